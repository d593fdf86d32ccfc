//! `embrasure compare`: measures the difference between an image and a reference, and tests whether
//! the difference exceeds the noise of both.

mod json;
mod map;
mod pair;
mod text;

use super::args::CompareArgs;
use super::error::CliError;
use super::outputs::Outputs;
use crate::color::srgb;
use crate::compare::{CommonErrors, Errors, Flip, MIN_RARE, Scale, Significance, SizeMismatch};
use crate::files::Output;
use crate::film::RgbImage;
use crate::io::{Format, Rendering};
use crate::session::Error;
use pair::Pair;
use std::path::Path;
use std::process::ExitCode;

/// Prints the difference between the image and the reference. The exit code is 1 if the image
/// differs or exceeds a limit.
pub(super) fn compare(args: &CompareArgs) -> Result<ExitCode, CliError> {
    let mut outputs = Outputs::default();
    let output = args.output.as_deref();
    let output = output.map(|path| prepare(path, &mut outputs)).transpose()?;
    outputs.refuse_inputs([&*args.reference, &*args.image])?;
    for (flag, limit) in [
        ("--tolerance", args.tolerance),
        ("--max-relmse", args.max_relmse),
        ("--max-flip", args.max_flip),
    ] {
        if let Some(limit) = limit.filter(|limit| limit.is_nan() || *limit < 0.0) {
            return Err(CliError::Usage(format!(
                "{flag} {limit}\n  help: use a number, 0 or more"
            )));
        }
    }
    let pair = Pair::read(&args.reference, &args.image)?;
    let comparison = Comparison::new(args, &pair).map_err(|e| CliError::Failed(e.to_string()))?;
    // Print the result first, because writing the picture may fail.
    if args.json {
        outln!("{:#}", comparison.json());
    } else if !args.quiet {
        comparison.print();
    }
    if let Some(output) = output {
        let figure = map::draw(args.map, &pair, &comparison)?;
        figure.write(&output)?;
        if !args.json && !args.quiet {
            outln!("  {}: {}", output.path().display(), figure.legend);
        }
    }
    Ok(ExitCode::from(u8::from(comparison.fails())))
}

/// Returns the output of `embrasure compare --json` for two pictures. `reference` and `image` are
/// their names. `significance` is the probability of a false alarm.
///
/// # Errors
///
/// Pictures of different sizes or without common pixels.
pub fn compared(
    (reference, image): (&Path, &Path),
    pictures: (Rendering, Rendering),
    significance: f64,
) -> Result<serde_json::Value, Error> {
    let args = CompareArgs::of(reference, image, significance);
    let pair = Pair::new((reference, pictures.0), (image, pictures.1))?;
    let comparison = Comparison::new(&args, &pair).map_err(|e| Error::Failed(e.to_string()))?;
    Ok(comparison.json())
}

/// Checks the path of the picture, and adds it to `outputs`.
fn prepare(path: &Path, outputs: &mut Outputs) -> Result<Output, CliError> {
    match Format::of_path(path) {
        Ok(Format::Png(_)) => outputs.prepare("-o", path),
        _ => {
            let path = path.display();
            let message =
                format!("-o {path}: the picture of a difference is a PNG\n  help: use a name that ends in .png");
            Err(CliError::Usage(message))
        }
    }
}

/// Maximum difference of a channel between display pictures that count as equal, in levels of 255.
/// It allows for rounding errors.
const TOLERANCE: f64 = 1.0;

/// Largest difference of a channel of a pixel. The unit is one of the 255 levels of 8-bit sRGB.
fn max_levels(reference: &RgbImage, image: &RgbImage) -> f64 {
    let pairs = reference.pixels.iter().flatten().zip(image.pixels.iter().flatten());
    let difference = |(a, b): (&f32, &f32)| f64::from((srgb::encode(*a) - srgb::encode(*b)).abs());
    // Round to 1/1000 level, which removes the rounding errors of decoding and encoding.
    (255e3 * pairs.map(difference).fold(0.0, f64::max)).round() / 1e3
}

