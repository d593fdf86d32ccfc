use super::energy::Row;
use super::{half_vector, on_side_of, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::{UNIFORM_HEMISPHERE_PDF, uniform_hemisphere};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::OnceLock;

/// Light scattered by upright fibres, as of cloth and dust, mostly at grazing angles. Symmetric on
/// both sides of the surface.
///
/// `f = color · D / (4 (cos θo + cos θi − cos θo cos θi))` with `D = (2 + 1/α) sin^(1/α) θh / 2π`
/// (Estevez and Kulla 2017, "Production Friendly Microfacet Sheen BRDF", eq. 2; the denominator is
/// from Neubelt and Pettineo 2013, "Crafting a Next-Gen Material Pipeline for The Order: 1886").
/// `α` is fixed at 1/4. With colour 1 the lobe then scatters 3 % of the light along the normal and
/// 96 % at the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// Factor of the scattered light, each channel in [0, 1].
    pub color: Spectrum,
}

/// Directional albedo of a sheen of colour 1, by cosine.
static ALBEDO: OnceLock<Row> = OnceLock::new();

/// Number of quadrature points along the cosine and along half the azimuth.
const POINTS: u32 = 128;

impl Sheen {
    /// Returns the value of the lobe, sr⁻¹, and the density of `wi` per solid angle, which is
    /// uniform over the hemisphere of `wo`.
    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(wo, wi) || self.color.is_black() {
            return (Spectrum::ZERO, 0.0);
        }
        let f = half_vector(wo, wi).map_or(Spectrum::ZERO, |(h, _)| self.color * value(wo.z.abs(), wi.z.abs(), h));
        (f, UNIFORM_HEMISPHERE_PDF)
    }

    /// Samples `wi` on the side of `wo`. The weight is at most 3/2 of the colour.
    pub(super) fn sample_direction(wo: Vec3, u: Vec2) -> Vec3 {
        on_side_of(wo, uniform_hemisphere(u))
    }

    /// Mean albedo under uniform light.
    pub(super) fn albedo(&self) -> Spectrum {
        self.color * albedo_row().mean
    }

    /// Directional albedo towards `wo`.
    pub(super) fn albedo_towards(&self, wo: Vec3) -> Spectrum {
        self.color * albedo_row().at(wo.z.abs())
    }
}

/// Value for colour 1 and the half vector `h`.
fn value(cos_o: f32, cos_i: f32, h: Vec3) -> f32 {
    let sin2 = h.x * h.x + h.y * h.y;
    3.0 * FRAC_1_PI * sin2 * sin2 / (4.0 * (cos_o + cos_i - cos_o * cos_i))
}

/// Directional albedo by the midpoint rule over half of the hemisphere. The other half is
/// symmetric.
fn albedo_row() -> &'static Row {
    ALBEDO.get_or_init(|| {
        Row::of(|cos_o| {
            let wo = Vec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            let middle = |i: u32| (i as f32 + 0.5) / POINTS as f32;
            let mut sum = 0.0;
            for (i, j) in (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (i, j))) {
                let cos_i = middle(i);
                let (sin, cos) = (PI * middle(j)).sin_cos();
                let r = (1.0 - cos_i * cos_i).sqrt();
                let h = (wo + Vec3::new(r * cos, r * sin, cos_i)).normalize();
                sum += (value(cos_o, cos_i, h) * cos_i) as f64;
            }
            (sum * 2.0 * std::f64::consts::PI / (POINTS * POINTS) as f64) as f32
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_that_grazes_is_scattered_most() {
        let sheen = Sheen { color: Spectrum::ONE };
        let share = |cos: f32| {
            sheen
                .albedo_towards(Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos))
                .mean()
        };
        // Along the normal: θh is half of θi, ∫ 2π (3/4π) sin⁴(θi/2) cos θi d cos θi = 3/8 ∫ (1 −
        // x)² x dx = 1/32
        assert!((share(1.0) - 1.0 / 32.0).abs() < 1e-4, "{}", share(1.0));
        // Compare with values of the midpoint rule in f64 on a finer grid
        for (cos, expected) in [(0.1, 0.639), (0.3, 0.381), (0.5, 0.230), (0.7, 0.128), (0.9, 0.058)] {
            assert!((share(cos) - expected).abs() < 2e-3, "{cos}: {}", share(cos));
        }
        assert!((0.9..1.0).contains(&share(0.0)), "{}", share(0.0));
        assert!((0.0..1.0).contains(&share(f32::NAN)));
    }
}
