//! From a surface point to the BSDF that holds there.

use crate::bsdf::{Bsdf, Lambert};
use crate::color::Spectrum;
use crate::geometry::SurfacePoint;

/// A material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a surface is made of. All colours are linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, from MTL or the scene file.
    pub name: String,
    /// Diffuse reflectance, each channel in [0, 1].
    pub diffuse: Spectrum,
    /// Emitted radiance on the front side, W·sr⁻¹·m⁻².
    pub emission: Spectrum,
}

impl Material {
    /// The BSDF at `_point`.
    pub fn bsdf(&self, _point: &SurfacePoint) -> Bsdf {
        Bsdf::Lambert(Lambert { albedo: self.diffuse })
    }
}
