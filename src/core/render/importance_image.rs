use super::cancellation::CountedRays;
use super::observer::Observer;
use super::pieces::in_pieces;
use super::statistics::RayCounts;
use crate::accel::Accel;
use crate::integrator::{ImportanceImage, ImportanceImageMaker};
use crate::sampler::Sampler;

/// Makes an importance image; `None` where the observer asked to stop. It is the same to the bit for any number of threads.
pub fn importance_image<A: Accel, S: Sampler>(
    maker: &ImportanceImageMaker<A>,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(ImportanceImage, RayCounts)> {
    let piece = |index, sampler: &mut S, rays: &mut CountedRays| maker.piece(index, sampler, rays);
    let (pieces, rays) = in_pieces(ImportanceImageMaker::<A>::PIECES, sampler, observer, piece)?;
    Some((maker.join(&pieces), rays))
}
