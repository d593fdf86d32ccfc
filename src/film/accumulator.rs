use super::metrics::DARK;
use crate::color::Spectrum;
use crate::math::Vec3;

/// What the camera sees first, for the auxiliary channels.
#[derive(Clone, Copy, Debug)]
pub struct FirstSurface {
    /// Albedo of the material.
    pub albedo: Spectrum,
    /// Unit shading normal in world space, on the side of the viewer.
    pub normal: Vec3,
    /// Distance along the camera's axis, scene units.
    pub depth: f32,
}

/// Samples whose sum is one term of a pixel's total.
pub const BLOCK: u32 = 64;

/// Sums over the samples of one pixel.
///
/// Radiance is added in f64. Sums of fixed sample ranges are merged in the order of their indices, so a pixel's bits
/// depend neither on threads nor on where a render was interrupted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accumulator {
    sum: [f64; 3],
    sum_of_squares: [f64; 3],
    /// Squared differences of the means of whole blocks from their mean.
    block_spread: [f64; 3],
    albedo: [f32; 3],
    normal: [f32; 3],
    depth: f32,
    surfaces: u32,
    samples: u32,
}

impl Accumulator {
    /// Adds one sample: its radiance, and the first surface if the camera ray met one.
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
        self.samples += 1;
    }

    /// Appends the sums of the samples that come next.
    pub fn merge(&mut self, next: &Self) {
        // Blocks that follow on blocks (Welford 1962, "Note on a Method for Calculating Corrected Sums of Squares and Products")
        if self.samples >= BLOCK && self.samples % BLOCK == 0 && next.samples == BLOCK {
            let blocks = (self.samples / BLOCK) as f64;
            for c in 0..3 {
                let d = next.mean(c) - self.mean(c);
                self.block_spread[c] += d * d * blocks / (blocks + 1.0);
            }
        }
        for c in 0..3 {
            self.sum[c] += next.sum[c];
            self.sum_of_squares[c] += next.sum_of_squares[c];
            self.albedo[c] += next.albedo[c];
            self.normal[c] += next.normal[c];
        }
        self.depth += next.depth;
        self.surfaces += next.surfaces;
        self.samples += next.samples;
    }

    /// Number of samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Mean radiance in channel `c`; 0 before the first sample.
    pub fn mean(&self, c: usize) -> f64 {
        if self.samples == 0 {
            0.0
        } else {
            self.sum[c] / self.samples as f64
        }
    }

    /// Unbiased estimate of the variance of [`Accumulator::mean`]; infinite while fewer than two samples tell nothing.
    pub fn variance_of_mean(&self, c: usize) -> f64 {
        if self.samples < 2 {
            return f64::INFINITY;
        }
        let n = self.samples as f64;
        let spread = self.sum_of_squares[c] - self.sum[c] * self.sum[c] / n;
        // Rounding can leave a constant pixel a hair below zero.
        spread.max(0.0) / (n * (n - 1.0))
    }

    /// Estimate of the pixel's squared error relative to its value, mean over the channels: what [`Errors::rel_mse`] averages, here
    /// without leaving the worst pixels out. Infinite before there are two blocks.
    ///
    /// It is the variance of the mean of independent blocks. Blocks of a low-discrepancy sequence fill each other's gaps:
    /// their mean is better than that, and the estimate too large.
    ///
    /// [`Errors::rel_mse`]: super::Errors::rel_mse
    pub fn squared_error(&self) -> f64 {
        let blocks = self.samples / BLOCK;
        if blocks < 2 {
            return f64::INFINITY;
        }
        let n = blocks as f64;
        let channel = |c| self.block_spread[c] / (n * (n - 1.0)) / (self.mean(c).powi(2) + DARK);
        [0, 1, 2].map(channel).iter().sum::<f64>() / 3.0
    }

    /// Mean albedo in channel `c`; background counts as black.
    pub fn albedo(&self, c: usize) -> f32 {
        self.albedo[c] / self.samples.max(1) as f32
    }

    /// Coordinate `c` of the mean normal; background counts as zero.
    pub fn normal(&self, c: usize) -> f32 {
        self.normal[c] / self.samples.max(1) as f32
    }

    /// Mean depth of the samples that met a surface, if any did.
    pub fn depth(&self) -> Option<f32> {
        (self.surfaces > 0).then(|| self.depth / self.surfaces as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_variance() {
        let mut a = Accumulator::default();
        assert_eq!((a.mean(0), a.variance_of_mean(0)), (0.0, f64::INFINITY));
        for x in [1.0, 2.0, 3.0, 6.0] {
            a.add(Spectrum::rgb(x, 0.0, 2.0), None);
        }
        assert_eq!(a.mean(0), 3.0);
        // Sample variance 14/3, of the mean a quarter of it.
        assert!((a.variance_of_mean(0) - 14.0 / 12.0).abs() < 1e-12);
        assert_eq!(a.variance_of_mean(2), 0.0);
        assert_eq!(a.depth(), None);
    }

    #[test]
    fn merging_ranges_appends_them() {
        let surface = FirstSurface {
            albedo: Spectrum::splat(0.5),
            normal: Vec3::Y,
            depth: 4.0,
        };
        let (mut all, mut a, mut b) = (Accumulator::default(), Accumulator::default(), Accumulator::default());
        for i in 0..10 {
            let part = if i < 6 { &mut a } else { &mut b };
            let surface = (i % 2 == 0).then_some(&surface);
            // Small integers: sums are exact in any order.
            all.add(Spectrum::splat(i as f32), surface);
            part.add(Spectrum::splat(i as f32), surface);
        }
        a.merge(&b);
        assert_eq!(a, all);
        assert_eq!(
            (a.samples(), a.depth(), a.normal(1), a.albedo(2)),
            (10, Some(4.0), 0.5, 0.25)
        );
    }

    #[test]
    fn errors_come_from_the_differences_of_blocks() {
        let means = [1.0, 2.0, 4.0, 5.0];
        let mut a = Accumulator::default();
        for (i, &mean) in means.iter().enumerate() {
            assert_eq!(a.squared_error().is_infinite(), i < 2);
            // The first block may come in parts.
            let parts: &[u32] = if i == 0 { &[2, 30, 32] } else { &[64] };
            for &samples in parts {
                let mut part = Accumulator::default();
                for j in 0..samples {
                    // What varies within a block does not count.
                    let d = if j % 2 == 0 { 0.5 } else { -0.5 };
                    part.add(Spectrum::splat(mean + d), None);
                }
                a.merge(&part);
            }
        }
        // Sample variance of the means 10/3, of their mean a quarter of it; their mean is 3.
        let expected = 10.0 / 12.0 / (9.0 + DARK);
        assert!(
            (a.squared_error() / expected - 1.0).abs() < 1e-6,
            "{}",
            a.squared_error()
        );
    }
}
