//! Arguments of `embrasure merge`.

use super::exr::ExrArgs;
use super::flags::{Flags, NameParser};
use super::values::parse_radius;
use crate::cli::printing;
use crate::denoise::Denoiser;
use crate::options::{Denoising, Finish, ToneOptions};
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Parts come from `render` with --samples, --crop or both, written by -o or --checkpoint. All parts
must have the same scene, settings, seed, program and backend. No sample may be missing or occur
twice. Denoiser, exposure and tone curve are those of the render, unless flags say otherwise.
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
    ///
    /// {face} in the name writes the faces of a cube map, as in `render`.
    #[arg(short, long, value_name = "FILE", required_unless_present = "checkpoint")]
    pub output: Vec<PathBuf>,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    /// Denoiser; without a name the best one built in [default: that of the render]
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, value_parser = NameParser::<Denoising>::new())]
    pub denoise: Option<Option<Denoising>>,

    /// Standard deviation in pixels of the denoiser gaussian [default: that of the render]
    #[arg(long, value_name = "PIXELS", value_parser = parse_radius)]
    pub denoise_radius: Option<f32>,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Write the joined samples to this EXR file, to merge or resume it later
    ///
    /// Without -o, samples may be missing.
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

impl MergeArgs {
    /// Denoiser, tone curve and lines of the merged picture. If a flag is missing, the value of
    /// `noted` is used: the settings that the render stored in the parts.
    pub fn finish(&self, noted: Finish) -> Finish {
        let denoiser = match self.denoise {
            None => noted.denoiser.filter(|denoiser| is_there(*denoiser)),
            Some(None) => Some(Denoiser::best()),
            Some(Some(denoising)) => denoising.denoiser(),
        };
        let has_radius = denoiser.is_some_and(|denoiser| denoiser.default_radius().is_some());
        let noted_radius = noted.denoise_radius.filter(|_| has_radius && self.denoise.is_none());
        Finish {
            tone: self.tone.0.over(noted.tone),
            denoiser,
            denoise_radius: self.denoise_radius.or(noted_radius),
            lines: noted.lines,
        }
    }
}

/// Returns true if the denoiser of the render is available. If not, prints a warning.
fn is_there(denoiser: Denoiser) -> bool {
    let version = denoiser.version();
    if let Err(error) = &version {
        printing::warning(format!("the pictures are not denoised: {error}"));
    }
    version.is_ok()
}
