use super::{BsdfSample, Scattering, TransportMode, fresnel, mirror_direction};
use crate::color::Spectrum;
use crate::math::Vec3;

/// A smooth dielectric boundary: reflects by Fresnel's equations and refracts the rest by Snell's
/// law.
///
/// +z is the outside. Radiance that crosses the boundary changes with the square of the index (PBR4
/// §9.5.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dielectric {
    /// Factor of the reflected light.
    pub reflectance: Spectrum,
    /// Factor of the refracted light.
    pub transmittance: Spectrum,
    /// Index of refraction inside, relative to the outside.
    pub ior: f32,
}

impl Dielectric {
    /// Directional albedo: fraction of the flux of uniform light that is reflected or refracted to
    /// `wo`, by channel.
    pub(super) fn directional_albedo(&self, wo: Vec3) -> Spectrum {
        let eta = if wo.z > 0.0 { self.ior } else { 1.0 / self.ior };
        let (r, _) = fresnel::dielectric(wo.z.abs(), eta);
        self.reflectance * r + self.transmittance * (1.0 - r)
    }

    /// Returns a sample of the reflected direction and a sample of the refracted direction. The
    /// density of a sample is the fraction of the flux in this direction. `None` if a direction
    /// gets no light.
    pub fn directions(&self, wo: Vec3, mode: TransportMode) -> [Option<BsdfSample>; 2] {
        let cos_o = wo.z.abs();
        if cos_o == 0.0 {
            return [None, None];
        }
        // Index of refraction on the other side, relative to the side of `wo`
        let eta = if wo.z > 0.0 { self.ior } else { 1.0 / self.ior };
        let (r, cos_t) = fresnel::dielectric(cos_o, eta);
        let f = self.reflectance * (r / cos_o);
        let reflected = BsdfSample::new(f, mirror_direction(wo), r, Scattering::Specular);
        if r >= 1.0 || cos_t <= 0.0 {
            return [Some(reflected), None];
        }

        // Refraction changes the solid angle, and so the radiance. It does not change importance.
        let scale = match mode {
            TransportMode::Radiance => 1.0 / (eta * eta),
            TransportMode::Importance => 1.0,
        };
        let f = self.transmittance * (scale * (1.0 - r) / cos_t);
        let wi = Vec3::new(-wo.x / eta, -wo.y / eta, -cos_t.copysign(wo.z));
        let refracted = BsdfSample {
            eta,
            ..BsdfSample::new(f, wi, 1.0 - r, Scattering::Specular)
        };
        [(r > 0.0).then_some(reflected), Some(refracted)]
    }
}
