//! The renders of a comparison: each contender takes samples until its budgets are spent, and
//! stores snapshots.
//!
//! Snapshots are taken at 1, 4, 16, 64, … samples per pixel and at the end of each budget. The film
//! of the main render ends only at cuts, which are sample counts between two passes
//! (`render/schedule.rs`). If a budget ends between two cuts, its last samples are added to a copy
//! of the film. The time of these samples counts only for the snapshot of this budget. If the
//! sampler depends on the total number of samples, each snapshot is rendered from the start.

use super::budget::{Budget, Step, is_mark};
use super::contenders::Contender;
use crate::cli::error::CliError;
use crate::cli::progress::{Progress, is_interrupted};
use crate::color::Tone;
use crate::film::{Film, Filter, RgbImage, metered};
use crate::integrator::World;
use crate::light_sampling::LightSelection;
use crate::options::ChosenIntegrator;
use crate::pipeline::AnyAccel;
use crate::render::{Outcome, StopCondition, last_cut};
use crate::sampler::RenderSampler;
use crate::session::{Preparation, RenderContext, Renderer, Session, Unfinished, denoise};
use std::time::Instant;

/// Picture of a contender after `samples` samples.
pub(super) struct Snapshot {
    /// Samples per pixel.
    pub samples: u32,
    /// Seconds of preparation, rendering and denoising.
    pub seconds: f64,
    pub image: RgbImage,
    /// Indices of the budgets that end here.
    pub budgets: Vec<usize>,
    /// relMSE against the reference; `None` without a reference.
    pub rel_mse: Option<f64>,
    /// relMSE of the means of 16 × 16 pixels.
    pub block_rel_mse: Option<f64>,
}

impl Snapshot {
    /// `1 / (relMSE × seconds)`.
    pub fn efficiency(&self) -> Option<f64> {
        Some(1.0 / (self.rel_mse? * self.seconds))
    }
}

/// Results of a contender.
#[derive(Default)]
pub(super) struct ContenderRun {
    /// Snapshots in the order of their samples.
    pub snapshots: Vec<Snapshot>,
    /// Tone of the contender's pictures. An automatic exposure is metered in the last picture.
    pub tone: Tone,
    /// True if an interrupt ended the render before all budgets were spent.
    pub is_interrupted: bool,
}

impl ContenderRun {
    /// Time of the first snapshot, and the largest budget that this time exceeds by more than a
    /// tenth; both in seconds. `None` if there is no such budget. The first snapshot always has one
    /// sample per pixel, even if this takes longer than a budget.
    pub fn overspent(&self, budgets: &[Budget]) -> Option<[f64; 2]> {
        let first = self.snapshots.first()?;
        let budgets = first.budgets.iter().filter_map(|&index| match budgets[index] {
            Budget::Seconds(seconds) if first.seconds > 1.1 * seconds => Some(seconds),
            _ => None,
        });
        Some([first.seconds, budgets.max_by(f64::total_cmp)?])
    }

    /// The snapshot at the end of the budget `index`.
    pub fn at(&self, index: usize) -> Option<&Snapshot> {
        self.snapshots.iter().find(|snapshot| snapshot.budgets.contains(&index))
    }
}

/// Renders `contender` until all `budgets`, in ascending order, are spent.
pub(super) fn run(
    renderer: &Renderer,
    contender: &Contender,
    budgets: &[Budget],
    quiet: bool,
) -> Result<ContenderRun, CliError> {
    let samples = match budgets.last() {
        Some(Budget::Samples(samples)) => *samples,
        _ => 0,
    };
    let pixels = contender.settings.crop().area();
    let progress = Progress::new(pixels * u64::from(samples), quiet || samples == 0);
    let mut run = ContenderRun::default();
    let spent = Estimate::new(renderer, contender, &progress).spend(budgets, &mut run);
    progress.finish();
    spent?;
    // After an interrupt, the last snapshot counts for the first budget that was not spent.
    if run.is_interrupted {
        let spent = run.snapshots.iter().flat_map(|snapshot| &snapshot.budgets).max();
        let next = spent.map_or(0, |spent| spent + 1);
        if let Some(last) = run.snapshots.last_mut().filter(|last| last.budgets.is_empty()) {
            last.budgets.push(next);
        }
    }
    Ok(run)
}

/// Error of a render that an interrupt has ended.
struct Interrupt;

/// A render that advances step by step.
struct Estimate<'a> {
    renderer: &'a Renderer<'a>,
    contender: &'a Contender,
    integrator: ChosenIntegrator,
    prepared: Preparation,
    /// Pixel filter of the contender.
    filter: Filter,
    /// Light selection of the contender. The time to learn the selection is a part of the time of
    /// the contender.
    light_selection: LightSelection,
    progress: &'a Progress,
    /// Seconds of the preparation before the first sample.
    preparing: f64,
    /// Sums of all samples up to a cut between two passes.
    film: Film,
    done: u32,
    /// Seconds for the preparation and for the samples on `film`.
    seconds: f64,
}

impl<'a> Estimate<'a> {
    fn new(renderer: &'a Renderer<'a>, contender: &'a Contender, progress: &'a Progress) -> Self {
        let settings = &contender.settings;
        Self {
            renderer,
            contender,
            integrator: contender.chosen_integrator(),
            prepared: Preparation::new(settings.resolution, settings.seed),
            filter: settings.filter(),
            light_selection: renderer
                .session()
                .scene()
                .light_selection(contender.chosen_integrator().light_choice()),
            progress,
            preparing: 0.0,
            film: Film::new(settings.resolution, settings.crop()),
            done: 0,
            seconds: 0.0,
        }
    }

