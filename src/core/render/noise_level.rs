//! Adaptive sampling to a noise level: `--noise LEVEL`.
//!
//! A render ends when the estimated relative error of the picture, the root of relMSE as `compare/metrics.rs` defines it, is LEVEL. The film keeps
//! for each pixel the spread of blocks of 64 samples; the error of a tile is the mean over its pixels. The estimate is unbiased for independent
//! blocks, also with shared paths. It is a little too large for low-discrepancy points, whose blocks fill each other's gaps: the picture is then
//! better than it says. Unlike relMSE it leaves no pixels out, and so is larger where there are fireflies. `Accumulator::squared_error` is the
//! estimate for a pixel. Methods that make whole iterations compare the error of the whole picture with LEVEL (`render/iterations.rs`).
//!
//! Tiles get samples in proportion to the root of the error that one block would leave in them, which minimises the mean error (Neyman 1934).
//! Stopping each tile at the same error would take as many samples as uniform sampling does for that mean error: errors fall as 1/n, and what noisy
//! tiles gain the others lose.
//!
//! Decisions fall between rounds and from the film alone, so threads change no bit. They look at the samples that they keep, which moves means a
//! little (Kirk and Arvo 1991). The pixels of a tile therefore decide together, after at least 128 samples, and more where the picture has less than
//! 256 pixels. docs/benchmarks.md, "Stopping at a noise level", shows that no bias is left to be seen. A crop reaches the level by itself; its pixels
//! are not those of the full picture.

use super::dispatch::SampleIntegrator;
use super::observer::{Observer, Outcome, should_leave};
use super::schedule::passes;
use super::statistics::Statistics;
use super::stop_condition::StopCondition;
use super::tiles::{advance, render};
use crate::film::{BLOCK, Film, Tile};
use crate::sampler::Sampler;
use rayon::prelude::*;

/// Differences between blocks, over all pixels, that are known at least before anything is decided.
const FIRST_DIFFERENCES: u64 = 256;
/// A tile gets more blocks in rounds, each of this share of those it has: its error is known better after each.
const GROWTH: f64 = 0.25;

/// Adds samples to every pixel of `film` until the condition `stop` holds: as [`render`] if it
/// names no noise level, else until the error of the film is that small.
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

