//! Sums of one pixel: the sums over one pass (`Block`), and the exact totals over all passes
//! (`Accumulator`).

use super::fixed::Narrow;
use super::{Features, Fixed};
use crate::color::{Spectrum, luminance};
use crate::math::Vec3;

/// First surface along a camera ray, for the auxiliary channels.
#[derive(Clone, Copy, Debug)]
pub struct FirstSurface {
    /// Albedo of the material.
    pub albedo: Spectrum,
    /// Unit shading normal in world space, on the side of the viewer.
    pub normal: Vec3,
    /// Distance along the camera's axis, in scene units.
    pub depth: f32,
    /// Luminance of the radiance that the surface emits towards the camera.
    pub emitted: f32,
    /// Values of further channels, if requested.
    pub features: Option<Features>,
}

/// Number of samples whose sum is one term of a pixel's total.
pub const BLOCK: u32 = 64;

/// Sums over the samples of one pixel in one task: at most [`BLOCK`] samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Block {
    sum: [f64; 3],
    sum_of_squares: [f64; 3],
    albedo: [f32; 3],
    normal: [f32; 3],
    depth: f32,
    emitted: f64,
    surfaces: u32,
    samples: u32,
}

impl Block {
    /// Block of a single sample. The sum `radiance` of the light of this sample is in double
    /// precision.
    pub(super) fn alone(radiance: [f64; 3], surface: Option<&FirstSurface>) -> Self {
        let mut block = Self::default();
        block.add(Spectrum::from(radiance.map(|value| value as f32)), surface);
        block.sum = radiance;
        block.sum_of_squares = radiance.map(|value| value * value);
        block
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Sum of the radiance of all samples, by channel.
    pub fn sum(&self) -> [f64; 3] {
        self.sum
    }

    /// Adds one sample: its radiance, and the first surface if the camera ray hit one. Without a
    /// surface, the radiance comes from the background, and its luminance counts as emitted light.
    pub fn add(&mut self, radiance: Spectrum, surface: Option<&FirstSurface>) {
        for (c, value) in radiance.to_array().into_iter().enumerate() {
            let value = value as f64;
            self.sum[c] += value;
            self.sum_of_squares[c] += value * value;
        }
        if let Some(s) = surface {
            let (albedo, normal) = (s.albedo.to_array(), s.normal.to_array());
            for c in 0..3 {
                self.albedo[c] += albedo[c];
                self.normal[c] += normal[c];
            }
            self.depth += s.depth;
            self.surfaces += 1;
        }
        self.emitted += f64::from(surface.map_or_else(|| radiance.luminance(), |s| s.emitted));
        self.samples += 1;
    }
}

/// Sums over all samples of one pixel.
///
/// A total is the exact sum of its terms. Each term is the sum of a block of samples. The first
/// block can be added in parts; each part is then a term. The indices of the samples determine the
/// terms, so the bits of a pixel do not depend on threads, on interruptions, or on the machine that
/// took a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accumulator {
    pub(super) exact: ExactSums,
    /// Sum of the squared differences between the means of full blocks and their common mean.
    pub(super) block_spread: [f64; 3],
}

/// Exact sums over the samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ExactSums {
    /// Radiance, from [`SUM`] on, its squares, from [`SQUARES`] on, depth, and luminance of the
    /// light emitted towards the camera by a surface or the background.
    pub wide: [Fixed; 8],
    /// Albedo, then normal, from [`NORMAL`] on.
    pub narrow: [Narrow; 6],
    /// Numbers of samples that hit a surface, and of all samples.
    pub counts: [u32; 2],
}

// Indices in the arrays of `ExactSums`
const SUM: usize = 0;
const SQUARES: usize = 3;
const DEPTH: usize = 6;
const EMITTED: usize = 7;
const NORMAL: usize = 3;
const SURFACES: usize = 0;
const SAMPLES: usize = 1;

