//! Rendering of iterations, for methods whose light paths contribute to any pixel
//! (`IterationIntegrator`).
//!
//! The work of an iteration is divided into work items: blocks of pixels, and Markov chains. Work
//! items run on any number of threads. Their light is added in the order of the work items, so that
//! plain f64 sums have the same bits for any number of threads. At most `WORK_ITEMS_AT_ONCE` items
//! keep their light at the same time.
//!
//! If a render stops, an incomplete iteration is discarded, like the work of a tile. A pause, in
//! which files are written, waits for the end of the iteration instead (`Observer::should_pause`).
//! Errors of different iterations are independent, so the accumulator of a pixel needs no blocks of
//! 64 samples (`Accumulator::add_alone`).

use super::cancellation::{Cancellation, CountedRays};
use super::light_parts::LightParts;
use super::observer::{Observer, Outcome, should_leave};
use super::statistics::{DroppedSample, Statistics};
use super::stop_condition::StopCondition;
use super::tiles::MANY_RAYS;
use super::work_items::{in_work_items, map_indices};
use crate::color::Spectrum;
use crate::film::{BLOCK, Film, Filter, FirstSurface, Iteration, Rect, Tile};
use crate::integrator::{
    CameraView, ChainCounts, FoundLight, IterationIntegrator, PathEvent, RayKind, RaySink, Sink, SplatSink,
};
use crate::math::{UVec2, Vec2};
use crate::sampler::{SampleKey, Sampler};

mod record;

pub use record::{SampleRecord, record_iteration};

/// Maximum number of work items whose light is kept until all earlier work items are added. This
/// limits memory, and does not change the image.
const WORK_ITEMS_AT_ONCE: usize = 128;
/// Approximate maximum size of the kept light, in bytes. Each thread keeps at least one work item,
/// even if its light is larger.
const BYTES_AT_ONCE: usize = 128 << 20;
/// Approximate number of samples in a work item, and of splats per sample. Both are used to
/// estimate the size of a work item's light.
const SAMPLES_OF_A_WORK_ITEM: usize = 256;
const LIGHTS_OF_A_SAMPLE: usize = 8;

/// Number of pixels of a work item between two calls of the observer. Fewer pixels would make the
/// calls expensive; more pixels would delay a stop.
const PIXELS_BETWEEN_CHECKS: usize = 4;

/// Adds iterations to `film`, after the existing iterations, until the stop condition holds. The
/// error of the condition is compared with the estimated error of the image.
///
/// The result is bit-identical for any number of threads, because the light of a work item depends
/// only on its index, and work items are added in order. If the observer stops, the incomplete
/// iteration is discarded; if it pauses, the iteration is completed first. The error is checked at
/// the ends of sample blocks, as in [`render_samples`](super::render_samples), but only for the
/// whole image, because light paths contribute to any pixel.
pub fn render_iterations<I: IterationIntegrator, S: Sampler>(
    integrator: &I,
    (sampler, filter): (&S, &Filter),
    film: &mut Film,
    StopCondition { end, noise }: StopCondition,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let mut statistics = Statistics::default();
    let start = film.tiles().iter().map(Tile::next_sample).min().unwrap_or(end);
    for index in start..end {
        let taken = index - film.first_sample();
        if let Some(level) = noise.filter(|_| taken >= 2 * BLOCK && taken % BLOCK == 0) {
            if film.error() <= level * level {
                break;
            }
        }
        let done = iteration(integrator, (sampler, filter), film, index, observer);
        let Some((iteration, done)) = done else {
            return (Outcome::Stopped, statistics);
        };
        film.add_iteration(&iteration);
        statistics = statistics.merge(done);
        observer.passed(film);
        if index + 1 < end && should_leave(observer) {
            return (Outcome::Stopped, statistics);
        }
    }
    (Outcome::Complete, statistics)
}

/// Number of light groups that `film` separates. Light groups are the first parts of the film,
/// before strategies and light paths.
fn groups_of(film: &Film, integrator: &impl IterationIntegrator) -> usize {
    film.parts_before_paths().saturating_sub(2 * integrator.strategies())
}

