//! Renders that can be left and gone on with: what `--checkpoint` and `--resume` ask for.

use super::args::RenderArgs;
use super::error::CliError;
use super::job::Job;
use crate::film::{Aov, Film, Image};
use crate::io::{Checkpoint, FileError, Format, Metadata, Output, State, cryptomattes, read_checkpoint};
use crate::light::LightGroups;
use crate::render::{DroppedSample, RayCounts, Statistics};
use crate::sampler::SampleKey;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Seconds between checkpoints where nothing else is said.
const USUAL_INTERVAL: f64 = 60.0;

/// Where a render keeps what it knows.
pub(super) struct Keeper {
    output: Output,
    /// What is there from before.
    found: Option<Checkpoint>,
    /// Seconds between one time and the next.
    pub interval: f64,
}

/// A render's sums and counts so far, over all runs of the program.
pub(super) struct Progressed {
    pub film: Film,
    pub statistics: Statistics,
    /// Of rendering.
    pub seconds: f64,
}

impl Keeper {
    /// As the arguments say, if they do. What is there already is not overwritten, unless the render goes on from it.
    pub fn new(args: &RenderArgs) -> Result<Option<Self>, CliError> {
        let Some(path) = &args.checkpoint else {
            return Ok(None);
        };
        let is_there = path.exists();
        if is_there && !args.resume {
            return Err(CliError::Usage(format!(
                "--checkpoint {} exists already\n  help: add --resume to go on from it, or delete it to start anew",
                path.display()
            )));
        }
        Ok(Some(Self {
            output: Output::prepare(path)?,
            found: is_there.then(|| read_checkpoint(path)).transpose()?,
            interval: args.checkpoint_interval.unwrap_or(USUAL_INTERVAL),
        }))
    }

    /// What the render of `job` goes on from, whose result would say of itself what `metadata` does.
    pub fn restore(&mut self, job: &Job, metadata: &Metadata) -> Result<Option<Progressed>, CliError> {
        let Some(found) = self.found.take() else {
            return Ok(None);
        };
        let refused = |message: String, help: &str| {
            let error = FileError::new(self.output.path(), message);
            Err(CliError::File(error.help(help)))
        };
        let (there, here) = (found.film.crop(), job.crop);
        let difference = if found.film.resolution() != job.resolution {
            Some(format!("image size {} and {}", found.film.resolution(), job.resolution))
        } else if there != here {
            let corners = [there, here].map(|r| format!("{},{},{},{}", r.min.x, r.min.y, r.max.x, r.max.y));
            Some(format!("crop {} and {}", corners[0], corners[1]))
        } else if found.metadata.first_sample != job.samples.start {
            let first = found.metadata.first_sample;
            Some(format!("first sample {first} and {}", job.samples.start))
        } else {
            found.metadata.difference(metadata)
        };
        if let Some(difference) = difference {
            return refused(
                format!("this checkpoint is of another render: {difference} (there and here)"),
                "render as before, or name another --checkpoint",
            );
        }
        let most = found
            .film
            .tiles()
            .iter()
            .map(|tile| tile.next_sample())
            .max()
            .unwrap_or(0);
        if most > job.samples.end {
            return refused(
                format!(
                    "this checkpoint has {most} samples a pixel already, {} are wanted",
                    job.samples.end
                ),
                "ask for as many or for more: samples are not taken out",
            );
        }
        Progressed::of_checkpoint(self.output.path(), found).map(Some)
    }

    /// Writes all that is known.
    pub fn keep(&self, progressed: &Progressed, metadata: &Metadata) -> Result<(), FileError> {
        write_state(&self.output, progressed, metadata)
    }
}

/// Writes a checkpoint.
pub(super) fn write_state(output: &Output, progressed: &Progressed, metadata: &Metadata) -> Result<(), FileError> {
    let statistics = progressed.counted();
    let state = State {
        film: &progressed.film,
        statistics: &statistics,
    };
    state.write(output, metadata)
}

