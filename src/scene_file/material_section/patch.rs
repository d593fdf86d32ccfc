//! Patches: changes of a material by the keys of a section. All other properties are kept.
//!
//! A key of another reflection model also changes the model. `roughness` and `anisotropy` turn a
//! Phong or Blinn lobe, or a mirror, into GGX microfacets. `eta` and `k` make a metal, and
//! `metallic` makes the metallic-roughness model. Properties that both models have keep their
//! values.

use super::mistakes::NamedMaterial;
use super::{FileMaterial, Gloss, Material, MaterialSection, Source, fields, place_of, texture};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::scene_file::mtl::MapSlot;
use crate::scene_file::section::value;
use crate::scene_file::{ChannelValues, ColorValue, FileError, MapSection};
use toml::Spanned;

/// Default exponent of a glossy reflection.
const DEFAULT_EXPONENT: f32 = 10.0;

/// Minimum transmittance at the absorption depth. A transmittance of 0 has no finite absorption
/// coefficient.
const MIN_TRANSMISSION: f32 = 1e-6;

impl From<ColorValue> for Spectrum {
    fn from(color: ColorValue) -> Self {
        color.0.into()
    }
}

impl From<ChannelValues> for Spectrum {
    fn from(channels: ChannelValues) -> Self {
        channels.0.into()
    }
}

impl MaterialSection {
    /// Material `name` that only this section defines: a black material that is patched.
    pub(in crate::scene_file) fn material(&self, name: &str, file: &Source) -> Result<FileMaterial, FileError> {
        let black = |gloss| FileMaterial {
            material: Material {
                name: name.into(),
                gloss,
                ..Material::default()
            },
            ..FileMaterial::default_of(name)
        };
        if self.preset.is_some() {
            return Ok(self.patched(&black(Gloss::Phong(1.0)), file)?.0);
        }
        let has_facets = place_of(&self.roughness, &self.roughness_map).is_some()
            || place_of(&self.metallic, &self.metallic_map).is_some();
        let mut section = self.clone();
        section.model.get_or_insert_with(|| {
            let model = if has_facets { "ggx" } else { "phong" };
            Spanned::new(0..0, model.into())
        });
        Ok(section.patched(&black(Gloss::Ggx(Fresnel::Full)), file)?.0)
    }

    /// `base` changed by the keys of the section, and a warning if the keys have no visible effect.
    /// If a key is invalid, the error points to it in `file`.
    pub(in crate::scene_file) fn patched(
        &self,
        base: &FileMaterial,
        file: &Source,
    ) -> Result<(FileMaterial, Option<FileError>), FileError> {
        let name = base.material.name.as_str();
        let section = NamedMaterial { name, file };
        section.check(self)?;
        let base = &*self.preset_over(base, file)?;
        let mut patched = base.clone();
        let material = &mut patched.material;

        // Set keys that do not depend on other keys
        macro_rules! set {
            ($($key:ident),+) => {
                $(if let Some(value) = value(&self.$key) {
                    material.$key = value.into();
                })+
            };
        }
        fields!(set);
        material.abbe = value(&self.abbe).or(material.abbe);
        self.set_absorption_depth(material);
        if self.opacity.is_some() {
            patched.opacity = None;
        }

        // Apply keys that decide the reflection model
        let has_share = matches!(base.material.gloss, Gloss::Metallic(_)) && base.has_map(MapSlot::Metallic);
        let is_new_map = texture(&self.metallic_map).is_some() && !has_share;
        let metallic = value(&self.metallic).or(is_new_map.then_some(1.0));
        let gloss = self.patched_gloss(&section, metallic, base, material)?;
        self.change_model(gloss, material);
        self.check_facets(&section, material)?;

        // Set textures
        for (map, slot) in self.slots() {
            let Some(map) = map else { continue };
            let had = base.has_map(slot);
            patched.maps.retain(|request| request.statement.slot != slot);
            let MapSection::Texture(texture) = map.get_ref() else {
                continue;
            };
            patched.maps.push(texture.request(map.span(), slot, name, file)?);
            if !had {
                self.unlock(&mut patched.material, slot);
            }
        }
        let gloss = patched.material.gloss;
        patched.maps.retain(|request| match request.statement.slot {
            MapSlot::Exponent => matches!(gloss, Gloss::Phong(_) | Gloss::Blinn(..)),
            MapSlot::Metallic => matches!(gloss, Gloss::Metallic(_)),
            _ => true,
        });

        let warning = self.idle_roughness(&section, &patched);
        Ok((patched, warning))
    }