/// Maximum size of the light of one splat, in bytes: one entry for each pixel of `crop` that the
/// filter reaches. If groups are separated, each pixel has a second entry for the group.
fn light_bytes(separates_groups: bool, filter: &Filter, crop: Rect) -> usize {
    let side = (2.0 * filter.radius()).ceil().max(1.0) as usize;
    let pixels = side.saturating_mul(side).min(crop.area() as usize);
    let group = if separates_groups {
        size_of::<(UVec2, usize, Spectrum)>()
    } else {
        0
    };
    pixels.saturating_mul(size_of::<(UVec2, Spectrum)>() + group)
}

/// Number of work items that are kept at the same time with `threads` threads. `light` is the size
/// of the light of a splat, in bytes.
fn work_items_at_once(light: usize, threads: usize) -> usize {
    let work_item = light.saturating_mul(SAMPLES_OF_A_WORK_ITEM * LIGHTS_OF_A_SAMPLE);
    (BYTES_AT_ONCE / work_item.max(1)).max(threads).min(WORK_ITEMS_AT_ONCE)
}

/// A work item of an iteration.
#[derive(Clone, Copy)]
enum IterationWork {
    /// Samples of a block of pixels.
    Pixels(Rect),
    Chain(u32),
}

/// Renders the iteration with index `index`. Returns `None` if the observer stops.
fn iteration<I: IterationIntegrator, S: Sampler>(
    integrator: &I,
    (sampler, filter): (&S, &Filter),
    film: &Film,
    index: u32,
    observer: &impl Observer,
) -> Option<(Iteration, Statistics)> {
    // Prepare the data that all work items share
    let prepare = |part, sampler: &mut S, rays: &mut CountedRays| integrator.prepare(index, part, sampler, rays);
    let (parts, rays) = in_work_items(integrator.preparations(), sampler, observer, prepare)?;
    let mut statistics = Statistics {
        rays,
        ..Statistics::default()
    };
    let prepared = integrator.join(index, parts);

    // Run all work items, in batches
    let seen = if integrator.sends_light() {
        Film::cells(film.resolution(), Rect::full(film.resolution()))
    } else {
        Film::cells(film.resolution(), film.crop())
    };
    let cells = seen.into_iter().map(IterationWork::Pixels);
    let work: Vec<IterationWork> = cells
        .chain((0..integrator.chains()).map(IterationWork::Chain))
        .collect();
    let target = IterationTarget {
        filter,
        groups: groups_of(film, integrator),
        before_paths: film.parts_before_paths(),
        resolution: film.resolution(),
        crop: film.crop(),
        repeats: integrator.repeats(),
    };
    let mut iteration = Iteration::of(film);
    let mut done = 0;
    let light = light_bytes(target.groups > 0, filter, film.crop());
    for batch in work.chunks(work_items_at_once(light, rayon::current_num_threads())) {
        let work_items: Vec<WorkItem> = map_indices(batch.len(), |i| {
            let work_item = WorkItem::new(target, observer);
            work_item.of(integrator, &prepared, (batch[i], index), sampler, observer)
        })?;
        for work_item in work_items {
            statistics = statistics.merge(work_item.add_to(&mut iteration));
        }
        // Report progress, in samples
        let before = done;
        done += batch.len() as u64;
        let share = |work_items: u64| film.crop().area() * work_items / work.len() as u64;
        observer.progress(share(done) - share(before));
    }
    statistics.samples = film.crop().area();
    Some((iteration, statistics))
}

/// Properties of the film that receives the light of an iteration, and the pixel filter.
#[derive(Clone, Copy)]
struct IterationTarget<'a> {
    filter: &'a Filter,
    /// Number of light groups. Groups are the first parts of the light. Strategies follow, each
    /// with a weighted and an unweighted part.
    groups: usize,
    /// Number of parts of the light before the first class of light paths.
    before_paths: usize,
    resolution: UVec2,
    crop: Rect,
    /// True if the image is a panorama whose film positions repeat
    /// ([`IterationIntegrator::repeats`]).
    repeats: bool,
}