/// Adds samples to `film` until its error ([`Film::error`], a squared relative error) is estimated to be `level`² at most, but no
/// more than `max` to a pixel; both counts are in whole blocks, `max` rounded down.
///
/// Tiles get as many samples as make the error of the whole smallest for the work: with v the squared error that one block
/// would leave in a tile, Σ v/n is least for a given Σ n where n goes like √v (Neyman 1934). After each round, √v is
/// estimated anew from the differences between blocks.
///
/// Decisions are made between rounds and from the film alone, so bits do not depend on threads. They look at the samples that they then
/// keep, which moves means a little (Kirk and Arvo 1991): a tile that by chance has seen too little light is likely to get
/// too few samples. A tile decides by all its pixels together, so that no single one decides for itself.
fn render_to_noise<S: Sampler>(
    integrator: &dyn SampleIntegrator<S>,
    sampler: &S,
    film: &mut Film,
    level: f64,
    max: u32,
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let max = max / BLOCK;
    // Two blocks of every pixel, or more of a few
    let first = 1 + FIRST_DIFFERENCES.div_ceil(film.crop().area()) as u32;
    let first = first.min(max) * BLOCK;
    let (mut outcome, mut statistics) = render(integrator, sampler, film, first, observer);
    while outcome == Outcome::Complete {
        // Remaining work, as estimated now. Where a render goes on that was stopped within a round, the round comes first.
        if film.tiles().iter().all(|tile| tile.samples() >= tile.target()) {
            let wanted = wanted_blocks(film, level, max);
            let left = film.tiles().iter().zip(&wanted).map(|(tile, &wanted)| {
                let blocks = tile.samples() / BLOCK;
                tile.bounds().area() * (wanted.saturating_sub(blocks) * BLOCK) as u64
            });
            let left = left.sum();
            observer.expect(left, film.error().sqrt());
            if left == 0 {
                break;
            }
            for (tile, wanted) in film.tiles_mut().iter_mut().zip(wanted) {
                let blocks = tile.samples() / BLOCK;
                let step = (blocks as f64 * GROWTH).ceil() as u32;
                tile.set_target(wanted.min(blocks.saturating_add(step)) * BLOCK);
            }
        }

        // A round
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

/// Blocks that each tile should have in the end, `max` at most.
fn wanted_blocks(film: &Film, level: f64, max: u32) -> Vec<u32> {
    let tiles = film.tiles();
    if film.error() <= level * level {
        return vec![0; tiles.len()];
    }
    // Squared error that one block would leave, mean over the pixels of a tile
    let one_block = |tile: &Tile| tile.error() * (tile.samples() / BLOCK) as f64;
    let roots: Vec<f64> = tiles.iter().map(|tile| one_block(tile).sqrt()).collect();
    let areas: Vec<f64> = tiles.iter().map(|tile| tile.bounds().area() as f64).collect();

    // ANCHOR: shares
    // n = c √v, with c such that Σ v/n is what may be left. What tiles that get no more leave, the others have to make up for.
    let mut allowed = level * level * film.crop().area() as f64;
    let mut is_full = vec![false; tiles.len()];
    loop {
        let free = || (0..tiles.len()).filter(|&i| !is_full[i]);
        let c = free().map(|i| areas[i] * roots[i]).sum::<f64>() / allowed.max(0.0);
        let full: Vec<usize> = free().filter(|&i| c * roots[i] > max as f64).collect();
        if full.is_empty() {
            // Floats saturate where they are cast.
            let wanted = |i: usize| if is_full[i] { max } else { (c * roots[i]).ceil() as u32 };
            return (0..tiles.len()).map(wanted).collect();
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
    use crate::film::Rect;
    use crate::integrator::{Integrator, Sink};
    use crate::math::UVec2;
    use crate::sampler::{Dimension, Independent, SampleKey};

    /// Light of mean 1 whose deviation is 0.1 in the left half of the picture, and 1 in the right one.
    struct Noisy;

    const SIZE: UVec2 = UVec2::new(128, 64);

    fn deviation(x: u32) -> f64 {
        if x < SIZE.x / 2 { 0.1 } else { 1.0 }
    }

    impl Integrator for Noisy {
        fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
            sampler.start(key);
            out.weight(1.0);
            let u = sampler.get_1d(Dimension::PIXEL);
            let value = if u < 0.5 {
                1.0 - deviation(key.x) as f32
            } else {
                1.0 + deviation(key.x) as f32
            };
            out.radiance(Spectrum::splat(value));
        }
    }

    fn rendered(level: f64, max: u32, seed: u64) -> Film {
        let mut film = Film::new(SIZE, Rect::full(SIZE));
        let (outcome, statistics) = render_to_noise(&Noisy, &Independent::new(seed), &mut film, level, max, &());
        assert_eq!(outcome, Outcome::Complete);
        let taken: u64 = film
            .tiles()
            .iter()
            .map(|t| t.samples() as u64 * t.bounds().area())
            .sum();
        assert_eq!(statistics.samples, taken);
        film
    }

    /// Mean over the tiles of one half, by `of`.
    fn mean(film: &Film, left: bool, of: impl Fn(&Tile) -> f64) -> f64 {
        let tiles = film.tiles().iter().filter(|t| (t.bounds().min.x < SIZE.x / 2) == left);
        let values: Vec<f64> = tiles.map(of).collect();
        values.iter().sum::<f64>() / values.len() as f64
    }

    #[test]
    fn the_error_is_what_was_asked_for() {
        let level = 0.01;
        let film = rendered(level, 1 << 20, 3);
        assert!(film.error() <= level * level);
        // Against the truth, which is 1
        let error = mean_error(&film);
        assert!((error / (level * level) - 1.0).abs() < 0.1, "{error}");
        // Ten times the deviation is worth ten times the samples.
        let [quiet, noisy] = [true, false].map(|left| mean(&film, left, |t| t.samples() as f64));
        assert!((noisy / quiet / 10.0 - 1.0).abs() < 0.15, "{quiet} {noisy}");
    }

    fn mean_error(film: &Film) -> f64 {
        let pixels = film.pixels();
        pixels.map(|(_, a)| (a.mean(0) - 1.0).powi(2) / 1.01).sum::<f64>() / film.crop().area() as f64
    }

    /// Uniform sampling would need 1.7 times as many.
    #[test]
    fn samples_go_where_they_are_worth_most() {
        let level = 0.02;
        let film = rendered(level, 1 << 20, 3);
        let all = 0.5
            * [true, false]
                .map(|left| mean(&film, left, |t| t.samples() as f64))
                .iter()
                .sum::<f64>();
        let uniform = 0.5 * (0.01 + 1.0) / 1.01 / (level * level);
        assert!(uniform / all > 1.5, "{all} samples per pixel instead of {uniform}");
    }

    /// What the noisy half may not have, the quiet one gets, as long as that helps.
    #[test]
    fn others_make_up_for_what_may_not_be_had() {
        // By themselves the halves want 625 and 6250 samples.
        let film = rendered(0.01, 5120, 3);
        let [quiet, noisy] = [true, false].map(|left| mean(&film, left, |t| t.samples() as f64));
        assert!(film.error() <= 1e-4, "{}", film.error());
        assert!(noisy <= 5120.0 && quiet > 1000.0, "{quiet} {noisy}");
    }

    /// One pixel knows little of its error: it takes more before it decides.
    #[test]
    fn few_pixels_look_longer() {
        let crop = Rect {
            min: UVec2::ZERO,
            max: UVec2::ONE,
        };
        let mut film = Film::new(SIZE, crop);
        render_to_noise(&Noisy, &Independent::new(0), &mut film, 0.5, 1 << 20, &());
        assert!(film.tiles()[0].samples() >= 64 * 256);
    }

    #[test]
    fn nobody_gets_more_than_there_are() {
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

    /// Means of pixels that decide together how many samples they take, over many pictures.
    #[test]
    fn means_hardly_move() {
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
