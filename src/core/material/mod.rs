//! Materials: the user's parameters of a surface, and the resulting BSDF.
//!
//! A [`Material`] holds the user's parameters. `Material::bsdf` computes lobes from the constants
//! of the material once, when the scene is built. Vertices refer to this BSDF, because building or
//! copying a BSDF at every hit cost 5 % of a render. If textures vary a material (`maps`),
//! `Material::bsdf_at` builds a BSDF for each point. The integrator provides a slot (`BsdfSlot`)
//! for this BSDF and its view while it uses the vertex, so that nothing is allocated.
//!
//! A shape with constant normal and material is marked plain when the scene is built.
//! `World::vertex` has shorter code for plain shapes. Shapes of anisotropic materials are not
//! plain. They need a tangent, which is the direction of u on each triangle. `Scene::frame`
//! computes tangents for these materials only.

mod dispersion;
mod maps;
mod quantities;
mod thin_surface;

pub use maps::{Map, Maps, Spot};
pub use quantities::{Quantity, range_of};
pub use thin_surface::ThinSurface;

use crate::bsdf::{
    Blinn, Bsdf, BsdfView, CoatedLambert, Dielectric, Fresnel, Lambert, Layered, Lobe, MIN_ALPHA, Mirror, Mix, Phong,
    RoughConductor, RoughDielectric, Sheen, ThinDielectric,
};
use crate::color::Spectrum;
use crate::math::{Vec2, encode_variants, rounded};
use crate::parameter::Range;
use quantities::{NOT_NEGATIVE, POSITIVE, SHARE, quantities};
use std::cell::OnceCell;
use std::fmt;

/// Index of a material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct MaterialId(pub u32);

quantities! {
    /// Material of a surface: any mixture of diffuse reflection, glossy or mirror reflection, and
    /// transmission. All colours are linear Rec.709.
    pub struct Material {
        /// Name, from MTL or the scene file.
        name: String = String::new();
        /// `kd`: diffuse reflectance; with [`Gloss::Metallic`] the base colour.
        diffuse: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// `ks`: factor of the glossy or mirror reflection.
        specular: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// Shape of the reflection of `specular`.
        gloss: Gloss = Gloss::Phong(1.0);
        /// Roughness of [`Gloss::Ggx`], [`Gloss::Metallic`] and of transmission into a body: the
        /// square root of the facets' `α`. 0 is smooth.
        roughness: f32 = 0.0, in SHARE;
        /// Elongation of highlights. The roughness along the tangent, divided by the roughness
        /// across it, is the inverse square root of `1 − 0.9 anisotropy` (Burley 2012, "Physically
        /// Based Shading at Disney").
        anisotropy: f32 = 0.0, in SHARE;
        /// Angle from ∂p/∂u to the tangent in degrees, counter-clockwise around the normal.
        anisotropy_rotation: f32 = 0.0, in Range::Any;
        /// Factor of the reflection of the clear coat, a layer of index 1.5 over all other lobes.
        clearcoat: f32 = 0.0, in SHARE;
        /// Roughness of the clear coat.
        clearcoat_roughness: f32 = 0.0, in SHARE;
        /// Factor of the light scattered by fibres between coat and base.
        sheen: Spectrum = Spectrum::ZERO, in SHARE;
        /// `kt`: factor of the transmitted light.
        transmission: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// Index of refraction behind the surface, relative to the front.
        ior: f32 = 1.5, in POSITIVE;
        /// Abbe number of a body: a high number means that the index, given at 587.56 nm, depends
        /// little on the wavelength. `None` without dispersion.
        abbe: Option<f32> = None, in Range::AtLeast(5.0);
        /// Absorption coefficient inside the body behind the surface, per scene unit.
        absorption: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// True for a thin dielectric, which transmits light without refraction, instead of the
        /// boundary of a body.
        thin: bool = false;
        /// Emitted radiance on the front side, W·sr⁻¹·m⁻². An emission texture multiplies this
        /// radiance. If the constant is black, only the texture is used.
        emission: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// Opacity, 0 to 1.
        opacity: f32 = 1.0, in SHARE;
        /// False for a surface that camera rays pass through without a hit.
        camera_visible: bool = true;
        /// False for a surface that only camera rays hit.
        light_visible: bool = true;
        /// Textures that vary the material over the surface.
        maps: Maps = Maps::default();
    }
}

/// Reflectance of a clear coat of index 1.5 along the normal.
const COAT_F0: f32 = 0.04;

/// Storage for the BSDF of one vertex, and for the view of this BSDF.
#[derive(Default)]
pub struct BsdfSlot<'v> {
    /// BSDF at the vertex, if the material varies over the surface.
    pub bsdf: OnceCell<Bsdf>,
    /// View of a BSDF with several lobes, for the direction from the vertex to the viewer.
    pub view: OnceCell<BsdfView<'v>>,
}

impl BsdfSlot<'_> {
    /// An empty slot.
    pub const fn new() -> Self {
        Self {
            bsdf: OnceCell::new(),
            view: OnceCell::new(),
        }
    }
}

