//! Photon maps, made once before the first sample of a render. Crops and parts of a render have the
//! photons of the whole image.

use super::observer::Observer;
use super::statistics::RayCounts;
use super::work_items::in_work_items;
use crate::accel::Accel;
use crate::integrator::{PhotonMaps, PhotonTracer, PhotonWorkItem};
use crate::sampler::Sampler;

/// Traces `paths` photon paths and makes maps of their photons. Photons that `tracer` omits are not
/// stored. Returns the maps and the number of rays traced, or `None` if the observer stops.
///
/// The maps are bit-identical for any number of threads, for crops and for parts of a render,
/// because photons depend only on the index of their path.
pub fn photon_maps<A: Accel, S: Sampler>(
    tracer: &PhotonTracer<A>,
    paths: u32,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(PhotonMaps, RayCounts)> {
    let (work_items, rays) = in_work_items(
        PhotonTracer::<A>::work_items(paths),
        sampler,
        observer,
        |index, sampler, rays| {
            let item = PhotonWorkItem {
                iteration: 0,
                index,
                paths,
            };
            tracer.work_item(item, None, sampler, rays)
        },
    )?;
    let photons = work_items.into_iter().flatten().collect();
    Some((PhotonMaps::new(photons, paths, tracer.slices(paths)), rays))
}
