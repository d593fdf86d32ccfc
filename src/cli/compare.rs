//! `embrasure compare`: how far an image is from a reference, and whether by more than their noise.

use super::args::{CompareArgs, Map};
use super::error::CliError;
use super::outputs::Outputs;
use crate::color::{Spectrum, false_color};
use crate::compare::{
    CommonErrors, Errors, Extreme, Flip, MIN_RARE, Noise, Scale, Significance, SizeMismatch, pixel_scores,
};
use crate::film::{Rect, RgbImage};
use crate::io::{Figure, FileError, Format, Output, Rendering, read_rendering};
use crate::options::name_of;
use serde_json::{Value, json};
use std::path::Path;
use std::process::ExitCode;

/// Prints how far the image is from the reference. The exit code is 1 where it differs, or is beyond a limit.
pub(super) fn compare(args: &CompareArgs) -> Result<ExitCode, CliError> {
    let output = args.output.as_deref().map(output).transpose()?;
    let mut outputs = Outputs::default();
    output.iter().try_for_each(|output| outputs.add("-o", output))?;
    outputs.spare([&*args.reference, &*args.image])?;
    let map = args.map;
    for (flag, limit) in [("--max-relmse", args.max_relmse), ("--max-flip", args.max_flip)] {
        if let Some(limit) = limit.filter(|limit| limit.is_nan() || *limit < 0.0) {
            return Err(CliError::Usage(format!(
                "{flag} {limit}\n  help: use a number, 0 or more"
            )));
        }
    }
    let pair = Pair::read(&args.reference, &args.image)?;
    let comparison = Comparison::new(args, &pair).map_err(|e| CliError::Failed(e.to_string()))?;
    // What a person would look at is there even where the picture of it cannot be written.
    if args.json {
        outln!("{:#}", comparison.json());
    } else {
        comparison.print();
    }
    if let Some(output) = output {
        let figure = map.draw(&pair, &comparison)?;
        figure.write(&output)?;
        if !args.json {
            outln!("  {}: {}", output.path().display(), figure.legend);
        }
    }
    Ok(ExitCode::from(u8::from(comparison.fails())))
}

/// Where the picture goes.
fn output(path: &Path) -> Result<Output, CliError> {
    match Format::of_path(path) {
        Ok(Format::Png(_)) => Ok(Output::prepare(path)?),
        _ => {
            let path = path.display();
            let message =
                format!("-o {path}: the picture of a difference is a PNG\n  help: use a name that ends in .png");
            Err(CliError::Usage(message))
        }
    }
}

/// Both images, cut to the pixels that both have, with black for values that are none.
struct Pair {
    window: Rect,
    resolution: [u32; 2],
    reference: Rendering,
    image: Rendering,
    /// Pixels with values that are not finite, of the reference and the image.
    not_finite: [usize; 2],
    /// Whether the pixels are the same to the bit.
    is_identical: bool,
    /// Whether values are those that a display can show.
    is_display: bool,
}

impl Pair {
    fn read(reference: &Path, image: &Path) -> Result<Self, CliError> {
        let [mut first, mut second] = [read_rendering(reference)?, read_rendering(image)?];
        let [a, b] = [first.resolution, second.resolution];
        if a != b {
            let message = format!(
                "has {}x{} pixels, but {} has {}x{}",
                b.x,
                b.y,
                reference.display(),
                a.x,
                a.y
            );
            let help = "compare images of one size; of a crop the EXR keeps the full image's window";
            return Err(FileError::new(image, message).help(help).into());
        }
        let window = first.window.intersection(second.window);
        if window.area() == 0 {
            let message = format!("has no pixel in common with {}", reference.display());
            return Err(FileError::new(image, message).help("compare crops that overlap").into());
        }
        let is_display = first.is_display || second.is_display;
        for rendering in [&mut first, &mut second] {
            if rendering.window != window {
                *rendering = rendering.cropped(window);
            }
        }
        let bits = |image: &RgbImage| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
        let is_identical = bits(&first.image) == bits(&second.image);
        let mut not_finite = [0; 2];
        let (pixels, others) = (&mut first.image.pixels, &mut second.image.pixels);
        for (a, b) in pixels.iter_mut().zip(others) {
            let wrong = [&*a, &*b].map(|p| !p.iter().all(|v| v.is_finite()));
            (0..2).for_each(|i| not_finite[i] += usize::from(wrong[i]));
            if wrong != [false; 2] {
                (*a, *b) = ([0.0; 3], [0.0; 3]);
            }
            if is_display {
                (*a, *b) = (a.map(|v| v.clamp(0.0, 1.0)), b.map(|v| v.clamp(0.0, 1.0)));
            }
        }
        Ok(Self {
            window,
            resolution: [a.x, a.y],
            reference: first,
            image: second,
            not_finite,
            is_identical,
            is_display,
        })
    }