/// Shape of a specular reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// Modified Phong lobe with this exponent.
    Phong(f32),
    /// Blinn's microfacets with this exponent and a Fresnel term.
    Blinn(f32, Fresnel),
    /// GGX microfacets with the material's roughness and a Fresnel term.
    Ggx(Fresnel),
    /// Metallic-roughness model (glTF 2.0, appendix B) with this fraction of metal: GGX microfacets
    /// with the material's roughness. The metal part reflects with the base colour. The dielectric
    /// part has a diffuse base under a reflection by the index of refraction.
    Metallic(f32),
    /// Perfect mirror with a Fresnel term.
    Mirror(Fresnel),
}

impl fmt::Display for Gloss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Phong(exponent) => write!(f, "Phong, exponent {}", rounded((*exponent).into())),
            Self::Blinn(exponent, fresnel) => {
                write!(
                    f,
                    "Blinn microfacets, exponent {}, {fresnel}",
                    rounded((*exponent).into())
                )
            }
            Self::Ggx(fresnel) => write!(f, "GGX microfacets, {fresnel}"),
            Self::Metallic(share) => write!(f, "metallic-roughness model, metallic {}", rounded((*share).into())),
            Self::Mirror(fresnel) => write!(f, "mirror, {fresnel}"),
        }
    }
}

encode_variants!(Gloss {
    0 => Phong(exponent),
    1 => Blinn(exponent, fresnel),
    2 => Ggx(fresnel),
    3 => Metallic(share),
    4 => Mirror(fresnel),
});

impl Gloss {
    /// Fresnel term of the facets or the mirror.
    pub fn fresnel(self) -> Fresnel {
        match self {
            Self::Blinn(_, fresnel) | Self::Ggx(fresnel) | Self::Mirror(fresnel) => fresnel,
            Self::Phong(_) | Self::Metallic(_) => Fresnel::Full,
        }
    }
}

impl Material {
    /// Material of the metallic-roughness model. The index of refraction of the dielectric part is
    /// 1.5. `metallic` and `roughness` are in [0, 1].
    pub fn metallic_roughness(base: Spectrum, metallic: f32, roughness: f32) -> Self {
        Self {
            diffuse: base,
            specular: Spectrum::ONE,
            gloss: Gloss::Metallic(metallic),
            roughness,
            ..Self::default()
        }
    }

    /// Radiance that the front side emits. With an emission texture, it is the factor of the
    /// texture, which is 1 if the constant `emission` is black.
    pub fn emission_factor(&self) -> Spectrum {
        match self.maps.emission {
            Some(_) if self.emission.is_black() => Spectrum::ONE,
            _ => self.emission,
        }
    }

    /// Fraction of the light that the material scatters: the maximum over the channels. With
    /// [`Gloss::Metallic`], the base gets only the light that the reflection above it transmits, so
    /// the larger of the two factors counts instead of their sum.
    pub fn scattered(&self) -> f32 {
        let reflected = match self.gloss {
            Gloss::Metallic(_) => self.diffuse.max(self.specular),
            _ => self.diffuse + self.specular,
        };
        (reflected + self.transmission).max_component()
    }

    /// If the material scatters more than all light, divides the factors of all lobes by
    /// [`Material::scattered`].
    pub(crate) fn scale_to_one(&mut self) {
        let scattered = self.scattered();
        if scattered > 1.0 {
            self.diffuse = self.diffuse / scattered;
            self.specular = self.specular / scattered;
            self.transmission = self.transmission / scattered;
        }
    }

    /// Returns true if the surface transmits or emits light.
    pub fn emits_or_transmits(&self) -> bool {
        self.opacity < 1.0 || !self.transmission.is_black() || !self.emission.is_black()
    }

    /// BSDF of the material's constants, without its textures.
    pub fn bsdf(&self) -> Bsdf {
        let lobes = self.base_lobes();
        if self.clearcoat > 0.0 || !self.sheen.is_black() {
            let sheen = (!self.sheen.is_black()).then_some(Sheen { color: self.sheen });
            return Bsdf::Layered(Layered::new(lobes, sheen, self.coat_lobe()));
        }
        match lobes {
            [None, None, None] => Bsdf::Single(self.diffuse_lobe()),
            [Some(lobe), None, None] | [None, Some(lobe), None] | [None, None, Some(lobe)] if !lobe.has_parts() => {
                Bsdf::Single(lobe)
            }
            _ => Bsdf::Mix(Mix::new(lobes)),
        }
    }

    /// Lobes below sheen and coat: diffuse, glossy or mirror-like, transmitting.
    fn base_lobes(&self) -> [Option<Lobe>; 3] {
        let present = |weight: Spectrum| !weight.is_black();
        [
            present(self.diffuse_reflectance()).then(|| self.diffuse_lobe()),
            present(self.specular).then(|| self.specular_lobe()),
            present(self.transmission).then(|| self.transmission_lobe()),
        ]
    }

