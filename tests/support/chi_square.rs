//! Pearson's χ² test of a sampler of directions against its density.

#![allow(dead_code, missing_docs)] // Each test program uses only a part of this module.

use embrasure::math::Vec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;

/// Number of bins in θ and φ over the whole sphere.
const BINS: [usize; 2] = [40, 80];
/// Bins with a smaller expected count are merged.
const MIN_EXPECTED: f64 = 5.0;

/// Result of the χ² test.
#[derive(Clone, Copy, Debug)]
pub struct Outcome {
    /// Probability of a fit that is this bad or worse, if the density is right.
    pub p_value: f64,
    /// ∫ pdf over the sphere.
    pub integral: f64,
    /// Fraction of samples that have a direction.
    pub share: f64,
}

/// Draws `n` samples and compares their directions with `pdf`, a density per solid angle. `sample`
/// returns `None` for a sample without a direction. `edges` is true if the density has jumps that
/// are not at the horizon.
pub fn chi_square(
    n: u32,
    mut sample: impl FnMut(u32) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f64,
    edges: bool,
) -> Outcome {
    // Observed counts. The last bin counts samples without a direction.
    let mut observed = vec![0.0; BINS[0] * BINS[1] + 1];
    for i in 0..n {
        observed[sample(i).map_or(BINS[0] * BINS[1], bin)] += 1.0;
    }

    // Compute the expected counts
    let density = |theta: f64, phi: f64| {
        let (sin, cos) = theta.sin_cos();
        let w = Vec3::new((sin * phi.cos()) as f32, (sin * phi.sin()) as f32, cos as f32);
        pdf(w) * sin
    };
    let step = [PI / BINS[0] as f64, 2.0 * PI / BINS[1] as f64];
    // The tolerance is 3 % of one sample
    let tolerance = 0.03 / n as f64;
    let mut expected = Vec::with_capacity(observed.len());
    for t in 0..BINS[0] {
        for p in 0..BINS[1] {
            let cell = [t as f64 * step[0], p as f64 * step[1], step[0], step[1]];
            let whole = gauss(&density, cell);
            expected.push(n as f64 * integrate(&density, edges, (cell, whole), tolerance, 0));
        }
    }
    let integral = expected.iter().sum::<f64>() / n as f64;
    expected.push((n as f64 * (1.0 - integral)).max(0.0));
    let share = 1.0 - observed[BINS[0] * BINS[1]] / n as f64;

    Outcome {
        p_value: p_value(&observed, &expected),
        integral,
        share,
    }
}

/// Significance level for each of `tests` tests. If all densities are right, all tests pass with
/// the probability 1 − `alpha`.
pub fn sidak(alpha: f64, tests: usize) -> f64 {
    1.0 - (1.0 - alpha).powf(1.0 / tests as f64)
}

fn bin(w: Vec3) -> usize {
    let theta = (w.z as f64).clamp(-1.0, 1.0).acos();
    let phi = (w.y as f64).atan2(w.x as f64).rem_euclid(2.0 * PI);
    let t = (theta / PI * BINS[0] as f64) as usize;
    let p = (phi / (2.0 * PI) * BINS[1] as f64) as usize;
    t.min(BINS[0] - 1) * BINS[1] + p.min(BINS[1] - 1)
}

/// Integral of `f` over the cell `[θ, φ, Δθ, Δφ]`, by three-point Gauss-Legendre quadrature in both
/// directions.
fn gauss(f: &impl Fn(f64, f64) -> f64, [t, p, dt, dp]: [f64; 4]) -> f64 {
    let x = 0.5 * 0.6f64.sqrt();
    let nodes = [(0.5 - x, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + x, 5.0 / 18.0)];
    let rows = nodes.map(|(a, wa)| {
        nodes
            .iter()
            .map(|(b, wb)| wa * wb * f(t + a * dt, p + b * dp))
            .sum::<f64>()
    });
    rows.iter().sum::<f64>() * dt * dp
}

/// Integral of `f` over a cell. `whole` is an estimate of this integral. The cell is halved in both
/// directions until its parts sum to `whole` within `tolerance`.
fn integrate(
    f: &impl Fn(f64, f64) -> f64,
    edges: bool,
    ([t, p, dt, dp], whole): ([f64; 4], f64),
    tolerance: f64,
    depth: u32,
) -> f64 {
    // Split a density with edges three times before the comparison, because an edge may lie between
    // the nodes.
    let min_depth = if edges { 3 } else { 0 };
    let (ht, hp) = (0.5 * dt, 0.5 * dp);
    let cells = [
        [t, p, ht, hp],
        [t + ht, p, ht, hp],
        [t, p + hp, ht, hp],
        [t + ht, p + hp, ht, hp],
    ];
    let parts = cells.map(|cell| gauss(f, cell));
    let sum: f64 = parts.iter().sum();
    if depth >= 8 || (depth >= min_depth && (sum - whole).abs() < tolerance) {
        return sum;
    }
    cells
        .iter()
        .zip(parts)
        .map(|(&cell, part)| integrate(f, edges, (cell, part), tolerance, depth + 1))
        .sum()
}

/// Merges bins of small expected count, smallest first, and returns the p-value of the χ²
/// distribution.
fn p_value(observed: &[f64], expected: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|&a, &b| expected[a].total_cmp(&expected[b]));
    let (mut statistic, mut bins) = (0.0, 0);
    let (mut pooled_observed, mut pooled_expected) = (0.0, 0.0);
    for (k, &i) in order.iter().enumerate() {
        pooled_observed += observed[i];
        pooled_expected += expected[i];
        let rest_is_large = order.get(k + 1).is_none_or(|&next| expected[next] >= MIN_EXPECTED);
        if pooled_expected >= MIN_EXPECTED && (expected[i] >= MIN_EXPECTED || rest_is_large) {
            statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected;
            bins += 1;
            (pooled_observed, pooled_expected) = (0.0, 0.0);
        }
    }
    // The remaining bins expect hardly any samples. If they contain many samples, the density is
    // wrong
    if pooled_observed > 10.0 * MIN_EXPECTED {
        return 0.0;
    }
    if bins < 2 {
        return 1.0;
    }
    let distribution = ChiSquared::new((bins - 1) as f64).expect("degrees of freedom");
    1.0 - distribution.cdf(statistic)
}
