//! Comparison of means, with the same rate of false alarms in each comparison.
//!
//! All tests together compare fewer than 10,000 pairs of means. Each comparison fails by chance
//! with a probability of [`FALSE_ALARM`]. By the union bound, at most one in 10,000 runs of all
//! tests fails by chance. Seeds are fixed, so a test gives the same result in each run until the
//! code uses other random numbers.
//!
//! The statistic is Welch's t: the difference of two means over its standard error. Its degrees of
//! freedom follow Welch and Satterthwaite (Welch 1947, "The generalization of 'Student's' problem
//! when several different population variances are involved", Biometrika 34).

use embrasure::film::{Accumulator, Film};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::erf::erfc;
use std::fmt;

/// Probability that one comparison fails by chance. With 10⁴ comparisons, a run of all tests fails
/// by chance with the probability 10⁻⁴. |z| of a normal variable exceeds 5.73 with the probability
/// 10⁻⁸, and |t| with 30 degrees of freedom exceeds 7.6.
pub const FALSE_ALARM: f64 = 1e-8;

/// Relative difference that is explained by rounding of `f32` samples, even if a mean has no noise.
const ROUNDING: f64 = 1e-6;

/// A mean with its variance.
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    pub value: f64,
    /// Variance of the mean.
    pub variance: f64,
    /// Degrees of freedom of the variance. Infinite if the variance is known, as for means of many
    /// values.
    pub degrees: f64,
}

impl fmt::Display for Mean {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:.6} ± {:.6}", self.value, self.error())
    }
}

impl Mean {
    /// Mean with an exactly known value, without variance.
    pub fn exact(value: f64) -> Self {
        Self::new(value, 0.0)
    }

    /// Mean of many values with standard error `error`.
    pub fn new(value: f64, error: f64) -> Self {
        Self {
            value,
            variance: error * error,
            degrees: f64::INFINITY,
        }
    }

    /// Mean of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let value = values.iter().sum::<f64>() / n;
        let squares = values.iter().map(|v| (v - value).powi(2)).sum::<f64>();
        Self {
            value,
            variance: squares / (n * (n - 1.0)),
            degrees: n - 1.0,
        }
    }

    /// Mean of channel `c` of a pixel whose samples are independent.
    pub fn of_pixel(sums: &Accumulator, c: usize) -> Self {
        Self::new(sums.mean(c), sums.variance_of_mean(c).sqrt())
    }

    /// Mean of each value over independent renders with different seeds.
    pub fn of_each(renders: &[Vec<f64>]) -> Vec<Self> {
        let of = |i: usize| Self::of(&renders.iter().map(|values| values[i]).collect::<Vec<_>>());
        (0..renders[0].len()).map(of).collect()
    }

    /// Count of independent events with expectation `expected` (Poisson).
    pub fn of_events(count: usize, expected: f64) -> Self {
        Self::new(count as f64, expected.sqrt())
    }

    /// Mean of channel `c` over all pixels of a film whose pixels are independent.
    pub fn of_film(film: &Film, c: usize) -> Self {
        Self::new(super::film_mean(film, c), super::film_error(film, c))
    }

    /// Standard error of the mean.
    pub fn error(&self) -> f64 {
        self.variance.sqrt()
    }

    /// Returns Welch's t and its degrees of freedom. t is the difference from `other`, less the
    /// rounding error, in standard errors of the difference.
    pub fn t(self, other: Self) -> (f64, f64) {
        let rounding = ROUNDING * self.value.abs().max(other.value.abs());
        let difference = self.value - other.value;
        let difference = difference - difference.clamp(-rounding, rounding);
        let variance = self.variance + other.variance;
        if difference == 0.0 {
            return (0.0, f64::INFINITY);
        }
        let part = |mean: Self| mean.variance.powi(2) / mean.degrees;
        (
            difference / variance.sqrt(),
            variance.powi(2) / (part(self) + part(other)),
        )
    }

    /// This mean, moved towards `other` by up to `allowed`.
    fn towards(self, other: Self, allowed: f64) -> Self {
        let difference = self.value - other.value;
        Self {
            value: difference - difference.clamp(-allowed, allowed) + other.value,
            ..self
        }
    }

    /// Probability of a difference at least as large, if both means estimate the same value.
    pub fn p(self, other: Self) -> f64 {
        let (t, degrees) = self.t(other);
        if degrees < 1e4 {
            2.0 * StudentsT::new(0.0, 1.0, degrees).unwrap().cdf(-t.abs())
        } else {
            erfc(t.abs() / std::f64::consts::SQRT_2)
        }
    }
}

