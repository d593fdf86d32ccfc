//! Materials: what a user says of a surface, and the BSDF that follows.
//!
//! A [`Material`] holds the user's parameters. `Material::bsdf` makes lobes of its constants once, when the scene is frozen, and vertices refer to
//! that BSDF: building or copying it at every hit cost 5 % of a render. Where textures vary a material (`maps`), `Material::bsdf_at` makes another
//! BSDF for the spot. The integrator lends a slot (`BsdfSlot`) for the lifetime of the vertex. The slot holds that BSDF and its view, so that nothing is allocated.
//!
//! A shape whose normal and material are the same all over is marked plain when the scene is frozen, and takes a shorter path through
//! `World::vertex`. Anisotropic materials need a tangent, which is that of growing u, triangle by triangle; `Scene::frame` computes it for these
//! materials alone, and their surfaces are not plain.

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

/// A material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MaterialId(pub u32);

quantities! {
    /// What a surface is made of: any mixture of diffuse reflection, glossy or mirror reflection, and transmission.
    /// All colours are linear Rec.709.
    pub struct Material {
        /// Name, from MTL or the scene file.
        name: String = String::new();
        /// `kd`: diffuse reflectance; with [`Gloss::Metallic`] the base colour.
        diffuse: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// `ks`: factor of the glossy or mirror reflection.
        specular: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// How `specular` reflects.
        gloss: Gloss = Gloss::Phong(1.0);
        /// Roughness of [`Gloss::Ggx`], [`Gloss::Metallic`] and of a body's transmission: the root
        /// of the facets' `α`. 0 is smooth.
        roughness: f32 = 0.0, in SHARE;
        /// Elongation of highlights: the roughness along the tangent, over that across it, is the
        /// inverse root of `1 − 0.9 anisotropy` (Burley 2012, "Physically Based Shading at Disney").
        anisotropy: f32 = 0.0, in SHARE;
        /// Angle from ∂p/∂u to the tangent about the normal, degrees.
        anisotropy_rotation: f32 = 0.0, in Range::Any;
        /// Factor of the reflection of a layer of index 1.5 over all other lobes.
        clearcoat: f32 = 0.0, in SHARE;
        /// Roughness of that layer.
        clearcoat_roughness: f32 = 0.0, in SHARE;
        /// Factor of the light scattered by fibres between coat and base.
        sheen: Spectrum = Spectrum::ZERO, in SHARE;
        /// `kt`: factor of the transmitted light.
        transmission: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// Index of refraction behind the surface, over that before it.
        ior: f32 = 1.5, in POSITIVE;
        /// Abbe number of a body: how little the index, which is that at 587.56 nm, depends on the
        /// wavelength. `None` without dispersion.
        abbe: Option<f32> = None, in Range::AtLeast(5.0);
        /// Absorption coefficient inside a body that light enters here, per scene unit.
        absorption: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// True for a thin dielectric, which light leaves straight on, instead of the boundary of
        /// a body.
        thin: bool = false;
        /// Emitted radiance on the front side, W·sr⁻¹·m⁻². A texture replaces black, and multiplies
        /// any other colour.
        emission: Spectrum = Spectrum::ZERO, in NOT_NEGATIVE;
        /// Opacity.
        opacity: f32 = 1.0, in SHARE;
        /// False for a surface that rays from the camera pass, as if it were not there.
        camera_visible: bool = true;
        /// False for a surface that only rays from the camera meet.
        light_visible: bool = true;
        /// What varies over the surface.
        maps: Maps = Maps::default();
    }
}

/// What a clear coat, of index 1.5, reflects along the normal.
const COAT_F0: f32 = 0.04;

/// Holds the parts of a BSDF that belong to one vertex, for the lifetime of the vertex.
#[derive(Default)]
pub struct BsdfSlot<'v> {
    /// The BSDF of a surface that varies.
    pub bsdf: OnceCell<Bsdf>,
    /// A BSDF of several lobes as the viewer sees it.
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

