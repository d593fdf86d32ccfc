//! Arguments of `embrasure paths`.

use super::camera::CameraArgs;
use super::flags::Flags;
use super::load::LoadArgs;
use super::values::{parse_list, parse_paths_output, parse_range, parse_size};
use crate::options::{FilterOptions, IntegratorOptions, SamplingOptions};
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The contributions add up to the light of the sample in the pixel, as `render` computes it. Methods
such as bdpt and mlt can add light to any pixel. A sample of such a method is an iteration over the
whole image: the command traces the iteration, and keeps the paths that add light to the pixel.
Examples:
  embrasure paths scenes/cornell-box.toml --pixel 256,300 -o paths.svg
  embrasure paths scenes/cornell-box.toml --pixel 128,150 --size 256x256 --integrator bdpt --samples 0..4 -o paths.obj -o paths.json")]
pub(in crate::cli) struct PathsArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// The pixel: column and row, from 0, origin top left
    #[arg(long, value_name = "X,Y", value_parser = parse_list::<u32, 2>)]
    pub pixel: [u32; 2],

    /// Index of the sample
    #[arg(long, value_name = "K", default_value = "0", conflicts_with = "samples")]
    pub sample: u32,

    /// Record samples A to B-1 in place of one
    #[arg(long, value_name = "A..B", value_parser = parse_range)]
    pub samples: Option<[u32; 2]>,

    /// File to write: .svg (two views), .obj (lines in space), .json; repeatable
    #[arg(short, long, value_name = "FILE", value_parser = parse_paths_output)]
    pub output: Vec<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub integrator: Flags<IntegratorOptions>,

    #[command(flatten)]
    pub sampling: Flags<SamplingOptions>,

    #[command(flatten)]
    pub filter: Flags<FilterOptions>,

    #[command(flatten)]
    pub camera: CameraArgs,

    #[command(flatten)]
    pub load: LoadArgs,
}
