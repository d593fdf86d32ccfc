//! Arguments of `embrasure lab`.

use super::flags::{NameParser, value_parser};
use super::values::{parse_duration, parse_size};
use crate::options::{Backend, IntegratorKind, MaxDepth};
use clap::Parser;
use std::path::PathBuf;

/// Equal samples with --spp, equal time with --time.
#[derive(Debug, Parser)]
#[command(after_help = "\
Writes PREFIX.png (the pictures), PREFIX.csv and PREFIX.md (relMSE, seconds, efficiency = 1 / (relMSE x seconds)).
Without --reference the last estimator that is unbiased and finds all light (path, naive, bdpt, pssmlt or mlt) renders one, in 64 times its time: with
--time 10s some 11 minutes. An interrupt during the reference writes pictures and times without errors.
Examples:
  embrasure lab scenes/cornell-box.toml --size 256x256
  embrasure lab scenes/cornell-box.toml --size 256x256 --methods sppm,vcm,bdpt --spp 16
  embrasure lab scenes/cornell-box.toml --size 256x256 --bounces
  embrasure lab scenes/veach-plates.toml --time 5s -o out/veach")]
pub(in crate::cli) struct LabArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Integrators to compare in place of the ladder, such as path,bdpt,mlt,sppm, each with its defaults
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = NameParser::<IntegratorKind>::new())]
    pub methods: Vec<IntegratorKind>,

    /// Write a sheet of path's picture and the light of 0 to 5 bounces by itself, in place of a comparison
    #[arg(long, conflicts_with_all = ["methods", "time", "reference"])]
    pub bounces: bool,

    /// Samples a pixel of every estimator [default: 64]
    #[arg(long, value_name = "N", conflicts_with = "time")]
    pub spp: Option<u32>,

    /// Time for every estimator, such as 10s or 2m
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub time: Option<f64>,

    /// Reference, an EXR file [default: the last unbiased estimator at 64 times its samples]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Name of the files without their extension [default: SCENE's stem + -lab]
    #[arg(short, long, value_name = "PREFIX")]
    pub output: Option<PathBuf>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Maximum number of scattering events; 0 shows emission alone, none is 1024 [default: 16]
    #[arg(long, value_name = "N", value_parser = value_parser::<MaxDepth>)]
    pub max_depth: Option<MaxDepth>,

    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Ray-tracing backend, of those built in
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Render and build threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}
