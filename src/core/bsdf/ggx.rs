//! The GGX distribution of microfacets.

use crate::math::{Vec2, Vec3, float::UNIT_ROUNDOFF, sin_cos_turns};
use std::f32::consts::PI;

/// Minimum `α` whose distribution is accurate in `f32`, 2⁻¹².
///
/// The tangential part of a half vector has an error of about 4 roundings of 2⁻²⁴. At a distance of
/// `t α` from the normal, `D` falls as `(1 + t²)⁻²`. The relative error of `D` is therefore at most
/// `2 / α` times the error of the half vector: 0.2 % for this `α`. Smoother surfaces look like
/// mirrors.
pub const MIN_ALPHA: f32 = 4096.0 * UNIT_ROUNDOFF;

/// Microfacets with the distribution of normals of Trowbridge and Reitz (1975), known as GGX
/// (Walter et al. 2007), with Smith's masking and shadowing (Heitz 2014, "Understanding the
/// Masking-Shadowing Function in Microfacet-Based BRDFs").
///
/// All functions are symmetric in z. Functions of two directions need both directions on the same
/// side, unless documented otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ggx {
    /// Widths `αx` and `αy` of the distribution of slopes along x and y.
    alpha: Vec2,
}

impl Ggx {
    /// Facets whose distribution of slopes has the widths `αx` and `αy`, each clamped to
    /// [[`MIN_ALPHA`], 1].
    pub fn new(alpha: Vec2) -> Self {
        // Unlike `clamp`, this expression maps NaN to `MIN_ALPHA`.
        let bounded = |a: f32| if a > MIN_ALPHA { a.min(1.0) } else { MIN_ALPHA };
        Self {
            alpha: Vec2::new(bounded(alpha.x), bounded(alpha.y)),
        }
    }

    /// Widths `αx` and `αy` of the distribution of slopes.
    pub fn slopes(&self) -> Vec2 {
        self.alpha
    }

    /// Distribution `D` of normals: the area of the facets with normal `h`, per solid angle and per
    /// area of the surface (Heitz 2014, eq. 85).
    ///
    /// Unlike the form with `cos² (α² − 1) + 1`, this form has no subtraction.
    #[inline(always)]
    pub fn density(&self, h: Vec3) -> f32 {
        // Multiply the normal by `αx` and `αy`, so that one division is enough
        let area = self.alpha.x * self.alpha.y;
        let (x, y, z) = (h.x * self.alpha.y, h.y * self.alpha.x, h.z * area);
        let t = x * x + y * y + z * z;
        area * area * area / (PI * t * t)
    }

