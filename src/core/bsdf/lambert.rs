use super::{BsdfSample, Scattering, on_side_of, same_hemisphere};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use std::f32::consts::FRAC_1_PI;

/// Ideal diffuse reflection (Lambert): `f = albedo / π`, symmetric on both sides of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lambert {
    /// Reflected fraction of the incident flux, each channel in [0, 1].
    pub albedo: Spectrum,
}

impl Lambert {
    /// Value of the lobe, sr⁻¹.
    pub fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if same_hemisphere(wo, wi) {
            self.albedo * FRAC_1_PI
        } else {
            Spectrum::ZERO
        }
    }

    /// Density of [`Lambert::sample`], cosine-weighted around the normal on the side of `wo`.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) && !self.albedo.is_black() {
            cosine_hemisphere_pdf(wi.z.abs())
        } else {
            0.0
        }
    }

    /// [`Lambert::eval`] and [`Lambert::pdf`].
    #[inline(always)]
    pub fn eval_pdf(&self, wo: Vec3, wi: Vec3) -> (Spectrum, f32) {
        (self.eval(wo, wi), self.pdf(wo, wi))
    }

    /// Samples `wi` on the side of `wo`, with a density proportional to the cosine of `wi`.
    #[inline(always)]
    pub(super) fn sample_direction(wo: Vec3, u: Vec2) -> Vec3 {
        on_side_of(wo, cosine_hemisphere(u))
    }

    /// Samples `wi` on the side of `wo`.
    pub fn sample(&self, wo: Vec3, u: Vec2) -> Option<BsdfSample> {
        if self.albedo.is_black() {
            return None;
        }
        let wi = Self::sample_direction(wo, u);
        let pdf = cosine_hemisphere_pdf(wi.z.abs());
        (pdf > 0.0).then_some(BsdfSample {
            f: self.albedo * FRAC_1_PI,
            wi,
            pdf,
            // The cosine and π cancel, so the weight does not depend on the direction. Roulette can
            // use the weight before the direction is computed.
            weight: self.albedo,
            scattering: Scattering::Diffuse,
            eta: 1.0,
        })
    }
}
