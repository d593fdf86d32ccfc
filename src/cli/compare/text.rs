//! Text output of `embrasure compare`.

use super::{CHANNELS, Comparison, Outcome, heavy_tails, left_out, scale_name};
use crate::cli::printing::number;
use crate::compare::Scale;
use crate::film::Rect;

impl Comparison<'_> {
    /// Prints the result of the comparison as text.
    pub fn print(&self) {
        let (pair, errors) = (self.pair, &self.errors);
        let size = pair.window.size();
        outln!(
            "{} against {}",
            self.args.image.display(),
            self.args.reference.display()
        );
        let part = if [size.x, size.y] == pair.resolution {
            String::new()
        } else {
            let (from, full) = (pair.window.min, pair.resolution);
            format!(
                " from {},{} on, common to both images of {}x{}",
                from.x, from.y, full[0], full[1]
            )
        };
        let values = if pair.is_display {
            "display values decoded by the sRGB curve, clamped to [0, 1]"
        } else {
            "linear values"
        };
        outln!("  {}x{} pixels{part}; {values}", size.x, size.y);
        if pair.not_finite != [0; 2] {
            let [reference, image] = pair.not_finite;
            outln!(
                "  not finite: {reference} pixels of the reference, {image} of the image; these pixels count as black in both"
            );
        }
        let row = |name: &str, values: [f64; 3], show: &dyn Fn(f64) -> String| {
            let cells: Vec<String> = values.iter().map(|v| format!("{:>12}", show(*v))).collect();
            outln!("  {name:<17}{}", cells.concat());
        };
        outln!("  {:<17}{:>12}{:>12}{:>12}", "", "red", "green", "blue");
        row("mean, reference", errors.reference_mean, &|v| format!("{v:.6}"));
        row("mean, image", errors.mean, &|v| format!("{v:.6}"));
        row("bias", errors.bias(), &|v| format!("{v:+.6}"));
        row("bias, %", errors.relative_bias(), &percent);
        outln!("  MSE     {}", number(errors.mse));
        outln!(
            "  relMSE  {:<12.6}mean of (x - ref)² / (ref² + 0.01), without the worst 0.1 % of the pixels",
            errors.rel_mse
        );
        let blocks: Vec<String> = errors.block_rel_mse.iter().map(|error| number(*error)).collect();
        outln!(
            "  blocks  {}: relMSE of the means of 4x4, 16x16 and 64x64 pixels, which no denoiser reduces",
            blocks.join(", ")
        );
        outln!(
            "  PSNR    {:<12}of sRGB values in [0, 1]; the peak is 1",
            decibels(errors.psnr())
        );
        outln!(
            "  levels  {:<12.2}largest difference of a channel, of 255 levels of sRGB",
            self.levels
        );
        outln!("  FLIP    {:<12.6}{}", self.flip.mean, self.flip_words());
        self.print_result();
        for line in self.biased() {
            outln!("  {line}");
        }
        for (flag, value, limit) in self.limits() {
            let word = if value > limit { "above" } else { "within" };
            outln!("  limit: {value:.6} is {word} --{flag} {limit}");
        }
    }

    /// Messages about images whose mean is biased.
    fn biased(&self) -> impl Iterator<Item = String> {
        let pictures = [
            (&self.args.reference, &self.pair.reference),
            (&self.args.image, &self.pair.image),
        ];
        pictures.into_iter().filter_map(|(path, picture)| {
            let bias = picture.bias.as_ref()?;
            Some(format!(
                "{} is biased by {bias}: a difference may be this bias and not an error",
                path.display()
            ))
        })
    }

    fn flip_words(&self) -> String {
        match self.flip.exposures {
            None => "mean LDR-FLIP; 0: no visible difference, 1: the maximum".into(),
            Some(e) => format!(
                "mean HDR-FLIP of {} exposures from {:+.2} to {:+.2} stops; 0: no visible difference, 1: the maximum",
                e.count, e.start, e.stop
            ),
        }
    }

    /// Approximate number of rare samples that cause nearly all noise. `None` if this number is
    /// large enough for all tests.
    fn rare(&self) -> Option<f64> {
        self.significance.as_ref().and_then(|significance| significance.rare)
    }

    fn print_result(&self) {
        let level = self.args.significance;
        if let (Outcome::Unknown, Some(rare)) = (self.outcome, self.rare()) {
            outln!("  result: {}: {}", self.outcome.words(), heavy_tails(rare));
            return;
        }
        let Some(significance) = self
            .significance
            .as_ref()
            .filter(|significance| !significance.extremes.is_empty())
        else {
            let why = match (self.outcome, self.pair.noisy()) {
                (Outcome::Unknown, None) => ": one of the images has no variance channels (variance.R, .G, .B)",
                (Outcome::Unknown, Some(_)) => {
                    ": too few samples or pixels; take at least 2 samples per pixel, and with photon-map and irradiance-cache at least 160x160 pixels"
                }
                (Outcome::Differs, None) if self.pair.is_display && self.pair.not_finite == [0; 2] => {
                    ": a channel differs by more than 1 level of 255; --tolerance sets another limit"
                }
                _ => "",
            };
            outln!("  result: {}{why}", self.outcome.words());
            return;
        };
        outln!(
            "  {:<8}{:>9}  {:<18}{:<8}{:>12}{:>12}{:>10}{:>9}{:>10}",
            "tests of",
            "tests",
            "furthest off",
            "",
            "reference",
            "image",
            "%",
            "score",
            "p"
        );
        for e in &significance.extremes {
            outln!(
                "  {:<8}{:>9}  {:<18}{:<8}{:>12.6}{:>12.6}{:>10}{:>+9.2}{:>10}",
                scale_name(e.scale),
                e.tests,
                place(e.window),
                CHANNELS[e.channel.min(2)],
                e.reference,
                e.image,
                percent(e.difference),
                e.score,
                chance(e.p)
            );
        }
        if let Some(words) = left_out(significance) {
            outln!("  {words}");
        }
        if self.pair.is_denoised() {
            outln!("  the tests compare the light before the denoiser (raw.R, raw.G, raw.B)");
        }
        let p = format!("p = {} over all tests, significance {level}", chance(significance.p));
        match (self.outcome, significance.worst()) {
            (Outcome::Differs, Some(e)) if significance.differs() => {
                let (window, channel) = (place_of_test(e.scale, e.window), CHANNELS[e.channel.min(2)]);
                let by = if e.difference.is_finite() {
                    format!("{} %", percent(e.difference))
                } else {
                    format!("{:+.6}", e.image - e.reference)
                };
                outln!("  result: differs by {by} in {channel}, in {window} ({p})");
            }
            (Outcome::Differs, _) => outln!("  result: differs: some values are not finite"),
            (outcome, _) => outln!("  result: {} ({p})", outcome.words()),
        }
    }
}

