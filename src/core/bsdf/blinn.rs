use super::exponent_energy::blinn_reflected;
use super::{Fresnel, half_vector, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::{cosine_power_hemisphere, cosine_power_hemisphere_pdf};
use std::f32::consts::PI;

/// Reflection by V-shaped grooves of mirrors with Blinn's distribution of normals, `D = (n + 2) /
/// 2π · cosⁿ θh`. Symmetric on both sides of the surface (Torrance and Sparrow 1967; Blinn 1977;
/// PBR3 §8.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blinn {
    /// Factor of the reflected light.
    pub reflectance: Spectrum,
    /// Exponent `n` ≥ 0.
    pub exponent: f32,
    /// Fresnel reflectance of a facet.
    pub fresnel: Fresnel,
}

impl Blinn {
    /// Returns the value of the lobe, sr⁻¹, `D G F / (4 cos θi cos θo)`, and the density of `wi`
    /// per solid angle. The density is the density `D cos θh` of the half vector times the Jacobian
    /// `1 / (4 wo·wh)`.
    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        let Some((wh, cos_oh)) = half_vector(wo, wi) else {
            return (Spectrum::ZERO, 0.0);
        };
        let (cos_o, cos_i, cos_h) = (wo.z.abs(), wi.z.abs(), wh.z.abs());
        let d = (self.exponent + 2.0) / (2.0 * PI) * cos_h.powf(self.exponent);
        // Factor for shadowing and masking in V-shaped grooves
        let g = (2.0 * cos_h * cos_o.min(cos_i) / cos_oh).min(1.0);
        (
            self.reflectance * self.fresnel.reflectance(cos_oh) * (d * g / (4.0 * cos_i * cos_o)),
            cosine_power_hemisphere_pdf(cos_h, self.exponent + 1.0) / (4.0 * cos_oh),
        )
    }

    /// Directional albedo: fraction of uniform light that is reflected to `wo`, by channel.
    pub(super) fn directional_albedo(&self, wo: Vec3) -> Spectrum {
        let [all, grazing] = blinn_reflected(self.exponent, wo.z.abs());
        self.reflectance * self.fresnel.mean_reflectance(all, grazing)
    }

    /// Samples a facet and reflects `wo` on it. `None` if the direction lies below the horizon.
    pub(super) fn sample_direction(&self, wo: Vec3, u: Vec2) -> Option<Vec3> {
        let mut wh = cosine_power_hemisphere(u, self.exponent + 1.0);
        wh.z = wh.z.copysign(wo.z);
        let cos_oh = wo.dot(wh);
        // A facet does not reflect on its back side.
        if cos_oh <= 0.0 {
            return None;
        }
        let wi = (2.0 * cos_oh * wh - wo).normalize();
        same_hemisphere(wo, wi).then_some(wi)
    }
}
