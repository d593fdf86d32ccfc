use super::bounds::{LightBounds, ReceiverRegion};
use super::{Emission, LightSample};
use crate::color::Spectrum;
use crate::math::{Frame, Vec2, Vec3, encode_fields};
use crate::sampling::warp::{uniform_cone, uniform_cone_pdf};
use std::f64::consts::PI;

/// A point that emits into a cone.
#[derive(Clone, Copy, Debug)]
pub struct SpotLight {
    /// Position, world space.
    pub position: Vec3,
    /// Unit axis of the cone, world space.
    pub direction: Vec3,
    /// Radiant intensity within the inner cone, W/sr.
    pub intensity: Spectrum,
    /// Cosine of the inner cone's half-angle, at which the falloff begins.
    pub cos_inner: f32,
    /// Cosine of the outer cone's half-angle, at which the intensity reaches zero.
    pub cos_outer: f32,
}

encode_fields!(SpotLight {
    position,
    direction,
    intensity,
    cos_inner,
    cos_outer,
});

impl SpotLight {
    /// Incident light at `p`. There is only one direction to the light. `None` if `p` is outside of
    /// the cone.
    pub(super) fn sample(&self, p: Vec3) -> Option<LightSample> {
        let wi = (self.position - p).try_normalize()?;
        let falloff = self.falloff(-wi.dot(self.direction));
        (falloff > 0.0).then(|| LightSample {
            wi,
            radiance: self.intensity * (falloff / p.distance_squared(self.position)),
            pdf: 1.0,
            is_delta: true,
            target: Some(self.position),
        })
    }

    /// Samples the start of a light path, in a direction uniform in the outer cone.
    pub(super) fn sample_emission(&self, u: Vec2) -> Emission {
        let w = Frame::from_z(self.direction).to_world(uniform_cone(u, self.cos_outer));
        let intensity = self.intensity * self.falloff(w.dot(self.direction));
        Emission::of_point(self.position, w, intensity, self.emission_pdf(w))
    }

    /// Density per solid angle with which emission sampling samples the unit direction `w`.
    pub(super) fn emission_pdf(&self, w: Vec3) -> f32 {
        if w.dot(self.direction) >= self.cos_outer {
            uniform_cone_pdf(self.cos_outer)
        } else {
            0.0
        }
    }

    /// Fraction of `intensity` in a direction whose angle to the axis has the cosine `cos`. It is a
    /// smoothstep function of the cosine.
    fn falloff(&self, cos: f32) -> f32 {
        if cos >= self.cos_inner {
            return 1.0;
        }
        let t = ((cos - self.cos_outer) / (self.cos_inner - self.cos_outer)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Position and emission of the light for distant points: isotropic, with the mean intensity.
    pub(super) fn bounds(&self) -> LightBounds {
        LightBounds::isotropic(self.position, (self.power() / (4.0 * PI)) as f32)
    }

    /// Estimate of the mean irradiance in `region`. It includes light from the cone even if only a
    /// part of the region, and not its middle, is in the cone.
    pub(super) fn irradiance(&self, region: &ReceiverRegion) -> f32 {
        region.irradiance_by(self.position, 0.0, |wi, spread| {
            self.intensity.luminance() * self.falloff((spread - wi.dot(self.direction)).min(1.0))
        })
    }

    /// Power in watts. The smoothstep is antisymmetric about its middle, so its mean between the
    /// cones is 1/2. The integral of the falloff over all directions is therefore the solid angle
    /// of the inner cone plus half of the solid angle between the cones.
    pub(super) fn power(&self) -> f64 {
        let solid_angle = 2.0 * PI * (1.0 - 0.5 * (self.cos_inner as f64 + self.cos_outer as f64));
        solid_angle * self.intensity.luminance() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_ends_at_the_cone() {
        let spot = SpotLight {
            position: Vec3::ZERO,
            direction: Vec3::X,
            intensity: Spectrum::splat(4.0),
            cos_inner: 0.9,
            cos_outer: 0.8,
        };
        let at = |cos: f32| {
            let p = 2.0 * Vec3::new(cos, (1.0 - cos * cos).sqrt(), 0.0);
            spot.sample(p).map_or(0.0, |s| s.radiance.max_component())
        };
        assert!((at(1.0) - 1.0).abs() < 1e-5 && (at(0.91) - 1.0).abs() < 1e-5);
        assert!((at(0.85) - 0.5).abs() < 1e-4);
        assert_eq!((at(0.79), at(-1.0)), (0.0, 0.0));
        // Compare the power with a sum over directions
        let n = 100_000;
        let sum: f64 = (0..n)
            .map(|i| spot.falloff(-1.0 + 2.0 * (i as f32 + 0.5) / n as f32) as f64)
            .sum();
        let power = 4.0 * PI * sum / n as f64 * 4.0;
        assert!((spot.power() / power - 1.0).abs() < 1e-3, "{} {power}", spot.power());
    }
}
