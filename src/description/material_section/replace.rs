use super::values::{Named, Values};
use super::{FileMaterial, Gloss, Material, MaterialSection, Source, place_of, texture};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::description::mtl::MapRequest;
use crate::description::{FileError, MapSection};
use std::path::PathBuf;
use toml::Spanned;

/// Exponent of a glossy reflection that names none.
pub(super) const DEFAULT_EXPONENT: f32 = 10.0;

impl MaterialSection {
    /// The material `name` as this section alone has it; what cannot be is an error at its key in `file`.
    pub(in crate::description) fn material(&self, name: &str, file: &Source) -> Result<FileMaterial, FileError> {
        if self.preset.is_some() {
            // Keys beside a preset change it, as those of a patch do. It has no texture to be kept.
            let found = FileMaterial {
                material: Material {
                    name: name.into(),
                    ..Material::default()
                },
                ..FileMaterial::default_of(name)
            };
            return self.patched(&found, file).map(|(found, _)| found);
        }
        let section = Named { name, file };
        let values = self.values(&section)?;
        let conductor = match (values.eta, values.k) {
            (Some(eta), Some(k)) => Some(Fresnel::Conductor { eta, k }),
            _ => None,
        };
        match (&self.eta, &self.k) {
            (Some(eta), None) => return Err(section.half_a_metal("eta", eta.span())),
            (None, Some(k)) => return Err(section.half_a_metal("k", k.span())),
            _ => {}
        }
        // Beside a texture, a constant that is left out changes nothing; a metal reflects by its own colour.
        let color =
            |given: Option<Spectrum>, is_full| given.unwrap_or(if is_full { Spectrum::ONE } else { Spectrum::ZERO });
        let has = |map: &Option<Spanned<MapSection>>| texture(map).is_some();
        let metallic = values.metallic.or(has(&self.metallic_map).then_some(1.0));
        let exponent = values.exponent.or(has(&self.exponent_map).then_some(1.0));
        let is_metal = conductor.is_some() || metallic.is_some();
        let mut material = Material {
            name: name.into(),
            diffuse: color(values.diffuse, has(&self.diffuse_map)),
            specular: color(values.specular, is_metal || has(&self.specular_map)),
            gloss: self.gloss(&section, &values, (conductor, exponent, metallic))?,
            roughness: values
                .roughness
                .unwrap_or(if has(&self.roughness_map) { 1.0 } else { 0.0 }),
            anisotropy: values.anisotropy.unwrap_or(0.0),
            anisotropy_rotation: values.anisotropy_rotation.unwrap_or(0.0),
            clearcoat: values.clearcoat.unwrap_or(0.0),
            clearcoat_roughness: values.clearcoat_roughness.unwrap_or(0.0),
            sheen: values.sheen.unwrap_or(Spectrum::ZERO),
            transmission: values.transmission.unwrap_or(Spectrum::ZERO),
            ior: values.ior.unwrap_or(Material::default().ior),
            thin: self.thin.unwrap_or(false),
            emission: values.emission.unwrap_or(Spectrum::ZERO),
            opacity: values.opacity.unwrap_or(1.0),
            ..Material::default()
        };
        material.abbe = values.abbe;
        values.set_absorption(&mut material);
        self.check_facets(&section, &material)?;
        // The scene file tells its places itself.
        Ok(FileMaterial {
            material,
            maps: self.maps(name, file)?,
            library: PathBuf::new(),
            line: 0,
            opacity_line: None,
        })
    }

    /// An error where a key speaks of facets that `material` does not have: what roughens nothing was meant otherwise.
    pub(super) fn check_facets(&self, section: &Named, material: &Material) -> Result<(), FileError> {
        if let Some(abbe) = self.abbe.as_ref().filter(|_| !material.is_dispersive()) {
            return Err(section.disperses_nothing(abbe.span()));
        }
        let has_facets = matches!(material.gloss, Gloss::Ggx(_) | Gloss::Metallic(_));
        let refracts = !material.transmission.is_black() && !material.thin;
        if has_facets || refracts {
            return Ok(());
        }
        if let Some(place) = place_of(&self.roughness, &self.roughness_map) {
            return Err(section.nothing_has("a roughness", place));
        }
        match &self.anisotropy {
            Some(anisotropy) => Err(section.nothing_has("facets", anisotropy.span())),
            None => Ok(()),
        }
    }

    /// The textures.
    fn maps(&self, name: &str, file: &Source) -> Result<Vec<MapRequest>, FileError> {
        let given = self
            .slots()
            .into_iter()
            .filter_map(|(map, slot)| texture(map).map(|map| (map, slot)));
        given
            .map(|(map, slot)| MapSection::request(map, slot, name, file))
            .collect()
    }

    fn gloss(
        &self,
        section: &Named,
        values: &Values,
        (conductor, exponent, metallic): (Option<Fresnel>, Option<f32>, Option<f32>),
    ) -> Result<Gloss, FileError> {
        let has_facets = values.roughness.is_some() || texture(&self.roughness_map).is_some() || metallic.is_some();
        let default = if has_facets { "ggx" } else { "phong" };
        let model = self.model.as_ref().map_or(default, |m| m.get_ref());
        match place_of(&self.metallic, &self.metallic_map) {
            Some(place) if model != "ggx" || conductor.is_some() => return Err(section.metallic_with_others(place)),
            _ => {}
        }
        let dielectric = values.ior.map(|eta| Fresnel::Dielectric { eta });
        let fresnel = conductor.or(dielectric).unwrap_or(Fresnel::Full);
        match (model, &self.eta, place_of(&self.exponent, &self.exponent_map)) {
            ("phong", Some(eta), _) => Err(section.fresnel_of_phong(eta.span())),
            ("phong", None, _) => Ok(Gloss::Phong(exponent.unwrap_or(DEFAULT_EXPONENT))),
            ("blinn", ..) => Ok(Gloss::Blinn(exponent.unwrap_or(DEFAULT_EXPONENT), fresnel)),
            ("ggx" | "mirror", _, Some(place)) => Err(section.exponent_of(model, place)),
            ("ggx", ..) => match metallic {
                Some(metallic) => Ok(Gloss::Metallic(metallic)),
                None => Ok(Gloss::Ggx(fresnel)),
            },
            ("mirror", _, None) => Ok(Gloss::Mirror(conductor.unwrap_or(Fresnel::Full))),
            (other, ..) => {
                let span = self.model.as_ref().map_or(0..0, Spanned::span);
                Err(section.unknown_model(other, span))
            }
        }
    }
}
