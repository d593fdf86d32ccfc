//! Adaptive sampling to a noise level: `--noise LEVEL`.
//!
//! A render ends when the estimated relative error of the image is at most LEVEL. This error is
//! the square root of the mean of variance / (mean² + floor²). The floor is a third of the
//! brightness of the image (`Film::error_floor`), and 0.1 in the relMSE of `compare/metrics.rs`.
//! For each pixel, the film stores the spread between blocks of 64 samples. The error of a tile is
//! the mean over its pixels. The estimate is unbiased for independent blocks, even if pixels share
//! paths. For low-discrepancy points, the estimate is a little too large. The blocks complement
//! each other, so the image is better than the estimate. Unlike relMSE, the estimate includes all
//! pixels, so fireflies make it larger. `Accumulator::squared_error` is the estimate for a pixel.
//! Methods that render whole iterations compare the error of the whole image with LEVEL
//! (`render/iterations.rs`).
//!
//! Tiles get samples in proportion to √v, where v is the squared error of a tile after one block.
//! This minimises the mean squared error (Neyman 1934). Stopping all tiles at the same error would
//! take as many samples as uniform sampling for the same mean squared error. Squared errors fall as
//! 1/n, so the samples that noisy tiles need in addition would equal the samples that the other
//! tiles save.
//!
//! Decisions are made between rounds and from the film only, so the image is bit-identical for any
//! number of threads. The samples that decide are part of the image, which biases means a little
//! (Kirk and Arvo 1991). Therefore the pixels of a tile decide together, after at least 128
//! samples, and after more samples if the image has fewer than 256 pixels.
//! docs/notebook/2026-11.md, "Stopping at a noise level", shows that no visible bias is left.
//! Decisions for a crop use only the pixels of the crop. So these pixels differ from the same
//! pixels of the full image.

use super::dispatch::SampleIntegrator;
use super::observer::{Observer, Outcome, should_leave};
use super::schedule::passes;
use super::statistics::Statistics;
use super::stop_condition::StopCondition;
use super::tiles::{advance, render};
use crate::film::{BLOCK, Film, Tile};
use crate::sampler::Sampler;
use rayon::prelude::*;

/// Minimum number of differences between blocks, summed over all pixels, before the first decision.
const FIRST_DIFFERENCES: u64 = 256;
/// Maximum growth of a tile's number of blocks in one round, as a fraction of the number before the
/// round. Growth is limited because the estimate of a tile's error is inaccurate after few blocks.
/// Each round makes the estimate more accurate.
const GROWTH: f64 = 0.25;

/// Adds samples to every pixel of `film` until the stop condition holds. Without a noise level,
/// this function is the same as [`render`]. With a noise level, the render ends when the estimated
/// error of the film reaches the level.
pub fn render_samples<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    film: &mut Film,
    StopCondition { end, noise }: StopCondition,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    match noise {
        None => render(integrator, sampler, film, end, observer),
        Some(level) => render_to_noise(integrator, sampler, film, level, end, observer),
    }
}

/// Adds samples to `film` until its estimated squared error ([`Film::error`]) falls to `level`². A
/// pixel gets at most `max` samples, rounded down to whole blocks.
///
/// The sample counts of the tiles minimise the total error for the given work. With the squared
/// error v of a tile after one block, Σ v/n is minimal for a given Σ n if n is proportional to √v
/// (Neyman 1934). After each round, √v is estimated again from the differences between blocks.
///
/// Decisions are made between rounds and from the film only, so the result is bit-identical for any
/// number of threads. The samples that decide are part of the image, which biases means a little
/// (Kirk and Arvo 1991). A tile that is too dark by chance probably gets too few samples. Therefore
/// all pixels of a tile decide together.
fn render_to_noise<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    film: &mut Film,
    level: f64,
    max: u32,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let max = max / BLOCK;
    // Start with two blocks for every pixel, or more if there are few pixels
    let first = 1 + FIRST_DIFFERENCES.div_ceil(film.crop().area()) as u32;
    let first = first.min(max) * BLOCK;
    let (mut outcome, mut statistics) = render(integrator, sampler, film, first, observer);
    while outcome == Outcome::Complete {
        // Estimate the remaining work. If a render was stopped within a round and continues, the
        // round is completed first.
        if film.tiles().iter().all(|tile| tile.samples() >= tile.target()) {
            let needed = needed_blocks(film, level, max);
            let left = film.tiles().iter().zip(&needed).map(|(tile, &needed)| {
                let blocks = tile.samples() / BLOCK;
                tile.bounds().area() * (needed.saturating_sub(blocks) * BLOCK) as u64
            });
            let left = left.sum();
            observer.expect(left, film.error().sqrt());
            if left == 0 {
                break;
            }
            for (tile, needed) in film.tiles_mut().iter_mut().zip(needed) {
                let blocks = tile.samples() / BLOCK;
                let step = (blocks as f64 * GROWTH).ceil() as u32;
                tile.set_target(needed.min(blocks.saturating_add(step)) * BLOCK);
            }
        }

        // Run a round: add samples to each tile until it reaches its target
        let behind = film
            .tiles_mut()
            .par_iter_mut()
            .with_max_len(1)
            .filter(|tile| tile.samples() < tile.target());
        let done = behind.map(|tile| {
            let target = tile.first_sample().saturating_add(tile.target());
            let passes = passes(tile.next_sample()..target).take_while(|_| !should_leave(observer));
            let done = passes.map_while(|pass| {
                let done = advance(integrator, sampler, tile, pass.end, observer)?;
                observer.progress(done.samples);
                Some(done)
            });
            done.reduce(Statistics::merge).unwrap_or_default()
        });
        statistics = statistics.merge(done.reduce(Statistics::default, Statistics::merge));
        if should_leave(observer) {
            outcome = Outcome::Stopped;
        }
    }
    (outcome, statistics)
}

