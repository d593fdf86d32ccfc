use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, encode_fields};
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use std::f64::consts::PI;

/// A point that emits the same intensity in every direction.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// Position, world space.
    pub position: Vec3,
    /// Radiant intensity, W/sr.
    pub intensity: Spectrum,
}

encode_fields!(PointLight { position, intensity });

impl PointLight {
    /// Incident light at `p`. There is only one direction to the light. `radiance` is the intensity
    /// divided by the squared distance.
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let wi = (self.position - p).try_normalize()?;
        Some(LightSample {
            wi,
            radiance: self.intensity / p.distance_squared(self.position),
            pdf: 1.0,
            is_delta: true,
            target: Some(self.position),
        })
    }

    /// Samples the start of a light path, in a uniform direction.
    pub(super) fn sample_emission(&self, u: Vec2) -> Emission {
        Emission::of_point(self.position, uniform_sphere(u), self.intensity, self.emission_pdf())
    }

    /// Density per solid angle, the same for every direction.
    pub(super) fn emission_pdf(&self) -> f32 {
        UNIFORM_SPHERE_PDF
    }

    /// Power in watts: `4π I`.
    pub(super) fn power(&self) -> f64 {
        4.0 * PI * self.intensity.luminance() as f64
    }
}
