use super::cancellation::CountedRays;
use super::observer::Observer;
use super::statistics::RayCounts;
use crate::sampler::Sampler;
use rayon::prelude::*;

/// What `piece` makes of each index below `count`, in their order, and how many rays it took; `None` where the observer asked to stop.
pub(super) fn in_pieces<T: Send, S: Sampler>(
    count: u32,
    sampler: &S,
    observer: &impl Observer,
    piece: impl Fn(u32, &mut S, &mut CountedRays) -> T + Sync,
) -> Option<(Vec<T>, RayCounts)> {
    let pieces = (0..count).into_par_iter().map(|index| {
        if observer.should_stop() {
            return None;
        }
        let mut rays = CountedRays::new(observer);
        let made = piece(index, &mut sampler.clone(), &mut rays);
        (!rays.cancellation.is_cancelled()).then_some((made, rays.counts))
    });
    let pieces: Vec<(T, RayCounts)> = pieces.collect::<Option<_>>()?;
    let (pieces, rays): (Vec<_>, Vec<_>) = pieces.into_iter().unzip();
    Some((pieces, rays.into_iter().fold(RayCounts::default(), RayCounts::plus)))
}
