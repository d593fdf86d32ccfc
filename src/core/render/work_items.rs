use super::cancellation::CountedRays;
use super::observer::Observer;
use super::statistics::RayCounts;
use crate::sampler::Sampler;
use rayon::prelude::*;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs `work_item` for each index below `count`. Returns the results in the order of the indices,
/// and the number of rays. Returns `None` if the observer stops.
pub(super) fn in_work_items<T: Send, S: Sampler>(
    count: u32,
    sampler: &S,
    observer: &impl Observer,
    work_item: impl Fn(u32, &mut S, &mut CountedRays) -> T + Sync,
) -> Option<(Vec<T>, RayCounts)> {
    let work_items: Vec<(T, RayCounts)> = map_indices(count as usize, |index| {
        if observer.should_stop() {
            return None;
        }
        let mut rays = CountedRays::new(observer);
        let made = work_item(index as u32, &mut sampler.clone(), &mut rays);
        (!rays.cancellation.is_cancelled()).then_some((made, rays.counts))
    })?;
    let (work_items, rays): (Vec<_>, Vec<_>) = work_items.into_iter().unzip();
    Some((work_items, rays.into_iter().fold(RayCounts::default(), RayCounts::plus)))
}

/// Runs `task` for each index below `count` in the current rayon pool. Returns the results in the
/// order of their indices, or `None` if any result is `None`.
///
/// Each result has a separate lock, whose time is negligible only for long tasks. The iterators of
/// rayon would be compiled again for each kind of task, which took 7 % of the time to compile this
/// crate.
pub(super) fn map_indices<T: Send>(count: usize, task: impl Fn(usize) -> Option<T> + Sync) -> Option<Vec<T>> {
    let results: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::new(None)).collect();
    let is_cut = AtomicBool::new(false);
    for_each_index(count, &|index| {
        if is_cut.load(Ordering::Relaxed) {
            return;
        }
        let result = task(index);
        if result.is_none() {
            is_cut.store(true, Ordering::Relaxed);
        }
        if let Ok(mut slot) = results[index].lock() {
            *slot = result;
        }
    });
    results
        .into_iter()
        .map(|slot| slot.into_inner().ok().flatten())
        .collect()
}

/// Calls `task` for each index below `count` in the current rayon pool.
fn for_each_index(count: usize, task: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().with_max_len(1).for_each(task);
}
