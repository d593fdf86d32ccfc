use super::{BsdfSample, Fresnel, Scattering, mirror_direction};
use crate::color::Spectrum;
use crate::math::Vec3;

/// Perfect specular reflection, alike on both sides of the surface; a smooth metal where a conductor's Fresnel term says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Factor of all that is reflected.
    pub reflectance: Spectrum,
    /// Reflected share by angle.
    pub fresnel: Fresnel,
}

impl Mirror {
    /// The direction of the reflection.
    pub fn directions(&self, wo: Vec3) -> [Option<BsdfSample>; 2] {
        let cos = wo.z.abs();
        let f = self.reflectance * self.fresnel.reflectance(cos) / cos;
        let reflected = BsdfSample::new(f, mirror_direction(wo), 1.0, Scattering::Specular);
        [(cos > 0.0).then_some(reflected), None]
    }
}
