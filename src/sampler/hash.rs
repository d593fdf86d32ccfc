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