    /// Reflection model of the patched material: the model of `base`, changed by the keys of the
    /// section that choose a model, such as `model`, `exponent` and `metallic`. `material` already
    /// has the values of the other keys of the section.
    fn patched_gloss(
        &self,
        section: &NamedMaterial,
        metallic: Option<f32>,
        base: &FileMaterial,
        material: &Material,
    ) -> Result<Gloss, FileError> {
        let was = base.material.gloss;
        let (own_model, own_exponent, own_fresnel) = match was {
            Gloss::Phong(exponent) => ("phong", Some(exponent), Fresnel::Full),
            Gloss::Blinn(exponent, fresnel) => ("blinn", Some(exponent), fresnel),
            Gloss::Ggx(fresnel) => ("ggx", None, fresnel),
            Gloss::Metallic(_) => ("ggx", None, Fresnel::Full),
            Gloss::Mirror(fresnel) => ("mirror", None, fresnel),
        };
        let metal_place = self.eta.as_ref().or(self.k.as_ref()).map(Spanned::span);
        let metallic_place = place_of(&self.metallic, &self.metallic_map);
        let is_roughened = place_of(&self.roughness, &self.roughness_map).is_some() || self.anisotropy.is_some();
        // If glass has no reflection model, roughness applies to its refraction
        let reflects =
            !material.specular.is_black() || base.has_map(MapSlot::Specular) || texture(&self.specular_map).is_some();
        let refracts = !material.transmission.is_black() && !material.thin;
        let model = match &self.model {
            Some(model) => model.get_ref().as_str(),
            None if metallic_place.is_some() => "ggx",
            None if metal_place.is_some() && own_model == "phong" => "ggx",
            None if is_roughened && (reflects || !refracts) => "ggx",
            None => own_model,
        };
        if let Some(place) = metallic_place.filter(|_| model != "ggx" || metal_place.is_some()) {
            return Err(section.metallic_with_others(place));
        }
        let exponent = match (value(&self.exponent), texture(&self.exponent_map)) {
            (Some(exponent), _) => exponent,
            (None, Some(_)) if !base.has_map(MapSlot::Exponent) => 1.0,
            (None, _) => own_exponent.unwrap_or(DEFAULT_EXPONENT),
        };
        let fresnel = match (self.conductor(section, own_fresnel)?, own_fresnel, value(&self.ior)) {
            (Some(conductor), ..) => conductor,
            (None, Fresnel::Full | Fresnel::Dielectric { .. }, Some(eta)) => Fresnel::Dielectric { eta },
            (None, own, _) => own,
        };
        match (model, place_of(&self.exponent, &self.exponent_map)) {
            ("phong", _) => match metal_place {
                Some(place) => Err(section.fresnel_of_phong(place)),
                None => Ok(Gloss::Phong(exponent)),
            },
            ("blinn", _) => Ok(Gloss::Blinn(exponent, fresnel)),
            ("ggx" | "mirror", Some(place)) => Err(section.exponent_of(model, place)),
            ("ggx", None) => Ok(match (was, metallic) {
                (_, Some(metallic)) => Gloss::Metallic(metallic),
                (Gloss::Metallic(_), None) if metal_place.is_none() => was,
                _ => Gloss::Ggx(fresnel),
            }),
            // A mirror without indices of a metal reflects equally at all angles
            ("mirror", None) => Ok(Gloss::Mirror(match fresnel {
                Fresnel::Dielectric { .. } if own_model != "mirror" => Fresnel::Full,
                Fresnel::Dielectric { .. } => own_fresnel,
                other => other,
            })),
            (other, _) => {
                let place = self.model.as_ref().map_or(0..0, Spanned::span);
                Err(section.unknown_model(other, place))
            }
        }
    }

    /// Fresnel term of a metal, if `eta` or `k` is given. If one of both keys is missing, its value
    /// is taken from the material.
    fn conductor(&self, section: &NamedMaterial, own: Fresnel) -> Result<Option<Fresnel>, FileError> {
        let (own_eta, own_k) = match own {
            Fresnel::Conductor { eta, k } => (Some(eta), Some(k)),
            _ => (None, None),
        };
        let channels = |key: &Option<Spanned<ChannelValues>>| value(key).map(|channels| channels.0);
        match (
            channels(&self.eta).or(own_eta),
            channels(&self.k).or(own_k),
            &self.eta,
            &self.k,
        ) {
            (_, _, None, None) => Ok(None),
            (Some(eta), Some(k), ..) => Ok(Some(Fresnel::Conductor { eta, k })),
            (_, _, Some(eta), _) => Err(section.half_a_metal("eta", eta.span())),
            (_, _, None, Some(k)) => Err(section.half_a_metal("k", k.span())),
        }
    }