    /// `a` in Smith's `Λ = (a / |cos θ| − 1) / 2` (Heitz 2014, eq. 86). It is the length of `w` in
    /// the stretched space in which the facets have the distribution of normals of a sphere.
    #[inline(always)]
    pub fn stretched(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha.x * w.x, self.alpha.y * w.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// Fraction of the facets facing `w` that are not masked, `G₁ = 1 / (1 + Λ)`.
    #[inline(always)]
    pub fn visible(&self, w: Vec3) -> f32 {
        let z = w.z.abs();
        2.0 * z / (z + self.stretched(w))
    }

    /// `D G₂ / (4 cos θi cos θo)` for the half vector `h`. `G₂ = 1 / (1 + Λ(wo) + Λ(wi))` is the
    /// height-correlated masking and shadowing (Heitz 2014, eq. 99).
    #[inline(always)]
    pub fn reflection(&self, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        self.density(h) * self.shadowed_reflection(wo, wi, [self.stretched(wo), self.stretched(wi)])
    }

    /// [`Ggx::reflection`] divided by `D`. `stretched` has the results of [`Ggx::stretched`] for
    /// both directions.
    #[inline(always)]
    pub fn shadowed_reflection(&self, wo: Vec3, wi: Vec3, stretched: [f32; 2]) -> f32 {
        let (zo, zi) = (wo.z.abs(), wi.z.abs());
        0.5 / (zi * stretched[0] + zo * stretched[1])
    }

    /// `G₂ / G₁(wo)`: weight of the reflection on a visible facet.
    pub fn reflection_weight(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (zo, zi) = (wo.z.abs(), wi.z.abs());
        let ao = self.stretched(wo);
        zi * (zo + ao) / (zi * ao + zo * self.stretched(wi))
    }

    /// Density of [`Ggx::sample_visible`] divided by `wo·h`: `G₁ D / cos θo`.
    #[inline(always)]
    pub fn visible_density(&self, wo: Vec3, h: Vec3) -> f32 {
        self.density(h) * self.seen(wo, self.stretched(wo))
    }

    /// [`Ggx::visible_density`] divided by `D`. `stretched` is the result of [`Ggx::stretched`] for
    /// `wo`.
    #[inline(always)]
    pub fn seen(&self, wo: Vec3, stretched: f32) -> f32 {
        2.0 / (wo.z.abs() + stretched)
    }

    /// Samples the normal of a visible facet, on the side of `wo`, with density `G₁ (wo·h) D / cos
    /// θo` per solid angle. In the stretched space, the normal is the normalised sum of a point on
    /// a spherical cap and the view direction (Dupuy and Benyoub 2023, "Sampling Visible GGX
    /// Normals with Spherical Caps").
    pub fn sample_visible(&self, wo: Vec3, u: Vec2) -> Vec3 {
        let side = 1f32.copysign(wo.z);
        let stretch = Vec3::new(self.alpha.x, self.alpha.y, side);
        let w = (wo * stretch).normalize_or(Vec3::Z);
        // Sample the spherical cap uniformly. It has the directions to which a visible facet can
        // reflect
        let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = sin_cos_turns(u.x);
        let h = Vec3::new(r * cos, r * sin, z) + w;
        // Clamp z: rounding must not flip a facet.
        let h = Vec3::new(h.x, h.y, h.z.max(0.0));
        (h * stretch).normalize_or(Vec3::new(0.0, 0.0, side))
    }

    /// Roughness `√α` for the energy tables, which have isotropic facets only. `α` is the geometric
    /// mean of `αx` and `αy`. For anisotropic facets, some of the lost light is therefore not
    /// returned, and up to 3 % too much light is returned at grazing angles.
    pub fn roughness(&self) -> f32 {
        if self.alpha.x == self.alpha.y {
            self.alpha.x.sqrt()
        } else {
            (self.alpha.x * self.alpha.y).sqrt().sqrt()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI as PI64;

    const SLOPES: [[f32; 2]; 4] = [[0.1, 0.1], [1.0, 1.0], [0.1, 0.4], [0.9, 0.3]];

    /// Integral of `f` over the upper hemisphere, by midpoints in azimuth and in `t`, with `tan θ =
    /// t / (1 − t)`. The points are dense near the normal, so narrow distributions of facets are
    /// resolved.
    fn integral(f: impl Fn(Vec3) -> f64) -> f64 {
        const STEPS: usize = 800;
        let mut sum = 0.0;
        for i in 0..STEPS {
            let t = (i as f64 + 0.5) / STEPS as f64;
            let (sin, cos) = (t / (1.0 - t)).atan().sin_cos();
            let jacobian = sin * cos * cos / ((1.0 - t) * (1.0 - t));
            for j in 0..STEPS {
                let (s, c) = (2.0 * PI64 * (j as f64 + 0.5) / STEPS as f64).sin_cos();
                sum += jacobian * f(Vec3::new((sin * c) as f32, (sin * s) as f32, cos as f32));
            }
        }
        2.0 * PI64 * sum / (STEPS * STEPS) as f64
    }

    fn directions() -> [Vec3; 3] {
        [
            Vec3::Z,
            Vec3::new(0.6, -0.3, 0.5).normalize(),
            Vec3::new(-0.4, 0.9, 0.05).normalize(),
        ]
    }

    #[test]
    fn projected_area_of_facets_is_the_area_of_the_surface() {
        for slopes in SLOPES {
            let facets = Ggx::new(slopes.into());
            // The projected area of all facets is the area of the surface.
            let area = integral(|h| (facets.density(h) * h.z) as f64);
            assert!((area - 1.0).abs() < 1e-3, "{slopes:?}: {area}");
            // The projected area of the visible facets is the area seen from `w`: ∫ G₁ max(0, w·h)
            // D dh = cos θ (Heitz 2014, eq. 14).
            for w in directions() {
                let seen = integral(|h| (facets.visible_density(w, h) * w.dot(h).max(0.0)) as f64);
                assert!((seen - 1.0).abs() < 2e-3, "{slopes:?} {w}: {seen}");
            }
        }
    }

    #[test]
    fn visible_facets_are_sampled_by_their_density() {
        const GRID: u32 = 512;
        for slopes in SLOPES {
            let facets = Ggx::new(slopes.into());
            for w in directions() {
                // Compare the means of components of the normal, and of products of components,
                // from samples and by quadrature
                let mut drawn = [0.0f64; 4];
                for i in 0..GRID * GRID {
                    let u = Vec2::new((i % GRID) as f32 + 0.5, (i / GRID) as f32 + 0.5) / GRID as f32;
                    let h = facets.sample_visible(w, u);
                    let behind = facets.sample_visible(w * Vec3::new(1.0, 1.0, -1.0), u);
                    assert!((h - behind * Vec3::new(1.0, 1.0, -1.0)).length() < 1e-6);
                    let values = [h.x, h.y, h.x * h.x, h.x * h.y];
                    for (sum, value) in drawn.iter_mut().zip(values) {
                        *sum += value as f64 / (GRID * GRID) as f64;
                    }
                }
                let density = |h: Vec3| (facets.visible_density(w, h) * w.dot(h).max(0.0)) as f64;
                let expected = [
                    integral(|h| density(h) * h.x as f64),
                    integral(|h| density(h) * h.y as f64),
                    integral(|h| density(h) * (h.x * h.x) as f64),
                    integral(|h| density(h) * (h.x * h.y) as f64),
                ];
                for (a, b) in drawn.into_iter().zip(expected) {
                    assert!((a - b).abs() < 2e-3, "{slopes:?} {w}: {drawn:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn invalid_slopes_are_clamped() {
        for alpha in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e-30] {
            let facets = Ggx::new(Vec2::splat(alpha));
            assert!(facets.alpha.x >= MIN_ALPHA && facets.alpha.x <= 1.0);
            for w in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::ZERO] {
                for u in [Vec2::ZERO, Vec2::ONE, Vec2::new(0.3, 0.999_999_94)] {
                    assert!(facets.sample_visible(w, u).is_finite());
                }
            }
        }
    }
}
