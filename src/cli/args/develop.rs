//! Arguments of `embrasure develop`.

use super::exr::ExrArgs;
use super::flags::{Flags, NameParser};
use super::values::{parse_list, parse_radius, parse_size};
use crate::options::{Denoising, DrawnLines, ToneOptions, Value};
use clap::Parser;
use std::fmt;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Without --exposure and --tone, the exposure and tone curve stored in the file apply.
Examples:
  embrasure develop room.exr -o room.png --exposure auto --tone agx
  embrasure develop room.exr --list
  embrasure develop room.exr --channel Z -o depth.png
  embrasure develop room.exr --matte 'Sofa*' -o sofa.png
  embrasure develop room.exr -o 'masks/{part}.png'
  embrasure develop cycles.exr --channel ViewLayer.Combined --denoise -o clean.exr -o clean.png
  embrasure develop sky.exr -o 'sky_{face}.png'
  embrasure develop room.exr --crop 100,50,300,200 --scale 2 -o detail.png")]
pub(in crate::cli) struct DevelopArgs {
    /// EXR file, from this program or another one
    pub input: PathBuf,

    /// Picture to write, .png (display, false colours) or .exr (linear); repeatable
    ///
    /// {face} in the name writes the faces of a cube map: right, left, up, down, front and back.
    /// {part}, {object} or {material} writes a mask for each of them (--matte selects some).
    #[arg(short, long, value_name = "FILE", required_unless_present = "list")]
    pub output: Vec<PathBuf>,

    /// Layer or channel to show, such as albedo, N, Z or light_key [default: the picture]
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,

    /// Mask of the names that match, from --aov cryptomatte
    ///
    /// GLOB selects parts, objects and materials by their names. They are white in the mask.
    /// LAYER:GLOB searches one layer, such as CryptoMaterial:wood.
    #[arg(long, value_name = "GLOB", conflicts_with_all = ["channel", "list", "denoise", "lines", "exposure", "tone"])]
    pub matte: Option<String>,

    /// List layers, channels and names of mattes, each with the flag that writes it
    #[arg(long, conflicts_with_all = ["output", "channel"])]
    pub list: bool,

    /// Print the list as JSON
    #[arg(long, requires = "list")]
    pub json: bool,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    /// Denoiser; without a name the best one built in [default: off]
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, value_parser = NameParser::<Denoising>::new())]
    pub denoise: Option<Option<Denoising>>,

    /// Standard deviation in pixels of the denoiser gaussian [default: 0.7]
    #[arg(long, value_name = "PIXELS", requires = "denoise", value_parser = parse_radius)]
    pub denoise_radius: Option<f32>,

    /// Colour of the lines of --aov lines, black without a value; off draws none [default: as
    /// the render]
    #[arg(long, value_name = "COLOUR", num_args = 0..=1, require_equals = true, value_parser = parse_lines)]
    pub lines: Option<Option<DrawnLines>>,

    /// Keep only these pixels; origin top left, X1 and Y1 excluded
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_list::<u32, 4>)]
    pub crop: Option<[u32; 4]>,

    /// Size of the result: a factor such as 0.5, or pixels such as 960x540
    #[arg(long, value_name = "FACTOR|WxH", value_parser = parse_scale)]
    pub scale: Option<Scale>,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Size of the result, as a factor or in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) enum Scale {
    Factor(f64),
    Size([u32; 2]),
}

impl fmt::Display for Scale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Factor(factor) => write!(f, "{factor}"),
            Self::Size([width, height]) => write!(f, "{width}x{height}"),
        }
    }
}

fn parse_lines(text: &str) -> Result<DrawnLines, String> {
    let lines = DrawnLines::of_text(text).filter(Value::is_finite);
    lines.ok_or_else(|| format!("{} is expected", DrawnLines::KIND))
}

fn parse_scale(text: &str) -> Result<Scale, String> {
    let factor = text.parse().ok().filter(|f: &f64| f.is_finite() && *f > 0.0);
    let scale = factor
        .map(Scale::Factor)
        .or_else(|| parse_size(text).ok().map(Scale::Size));
    scale.ok_or_else(|| "a factor above 0 such as 0.5, or a size in pixels such as 960x540, is expected".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_factors_or_sizes() {
        assert_eq!(parse_scale("0.5"), Ok(Scale::Factor(0.5)));
        assert_eq!(parse_scale("64x48"), Ok(Scale::Size([64, 48])));
        for wrong in ["0", "-1", "nan", "inf", "half", "3x", "1x2x3", ""] {
            assert!(parse_scale(wrong).is_err(), "{wrong}");
        }
    }
}
