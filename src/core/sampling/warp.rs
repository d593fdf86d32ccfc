//! Warps from the unit square to the shapes that a path tracer samples, and the densities of the
//! warps.
//!
//! Directions are unit vectors in a local frame whose +z is the normal; densities are per solid
//! angle or area.

use crate::math::{Vec2, Vec3, atan2, float::ALMOST_ONE, sin_cos_eighth_turn, sin_cos_turns};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_4, PI};

/// Uniform point on the unit disk by the concentric map (Shirley and Chiu 1997). Density `1/π` per
/// area.
///
/// The code computes both cases and selects one, because the case is random from point to point,
/// and a mispredicted branch would cost more than both cases.
pub fn uniform_disk(u: Vec2) -> Vec2 {
    let o = 2.0 * u - Vec2::ONE;
    let steep = o.x.abs() <= o.y.abs();
    let (r, other) = if steep { (o.y, o.x) } else { (o.x, o.y) };
    let ratio = if r == 0.0 { 0.0 } else { other / r };
    let (sin, cos) = sin_cos_eighth_turn(FRAC_PI_4 * ratio);
    if steep {
        r * Vec2::new(sin, cos)
    } else {
        r * Vec2::new(cos, sin)
    }
}

/// Cosine-weighted direction on the upper hemisphere: a point of the disk, projected up to the
/// hemisphere (Malley's method).
// ANCHOR: cosine
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let d = uniform_disk(u);
    let z = (1.0 - d.length_squared()).max(0.0).sqrt();
    Vec3::new(d.x, d.y, z)
}
// ANCHOR_END: cosine

/// Cosine-weighted direction on the upper hemisphere, from the point of the unit sphere to which
/// [`uniform_sphere`] maps `u`: the sum of the normal and this point, normalised. The sum halves
/// the angle to the normal, so the sine of the new angle is `√u.x`.
pub fn cosine_hemisphere_of_sphere(u: Vec2) -> Vec3 {
    let (sin, cos) = sin_cos_turns(u.y);
    let r = u.x.sqrt();
    Vec3::new(r * cos, r * sin, (1.0 - u.x).sqrt())
}

/// Density of [`cosine_hemisphere`] and [`cosine_hemisphere_of_sphere`] per solid angle, `cos θ /
/// π` for `cos θ > 0`.
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// Direction on the upper hemisphere with density proportional to `cosⁿ θ`, by `cos θ = (1 −
/// ξ)^{1/(n+1)}`.
// ANCHOR: cosine_power
pub fn cosine_power_hemisphere(u: Vec2, exponent: f32) -> Vec3 {
    let z = (1.0 - u.x).powf(1.0 / (exponent + 1.0)).min(1.0);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, z)
}
// ANCHOR_END: cosine_power

/// Density of [`cosine_power_hemisphere`] per solid angle, `(n + 1) / (2π) · cosⁿ θ` for `cos θ >
/// 0`.
pub fn cosine_power_hemisphere_pdf(cos_theta: f32, exponent: f32) -> f32 {
    if cos_theta <= 0.0 {
        return 0.0;
    }
    (exponent + 1.0) / (2.0 * PI) * cos_theta.powf(exponent)
}

/// Uniform direction on the upper hemisphere. Density [`UNIFORM_HEMISPHERE_PDF`].
pub fn uniform_hemisphere(u: Vec2) -> Vec3 {
    cosine_power_hemisphere(u, 0.0)
}

/// Uniform direction on the upper hemisphere: the point of the unit sphere to which
/// [`uniform_sphere`] maps `u`, mirrored to the upper hemisphere if it is below.
pub fn uniform_hemisphere_of_sphere(u: Vec2) -> Vec3 {
    let w = uniform_sphere(u);
    Vec3::new(w.x, w.y, w.z.abs())
}

/// Density of [`uniform_hemisphere`] and [`uniform_hemisphere_of_sphere`] per solid angle, `1 /
/// (2π)`.
pub const UNIFORM_HEMISPHERE_PDF: f32 = 0.5 * FRAC_1_PI;

/// Uniform direction on the unit sphere. Density [`UNIFORM_SPHERE_PDF`].
pub fn uniform_sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = sin_cos_turns(u.y);
    Vec3::new(r * cos, r * sin, z)
}

