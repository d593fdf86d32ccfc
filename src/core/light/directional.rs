use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Ball, Vec2, Vec3, encode_fields};
use std::f64::consts::PI;

/// Parallel light from infinitely far away.
#[derive(Clone, Copy, Debug)]
pub struct DirectionalLight {
    /// Unit direction in which the light travels, world space.
    pub direction: Vec3,
    /// Irradiance of a surface that faces the light, W·m⁻².
    pub irradiance: Spectrum,
}

encode_fields!(DirectionalLight { direction, irradiance });

impl DirectionalLight {
    /// Returns the incident light. It comes from a single direction.
    pub(super) fn sample(&self) -> LightSample {
        LightSample {
            wi: -self.direction,
            radiance: self.irradiance,
            pdf: 1.0,
            is_delta: true,
            target: None,
        }
    }

    /// Samples the start of a light path that enters `world`, the ball around the scene.
    pub(super) fn sample_emission(&self, u_position: Vec2, world: &Ball) -> Emission {
        Emission {
            is_delta_direction: true,
            ..Emission::from_infinity(self.direction, self.irradiance, 1.0, u_position, world)
        }
    }

    /// Power in watts through a disk of the scene's radius: `π r² E`.
    pub(super) fn power(&self, scene_radius: f32) -> f64 {
        PI * (scene_radius as f64).powi(2) * self.irradiance.luminance() as f64
    }
}