    /// Returns true if a lobe uses the material's `roughness`.
    pub fn uses_roughness(&self) -> bool {
        self.base_lobes().iter().flatten().any(Lobe::has_roughness)
    }

    /// Diffuse reflectance. With [`Gloss::Metallic`], only the dielectric part reflects diffusely.
    fn diffuse_reflectance(&self) -> Spectrum {
        match self.gloss {
            Gloss::Metallic(metallic) => self.diffuse * (1.0 - metallic),
            _ => self.diffuse,
        }
    }

    fn diffuse_lobe(&self) -> Lobe {
        let albedo = self.diffuse_reflectance();
        match self.gloss {
            Gloss::Metallic(_) if !self.specular.is_black() => {
                Lobe::CoatedLambert(CoatedLambert::new(albedo, self.alpha(), self.f0()))
            }
            _ => Lobe::Lambert(Lambert { albedo }),
        }
    }

    fn specular_lobe(&self) -> Lobe {
        let (reflectance, alpha) = (self.specular, self.slopes());
        match self.gloss {
            Gloss::Phong(exponent) => Lobe::Phong(Phong { reflectance, exponent }),
            Gloss::Blinn(exponent, fresnel) => Lobe::Blinn(Blinn {
                reflectance,
                exponent,
                fresnel,
            }),
            Gloss::Mirror(fresnel) => Lobe::Mirror(Mirror { reflectance, fresnel }),
            // If `α` is too small for the formulas of microfacets, the lobe is a mirror.
            Gloss::Ggx(fresnel) if self.alpha() < MIN_ALPHA => Lobe::Mirror(Mirror { reflectance, fresnel }),
            Gloss::Ggx(fresnel) => Lobe::RoughConductor(RoughConductor::new(reflectance, alpha, fresnel)),
            Gloss::Metallic(metallic) if self.alpha() < MIN_ALPHA => {
                let f0 = self.diffuse * metallic + Spectrum::splat(self.f0() * (1.0 - metallic));
                let fresnel = Fresnel::Schlick { f0: f0.to_array() };
                Lobe::Mirror(Mirror { reflectance, fresnel })
            }
            Gloss::Metallic(metallic) => {
                let lobe = RoughConductor::metallic(reflectance, alpha, self.diffuse, self.f0(), metallic);
                Lobe::RoughConductor(lobe)
            }
        }
    }

    fn coat_lobe(&self) -> Option<Lobe> {
        let reflectance = Spectrum::splat(self.clearcoat);
        let fresnel = Fresnel::Schlick { f0: [COAT_F0; 3] };
        let alpha = self.clearcoat_roughness * self.clearcoat_roughness;
        (self.clearcoat > 0.0).then(|| {
            if alpha < MIN_ALPHA {
                Lobe::Mirror(Mirror { reflectance, fresnel })
            } else {
                Lobe::RoughConductor(RoughConductor::new(reflectance, Vec2::splat(alpha), fresnel))
            }
        })
    }

    /// Width `α` of the facets' distribution: the square of the roughness (Burley 2012, "Physically
    /// Based Shading at Disney").
    fn alpha(&self) -> f32 {
        self.roughness * self.roughness
    }

    /// Width `α` of the facets' distribution along the tangent, and across the tangent.
    fn slopes(&self) -> Vec2 {
        if !self.is_anisotropic() {
            return Vec2::splat(self.alpha());
        }
        let aspect = (1.0 - 0.9 * self.anisotropy).sqrt();
        self.alpha() * Vec2::new(1.0 / aspect, aspect)
    }

    /// Returns true if the BSDF changes when the surface is rotated around its normal.
    pub fn is_anisotropic(&self) -> bool {
        self.anisotropy > 0.0
    }

    /// Absorption coefficient of the body behind the surface; zero if there is none.
    pub fn absorption_of_body(&self) -> Spectrum {
        if self.thin || self.transmission.is_black() {
            Spectrum::ZERO
        } else {
            self.absorption
        }
    }

    /// Reflectance along the normal of a dielectric with the material's index of refraction.
    fn f0(&self) -> f32 {
        ((self.ior - 1.0) / (self.ior + 1.0)).powi(2)
    }

    /// Lobe of the transmitted light. As a dielectric, the lobe also reflects light, without
    /// colour. The factor of the reflection is the largest channel of the transmission.
    fn transmission_lobe(&self) -> Lobe {
        let (reflectance, transmittance) = (Spectrum::splat(self.transmission.max_component()), self.transmission);
        let ior = self.ior;
        // Effective width of the lobe. If the index of refraction is close to 1, refraction spreads
        // light less than the slopes of the facets suggest.
        let spread = self.alpha() * (ior - 1.0).abs().min(1.0);
        if self.thin {
            Lobe::ThinDielectric(ThinDielectric {
                reflectance,
                transmittance,
                ior,
            })
        } else if spread >= MIN_ALPHA {
            Lobe::RoughDielectric(RoughDielectric::new(reflectance, transmittance, self.slopes(), ior))
        } else {
            Lobe::Dielectric(Dielectric {
                reflectance,
                transmittance,
                ior,
            })
        }
    }
}
