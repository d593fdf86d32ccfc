//! Pictures of several views: each view has its camera and its light selection, and all views
//! advance together.

use super::Renderer;
use crate::film::{BLOCK, Film};
use crate::integrator::World;
use crate::light_sampling::LightSelection;
use crate::render::{self, Outcome, Statistics, StopCondition};
use crate::session::{AnyAccel, Preparation, RenderContext, Session};
use std::ops::Range;

/// Function that adds samples to the film of a view until the stop condition is fulfilled.
pub(super) type ViewRender<'r, 'a> =
    dyn Fn(RenderContext<'_, AnyAccel<'a>>, &mut Film, StopCondition) -> (Outcome, Statistics) + 'r;

/// Data that the samples of a view share.
pub(super) struct ViewData {
    /// Selection of lights, with the visibility of lights that is learned for the view.
    light_selection: LightSelection,
    pub prepared: Preparation,
}

impl ViewData {
    /// New data of each view of the session's picture; empty if the picture has one view.
    pub fn of(session: &Session) -> Vec<Self> {
        if session.views().len() == 1 {
            return Vec::new();
        }
        let settings = session.settings();
        let new = |_| Self {
            light_selection: session
                .scene()
                .light_selection(settings.chosen_integrator().light_choice()),
            prepared: Preparation::new(session.view_size(), settings.seed),
        };
        session.views().iter().map(new).collect()
    }
}

/// Stages of a render with several views. All views take the samples of a stage before the next
/// stage begins. The views of a stopped render therefore have similar numbers of samples, and no
/// view is without samples. The stages end between passes, where a render can stop and resume
/// without repeated work. With a noise level, each view must reach the level separately. The last
/// stage does this, and the stages before it have the samples that every pixel gets in any case:
/// two blocks.
fn stages(samples: Range<u32>, noise: Option<f64>) -> Vec<StopCondition> {
    let first = render::passes(samples.clone()).next().map(|pass| pass.end);
    let growth = if noise.is_none() { 4 } else { 2 };
    let later = std::iter::successors(Some(BLOCK), |end| end.checked_mul(growth));
    let later = later.skip_while(|&stage| stage <= samples.start);
    let later = later.take_while(|&stage| stage < samples.end && (noise.is_none() || stage <= 2 * BLOCK));
    let mut ends: Vec<u32> = first.into_iter().chain(later).collect();
    ends.dedup();
    ends.retain(|&end| end < samples.end);
    let last = StopCondition {
        end: samples.end,
        noise,
    };
    ends.into_iter().map(StopCondition::at).chain([last]).collect()
}

impl<'a> Renderer<'a> {
    /// Renders each view of `film` by `render`, or the film itself if there is one view.
    pub(super) fn render_views(&self, film: &mut Film, render: &ViewRender<'_, 'a>) -> (Outcome, Statistics) {
        let stop = self.session.settings().stop();
        if self.views.is_empty() {
            return render(self.context(), film, stop);
        }
        let mut statistics = Statistics::default();
        for stage in stages(film.first_sample()..stop.end, stop.noise) {
            for (index, (view, data)) in self.session.views().iter().zip(&self.views).enumerate() {
                let context = RenderContext {
                    world: World {
                        camera: &view.camera,
                        light_selection: &data.light_selection,
                        ..self.world()
                    },
                    prepared: &data.prepared,
                };
                let done = film.with_view(index, |film| {
                    let is_behind =
                        stage.noise.is_some() || film.tiles().iter().any(|tile| tile.next_sample() < stage.end);
                    is_behind.then(|| render(context, film, stage))
                });
                // The crop does not contain the view, or the view has all samples
                let Some((outcome, mut taken)) = done.flatten() else {
                    continue;
                };
                for sample in &mut taken.first_dropped {
                    sample.key.x += view.corner.x;
                    sample.key.y += view.corner.y;
                }
                statistics = statistics.merge(taken);
                if outcome == Outcome::Stopped {
                    return (outcome, statistics);
                }
            }
        }
        (Outcome::Complete, statistics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_begin_with_one_pass() {
        let ends = |samples: Range<u32>| -> Vec<u32> {
            let stages = stages(samples.clone(), None);
            assert!(stages.iter().all(|stage| stage.noise.is_none()));
            stages.iter().map(|stage| stage.end).collect()
        };
        assert_eq!(ends(0..1), [1]);
        assert_eq!(ends(0..300), [1, 64, 256, 300]);
        assert_eq!(ends(60..256), [64, 256]);
        assert_eq!(ends(100..3000), [128, 256, 1024, 3000]);
        let to_noise = |end: u32| StopCondition { end, noise: Some(0.1) };
        let at = StopCondition::at;
        assert_eq!(stages(0..3000, Some(0.1)), [at(1), at(64), at(128), to_noise(3000)]);
        assert_eq!(stages(0..100, Some(0.1)), [at(1), at(64), to_noise(100)]);
    }
}