/// Sink that collects the light of a work item, and the result of the work item.
struct WorkItem<'a> {
    target: IterationTarget<'a>,
    light: Vec<(UVec2, Spectrum)>,
    /// Light of parts: pixel, index of the part, and light. Parts are light groups, strategies and
    /// classes of light paths.
    parts: Vec<(UVec2, usize, Spectrum)>,
    surfaces: Vec<(UVec2, FirstSurface)>,
    /// Pixels of samples that lie on lines.
    lines: Vec<UVec2>,
    /// Pixels of samples that show the background, and the fraction of each sample that shows the
    /// background, per channel.
    backgrounds: Vec<(UVec2, Spectrum)>,
    statistics: Statistics,
    /// Key and filter weight of the current sample, and its light in its own pixel.
    key: SampleKey,
    weight: f32,
    radiance: Spectrum,
    /// Light of each group in the sample's own pixel, if groups are separated.
    groups: Option<LightParts<'static>>,
    view: Option<CameraView>,
    cancellation: Cancellation<'a>,
    /// Path events of the work item, if they are recorded.
    record: Option<Vec<PathEvent>>,
}

impl<'a> WorkItem<'a> {
    fn new(target: IterationTarget<'a>, observer: &'a impl Observer) -> Self {
        Self {
            target,
            light: Vec::new(),
            parts: Vec::new(),
            surfaces: Vec::new(),
            lines: Vec::new(),
            backgrounds: Vec::new(),
            statistics: Statistics::default(),
            key: SampleKey::new(0, 0, 0),
            weight: 1.0,
            radiance: Spectrum::ZERO,
            groups: (target.groups > 0).then(|| LightParts::new(None)),
            view: None,
            cancellation: Cancellation::new(observer),
            record: None,
        }
    }

    /// Runs the work item `work`. Returns `None` if the observer stops.
    fn of<I: IterationIntegrator>(
        mut self,
        integrator: &I,
        prepared: &I::Preparation,
        (work, index): (IterationWork, u32),
        sampler: &impl Sampler,
        observer: &impl Observer,
    ) -> Option<Self> {
        let mut sampler = sampler.clone();
        match work {
            IterationWork::Pixels(cell) => {
                let mut rays_before = 0;
                for (i, pixel) in cell.pixels().enumerate() {
                    let rays = self.statistics.rays.total();
                    let is_slow = rays - rays_before > MANY_RAYS;
                    rays_before = rays;
                    if (is_slow || i % PIXELS_BETWEEN_CHECKS == 0) && observer.should_stop() {
                        return None;
                    }
                    self.key = SampleKey::new(pixel.x, pixel.y, index);
                    self.weight = 1.0;
                    integrator.sample(prepared, self.key, &mut sampler, &mut self);
                    let mut radiance = std::mem::take(&mut self.radiance);
                    let groups = self.groups.as_mut();
                    let mut groups = groups.map(|groups| std::mem::replace(groups, LightParts::new(None)));
                    if let Some(view) = self.view.take() {
                        if let Some(groups) = &mut groups {
                            groups.finish(&view);
                        }
                        let (seen, background) = view.finish(radiance).unwrap_or_default();
                        radiance = seen;
                        if !background.is_black() && self.target.crop.contains(pixel) {
                            self.backgrounds.push((pixel, background * self.weight));
                        }
                    }
                    let is_kept = self.fall_on(pixel, radiance * self.weight);
                    let groups = groups.iter().filter(|_| is_kept).flat_map(|groups| groups.by_group());
                    let groups = groups.enumerate().filter(|(_, light)| !light.is_black());
                    let weight = self.weight;
                    self.parts
                        .extend(groups.map(|(group, light)| (pixel, group, *light * weight)));
                }
            }
            IterationWork::Chain(chain) => {
                if observer.should_stop() {
                    return None;
                }
                self.key = SampleKey::new(chain, u32::MAX, index);
                integrator.chain(prepared, index, chain, &mut sampler, &mut self);
            }
        }
        (!self.cancellation.is_cancelled()).then_some(self)
    }

