use super::{BsdfSample, Scattering, mirror_direction, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::warp::{cosine_power_hemisphere, cosine_power_hemisphere_pdf};
use std::f32::consts::PI;

/// Modified Phong reflection, `f = ks (n + 2) / 2π · cosⁿ α` with `α` between `wi` and the mirror direction of `wo`, alike on
/// both sides of the surface (Lafortune and Willems 1994).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phong {
    /// `ks`: the reflected share at normal incidence; less at others, where part of the lobe is below the horizon.
    pub reflectance: Spectrum,
    /// `n` ≥ 0.
    pub exponent: f32,
}

impl Phong {
    /// Value of the lobe, sr⁻¹.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if !same_hemisphere(wo, wi) {
            return Spectrum::ZERO;
        }
        let cos_alpha = mirror_direction(wo).dot(wi).max(0.0);
        self.reflectance * ((self.exponent + 2.0) / (2.0 * PI) * cos_alpha.powf(self.exponent))
    }

    /// Density of [`Phong::sample`], `(n + 1) / 2π · cosⁿ α` above the horizon.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        cosine_power_hemisphere_pdf(mirror_direction(wo).dot(wi), self.exponent)
    }

    /// Draws `wi` about the mirror direction; what falls below the horizon carries nothing.
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        let about_mirror = Frame::from_z(mirror_direction(wo));
        let wi = about_mirror.to_world(cosine_power_hemisphere(u, self.exponent));
        let pdf = self.pdf(wo, wi);
        (pdf > 0.0).then(|| BsdfSample::new(self.eval(wo, wi), wi, pdf, Scattering::Glossy))
    }
}