    /// Sets the reflection model `gloss` of `material`, and the fields that depend on the model.
    fn change_model(&self, gloss: Gloss, material: &mut Material) {
        let was = std::mem::replace(&mut material.gloss, gloss);
        let is_metal = |gloss: Gloss| {
            matches!(
                gloss,
                Gloss::Metallic(_)
                    | Gloss::Ggx(Fresnel::Conductor { .. })
                    | Gloss::Blinn(_, Fresnel::Conductor { .. })
                    | Gloss::Mirror(Fresnel::Conductor { .. })
            )
        };
        // A metal's colour is its reflectance from `eta` and `k`, so the specular factor is 1
        if is_metal(gloss) && !is_metal(was) && self.specular.is_none() {
            material.specular = Spectrum::ONE;
        }
        let is_rough_said = place_of(&self.roughness, &self.roughness_map).is_some();
        match (was, gloss) {
            (_, Gloss::Ggx(_) | Gloss::Metallic(_)) if is_rough_said => {}
            (Gloss::Phong(n), Gloss::Ggx(_) | Gloss::Metallic(_)) => {
                material.roughness = roughness_of_exponent(PHONG_TO_BLINN * n);
            }
            (Gloss::Blinn(n, _), Gloss::Ggx(_) | Gloss::Metallic(_)) => {
                material.roughness = roughness_of_exponent(n);
            }
            _ => {}
        }
    }

    /// Warning that a roughness has no effect, because the material has no reflection.
    fn idle_roughness(&self, section: &NamedMaterial, patched: &FileMaterial) -> Option<FileError> {
        let material = &patched.material;
        let place = place_of(&self.roughness, &self.roughness_map)?;
        let refracts = !material.transmission.is_black() && !material.thin;
        let reflects = !material.specular.is_black() || patched.has_map(MapSlot::Specular);
        (!refracts && !reflects).then(|| {
            let help = "give the material a `specular` or `metallic` too";
            section.error(place, "roughness has no effect, because `specular` is 0", help)
        })
    }

    /// Sets the constant of `slot` to 1 if the slot gets a new texture and no key sets the
    /// constant. The constant was the value of the material, but becomes a factor of the texture.
    /// The emission is not changed, because it defines the brightness of a lamp.
    fn unlock(&self, material: &mut Material, slot: MapSlot) {
        match slot {
            MapSlot::Diffuse if self.diffuse.is_none() => material.diffuse = Spectrum::ONE,
            MapSlot::Specular if self.specular.is_none() => material.specular = Spectrum::ONE,
            MapSlot::Roughness if self.roughness.is_none() => material.roughness = 1.0,
            MapSlot::Opacity if self.opacity.is_none() => material.opacity = 1.0,
            _ => {}
        }
    }

    /// Converts the transmission of `material` to an absorption coefficient: the transmission
    /// becomes the transmittance of the body at the absorption depth. The colour moves from the
    /// surface to the body.
    fn set_absorption_depth(&self, material: &mut Material) {
        let Some(depth) = value(&self.absorption_depth) else {
            return;
        };
        let kept = material.transmission.to_array();
        if kept != [1.0; 3] && !material.transmission.is_black() {
            let coefficient = |kept: f32| -kept.clamp(MIN_TRANSMISSION, 1.0).ln() / depth;
            material.absorption = kept.map(coefficient).into();
            material.transmission = Spectrum::ONE;
        }
    }

    /// Returns an error if the section has a key for microfacets and `material` has no microfacets,
    /// or a key for dispersion and `material` has no dispersion.
    fn check_facets(&self, section: &NamedMaterial, material: &Material) -> Result<(), FileError> {
        if let Some(abbe) = self.abbe.as_ref().filter(|_| !material.is_dispersive()) {
            return Err(section.disperses_nothing(abbe.span()));
        }
        let has_facets = matches!(material.gloss, Gloss::Ggx(_) | Gloss::Metallic(_));
        let refracts = !material.transmission.is_black() && !material.thin;
        if has_facets || refracts {
            return Ok(());
        }
        if let Some(place) = place_of(&self.roughness, &self.roughness_map) {
            return Err(section.no_facets_for("roughness", place));
        }
        match &self.anisotropy {
            Some(anisotropy) => Err(section.no_facets_for("anisotropy", anisotropy.span())),
            None => Ok(()),
        }
    }
}

/// Ratio of Blinn's exponent to Phong's exponent for a highlight of equal width. Angles to the half
/// vector are half as large as angles to the mirror direction (Fisher and Woo 1994, "R.E versus N.H
/// Specular Highlights", Graphics Gems IV).
const PHONG_TO_BLINN: f32 = 4.0;

/// Roughness of microfacets whose highlight is about as wide as a highlight of Blinn's exponent
/// `n`: α² = 2 / (n + 2) (Walter et al. 2007, "Microfacet Models for Refraction through Rough
/// Surfaces", section 5.2, for the Beckmann distribution), and α is the square of the roughness.
fn roughness_of_exponent(n: f32) -> f32 {
    (2.0 / (n + 2.0)).sqrt().sqrt()
}
