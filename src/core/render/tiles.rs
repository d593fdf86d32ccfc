//! Passes over tiles: each tile of a pass is one task.
//!
//! A task takes the samples of its pixels, sums them, and adds the sums to the tile. The result of
//! a task depends only on its pixels and sample indices, so the image is bit-identical for any
//! number of threads. If the render stops, the work of an incomplete tile is discarded.

use super::dispatch::{DynSink, SampleIntegrator};
use super::groups::shuffled;
use super::light_parts::LightParts;
use super::observer::{Observer, Outcome, should_leave};
use super::pixel_sample::{PartedSample, PixelSample};
use super::schedule::{last_cut, passes};
use super::statistics::{DroppedSample, Statistics};
use crate::film::{Film, PixelBlock, SampleChange, Tile, TileSums};
use crate::integrator::SAMPLES_AT_ONCE;
use crate::sampler::{SampleKey, Sampler};
use rayon::prelude::*;
use std::array::from_fn;
use std::ops::Range;

/// Adds samples to every pixel of `film`, from the next sample of the pixel to index `end` − 1.
///
/// The result is bit-identical for any number of threads and interruptions, because each tile of a
/// pass is one task, whose result depends only on its pixels and sample indices.
pub fn render<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    film: &mut Film,
    end: u32,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let mut statistics = Statistics::default();
    let start = film.tiles().iter().map(Tile::next_sample).min().unwrap_or(end);
    for pass in passes(last_cut(start)..end) {
        // Give tiles to threads one by one. If a thread took several tiles in a row, the other
        // threads would wait for it at the end of the pass.
        let behind = film
            .tiles_mut()
            .par_iter_mut()
            .with_max_len(1)
            .filter(|tile| tile.next_sample() < pass.end);
        let done = behind.filter_map(|tile| {
            if should_leave(observer) {
                return None;
            }
            let done = advance(integrator, sampler, tile, pass.end, observer)?;
            observer.progress(done.samples);
            Some(done)
        });
        statistics = statistics.merge(done.reduce(Statistics::default, Statistics::merge));
        if should_leave(observer) {
            return (Outcome::Stopped, statistics);
        }
        observer.passed(film);
    }
    (Outcome::Complete, statistics)
}

/// Adds the missing samples before index `end` to `tile`. Returns `None` and leaves the tile
/// unchanged if the observer stops.
pub(super) fn advance<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    tile: &mut Tile,
    end: u32,
    observer: &impl Observer,
) -> Option<Statistics> {
    let mut sums = tile.open();
    let done = advance_passes(integrator, sampler, (tile, &mut sums), end, observer)?;
    tile.close(sums);
    Some(done)
}

/// Adds the missing samples before index `end` to the opened sums of `tile`. Returns `None` if the
/// observer stops; the sums are then invalid.
fn advance_passes<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    (tile, sums): (&Tile, &mut TileSums),
    end: u32,
    observer: &impl Observer,
) -> Option<Statistics> {
    let next = tile.next_sample();
    let start = last_cut(next).max(tile.first_sample());
    // If an earlier render ended within a pass (`schedule`): trace the samples of this pass again
    // and subtract them. Then the whole pass, with the new samples, is summed and added.
    let again = if start < next {
        Some(render_tile(
            integrator,
            sampler,
            (tile, sums),
            (start..next, SampleChange::TakeBack),
            observer,
        )?)
    } else {
        None
    };
    let mut statistics = Statistics::default();
    for pass in passes(start..end) {
        let taken = render_tile(integrator, sampler, (tile, sums), (pass, SampleChange::Add), observer)?;
        statistics = statistics.merge(taken);
    }
    Some(match again {
        Some(again) => statistics.after(&again),
        None => statistics,
    })
}

/// Number of rays per sample above which samples are taken one by one, with a call of the observer
/// before each sample. A sample of a method that gathers or branches may take seconds.
pub(super) const MANY_RAYS: u64 = 64;