    /// Spends all budgets, and stores their snapshots and the snapshots of the curve in `run`.
    fn spend(&mut self, budgets: &[Budget], run: &mut ContenderRun) -> Result<(), CliError> {
        if self.prepare().is_err() {
            run.is_interrupted = true;
            return Ok(());
        }
        for (index, budget) in budgets.iter().enumerate() {
            loop {
                let Step { end, is_last } = budget.step(self.done, self.seconds);
                if run.snapshots.last().is_none_or(|last| last.samples < end) {
                    let Ok((copy, seconds)) = self.advance(end) else {
                        run.is_interrupted = true;
                        return Ok(());
                    };
                    if is_last || is_mark(end) {
                        let film = copy.as_ref().unwrap_or(&self.film);
                        let Some(snapshot) = self.snapshot(film, end, seconds, run)? else {
                            run.is_interrupted = true;
                            return Ok(());
                        };
                        run.snapshots.push(snapshot);
                    }
                }
                if is_last {
                    // A budget that is hardly larger than the previous budget may end at the same
                    // snapshot.
                    run.snapshots
                        .last_mut()
                        .into_iter()
                        .for_each(|last| last.budgets.push(index));
                    break;
                }
            }
        }
        Ok(())
    }

    /// Takes the samples before `end`, which is at least `done`. Returns the time of these samples
    /// in seconds. The samples are added to `film`, or to a returned copy of `film`.
    fn advance(&mut self, end: u32) -> Result<(Option<Film>, f64), Interrupt> {
        if self.contender.settings.sampler.needs_count() || self.integrator.needs_count() {
            let mut film = self.new_film();
            self.seconds = self.preparing + self.take(&mut film, end)?;
            (self.film, self.done) = (film, end);
            return Ok((None, self.seconds));
        }
        let cut = last_cut(end);
        if cut > self.done {
            let empty = self.new_film();
            let mut film = std::mem::replace(&mut self.film, empty);
            self.seconds += self.take(&mut film, cut)?;
            (self.film, self.done) = (film, cut);
        }
        if end == self.done {
            return Ok((None, self.seconds));
        }
        let mut film = self.film.clone();
        let seconds = self.take(&mut film, end)?;
        Ok((Some(film), self.seconds + seconds))
    }

    fn new_film(&self) -> Film {
        Film::new(self.contender.settings.resolution, self.contender.settings.crop())
    }

    /// Computes the data that must exist before the first sample.
    fn prepare(&mut self) -> Result<(), Interrupt> {
        let start = Instant::now();
        let sampler = self.sampler(self.contender.settings.spp);
        let session = self.session();
        let context = self.context();
        let (outcome, _) = session.install(|| self.integrator.prepare(context, &sampler, self.progress));
        self.preparing = start.elapsed().as_secs_f64();
        self.seconds = self.preparing;
        whole(outcome)
    }

    /// Adds the samples before `end` to `film`, and returns the seconds that they took.
    fn take(&self, film: &mut Film, end: u32) -> Result<f64, Interrupt> {
        let start = Instant::now();
        let (session, sampler) = (self.session(), self.sampler(end));
        let (context, stop) = (self.context(), StopCondition::at(end));
        let render = || self.integrator.render(context, &sampler, film, stop, self.progress);
        let (outcome, _) = session.install(render);
        let seconds = start.elapsed().as_secs_f64();
        whole(outcome).map(|()| seconds)
    }

    /// The picture of `film`, denoised if requested; `None` after an interrupt.
    fn snapshot(
        &self,
        film: &Film,
        samples: u32,
        seconds: f64,
        run: &mut ContenderRun,
    ) -> Result<Option<Snapshot>, CliError> {
        let settings = &self.contender.settings;
        let start = Instant::now();
        let image = match denoise(settings, film.develop(), &is_interrupted) {
            Ok((image, _)) => image,
            Err(Unfinished::Cancelled) => return Ok(None),
            Err(Unfinished::Failed(error)) => {
                let name = &self.contender.name;
                return Err(CliError::Failed(format!("{name}: {error}")));
            }
        };
        let denoising = settings.denoiser.map_or(0.0, |_| start.elapsed().as_secs_f64());
        run.tone = metered(settings.tone, &image);
        Ok(Some(Snapshot {
            samples,
            seconds: seconds + denoising,
            image: RgbImage::from(&image),
            budgets: Vec::new(),
            rel_mse: None,
            block_rel_mse: None,
        }))
    }

    /// The world of the session with the contender's filter and light selection.
    fn world(&self) -> World<'_, AnyAccel<'a>> {
        World {
            filter: &self.filter,
            light_selection: &self.light_selection,
            ..self.session().world(self.renderer.accel())
        }
    }

    fn context(&self) -> RenderContext<'_, AnyAccel<'a>> {
        RenderContext {
            world: self.world(),
            prepared: &self.prepared,
        }
    }

    fn session(&self) -> &'a Session {
        self.renderer.session()
    }

    /// The contender's random numbers for `count` samples per pixel.
    fn sampler(&self, count: u32) -> RenderSampler {
        let settings = &self.contender.settings;
        self.integrator.sampler(settings.sampler, settings.seed, count)
    }
}

/// Returns an error unless all samples were taken.
fn whole(outcome: Outcome) -> Result<(), Interrupt> {
    match outcome {
        Outcome::Complete => Ok(()),
        Outcome::Stopped => Err(Interrupt),
    }
}
