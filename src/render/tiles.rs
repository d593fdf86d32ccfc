use super::schedule::passes;
use super::statistics::{DroppedSample, RayCounts, Statistics};
use crate::color::Spectrum;
use crate::film::{Accumulator, Film, FirstSurface, Tile};
use crate::integrator::{Integrator, RayKind, SAMPLES_AT_ONCE, Sink};
use crate::sampler::{SampleKey, Sampler};
use rayon::prelude::*;
use std::array::from_fn;
use std::ops::Range;

/// Watches a render from outside; called from many threads at once.
pub trait Observer: Sync {
    /// `samples` more have been taken.
    fn progress(&self, samples: u64);

    /// Whether to end the render as soon as the tiles in work are done.
    fn should_stop(&self) -> bool;
}

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Complete,
    /// The observer asked to stop; some pixels have fewer samples than others.
    Stopped,
}

/// Adds the samples with indices `samples` to every pixel of `film`.
///
/// The result is the same to the bit for any number of threads: each tile of a pass is the work of one task, and what a
/// task computes depends on nothing but its pixels and sample indices.
pub fn render<I: Integrator, S: Sampler>(
    integrator: &I,
    sampler: &S,
    film: &mut Film,
    samples: Range<u32>,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let mut statistics = Statistics::default();
    for pass in passes(samples) {
        let done = film
            .tiles_mut()
            .par_iter_mut()
            .filter_map(|tile| {
                (!observer.should_stop()).then(|| {
                    let done = render_tile(integrator, sampler, tile, pass.clone());
                    observer.progress(done.samples);
                    done
                })
            })
            .reduce(Statistics::default, Statistics::merge);
        statistics = statistics.merge(done);
        if observer.should_stop() {
            return (Outcome::Stopped, statistics);
        }
    }
    (Outcome::Complete, statistics)
}

fn render_tile<I: Integrator, S: Sampler>(
    integrator: &I,
    sampler: &S,
    tile: &mut Tile,
    samples: Range<u32>,
) -> Statistics {
    let mut sampler = sampler.clone();
    let mut statistics = Statistics::default();
    let mut taken: [PixelSample; SAMPLES_AT_ONCE] = Default::default();
    for (pixel, sums) in tile.iter_mut() {
        let mut block = Accumulator::default();
        let mut start = samples.start;
        while start < samples.end {
            // Some samples at once, whose camera rays are nearly the same
            let count = SAMPLES_AT_ONCE.min((samples.end - start) as usize);
            let keys: [_; SAMPLES_AT_ONCE] =
                from_fn(|i| SampleKey::new(pixel.x, pixel.y, start.wrapping_add(i as u32)));
            let (keys, taken) = (&keys[..count], &mut taken[..count]);
            taken.fill_with(PixelSample::default);
            integrator.samples(keys, &mut sampler, taken);
            for (&key, sample) in keys.iter().zip(taken) {
                statistics.rays = sample.rays.plus(statistics.rays);
                if !sample.radiance.is_valid() {
                    statistics.drop_sample(DroppedSample {
                        key,
                        radiance: sample.radiance.to_array(),
                    });
                    sample.radiance = Spectrum::ZERO;
                }
                block.add(sample.radiance, sample.surface.as_ref());
            }
            start += count as u32;
        }
        statistics.samples += samples.len() as u64;
        sums.merge(&block);
    }
    statistics
}

/// What one sample gave.
#[derive(Default)]
struct PixelSample {
    radiance: Spectrum,
    surface: Option<FirstSurface>,
    rays: RayCounts,
}

impl Sink for PixelSample {
    fn radiance(&mut self, radiance: Spectrum) {
        self.radiance += radiance;
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        self.surface = Some(surface);
    }

    fn ray(&mut self, kind: RayKind) {
        self.rays.count(kind);
    }
}
