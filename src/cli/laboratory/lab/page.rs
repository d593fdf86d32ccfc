//! A comparison as a single HTML page without links to other files, so that browsers show it from a
//! disk without a network.
//!
//! `page.html`, `page.css` and `page.js` are the page. Numbers are JSON in a script element, and
//! pictures are PNG files in base64. An error map is a grey PNG. A filter of the page turns the
//! grey values into colours, either by signed or by absolute error.

use super::Comparison;
use super::budget::Budget;
use super::contenders::Contender;
use super::curves::{self, Measure};
use super::runs::{ContenderRun, Snapshot};
use super::sheet::shown;
use crate::cli::plot::{self, SvgTarget};
use crate::cli::printing::count;
use crate::color::{false_color, srgb};
use crate::compare::relative_differences;
use crate::film::RgbImage;
use crate::io::png_bytes;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};
use std::io::{self, Write};

/// Maximum total number of pixels in the pictures of a page, so that browsers can show the page. If
/// the pictures have more pixels, blocks of pixels are averaged.
const MAX_PIXELS: usize = 8 << 20;
/// Number of colours of the error map palette.
const COLORS: usize = 65;

/// Writes the HTML page of `comparison`.
pub(super) fn write(writer: &mut impl Write, comparison: &Comparison) -> io::Result<()> {
    let data = data(comparison)?.to_string();
    let title = format!("Estimators compared: {}", comparison.scene);
    let curves = curves::svg(comparison, SvgTarget::Page);
    let values = [
        ("style", include_str!("page/page.css").trim_end()),
        ("script", include_str!("page/page.js").trim_end()),
        ("curves", curves.trim_end()),
        ("title", &plot::escaped(&title)),
        // Escape `<`, so that no tag in the data ends the script element.
        ("data", &data.replace('<', "\\u003c")),
    ];
    writer.write_all(filled(include_str!("page/page.html"), &values).as_bytes())
}

/// `template` with each `{{name}}` replaced by the value of `name`. Marks within values are not
/// replaced, because file names may contain such marks.
fn filled(template: &str, values: &[(&str, &str)]) -> String {
    let mut pieces = template.split("{{");
    let mut page = pieces.next().unwrap_or_default().to_string();
    for piece in pieces {
        let known = |name: &str| values.iter().find(|(known, _)| *known == name);
        let found = piece
            .split_once("}}")
            .and_then(|(name, rest)| Some((known(name)?.1, rest)));
        match found {
            Some((value, rest)) => page.extend([value, rest]),
            None => page.extend(["{{", piece]),
        }
    }
    page
}

/// Data for the script of the page, as JSON.
fn data(comparison: &Comparison) -> io::Result<Value> {
    let snapshots = comparison.rendered().map(|(_, run)| run.snapshots.len()).sum();
    let [width, height] = comparison.size;
    let pictures = Pictures {
        comparison,
        factor: factor(comparison.size, snapshots),
    };
    let measure = match comparison.budgets.first() {
        Some(Budget::Seconds(_)) => "seconds",
        _ => "samples",
    };
    let mut index = 0;
    let estimators: io::Result<Vec<Value>> = comparison
        .runs
        .iter()
        .map(|(contender, run)| {
            let color = (!run.snapshots.is_empty()).then(|| plot::color(index));
            index += usize::from(color.is_some());
            pictures.estimator(contender, run, color)
        })
        .collect();
    let reference = comparison.reference.as_ref().map(|reference| {
        let picture = pictures.picture(&reference.image)?;
        io::Result::Ok(json!({ "name": reference.name, "samples": reference.samples, "picture": picture }))
    });
    let warnings = comparison.verdict.faults.iter().map(|fault| fault.advice());
    let witness = comparison.verdict.witness.as_ref().map(|(image, iterations)| {
        let picture = pictures.picture(image)?;
        io::Result::Ok(json!({ "samples": iterations, "picture": picture }))
    });
    let signed = |share: f32| false_color::diverging(2.0 * share - 1.0);
    let magnitude = |share: f32| false_color::magma((2.0 * share - 1.0).abs());
    Ok(json!({
        "summary": pictures.summary(),
        "warnings": warnings.collect::<Vec<_>>(),
        "size": [width / pictures.factor, height / pictures.factor],
        "measure": measure,
        "estimators": estimators?,
        "reference": reference.transpose()?,
        "witness": witness.transpose()?,
        "palettes": { "signed": palette(signed), "magnitude": palette(magnitude) },
    }))
}

fn palette(color: impl Fn(f32) -> [u8; 3]) -> Vec<[u8; 3]> {
    (0..COLORS).map(|i| color(i as f32 / (COLORS - 1) as f32)).collect()
}

/// Side in pixels of the blocks to average, if a page has `pictures` pictures of the given size.
fn factor([width, height]: [usize; 2], pictures: usize) -> usize {
    let largest = width.min(height).max(1);
    let fits = |factor: &usize| (width / factor) * (height / factor) * pictures <= MAX_PIXELS;
    (1..largest).find(fits).unwrap_or(largest)
}

