//! Pixel filters, importance-sampled (Ernst, Stamminger and Greiner 2006, "Filter Importance
//! Sampling").
//!
//! The filter determines the distribution of the sample positions of a pixel. Each sample belongs
//! to one pixel and is not spread over several pixels, so tiles do not write to their neighbours.
//! Negative lobes of a filter, such as Mitchell's, become negative weights. Auxiliary channels
//! (albedo, normal, depth) use the same samples without weights.

use crate::math::Vec2;
use crate::sampling::distribution::Distribution1D;
use std::f64::consts::PI;

/// Shapes of reconstruction filters. A filter is the product of a function of x and the same
/// function of y. The function is 0 beyond the radius.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FilterKind {
    /// Constant 1.
    Box,
    /// Linear from the centre to 0 at the radius.
    Tent,
    /// A Gaussian with a standard deviation of a third of the radius, minus its value at the
    /// radius.
    Gaussian,
    /// Piecewise cubic with B = C = 1/3; negative near the rim (Mitchell and Netravali 1988,
    /// "Reconstruction Filters in Computer Graphics").
    Mitchell,
    /// The four-term window (Harris 1978, "On the Use of Windows for Harmonic Analysis").
    BlackmanHarris,
}

impl FilterKind {
    /// Names that users type. The default is first.
    pub const NAMES: &[(&str, Self)] = &[
        ("box", Self::Box),
        ("tent", Self::Tent),
        ("gaussian", Self::Gaussian),
        ("mitchell", Self::Mitchell),
        ("blackman-harris", Self::BlackmanHarris),
    ];

    /// Returns true if the filter is negative somewhere. Pixels beside bright pixels can then be
    /// negative.
    pub fn has_negative_lobes(self) -> bool {
        self == Self::Mitchell
    }

    /// Default radius in pixels.
    pub fn usual_radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Tent => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::Mitchell => 2.0,
        }
    }

    /// Function of one coordinate `x` in units of the radius, |x| ≤ 1; not normalised.
    fn eval(self, x: f64) -> f64 {
        let x = x.abs();
        match self {
            Self::Box => 1.0,
            Self::Tent => 1.0 - x,
            Self::Gaussian => (-4.5 * x * x).exp() - (-4.5f64).exp(),
            Self::Mitchell => {
                const B: f64 = 1.0 / 3.0;
                const C: f64 = 1.0 / 3.0;
                let x = 2.0 * x;
                if x < 1.0 {
                    (12.0 - 9.0 * B - 6.0 * C) * x.powi(3) + (-18.0 + 12.0 * B + 6.0 * C) * x * x + (6.0 - 2.0 * B)
                } else {
                    (-B - 6.0 * C) * x.powi(3)
                        + (6.0 * B + 30.0 * C) * x * x
                        + (-12.0 * B - 48.0 * C) * x
                        + (8.0 * B + 24.0 * C)
                }
            }
            Self::BlackmanHarris => {
                let cosine = |k: f64| (PI * k * x).cos();
                0.35875 + 0.48829 * cosine(1.0) + 0.14128 * cosine(2.0) + 0.01168 * cosine(3.0)
            }
        }
    }
}

/// An importance-sampled reconstruction filter: the sample positions have the filter's
/// distribution, so that each sample touches one pixel only (Ernst, Stamminger and Greiner 2006,
/// "Filter Importance Sampling").
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    /// Radius in pixels.
    radius: f32,
    /// Distribution of a coordinate of the sample positions over [-radius, radius]: constant in
    /// each step, and proportional to the absolute value of the function. `None` if samples are
    /// uniform.
    steps: Option<Distribution1D>,
    /// Integral of the function over [-1, 1].
    integral: f64,
}

/// Number of steps of the sampling density.
const STEPS: usize = 256;
/// Number of evaluations of the function in a step.
const PLACES: usize = 16;

impl Filter {
    /// Box filter with the size of a pixel: samples are uniform in the pixel.
    pub const BOX: Self = Self {
        kind: FilterKind::Box,
        radius: 0.5,
        steps: None,
        integral: 2.0,
    };

    /// Filter with the shape `kind` and a `radius` in pixels, above 0.
    pub fn new(kind: FilterKind, radius: f32) -> Self {
        let place = |i: usize| 2.0 * (i as f64 + 0.5) / (STEPS * PLACES) as f64 - 1.0;
        let values: Vec<f64> = (0..STEPS * PLACES).map(|i| kind.eval(place(i))).collect();
        // Mean absolute value in a step: above 0 unless the function is 0 everywhere in the step
        let weight = |values: &[f64]| values.iter().map(|v| v.abs()).sum::<f64>() as f32;
        let weights: Vec<f32> = values.chunks(PLACES).map(weight).collect();
        Self {
            kind,
            radius,
            steps: (kind != FilterKind::Box).then(|| Distribution1D::new(&weights)),
            integral: 2.0 * values.iter().sum::<f64>() / values.len() as f64,
        }
    }