    /// The images with their noise, where both are known.
    fn noisy(&self) -> Option<[(&RgbImage, &Noise); 2]> {
        let (reference, image) = (&self.reference, &self.image);
        Some([
            (&reference.image, reference.noise.as_ref()?),
            (&image.image, image.noise.as_ref()?),
        ])
    }
}

/// What is said of the pair as a whole.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Identical,
    Equal,
    Differs,
    /// Nothing is known of the noise.
    Unknown,
}

impl Outcome {
    fn words(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Equal => "equal within noise",
            Self::Differs => "differs",
            Self::Unknown => "no verdict",
        }
    }
}

/// What was found.
struct Comparison<'a> {
    args: &'a CompareArgs,
    pair: &'a Pair,
    errors: Errors,
    flip: Flip,
    verdict: Option<Significance>,
    outcome: Outcome,
}

impl<'a> Comparison<'a> {
    fn new(args: &'a CompareArgs, pair: &'a Pair) -> Result<Self, SizeMismatch> {
        let (reference, image) = (&pair.reference.image, &pair.image.image);
        let verdict = pair
            .noisy()
            .and_then(|[reference, image]| Significance::new(pair.window, reference, image, args.significance));
        let outcome = match &verdict {
            _ if pair.not_finite != [0; 2] => Outcome::Differs,
            _ if pair.is_identical => Outcome::Identical,
            None => Outcome::Unknown,
            Some(verdict) if verdict.differs() => Outcome::Differs,
            Some(verdict) if verdict.extremes.is_empty() => Outcome::Unknown,
            Some(_) => Outcome::Equal,
        };
        Ok(Self {
            args,
            pair,
            errors: Errors::new(image, reference)?,
            flip: if pair.is_display {
                Flip::ldr(image, reference)?
            } else {
                Flip::hdr(image, reference)?
            },
            verdict,
            outcome,
        })
    }

    /// Limits that were given: flag, measured, limit.
    fn limits(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let limits = [
            ("max-relmse", self.errors.rel_mse, self.args.max_relmse),
            ("max-flip", self.flip.mean, self.args.max_flip),
        ];
        limits
            .into_iter()
            .filter_map(|(flag, value, limit)| Some((flag, value, limit?)))
    }

    /// Whether the exit code is to say so.
    fn fails(&self) -> bool {
        if self.limits().next().is_none() {
            return self.outcome == Outcome::Differs;
        }
        self.pair.not_finite != [0; 2] || self.limits().any(|(_, value, limit)| value > limit)
    }

    fn print(&self) {
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
                " from {},{} on, which both have of {}x{}",
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
                "  not finite: {reference} pixels of the reference, {image} of the image; they count as black in both"
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
        row("bias, %", errors.relative_bias(), &|v| format!("{:+.3}", 100.0 * v));
        outln!("  MSE     {:.6e}", errors.mse);
        outln!(
            "  relMSE  {:<12.6}mean of (x - ref)² / (ref² + 0.01), without the worst 0.1 % of the pixels",
            errors.rel_mse
        );
        outln!(
            "  PSNR    {:<12}of sRGB values in [0, 1]; the peak is 1",
            decibels(errors.psnr())
        );
        outln!("  FLIP    {:<12.6}{}", self.flip.mean, self.flip_words());
        self.print_verdict();
        for line in self.biased() {
            outln!("  {line}");
        }
        for (flag, value, limit) in self.limits() {
            let word = if value > limit { "above" } else { "within" };
            outln!("  limit: {value:.6} is {word} --{flag} {limit}");
        }
    }

    /// That the mean of a picture is not that of all light, of each of both.
    fn biased(&self) -> impl Iterator<Item = String> {
        let pictures = [
            (&self.args.reference, &self.pair.reference),
            (&self.args.image, &self.pair.image),
        ];
        pictures.into_iter().filter_map(|(path, picture)| {
            let bias = picture.bias.as_ref()?;
            Some(format!(
                "{} is biased by {bias}: a difference may be that bias, and no sign of an error",
                path.display()
            ))
        })
    }

    fn flip_words(&self) -> String {
        match self.flip.exposures {
            None => "LDR-FLIP, mean; 0 looks alike, 1 is the most".into(),
            Some(e) => format!(
                "HDR-FLIP, mean, of {} exposures from {:+.2} to {:+.2} stops; 0 looks alike, 1 is the most",
                e.count, e.start, e.stop
            ),
        }
    }

