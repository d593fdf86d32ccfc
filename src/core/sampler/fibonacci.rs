//! Directions from spherical Fibonacci points (`--directions fibonacci`).
//!
//! This sampler wraps the sampler of `--sampler`. `integrator/path/strategy.rs` has the matching
//! warp. Any sampler can be combined with any warp, because samplers return uniform numbers, and
//! warps map uniform numbers to directions with a cosine density. Fibonacci directions cost more
//! time than their lower error saves (docs/notebook/2026-11.md, "Fibonacci directions").

use super::hash::{numbered, permute, pixel};
use super::sphere::{moved_on_disk, pair, rotation, set_bits};
use super::{AnySampler, Bounce, Dimension, SampleKey, Sampler};
use crate::math::{Vec2, Vec3, hash::mix};
use crate::sampling::warp::{square_of_sphere, uniform_sphere};

/// Fractional part of the golden ratio.
const GOLDEN_SECTION: f32 = 0.618_034;

/// Directions from spherical Fibonacci points, each moved at random on a disk in its tangent plane.
/// All other numbers come from another sampler.
///
/// Each of n samples uses a different point of a spherical Fibonacci set (Marques et al. 2013,
/// "Spherical Fibonacci Point Sets for Illumination Integrals"). Each decision uses the points in a
/// separate order. n is the largest power of 2 up to the number of samples, at most 1024. The disks
/// have the radius 1/√n, which is half the radius of a disk with the area 4π/n. A uniform random
/// rotation turns each set. Each direction alone is therefore exactly uniform on the sphere, and
/// its density is known.
///
/// The sampler returns points of the unit square that [`uniform_sphere`] maps to the directions.
/// Sets are independent of each other.
#[derive(Clone, Copy, Debug)]
pub struct Fibonacci {
    others: AnySampler,
    seed: u64,
    /// Hash of the seed, the pixel and the index of the set.
    key: u64,
    sample: u32,
    /// Base-2 logarithm of the number of points of a set.
    bits: u32,
}

impl Fibonacci {
    /// Directions for `seed` and `count` samples per pixel. All other numbers come from `others`.
    pub fn new(seed: u64, count: u32, others: AnySampler) -> Self {
        Self {
            others,
            seed,
            key: 0,
            sample: 0,
            bits: set_bits(count),
        }
    }

    /// Point of the current sample on the unit sphere, for the decision `dimension`.
    fn point(&self, dimension: Dimension) -> Vec3 {
        let n = 1u32 << self.bits;
        let set = numbered(self.key, dimension.index());
        let index = permute(self.sample % n, self.bits, set);
        let base = uniform_sphere(spiral(index, n));
        let radius = 1.0 / (n as f32).sqrt();
        rotation(numbered(set, n)) * moved_on_disk(base, pair(numbered(set, index)), radius)
    }
}

impl Sampler for Fibonacci {
    fn start(&mut self, key: SampleKey) {
        self.others.start(key);
        let block = key.sample >> self.bits;
        self.key = mix(pixel(self.seed, key) ^ block as u64);
        self.sample = key.sample;
    }

    fn separate(&mut self) {
        self.others.separate();
    }

    #[inline(never)]
    fn get_1d(&self, dimension: Dimension) -> f32 {
        self.others.get_1d(dimension)
    }

    #[inline(never)]
    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        if dimension.is(Bounce::Direction) {
            square_of_sphere(self.point(dimension))
        } else {
            self.others.get_2d(dimension)
        }
    }
}

