//! SplitMix64 (Steele, Lea and Flood 2014), whose output function is a hash.

/// SplitMix64's increment: 2⁶⁴ divided by the golden ratio, made odd.
pub const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// SplitMix64's output function: a bijection on 64 bits (variant 13 of Stafford's search).
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Number in [0, 1) from the top 24 bits of `bits`: a multiple of 2⁻²⁴, which is exact in `f32`.
pub fn unit_f32(bits: u64) -> f32 {
    (bits >> 40) as f32 * (1.0 / (1u64 << 24) as f32)
}

/// Number in [0, 1) from the top 53 bits of `bits`: a multiple of 2⁻⁵³, which is exact in `f64`.
pub fn unit_f64(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}
