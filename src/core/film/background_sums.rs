//! Fraction of the background's light that a pixel receives.

use super::Fixed;
use super::accumulator::BLOCK;
use crate::color::{Spectrum, luminance};

/// Floor of relative errors in front of a white background, as a fraction of white.
const WHITE_FLOOR: f64 = 0.1;

/// A background to which exposure and tone curve do not apply in pictures for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Backing {
    /// No background: the picture has an alpha channel.
    Transparent,
    /// A colour, linear Rec.709. Exposure and tone curve apply only to the light in front of this
    /// colour.
    Color(Spectrum),
}

impl Backing {
    /// Names of the coverage channels. Coverage is the fraction of a pixel that is not light of the
    /// background, for red, green and blue. The three fractions differ in coloured shadows on a
    /// ground. Alpha is the luminance of the three fractions.
    pub const fn channels(self) -> &'static [&'static str] {
        match self {
            Self::Transparent => &["A"],
            Self::Color(_) => &["coverage.R", "coverage.G", "coverage.B"],
        }
    }

    /// Names of the coverage channels before denoising.
    pub const fn raw_channels(self) -> &'static [&'static str] {
        match self {
            Self::Transparent => &["raw.A"],
            Self::Color(_) => &["raw.coverage.R", "raw.coverage.G", "raw.coverage.B"],
        }
    }

    /// Light of the background in `R G B` of a pixel that nothing covers.
    pub fn light(self) -> Spectrum {
        match self {
            Self::Transparent => Spectrum::ZERO,
            Self::Color(color) => color,
        }
    }
}

/// Sum over the samples of a pixel. The term of a sample is the fraction of the background's light
/// that the sample receives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BackgroundSum {
    /// Exact sum of each channel.
    pub sum: [Fixed; 3],
    /// Sum of the squared differences between the mean luminances of full blocks and their common
    /// mean. NaN if samples were added outside of blocks.
    pub(super) block_spread: f64,
}

impl BackgroundSum {
    /// Adds `share`, the sum over `samples` samples. `before` is the number of earlier samples.
    pub fn add(&mut self, share: [f64; 3], samples: u32, before: u32) {
        if before >= BLOCK && before % BLOCK == 0 && samples == BLOCK {
            let blocks = f64::from(before / BLOCK);
            let difference = luminance(share) / f64::from(BLOCK) - luminance(self.mean(before));
            self.block_spread += difference * difference * blocks / (blocks + 1.0);
        }
        self.change(share, Fixed::plus);
    }

    /// Adds the `share` of one sample that is in no block.
    pub fn add_alone(&mut self, share: [f64; 3]) {
        self.change(share, Fixed::plus);
        self.block_spread = f64::NAN;
    }

    /// Subtracts `share`, the sum over the samples that were added last. They must be fewer than a
    /// full block.
    pub fn take_back(&mut self, share: [f64; 3]) {
        self.change(share, Fixed::minus);
    }

    fn change(&mut self, share: [f64; 3], by: fn(Fixed, Fixed) -> Fixed) {
        self.sum = [0, 1, 2].map(|c| by(self.sum[c], Fixed::new(share[c])));
    }

    /// Adds `other`, the sum of other samples of the same pixel. `own` and `others` are the numbers
    /// of samples of `self` and of `other`.
    pub fn merge(&mut self, other: &Self, [own, others]: [u32; 2]) {
        // Merge the spreads (Chan, Golub and LeVeque 1983, "Algorithms for Computing the Sample
        // Variance")
        let [n, m] = [own, others].map(|samples| f64::from(samples / BLOCK));
        let between = if n * m > 0.0 {
            luminance([0, 1, 2].map(|c| other.mean(others)[c] - self.mean(own)[c])).powi(2) * n * m / (n + m)
        } else {
            0.0
        };
        self.sum = [0, 1, 2].map(|c| self.sum[c].plus(other.sum[c]));
        self.block_spread += other.block_spread + between;
    }

    /// Mean fraction over `samples` samples; 0 before the first sample.
    pub fn mean(&self, samples: u32) -> [f64; 3] {
        self.sum.map(|sum| sum.to_f64() / f64::from(samples.max(1)))
    }

    /// Coverage over `samples` samples: 1 − the mean fraction, and 0 before the first sample.
    pub(super) fn coverage(&self, samples: u32) -> [f32; 3] {
        if samples == 0 {
            return [0.0; 3];
        }
        self.mean(samples).map(|seen| (1.0 - seen).clamp(0.0, 1.0) as f32)
    }

    /// Estimate of the squared relative error that the noise of the coverage causes in front of a
    /// white background. Infinite with fewer than two blocks. The estimate is the analogue of
    /// [`Accumulator::squared_error`].
    ///
    /// [`Accumulator::squared_error`]: super::Accumulator::squared_error
    pub fn squared_error(&self, samples: u32) -> f64 {
        let mean = luminance(self.mean(samples));
        let (count, spread) = if self.block_spread.is_nan() {
            // Without blocks, treat samples as independent. The variance of fractions in [0, 1]
            // with this mean is at most mean × (1 − mean)
            (f64::from(samples), f64::from(samples) * (mean * (1.0 - mean)).max(0.0))
        } else {
            (f64::from(samples / BLOCK), self.block_spread)
        };
        if count < 2.0 {
            return f64::INFINITY;
        }
        spread / (count * (count - 1.0)) / (mean.powi(2) + WHITE_FLOOR.powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_come_from_the_differences_of_blocks() {
        let means = [0.0, 0.5, 0.25, 0.25];
        let mut whole = BackgroundSum::default();
        let mut halves = [BackgroundSum::default(); 2];
        for (i, mean) in means.into_iter().enumerate() {
            let share = [mean * f64::from(BLOCK); 3];
            assert_eq!(whole.squared_error(i as u32 * BLOCK).is_infinite(), i < 2);
            whole.add(share, BLOCK, i as u32 * BLOCK);
            halves[i / 2].add(share, BLOCK, (i as u32 % 2) * BLOCK);
        }
        // The variance of the means is 1/24; the variance of their mean is a quarter of it. The
        // mean is 1/4.
        let expected = 0.125 / 12.0 / (0.0625 + 0.01);
        let error = whole.squared_error(4 * BLOCK);
        assert!((error / expected - 1.0).abs() < 1e-9, "{error} {expected}");
        let [mut merged, other] = halves;
        merged.merge(&other, [2 * BLOCK; 2]);
        assert_eq!(merged.sum, whole.sum);
        assert!((merged.block_spread - whole.block_spread).abs() < 1e-12);
        // Adding and subtracting samples restores the sums.
        let mut longer = whole;
        longer.add([3.5; 3], 7, 4 * BLOCK);
        longer.take_back([3.5; 3]);
        assert_eq!(longer, whole);
    }
}
