use super::cancellation::CountedRays;
use super::observer::Observer;
use super::statistics::RayCounts;
use super::work_items::in_work_items;
use crate::accel::Accel;
use crate::integrator::VisibilityLearner;
use crate::light_sampling::VisibilityGrid;
use crate::sampler::Sampler;

/// Learns which part of the sky is visible from surfaces. Returns the visibility grid and the
/// number of rays traced, or `None` if the observer stops. The grid is `None` if sampling by
/// visibility would not reduce the noise. The result is bit-identical for any number of threads.
pub fn learn_visibility<A: Accel, S: Sampler>(
    learner: &VisibilityLearner<A>,
    sampler: &S,
    observer: &impl Observer,
) -> Option<(Option<VisibilityGrid>, RayCounts)> {
    let paths = |index, _: &mut S, rays: &mut CountedRays| learner.find_sites(index, rays);
    let (found, rays) = in_work_items(learner.site_work_items(), sampler, observer, paths)?;
    let sites = learner.join(found);
    let Some(grid) = learner.grid(&sites) else {
        return Some((None, rays));
    };
    let places = learner.places(&grid, &sites.sites);
    let group = |index, _: &mut S, rays: &mut CountedRays| learner.trace_from_groups(&grid, &places, index, rays);
    let (groups, of_groups) = in_work_items(learner.trace_work_items(places.groups()), sampler, observer, group)?;
    let groups = groups.concat();
    let cell =
        |index, _: &mut S, rays: &mut CountedRays| learner.trace_from_cells(&grid, &places, &groups, index, rays);
    let (cells, of_cells) = in_work_items(learner.trace_work_items(grid.cells()), sampler, observer, cell)?;
    let grid = grid.with_visibility(&cells.concat(), places.counts());
    Some((Some(grid), rays.plus(of_groups).plus(of_cells)))
}
