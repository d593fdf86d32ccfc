use super::cancellation::CountedRays;
use super::pieces::in_pieces;
use super::statistics::RayCounts;
use super::tiles::Observer;
use crate::accel::Accel;
use crate::integrator::{TestPicture, TestPictureMaker};
use crate::sampler::Sampler;

/// Makes a test picture; `None` where the observer asked to stop. It is the same to the bit for any number of threads.
pub fn test_picture<A: Accel, S: Sampler>(
    maker: &TestPictureMaker<A>,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(TestPicture, RayCounts)> {
    let piece = |index, sampler: &mut S, rays: &mut CountedRays| maker.piece(index, sampler, rays);
    let (pieces, rays) = in_pieces(TestPictureMaker::<A>::PIECES, sampler, observer, piece)?;
    Some((maker.join(&pieces), rays))
}
