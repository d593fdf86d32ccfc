use super::statistics::RayCounts;
use super::tiles::Observer;
use crate::accel::Accel;
use crate::integrator::{Photon, PhotonMaps, PhotonTracer};
use crate::sampler::Sampler;
use rayon::prelude::*;

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
    let pieces = (0..PhotonTracer::<A>::pieces(paths)).into_par_iter().map(|index| {
        if observer.should_stop() {
            return None;
        }
        let mut rays = RayCounts::default();
        let photons = tracer.piece((0, index), paths, None, &mut sampler.clone(), &mut rays);
        Some((photons, rays))
    });
    let pieces: Vec<(Vec<Photon>, RayCounts)> = pieces.collect::<Option<_>>()?;
    let rays = pieces
        .iter()
        .fold(RayCounts::default(), |sum, (_, rays)| sum.plus(*rays));
    let photons = pieces.into_iter().flat_map(|(photons, _)| photons).collect();
    Some((PhotonMaps::new(photons, paths), rays))
}
