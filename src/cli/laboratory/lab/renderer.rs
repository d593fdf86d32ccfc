//! Runs the renders of all contenders, and the render of the reference. Successive contenders use
//! the same scene in memory, if possible.

use super::budget::Budget;
use super::contenders::Contender;
use super::runs::{self, ContenderRun, Snapshot};
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::cli::progress::is_interrupted;
use crate::film::RgbImage;
use crate::io::read_exr;
use crate::session::{Session, Settings};
use std::path::Path;

/// Number of samples of the reference, divided by the number of samples that the same estimator
/// takes in the comparison.
const REFERENCE_FACTOR: u32 = 64;

/// Reference of the comparison.
pub(super) struct Reference {
    /// Name of the estimator, or of the file.
    pub name: String,
    /// Samples per pixel; `None` if the reference is a file.
    pub samples: Option<u32>,
    pub image: RgbImage,
}

impl Reference {
    /// Text lines with the name and the number of samples.
    pub fn lines(&self) -> Vec<String> {
        let samples = self.samples.map(|samples| format!("{samples} samples"));
        [self.name.clone()].into_iter().chain(samples).collect()
    }

    /// Reads the picture `path`, which must have the size of the rendered pictures.
    pub fn read(path: &Path, settings: &Settings) -> Result<Self, CliError> {
        let image = read_exr(path)?;
        let [width, height] = settings.crop().size().as_usizevec2().to_array();
        if [image.width, image.height] != [width, height] {
            return Err(CliError::Usage(format!(
                "{} has {}x{} pixels, but {width}x{height} are rendered\n  help: give --size {}x{}",
                path.display(),
                image.width,
                image.height,
                image.width,
                image.height
            )));
        }
        Ok(Self {
            name: path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            samples: None,
            image,
        })
    }
}

/// Renders contenders, and reuses a scene for several of them if possible.
pub(super) struct ContenderRenderer<'a> {
    pub job: &'a Job,
    pub quiet: bool,
    /// Session whose scene is in memory, if any.
    pub session: Option<Session>,
}

impl ContenderRenderer<'_> {
    /// Renders all contenders that are not refused, until an interrupt.
    pub fn runs(
        &mut self,
        contenders: Vec<Contender>,
        budgets: &[Budget],
    ) -> Result<Vec<(Contender, ContenderRun)>, CliError> {
        let mut runs = Vec::new();
        let mut rest = contenders.into_iter().peekable();
        loop {
            if let Some(skipped) = rest.next_if(|next| next.refused.is_some() || is_interrupted()) {
                runs.push((skipped, ContenderRun::default()));
                continue;
            }
            let Some(first) = rest.peek() else { return Ok(runs) };
            let session = self.session_for(first)?;
            let renderer = session.renderer()?;
            while let Some(contender) = rest.next_if(|next| next.shares_scene(session.settings())) {
                let run = if contender.refused.is_some() || is_interrupted() {
                    ContenderRun::default()
                } else {
                    runs::run(&renderer, &contender, budgets, self.quiet)?
                };
                runs.push((contender, run));
            }
            drop(renderer);
            self.session = Some(session);
        }
    }

    /// A session with a scene that is valid for `contender`.
    fn session_for(&mut self, contender: &Contender) -> Result<Session, CliError> {
        let serves = |session: &Session| contender.shares_scene(session.settings());
        match self.session.take().filter(serves) {
            Some(session) => Ok(session),
            None => Ok(Session::load(&self.job.scene, contender.settings.clone(), &())?),
        }
    }

    /// Reference rendered by `contender` with more samples than `run`; `None` after an interrupt.
    pub fn reference(&mut self, contender: &Contender, run: &ContenderRun) -> Result<Option<Reference>, CliError> {
        let Some(last) = run.snapshots.last() else {
            return Ok(None);
        };
        let samples = last.samples.saturating_mul(REFERENCE_FACTOR);
        if !self.quiet {
            let seconds = last.seconds * f64::from(REFERENCE_FACTOR);
            errln!(
                "reference: {}, {samples} samples of another seed, about {seconds:.0} s",
                contender.name
            );
        }
        // Another seed makes the errors of the reference independent.
        let judge = Contender {
            name: contender.name.clone(),
            lesson: contender.lesson.clone(),
            settings: Settings {
                seed: contender.settings.seed.wrapping_add(1),
                denoiser: None,
                denoise_radius: None,
                ..contender.settings.clone()
            },
            refused: None,
        };
        let session = self.session_for(&judge)?;
        let renderer = session.renderer()?;
        let mut run = runs::run(&renderer, &judge, &[Budget::Samples(samples)], self.quiet)?;
        let whole = run.snapshots.pop().filter(|_| !run.is_interrupted);
        Ok(whole.map(|Snapshot { image, .. }| Reference {
            name: judge.name,
            samples: Some(samples),
            image,
        }))
    }
}
