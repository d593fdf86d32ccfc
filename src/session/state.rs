//! State of a render: sums, counts and time. Checkpoints store this state.
//!
//! Each tile stores its number of samples, and `render::render` adds samples to each tile up to the
//! requested end. A resumed film is therefore not a special case. `--noise` assigns a target number
//! of samples to each tile, in rounds. The target (`Tile::target`) is a part of the state, so that
//! an interrupted round is completed before the next targets are chosen.

use crate::files::Output;
use crate::film::{Aov, Backing, Film, Image, MAX_PARTS};
use crate::integrator::ChainCounts;
use crate::io::{Checkpoint, FeatureNames, FileError, Format, Metadata, State, cryptomattes};
use crate::render::{DroppedSample, MutationCounts, RayCounts, Statistics};
use crate::sampler::SampleKey;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Complete state of a render. Sums and counts include all runs of the program that have added
/// samples.
#[derive(Clone, Debug)]
pub struct RenderState {
    /// Sums of each pixel.
    pub film: Film,
    /// Counts of rays and samples.
    pub statistics: Statistics,
    /// Time of rendering in seconds.
    pub seconds: f64,
}

impl RenderState {
    /// State before the first sample: an empty film. It has sums for all channels of `features`,
    /// and for the coverage if there is a `backing`.
    pub(super) fn new(mut film: Film, backing: Option<Backing>, features: Option<&FeatureNames>) -> Self {
        if let Some(backing) = backing {
            film = film.with_backing(backing);
        }
        if let Some(names) = features {
            film = film.with_parts(names.parts().len().min(MAX_PARTS));
            if names.aovs().iter().any(|aov| aov.is_of_surface()) {
                film = film.with_features();
            }
        }
        Self {
            film,
            statistics: Statistics::default(),
            seconds: 0.0,
        }
    }

    /// Returns true if the state has no sample, so that there is no picture. An integrator whose
    /// samples cover all pixels may be stopped before its first sample is complete.
    pub fn is_empty(&self) -> bool {
        self.film.samples() == 0
    }

    /// State from a checkpoint.
    pub(super) fn of_checkpoint(checkpoint: Checkpoint) -> Result<Self, FileError> {
        let counted: StoredStatistics = serde_json::from_str(&checkpoint.statistics).map_err(|error| {
            FileError::new(&checkpoint.path, format!("its statistics are invalid: {error}")).help("render it anew")
        })?;
        Ok(Self {
            film: checkpoint.film,
            statistics: counted.statistics(),
            seconds: counted.seconds,
        })
    }

    /// The current picture with the channels of `features`. It has an error map if `with_error` is
    /// true.
    pub(super) fn develop(&self, with_error: bool, features: Option<&FeatureNames>) -> Image {
        let mut image = self.film.develop();
        if let Some(names) = features {
            let aovs = names.aovs();
            image.channels.extend(self.film.develop_features(&aovs));
            image.channels.extend(self.film.develop_parts(&names.parts()));
            if aovs.contains(&Aov::Cryptomatte) {
                image.channels.extend(cryptomattes(&self.film, names));
            }
        }
        if with_error {
            image.channels.push(self.film.error_map());
        }
        image
    }

    /// Writes the complete state to an EXR file, from which the render can be resumed.
    ///
    /// # Errors
    ///
    /// Errors of writing the file. An existing file is then kept.
    pub fn keep(&self, output: &Output, metadata: &Metadata) -> Result<(), FileError> {
        let statistics = self.counted();
        self.as_state(&statistics).write(output, metadata)
    }

    /// Writes `image` to all `outputs`, and returns the errors. If `with_sums` is true, the sums
    /// are also written. If there are no samples, no file is written, and existing files are kept.
    pub fn write(
        &self,
        image: &Image,
        outputs: &[(Format, Output)],
        with_sums: bool,
        metadata: &Metadata,
    ) -> Vec<FileError> {
        if self.is_empty() {
            let refused = |(_, output): &(_, Output)| {
                FileError::new(output.path(), "not written: no sample was taken").help("render for longer")
            };
            return outputs.iter().map(refused).collect();
        }
        let statistics = self.counted();
        let state = with_sums.then(|| self.as_state(&statistics));
        let write = |(format, output): &(_, Output)| output.write_image(format, image, state.as_ref(), metadata);
        outputs.iter().filter_map(|o| write(o).err()).collect()
    }

