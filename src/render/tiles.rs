use super::groups::shuffled;
use super::schedule::{last_cut, passes};
use super::statistics::{DroppedSample, RayCounts, Statistics};
use crate::color::Spectrum;
use crate::film::{Block, FeatureBlock, Film, FirstSurface, PartBlock, Tile};
use crate::integrator::{ByGroup, Gathered, Integrator, RayKind, RaySink, SAMPLES_AT_ONCE, Sink};
use crate::sampler::{SampleKey, Sampler};
use rayon::prelude::*;
use std::ops::Range;

/// Watches a render from outside; called from many threads at once.
pub trait Observer: Sync {
    /// `samples` more have been taken.
    fn progress(&self, samples: u64);

    /// As things look now, `samples` more will be taken; the picture's relative error is estimated to be `error`. Told by renders whose
    /// number of samples is not known ahead.
    fn expect(&self, _samples: u64, _error: f64) {}

    /// What has to be there before the first sample is being made: the irradiance cache has so many `records`.
    fn prepared(&self, _records: u64) {}

    /// A pass over all tiles of `film` is done.
    fn passed(&self, _film: &Film) {}

    /// Whether to end the render as soon as the tiles in work are done.
    fn should_stop(&self) -> bool;
}

/// Nobody watches, and nothing stops the render.
impl Observer for () {
    fn progress(&self, _: u64) {}

    fn should_stop(&self) -> bool {
        false
    }
}

/// Whoever it is, for what is compiled once.
impl Observer for &dyn Observer {
    fn progress(&self, samples: u64) {
        (**self).progress(samples);
    }

    fn prepared(&self, records: u64) {
        (**self).prepared(records);
    }

    fn expect(&self, samples: u64, error: f64) {
        (**self).expect(samples, error);
    }

    fn passed(&self, film: &Film) {
        (**self).passed(film);
    }

    fn should_stop(&self) -> bool {
        (**self).should_stop()
    }
}

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Complete,
    /// The observer asked to stop; some pixels have fewer samples than others.
    Stopped,
}

/// Adds samples to every pixel of `film`, from those that it has to the one before the index `end`.
///
/// The result is the same to the bit for any number of threads: each tile of a pass is the work of one task, and what a
/// task computes depends on nothing but its pixels and sample indices. Nor does it depend on how often the render was stopped before.
pub fn render<I: Integrator, S: Sampler>(
    integrator: &I,
    sampler: &S,
    film: &mut Film,
    end: u32,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let mut statistics = Statistics::default();
    let start = film.tiles().iter().map(Tile::next_sample).min().unwrap_or(end);
    for pass in passes(last_cut(start)..end) {
        let behind = film
            .tiles_mut()
            .par_iter_mut()
            .filter(|tile| tile.next_sample() < pass.end);
        let done = behind.filter_map(|tile| {
            (!observer.should_stop()).then(|| {
                let done = advance(integrator, sampler, tile, pass.end);
                observer.progress(done.samples);
                done
            })
        });
        statistics = statistics.merge(done.reduce(Statistics::default, Statistics::merge));
        if observer.should_stop() {
            return (Outcome::Stopped, statistics);
        }
        observer.passed(film);
    }
    (Outcome::Complete, statistics)
}

/// Adds the samples that `tile` lacks before the one with index `end`.
pub(super) fn advance<I: Integrator, S: Sampler>(integrator: &I, sampler: &S, tile: &mut Tile, end: u32) -> Statistics {
    // A film that does not tell lights apart pays nothing for it.
    match tile.parts() {
        0 => advance_gathering::<Spectrum, _, _>(integrator, sampler, tile, end),
        _ => advance_gathering::<ByGroup, _, _>(integrator, sampler, tile, end),
    }
}

fn advance_gathering<R: Gathered, I: Integrator, S: Sampler>(
    integrator: &I,
    sampler: &S,
    tile: &mut Tile,
    end: u32,
) -> Statistics {
    let next = tile.next_sample();
    let start = last_cut(next).max(tile.first_sample());
    // A render that has ended between cuts goes on: what it took last comes again, in one sum with what follows.
    let again = (start < next).then(|| render_tile::<R, _, _>(integrator, sampler, tile, start..next, Turn::TakeBack));
    let taken = passes(start..end).map(|pass| render_tile::<R, _, _>(integrator, sampler, tile, pass, Turn::Add));
    let statistics = taken.reduce(Statistics::merge).unwrap_or_default();
    match again {
        Some(again) => statistics.after(&again),
        None => statistics,
    }
}

/// What becomes of samples that are taken.
#[derive(Clone, Copy)]
enum Turn {
    Add,
    TakeBack,
}

