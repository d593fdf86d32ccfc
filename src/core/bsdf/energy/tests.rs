use super::*;
use std::f64::consts::PI;

/// Albedo of single reflections, unweighted and weighted by `(1 − cos)⁵`: ∫ D G₂ / (4 cos θo) dωi
/// in f64. The grid and the forms of `D` and `Λ` differ from the grid and the forms of the tables.
fn shares(cos_o: f64, alpha: f64) -> [f64; 2] {
    const STEPS: usize = 1000;
    let lambda = |cos: f64| 0.5 * ((1.0 + alpha * alpha * (1.0 / (cos * cos) - 1.0)).sqrt() - 1.0);
    let sin_o = (1.0 - cos_o * cos_o).sqrt();
    let mut sums = [0.0; 2];
    for i in 0..STEPS {
        let z = (i as f64 + 0.5) / STEPS as f64;
        let r = (1.0 - z * z).sqrt();
        for j in 0..STEPS {
            let phi = PI * (j as f64 + 0.5) / STEPS as f64;
            // |wo + wi|² = 2 (1 + wo·wi). The cosine of half of the angle between `wo` and `wi`
            // follows from this length
            let length = (2.0 * (1.0 + sin_o * r * phi.cos() + cos_o * z)).sqrt();
            let (cos_h, cos_d) = ((cos_o + z) / length, 0.5 * length);
            let d = alpha * alpha / (PI * (cos_h * cos_h * (alpha * alpha - 1.0) + 1.0).powi(2));
            let value = d / (1.0 + lambda(cos_o) + lambda(z)) / (4.0 * cos_o);
            sums[0] += value;
            sums[1] += value * (1.0 - cos_d).powi(5);
        }
    }
    sums.map(|sum| 2.0 * PI * sum / (STEPS * STEPS) as f64)
}

#[test]
fn tables_match_quadrature() {
    for roughness in [0.33f32, 0.5, 0.77, 0.98] {
        let [missing, grazing] = ConductorTables::new(roughness).loss_and_grazing();
        for cos in [0.09f32, 0.22, 0.5, 0.81, 0.99] {
            let [all, grazed] = shares(cos as f64, (roughness * roughness) as f64);
            let table = [1.0 - missing.towards(cos), grazing.towards(cos)].map(f64::from);
            let error = (table[0] - all).abs().max((table[1] - grazed).abs());
            assert!(error < 2e-3, "{cos} {roughness}: {table:?} {all} {grazed}");
        }
    }
    // Facets of α = 1 along the normal: ∫ (1 − 2v) / (1 − v) dv from 0 to 1/2
    let along_normal = ConductorTables::new(1.0).loss().towards(1.0);
    assert!((along_normal - std::f32::consts::LN_2).abs() < 5e-4, "{along_normal}");
}

/// Cosine-weighted mean by the midpoint rule.
fn mean(value: impl Fn(f32) -> f32) -> f64 {
    const N: u32 = 20_000;
    let cosines = (0..N).map(|i| (i as f32 + 0.5) / N as f32);
    cosines.map(|cos| (2.0 * value(cos) * cos) as f64).sum::<f64>() / N as f64
}

fn check_mean<const N: usize>(shares: &EnergyTable<N>) {
    assert!((mean(|cos| shares.towards(cos)) - shares.mean() as f64).abs() < 1e-5);
}

fn check_density<const N: usize>(shares: &EnergyTable<N>) {
    let total = PI * mean(|cos| shares.pdf(cos) / cos);
    assert!((total - 1.0).abs() < 1e-3, "{total}");
}

#[test]
fn means_match_the_interpolated_values() {
    for roughness in [0.2, 0.71, 1.0] {
        let [missing, grazing] = ConductorTables::new(roughness).loss_and_grazing();
        check_mean(&grazing);
        check_mean(&missing);
        check_density(&missing);
        check_mean(&dielectric_loss(roughness, 1.4));
        check_density(&dielectric_loss(roughness, 1.4));
    }
}

#[test]
fn smooth_surfaces_have_no_energy_loss() {
    let [missing, grazing] = ConductorTables::new(0.0).loss_and_grazing();
    for cos in [0.01, 0.3, 1.0] {
        assert!((grazing.towards(cos) - (1.0 - cos).powi(5)).abs() < 0.01);
        let of_dielectrics = [1.5, 1.0 / 1.5].map(|eta| dielectric_loss(0.0, eta).towards(cos));
        for missing in of_dielectrics.into_iter().chain([missing.towards(cos)]) {
            assert!(missing < 0.01, "{cos}: {missing}");
        }
    }
}

#[test]
fn invalid_arguments_have_a_valid_energy() {
    fn check<const N: usize>(missing: &EnergyTable<N>, x: f32) {
        for share in [missing.towards(x), missing.towards(0.5), missing.mean()] {
            assert!((0.0..=1.0).contains(&share), "{x}: {share}");
        }
        assert!(missing.sample(Vec2::ONE).is_finite() && missing.sample(Vec2::ZERO).is_finite());
    }
    for x in [f32::NAN, f32::INFINITY, -1.0, 0.0, 2.0] {
        check(&ConductorTables::new(x).loss(), x);
        check(&dielectric_loss(x, x), x);
    }
}
