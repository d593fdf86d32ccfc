//! SplitMix64 (Steele, Lea and Flood 2014) as a function of its counter.

use super::SampleKey;

/// SplitMix64's increment: 2⁶⁴ over the golden ratio, made odd.
pub(super) const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's output function: a bijection on 64 bits (variant 13 of Stafford's search).
pub(super) fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

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
