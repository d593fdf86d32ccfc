use super::{BsdfSample, Scattering, fresnel, mirror_direction};
use crate::color::Spectrum;
use crate::math::Vec3;

/// A thin dielectric: light leaves in its original direction, after all reflections between the two
/// faces.
///
/// Each face reflects the fraction `R`, so both faces together reflect `R + (1 − R)² R / (1 − R²) =
/// 2R / (1 + R)` (PBR3 §8.2.2). With an index of 1, nothing is reflected, and the dielectric is a
/// colour filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinDielectric {
    /// Factor of the reflected light.
    pub reflectance: Spectrum,
    /// Factor of the transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction inside.
    pub ior: f32,
}

impl ThinDielectric {
    /// Reflectance at the cosine `cos` for the index `ior`, with all reflections between the faces.
    pub fn reflected_share(cos: f32, ior: f32) -> f32 {
        let (face, _) = fresnel::dielectric(cos, ior);
        2.0 * face / (1.0 + face)
    }

    /// Directional albedo: fraction of uniform light that is reflected or transmitted to `wo`, by
    /// channel.
    pub(super) fn directional_albedo(&self, wo: Vec3) -> Spectrum {
        let r = Self::reflected_share(wo.z.abs(), self.ior);
        self.reflectance * r + self.transmittance * (1.0 - r)
    }

    /// Returns a sample of the reflected direction and a sample of the transmitted direction. The
    /// density of a sample is the fraction of the flux in this direction.
    pub fn directions(&self, wo: Vec3) -> [Option<BsdfSample>; 2] {
        let cos = wo.z.abs();
        if cos == 0.0 {
            return [None, None];
        }
        let r = Self::reflected_share(cos, self.ior);
        let sample =
            |f: Spectrum, wi, pdf| (pdf > 0.0).then(|| BsdfSample::new(f * (pdf / cos), wi, pdf, Scattering::Specular));
        [
            sample(self.reflectance, mirror_direction(wo), r),
            sample(self.transmittance, -wo, 1.0 - r),
        ]
    }
}
