//! SplitMix64 as a function of its counter.

use super::SampleKey;
use crate::math::hash::{GOLDEN_GAMMA, mix};

/// Number `n` of the sequence that `key` names.
pub(super) fn numbered(key: u64, n: u32) -> u64 {
    mix(key.wrapping_add((n as u64 + 1).wrapping_mul(GOLDEN_GAMMA)))
}

/// A hash of seed and pixel. Each input is hashed in by itself, so that no two of them can cancel.
pub(super) fn pixel(seed: u64, key: SampleKey) -> u64 {
    let pixel = ((key.y as u64) << 32) | key.x as u64;
    mix(mix(seed.wrapping_add(GOLDEN_GAMMA)) ^ pixel)
}

/// The top 24 of 32 bits as a multiple of 2⁻²⁴ in [0, 1): every such value is exact in f32.
pub(super) fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// A permutation of the numbers of `bits` digits, chosen by `key`: where it puts `x`, which is one of them.
pub(super) fn permute(mut x: u32, bits: u32, key: u64) -> u32 {
    let mask = ((1u64 << bits) - 1) as u32;
    let mut key = key;
    // Each step can be undone: an odd factor, an exclusive or with higher digits, a sum.
    for _ in 0..4 {
        key = mix(key);
        x = x.wrapping_mul(key as u32 | 1) & mask;
        x ^= x >> (bits / 2).max(1);
        x = x.wrapping_add((key >> 32) as u32) & mask;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_are_permutations_and_differ() {
        for bits in [0, 1, 2, 3, 6, 9] {
            let n = 1u32 << bits;
            for key in 0..50 {
                let mut all: Vec<u32> = (0..n).map(|x| permute(x, bits, key)).collect();
                all.sort_unstable();
                assert_eq!(all, (0..n).collect::<Vec<_>>(), "{bits} bits, key {key}");
            }
        }
        // Each number goes everywhere alike: χ² with 63 degrees of freedom, mean 63 and standard deviation 11.2.
        for x in [0, 1, 32, 63] {
            let mut counts = [0.0; 64];
            (0..64_000).for_each(|key| counts[permute(x, 6, key) as usize] += 1.0);
            let chi2: f64 = counts.iter().map(|c: &f64| (c - 1000.0).powi(2) / 1000.0).sum();
            assert!(chi2 < 63.0 + 5.0 * 11.2, "{x}: χ² = {chi2}");
        }
    }
}