/// Takes the samples `samples` of each pixel of `tile`. Adds the sums of the samples to `sums` or
/// subtracts them, according to `change`. Returns `None` if the observer stops; `sums` are then
/// invalid.
fn render_tile<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    (tile, sums): (&Tile, &mut TileSums),
    (samples, change): (Range<u32>, SampleChange),
    observer: &impl Observer,
) -> Option<Statistics> {
    let mut sampler = sampler.clone();
    let mut statistics = Statistics::default();
    // Skip all work for parts of the light if the tile has no parts.
    let paths = tile.light_paths().cloned();
    let has_parts = paths.is_some() || tile.parts() > 0;
    let mut parts: Vec<LightParts> = Vec::new();
    let mut taken: [PixelSample; SAMPLES_AT_ONCE] = from_fn(|_| PixelSample::new(observer));
    let mut keys = [SampleKey::new(0, 0, 0); SAMPLES_AT_ONCE];

    // Trace either many samples of one pixel at once, or one sample of each of many pixels. In the
    // second case pixels share paths, so pixels outside of the crop are traced too.
    let pixels_at_once = integrator.pixels_at_once().clamp(1, SAMPLES_AT_ONCE);
    let samples_at_once = SAMPLES_AT_ONCE / pixels_at_once;
    let pixels = match pixels_at_once {
        1 => tile.bounds().pixels().collect(),
        _ => shuffled(tile.cell(), samples.start),
    };
    let mut blocks = vec![tile.block(); pixels_at_once];
    let bounds = tile.bounds();
    let is_cropped = |pixel| !bounds.contains(pixel);
    // Number of samples of a pixel that are traced at once. It is 1 until the cost of a sample is
    // known.
    let mut samples_now = 1;
    for group in pixels.chunks(pixels_at_once) {
        if group.iter().all(|&pixel| is_cropped(pixel)) {
            continue;
        }
        blocks.iter_mut().for_each(PixelBlock::clear);
        let mut start = samples.start;
        while start < samples.end {
            if observer.should_stop() {
                return None;
            }
            let end = samples.end.min(start.saturating_add(samples_now as u32));
            let mut count = 0;
            for pixel in group {
                for sample in start..end {
                    keys[count] = SampleKey::new(pixel.x, pixel.y, sample);
                    count += 1;
                }
            }
            let (keys, taken) = (&keys[..count], &mut taken[..count]);
            taken.fill_with(|| PixelSample::new(observer));
            if has_parts {
                parts.clear();
                parts.resize_with(count, || LightParts::new(paths.as_deref()));
                let sinks = taken.iter_mut().zip(&mut parts);
                let mut sinks: Vec<_> = sinks.map(|(sample, parts)| PartedSample { sample, parts }).collect();
                let mut sinks: Vec<DynSink> = sinks.iter_mut().map(|sink| sink as DynSink).collect();
                integrator.samples_into(keys, &mut sampler, &mut sinks);
            } else {
                integrator.samples(keys, &mut sampler, taken);
            }
            // If the integrator was cancelled, discard the incomplete samples.
            if taken.iter().any(|sample| sample.cancellation.is_cancelled()) {
                return None;
            }
            let rays_before = statistics.rays.total();
            for (i, (&key, sample)) in keys.iter().zip(taken).enumerate() {
                statistics.rays = sample.rays.plus(statistics.rays);
                let mut parts = parts.get_mut(i);
                if !sample.finish(parts.as_deref_mut()) {
                    if !is_cropped(key.pixel()) {
                        statistics.drop_sample(DroppedSample {
                            key,
                            radiance: sample.radiance.to_array(),
                        });
                    }
                    sample.drop_light(parts.as_deref_mut());
                }
                blocks[i * group.len() / count].add(&sample.weighted(parts));
            }
            let is_slow = statistics.rays.total() - rays_before > MANY_RAYS * count as u64;
            samples_now = if is_slow { 1 } else { samples_at_once };
            start = end;
        }
        for (&pixel, block) in group.iter().zip(&blocks) {
            sums.change(pixel, block, change);
            if !is_cropped(pixel) {
                statistics.samples += samples.len() as u64;
            }
        }
    }
    Some(statistics)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::Rect;
    use crate::integrator::{Integrator, RayKind, Sink};
    use crate::math::UVec2;
    use crate::sampler::{Dimension, SamplerKind};
    use std::sync::atomic::{AtomicU64, Ordering};

    /// Test integrator that counts its samples. Each sample takes many rays.
    struct SlowIntegrator(AtomicU64);

    impl Integrator for SlowIntegrator {
        fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
            self.0.fetch_add(1, Ordering::Relaxed);
            sampler.start(key);
            (0..=MANY_RAYS).for_each(|_| out.ray(RayKind::Bounce));
            out.weight(1.0);
            out.radiance(Spectrum::splat(sampler.get_1d(Dimension::PIXEL)));
        }
    }

    struct StopAt<'a>(&'a SlowIntegrator, u64);

    impl Observer for StopAt<'_> {
        fn progress(&self, _: u64) {}

        fn should_stop(&self) -> bool {
            self.0.0.load(Ordering::Relaxed) >= self.1
        }
    }

    /// Slow samples are stopped one by one. Incomplete tiles stay unchanged, so the result is
    /// bit-identical to a render without stops.
    #[test]
    fn slow_samples_are_stopped_within_tiles() {
        let sampler = SamplerKind::Independent.with_seed(1, 90);
        let new = || Film::new(UVec2::new(40, 20), Rect::full(UVec2::new(40, 20)));
        let mut whole = new();
        assert_eq!(
            render(&SlowIntegrator(AtomicU64::new(0)), &sampler, &mut whole, 90, &()).0,
            Outcome::Complete
        );
        let (mut film, mut patience, mut stops) = (new(), 100, 0);
        // Both renders end between two cuts of passes.
        for end in [50, 90] {
            loop {
                let slow = SlowIntegrator(AtomicU64::new(0));
                let (outcome, statistics) = render(&slow, &sampler, &mut film, end, &StopAt(&slow, patience));
                if outcome == Outcome::Complete {
                    break;
                }
                let taken = slow.0.into_inner();
                assert!(
                    taken <= patience + rayon::current_num_threads() as u64,
                    "{taken}, {patience}"
                );
                assert!(statistics.samples <= taken);
                (patience, stops) = (patience + patience / 2, stops + 1);
            }
        }
        assert!(stops > 5, "{stops}");
        let sums = |film: &Film| film.pixels().map(|(_, sums)| sums).collect::<Vec<_>>();
        assert_eq!(sums(&film), sums(&whole));
    }
}
