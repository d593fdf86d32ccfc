//! Arguments of `embrasure compare`.

use super::flags::NameParser;
use super::values::parse_chance;
use crate::options::named;
use clap::Parser;
use std::path::{Path, PathBuf};

#[derive(Debug, Parser)]
#[command(after_help = "\
Images are EXR files, or PNG, JPEG, TIFF, WebP, GIF, TGA, BMP, DDS and HDR pictures. Pictures of 8
or 16 bits are decoded by the sRGB curve. If both images have `variance` channels, as EXR files of
this program have, a significance test decides whether the images differ by more than their noise.
Errors of pssmlt, mlt, sppm, photon-map and irradiance-cache spread over many pixels, so fewer tests
apply to these methods; the output names the tests that are left out. Pictures of 8 or 16 bits have
no variance: they differ if a channel of a pixel differs by more than --tolerance. The exit code is
1 if the images differ, if a value is not finite, or if a limit is exceeded. With --tolerance,
--max-relmse or --max-flip, only these limits decide.
Examples:
  embrasure compare reference.exr image.exr
  embrasure compare reference.exr image.exr -o difference.png
  embrasure compare reference.png image.png --tolerance 3
  embrasure compare reference.png image.png --max-flip 0.02 --json")]
pub(in crate::cli) struct CompareArgs {
    /// Reference image
    pub reference: PathBuf,

    /// Image to compare with it
    pub image: PathBuf,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Print nothing; the exit code is the result
    #[arg(short, long, conflicts_with = "json")]
    pub quiet: bool,

    /// Probability of a false alarm over all tests, 0 to 1
    #[arg(long, value_name = "P", value_parser = parse_chance, default_value = "0.01")]
    pub significance: f64,

    /// Maximum difference of a channel, in levels of 255 [default of PNG files: 1]
    #[arg(long, value_name = "LEVELS")]
    pub tolerance: Option<f64>,

    /// Maximum relMSE; above it the exit code is 1
    #[arg(long, value_name = "X")]
    pub max_relmse: Option<f64>,

    /// Maximum mean FLIP; above it the exit code is 1
    #[arg(long, value_name = "X")]
    pub max_flip: Option<f64>,

    /// Write a picture of the difference to this .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Content of the picture of the difference
    ///
    /// error: relative difference of luminance; flip: FLIP; z: difference divided by its standard
    /// deviation.
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Map>::new(), default_value = "error", requires = "output")]
    pub map: Map,
}

impl CompareArgs {
    /// Arguments for the comparison of `image` with `reference`, without limits and without a
    /// difference picture. `significance` is the probability of a false alarm.
    pub fn of(reference: &Path, image: &Path, significance: f64) -> Self {
        Self {
            reference: reference.into(),
            image: image.into(),
            json: true,
            quiet: false,
            significance,
            tolerance: None,
            max_relmse: None,
            max_flip: None,
            output: None,
            map: Map::Error,
        }
    }
}

/// Content of a difference picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) enum Map {
    Error,
    Flip,
    Scores,
}

named! {
    Map: "error" => Self::Error, "flip" => Self::Flip, "z" => Self::Scores;
}
