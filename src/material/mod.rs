//! What surfaces are made of, and the BSDF that makes.

mod maps;

pub use maps::{Map, Maps, Spot};

use crate::bsdf::{Blinn, Bsdf, Dielectric, Fresnel, Lambert, Lobe, Mirror, Mix, Phong, ThinSheet};
use crate::color::Spectrum;
use std::cell::OnceCell;

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
    /// Share of the surface that is there, in [0, 1]: the rest is a hole.
    pub opacity: f32,
    /// What varies over the surface.
    pub maps: Maps,
}

/// Holds the BSDF of a surface that varies, for as long as it is looked at.
pub type BsdfSlot = OnceCell<Bsdf>;

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
            opacity: 1.0,
            maps: Maps::default(),
        }
    }
}

impl Material {
    /// The BSDF of a surface that is the same all over.
    pub fn bsdf(&self) -> Bsdf {
        self.bsdf_of(self.diffuse, self.specular, self.gloss, self.transmission)
    }

    fn bsdf_of(&self, diffuse: Spectrum, specular: Spectrum, gloss: Gloss, transmission: Spectrum) -> Bsdf {
        let present = |weight: Spectrum| (!weight.is_black()).then_some(weight);
        let lobes = [
            present(diffuse).map(diffuse_lobe),
            present(specular).map(|reflectance| specular_lobe(reflectance, gloss)),
            present(transmission).map(|transmittance| self.transmission_lobe(transmittance)),
        ];
        match lobes {
            [None, None, None] => Bsdf::Single(diffuse_lobe(Spectrum::ZERO)),
            [Some(lobe), None, None] | [None, Some(lobe), None] | [None, None, Some(lobe)] => Bsdf::Single(lobe),
            _ => Bsdf::Mix(Mix::new(lobes)),
        }
    }

    /// Reflects without colour, as dielectrics do, within the energy that the mixture gives to transmission.
    fn transmission_lobe(&self, transmittance: Spectrum) -> Lobe {
        let reflectance = Spectrum::splat(transmittance.max_component());
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

fn diffuse_lobe(albedo: Spectrum) -> Lobe {
    Lobe::Lambert(Lambert { albedo })
}

fn specular_lobe(reflectance: Spectrum, gloss: Gloss) -> Lobe {
    match gloss {
        Gloss::Phong(exponent) => Lobe::Phong(Phong { reflectance, exponent }),
        Gloss::Blinn(exponent, fresnel) => Lobe::Blinn(Blinn {
            reflectance,
            exponent,
            fresnel,
        }),
        Gloss::Mirror(fresnel) => Lobe::Mirror(Mirror { reflectance, fresnel }),
    }
}
