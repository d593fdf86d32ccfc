//! Hash functions of samplers: SplitMix64 as a function of its counter, and permutations.

use super::SampleKey;
use crate::math::hash::{GOLDEN_GAMMA, mix};

/// Number `n` of the sequence of random numbers with the key `key`.
pub(super) fn numbered(key: u64, n: u32) -> u64 {
    mix(key.wrapping_add((n as u64 + 1).wrapping_mul(GOLDEN_GAMMA)))
}

/// Hash of the seed and the pixel. Each input is hashed separately, so that no two inputs can
/// cancel.
pub(super) fn pixel(seed: u64, key: SampleKey) -> u64 {
    let pixel = ((key.y as u64) << 32) | key.x as u64;
    mix(mix(seed.wrapping_add(GOLDEN_GAMMA)) ^ pixel)
}

/// The top 24 of 32 bits as a multiple of 2⁻²⁴ in [0, 1), which is exact in f32.
#[inline(always)]
pub(super) fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// Permutes the numbers with `bits` binary digits, and returns the image of `x`. `key` selects the
/// permutation.
pub(super) fn permute(x: u32, bits: u32, key: u64) -> u32 {
    let words = [mix(key), mix(key ^ GOLDEN_GAMMA)].map(|hash| [hash as u32, (hash >> 32) as u32]);
    let step = |x, word: u32| permutation_step(x, bits, word, word.rotate_left(16));
    words.into_iter().flatten().fold(x, step)
}

/// [`permute`] for at most 8 binary digits, for which one hash is enough.
pub(super) fn permute_few(x: u32, bits: u32, key: u64) -> u32 {
    let hash = mix(key);
    let step = |x, i: u32| permutation_step(x, bits, (hash >> (16 * i)) as u32, (hash >> (16 * i + 8)) as u32);
    (0..4).fold(x, step)
}

/// One step of [`permute`], which is a bijection: multiplies by an odd factor, combines with the
/// higher digits by exclusive or, and adds a summand.
fn permutation_step(x: u32, bits: u32, factor: u32, summand: u32) -> u32 {
    let mask = ((1u64 << bits) - 1) as u32;
    let x = x.wrapping_mul(factor | 1) & mask;
    let x = x ^ (x >> (bits / 2).max(1));
    x.wrapping_add(summand) & mask
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_are_bijective_and_uniform() {
        let is_one = |n: u32, of: &dyn Fn(u32) -> u32| {
            let mut all: Vec<u32> = (0..n).map(of).collect();
            all.sort_unstable();
            all.into_iter().eq(0..n)
        };
        for key in 0..50 {
            for bits in [0, 1, 2, 3, 6, 9, 17] {
                assert!(is_one(1 << bits, &|x| permute(x, bits, key)), "{bits} bits, key {key}");
            }
            for bits in 0..=8 {
                assert!(
                    is_one(1 << bits, &|x| permute_few(x, bits, key)),
                    "{bits} bits, key {key}"
                );
            }
        }
        // Each number has all images equally often: χ² with 63 degrees of freedom, mean 63 and
        // standard deviation 11.2.
        for permute in [permute, permute_few] {
            for x in [0, 1, 32, 63] {
                let mut counts = [0.0; 64];
                (0..64_000).for_each(|key| counts[permute(x, 6, key) as usize] += 1.0);
                let chi2: f64 = counts.iter().map(|c: &f64| (c - 1000.0).powi(2) / 1000.0).sum();
                assert!(chi2 < 63.0 + 5.0 * 11.2, "{x}: χ² = {chi2}");
            }
            // Images of two numbers are independent: all 56 pairs of images are about equally
            // frequent.
            for (x, y) in [(0, 1), (0, 4), (3, 6), (6, 7)] {
                let mut counts = [[0; 8]; 8];
                (0..56_000).for_each(|key| counts[permute(x, 3, key) as usize][permute(y, 3, key) as usize] += 1);
                let mut pairs = counts.into_iter().flatten().filter(|&count| count > 0);
                assert!(pairs.all(|count| (700..1400).contains(&count)), "{x} {y}: {counts:?}");
            }
        }
    }
}
