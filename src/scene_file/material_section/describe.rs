//! Writes a material as a section with all keys that apply to the material. A patch of a material
//! by the section that was written for it changes nothing.

use super::{ChannelValues, ColorValue, FileMaterial, Gloss, MapSection, MaterialSection, fields};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::material::Material;
use crate::scene_file::TextureSection;
use crate::scene_file::mtl::{MapRequest, MapSlot};
use std::path::PathBuf;
use toml::Spanned;

/// A value without a place in a file.
fn spanned<T>(value: T) -> Option<Spanned<T>> {
    Some(Spanned::new(0..0, value))
}

impl From<Spectrum> for ColorValue {
    fn from(color: Spectrum) -> Self {
        Self(color.to_array())
    }
}

impl From<Spectrum> for ChannelValues {
    fn from(channels: Spectrum) -> Self {
        Self(channels.to_array())
    }
}

impl MaterialSection {
    /// Section of a material of a scene, without textures.
    #[cfg(feature = "view")]
    pub(crate) fn of_material(material: &Material) -> Self {
        let found = FileMaterial {
            material: material.clone(),
            ..FileMaterial::default_of(&material.name)
        };
        Self::of(&found, &|_| None)
    }

    /// Section of the material `found`. `path` returns the file of each texture. If `path` returns
    /// `None`, the texture is left out.
    pub(in crate::scene_file) fn of(found: &FileMaterial, path: &dyn Fn(&MapRequest) -> Option<PathBuf>) -> Self {
        let (material, has) = (&found.material, |slot| found.has_map(slot));
        let reflects = !material.specular.is_black() || has(MapSlot::Specular);
        let refracts = !material.transmission.is_black();
        // Write fields that differ from the fields of a black surface, and always `diffuse` and
        // `specular`
        let (mut section, black) = (Self::default(), Material::default());
        macro_rules! say {
            ($($key:ident),+) => {
                $(if material.$key != black.$key {
                    section.$key = spanned(material.$key.clone().into());
                })+
            };
        }
        fields!(say);
        section.diffuse = spanned(material.diffuse.into());
        section.specular = spanned(material.specular.into());
        section.ior = None;
        let model = |name: &str| if reflects { spanned(name.to_string()) } else { None };
        let fresnel = match material.gloss {
            Gloss::Phong(exponent) => {
                section.model = model("phong");
                section.exponent = spanned(exponent).filter(|_| reflects || has(MapSlot::Exponent));
                Fresnel::Full
            }
            Gloss::Blinn(exponent, fresnel) => {
                section.model = model("blinn");
                section.exponent = spanned(exponent).filter(|_| reflects || has(MapSlot::Exponent));
                fresnel
            }
            Gloss::Ggx(fresnel) => {
                section.model = spanned("ggx".to_string());
                fresnel
            }
            Gloss::Metallic(share) => {
                section.metallic = spanned(share);
                section.ior = spanned(material.ior);
                Fresnel::Full
            }
            Gloss::Mirror(fresnel) => {
                section.model = model("mirror");
                fresnel
            }
        };
        let has_facets = matches!(material.gloss, Gloss::Ggx(_) | Gloss::Metallic(_));
        if has_facets || (refracts && !material.thin && (material.roughness > 0.0 || has(MapSlot::Roughness))) {
            section.roughness = spanned(material.roughness);
        } else {
            (section.roughness, section.anisotropy) = (None, None);
        }
        match fresnel {
            Fresnel::Conductor { eta, k } => {
                section.eta = spanned(ChannelValues(eta));
                section.k = spanned(ChannelValues(k));
            }
            Fresnel::Dielectric { eta } => section.ior = spanned(eta),
            Fresnel::Full | Fresnel::Schlick { .. } => {}
        }
        section.abbe = material.abbe.and_then(spanned).filter(|_| material.is_dispersive());
        if refracts {
            // Leave out `ior` for GGX and Blinn lobes: the key would add a Fresnel term to the lobe
            if !matches!(material.gloss, Gloss::Ggx(_) | Gloss::Blinn(..)) {
                section.ior = spanned(material.ior);
            }
        } else {
            (section.thin, section.absorption) = (None, None);
        }
        for request in &found.maps {
            let Some(file) = path(request) else { continue };
            let map = spanned(MapSection::Texture(Box::new(TextureSection::of(
                file,
                &request.statement.mapping,
            ))));
            let slot = request.statement.slot;
            section
                .maps_mut()
                .into_iter()
                .filter(|(known, _)| *known == slot)
                .for_each(|(_, key)| *key = map.clone());
        }
        section
    }
}
