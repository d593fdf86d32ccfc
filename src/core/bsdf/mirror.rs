use super::{BsdfSample, Fresnel, Scattering, mirror_direction};
use crate::color::Spectrum;
use crate::math::Vec3;

/// Perfect specular reflection, symmetric on both sides of the surface. With a conductor's Fresnel
/// term, it is a smooth metal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Factor of the reflected light.
    pub reflectance: Spectrum,
    /// Fresnel reflectance by angle.
    pub fresnel: Fresnel,
}

impl Mirror {
    /// Sample of the mirror direction. The second sample is always `None`.
    pub fn directions(&self, wo: Vec3) -> [Option<BsdfSample>; 2] {
        let cos = wo.z.abs();
        let f = self.reflectance * self.fresnel.reflectance(cos) / cos;
        let reflected = BsdfSample::new(f, mirror_direction(wo), 1.0, Scattering::Specular);
        [(cos > 0.0).then_some(reflected), None]
    }
}
