//! Arguments of `embrasure explain`.

use super::load::LoadArgs;
use super::values::parse_size;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure explain scenes/cornell-box.toml red
  embrasure explain room.obj \"Window Glass\" -o glass.png --size 256x256
  embrasure explain scenes/spheres.toml brass --plots -o brass.svg")]
pub(in crate::cli) struct ExplainArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Name of a material in the scene
    pub material: String,

    /// File to write: .exr or .png (sphere), .svg (polar plots of lobes); repeatable
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Draw polar plots in the terminal; with --json, print their numbers
    #[arg(long)]
    pub plots: bool,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Samples per pixel of the sphere
    #[arg(long, value_name = "N", default_value = "64")]
    pub spp: std::num::NonZeroU32,

    /// Size of the sphere's image in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "512x512")]
    pub size: [u32; 2],

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub load: LoadArgs,
}