    /// Adds the light `radiance` to `pixel`, if the pixel is in the crop. Drops invalid light.
    /// Returns `true` if light was added.
    fn fall_on(&mut self, pixel: UVec2, radiance: Spectrum) -> bool {
        // Negative light is valid here, because filters may have negative lobes. The light of the
        // integrator was checked before.
        if !radiance.to_array().iter().all(|v| v.is_finite()) {
            self.drop(radiance);
            return false;
        }
        let is_kept = self.target.crop.contains(pixel) && !radiance.is_black();
        if is_kept {
            self.light.push((pixel, radiance));
        }
        is_kept
    }

    /// Adds light to parts of the image. An element of `light` is the index of a part and the
    /// radiance. The light falls on the film position `film`, or on the sample's own pixel if
    /// `film` is `None`.
    fn add_to_parts<const N: usize>(&mut self, light: [(usize, Spectrum); N], film: Option<Vec2>) {
        let mut add = |pixel: UVec2, weight: f32| {
            for (part, radiance) in light {
                let radiance = radiance * weight;
                if self.target.crop.contains(pixel) && radiance.to_array().iter().all(|v| v.is_finite()) {
                    self.parts.push((pixel, part, radiance));
                }
            }
        };
        match film {
            Some(film) => self.target.seen_by(film).for_each(|(pixel, weight)| add(pixel, weight)),
            None => add(self.key.pixel(), self.weight),
        }
    }

    fn drop(&mut self, radiance: Spectrum) {
        self.statistics.drop_sample(DroppedSample {
            key: self.key,
            radiance: radiance.to_array(),
        });
    }

    /// Adds the light of the work item to `iteration`. Returns the statistics of the work item.
    fn add_to(self, iteration: &mut Iteration) -> Statistics {
        for (pixel, radiance) in self.light {
            iteration.add(pixel, radiance);
        }
        for (pixel, part, radiance) in self.parts {
            iteration.add_to_part(pixel, part, radiance);
        }
        for (pixel, surface) in self.surfaces {
            iteration.see(pixel, surface);
        }
        for pixel in self.lines {
            iteration.draw(pixel);
        }
        for (pixel, share) in self.backgrounds {
            iteration.see_background(pixel, share.to_array().map(f64::from));
        }
        self.statistics
    }
}

impl RaySink for WorkItem<'_> {
    fn ray(&mut self, kind: RayKind) {
        self.statistics.rays.count(kind);
    }

    fn cut_walk(&mut self) {
        self.statistics.rays.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.cancellation.should_stop()
    }

    fn records(&self) -> bool {
        self.record.is_some()
    }

    fn record(&mut self, event: PathEvent) {
        if let Some(record) = &mut self.record {
            record.push(event);
        }
    }

    fn record_len(&self) -> usize {
        self.record.as_ref().map_or(0, Vec::len)
    }

    fn take_record(&mut self, from: usize) -> Vec<PathEvent> {
        let record = self.record.as_mut().filter(|record| from <= record.len());
        record.map_or(Vec::new(), |record| record.split_off(from))
    }
}

impl Sink for WorkItem<'_> {
    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }

    fn light(&mut self, light: FoundLight) {
        let radiance = light.radiance;
        self.record(PathEvent::Added { film: None, radiance });
        if !radiance.is_valid() {
            self.drop(radiance);
            return;
        }
        self.radiance += radiance;
        self.part(light);
    }

    fn part(&mut self, light: FoundLight) {
        if let Some(groups) = self.groups.as_mut().filter(|_| light.radiance.is_valid()) {
            groups.add(&light);
        }
    }

    fn separates_parts(&self) -> bool {
        self.groups.is_some()
    }

    fn first_surface(&mut self, mut surface: FirstSurface) {
        surface.emitted *= self.weight;
        if self.target.crop.contains(self.key.pixel()) {
            self.surfaces.push((self.key.pixel(), surface));
        }
    }

    fn camera_view(&mut self, view: CameraView) {
        self.view = Some(view);
    }

    fn line(&mut self) {
        self.lines.push(self.key.pixel());
    }
}

