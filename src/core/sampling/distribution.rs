//! Piecewise-constant distributions over the unit interval and the unit square.

use crate::math::{Vec2, float::ALMOST_ONE};
use std::ops::Range;

/// A probability density over [0, 1) that is constant in each of n equal steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution1D {
    /// Cumulative probabilities: element i is the probability of all steps before step i. The last
    /// element is 1.
    cdf: Vec<f32>,
    integral: f64,
}

impl Distribution1D {
    /// A density proportional to `weights`, which are finite and ≥ 0. It is uniform if the weights
    /// sum to 0.
    ///
    /// # Panics
    /// Panics if `weights` is empty.
    pub fn new(weights: &[f32]) -> Self {
        assert!(!weights.is_empty(), "a distribution has at least one step");
        let n = weights.len();
        let total: f64 = weights.iter().map(|&w| w as f64).sum();
        let mut sum = 0.0;
        let mut cdf = Vec::with_capacity(n + 1);
        cdf.push(0.0);
        for (i, &w) in weights.iter().enumerate() {
            sum += w as f64;
            cdf.push(if total > 0.0 {
                (sum / total) as f32
            } else {
                ((i + 1) as f64 / n as f64) as f32
            });
        }
        cdf[n] = 1.0;
        Self {
            cdf,
            integral: total / n as f64,
        }
    }

    /// Number of steps.
    fn len(&self) -> usize {
        self.cdf.len() - 1
    }

    /// Mean of the weights, which is the integral of the function before normalisation.
    pub fn integral(&self) -> f64 {
        self.integral
    }

    /// Draws `x` in [0, 1) by inversion. Returns `x` and the index of its step.
    pub fn sample(&self, u: f32) -> (f32, usize) {
        // Find the last step that begins at or below `u`. Its width is positive, except if `u` is
        // at the very end.
        let i = self.cdf.partition_point(|&c| c <= u).clamp(1, self.len()) - 1;
        let (low, high) = (self.cdf[i], self.cdf[i + 1]);
        let within = if high > low {
            ((u - low) / (high - low)).clamp(0.0, ALMOST_ONE)
        } else {
            0.5
        };
        (self.place(i, within), i)
    }

    /// Draws `x` within the steps `steps` by inversion. Returns `x` and the index of its step. The
    /// probability of `steps` must be above 0.
    fn sample_within(&self, steps: &Range<usize>, u: f32) -> (f32, usize) {
        let (low, high) = (self.cdf[steps.start], self.cdf[steps.end]);
        // Largest number below `high`, which is positive
        let last = f32::from_bits(high.to_bits().saturating_sub(1)).max(low);
        self.sample((low + u * (high - low)).clamp(low, last))
    }

    /// Probability of the steps `steps`.
    fn probability(&self, steps: &Range<usize>) -> f32 {
        self.cdf[steps.end] - self.cdf[steps.start]
    }

    /// Position in [0, 1) that lies in step `i`, at the fraction `within` in [0, 1) of its width.
    fn place(&self, i: usize, within: f32) -> f32 {
        // Rounding must not move the position into a neighbouring step, which has a different
        // density.
        let mut x = ((i as f32 + within) / self.len() as f32).min(ALMOST_ONE);
        while self.step(x) > i {
            x = f32::from_bits(x.to_bits() - 1);
        }
        while self.step(x) < i {
            x = f32::from_bits(x.to_bits() + 1);
        }
        x
    }

    /// Probability density at `x` in [0, 1).
    pub fn pdf(&self, x: f32) -> f32 {
        self.pdf_of_step(self.step(x))
    }

    fn step(&self, x: f32) -> usize {
        ((x * self.len() as f32) as usize).min(self.len() - 1)
    }

    fn pdf_of_step(&self, i: usize) -> f32 {
        (self.cdf[i + 1] - self.cdf[i]) * self.len() as f32
    }
}

/// A probability density over the unit square that is constant in each cell of a grid (PBR4
/// §A.5.6).
#[derive(Clone, Debug, PartialEq)]
pub struct Distribution2D {
    /// Distributions over x, one for each row.
    rows: Vec<Distribution1D>,
    /// Distribution over y: the choice of the row.
    marginal: Distribution1D,
}

