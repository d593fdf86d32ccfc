use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Ball, Vec2, encode_fields};
use crate::sampling::warp::{UNIFORM_SPHERE_PDF, uniform_sphere};
use std::f64::consts::PI;

/// An environment at infinity with the same radiance from every direction.
#[derive(Clone, Copy, Debug)]
pub struct ConstantLight {
    /// Radiance, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
}

encode_fields!(ConstantLight { radiance });

impl ConstantLight {
    /// Samples a uniform direction of the sphere.
    pub(super) fn sample(&self, u: Vec2) -> LightSample {
        LightSample {
            wi: uniform_sphere(u),
            radiance: self.radiance,
            pdf: self.pdf(),
            is_delta: false,
            target: None,
        }
    }

    /// Density per solid angle, the same for every direction.
    pub fn pdf(&self) -> f32 {
        UNIFORM_SPHERE_PDF
    }

    /// Samples the start of a light path: a uniform direction from infinity into `world`, the ball
    /// around the scene.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2, world: &Ball) -> Emission {
        let w = -uniform_sphere(u_direction);
        Emission::from_infinity(w, self.radiance, self.pdf(), u_position, world)
    }

    /// Power in watts through a sphere of the scene's radius: `4π · π r² L`.
    pub(super) fn power(&self, scene_radius: f32) -> f64 {
        4.0 * PI * PI * (scene_radius as f64).powi(2) * self.radiance.luminance() as f64
    }
}
