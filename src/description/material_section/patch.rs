//! Patches: a material changed by the keys of a section, and by nothing else.
//!
//! A key that only another model of reflection has brings that model with it: `roughness` and `anisotropy` make a Phong or Blinn lobe, or a mirror, one of
//! GGX facets, `eta` and `k` make a metal, and `metallic` the metallic-roughness model. What the old model has in common with the new one stays.

use super::replace::DEFAULT_EXPONENT;
use super::values::{Named, Values};
use super::{FileMaterial, Gloss, Material, MaterialSection, Source, place_of, texture};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::description::mtl::MapSlot;
use crate::description::{FileError, MapSection};
use toml::Spanned;

impl MaterialSection {
    /// `base` with what the keys say, and a warning where they change nothing that can be seen; what cannot be is an error at its key in `file`.
    pub(in crate::description) fn patched(
        &self,
        base: &FileMaterial,
        file: &Source,
    ) -> Result<(FileMaterial, Option<FileError>), FileError> {
        let name = base.material.name.as_str();
        let section = Named { name, file };
        let values = self.values(&section)?;
        let base = &*self.preset_over(base, file)?;
        let mut patched = base.clone();
        let material = &mut patched.material;

        // Keys that stand by themselves
        let set = |given: Option<f32>, number: &mut f32| *number = given.unwrap_or(*number);
        let set_color = |given: Option<Spectrum>, color: &mut Spectrum| *color = given.unwrap_or(*color);
        set_color(values.diffuse, &mut material.diffuse);
        set_color(values.specular, &mut material.specular);
        set_color(values.sheen, &mut material.sheen);
        set_color(values.transmission, &mut material.transmission);
        set_color(values.emission, &mut material.emission);
        set(values.roughness, &mut material.roughness);
        set(values.anisotropy, &mut material.anisotropy);
        set(values.anisotropy_rotation, &mut material.anisotropy_rotation);
        set(values.clearcoat, &mut material.clearcoat);
        set(values.clearcoat_roughness, &mut material.clearcoat_roughness);
        set(values.ior, &mut material.ior);
        material.abbe = values.abbe.or(material.abbe);
        values.set_absorption(material);
        set(values.opacity, &mut material.opacity);
        if values.opacity.is_some() {
            patched.opacity_line = None;
        }
        material.thin = self.thin.unwrap_or(material.thin);

        // Those that decide about the model of reflection
        let has_share = matches!(base.material.gloss, Gloss::Metallic(_)) && base.has_map(MapSlot::Metallic);
        let is_new_map = texture(&self.metallic_map).is_some() && !has_share;
        let metallic = values.metallic.or(is_new_map.then_some(1.0));
        let gloss = self.patched_gloss(&section, &values, metallic, base, material)?;
        self.change_model(&values, gloss, material);
        self.check_facets(&section, material)?;

        // Textures
        for (map, slot) in self.slots() {
            let Some(map) = map else { continue };
            let had = base.has_map(slot);
            patched.maps.retain(|request| request.statement.slot != slot);
            if map.get_ref().is_none {
                continue;
            }
            patched.maps.push(MapSection::request(map, slot, name, file)?);
            if !had {
                unlock(&mut patched.material, slot, &values);
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

    /// The reflection of `base` as the keys change it; `material` has the other keys already.
    fn patched_gloss(
        &self,
        section: &Named,
        values: &Values,
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
        // Of glass without a reflection of its own, it is the refraction that is roughened.
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
        let exponent = match (values.exponent, texture(&self.exponent_map)) {
            (Some(exponent), _) => exponent,
            (None, Some(_)) if !base.has_map(MapSlot::Exponent) => 1.0,
            (None, _) => own_exponent.unwrap_or(DEFAULT_EXPONENT),
        };
        let fresnel = match (self.conductor(section, values, own_fresnel)?, own_fresnel, values.ior) {
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
            // A mirror without an index of a metal reflects alike at all angles.
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

    /// The Fresnel term of a metal, where a key gives one of its numbers: the other may be that of the material.
    fn conductor(&self, section: &Named, values: &Values, own: Fresnel) -> Result<Option<Fresnel>, FileError> {
        let (own_eta, own_k) = match own {
            Fresnel::Conductor { eta, k } => (Some(eta), Some(k)),
            _ => (None, None),
        };
        let place = |value: &Option<Spanned<super::ChannelValues>>| value.as_ref().map_or(0..0, Spanned::span);
        match (values.eta.or(own_eta), values.k.or(own_k)) {
            _ if values.eta.is_none() && values.k.is_none() => Ok(None),
            (Some(eta), Some(k)) => Ok(Some(Fresnel::Conductor { eta, k })),
            (Some(_), None) => Err(section.half_a_metal("eta", place(&self.eta))),
            (None, _) => Err(section.half_a_metal("k", place(&self.k))),
        }
    }

    /// Gives `material` the reflection `gloss`, and what that needs besides.
    fn change_model(&self, values: &Values, gloss: Gloss, material: &mut Material) {
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
        // A metal reflects by its own colour.
        if is_metal(gloss) && !is_metal(was) && values.specular.is_none() {
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

    /// That a roughness roughens what cannot be seen: nothing is reflected.
    fn idle_roughness(&self, section: &Named, patched: &FileMaterial) -> Option<FileError> {
        let material = &patched.material;
        let place = place_of(&self.roughness, &self.roughness_map)?;
        let refracts = !material.transmission.is_black() && !material.thin;
        let reflects = !material.specular.is_black() || patched.has_map(MapSlot::Specular);
        (!refracts && !reflects).then(|| {
            let help = "give the material a `specular` or `metallic` too";
            section.error(place, "roughness has no effect, because `specular` is 0", help)
        })
    }
}

/// A texture that a material did not have is not multiplied: the constant of its `slot` was the value itself. The emission stays, since it says how bright a
/// lamp is.
fn unlock(material: &mut Material, slot: MapSlot, values: &Values) {
    match slot {
        MapSlot::Diffuse if values.diffuse.is_none() => material.diffuse = Spectrum::ONE,
        MapSlot::Specular if values.specular.is_none() => material.specular = Spectrum::ONE,
        MapSlot::Roughness if values.roughness.is_none() => material.roughness = 1.0,
        MapSlot::Opacity if values.opacity.is_none() => material.opacity = 1.0,
        _ => {}
    }
}

/// Exponent of Blinn's half vector for a highlight as wide as one of Phong's mirror direction, whose exponent is 1: angles to the half vector are half as large
/// (Fisher and Woo 1994, "R.E versus N.H Specular Highlights", Graphics Gems IV).
const PHONG_TO_BLINN: f32 = 4.0;

/// Roughness of facets whose highlight is about as wide as that of Blinn's exponent `n`: α² = 2 / (n + 2) (Walter et al. 2007, "Microfacet Models for
/// Refraction through Rough Surfaces", section 5.2, for Beckmann's facets), and α is the square of the roughness.
fn roughness_of_exponent(n: f32) -> f32 {
    (2.0 / (n + 2.0)).sqrt().sqrt()
}
