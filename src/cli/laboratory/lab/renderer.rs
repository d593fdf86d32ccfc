//! Runs the renders of all contenders, and the render of the reference. Successive contenders use
//! the same scene in memory, if possible.

use super::budget::Budget;
use super::contenders::Contender;
use super::runs::{self, ContenderRun};
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::cli::progress::is_interrupted;
use crate::compare::Errors;
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
    /// relMSE of `image` by its own noise; `None` if the reference is a file.
    pub rel_mse: Option<f64>,
}

impl Reference {
    /// Mean of two pictures of the same scene with `samples` samples each, of different seeds.
    fn of_halves(name: String, samples: u32, halves: [RgbImage; 2]) -> Self {
        let [first, second] = &halves;
        let image = mean_of(first, second);
        // The squared difference between a half and the mean is, on average, the squared error of
        // the mean: (a − b)² / 4 has the mean (V + V) / 4 = V / 2 if each half has the variance V.
        let rel_mse = Errors::new(first, &image).ok().map(|errors| errors.rel_mse);
        Self {
            name,
            samples: Some(samples.saturating_mul(2)),
            image,
            rel_mse,
        }
    }

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
            rel_mse: None,
        })
    }
}

/// Mean of two pictures of the same size.
pub(super) fn mean_of(first: &RgbImage, second: &RgbImage) -> RgbImage {
    let pairs = first.pixels.iter().zip(&second.pixels);
    let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
    RgbImage {
        pixels: pairs.map(mean).collect(),
        ..*first
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
    pub fn session_for(&mut self, contender: &Contender) -> Result<Session, CliError> {
        let serves = |session: &Session| contender.shares_scene(session.settings());
        match self.session.take().filter(serves) {
            Some(session) => Ok(session),
            None => Ok(Session::load(&self.job.scene, contender.settings.clone(), &())?),
        }
    }

    /// Reference rendered by `contender` with more samples than `run`, as the mean of two halves;
    /// `None` after an interrupt.
    pub fn reference(&mut self, contender: &Contender, run: &ContenderRun) -> Result<Option<Reference>, CliError> {
        let Some(last) = run.snapshots.last() else {
            return Ok(None);
        };
        let samples = last.samples.saturating_mul(REFERENCE_FACTOR / 2);
        if !self.quiet {
            let seconds = last.seconds * f64::from(REFERENCE_FACTOR);
            errln!(
                "reference: {}, {} samples of other seeds, about {seconds:.0} s",
                contender.name,
                u64::from(samples) * 2
            );
        }
        let [Some(first), Some(second)] = [
            self.picture(&contender.with_seed(1), samples)?,
            self.picture(&contender.with_seed(2), samples)?,
        ] else {
            return Ok(None);
        };
        Ok(Some(Reference::of_halves(
            contender.name.clone(),
            samples,
            [first, second],
        )))
    }

    /// Picture of `contender` with `samples` samples per pixel; `None` after an interrupt.
    pub fn picture(&mut self, contender: &Contender, samples: u32) -> Result<Option<RgbImage>, CliError> {
        if is_interrupted() {
            return Ok(None);
        }
        let session = self.session_for(contender)?;
        let renderer = session.renderer()?;
        let mut run = runs::run(&renderer, contender, &[Budget::Samples(samples)], self.quiet)?;
        drop(renderer);
        self.session = Some(session);
        let whole = run.snapshots.pop().filter(|_| !run.is_interrupted);
        Ok(whole.map(|snapshot| snapshot.image))
    }
}