impl ExactSums {
    /// Changes each sum by the corresponding sum of `block`.
    #[inline(always)]
    fn change(
        &mut self,
        block: &Block,
        wide: fn(Fixed, Fixed) -> Fixed,
        narrow: fn(Narrow, Narrow) -> Narrow,
        count: fn(u32, u32) -> u32,
    ) {
        let ([r, g, b], [rr, gg, bb]) = (block.sum, block.sum_of_squares);
        let terms = [r, g, b, rr, gg, bb, f64::from(block.depth), block.emitted];
        for (sum, term) in self.wide.iter_mut().zip(terms) {
            *sum = wide(*sum, Fixed::new(term));
        }
        let terms = block.albedo.into_iter().chain(block.normal);
        for (sum, term) in self.narrow.iter_mut().zip(terms) {
            *sum = narrow(*sum, Narrow::new(f64::from(term)));
        }
        self.counts[SURFACES] = count(self.counts[SURFACES], block.surfaces);
        self.counts[SAMPLES] = count(self.counts[SAMPLES], block.samples);
    }

    fn add(&mut self, block: &Block) {
        self.change(block, Fixed::plus, Narrow::plus, u32::saturating_add);
    }

    fn subtract(&mut self, block: &Block) {
        self.change(block, Fixed::minus, Narrow::minus, u32::saturating_sub);
    }

    fn merge(&mut self, other: &Self) {
        for (sum, other) in self.wide.iter_mut().zip(other.wide) {
            *sum = sum.plus(other);
        }
        for (sum, other) in self.narrow.iter_mut().zip(other.narrow) {
            *sum = sum.plus(other);
        }
        for (count, other) in self.counts.iter_mut().zip(other.counts) {
            *count = count.saturating_add(other);
        }
    }
}

impl Accumulator {
    /// Adds the next samples.
    pub fn add(&mut self, block: &Block) {
        // Update the running variance over full blocks (Welford 1962, "Note on a Method for
        // Calculating Corrected Sums of Squares and Products")
        let samples = self.samples();
        if samples >= BLOCK && samples % BLOCK == 0 && block.samples == BLOCK {
            let blocks = (samples / BLOCK) as f64;
            for c in 0..3 {
                let d = block.sum[c] / BLOCK as f64 - self.mean(c);
                self.block_spread[c] += d * d * blocks / (blocks + 1.0);
            }
        }
        self.exact.add(block);
    }

    /// Adds one sample as a separate term, which belongs to no block. The spread of blocks becomes
    /// NaN. Errors are then estimated as if samples were independent.
    pub fn add_alone(&mut self, sample: &Block) {
        self.block_spread = [f64::NAN; 3];
        self.exact.add(sample);
    }

    /// Subtracts the samples that were added last. `block` must have fewer samples than a full
    /// block.
    pub fn take_back(&mut self, block: &Block) {
        self.exact.subtract(block);
    }

    /// Adds the samples of another accumulator of the same pixel. The sums are bit-identical to the
    /// sums of one render. The spread of blocks, from which the error is estimated, is equal up to
    /// rounding.
    pub fn merge(&mut self, other: &Self) {
        // Merge the spreads (Chan, Golub and LeVeque 1983, "Algorithms for Computing the Sample
        // Variance")
        let [n, m] = [self.samples(), other.samples()].map(|samples| (samples / BLOCK) as f64);
        let spread = |c: usize| {
            let between = if n * m > 0.0 {
                (other.mean(c) - self.mean(c)).powi(2) * n * m / (n + m)
            } else {
                0.0
            };
            self.block_spread[c] + other.block_spread[c] + between
        };
        self.block_spread = [0, 1, 2].map(spread);
        self.exact.merge(&other.exact);
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        self.exact.counts[SAMPLES]
    }

