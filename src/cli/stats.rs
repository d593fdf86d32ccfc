//! `--stats`: the statistics of a render, and their output.

use super::audit::AuditReport;
use super::error::CliError;
use super::outputs::Outputs;
use super::printing;
use super::progress::{MIN_SAMPLES, samples_left, work_left};
use crate::files::Output;
use crate::film::{Film, Tile};
use crate::integrator::ChainCounts;
use crate::io::FileError;
use crate::math::list;
use crate::render::{DroppedSample, MutationCounts};
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Output of `--stats`.
pub(super) enum StatsOutput {
    StandardOutput,
    File(Output),
}

impl StatsOutput {
    /// Checks the file `path`, and adds it to `outputs`; `-` is the standard output.
    ///
    /// # Errors
    ///
    /// Errors of [`Outputs::prepare`].
    pub fn prepare(path: &Path, outputs: &mut Outputs) -> Result<Self, CliError> {
        if path == Path::new("-") {
            return Ok(Self::StandardOutput);
        }
        Ok(Self::File(outputs.prepare("--stats", path)?))
    }

    /// Writes the text `json`.
    pub fn write(&self, json: &str) -> Result<(), FileError> {
        match self {
            Self::StandardOutput => {
                outln!("{json}");
                Ok(())
            }
            Self::File(output) => output.write(|writer| writer.write_all(json.as_bytes())),
        }
    }
}

/// Content of `--stats`: one JSON object.
#[derive(Debug, Serialize)]
pub(super) struct Stats<'a> {
    pub version: &'static str,
    pub build: &'static str,
    pub backend: &'static str,
    pub backend_version: &'a str,
    pub isa: &'static str,
    pub integrator: &'static str,
    pub sampler: &'static str,
    pub spp: u32,
    pub threads: usize,
    pub width: u32,
    pub height: u32,
    pub triangles: u64,
    pub lights: usize,
    /// Distance in scene units from the lens to the plane in focus, along the view axis.
    pub focus_distance: f32,
    /// Seconds to read files.
    pub load_s: f64,
    /// Seconds to find a missing camera and missing light.
    pub guess_s: f64,
    pub build_s: f64,
    pub render_s: f64,
    /// Seconds to write files.
    pub write_s: f64,
    pub total_s: f64,
    pub rays: Rays,
    pub samples: u64,
    pub complete: bool,
    /// Reason for the end of the render: samples, noise, time-limit or interrupt.
    pub stop: &'static str,
    /// Estimate of the relative error; `null` if unknown.
    pub error: Option<f64>,
    pub scene_hash: &'a str,
    pub scene_bytes: u64,
    pub bvh_bytes: u64,
    /// Peak memory of the process; `null` if the system does not report it.
    pub peak_rss_bytes: Option<u64>,
    /// Number of rays that were cut off after 10,000 surfaces with opacity below 1.
    pub cut_walks: u64,
    pub dropped_samples: u64,
    /// The first dropped samples, with the data to trace them again.
    pub dropped: Vec<DroppedSampleEntry>,
    /// Mutations of Markov chains, by kind.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub mutations: BTreeMap<&'a str, Mutations>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chains: Option<Chains>,
    /// Exposure of PNG files in stops, metered or given; `null` without a picture.
    pub exposure: Option<f32>,
    /// Noise of the picture, and the level of `--noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseOfRender>,
    /// Denoiser of the picture, if the picture is denoised.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub denoise: Option<DenoiseStats>,
    /// Report of `--audit-rays`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub audit: Option<AuditReport>,
    pub warnings: Vec<&'a str>,
}

#[derive(Debug, Serialize)]
pub(super) struct Rays {
    pub camera: u64,
    pub bounce: u64,
    pub shadow: u64,
}

#[derive(Debug, Serialize)]
pub(super) struct DroppedSampleEntry {
    pixel: [u32; 2],
    sample: u32,
    /// Radiance of the sample as text, because JSON has no NaN.
    radiance: String,
}

/// Counts of the mutations of one kind.
#[derive(Debug, Serialize)]
pub(super) struct Mutations {
    proposed: u64,
    accepted: u64,
    /// Fraction of accepted mutations; `null` without mutations.
    acceptance: Option<f64>,
}

/// Statistics of Markov chains, and of their motion between pixels.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Chains {
    pub count: u64,
    /// Mean number of mutations per chain.
    pub mutations: f64,
    /// Integrated autocorrelation time, in mutations, of the pixel in which a chain is. It is the
    /// variance of a pixel value, divided by the variance that as many independent samples would
    /// have.
    pub autocorrelation_time: f64,
    /// Fraction of chains with at least half of their mutations in one pixel.
    pub stuck: f64,
}

impl Chains {
    /// Statistics of `counts`; `None` without chains.
    pub fn new(counts: ChainCounts) -> Option<Self> {
        let autocorrelation_time = counts.autocorrelation_time()?;
        Some(Self {
            count: counts.chains,
            mutations: counts.mutations as f64 / counts.chains as f64,
            autocorrelation_time,
            stuck: counts.stuck as f64 / counts.chains as f64,
        })
    }

    /// Warning that chains hardly move between pixels; `None` if they move enough.
    pub fn warning(&self) -> Option<String> {
        let Self {
            mutations,
            autocorrelation_time: time,
            ..
        } = *self;
        (time > MAX_SHARE_OF_A_CHAIN * mutations).then(|| {
            format!(
                "the picture shows where Markov chains started, because a chain of {mutations:.0} mutations returns to the same pixels so often that it is worth only {:.1} independent samples\n  \
                 help: use fewer and longer chains (--chains), or compare with bdpt or vcm",
                mutations / time
            )
        })
    }
}