/// Verdict of a comparison of two images.
#[derive(Clone, Copy, PartialEq)]
enum Outcome {
    Identical,
    Equal,
    /// No channel differs by more than [`TOLERANCE`].
    Alike,
    Differs,
    /// Too little is known about the noise for a test.
    Unknown,
}

impl Outcome {
    fn words(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Equal => "equal within noise",
            Self::Alike => "equal within tolerance",
            Self::Differs => "differs",
            Self::Unknown => "not tested",
        }
    }
}

/// Measured errors and test results of a comparison.
struct Comparison<'a> {
    args: &'a CompareArgs,
    pair: &'a Pair,
    errors: Errors,
    flip: Flip,
    /// Largest difference of a channel of a pixel. The unit is one of the 255 levels of 8-bit sRGB.
    levels: f64,
    significance: Option<Significance>,
    outcome: Outcome,
}

impl<'a> Comparison<'a> {
    fn new(args: &'a CompareArgs, pair: &'a Pair) -> Result<Self, SizeMismatch> {
        let (reference, image) = (&pair.reference.image, &pair.image.image);
        let significance = pair
            .noisy()
            .and_then(|[reference, image]| Significance::new(pair.window, reference, image, args.significance));
        let levels = max_levels(reference, image);
        let outcome = match &significance {
            _ if pair.not_finite != [0; 2] => Outcome::Differs,
            _ if pair.is_identical => Outcome::Identical,
            None if pair.is_display && levels > TOLERANCE => Outcome::Differs,
            None if pair.is_display => Outcome::Alike,
            None => Outcome::Unknown,
            Some(significance) if significance.differs() => Outcome::Differs,
            Some(significance) if significance.extremes.is_empty() => Outcome::Unknown,
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
            levels,
            significance,
            outcome,
        })
    }

    /// Limits given by flags: name of the flag, measured value, limit.
    fn limits(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let limits = [
            ("tolerance", self.levels, self.args.tolerance),
            ("max-relmse", self.errors.rel_mse, self.args.max_relmse),
            ("max-flip", self.flip.mean, self.args.max_flip),
        ];
        limits
            .into_iter()
            .filter_map(|(flag, value, limit)| Some((flag, value, limit?)))
    }

    /// Returns true if the exit code must be 1.
    fn fails(&self) -> bool {
        if self.limits().next().is_none() {
            return self.outcome == Outcome::Differs;
        }
        self.pair.not_finite != [0; 2] || self.limits().any(|(_, value, limit)| value > limit)
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

/// Reason why a comparison has no tests: about `rare` rare samples cause nearly all noise.
fn heavy_tails(rare: f64) -> String {
    format!(
        "about {rare:.0} rare samples cause nearly all noise (heavy tails), but the test needs {MIN_RARE}; take more samples per pixel"
    )
}

/// Text that names the tests left out and the reason; `None` if no test was left out.
fn left_out(significance: &Significance) -> Option<String> {
    match significance.common {
        _ if significance.extremes.is_empty() => significance.rare.map(heavy_tails),
        CommonErrors::None | CommonErrors::Tile => significance.rare.map(|rare| {
            format!(
                "left out: tests of pixels, tiles and regions, because about {rare:.0} rare samples cause nearly all noise (heavy tails), and most tiles have none of these samples"
            )
        }),
        CommonErrors::Sample => Some(
            "left out: tests of regions, because the pixels of one sample have errors in common; the tests of tiles and of the whole picture are weaker for the same reason; to find more, compare means of several seeds"
                .into(),
        ),
        CommonErrors::Picture => Some(
            "left out: tests of pixels, tiles and regions, because all samples use the same photons or irradiance records, whose errors are not in the variance; to find more, compare means of several seeds"
                .into(),
        ),
    }
}
