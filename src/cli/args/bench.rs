//! Arguments of `embrasure bench`.

use super::flags::NameParser;
use super::values::parse_size;
use crate::options::Backend;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The rays come from a render with default settings. They are recorded, then traced again without
shading (replay): `render / replay` is the time of the render divided by the time of its rays alone.
Examples:
  embrasure bench scenes/cornell-box.toml
  embrasure bench scenes/cornell-box.toml bunny.obj --size 256x256 --json")]
pub(in crate::cli) struct BenchArgs {
    /// .toml scene files or bare .obj files
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Measure only this ray-tracing backend [default: all that are built in, except brute]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Number of measurements; the result is their median
    #[arg(long, value_name = "N", default_value = "7")]
    pub repeat: std::num::NonZeroUsize,

    /// Threads of the second measurement; the first uses one [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
