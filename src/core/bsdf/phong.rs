use super::exponent_energy::phong_reflected;
use super::{mirror_direction, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::warp::{cosine_power_hemisphere, cosine_power_hemisphere_pdf};
use std::f32::consts::PI;

/// Modified Phong reflection, `f = ks (n + 2) / 2π · cosⁿ α` with `α` between `wi` and the mirror
/// direction of `wo`. Symmetric on both sides of the surface (Lafortune and Willems 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// `ks`: the reflectance at normal incidence. At other angles, a part of the lobe is below the
    /// horizon, and the surface reflects less.
    pub reflectance: Spectrum,
    /// Exponent `n` ≥ 0.
    pub exponent: f32,
}

impl Phong {
    // ANCHOR: phong
    /// Returns the value of the lobe, sr⁻¹, and the density of `wi` per solid angle, which is `(n +
    /// 1) / 2π · cosⁿ α` above the horizon.
    #[inline(never)]
    pub(super) fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        if !same_hemisphere(wo, wi) {
            return (Spectrum::ZERO, 0.0);
        }
        let cos_alpha = mirror_direction(wo).dot(wi);
        (
            self.reflectance * ((self.exponent + 2.0) / (2.0 * PI) * cos_alpha.max(0.0).powf(self.exponent)),
            cosine_power_hemisphere_pdf(cos_alpha, self.exponent),
        )
    }

    /// Samples `wi` around the mirror direction. `None` if `wi` lies below the horizon.
    pub(super) fn sample_direction(&self, wo: Vec3, u: Vec2) -> Option<Vec3> {
        let about_mirror = Frame::from_z(mirror_direction(wo));
        let wi = about_mirror.to_world(cosine_power_hemisphere(u, self.exponent));
        same_hemisphere(wo, wi).then_some(wi)
    }
    // ANCHOR_END: phong

    /// Directional albedo: fraction of uniform light that is reflected to `wo`, by channel.
    pub(super) fn directional_albedo(&self, wo: Vec3) -> Spectrum {
        self.reflectance * phong_reflected(self.exponent, wo.z.abs())
    }
}