    /// Mean radiance in channel `c`; 0 before the first sample.
    pub fn mean(&self, c: usize) -> f64 {
        if self.samples() == 0 {
            0.0
        } else {
            self.exact.wide[SUM + c].to_f64() / self.samples() as f64
        }
    }

    /// Luminance of [`Accumulator::mean`].
    pub fn luminance(&self) -> f64 {
        luminance([0, 1, 2].map(|c| self.mean(c)))
    }

    /// Unbiased estimate of the variance of [`Accumulator::mean`]; infinite with fewer than two
    /// samples.
    // ANCHOR: variance
    pub fn variance_of_mean(&self, c: usize) -> f64 {
        if self.samples() < 2 {
            return f64::INFINITY;
        }
        let n = self.samples() as f64;
        let sum = self.exact.wide[SUM + c].to_f64();
        let spread = self.exact.wide[SQUARES + c].to_f64() - sum * sum / n;
        // Rounding can leave the spread of a constant pixel slightly below zero.
        spread.max(0.0) / (n * (n - 1.0))
    }
    // ANCHOR_END: variance

    /// Estimate of the pixel's squared relative error, as a mean over the channels. The relMSE of
    /// `compare` is a mean of a similar quantity, with a fixed `floor` of 0.1 and without the worst
    /// pixels. The estimate is infinite with fewer than two blocks.
    ///
    /// The divisor is the squared mean plus the squared `floor`, a radiance. Without it, dark
    /// pixels would dominate.
    ///
    /// The estimate is the variance of the mean of independent blocks. Blocks of a low-discrepancy
    /// sequence are not independent, because their samples fill each other's gaps. Their mean is
    /// more accurate, so the estimate is too large.
    pub fn squared_error(&self, floor: f64) -> f64 {
        if self.block_spread[0].is_nan() {
            return self.independent_squared_error(floor);
        }
        let blocks = self.samples() / BLOCK;
        if blocks < 2 {
            return f64::INFINITY;
        }
        let n = blocks as f64;
        let channel = |c| self.block_spread[c] / (n * (n - 1.0)) / self.divisor(c, floor);
        [0, 1, 2].map(channel).iter().sum::<f64>() / 3.0
    }

    /// Squared error from the variance of all samples, as if the samples were independent.
    pub fn independent_squared_error(&self, floor: f64) -> f64 {
        let channel = |c| self.variance_of_mean(c) / self.divisor(c, floor);
        [0, 1, 2].map(channel).iter().sum::<f64>() / 3.0
    }

    /// Divisor of the squared relative error of channel `c`.
    fn divisor(&self, c: usize, floor: f64) -> f64 {
        self.mean(c).powi(2) + floor.powi(2)
    }

    /// Mean albedo in channel `c`. The background is black.
    pub fn albedo(&self, c: usize) -> f32 {
        (self.exact.narrow[c].to_f64() / self.samples().max(1) as f64) as f32
    }

    /// Coordinate `c` of the mean normal. The normal of the background is zero.
    pub fn normal(&self, c: usize) -> f32 {
        (self.exact.narrow[NORMAL + c].to_f64() / self.samples().max(1) as f64) as f32
    }

    /// Mean luminance of the light emitted towards the camera, by the first surface or the
    /// background.
    pub fn emitted(&self) -> f32 {
        (self.exact.wide[EMITTED].to_f64() / self.samples().max(1) as f64) as f32
    }