/// The shape of a specular reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gloss {
    /// Modified Phong lobe of this exponent.
    Phong(f32),
    /// Blinn's microfacets of this exponent, which reflect by a Fresnel term.
    Blinn(f32, Fresnel),
    /// GGX microfacets of the material's roughness, which reflect by a Fresnel term.
    Ggx(Fresnel),
    /// The share of metal in a surface of the metallic-roughness model (glTF 2.0, appendix B): GGX microfacets of the
    /// material's roughness, which metal gives the base colour and the rest the reflection of its index, over a diffuse
    /// base where it is no metal.
    Metallic(f32),
    /// A perfect mirror that reflects by a Fresnel term.
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
    /// The Fresnel term of its facets or mirror.
    pub fn fresnel(self) -> Fresnel {
        match self {
            Self::Blinn(_, fresnel) | Self::Ggx(fresnel) | Self::Mirror(fresnel) => fresnel,
            Self::Phong(_) | Self::Metallic(_) => Fresnel::Full,
        }
    }
}

impl Material {
    /// A surface of the metallic-roughness model, whose index of refraction is 1.5 where it is no metal. `metallic` and
    /// `roughness` lie in [0, 1].
    pub fn metallic_roughness(base: Spectrum, metallic: f32, roughness: f32) -> Self {
        Self {
            diffuse: base,
            specular: Spectrum::ONE,
            gloss: Gloss::Metallic(metallic),
            roughness,
            ..Self::default()
        }
    }

    /// Radiance of the front side, or what its texture is multiplied by: a texture without a constant is not multiplied.
    pub fn emission_factor(&self) -> Spectrum {
        match self.maps.emission {
            Some(_) if self.emission.is_black() => Spectrum::ONE,
            _ => self.emission,
        }
    }

    /// The most that is scattered of any channel's light. A coat and the base below it share what there is.
    pub fn scattered(&self) -> f32 {
        let reflected = match self.gloss {
            Gloss::Metallic(_) => self.diffuse.max(self.specular),
            _ => self.diffuse + self.specular,
        };
        (reflected + self.transmission).max_component()
    }

    /// Divides all lobes by their sum, where it is above 1.
    pub(crate) fn scale_to_one(&mut self) {
        let scattered = self.scattered();
        if scattered > 1.0 {
            self.diffuse = self.diffuse / scattered;
            self.specular = self.specular / scattered;
            self.transmission = self.transmission / scattered;
        }
    }

    /// Returns true if light passes the surface, or comes from it.
    pub fn emits_or_transmits(&self) -> bool {
        self.opacity < 1.0 || !self.transmission.is_black() || !self.emission.is_black()
    }

    /// The BSDF of a surface that is the same all over.
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

    /// The lobes below sheen and coat: diffuse, glossy or mirror-like, transmitting.
    fn base_lobes(&self) -> [Option<Lobe>; 3] {
        let present = |weight: Spectrum| !weight.is_black();
        [
            present(self.diffuse_reflectance()).then(|| self.diffuse_lobe()),
            present(self.specular).then(|| self.specular_lobe()),
            present(self.transmission).then(|| self.transmission_lobe()),
        ]
    }

    /// Whether a lobe has the material's `roughness`.
    pub fn uses_roughness(&self) -> bool {
        self.base_lobes().iter().flatten().any(Lobe::has_roughness)
    }

    /// The share that is no metal reflects diffusely.
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
            // Facets too smooth for their formulas are a mirror.
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

    /// `α` of the facets (Burley 2012, "Physically Based Shading at Disney").
    fn alpha(&self) -> f32 {
        self.roughness * self.roughness
    }

    /// `α` of the facets along the tangent and across it.
    fn slopes(&self) -> Vec2 {
        if !self.is_anisotropic() {
            return Vec2::splat(self.alpha());
        }
        let aspect = (1.0 - 0.9 * self.anisotropy).sqrt();
        self.alpha() * Vec2::new(1.0 / aspect, aspect)
    }

    /// Whether it matters how the surface is turned about its normal.
    pub fn is_anisotropic(&self) -> bool {
        self.anisotropy > 0.0
    }

    /// Absorption coefficient of the body behind the surface, if there is one.
    pub fn absorption_of_body(&self) -> Spectrum {
        if self.thin || self.transmission.is_black() {
            Spectrum::ZERO
        } else {
            self.absorption
        }
    }

    /// What a dielectric of this index reflects along the normal.
    fn f0(&self) -> f32 {
        ((self.ior - 1.0) / (self.ior + 1.0)).powi(2)
    }

    /// Reflects without colour, as dielectrics do, within the energy that the mixture gives to transmission.
    fn transmission_lobe(&self) -> Lobe {
        let (reflectance, transmittance) = (Spectrum::splat(self.transmission.max_component()), self.transmission);
        let ior = self.ior;
        // Refraction spreads less than the facets where the index hardly changes.
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