impl Progressed {
    /// Nothing yet.
    pub fn start(job: &Job, metadata: &Metadata) -> Self {
        Self::of_film(Film::starting_at(job.resolution, job.crop, job.samples.start), metadata)
    }

    /// Nothing yet, in an empty film, which is to sum all that `metadata` asks for.
    pub fn of_film(mut film: Film, metadata: &Metadata) -> Self {
        if let Some(names) = &metadata.features {
            film = film.with_light_groups(names.lights.len().min(LightGroups::MOST));
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

    /// What was read of `path`.
    pub fn of_checkpoint(path: &Path, checkpoint: Checkpoint) -> Result<Self, CliError> {
        let counted: Counted = serde_json::from_str(&checkpoint.statistics).map_err(|error| {
            FileError::new(path, format!("its statistics make no sense: {error}")).help("render it anew")
        })?;
        Ok(Self {
            film: checkpoint.film,
            statistics: counted.statistics(),
            seconds: counted.seconds,
        })
    }

    /// The picture as it is now, with the channels that were asked for, and a map of the error if that was.
    pub fn develop(&self, with_error: bool, metadata: &Metadata) -> Image {
        let mut image = self.film.develop();
        if let Some(names) = &metadata.features {
            let aovs = names.aovs();
            image.channels.extend(self.film.develop_features(&aovs));
            image.channels.extend(self.film.develop_light_groups(&names.lights));
            if aovs.contains(&Aov::Cryptomatte) {
                image.channels.extend(cryptomattes(&self.film, names));
            }
        }
        if with_error {
            image.channels.push(self.film.error_map());
        }
        image
    }

    /// Writes `image` to all `outputs`, a part with its sums, and what went wrong with them.
    pub fn write(
        &self,
        image: &Image,
        outputs: &[(Format, Output)],
        is_part: bool,
        metadata: &Metadata,
    ) -> Vec<FileError> {
        let statistics = self.counted();
        let state = is_part.then_some(State {
            film: &self.film,
            statistics: &statistics,
        });
        let write = |(format, output): &(_, Output)| output.write_image(*format, image, state.as_ref(), metadata);
        outputs.iter().filter_map(|o| write(o).err()).collect()
    }

    /// What has been counted, as JSON.
    pub fn counted(&self) -> String {
        // Numbers alone: nothing can go wrong.
        serde_json::to_string(&Counted::new(&self.statistics, self.seconds)).unwrap_or_default()
    }
}

/// What files keep of [`Statistics`].
#[derive(Serialize, Deserialize)]
struct Counted {
    seconds: f64,
    /// Camera, bounce, shadow.
    rays: [u64; 3],
    samples: u64,
    dropped: u64,
    first_dropped: Vec<CountedSample>,
}

#[derive(Serialize, Deserialize)]
struct CountedSample {
    pixel: [u32; 2],
    sample: u32,
    /// Bits of the floats: JSON has no NaN.
    radiance: [u32; 3],
}

impl Counted {
    fn new(statistics: &Statistics, seconds: f64) -> Self {
        let RayCounts { camera, bounce, shadow } = statistics.rays;
        let dropped = statistics.first_dropped.iter().map(|d| CountedSample {
            pixel: d.key.pixel().to_array(),
            sample: d.key.sample,
            radiance: d.radiance.map(f32::to_bits),
        });
        Self {
            seconds,
            rays: [camera, bounce, shadow],
            samples: statistics.samples,
            dropped: statistics.dropped,
            first_dropped: dropped.collect(),
        }
    }

    fn statistics(&self) -> Statistics {
        let [camera, bounce, shadow] = self.rays;
        let dropped = self.first_dropped.iter().map(|d| DroppedSample {
            key: SampleKey::new(d.pixel[0], d.pixel[1], d.sample),
            radiance: d.radiance.map(f32::from_bits),
        });
        Statistics {
            rays: RayCounts { camera, bounce, shadow },
            samples: self.samples,
            dropped: self.dropped,
            first_dropped: dropped.collect(),
        }
    }
}