    /// About how many rare samples the noise consists of, where that limits what is tested.
    fn rare(&self) -> Option<f64> {
        self.verdict.as_ref().and_then(|verdict| verdict.rare)
    }

    fn print_verdict(&self) {
        let level = self.args.significance;
        if let (Outcome::Unknown, Some(rare)) = (self.outcome, self.rare()) {
            outln!("  verdict: {}: {}", self.outcome.words(), heavy_tails(rare));
            return;
        }
        let Some(verdict) = self.verdict.as_ref().filter(|verdict| !verdict.extremes.is_empty()) else {
            let why = match (self.outcome, self.pair.noisy()) {
                (Outcome::Unknown, None) => ": one of them says nothing of its noise (variance.R, .G, .B)",
                (Outcome::Unknown, Some(_)) => {
                    ": what they say of their noise is not enough; take 2 samples a pixel or more, and of photon-map and irradiance-cache 160x160 pixels or more"
                }
                _ => "",
            };
            outln!("  verdict: {}{why}", self.outcome.words());
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
        for e in &verdict.extremes {
            outln!(
                "  {:<8}{:>9}  {:<18}{:<8}{:>12.6}{:>12.6}{:>+10.3}{:>+9.2}{:>10}",
                scale_name(e.scale),
                e.tests,
                place(e.window),
                CHANNELS[e.channel.min(2)],
                e.reference,
                e.image,
                100.0 * e.difference,
                e.score,
                chance(e.p)
            );
        }
        if let Some(words) = left_out(verdict) {
            outln!("  {words}");
        }
        let p = format!("p = {} over all tests, significance {level}", chance(verdict.p));
        match (self.outcome, verdict.worst()) {
            (Outcome::Differs, Some(e)) if verdict.differs() => {
                let (what, channel) = (place(e.window), CHANNELS[e.channel.min(2)]);
                let percent = 100.0 * e.difference;
                outln!(
                    "  verdict: differs by {percent:+.3} % in {channel}, here: {} {what} ({p})",
                    scale_name(e.scale)
                );
            }
            (Outcome::Differs, _) => outln!("  verdict: differs: there are values that are not finite"),
            (outcome, _) => outln!("  verdict: {} ({p})", outcome.words()),
        }
    }

    fn json(&self) -> Value {
        let (pair, errors, args) = (self.pair, &self.errors, self.args);
        let verdict = self.verdict.as_ref().map(|verdict| {
            json!({
                "significance": verdict.level,
                "p": verdict.p,
                "differs": verdict.differs(),
                "tests": verdict.extremes.iter().map(extreme_json).collect::<Vec<_>>(),
                "worst": verdict.worst().map(extreme_json),
                "common_errors": name_of(CommonErrors::NAMES, verdict.common),
                "rare_samples": verdict.rare,
                "left_out": left_out(verdict),
            })
        });
        let limits = self.limits().map(|(flag, value, limit)| {
            (
                flag.replace('-', "_"),
                json!({ "limit": limit, "value": value, "passed": value <= limit }),
            )
        });
        json!({
            "reference": args.reference.display().to_string(),
            "image": args.image.display().to_string(),
            "resolution": pair.resolution,
            "window": corners(pair.window),
            "display_values": pair.is_display,
            "not_finite": { "reference": pair.not_finite[0], "image": pair.not_finite[1] },
            "reference_mean": errors.reference_mean,
            "mean": errors.mean,
            "bias": errors.bias(),
            "relative_bias": errors.relative_bias(),
            "mse": errors.mse,
            "rel_mse": errors.rel_mse,
            "psnr_db": errors.psnr(),
            "flip": {
                "mean": self.flip.mean,
                "exposures": self.flip.exposures.map(|e| json!({ "start": e.start, "stop": e.stop, "count": e.count })),
            },
            "outcome": self.outcome.words(),
            "biased_by": { "reference": pair.reference.bias, "image": pair.image.bias },
            "verdict": verdict,
            "limits": limits.collect::<serde_json::Map<String, Value>>(),
            "failed": self.fails(),
        })
    }
}

const CHANNELS: [&str; 3] = ["red", "green", "blue"];

fn scale_name(scale: Scale) -> &'static str {
    match scale {
        Scale::Pixel => "pixel",
        Scale::Tile => "tile",
        Scale::Region => "region",
        Scale::Whole => "whole",
    }
}

