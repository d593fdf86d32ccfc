//! Arguments of `embrasure merge`.

use super::exr::ExrArgs;
use super::flags::Flags;
use crate::options::ToneOptions;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Parts come from `render` with --samples, --crop or both, written by -o or --checkpoint. All parts
must have the same scene, settings, seed, program and backend. No sample may be missing or occur
twice.
Examples:
  embrasure render room.toml --spp 512 --samples 0..256 -o a.exr
  embrasure render room.toml --spp 512 --samples 256..512 -o b.exr
  embrasure merge a.exr b.exr -o room.exr -o room.png
  embrasure merge a.exr b.exr --checkpoint ab.exr            (a larger part)")]
pub(in crate::cli) struct MergeArgs {
    /// EXR files that hold parts
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,

    /// Image to write, .exr (linear) or .png (display); repeatable
    #[arg(short, long, value_name = "FILE", required_unless_present = "checkpoint")]
    pub output: Vec<PathBuf>,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Write the joined sums to this EXR file, to merge or resume it later
    ///
    /// Without -o the sums may be incomplete.
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Merge incomplete parts: pixels or samples may be missing
    ///
    /// Parts may also be unfinished, such as those of an interrupted render.
    #[arg(long)]
    pub allow_gaps: bool,

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No summary
    #[arg(short, long)]
    pub quiet: bool,
}
