//! Sums of parts of the light: of each light group, of each strategy of a bidirectional method, and of each part by light paths. A part takes 48 bytes
//! a pixel.

use super::Fixed;
use crate::color::Spectrum;

/// Sums of parts of the light that are distinguished, such as that of each group of lights, over samples of one pixel that one task takes, of a block at most.
#[derive(Clone, Debug, PartialEq)]
pub struct PartBlock(Vec<[f64; 3]>);

impl PartBlock {
    /// Empty sums of so many parts.
    pub fn new(parts: usize) -> Self {
        Self(vec![[0.0; 3]; parts])
    }

    /// Adds one sample, part by part.
    pub fn add(&mut self, radiance: &[Spectrum]) {
        for (sum, radiance) in self.0.iter_mut().zip(radiance) {
            for (sum, value) in sum.iter_mut().zip(radiance.to_array()) {
                *sum += value as f64;
            }
        }
    }

    /// Sums of all parts.
    pub fn sums(&self) -> &[[f64; 3]] {
        &self.0
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.0.fill([0.0; 3]);
    }

    /// Adds it to the sums of its pixel, part by part.
    pub fn add_to(&self, sums: &mut [PartSum]) {
        for (sum, block) in sums.iter_mut().zip(&self.0) {
            *sum = sum.plus(PartSum::new(*block));
        }
    }

    /// Takes it out of them again.
    pub fn take_back_from(&self, sums: &mut [PartSum]) {
        for (sum, block) in sums.iter_mut().zip(&self.0) {
            *sum = sum.minus(PartSum::new(*block));
        }
    }
}

/// Sum of one part of a pixel's light, exact as that of all light in [`Accumulator`](super::Accumulator).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartSum(pub(super) [Fixed; 3]);

impl PartSum {
    /// The exact sum that is nearest towards zero, by channel.
    pub(super) fn new(sum: [f64; 3]) -> Self {
        Self(sum.map(Fixed::new))
    }

    /// Sum of `self` and `other`.
    pub fn plus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|c| self.0[c].plus(other.0[c])))
    }

    /// The difference.
    pub fn minus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|c| self.0[c].minus(other.0[c])))
    }

    /// Mean in channel `c` over so many samples; 0 before the first one.
    pub fn mean(self, c: usize, samples: u32) -> f64 {
        self.0[c].to_f64() / samples.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_does_not_matter_and_what_is_taken_back_was_never_there() {
        let block = |range: std::ops::Range<u32>| {
            let mut block = PartBlock::new(2);
            for i in range {
                block.add(&[
                    Spectrum::rgb(0.1, i as f32, 1e9),
                    Spectrum::splat(1e-6 / (i + 1) as f32),
                ]);
            }
            block
        };
        let sum = |blocks: &[PartBlock]| {
            let mut sums = [PartSum::default(); 2];
            blocks.iter().for_each(|block| block.add_to(&mut sums));
            sums
        };
        let blocks = [block(0..2), block(2..40), block(40..100)];
        let backwards = [blocks[2].clone(), blocks[1].clone(), blocks[0].clone()];
        let mut all = sum(&blocks);
        assert_eq!(all, sum(&backwards));
        let parts = [sum(&blocks[..2]), sum(&blocks[2..])];
        assert_eq!(all, [0, 1].map(|group| parts[0][group].plus(parts[1][group])));
        assert!((all[0].mean(1, 100) - 49.5).abs() < 1e-9 && (all[1].mean(2, 100) - 5.187e-8).abs() < 1e-10);
        blocks[1..].iter().for_each(|block| block.take_back_from(&mut all));
        assert_eq!(all, sum(&blocks[..1]));
        assert_eq!(PartSum::default().mean(0, 0), 0.0);
    }

    #[test]
    fn a_block_that_is_cleared_is_a_new_one() {
        let mut block = PartBlock::new(3);
        block.add(&[Spectrum::ONE; 16]);
        assert_ne!(block, PartBlock::new(3));
        block.clear();
        assert_eq!(block, PartBlock::new(3));
    }
}