/// Encoder of the pictures of a page.
struct Pictures<'a> {
    comparison: &'a Comparison,
    /// Side of the pixel blocks that are averaged.
    factor: usize,
}

impl Pictures<'_> {
    /// Summary of the comparison in one line.
    fn summary(&self) -> String {
        let [width, height] = self.comparison.size;
        let estimators = count(self.comparison.runs.len() as u64, "estimator");
        let reference = match &self.comparison.reference {
            Some(reference) => format!("reference: {}", reference.lines().join(", ")),
            None => "without a reference, so errors are unknown".into(),
        };
        let averaged = match self.factor {
            1 => String::new(),
            n => format!("; each pixel shown is the mean of {n}×{n} pixels, but figures are of all pixels"),
        };
        format!(
            "{estimators} on {}, {width}×{height} pixels; {reference}{averaged}.",
            self.comparison.scene
        )
    }

    fn estimator(&self, contender: &Contender, run: &ContenderRun, color: Option<&str>) -> io::Result<Value> {
        let points: io::Result<Vec<Value>> = run.snapshots.iter().map(|snapshot| self.point(snapshot)).collect();
        let paper = contender.lesson.paper;
        Ok(json!({
            "name": contender.name,
            "sentence": contender.lesson.sentence,
            "paper": paper.map(|paper| json!({ "authors": paper.authors, "title": paper.title, "doi": paper.doi })),
            "color": color,
            "refused": contender.refusal(),
            "slope": Measure::in_words(&run.snapshots),
            "points": points?,
        }))
    }

    fn point(&self, snapshot: &Snapshot) -> io::Result<Value> {
        let error = self.comparison.reference.as_ref();
        let error = error.map(|reference| self.error_map(&snapshot.image, &reference.image));
        Ok(json!({
            "samples": snapshot.samples,
            "seconds": snapshot.seconds,
            "relmse": snapshot.rel_mse,
            "block_relmse": snapshot.block_rel_mse,
            "efficiency": snapshot.efficiency(),
            "is_budget": !snapshot.budgets.is_empty(),
            "picture": self.picture(&snapshot.image)?,
            "error": error.transpose()?,
        }))
    }

    /// PNG file of `image` with the tone of the comparison, in base64.
    fn picture(&self, image: &RgbImage) -> io::Result<String> {
        let image = shown(&image.averaged(self.factor, |v| v), &self.comparison.tone);
        let bytes: Vec<u8> = image
            .pixels
            .iter()
            .flat_map(|pixel| pixel.map(srgb::encode_u8))
            .collect();
        encoded(3, &image, &bytes)
    }

    /// PNG file of the relative error of luminance, in base64. The grey value is 127.5 + 127.5 ·
    /// sign(error) · √|error|. The value 0 means −100 % or less, and 255 means +100 % or more.
    fn error_map(&self, image: &RgbImage, reference: &RgbImage) -> io::Result<String> {
        let [image, reference] = [image, reference].map(|image| image.averaged(self.factor, |v| v));
        let code = |error: f32| 127.5 + 127.5 * error.signum() * error.abs().min(1.0).sqrt();
        let errors = relative_differences(&image, &reference).into_iter();
        let bytes: Vec<u8> = errors.map(|error| code(error).round() as u8).collect();
        encoded(1, &image, &bytes)
    }
}

/// A PNG file with `channels` channels and the size of `image`, in base64.
fn encoded(channels: usize, image: &RgbImage, bytes: &[u8]) -> io::Result<String> {
    let size = [image.width as u32, image.height as u32];
    Ok(STANDARD.encode(png_bytes(channels, size, bytes)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_of_many_pictures_has_smaller_pictures() {
        assert_eq!(factor([512, 512], 32), 1);
        assert_eq!(factor([512, 512], 33), 2);
        assert_eq!(factor([1920, 1080], 32), 3);
        assert_eq!((factor([1, 1], 1 << 24), factor([4, 1], 0)), (1, 1));
        let image = RgbImage {
            width: 3,
            height: 2,
            pixels: [1.0, 2.0, 9.0, 3.0, 6.0, 9.0].map(|v| [v, 0.0, -v]).into(),
        };
        let half = image.averaged(2, |v| v);
        assert_eq!((half.width, half.height, half.pixels), (1, 1, vec![[3.0, 0.0, -3.0]]));
        assert_eq!(image.averaged(1, |v| v), image);
    }

    #[test]
    fn marks_in_values_of_a_template_stay() {
        let values = [("title", "{{data}} {{title}}"), ("data", "{{title}}")];
        assert_eq!(
            filled("a{{title}}b {{ {{data}} {{other}} {{", &values),
            "a{{data}} {{title}}b {{ {{title}} {{other}} {{"
        );
        assert_eq!(filled("", &values), "");
    }

    #[test]
    fn palette_is_neutral_in_the_middle() {
        let middle = COLORS / 2;
        assert_eq!(
            palette(|share| false_color::diverging(2.0 * share - 1.0))[middle],
            [221; 3]
        );
        assert_eq!(
            palette(|share| false_color::magma((2.0 * share - 1.0).abs()))[middle],
            [0, 0, 4]
        );
    }
}
