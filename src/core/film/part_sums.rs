//! Sums of parts of the light: of each light group, each strategy of a bidirectional method, and
//! each light path expression. A part takes 48 bytes per pixel.

use super::Fixed;
use crate::color::Spectrum;

/// Sums of one pixel in one task, over at most one block of samples. There is one sum for each part
/// of the light, such as a light group.
#[derive(Clone, Debug, PartialEq)]
pub struct PartBlock(Vec<[f64; 3]>);

impl PartBlock {
    /// Empty sums of `parts` parts.
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

    /// Sets all sums. The length of `sums` is the number of parts.
    pub(super) fn set(&mut self, sums: &[[f64; 3]]) {
        self.0.copy_from_slice(sums);
    }

    /// Makes all sums zero.
    pub fn clear(&mut self) {
        self.0.fill([0.0; 3]);
    }
}

/// Exact sum of one part of the light of a pixel, like the total in
/// [`Accumulator`](super::Accumulator).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PartSum(pub(super) [Fixed; 3]);

impl PartSum {
    /// Converts `sum` to fixed point. Each channel is rounded towards zero.
    pub(super) fn new(sum: [f64; 3]) -> Self {
        Self(sum.map(Fixed::new))
    }

    /// Sum of `self` and `other`.
    pub fn plus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|c| self.0[c].plus(other.0[c])))
    }

    /// Difference of `self` and `other`.
    pub fn minus(self, other: Self) -> Self {
        Self([0, 1, 2].map(|c| self.0[c].minus(other.0[c])))
    }

    /// Mean in channel `c` over `samples` samples; 0 before the first sample.
    pub fn mean(self, c: usize, samples: u32) -> f64 {
        self.0[c].to_f64() / samples.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cleared_block_equals_a_new_block() {
        let mut block = PartBlock::new(3);
        block.add(&[Spectrum::ONE; 16]);
        assert_ne!(block, PartBlock::new(3));
        block.clear();
        assert_eq!(block, PartBlock::new(3));
    }
}
