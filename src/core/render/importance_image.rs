use super::cancellation::CountedRays;
use super::observer::Observer;
use super::statistics::RayCounts;
use super::work_items::in_work_items;
use crate::accel::Accel;
use crate::integrator::{ImportanceImage, ImportanceImageMaker};
use crate::sampler::Sampler;

/// Makes an importance image. Returns the image and the number of rays traced, or `None` if the
/// observer stops. The image is bit-identical for any number of threads.
pub fn importance_image<A: Accel, S: Sampler>(
    maker: &ImportanceImageMaker<A>,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(ImportanceImage, RayCounts)> {
    let work_item = |index, sampler: &mut S, rays: &mut CountedRays| maker.work_item(index, sampler, rays);
    let (work_items, rays) = in_work_items(ImportanceImageMaker::<A>::WORK_ITEMS, sampler, observer, work_item)?;
    Some((maker.join(&work_items), rays))
}