impl SplatSink for WorkItem<'_> {
    fn splat(&mut self, film: Vec2, light: FoundLight) {
        let radiance = light.radiance;
        self.record(PathEvent::Added {
            film: Some(film),
            radiance,
        });
        if !radiance.is_valid() {
            self.drop(radiance);
            return;
        }
        let group = light
            .source
            .and_then(|source| source.group)
            .filter(|_| self.groups.is_some());
        for (pixel, weight) in self.target.seen_by(film) {
            if self.fall_on(pixel, radiance * weight) {
                self.parts.extend(group.map(|group| (pixel, group, radiance * weight)));
            }
        }
    }

    fn strategy(&mut self, index: usize, film: Option<Vec2>, weighed: Spectrum, alone: Spectrum) {
        let first = self.target.groups + 2 * index;
        self.add_to_parts([(first, weighed), (first + 1, alone)], film);
    }

    fn path_class(&mut self, class: usize, film: Option<Vec2>, radiance: Spectrum) {
        self.add_to_parts([(self.target.before_paths + class, radiance)], film);
    }

    fn mutation(&mut self, kind: &'static str, proposed: u64, accepted: u64) {
        self.statistics.mutation(kind, proposed, accepted);
    }

    fn chain(&mut self, counts: ChainCounts) {
        self.statistics.chains = self.statistics.chains.plus(counts);
    }
}

impl<'a> IterationTarget<'a> {
    /// Pixels to which light at the film position `film` contributes, each with the value of the
    /// filter. Includes repetitions of `film` in a panorama.
    fn seen_by(self, film: Vec2) -> impl Iterator<Item = (UVec2, f32)> + 'a {
        let first = (!self.repeats).then_some(film);
        let repeated = self.repeats.then(|| self.repetitions(film));
        let places = first.into_iter().chain(repeated.into_iter().flatten());
        places.flat_map(move |film| self.seen_at(film))
    }

    /// Film positions of a panorama that have the same direction as `film`, including `film`. Only
    /// positions from which the filter reaches pixels of the image are needed. Such positions are
    /// whole turns away, or lie beyond a pole, half a turn to the side.
    fn repetitions(self, film: Vec2) -> impl Iterator<Item = Vec2> + 'a {
        let size = self.resolution.as_vec2();
        // Number of repetitions of the panorama that the filter reaches
        let [across, down] = (self.filter.radius() / size).ceil().as_ivec2().to_array();
        let over = Vec2::new(film.x + 0.5 * size.x, -film.y);
        let rows =
            (-down..=down).flat_map(move |i| [film, over].map(|at| at + Vec2::new(0.0, 2.0 * i as f32 * size.y)));
        rows.flat_map(move |at| (-across - 1..=across).map(move |i| at + Vec2::new(i as f32 * size.x, 0.0)))
    }

    /// Pixels to which light at the film position `film` contributes, each with the value of the
    /// filter. Ignores repetitions in a panorama.
    fn seen_at(self, film: Vec2) -> impl Iterator<Item = (UVec2, f32)> + 'a {
        // Compute the range of pixels whose centres are within the filter's radius
        let reach = self.filter.radius();
        let size = self.resolution.as_vec2();
        let first = (film - (reach + 0.5)).ceil().max(Vec2::ZERO).as_ivec2();
        let last = (film + (reach - 0.5)).floor().min(size - 1.0).as_ivec2();
        let pixels =
            (first.y..=last.y).flat_map(move |y| (first.x..=last.x).map(move |x| UVec2::new(x as u32, y as u32)));
        pixels.filter_map(move |pixel| {
            let weight = self.filter.eval(film - (pixel.as_vec2() + 0.5));
            (weight != 0.0).then_some((pixel, weight))
        })
    }
}

#[cfg(test)]
mod tests;