/// The point of the unit square that [`uniform_sphere`] maps to the unit vector `w`.
pub fn square_of_sphere(w: Vec3) -> Vec2 {
    let azimuth = atan2(w.y, w.x) * (0.5 * FRAC_1_PI);
    // Keep the result below 1 in spite of rounding
    let u = Vec2::new(0.5 - 0.5 * w.z, if azimuth < 0.0 { azimuth + 1.0 } else { azimuth });
    u.clamp(Vec2::ZERO, Vec2::splat(ALMOST_ONE))
}

/// Density of [`uniform_sphere`] per solid angle, `1 / (4π)`.
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// Uniform direction of the cone around +z whose half-angle has the cosine `cos`. Density
/// [`uniform_cone_pdf`].
pub fn uniform_cone(u: Vec2, cos: f32) -> Vec3 {
    uniform_cap(u, 1.0 - cos)
}

/// Uniform direction of the cap around +z with the depth `depth`: 1 − cos of the half-angle.
/// Density [`uniform_cap_pdf`].
///
/// For narrow caps the depth has more correct digits than the cosine.
pub fn uniform_cap(u: Vec2, depth: f32) -> Vec3 {
    // Sample the depth 1 − z uniformly, and compute the sine from the depth
    let depth = u.x * depth;
    let r = (depth * (2.0 - depth)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = sin_cos_turns(u.y);
    Vec3::new(r * cos_phi, r * sin_phi, 1.0 - depth)
}

/// Density of [`uniform_cone`] per solid angle within the cone, `1 / (2π (1 − cos))`.
pub fn uniform_cone_pdf(cos: f32) -> f32 {
    uniform_cap_pdf(1.0 - cos)
}

/// Density of [`uniform_cap`] per solid angle within the cap, `1 / (2π depth)`.
pub fn uniform_cap_pdf(depth: f32) -> f32 {
    0.5 * FRAC_1_PI / depth
}

/// Uniform point in a triangle. Returns the barycentric coordinates of the second and third vertex.
///
/// The map folds the unit square with little distortion (Heitz 2019, "A Low-Distortion Map Between
/// Triangle and Square"). Density: one over the triangle's area.
pub fn uniform_triangle(u: Vec2) -> (f32, f32) {
    let below = u.x < u.y;
    let (less, more) = if below { (u.x, u.y) } else { (u.y, u.x) };
    let (half, rest) = (0.5 * less, more - 0.5 * less);
    if below { (half, rest) } else { (rest, half) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Centres of the cells of an n × n grid: a quadrature over the unit square.
    fn grid(n: u32) -> impl Iterator<Item = Vec2> {
        (0..n * n).map(move |i| Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32)
    }

    fn mean(values: impl Iterator<Item = f64>) -> f64 {
        let (sum, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
        sum / n
    }

    #[test]
    fn disk_moments() {
        let n = 512;
        assert!(grid(n).all(|u| uniform_disk(u).length() <= 1.0 + 1e-6));
        // ∫ x² over the uniform unit disk is 1/4; first moments vanish; E r = 2/3.
        let second = mean(grid(n).map(|u| (uniform_disk(u).x as f64).powi(2)));
        let radius = mean(grid(n).map(|u| uniform_disk(u).length() as f64));
        let first = mean(grid(n).map(|u| uniform_disk(u).y as f64));
        assert!((second - 0.25).abs() < 1e-4, "{second}");
        assert!((radius - 2.0 / 3.0).abs() < 1e-4, "{radius}");
        assert!(first.abs() < 1e-6, "{first}");
    }

    #[test]
    fn cosine_hemisphere_matches_its_pdf() {
        // Under the density cos/π: E cos = 2/3, E cos² = 1/2, and E f/pdf = ∫f for f = 1 gives 2π.
        let n = 1024;
        let dirs = || grid(n).map(cosine_hemisphere);
        assert!(dirs().all(|d| (d.length() - 1.0).abs() < 1e-5 && d.z >= 0.0));
        assert!((mean(dirs().map(|d| d.z as f64)) - 2.0 / 3.0).abs() < 1e-4);
        assert!((mean(dirs().map(|d| (d.z as f64).powi(2))) - 0.5).abs() < 1e-4);
        let cap = mean(dirs().map(|d| {
            // Integral of 1 dω over the cap cos θ > 0.3, which is 2π · 0.7
            if d.z > 0.3 {
                1.0 / cosine_hemisphere_pdf(d.z) as f64
            } else {
                0.0
            }
        }));
        // The grid resolves the edge of the cap to about 0.001. A direction there has the weight π
        // / 0.3.
        assert!((cap - 1.4 * std::f64::consts::PI).abs() < 0.03, "{cap}");
    }

    #[test]
    fn sphere_is_uniform_in_every_axis() {
        for axis in 0..3 {
            // Archimedes: each coordinate is uniform in [-1, 1], so E x = 0 and E x² = 1/3.
            let second = mean(grid(512).map(|u| (uniform_sphere(u)[axis] as f64).powi(2)));
            assert!((second - 1.0 / 3.0).abs() < 1e-4, "{axis} {second}");
        }
    }

    #[test]
    fn the_sphere_maps_back_to_the_square() {
        for u in grid(64) {
            let back = square_of_sphere(uniform_sphere(u));
            assert!(back.distance(u) < 1e-6, "{u} {back}");
        }
        for w in [Vec3::Z, Vec3::NEG_Z, Vec3::X, Vec3::NEG_X, Vec3::new(1.0, -1e-30, 0.0)] {
            let u = square_of_sphere(w);
            assert!(u.cmpge(Vec2::ZERO).all() && u.cmplt(Vec2::ONE).all(), "{w} {u}");
            assert!(uniform_sphere(u).distance(w) < 1e-3, "{w} {u}");
        }
    }

    #[test]
    fn normal_plus_sphere_point_is_cosine_distributed() {
        for u in grid(64) {
            let sum = (Vec3::Z + uniform_sphere(u)).normalize();
            assert!(cosine_hemisphere_of_sphere(u).distance(sum) < 1e-5, "{u}");
        }
        let dirs = || grid(1024).map(cosine_hemisphere_of_sphere);
        assert!((mean(dirs().map(|d| d.z as f64)) - 2.0 / 3.0).abs() < 1e-4);
        assert!((mean(dirs().map(|d| (d.x as f64).powi(2))) - 0.25).abs() < 1e-4);
    }

    #[test]
    fn cones_are_uniform() {
        for cos in [-1.0, -0.3, 0.5, 0.99, 0.999_99] {
            let dirs = || grid(512).map(|u| uniform_cone(u, cos));
            assert!(dirs().all(|d| (d.length() - 1.0).abs() < 1e-5 && d.z >= cos - 1e-6));
            // z is uniform between the cosine and 1. The means of x² and y² are each half the mean
            // of 1 − z².
            let (low, span) = (cos as f64, 1.0 - cos as f64);
            let depth = mean(dirs().map(|d| 1.0 - d.z as f64)) / span;
            assert!((depth - 0.5).abs() < 1e-2, "{cos}: {depth}");
            let second = (1.0 + low + low * low) / 3.0;
            let across = mean(dirs().map(|d| (d.y as f64).powi(2))) / (0.5 * (1.0 - second));
            assert!((across - 1.0).abs() < 1e-3, "{cos}: {across}");
            let solid_angle = 2.0 * std::f64::consts::PI * span;
            assert!((uniform_cone_pdf(cos) as f64 * solid_angle - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn triangle_moments() {
        let n = 1024;
        assert!(
            grid(n)
                .map(uniform_triangle)
                .all(|(b1, b2)| b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0)
        );
        // For a uniform point each barycentric has E b = 1/3, E b² = 1/6, E b1 b2 = 1/12.
        let e = |f: fn((f32, f32)) -> f32| mean(grid(n).map(|u| f(uniform_triangle(u)) as f64));
        assert!((e(|b| b.0) - 1.0 / 3.0).abs() < 1e-3);
        assert!((e(|b| b.1) - 1.0 / 3.0).abs() < 1e-3);
        assert!((e(|b| b.0 * b.0) - 1.0 / 6.0).abs() < 1e-3);
        assert!((e(|b| b.0 * b.1) - 1.0 / 12.0).abs() < 1e-3);
    }
}
