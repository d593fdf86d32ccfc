//! Photon maps, made once before the first sample of a render; crops and parts of a render have the photons of the whole picture.

use super::observer::Observer;
use super::pieces::in_pieces;
use super::statistics::RayCounts;
use crate::accel::Accel;
use crate::integrator::{PhotonMaps, PhotonTracer};
use crate::sampler::Sampler;

/// Sends `paths` paths of photons, and makes maps of what they leave; what `tracer` leaves out is not in them. `None` where the observer asked to
/// stop.
///
/// They are the same to the bit for any number of threads, for crops and for parts of a render: photons depend on the number of their path alone.
pub fn photon_maps<A: Accel, S: Sampler>(
    tracer: &PhotonTracer<A>,
    paths: u32,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(PhotonMaps, RayCounts)> {
    let (pieces, rays) = in_pieces(
        PhotonTracer::<A>::pieces(paths),
        sampler,
        observer,
        |index, sampler, rays| tracer.piece((0, index), paths, None, sampler, rays),
    )?;
    let photons = pieces.into_iter().flatten().collect();
    Some((PhotonMaps::new(photons, paths, tracer.slices(paths)), rays))
}
