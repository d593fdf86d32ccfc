use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Ball, Frame, Vec2, Vec3, encode_fields};
use crate::sampling::warp::{uniform_cap, uniform_cap_pdf};
use std::f64::consts::PI;

/// Light from a disc at infinity with constant radiance: a sun with a size.
///
/// The disc is stored as the depth of its cap, 1 − cos of its half-angle α. The depth is accurate
/// for narrow cones; the cosine is not.
#[derive(Clone, Copy, Debug)]
pub struct SunLight {
    /// Unit direction in which the light of the disc's centre travels, world space.
    direction: Vec3,
    /// Radiance of the disc, W·sr⁻¹·m⁻².
    radiance: Spectrum,
    /// Depth of the cap: 1 − cos α = 2 sin² (α / 2).
    depth: f32,
}

encode_fields!(SunLight {
    direction,
    radiance,
    depth,
});

impl SunLight {
    /// Light that travels along the unit vector `direction`, with `irradiance`, W·m⁻², on a surface
    /// that faces the light. `angle` is the diameter of the disc in degrees, above 0 and at most
    /// 180.
    pub fn new(direction: Vec3, irradiance: Spectrum, angle: f32) -> Self {
        let half = (0.5 * f64::from(angle)).to_radians();
        // E = ∫ L cos dω over the cone = π L sin² α
        let factor = 1.0 / (PI * half.sin().powi(2));
        Self {
            direction,
            radiance: Spectrum::from(irradiance.to_array().map(|e| (f64::from(e) * factor) as f32)),
            depth: (2.0 * (0.5 * half).sin().powi(2)) as f32,
        }
    }

    /// Unit direction in which the light of the disc's centre travels, world space.
    pub fn direction(&self) -> Vec3 {
        self.direction
    }

    /// Radiance from the unit direction `wi`; zero outside of the disc.
    pub fn radiance(&self, wi: Vec3) -> Spectrum {
        if self.covers(wi) { self.radiance } else { Spectrum::ZERO }
    }

    /// Density per solid angle with which the direction `wi` is sampled; 0 outside of the disc.
    pub fn pdf(&self, wi: Vec3) -> f32 {
        if self.covers(wi) {
            uniform_cap_pdf(self.depth)
        } else {
            0.0
        }
    }

    /// Returns true if the disc lies in the direction `wi`. For unit vectors, half the squared
    /// distance is one minus the cosine, but has no cancellation error.
    fn covers(&self, wi: Vec3) -> bool {
        0.5 * (wi + self.direction).length_squared() <= self.depth
    }

    /// Samples a direction uniform in the disc's solid angle.
    pub(super) fn sample(&self, u: Vec2) -> LightSample {
        LightSample {
            wi: Frame::from_z(-self.direction).to_world(uniform_cap(u, self.depth)),
            radiance: self.radiance,
            pdf: uniform_cap_pdf(self.depth),
            is_delta: false,
            target: None,
        }
    }

    /// Samples the start of a light path that enters `world`, the ball around the scene.
    pub(super) fn sample_emission(&self, u_position: Vec2, u_direction: Vec2, world: &Ball) -> Emission {
        let LightSample { wi, radiance, pdf, .. } = self.sample(u_direction);
        Emission::from_infinity(-wi, radiance, pdf, u_position, world)
    }

    /// Power in watts: `π r² · 2π (1 − cos α) L`. It is the flux through a disk with the scene's
    /// radius r that is perpendicular to the direction of light, integrated over all directions of
    /// the cone.
    pub(super) fn power(&self, scene_radius: f32) -> f64 {
        2.0 * (PI * f64::from(scene_radius)).powi(2) * f64::from(self.depth) * f64::from(self.radiance.luminance())
    }

    /// Irradiance of a surface that faces the disc: `π L sin² α`.
    pub(super) fn facing_irradiance(&self) -> Spectrum {
        self.radiance * (PI as f32 * self.depth * (2.0 - self.depth))
    }

    /// Unit direction from surfaces to the disc's centre, and the sine of the half-angle.
    pub(super) fn cone(&self) -> (Vec3, f32) {
        (-self.direction, (self.depth * (2.0 - self.depth)).max(0.0).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ L cos dω over a grid of samples is the given irradiance for any size.
    #[test]
    fn irradiance_is_the_same_for_all_disc_sizes() {
        let direction = Vec3::new(0.3, -0.9, 0.2).normalize();
        for angle in [0.01, 0.53, 10.0, 90.0, 180.0] {
            let sun = SunLight::new(direction, Spectrum::rgb(3.0, 1.0, 0.5), angle);
            let n = 400;
            let (mut sum, mut inside) = (0.0, 0);
            for i in 0..n * n {
                let u = Vec2::new((i % n) as f32 + 0.5, (i / n) as f32 + 0.5) / n as f32;
                let sample = sun.sample(u);
                sum += f64::from(sample.wi.dot(-direction) * sample.radiance.to_array()[0] / sample.pdf);
                inside += u32::from(sun.pdf(sample.wi) == sample.pdf);
            }
            let irradiance = sum / f64::from(n * n);
            assert!((irradiance / 3.0 - 1.0).abs() < 1e-4, "{angle}: {irradiance}");
            // Rounding errors put hardly any sampled direction outside of the disc.
            assert!(f64::from(inside) > 0.995 * f64::from(n * n), "{angle}: {inside}");
        }
    }

    #[test]
    fn radiance_outside_of_the_disc_is_zero() {
        let sun = SunLight::new(Vec3::NEG_Y, Spectrum::ONE, 10.0);
        let at = |degrees: f32| sun.radiance(Vec3::new(degrees.to_radians().sin(), degrees.to_radians().cos(), 0.0));
        let expected = 1.0 / (PI * 5f64.to_radians().sin().powi(2));
        assert!((f64::from(at(4.99).max_component()) / expected - 1.0).abs() < 1e-5);
        assert!(at(5.01).is_black() && at(180.0).is_black());
        // The power is the power of parallel light with the same irradiance, divided by the mean
        // cosine of the cone.
        let parallel = super::super::DirectionalLight {
            direction: Vec3::NEG_Y,
            irradiance: Spectrum::ONE,
        };
        let mean_cosine = 0.5 * (1.0 + 5f64.to_radians().cos());
        assert!((sun.power(2.0) * mean_cosine / parallel.power(2.0) - 1.0).abs() < 1e-5);
    }
}
