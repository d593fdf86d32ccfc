//! Rendering of an iteration with a record of its paths, for `embrasure paths`.

use super::{CountedRays, IterationTarget, IterationWork, WorkItem, in_work_items};
use crate::color::Spectrum;
use crate::film::{Filter, Rect};
use crate::integrator::{IterationIntegrator, PathEvent};
use crate::math::UVec2;
use crate::sampler::{SampleKey, Sampler};

/// Recorded path events of one sample or of one Markov chain of an iteration.
#[derive(Clone, Debug)]
pub struct SampleRecord {
    /// Key of the sample. For a chain, the column is the number of the chain, and the row is a
    /// number that no image has.
    pub key: SampleKey,
    /// Path events in the order in which the integrator recorded them.
    pub events: Vec<PathEvent>,
    /// Filter weight of the sample's light in its own pixel.
    pub weight: f32,
    /// Light that the sample or chain adds to the requested pixel.
    pub light: Spectrum,
}

/// Renders iteration `index` on the calling thread; only the preparation may use other threads.
/// Calls `keep` with the record of each sample and chain that contributes to the pixel `pixel`, and
/// with the record of the pixel's own sample. The image has `resolution` pixels.
pub fn record_iteration<I: IterationIntegrator, S: Sampler>(
    integrator: &I,
    (sampler, filter): (&S, &Filter),
    (resolution, pixel): (UVec2, UVec2),
    index: u32,
    keep: &mut dyn FnMut(SampleRecord),
) {
    let observer = &();
    let prepare = |part, sampler: &mut S, rays: &mut CountedRays| integrator.prepare(index, part, sampler, rays);
    let Some((parts, _)) = in_work_items(integrator.preparations(), sampler, observer, prepare) else {
        return;
    };
    let prepared = integrator.join(index, parts);
    let of_pixel = |pixel: UVec2| Rect {
        min: pixel,
        max: pixel + UVec2::ONE,
    };
    let target = IterationTarget {
        filter,
        groups: 0,
        before_paths: 0,
        resolution,
        crop: of_pixel(pixel),
        repeats: integrator.repeats(),
    };
    let seen = if integrator.sends_light() {
        Rect::full(resolution)
    } else {
        of_pixel(pixel)
    };
    let pixels = seen.pixels().map(|pixel| IterationWork::Pixels(of_pixel(pixel)));
    for work in pixels.chain((0..integrator.chains()).map(IterationWork::Chain)) {
        let mut work_item = WorkItem::new(target, observer);
        work_item.record = Some(Vec::new());
        let Some(work_item) = work_item.of(integrator, &prepared, (work, index), sampler, observer) else {
            return;
        };
        let light = work_item
            .light
            .iter()
            .fold(Spectrum::ZERO, |sum, (_, light)| sum + *light);
        if work_item.key.pixel() == pixel || !light.is_black() {
            keep(SampleRecord {
                key: work_item.key,
                events: work_item.record.unwrap_or_default(),
                weight: work_item.weight,
                light,
            });
        }
    }
}
