//! Errors of integrals with known values, over the number of samples.

use super::PointSet;
use crate::cli::plot::slope;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::uniform_sphere;
use std::f64::consts::PI;

/// Number of seeds over which errors are averaged.
pub(super) const SEEDS: u64 = 64;
/// Minimum number of samples for an error to be used in the fit of a slope. Smaller sets of points
/// have no pattern yet.
pub(super) const FIRST_FITTED: u32 = 4;
/// Axis `a` in the integrands on the sphere. The point sets are not symmetric about this axis.
const AXIS: Vec3 = Vec3::new(1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0);

/// An integrand over the unit square or the sphere, whose mean is known.
pub(super) struct Integral {
    pub name: &'static str,
    /// The integrand as a formula.
    pub formula: &'static str,
    pub exact: f64,
    /// Variance of the integrand. The mean of N independent samples has the variance divided by N.
    pub variance: f64,
    f: fn(Vec2) -> f64,
}

/// Integrands: smooth functions and steps, in the square and on the sphere, with variances in
/// closed form.
fn integrals() -> [Integral; 4] {
    let smooth = |u: Vec2| {
        let [x, y] = [u.x, u.y].map(|v| (PI * f64::from(v)).sin());
        0.25 * PI * PI * x * y
    };
    let quarter = |u: Vec2| f64::from(u8::from(u.length_squared() < 1.0));
    let along = |u: Vec2| f64::from(uniform_sphere(u).dot(AXIS)).exp();
    let cap = |u: Vec2| f64::from(u8::from(uniform_sphere(u).dot(AXIS) > 0.5));
    let share = |p: f64| (p, p * (1.0 - p));
    let integral = |name, formula, (exact, variance), f| Integral {
        name,
        formula,
        exact,
        variance,
        f,
    };
    [
        integral(
            "smooth",
            "(π²/4) sin πx sin πy in the square",
            (1.0, PI.powi(4) / 64.0 - 1.0),
            smooth as fn(Vec2) -> f64,
        ),
        integral("edge", "quarter disk in the square", share(PI / 4.0), quarter),
        integral(
            "smooth",
            "exp(ω·a) on the sphere",
            (1f64.sinh(), 2f64.sinh() / 2.0 - 1f64.sinh().powi(2)),
            along,
        ),
        integral("edge", "cap of 60° on the sphere", share(0.25), cap),
    ]
}

/// Errors of the mean of one integrand.
pub(super) struct Convergence {
    pub integral: Integral,
    /// A curve for each decision of a path, such as the point on the lens. A curve has a name, and
    /// pairs of the number of samples and the root mean square error.
    pub curves: Vec<(&'static str, Vec<[f64; 2]>)>,
}

/// Errors of all integrals with 1, 2, 4, … samples, up to `count`.
pub(super) fn convergences(set: PointSet, seed: u64, count: u32) -> Vec<Convergence> {
    let mut found = integrals().map(|integral| Convergence {
        integral,
        curves: Vec::new(),
    });
    for (name, dimension) in set.decisions() {
        let mut curves = [const { Vec::new() }; 4];
        for n in (0..=count.ilog2()).map(|bits| 1u32 << bits) {
            let mut squares = [0.0; 4];
            for i in 0..SEEDS {
                let points = set.points(seed.wrapping_add(i), n, dimension);
                for (square, Convergence { integral, .. }) in squares.iter_mut().zip(&found) {
                    let mean = points.iter().map(|u| (integral.f)(*u)).sum::<f64>() / f64::from(n);
                    *square += (mean - integral.exact).powi(2);
                }
            }
            for (curve, square) in curves.iter_mut().zip(squares) {
                curve.push([f64::from(n), (square / SEEDS as f64).sqrt()]);
            }
        }
        for (convergence, curve) in found.iter_mut().zip(curves) {
            convergence.curves.push((name, curve));
        }
    }
    found.into()
}

/// Points of a curve used for the fit of a slope. Errors of 0 have no logarithm.
fn from_first(curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let is_fitted = |[n, error]: &[f64; 2]| *n >= f64::from(FIRST_FITTED) && *error > 0.0;
    curve.iter().copied().filter(is_fitted).collect()
}

/// Exponent of the power law fitted to a curve.
pub(super) fn fitted(curve: &[[f64; 2]]) -> Option<f64> {
    slope(&from_first(curve))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::SamplerKind;

    /// Checks means and variances on a fine grid of the square.
    #[test]
    fn integrands_have_the_stated_means_and_variances() {
        const SIDE: u32 = 1000;
        let points = || (0..SIDE * SIDE).map(|i| (Vec2::new((i % SIDE) as f32, (i / SIDE) as f32) + 0.5) / SIDE as f32);
        for Integral {
            formula,
            exact,
            variance,
            f,
            ..
        } in integrals()
        {
            let moment = |power| points().map(|u| f(u).powi(power)).sum::<f64>() / f64::from(SIDE * SIDE);
            let mean = moment(1);
            assert!((mean - exact).abs() < 3e-4, "{formula}: {mean} for {exact}");
            let found = moment(2) - mean * mean;
            assert!((found - variance).abs() < 1e-3, "{formula}: {found} for {variance}");
        }
    }

    /// The mean of independent samples has the error that follows from the variance. Errors of
    /// Sobol points fall about as fast as in theory (Owen 1997).
    #[test]
    fn errors_fall_as_they_should() {
        for convergence in convergences(PointSet::Sampler(SamplerKind::Independent), 5, 1024) {
            let expected = |n: f64| (convergence.integral.variance / n).sqrt();
            for (name, curve) in &convergence.curves {
                // The mean of 64 squared errors has a relative standard deviation of √(2/64). The
                // square root halves this deviation.
                let is_near =
                    |[n, error]: &[f64; 2]| (error / expected(*n) - 1.0).abs() < 5.0 * 0.5 * (2f64 / 64.0).sqrt();
                assert!(curve.iter().all(is_near), "{name}: {curve:?}");
                let slope = fitted(curve).unwrap();
                assert!((slope + 0.5).abs() < 0.12, "{name}: {slope}");
            }
        }
        let sobol = convergences(PointSet::Sampler(SamplerKind::Sobol), 5, 1024);
        for (curve, steepest) in sobol.iter().zip([-1.2, -0.65]) {
            let slope = fitted(&curve.curves[0].1).unwrap();
            assert!(slope < steepest, "{}: {slope}", curve.integral.formula);
        }
        assert_eq!(
            sobol[0].curves.len(),
            PointSet::Sampler(SamplerKind::Sobol).decisions().len()
        );
    }
}