/// Point `index` of `n` points of the spherical Fibonacci set, in the unit square.
fn spiral(index: u32, n: u32) -> Vec2 {
    Vec2::new((index as f32 + 0.5) / n as f32, (index as f32 * GOLDEN_SECTION).fract())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{SamplerKind, points};
    use crate::sampling::warp::cosine_hemisphere_of_sphere;

    const DIRECTION: Bounce = Bounce::Direction;

    fn sampler(seed: u64, count: u32) -> Fibonacci {
        Fibonacci::new(seed, count, SamplerKind::Sobol.with_seed(seed, count))
    }

    fn directions(seed: u64, count: u32) -> Vec<Vec3> {
        let points = points(sampler(seed, count), 3, Dimension::bounce(1, DIRECTION), 0..count);
        points.into_iter().map(uniform_sphere).collect()
    }

    #[test]
    fn samples_can_be_replayed_and_other_dimensions_use_other_sampler() {
        let of = |seed, x, depth, samples| points(sampler(seed, 100), x, Dimension::bounce(depth, DIRECTION), samples);
        let whole = of(5, 2, 3, 0..200);
        for sample in [0, 1, 63, 64, 99, 100, 199] {
            assert_eq!(of(5, 2, 3, sample..sample + 1)[0], whole[sample as usize]);
        }
        for other in [of(6, 2, 3, 0..200), of(5, 3, 3, 0..200), of(5, 2, 4, 0..200)] {
            assert!(whole.iter().zip(&other).all(|(a, b)| a != b));
        }
        for dimension in [Dimension::PIXEL, Dimension::bounce(2, Bounce::LightPoint)] {
            let sobol = points(SamplerKind::Sobol.with_seed(5, 100), 2, dimension, 0..200);
            assert_eq!(points(sampler(5, 100), 2, dimension, 0..200), sobol);
        }
    }

    /// χ² of single samples over 16 × 16 cells of equal area. Each sample has a different seed and
    /// pixel.
    #[test]
    fn single_samples_are_uniform() {
        for (sample, count) in [(0, 64), (3, 64), (70, 64), (5, 1), (1000, 1024)] {
            let mut counts = [0.0f64; 256];
            for i in 0..51_200 {
                let mut sampler = sampler(i / 7, count);
                sampler.start(SampleKey::new(i as u32 % 7, 3, sample));
                let u = sampler.get_2d(Dimension::bounce(2, DIRECTION));
                assert!(u.cmpge(Vec2::ZERO).all() && u.cmplt(Vec2::ONE).all());
                counts[(u.x * 16.0) as usize * 16 + (u.y * 16.0) as usize] += 1.0;
            }
            let chi2: f64 = counts.iter().map(|c| (c - 200.0).powi(2) / 200.0).sum();
            // 255 degrees of freedom: standard deviation 22.6
            assert!(chi2 < 255.0 + 5.0 * 22.6, "{sample} of {count}: χ² = {chi2}");
        }
    }

    /// Points are at least as far apart as the radii of the disks allow, and leave no large gap.
    #[test]
    fn points_are_spread_over_the_sphere() {
        for seed in 0..50 {
            let points = directions(seed, 64);
            // Neighbours among the n points are about 3/√n apart. Moving both points on their disks
            // reduces the distance by at most 2/√n.
            let pairs = points.iter().enumerate();
            let nearest = pairs.flat_map(|(i, a)| points[..i].iter().map(move |b| a.distance(*b)));
            let nearest = nearest.fold(f32::INFINITY, f32::min);
            // Largest distance of a direction from the nearest point, over directions all over the
            // sphere
            let all = (0..1000).map(|i| uniform_sphere(spiral(i, 1000)));
            let hole = all.map(|w| points.iter().map(|p| p.distance(w)).fold(f32::INFINITY, f32::min));
            let hole = hole.fold(0.0, f32::max);
            assert!(nearest > 1.0 / 8.0 && hole < 4.5 / 8.0, "{nearest} {hole}");
        }
    }

    /// The mean of a smooth integrand over the hemisphere has a lower error than with independent
    /// directions of the same density.
    #[test]
    fn smooth_integrands_have_less_error() {
        let (a, b) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, 0.6));
        let error = |direction: &dyn Fn(u64) -> Vec<Vec2>| {
            let mean = |seed| {
                let f = |u| {
                    let w = cosine_hemisphere_of_sphere(u);
                    (1.0 + w.dot(a) + w.dot(a) * w.dot(b)) as f64
                };
                direction(seed).into_iter().map(f).sum::<f64>() / 64.0
            };
            let means: Vec<f64> = (0..500).map(mean).collect();
            let all = means.iter().sum::<f64>() / 500.0;
            (all, means.iter().map(|m| (m - all).powi(2)).sum::<f64>() / 500.0)
        };
        let dimension = Dimension::bounce(0, DIRECTION);
        let (mean, variance) = error(&|seed| points(sampler(seed, 64), 1, dimension, 0..64));
        let independent = SamplerKind::Independent;
        let (expected, max) = error(&|seed| points(independent.with_seed(seed, 64), 1, dimension, 0..64));
        assert!((mean - expected).abs() < 4.0 * ((variance + max) / 500.0).sqrt());
        assert!(variance < 0.1 * max, "{variance} {max}");
    }
}
