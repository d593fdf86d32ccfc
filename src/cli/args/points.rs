//! Arguments of `embrasure points`.

use super::flags::NameParser;
use super::values::parse_svg_output;
use crate::integrator::Directions;
use crate::options::Named;
use crate::sampler::SamplerKind;
use clap::Parser;
use std::path::PathBuf;

/// Maximum number of points. The time to compute the star discrepancy grows with the square of the
/// number.
const MAX_POINTS: i64 = 1 << 14;

/// A set of points for `embrasure points`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli) enum PointSet {
    /// All dimensions of a sampler.
    Sampler(SamplerKind),
    /// Directions on the sphere, as in `render --directions`.
    Directions(Directions),
}

impl Named for PointSet {
    const NAMES: &'static [(&'static str, Self)] = &{
        const SAMPLERS: usize = SamplerKind::NAMES.len();
        let fibonacci = ("fibonacci", Self::Directions(Directions::Fibonacci));
        let perturbed = ("perturbed-qmc", Self::Directions(Directions::PerturbedQmc));
        let mut names = [fibonacci; SAMPLERS + 2];
        names[SAMPLERS + 1] = perturbed;
        let mut i = 0;
        while i < SAMPLERS {
            let (name, kind) = SamplerKind::NAMES[i];
            names[i] = (name, Self::Sampler(kind));
            i += 1;
        }
        names
    };
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Projections show pairs of numbers that a path draws. Convergence is the error of known integrals at
each power of two.
Examples:
  embrasure points sobol -n 256 -o sobol.svg
  embrasure points perturbed-qmc -n 512 -o directions.svg
  embrasure points halton -n 64 --json")]
pub(in crate::cli) struct PointsArgs {
    /// A sampler of `render --sampler`, or fibonacci or perturbed-qmc of `--directions`
    #[arg(value_name = "SAMPLER", value_parser = NameParser::<PointSet>::new())]
    pub set: PointSet,

    /// Number of points, at most 16384
    #[arg(short = 'n', long = "points", value_name = "N", default_value = "256", value_parser = clap::value_parser!(u32).range(1..=MAX_POINTS))]
    pub count: u32,

    /// Write a picture of points and convergence to this .svg
    #[arg(short, long, value_name = "FILE.svg", value_parser = parse_svg_output)]
    pub output: Option<PathBuf>,

    /// Seed of the random numbers
    #[arg(long, value_name = "SEED", default_value = "0")]
    pub seed: u64,

    /// Print JSON, with the coordinates of all points
    #[arg(long)]
    pub json: bool,
}
