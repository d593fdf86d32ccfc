//! A material as the section that says it: of each key what it is, where that has a meaning for the material. To patch the material with this section changes
//! nothing.

use super::{ChannelValues, ColorValue, FileMaterial, Gloss, MapSection, MaterialSection};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::description::mtl::{MapRequest, MapSlot};
#[cfg(feature = "view")]
use crate::material::Material;
use std::path::PathBuf;
use toml::Spanned;

/// A value without a place.
fn said<T>(value: T) -> Option<Spanned<T>> {
    Some(Spanned::new(0..0, value))
}

fn color(color: Spectrum) -> Option<Spanned<ColorValue>> {
    said(ColorValue(color.to_array()))
}

impl MaterialSection {
    /// The section of a material of a scene, without its textures.
    #[cfg(feature = "view")]
    pub(crate) fn of_material(material: &Material) -> Self {
        let found = FileMaterial {
            material: material.clone(),
            ..FileMaterial::default_of(&material.name)
        };
        Self::of(&found, &|_| None)
    }

    /// The section of `found`. `path` names the file of each texture; `None` leaves the texture out.
    pub(in crate::description) fn of(found: &FileMaterial, path: &dyn Fn(&MapRequest) -> Option<PathBuf>) -> Self {
        let (material, has) = (&found.material, |slot| found.has_map(slot));
        let reflects = !material.specular.is_black() || has(MapSlot::Specular);
        let refracts = !material.transmission.is_black();
        let mut section = Self {
            diffuse: color(material.diffuse),
            specular: color(material.specular),
            ..Self::default()
        };
        let model = |name: &str| if reflects { said(name.to_string()) } else { None };
        let fresnel = match material.gloss {
            Gloss::Phong(exponent) => {
                section.model = model("phong");
                section.exponent = said(exponent).filter(|_| reflects || has(MapSlot::Exponent));
                Fresnel::Full
            }
            Gloss::Blinn(exponent, fresnel) => {
                section.model = model("blinn");
                section.exponent = said(exponent).filter(|_| reflects || has(MapSlot::Exponent));
                fresnel
            }
            Gloss::Ggx(fresnel) => {
                section.model = said("ggx".to_string());
                fresnel
            }
            Gloss::Metallic(share) => {
                section.metallic = said(share);
                section.ior = said(material.ior);
                Fresnel::Full
            }
            Gloss::Mirror(fresnel) => {
                section.model = model("mirror");
                fresnel
            }
        };
        let has_facets = matches!(material.gloss, Gloss::Ggx(_) | Gloss::Metallic(_));
        if has_facets || (refracts && !material.thin && (material.roughness > 0.0 || has(MapSlot::Roughness))) {
            section.roughness = said(material.roughness);
            if material.anisotropy > 0.0 {
                section.anisotropy = said(material.anisotropy);
                section.anisotropy_rotation = said(material.anisotropy_rotation);
            }
        }
        match fresnel {
            Fresnel::Conductor { eta, k } => {
                section.eta = said(ChannelValues(eta));
                section.k = said(ChannelValues(k));
            }
            Fresnel::Dielectric { eta } => section.ior = said(eta),
            Fresnel::Full | Fresnel::Schlick { .. } => {}
        }
        if refracts {
            section.transmission = color(material.transmission);
            section.thin = material.thin.then_some(true);
            section.abbe = material.abbe.and_then(said).filter(|_| material.is_dispersive());
            if !material.absorption.is_black() {
                section.absorption = said(ChannelValues(material.absorption.to_array()));
            }
            // An index would give facets a Fresnel term that they do not have.
            if !matches!(material.gloss, Gloss::Ggx(_) | Gloss::Blinn(..)) {
                section.ior = said(material.ior);
            }
        }
        if material.clearcoat > 0.0 {
            section.clearcoat = said(material.clearcoat);
            section.clearcoat_roughness = said(material.clearcoat_roughness);
        }
        if !material.sheen.is_black() {
            section.sheen = color(material.sheen);
        }
        if !material.emission.is_black() {
            section.emission = color(material.emission);
        }
        if material.opacity < 1.0 {
            section.opacity = said(material.opacity);
        }
        for request in &found.maps {
            let Some(file) = path(request) else { continue };
            let map = said(MapSection::of(file, &request.statement.mapping));
            *match request.statement.slot {
                MapSlot::Diffuse => &mut section.diffuse_map,
                MapSlot::Specular => &mut section.specular_map,
                MapSlot::Emission => &mut section.emission_map,
                MapSlot::Exponent => &mut section.exponent_map,
                MapSlot::Roughness => &mut section.roughness_map,
                MapSlot::Metallic => &mut section.metallic_map,
                MapSlot::Opacity => &mut section.opacity_map,
                MapSlot::Bump => &mut section.bump_map,
                MapSlot::Normal => &mut section.normal_map,
            } = map;
        }
        section
    }
}
