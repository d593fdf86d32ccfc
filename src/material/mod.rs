//! What surfaces are made of, and the BSDF that makes.

use crate::bsdf::{Blinn, Bsdf, Dielectric, Fresnel, Lambert, Lobe, Mirror, Mix, Phong, ThinSheet};
use crate::color::Spectrum;

/// A material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

/// What a surface is made of: any mixture of diffuse reflection, glossy or mirror reflection, and transmission.
/// All colours are linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name, from MTL or the scene file.
    pub name: String,
    /// `kd`: diffuse reflectance, each channel in [0, 1].
    pub diffuse: Spectrum,
    /// `ks`: factor of the glossy or mirror reflection.
    pub specular: Spectrum,
    /// How `specular` reflects.
    pub gloss: Gloss,
    /// `kt`: factor of what passes the surface.
    pub transmission: Spectrum,
    /// Index of refraction behind the surface, over that before it.
    pub ior: f32,
    /// Whether the surface is a thin sheet, which light leaves straight on, instead of the boundary of a body.
    pub thin: bool,
    /// Emitted radiance on the front side, W·sr⁻¹·m⁻².
    pub emission: Spectrum,
}

/// The shape of a specular reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// Modified Phong lobe of this exponent.
    Phong(f32),
    /// Blinn's microfacets of this exponent, which reflect by a Fresnel term.
    Blinn(f32, Fresnel),
    /// A perfect mirror that reflects by a Fresnel term.
    Mirror(Fresnel),
}

impl Default for Material {
    /// A black surface.
    fn default() -> Self {
        Self {
            name: String::new(),
            diffuse: Spectrum::ZERO,
            specular: Spectrum::ZERO,
            gloss: Gloss::Phong(1.0),
            transmission: Spectrum::ZERO,
            ior: 1.5,
            thin: false,
            emission: Spectrum::ZERO,
        }
    }
}

impl Material {
    /// The BSDF, which is the same all over the surface.
    pub fn bsdf(&self) -> Bsdf {
        let present = |weight: Spectrum| (!weight.is_black()).then_some(weight);
        let lobes = [
            present(self.diffuse).map(|_| self.diffuse_lobe()),
            present(self.specular).map(|_| self.specular_lobe()),
            present(self.transmission).map(|_| self.transmission_lobe()),
        ];
        match lobes {
            [None, None, None] => Bsdf::Single(self.diffuse_lobe()),
            [Some(lobe), None, None] | [None, Some(lobe), None] | [None, None, Some(lobe)] => Bsdf::Single(lobe),
            _ => Bsdf::Mix(Mix::new(lobes)),
        }
    }

    fn diffuse_lobe(&self) -> Lobe {
        Lobe::Lambert(Lambert { albedo: self.diffuse })
    }

    fn specular_lobe(&self) -> Lobe {
        let reflectance = self.specular;
        match self.gloss {
            Gloss::Phong(exponent) => Lobe::Phong(Phong { reflectance, exponent }),
            Gloss::Blinn(exponent, fresnel) => Lobe::Blinn(Blinn {
                reflectance,
                exponent,
                fresnel,
            }),
            Gloss::Mirror(fresnel) => Lobe::Mirror(Mirror { reflectance, fresnel }),
        }
    }

    /// Reflects without colour, as dielectrics do, within the energy that the mixture gives to transmission.
    fn transmission_lobe(&self) -> Lobe {
        let (reflectance, transmittance) = (Spectrum::splat(self.transmission.max_component()), self.transmission);
        let ior = self.ior;
        if self.thin {
            Lobe::ThinSheet(ThinSheet {
                reflectance,
                transmittance,
                ior,
            })
        } else {
            Lobe::Dielectric(Dielectric {
                reflectance,
                transmittance,
                ior,
            })
        }
    }
}