/// Why there is no verdict on pictures whose noise consists of so few samples.
fn heavy_tails(rare: f64) -> String {
    format!(
        "heavy tails: not testable at this count; nearly all noise is that of about {rare:.0} rare samples, {MIN_RARE} at least are needed; take more samples a pixel"
    )
}

/// What is not tested, and why.
fn left_out(verdict: &Significance) -> Option<String> {
    match verdict.common {
        _ if verdict.extremes.is_empty() => verdict.rare.map(heavy_tails),
        CommonErrors::None | CommonErrors::Tile => verdict.rare.map(|rare| {
            format!(
                "left out: pixels, tiles and regions; heavy tails: nearly all noise is that of about {rare:.0} rare samples, which most tiles have not seen"
            )
        }),
        CommonErrors::Sample => Some(
            "left out: regions; pixels of one sample have errors in common, so tiles and the whole are judged more mildly; \
             means of several seeds tell more"
                .into(),
        ),
        CommonErrors::Picture => Some(
            "left out: pixels, tiles and regions; all samples look at the same photons or records, whose errors are in no variance; \
             means of several seeds tell more"
                .into(),
        ),
    }
}

/// First corner and, of more than a pixel, the size.
fn place(window: Rect) -> String {
    let (at, size) = (window.min, window.size());
    if window.area() == 1 {
        format!("{},{}", at.x, at.y)
    } else {
        format!("{},{} ({}x{})", at.x, at.y, size.x, size.y)
    }
}

fn corners(window: Rect) -> [u32; 4] {
    [window.min.x, window.min.y, window.max.x, window.max.y]
}

/// A chance, to three digits that matter.
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

fn extreme_json(e: &Extreme) -> Value {
    json!({
        "scale": scale_name(e.scale),
        "tests": e.tests,
        "window": corners(e.window),
        "channel": CHANNELS[e.channel.min(2)],
        "reference": e.reference,
        "image": e.image,
        "difference": e.difference,
        "score": e.score,
        "p": e.p,
    })
}

impl Map {
    fn draw(self, pair: &Pair, comparison: &Comparison) -> Result<Figure, CliError> {
        let size = pair.window.size();
        let figure = |pixels, legend| Figure {
            size: [size.x, size.y],
            pixels,
            legend,
        };
        let diverging = |values: &[f32], range: f32| values.iter().map(|v| false_color::diverging(v / range)).collect();
        match self {
            Self::Flip => {
                let pixels = comparison.flip.map.iter().map(|e| false_color::magma(*e)).collect();
                Ok(figure(pixels, "FLIP, black 0 to pale yellow 1".into()))
            }
            Self::Error => {
                let values = relative_differences(&pair.image.image, &pair.reference.image);
                let range = round_range(&values);
                let percent = 100.0 * range;
                let legend = format!(
                    "(Y - Yref) / (Yref² + 0.01)^(1/2) of luminance, blue -{percent} % over grey 0 to red +{percent} %"
                );
                Ok(figure(diverging(&values, range), legend))
            }
            Self::Scores => {
                let scores = pair
                    .noisy()
                    .and_then(|[reference, image]| pixel_scores(pair.window, reference, image));
                let Some(scores) = scores else {
                    let message =
                        "--map z: one of the images says nothing of its noise\n  help: use --map error or flip";
                    return Err(CliError::Failed(message.into()));
                };
                const RANGE: f32 = 6.0;
                let legend = "difference over its standard deviation, of the channel where that is largest, blue -6 over grey 0 to red +6";
                Ok(figure(diverging(&scores, RANGE), legend.into()))
            }
        }
    }
}

/// Signed, of luminance, in the measure of relMSE.
fn relative_differences(image: &RgbImage, reference: &RgbImage) -> Vec<f32> {
    let luminance = |p: &[f32; 3]| Spectrum::from(*p).luminance();
    let pairs = image.pixels.iter().zip(&reference.pixels);
    let difference = |(x, r): (f32, f32)| (x - r) / (r * r + 0.01).sqrt();
    pairs.map(|(x, r)| difference((luminance(x), luminance(r)))).collect()
}

/// The next of 1, 2, 5, 10 … over the size of all values but the largest hundredth; 0.01 at least.
fn round_range(values: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).collect();
    sizes.sort_by(f32::total_cmp);
    let usual = sizes
        .get(sizes.len().saturating_sub(1) * 99 / 100)
        .copied()
        .unwrap_or(0.0);
    let steps = (0..).flat_map(|decade| [1.0, 2.0, 5.0].map(|step| step * 10f32.powi(decade - 2)));
    steps.take(60).find(|step| *step >= usual).unwrap_or(1.0)
}