/// Final number of blocks of each tile, at most `max`. 0 for all tiles if the film has reached the
/// level.
fn needed_blocks(film: &Film, level: f64, max: u32) -> Vec<u32> {
    let (tiles, errors) = (film.tiles(), film.tile_errors());
    let areas: Vec<f64> = tiles.iter().map(|tile| tile.bounds().area() as f64).collect();
    let sum: f64 = errors.iter().zip(&areas).map(|(error, area)| error * area).sum();
    if sum / film.crop().area() as f64 <= level * level {
        return vec![0; tiles.len()];
    }
    // Squared error of a tile after one block, as the mean over its pixels
    let one_block = |(error, tile): (&f64, &Tile)| error * (tile.samples() / BLOCK) as f64;
    let roots: Vec<f64> = errors.iter().zip(tiles).map(|of| one_block(of).sqrt()).collect();

    // ANCHOR: shares
    // n = c √v, with c such that Σ v/n is the allowed error. Tiles at their maximum leave more
    // error, and the other tiles compensate for this error.
    let mut allowed = level * level * film.crop().area() as f64;
    let mut is_full = vec![false; tiles.len()];
    loop {
        let free = || (0..tiles.len()).filter(|&i| !is_full[i]);
        let c = free().map(|i| areas[i] * roots[i]).sum::<f64>() / allowed.max(0.0);
        let full: Vec<usize> = free().filter(|&i| c * roots[i] > max as f64).collect();
        if full.is_empty() {
            // Float casts saturate.
            let needed = |i: usize| if is_full[i] { max } else { (c * roots[i]).ceil() as u32 };
            return (0..tiles.len()).map(needed).collect();
        }
        for i in full {
            is_full[i] = true;
            allowed -= areas[i] * roots[i] * roots[i] / max as f64;
        }
    }
    // ANCHOR_END: shares
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Accumulator, Rect};
    use crate::integrator::{Integrator, Sink};
    use crate::math::UVec2;
    use crate::sampler::{Dimension, Independent, SampleKey};

    /// Test integrator with mean radiance 1. The standard deviation is 0.1 in the left half of the
    /// image and 1 in the right half.
    struct NoisyIntegrator {
        /// Factor of all radiances.
        scale: f32,
    }

    const SIZE: UVec2 = UVec2::new(128, 64);
    /// Squared mean, plus the squared floor of an image with brightness 1.
    const DIVISOR: f64 = 1.0 + 1.0 / 9.0;

    fn deviation(x: u32) -> f64 {
        if x < SIZE.x / 2 { 0.1 } else { 1.0 }
    }

    impl Integrator for NoisyIntegrator {
        fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
            sampler.start(key);
            out.weight(1.0);
            let u = sampler.get_1d(Dimension::PIXEL);
            let value = if u < 0.5 {
                1.0 - deviation(key.x) as f32
            } else {
                1.0 + deviation(key.x) as f32
            };
            out.radiance(Spectrum::splat(self.scale * value));
        }
    }

    fn rendered(level: f64, max: u32, seed: u64) -> Film {
        let mut film = Film::new(SIZE, Rect::full(SIZE));
        let (outcome, statistics) = render_to_noise(
            &NoisyIntegrator { scale: 1.0 },
            &Independent::new(seed),
            &mut film,
            level,
            max,
            &(),
        );
        assert_eq!(outcome, Outcome::Complete);
        let taken: u64 = film
            .tiles()
            .iter()
            .map(|t| t.samples() as u64 * t.bounds().area())
            .sum();
        assert_eq!(statistics.samples, taken);
        film
    }

    /// Mean of the values of `of` over the tiles of the left half if `left` is true, else over the
    /// tiles of the right half.
    fn mean(film: &Film, left: bool, of: impl Fn(&Tile) -> f64) -> f64 {
        let tiles = film.tiles().iter().filter(|t| (t.bounds().min.x < SIZE.x / 2) == left);
        let values: Vec<f64> = tiles.map(of).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn error_reaches_the_level() {
        let level = 0.01;
        let film = rendered(level, 1 << 20, 3);
        assert!(film.error() <= level * level);
        // Error against the true mean, which is 1
        let error = mean_error(&film);
        assert!((error / (level * level) - 1.0).abs() < 0.1, "{error}");
        // The half with ten times the deviation needs ten times the samples.
        let [quiet, noisy] = [true, false].map(|left| mean(&film, left, |t| t.samples() as f64));
        assert!((noisy / quiet / 10.0 - 1.0).abs() < 0.15, "{quiet} {noisy}");
    }

    fn mean_error(film: &Film) -> f64 {
        let pixels = film.pixels();
        let squared = |(_, a): (UVec2, Accumulator)| (a.mean(0) - 1.0).powi(2) / DIVISOR;
        pixels.map(squared).sum::<f64>() / film.crop().area() as f64
    }

    /// The unit of radiance changes neither the error nor the number of samples.
    #[test]
    fn dim_picture_takes_as_many_samples_as_bright_picture() {
        let [bright, dim] = [1.0, 1e-3].map(|scale| {
            let mut film = Film::new(SIZE, Rect::full(SIZE));
            let integrator = NoisyIntegrator { scale };
            render_to_noise(&integrator, &Independent::new(3), &mut film, 0.03, 1 << 20, &());
            film
        });
        assert_eq!(bright.samples(), dim.samples());
        assert!((dim.error() / bright.error() - 1.0).abs() < 1e-3);
    }

    /// For the same error, uniform sampling would need 1.7 times as many samples.
    #[test]
    fn noise_level_needs_fewer_samples_than_uniform_sampling() {
        let level = 0.02;
        let film = rendered(level, 1 << 20, 3);
        let all = 0.5
            * [true, false]
                .map(|left| mean(&film, left, |t| t.samples() as f64))
                .iter()
                .sum::<f64>();
        let uniform = 0.5 * (0.01 + 1.0) / DIVISOR / (level * level);
        assert!(uniform / all > 1.5, "{all} samples per pixel instead of {uniform}");
    }

    /// If the samples of the noisy half are limited, the quiet half gets more samples, so that the
    /// image still reaches the error.
    #[test]
    fn quiet_tiles_compensate_for_limited_tiles() {
        // Without a limit the halves need 500 and 5000 samples.
        let film = rendered(0.01, 4608, 3);
        let [quiet, noisy] = [true, false].map(|left| mean(&film, left, |t| t.samples() as f64));
        assert!(film.error() <= 1e-4, "{}", film.error());
        assert!(noisy <= 4608.0 && quiet > 1000.0, "{quiet} {noisy}");
    }

    /// A single pixel takes more samples before its first decision, because its error estimate is
    /// poor.
    #[test]
    fn single_pixel_takes_more_samples_before_decision() {
        let crop = Rect {
            min: UVec2::ZERO,
            max: UVec2::ONE,
        };
        let mut film = Film::new(SIZE, crop);
        render_to_noise(
            &NoisyIntegrator { scale: 1.0 },
            &Independent::new(0),
            &mut film,
            0.5,
            1 << 20,
            &(),
        );
        assert!(film.tiles()[0].samples() >= 64 * 256);
    }

    #[test]
    fn samples_are_limited_to_maximum() {
        let film = rendered(1e-6, 200, 0);
        assert!(film.tiles().iter().all(|t| t.samples() == 192));
        assert!(film.error() > 1e-3);
    }

    #[test]
    fn bits_do_not_depend_on_threads() {
        let of = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rendered(0.03, 1 << 20, 1).develop())
        };
        assert_eq!(of(1), of(3));
    }

    /// The mean over many images has almost no bias, although the samples of a tile decide how many
    /// more samples the tile gets.
    #[test]
    fn noise_level_does_not_bias_means() {
        let pictures = 64;
        let mean: f64 = (0..pictures)
            .map(|seed| {
                let film = rendered(0.05, 1 << 20, 100 + seed);
                film.pixels().map(|(_, a)| a.mean(0)).sum::<f64>() / film.crop().area() as f64
            })
            .sum::<f64>()
            / pictures as f64;
        assert!((mean - 1.0).abs() < 2e-4, "{mean}");
    }
}
