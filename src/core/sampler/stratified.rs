use super::hash::{numbered, permute_few, pixel, unit_f32};
use super::{Dimension, SampleKey, Sampler};
use crate::math::float::ALMOST_ONE;
use crate::math::{Vec2, hash::mix};

/// Base-2 logarithm of the number of strata per side of the unit square.
const SIDE_BITS: u32 = 3;
/// Base-2 logarithm of the number of samples in a block. Each stratum contains one sample of a
/// block.
const BLOCK_BITS: u32 = 2 * SIDE_BITS;

/// Jittered strata. The strata are 8 × 8 squares of the unit square, or 64 intervals in 1-D. Of
/// every 64 samples, each stratum contains one. Each dimension has a separate order of the strata
/// (Cook, Porter and Carpenter 1984). Correlated multi-jitter also places one sample in each of 64
/// columns and 64 rows (Kensler 2013, "Correlated Multi-Jittered Sampling").
///
/// Blocks of 64 are independent of each other. Any sample can be drawn separately, and the total
/// number of samples need not be known.
#[derive(Clone, Copy, Debug)]
pub struct Stratified {
    seed: u64,
    /// Hash of the seed, the pixel and the block.
    key: u64,
    sample: u32,
    multi_jitter: bool,
}

impl Stratified {
    /// A sampler that jitters each sample within its square.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            key: 0,
            sample: 0,
            multi_jitter: false,
        }
    }

    /// A sampler with correlated multi-jitter.
    pub fn multi_jittered(seed: u64) -> Self {
        Self {
            multi_jitter: true,
            ..Self::new(seed)
        }
    }

    /// Returns three values: the key of the pattern of `dimension`, the index of the sample's
    /// stratum, and random bits for the position within this stratum.
    fn place(&self, dimension: Dimension) -> (u64, u32, u64) {
        let pattern = numbered(self.key, dimension.index());
        let within = self.sample & ((1 << BLOCK_BITS) - 1);
        (
            pattern,
            permute_few(within, BLOCK_BITS, pattern),
            numbered(pattern, self.sample),
        )
    }
}

impl Sampler for Stratified {
    fn start(&mut self, key: SampleKey) {
        let block = key.sample >> BLOCK_BITS;
        self.key = mix(pixel(self.seed, key) ^ block as u64);
        self.sample = key.sample;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        let (_, stratum, bits) = self.place(dimension);
        // Keep the result below 1 in spite of rounding
        ((stratum as f32 + unit_f32(bits as u32)) / (1 << BLOCK_BITS) as f32).min(ALMOST_ONE)
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let (pattern, stratum, bits) = self.place(dimension);
        let (column, row) = (stratum & ((1 << SIDE_BITS) - 1), stratum >> SIDE_BITS);
        let mut within = Vec2::new(unit_f32((bits >> 32) as u32), unit_f32(bits as u32));
        let side = (1 << SIDE_BITS) as f32;
        if self.multi_jitter {
            // Divide each stratum into 8 × 8 cells. The strata of one column use different cell
            // columns, and the strata of one row use different cell rows.
            let part = |other, key| permute_few(other, SIDE_BITS, mix(pattern ^ key)) as f32;
            within = (within + Vec2::new(part(row, 1), part(column, 2))) / side;
        }
        let p = (Vec2::new(column as f32, row as f32) + within) / side;
        p.min(Vec2::splat(ALMOST_ONE))
    }
}
