//! The samplers of Halton's sequence and of Hammersley's points.

use super::hash::{numbered, permute, pixel, unit_f32};
use super::{Dimension, SampleKey, Sampler};
use crate::math::float::ALMOST_ONE;
use crate::math::{Vec2, hash::mix};

/// Number of decisions with separate bases. Each decision uses two bases. Later decisions start
/// again with the first bases.
const DECISIONS: usize = 64;
const PRIMES: [u32; 2 * DECISIONS] = primes();

const fn primes() -> [u32; 2 * DECISIONS] {
    let mut primes = [0; 2 * DECISIONS];
    let (mut count, mut n) = (0, 2);
    while count < primes.len() {
        let (mut i, mut is_prime) = (0, true);
        while i < count {
            is_prime &= n % primes[i] != 0;
            i += 1;
        }
        if is_prime {
            primes[count] = n;
            count += 1;
        }
        n += 1;
    }
    primes
}

/// Halton's sequence: the digits of the sample's index, mirrored at the radix point, in a different
/// prime base for each dimension. Each digit is permuted at random, depending on the digits before
/// it (Owen 2017, "A randomized Halton algorithm in R").
#[derive(Clone, Copy, Debug)]
pub struct Halton {
    seed: u64,
    key: u64,
    sample: u32,
}

impl Halton {
    /// A sampler for the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            key: 0,
            sample: 0,
        }
    }

    fn coordinate(&self, dimension: Dimension, axis: u32) -> f32 {
        let base = PRIMES[2 * (dimension.ordinal() as usize % DECISIONS) + axis as usize];
        let key = mix(numbered(self.key, dimension.index()).wrapping_add(axis as u64));
        radical_inverse(base, self.sample, key)
    }
}

impl Sampler for Halton {
    fn start(&mut self, key: SampleKey) {
        self.key = pixel(self.seed, key);
        self.sample = key.sample;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        self.coordinate(dimension, 0)
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        Vec2::new(self.coordinate(dimension, 0), self.coordinate(dimension, 1))
    }
}

/// Hammersley's set for a known number of samples. One coordinate is the sample's position in the
/// set divided by the number of samples. The other coordinate mirrors the binary digits of the
/// position at the radix point. Each dimension orders the samples differently. Samples beyond the
/// known number start a new set.
#[derive(Clone, Copy, Debug)]
pub struct Hammersley {
    seed: u64,
    key: u64,
    /// Index of the sample in the set.
    sample: u32,
    count: u32,
}

impl Hammersley {
    /// A sampler for the given seed and number of samples, at least 1.
    pub fn new(seed: u64, count: u32) -> Self {
        Self {
            seed,
            key: 0,
            sample: 0,
            count: count.max(1),
        }
    }

    /// Position of the sample in the order of `dimension`, and random bits of the dimension.
    fn place(&self, dimension: Dimension) -> (u32, u64) {
        let order = numbered(self.key, dimension.index());
        (permute_below(self.count, self.sample, order), mix(order))
    }
}

impl Sampler for Hammersley {
    fn start(&mut self, key: SampleKey) {
        self.key = mix(pixel(self.seed, key) ^ (key.sample / self.count) as u64);
        self.sample = key.sample % self.count;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        self.get_2d(dimension).x
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let (place, bits) = self.place(dimension);
        let jitter = unit_f32(numbered(bits, place) as u32) as f64;
        let x = ((place as f64 + jitter) / self.count as f64) as f32;
        Vec2::new(x.min(ALMOST_ONE), radical_inverse(2, place, bits))
    }
}

/// Image of `x` in a permutation of the numbers below `n`. Permutes the numbers below the next
/// power of 2, and repeats until the result is below `n`.
fn permute_below(n: u32, x: u32, key: u64) -> u32 {
    let bits = u32::BITS - (n - 1).leading_zeros();
    let mut x = permute(x, bits, key);
    while x >= n {
        x = permute(x, bits, key);
    }
    x
}

/// The digits of `index` in `base`, mirrored at the radix point.
pub(super) fn plain_radical_inverse(base: u32, mut index: u32) -> f64 {
    let (mut x, mut scale) = (0.0, 1.0);
    while index > 0 {
        scale /= base as f64;
        x += scale * (index % base) as f64;
        index /= base;
    }
    x
}

/// The digits of `index` in `base`, mirrored at the radix point. Each digit is permuted by a hash
/// of `key` and the digits before it. (A shift is not enough: with fewer samples than the base
/// there is only one digit, and the numbers of two large bases would be correlated.)
// ANCHOR: radical_inverse
pub(super) fn radical_inverse(base: u32, mut index: u32, key: u64) -> f32 {
    let (mut x, mut scale, mut key) = (0.0, 1.0, key);
    while scale > 1.0 / (1u32 << 26) as f64 {
        let digit = index % base;
        index /= base;
        let bits = mix(key);
        scale /= base as f64;
        x += scale * permute_below(base, digit, bits) as f64;
        key = bits.wrapping_add(digit as u64);
    }
    (x as f32).min(ALMOST_ONE)
}
// ANCHOR_END: radical_inverse