/// Ratio of autocorrelation time to chain length above which a picture mainly depends on the paths
/// from which the chains start.
const MAX_SHARE_OF_A_CHAIN: f64 = 0.25;

/// Denoiser of the picture, in the output of `--stats`.
#[derive(Clone, Debug, Serialize)]
pub(super) struct DenoiseStats {
    /// Name of the denoiser, and version of the library of the denoiser.
    pub by: String,
    pub seconds: f64,
}

/// Noise of a picture.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct NoiseOfRender {
    /// Noise level requested by `--noise`.
    level: f64,
    /// Estimated relative error: the square root of relMSE.
    error: f64,
    min_spp: u32,
    mean_spp: f64,
    max_spp: u32,
}

impl NoiseOfRender {
    /// Noise of the samples on `film`.
    pub fn new(film: &Film, level: f64) -> Self {
        let samples = || film.tiles().iter().map(Tile::samples);
        let sum = |tile: &Tile| tile.samples() as f64 * tile.bounds().area() as f64;
        Self {
            level,
            error: film.error().sqrt(),
            min_spp: samples().min().unwrap_or(0),
            mean_spp: film.tiles().iter().map(sum).sum::<f64>() / film.crop().area() as f64,
            max_spp: samples().max().unwrap_or(0),
        }
    }

    /// Returns true if the estimated error is not above the requested noise level.
    pub fn is_reached(&self) -> bool {
        self.error <= self.level
    }

    /// Warning that the noise level is not reached after `seconds` of rendering.
    pub fn warning(&self, seconds: f64) -> String {
        let Self {
            level, error, max_spp, ..
        } = *self;
        let more = match samples_left(max_spp.into(), error, level) {
            Some(left) => format!(
                "raise --spp to about {}, which takes about {} more",
                round_up(u64::from(max_spp) + left),
                printing::duration(self.seconds_left(seconds).unwrap_or(0.0))
            ),
            None => format!("raise --spp to at least {MIN_SAMPLES}"),
        };
        format!(
            "noise level {} was not reached with at most {} per pixel: it is {}\n  help: {more}",
            printing::percent(level),
            printing::count(max_spp.into(), "sample"),
            printing::percent(error)
        )
    }

    /// Text for a render that was stopped after `seconds` of rendering: the time that the noise
    /// level still needs. `None` if the level is reached.
    pub fn shortfall(&self, seconds: f64) -> Option<String> {
        let level = printing::percent(self.level);
        (!self.is_reached()).then(|| match self.seconds_left(seconds) {
            Some(left) => format!("noise level {level} needs about {} more", printing::duration(left)),
            None => {
                format!("the time for noise level {level} cannot be estimated before {MIN_SAMPLES} samples per pixel")
            }
        })
    }

    /// Estimated seconds until the noise level is reached, after `seconds` of rendering. `None`
    /// before the error can be estimated.
    fn seconds_left(&self, seconds: f64) -> Option<f64> {
        work_left(self.error, self.level).map(|multiple| seconds * multiple)
    }
}

/// `count`, rounded up to two significant digits.
fn round_up(count: u64) -> u64 {
    let step = 10u64.pow(count.max(1).ilog10().saturating_sub(1));
    count.div_ceil(step).saturating_mul(step)
}

impl From<&DroppedSample> for DroppedSampleEntry {
    fn from(d: &DroppedSample) -> Self {
        Self {
            pixel: d.key.pixel().to_array(),
            sample: d.key.sample,
            radiance: list(&d.radiance),
        }
    }
}

impl From<MutationCounts> for Mutations {
    fn from(counts: MutationCounts) -> Self {
        let MutationCounts { proposed, accepted } = counts;
        Self {
            proposed,
            accepted,
            acceptance: (proposed > 0).then(|| accepted as f64 / proposed as f64),
        }
    }
}

/// Maximum resident size of the process so far in bytes, from Linux's `VmHWM`.
pub(super) fn peak_rss_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(error: f64) -> NoiseOfRender {
        NoiseOfRender {
            level: 0.01,
            error,
            min_spp: 192,
            mean_spp: 192.0,
            max_spp: 192,
        }
    }

    #[test]
    fn half_the_error_needs_four_times_the_samples() {
        assert_eq!(samples_left(1000, 0.02, 0.01), Some(3000));
        assert_eq!(samples_left(1000, 0.01, 0.01), Some(0));
        assert_eq!(samples_left(1000, f64::INFINITY, 0.01), None);
        assert_eq!([round_up(7), round_up(768), round_up(1_610_000)], [7, 770, 1_700_000]);
        let words = noise(0.02).warning(50.0);
        assert!(
            words.ends_with("help: raise --spp to about 770, which takes about 2 min 30 s more"),
            "{words}"
        );
        let words = noise(0.02).shortfall(50.0);
        assert_eq!(words.unwrap(), "noise level 1 % needs about 2 min 30 s more");
        let words = noise(f64::INFINITY).shortfall(50.0).unwrap();
        assert!(words.contains("cannot be estimated before 128 samples"), "{words}");
        assert_eq!(noise(0.009).shortfall(50.0), None);
    }
}