impl Distribution2D {
    /// A density proportional to `weights`, which are given row by row with `width` weights per
    /// row. All weights are finite and ≥ 0.
    ///
    /// # Panics
    /// Panics if `weights` is empty or its last row is incomplete.
    pub fn new(weights: &[f32], width: usize) -> Self {
        assert!(width > 0 && weights.len() % width == 0, "rows of {width} weights");
        let rows: Vec<Distribution1D> = weights.chunks(width).map(Distribution1D::new).collect();
        let totals: Vec<f32> = rows.iter().map(|row| row.integral() as f32).collect();
        Self {
            marginal: Distribution1D::new(&totals),
            rows,
        }
    }

    /// Draws a point of the unit square. Returns the point and its density.
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let (y, row) = self.marginal.sample(u.y);
        let (x, column) = self.rows[row].sample(u.x);
        let pdf = self.marginal.pdf_of_step(row) * self.rows[row].pdf_of_step(column);
        (Vec2::new(x, y), pdf)
    }

    /// Probability of the columns `columns` of the row `row`.
    pub fn probability(&self, row: usize, columns: &Range<usize>) -> f64 {
        self.marginal.probability(&(row..row + 1)) as f64 * self.rows[row].probability(columns) as f64
    }

    /// Draws a point within the columns `columns` of the row `row`, whose probability must be above
    /// 0. Returns the point and its density over the whole square.
    pub fn sample_within(&self, row: usize, columns: &Range<usize>, u: Vec2) -> (Vec2, f32) {
        let (x, column) = self.rows[row].sample_within(columns, u.x);
        let pdf = self.marginal.pdf_of_step(row) * self.rows[row].pdf_of_step(column);
        (Vec2::new(x, self.marginal.place(row, u.y.min(ALMOST_ONE))), pdf)
    }

    /// Probability density at `p` in [0, 1)².
    pub fn pdf(&self, p: Vec2) -> f32 {
        let row = self.marginal.step(p.y);
        self.marginal.pdf_of_step(row) * self.rows[row].pdf(p.x)
    }

    /// Size of the tables in bytes.
    pub fn bytes(&self) -> usize {
        (self.rows.len() + 1) * size_of_val(self.marginal.cdf.as_slice()).max(size_of_val(self.rows[0].cdf.as_slice()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Dimension, Independent, SampleKey, Sampler};

    #[test]
    fn steps_are_drawn_by_weight() {
        let d = Distribution1D::new(&[0.0, 1.0, 3.0, 0.0]);
        assert_eq!(
            (d.integral(), d.pdf(0.1), d.pdf(0.3), d.pdf(0.6), d.pdf(0.9)),
            (1.0, 0.0, 1.0, 3.0, 0.0)
        );
        assert_eq!(d.sample(0.0), (0.25, 1));
        assert_eq!(d.sample(0.25), (0.5, 2));
        let (x, step) = d.sample(ALMOST_ONE);
        assert!(x < 0.75 && step == 2, "{x}");
        assert_eq!(Distribution1D::new(&[0.0, 0.0]).pdf(0.7), 1.0);
    }

    #[test]
    fn cells_are_drawn_by_weight() {
        let weights = [0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 4.0, 0.5, 0.5];
        let d = Distribution2D::new(&weights, 3);
        let mut sampler = Independent::new(1);
        let mut count = [0; 9];
        const N: u32 = 80_000;
        for i in 0..N {
            sampler.start(SampleKey::new(0, 0, i));
            let (p, pdf) = d.sample(sampler.get_2d(Dimension::PIXEL));
            let cell = (p.y * 3.0) as usize * 3 + (p.x * 3.0) as usize;
            assert!((pdf - weights[cell] * 9.0 / 8.0).abs() < 1e-5 && (d.pdf(p) - pdf).abs() < 1e-5);
            count[cell] += 1;
        }
        for (n, w) in count.iter().zip(weights) {
            let expected = N as f32 * w / 8.0;
            assert!(
                (*n as f32 - expected).abs() <= 5.0 * expected.sqrt(),
                "{n} of {expected}"
            );
        }
    }
}