    /// Saves the state if no file of `outputs` has the picture as floats. The new file is beside
    /// the first output. It has `R G B` and all sums, as in a checkpoint. Returns the path of the
    /// new file.
    pub(super) fn rescue(
        &self,
        outputs: &[(Format, Output)],
        metadata: &Metadata,
    ) -> Option<Result<Output, FileError>> {
        let (_, beside) = outputs
            .iter()
            .find(|(format, _)| matches!(format, Format::Exr(_)))
            .or(outputs.first())?;
        let write = || {
            let output = beside.rescue()?;
            // Leave out additional data, which may have caused the failure
            let metadata = Metadata {
                features: None,
                denoiser: None,
                tone: None,
                ..metadata.clone()
            };
            self.keep(&output, &metadata)?;
            Ok(output)
        };
        (!self.is_empty()).then(write)
    }

    fn as_state<'a>(&'a self, statistics: &'a str) -> State<'a> {
        State {
            film: &self.film,
            statistics,
        }
    }

    /// Counts and time as JSON text.
    fn counted(&self) -> String {
        // The structure has only numbers, so serialization cannot fail.
        serde_json::to_string(&StoredStatistics::new(&self.statistics, self.seconds)).unwrap_or_default()
    }
}

/// [`Statistics`] as stored in files.
#[derive(Serialize, Deserialize)]
struct StoredStatistics {
    seconds: f64,
    /// Numbers of camera, bounce and shadow rays.
    rays: [u64; 3],
    /// Number of rays that were cut off after the maximum number of surfaces with opacity below 1.
    #[serde(default)]
    cut: u64,
    samples: u64,
    dropped: u64,
    first_dropped: Vec<CountedSample>,
    /// Numbers of proposed and accepted mutations, for each kind of mutation.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    mutations: BTreeMap<String, [u64; 2]>,
    /// Counts of Markov chains: number of chains, number of mutations, sum of squared visits of
    /// pixels, and number of stuck chains.
    #[serde(default)]
    chains: [u64; 4],
}

#[derive(Serialize, Deserialize)]
struct CountedSample {
    pixel: [u32; 2],
    sample: u32,
    /// Bits of the three floats. They are stored as integers, because JSON has no NaN.
    radiance: [u32; 3],
}

impl StoredStatistics {
    fn new(statistics: &Statistics, seconds: f64) -> Self {
        let RayCounts {
            camera,
            bounce,
            shadow,
            cut,
        } = statistics.rays;
        let dropped = statistics.first_dropped.iter().map(|d| CountedSample {
            pixel: d.key.pixel().to_array(),
            sample: d.key.sample,
            radiance: d.radiance.map(f32::to_bits),
        });
        let mutations = statistics
            .mutations
            .iter()
            .map(|(kind, counts)| (kind.to_string(), [counts.proposed, counts.accepted]));
        let chains = statistics.chains;
        Self {
            seconds,
            rays: [camera, bounce, shadow],
            cut,
            samples: statistics.samples,
            dropped: statistics.dropped,
            first_dropped: dropped.collect(),
            mutations: mutations.collect(),
            chains: [chains.chains, chains.mutations, chains.squared_visits, chains.stuck],
        }
    }

    fn statistics(&self) -> Statistics {
        let [camera, bounce, shadow] = self.rays;
        let [chains, of_chains, squared_visits, stuck] = self.chains;
        let dropped = self.first_dropped.iter().map(|d| DroppedSample {
            key: SampleKey::new(d.pixel[0], d.pixel[1], d.sample),
            radiance: d.radiance.map(f32::from_bits),
        });
        let mutations = self
            .mutations
            .iter()
            .map(|(kind, &[proposed, accepted])| (kind.clone().into(), MutationCounts { proposed, accepted }));
        Statistics {
            rays: RayCounts {
                camera,
                bounce,
                shadow,
                cut: self.cut,
            },
            samples: self.samples,
            dropped: self.dropped,
            first_dropped: dropped.collect(),
            mutations: mutations.collect(),
            chains: ChainCounts {
                chains,
                mutations: of_chains,
                squared_visits,
                stuck,
            },
        }
    }
}
