//! Arguments of `embrasure audit`.

use super::flags::NameParser;
use super::values::parse_size;
use crate::options::Backend;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The rays come from a render. A disagreement is explained if the ray passes so near to an edge, to a
plane or to an end of its interval that rounding errors decide the answer. An unexplained
disagreement gives exit code 1.
Examples:
  embrasure audit scenes/cornell-box.toml
  embrasure audit room.obj --rays 100000000 -o room-audit.json
  embrasure audit room.obj --replay room-audit.json")]
pub(in crate::cli) struct AuditArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Approximate number of rays, spread evenly over the image
    #[arg(long, value_name = "N", default_value = "1000000")]
    pub rays: std::num::NonZeroU64,

    /// Check the rays of this report instead of those of a render
    #[arg(long, value_name = "FILE", conflicts_with = "rays")]
    pub replay: Option<PathBuf>,

    /// Write the report as JSON to this file
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Ray-tracing backend to check
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Backend to compare with [default: another one that is built in]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub against: Option<Backend>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