/// Text for the window of a test, with the name of its scale.
fn place_of_test(scale: Scale, window: Rect) -> String {
    let (at, size) = (window.min, window.size());
    match scale {
        Scale::Whole => "the whole picture".into(),
        Scale::Pixel => format!("pixel {},{}", at.x, at.y),
        Scale::Tile | Scale::Region => {
            let name = scale_name(scale);
            format!("the {name} of {}x{} pixels at {},{}", size.x, size.y, at.x, at.y)
        }
    }
}

/// Text for a window: the first corner, and the size if the window is larger than a pixel.
fn place(window: Rect) -> String {
    let (at, size) = (window.min, window.size());
    if window.area() == 1 {
        format!("{},{}", at.x, at.y)
    } else {
        format!("{},{} ({}x{})", at.x, at.y, size.x, size.y)
    }
}

/// The fraction `share` in percent. The text is `0` if there is no difference. It is `-` if the
/// fraction is not finite, because the reference is 0.
fn percent(share: f64) -> String {
    if share == 0.0 {
        "0".into()
    } else if share.is_finite() {
        format!("{:+.3}", 100.0 * share)
    } else {
        "-".into()
    }
}

/// A probability with three significant digits.
fn chance(p: f64) -> String {
    if p < 1e-3 {
        format!("{p:.1e}")
    } else {
        format!("{p:.3}")
    }
}

fn decibels(psnr: f64) -> String {
    if psnr.is_finite() {
        format!("{psnr:.2} dB")
    } else {
        "no error".into()
    }
}