/// Takes `samples` of each pixel of `tile`, and adds their sums to it or takes them out again.
fn render_tile<R: Gathered, I: Integrator, S: Sampler>(
    integrator: &I,
    sampler: &S,
    tile: &mut Tile,
    samples: Range<u32>,
    turn: Turn,
) -> Statistics {
    let mut sampler = sampler.clone();
    let mut statistics = Statistics::default();
    let mut taken: [PixelSample<R>; SAMPLES_AT_ONCE] = Default::default();
    let mut keys = [SampleKey::new(0, 0, 0); SAMPLES_AT_ONCE];

    // Either many samples of a pixel at once, or one sample of each of many pixels. The latter give something to each other,
    // and so those that a crop leaves out are traced too.
    let pixels_at_once = integrator.pixels_at_once().clamp(1, SAMPLES_AT_ONCE);
    let samples_at_once = SAMPLES_AT_ONCE / pixels_at_once;
    let pixels = match pixels_at_once {
        1 => tile.bounds().pixels().collect(),
        _ => shuffled(tile.cell(), samples.start),
    };
    let mut blocks: [Block; SAMPLES_AT_ONCE] = Default::default();
    let mut feature_blocks = match tile.has_features() {
        true => vec![FeatureBlock::default(); SAMPLES_AT_ONCE],
        false => Vec::new(),
    };
    let mut part_blocks = match tile.parts() {
        0 => Vec::new(),
        groups => vec![PartBlock::new(groups); SAMPLES_AT_ONCE],
    };
    let bounds = tile.bounds();
    let is_cropped = |pixel| !bounds.contains(pixel);
    for group in pixels.chunks(pixels_at_once) {
        if group.iter().all(|&pixel| is_cropped(pixel)) {
            continue;
        }
        blocks[..group.len()].fill_with(Block::default);
        feature_blocks.iter_mut().for_each(FeatureBlock::clear);
        part_blocks.iter_mut().for_each(PartBlock::clear);
        for start in samples.clone().step_by(samples_at_once) {
            let end = samples.end.min(start.saturating_add(samples_at_once as u32));
            let mut count = 0;
            for pixel in group {
                for sample in start..end {
                    keys[count] = SampleKey::new(pixel.x, pixel.y, sample);
                    count += 1;
                }
            }
            let (keys, taken) = (&keys[..count], &mut taken[..count]);
            taken.fill_with(PixelSample::default);
            integrator.samples(keys, &mut sampler, taken);
            for (i, (&key, sample)) in keys.iter().zip(taken).enumerate() {
                statistics.rays = sample.rays.plus(statistics.rays);
                if !sample.radiance.sum().is_valid() {
                    if !is_cropped(key.pixel()) {
                        statistics.drop_sample(DroppedSample {
                            key,
                            radiance: sample.radiance.sum().to_array(),
                        });
                    }
                    sample.radiance = R::default();
                }
                let place = i * group.len() / count;
                let features = sample.surface.and_then(|surface| surface.features);
                if let (Some(features), Some(block)) = (&features, feature_blocks.get_mut(place)) {
                    block.add(features);
                }
                let radiance = sample.radiance * sample.weight;
                if let Some(block) = part_blocks.get_mut(place) {
                    block.add(radiance.by_group());
                }
                blocks[place].add(radiance.sum(), sample.surface.as_ref());
            }
        }
        for (&pixel, block) in group.iter().zip(&feature_blocks) {
            match (tile.features_mut(pixel), turn) {
                (Some(sums), Turn::Add) => sums.add(block),
                (Some(sums), Turn::TakeBack) => sums.take_back(block),
                (None, _) => {}
            }
        }
        for (&pixel, block) in group.iter().zip(&part_blocks) {
            let sums = tile.part_sums_mut(pixel);
            match turn {
                Turn::Add => block.add_to(sums),
                Turn::TakeBack => block.take_back_from(sums),
            }
        }
        for (&pixel, block) in group.iter().zip(&blocks) {
            if let Some(sums) = tile.sums_mut(pixel) {
                match turn {
                    Turn::Add => sums.add(block),
                    Turn::TakeBack => sums.take_back(block),
                }
                statistics.samples += samples.len() as u64;
            }
        }
    }
    statistics
}

/// What one sample gave.
#[derive(Default)]
struct PixelSample<R> {
    weight: f32,
    radiance: R,
    surface: Option<FirstSurface>,
    rays: RayCounts,
}

impl<R: Gathered> Sink for PixelSample<R> {
    type Radiance = R;

    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }

    fn radiance(&mut self, radiance: R) {
        self.radiance += radiance;
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.surface = Some(surface);
    }
}

impl<R> RaySink for PixelSample<R> {
    fn ray(&mut self, kind: RayKind) {
        self.rays.count(kind);
    }
}