    /// Shape of the filter.
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// Radius in pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Value of the filter at `offset` from the centre of the pixel, in pixels. The integral of the
    /// filter over the film is 1, if the area of a pixel is 1. The value is 0 beyond the radius.
    ///
    /// The box includes its lower border and excludes its upper border, so that each point of the
    /// film is in exactly one pixel.
    pub fn eval(&self, offset: Vec2) -> f32 {
        let along = |x: f32| {
            if -self.radius <= x && x < self.radius {
                self.kind.eval((x / self.radius) as f64) / (self.integral * self.radius as f64)
            } else {
                0.0
            }
        };
        (along(offset.x) * along(offset.y)) as f32
    }

    /// Samples a position relative to the pixel's upper left corner. Also returns the weight of the
    /// sample's radiance. The mean of the weights is 1.
    #[inline]
    pub fn sample(&self, u: Vec2) -> (Vec2, f32) {
        let ((x, wx), (y, wy)) = (self.draw(u.x), self.draw(u.y));
        (0.5 + Vec2::new(x, y) * self.radius, (wx * wy) as f32)
    }

    /// Samples one coordinate, in units of the radius. Also returns the weight of the sample.
    #[inline]
    fn draw(&self, u: f32) -> (f32, f64) {
        let Some(steps) = &self.steps else {
            return (2.0 * u - 1.0, 1.0);
        };
        let (place, _) = steps.sample(u);
        let x = 2.0 * place - 1.0;
        // Density of the sampled position over [-1, 1]
        let pdf = 0.5 * steps.pdf(place) as f64;
        (x, self.kind.eval(x as f64) / (self.integral * pdf))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Many positions in units of the radius, with their weights.
    fn draws(filter: &Filter) -> impl Iterator<Item = (f64, f64)> {
        const N: usize = 200_000;
        let draw = |i| filter.draw(((i as f64 + 0.5) / N as f64) as f32);
        (0..N).map(draw).map(|(x, weight)| (x as f64, weight))
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let (n, sum) = values.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
        sum / n
    }

    #[test]
    fn moments_of_samples_match_the_function() {
        for &(name, kind) in FilterKind::NAMES {
            let filter = Filter::new(kind, kind.usual_radius());
            // Compute ∫ xⁿ f / ∫ f by the midpoint rule
            let x = |i: usize| 2.0 * (i as f64 + 0.5) / 1e5 - 1.0;
            let integral = |n: i32| (0..100_000).map(|i| x(i).powi(n) * kind.eval(x(i))).sum::<f64>();
            for n in 0..5 {
                let expected = integral(n) / integral(0);
                let got = mean(draws(&filter).map(|(x, weight)| weight * x.powi(n)));
                assert!(
                    (got - expected).abs() < 1e-4,
                    "{name}: moment {n} is {got}, not {expected}"
                );
            }
        }
    }

    #[test]
    fn places_are_scaled_by_the_radius() {
        for &(name, kind) in FilterKind::NAMES {
            for radius in [0.7, kind.usual_radius()] {
                let filter = Filter::new(kind, radius);
                let (low, _) = filter.sample(Vec2::ZERO);
                let (high, _) = filter.sample(Vec2::splat(0.999_999_94));
                // If a function is 0 at the radius, the outermost steps are rarely sampled, so the
                // test has a tolerance.
                for (p, rim) in [(low, 0.5 - radius), (high, 0.5 + radius)] {
                    assert!((p - rim).abs().max_element() < 0.01 * radius, "{name}, {radius}: {p}");
                }
            }
        }
    }

    #[test]
    fn values_match_the_papers() {
        let at = |kind: FilterKind, x: f64| kind.eval(x);
        // Mitchell and Netravali: 16/18 in the middle, 1/18 at 1, 0 at 2 (times 6 here); at 1.5
        // −0.0347
        let mitchell = |x: f64| at(FilterKind::Mitchell, x / 2.0) / 6.0;
        for (x, expected) in [(0.0, 16.0 / 18.0), (1.0, 1.0 / 18.0), (2.0, 0.0), (1.5, -5.0 / 144.0)] {
            assert!((mitchell(x) - expected).abs() < 1e-12, "{x}: {}", mitchell(x));
        }
        // Harris: 1 in the middle, 0.00006 at the rim
        assert!((at(FilterKind::BlackmanHarris, 0.0) - 1.0).abs() < 1e-12);
        assert!((at(FilterKind::BlackmanHarris, 1.0) - 6e-5).abs() < 1e-12);
        assert!((at(FilterKind::Gaussian, 1.0)).abs() < 1e-12);
    }

    #[test]
    fn only_negative_lobes_have_negative_weights() {
        for &(name, kind) in FilterKind::NAMES {
            let filter = Filter::new(kind, kind.usual_radius());
            let negative = draws(&filter).filter(|(_, weight)| *weight < 0.0).count();
            assert_eq!(negative > 0, kind.has_negative_lobes(), "{name}");
            // The weights of a non-negative function hardly vary, because the distribution of
            // positions follows the function.
            let spread = mean(draws(&filter).map(|(_, weight)| (weight - 1.0).powi(2)));
            assert!(kind == FilterKind::Mitchell || spread < 1e-3, "{name}: {spread}");
        }
    }

    #[test]
    fn values_integrate_to_one_and_match_samples() {
        for &(name, kind) in FilterKind::NAMES {
            for radius in [0.5, 0.7, kind.usual_radius()] {
                let filter = Filter::new(kind, radius);
                // Use the midpoint rule, also over some space beyond the radius
                const CELLS: usize = 400;
                let reach = 1.25 * radius;
                let step = 2.0 * reach as f64 / CELLS as f64;
                let place = |i: usize| -reach + (i as f32 + 0.5) * step as f32;
                let row = |j: usize| (0..CELLS).map(move |i| Vec2::new(place(i), place(j)));
                let integral = (0..CELLS).flat_map(row).map(|p| filter.eval(p) as f64).sum::<f64>() * step * step;
                assert!((integral - 1.0).abs() < 2e-4, "{name} {radius}: {integral}");
                assert_eq!(filter.eval(Vec2::new(0.0, 1.001 * radius)), 0.0);
                assert_eq!(filter.eval(Vec2::new(f32::NAN, 0.0)), 0.0);

                // Compare the sums of sample weights in bins with the integral over each bin, for a
                // regular grid of samples
                const BINS: usize = 8;
                const N: usize = 512;
                let mut found = [[0.0; BINS]; BINS];
                for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
                    let (p, weight) = filter.sample((Vec2::new(i as f32, j as f32) + 0.5) / N as f32);
                    let cell = ((p - 0.5 + radius) / (2.0 * radius) * BINS as f32).as_uvec2();
                    found[(cell.y as usize).min(BINS - 1)][(cell.x as usize).min(BINS - 1)] += weight as f64;
                }
                const PARTS: usize = 32;
                let fine = |i: usize| radius * (2.0 * (i as f32 + 0.5) / (BINS * PARTS) as f32 - 1.0);
                let area = (2.0 * radius as f64 / (BINS * PARTS) as f64).powi(2);
                for (y, x) in (0..BINS).flat_map(|y| (0..BINS).map(move |x| (y, x))) {
                    let parts = (0..PARTS * PARTS).map(|k| (x * PARTS + k % PARTS, y * PARTS + k / PARTS));
                    let expected: f64 = parts
                        .map(|(i, j)| filter.eval(Vec2::new(fine(i), fine(j))) as f64)
                        .sum();
                    let (got, expected) = (found[y][x] / (N * N) as f64, expected * area);
                    assert!(
                        (got - expected).abs() < 1e-3,
                        "{name} {radius} {x} {y}: {got} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn each_point_is_in_one_box() {
        for place in [0.0, 0.3, 0.5, 1.0, 2.0, 2.75] {
            let sum: f32 = (0..4)
                .map(|pixel| Filter::BOX.eval(Vec2::new(place - pixel as f32 - 0.5, 0.0)))
                .sum();
            assert_eq!(sum, 1.0, "{place}");
        }
    }

    #[test]
    fn box_samples_lie_in_the_pixel() {
        assert_eq!(Filter::new(FilterKind::Box, 0.5), Filter::BOX);
        for u in [Vec2::ZERO, Vec2::new(0.25, 0.75), Vec2::splat(0.999_999_94)] {
            let (p, weight) = Filter::BOX.sample(u);
            assert!(
                weight == 1.0 && p.cmpge(Vec2::ZERO).all() && p.cmplt(Vec2::ONE).all(),
                "{p}"
            );
        }
    }
}