    /// Mean depth of the samples that hit a surface, if any.
    pub fn depth(&self) -> Option<f32> {
        (self.exact.counts[SURFACES] > 0)
            .then(|| (self.exact.wide[DEPTH].to_f64() / self.exact.counts[SURFACES] as f64) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(values: &[f32]) -> Block {
        let mut block = Block::default();
        values.iter().for_each(|&v| block.add(Spectrum::splat(v), None));
        block
    }

    #[test]
    fn mean_and_variance() {
        let mut a = Accumulator::default();
        assert_eq!((a.mean(0), a.variance_of_mean(0)), (0.0, f64::INFINITY));
        let mut block = Block::default();
        for x in [1.0, 2.0, 3.0, 6.0] {
            block.add(Spectrum::rgb(x, 0.0, 2.0), None);
        }
        a.add(&block);
        assert_eq!(a.mean(0), 3.0);
        // The sample variance is 14/3; the variance of the mean is a quarter of it.
        assert!((a.variance_of_mean(0) - 14.0 / 12.0).abs() < 1e-12);
        assert_eq!(a.variance_of_mean(2), 0.0);
        assert_eq!(a.depth(), None);
    }

    #[test]
    fn surfaces_are_counted_apart() {
        let surface = FirstSurface {
            albedo: Spectrum::splat(0.5),
            normal: Vec3::Y,
            depth: 4.0,
            emitted: 0.0,
            features: None,
        };
        let mut block = Block::default();
        for i in 0..10 {
            block.add(Spectrum::ONE, (i % 2 == 0).then_some(&surface));
        }
        let mut a = Accumulator::default();
        a.add(&block);
        assert_eq!(
            (a.samples(), a.depth(), a.normal(1), a.albedo(2)),
            (10, Some(4.0), 0.5, 0.25)
        );
    }

    /// The merged sums do not depend on the division into parts, nor on the order of the parts.
    #[test]
    fn merged_sums_are_bit_identical_to_one_render() {
        let value = |i: u32| (i as f32 * 0.7).sin().abs() * 10f32.powi(i as i32 % 13 - 6);
        let of = |blocks: std::ops::Range<u32>| {
            let mut a = Accumulator::default();
            for b in blocks {
                let values: Vec<f32> = (64 * b..64 * (b + 1)).map(value).collect();
                a.add(&block(&values));
            }
            a
        };
        let all = of(0..7);
        for parts in [vec![0..3, 3..7], vec![4..7, 0..1, 1..4], vec![6..7, 0..0, 0..6]] {
            let mut merged = Accumulator::default();
            parts.into_iter().for_each(|part| merged.merge(&of(part)));
            for c in 0..3 {
                assert_eq!(merged.mean(c).to_bits(), all.mean(c).to_bits());
                assert_eq!(merged.variance_of_mean(c).to_bits(), all.variance_of_mean(c).to_bits());
            }
            let error = merged.squared_error(0.1) / all.squared_error(0.1) - 1.0;
            assert!(error.abs() < 1e-9, "{error}");
        }
    }

    #[test]
    fn subtracting_a_block_restores_the_sums() {
        let mut a = Accumulator::default();
        a.add(&block(&[0.3; 64]));
        let before = a;
        let tail = block(&[0.1, 1e-7, 5e3]);
        a.add(&tail);
        a.take_back(&tail);
        assert_eq!(a, before);
    }

    #[test]
    fn errors_come_from_the_differences_of_blocks() {
        let means = [1.0, 2.0, 4.0, 5.0];
        let mut a = Accumulator::default();
        for (i, &mean) in means.iter().enumerate() {
            assert_eq!(a.squared_error(0.1).is_infinite(), i < 2);
            // The first block may be added in parts.
            let parts: &[u32] = if i == 0 { &[2, 30, 32] } else { &[64] };
            for &samples in parts {
                let mut part = Block::default();
                for j in 0..samples {
                    // The spread of samples within a block does not count.
                    let d = if j % 2 == 0 { 0.5 } else { -0.5 };
                    part.add(Spectrum::splat(mean + d), None);
                }
                a.add(&part);
            }
        }
        // The sample variance of the means is 10/3; the variance of their mean is a quarter of it.
        // The mean is 3.
        let expected = 10.0 / 12.0 / (9.0 + 0.01);
        assert!(
            (a.squared_error(0.1) / expected - 1.0).abs() < 1e-6,
            "{}",
            a.squared_error(0.1)
        );
    }
}
