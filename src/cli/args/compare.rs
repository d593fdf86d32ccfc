//! Arguments of `embrasure compare`.

use super::flags::NameParser;
use super::values::parse_chance;
use crate::options::names::named;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Images are .exr, or PNG and the like, which are decoded by the sRGB curve. Where both have `variance` channels, as this program
writes them, a verdict says whether they differ by more than their noise. Of pssmlt, mlt, sppm, photon-map and irradiance-cache less is
tested, since their errors reach over many pixels: the output says what is left out (docs/guide/reference/compare.md). The exit code is 1 where they do, where a value is not
finite, or where a limit is passed; with limits these alone decide.
Examples:
  embrasure compare reference.exr image.exr
  embrasure compare reference.exr image.exr -o difference.png
  embrasure compare reference.png image.png --max-flip 0.02 --json")]
pub(in crate::cli) struct CompareArgs {
    /// The image that is held to be right
    pub reference: PathBuf,

    /// The image to judge
    pub image: PathBuf,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Chance of a false alarm that the verdict may have, over all its tests
    #[arg(long, value_name = "P", value_parser = parse_chance, default_value = "0.01")]
    pub significance: f64,

    /// Fail where relMSE is above this
    #[arg(long, value_name = "X")]
    pub max_relmse: Option<f64>,

    /// Fail where mean FLIP is above this
    #[arg(long, value_name = "X")]
    pub max_flip: Option<f64>,

    /// Write a picture of the difference here, .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// What it shows: error (relative difference of luminance), flip, or z (difference over its standard deviation)
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Map>::new(), default_value = "error", requires = "output")]
    pub map: Map,
}

/// What a picture of a difference shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) enum Map {
    Error,
    Flip,
    Scores,
}

named! {
    Map: "error" => Self::Error, "flip" => Self::Flip, "z" => Self::Scores;
}