/// Fails if two means differ by more than chance.
#[track_caller]
pub fn assert_same_mean(what: impl fmt::Display, a: Mean, b: Mean) {
    assert_means_within(what, a, b, 0.0);
}

/// Fails if two means differ by more than chance and a systematic difference of `allowed`.
#[track_caller]
pub fn assert_means_within(what: impl fmt::Display, a: Mean, b: Mean, allowed: f64) {
    let rest = a.towards(b, allowed);
    let (t, _) = rest.t(b);
    println!("{what}: {a} and {b}, t = {t:+.2}");
    assert!(rest.p(b) >= FALSE_ALARM, "{what}: {a} and {b} differ: t = {t:+.2}");
}

/// Fails if one of many pairs of means, for example of pixels, differs by more than chance and a
/// systematic difference of `allowed`. All pairs together count as one comparison (Bonferroni).
#[track_caller]
pub fn assert_all_means_within(what: impl fmt::Display, pairs: &[(Mean, Mean)], allowed: impl Fn(Mean) -> f64) {
    let p = |&(a, b): &(Mean, Mean)| a.towards(b, allowed(b)).p(b);
    let all = pairs.iter().map(p).enumerate();
    let (worst, p) = all.min_by(|(_, p), (_, q)| p.total_cmp(q)).expect("pairs of means");
    let (a, b) = pairs[worst];
    let t = a.towards(b, allowed(b)).t(b).0;
    println!(
        "{what}: number {worst} of {} is the furthest apart: {a} and {b}, t = {t:+.2}",
        pairs.len()
    );
    assert!(
        p >= FALSE_ALARM / pairs.len() as f64,
        "{what}: number {worst}: {a} and {b} differ: t = {t:+.2}"
    );
}

#[test]
fn significant_differences_have_tabulated_p_values() {
    let (a, b) = (Mean::new(1.0, 0.03), Mean::new(1.0 + 5.0 * 0.05, 0.04));
    assert!((a.t(b).0 + 5.0).abs() < 1e-4 && a.t(b).1 == f64::INFINITY);
    // Values from tables of the normal distribution
    assert!((a.p(b) / 5.733e-7 - 1.0).abs() < 2e-3);
    assert!(a.p(Mean::new(1.0 + 5.73 * 0.05, 0.04)) > FALSE_ALARM);
    assert!(a.p(Mean::new(1.0 + 5.74 * 0.05, 0.04)) < FALSE_ALARM);
    // Two samples of 16: 30 degrees of freedom if their variances are equal. P(|t| > 2.750) is 1 %.
    let values: Vec<f64> = (0..16).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    let one = Mean::of(&values);
    let error = (2.0 * one.variance).sqrt();
    let moved: Vec<f64> = values.iter().map(|v| v + 2.750 * error).collect();
    let (t, degrees) = Mean::of(&moved).t(one);
    assert!((t - 2.75).abs() < 1e-5 && (degrees - 30.0).abs() < 1e-9);
    assert!((Mean::of(&moved).p(one) - 0.01).abs() < 1e-5);
    assert_means_within("allowed", Mean::exact(2.0), Mean::exact(2.1), 0.11);
    assert_eq!(Mean::exact(2.0).p(Mean::exact(2.0)), 1.0);
    assert_eq!(Mean::exact(2.0).p(Mean::exact(2.1)), 0.0);
}
