//! Materials of a scene file.
//!
//! `replace` makes a material of a section alone (of a preset if it names one), `patch` changes a
//! material by what a section says, and `describe` writes a material as the section that patches
//! nothing of it. `values` has what a key may hold.

mod describe;
mod patch;
mod preset;
mod replace;
mod values;

#[cfg(test)]
mod tests;

use super::FileError;
use super::mtl::{FileMaterial, MapSlot};
use super::presets::Preset;
use super::source::Source;
use super::{ChannelValues, ColorValue, MapSection};
use crate::material::{Gloss, Material};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use values::Named;

/// `[material.NAME]` or `[patch."GLOB"]`. In a material that is no patch, a key that is left out is 0, or the default of the model.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields, expecting = "a table with keys of a material")]
pub struct MaterialSection {
    /// Whether `[material.NAME]` changes the material of a library instead of replacing it.
    pub patch: Option<Spanned<bool>>,
    /// Name of a material that the other keys change.
    pub preset: Option<Spanned<String>>,
    /// Diffuse reflectance.
    pub diffuse: Option<Spanned<ColorValue>>,
    /// Factor of the glossy or mirror reflection.
    pub specular: Option<Spanned<ColorValue>>,
    /// How `specular` reflects: `phong`, `blinn`, `ggx` or `mirror`.
    pub model: Option<Spanned<String>>,
    /// Exponent of a glossy reflection.
    pub exponent: Option<Spanned<f32>>,
    /// Roughness of `ggx` and of `transmission`.
    pub roughness: Option<Spanned<f32>>,
    /// Share of metal: `diffuse` is the base colour.
    pub metallic: Option<Spanned<f32>>,
    /// Elongation of highlights of `ggx` and of `transmission`.
    pub anisotropy: Option<Spanned<f32>>,
    /// Degrees from the direction of growing u to that of long highlights.
    pub anisotropy_rotation: Option<Spanned<f32>>,
    /// Factor of what a clear coat reflects.
    pub clearcoat: Option<Spanned<f32>>,
    /// Roughness of the clear coat.
    pub clearcoat_roughness: Option<Spanned<f32>>,
    /// Factor of the light scattered by fibres.
    pub sheen: Option<Spanned<ColorValue>>,
    /// Index of refraction of a metal, by channel; with `k`.
    pub eta: Option<Spanned<ChannelValues>>,
    /// Extinction coefficient of a metal, by channel; with `eta`.
    pub k: Option<Spanned<ChannelValues>>,
    /// Factor of the transmitted light.
    pub transmission: Option<Spanned<ColorValue>>,
    /// Index of refraction, of `transmission` and of a `blinn` or `ggx` reflection.
    pub ior: Option<Spanned<f32>>,
    /// Abbe number of smooth glass.
    pub abbe: Option<Spanned<f32>>,
    /// Absorption coefficient inside of a body, per scene unit.
    pub absorption: Option<Spanned<ChannelValues>>,
    /// Way through a body on which `transmission` is what light keeps.
    pub absorption_depth: Option<Spanned<f32>>,
    /// Whether the surface is a sheet that light leaves straight on.
    pub thin: Option<bool>,
    /// Emitted radiance.
    pub emission: Option<Spanned<ColorValue>>,
    /// Opacity, 0 to 1.
    pub opacity: Option<Spanned<f32>>,
    /// Texture of `diffuse`.
    pub diffuse_map: Option<Spanned<MapSection>>,
    /// Texture of `specular`.
    pub specular_map: Option<Spanned<MapSection>>,
    /// Texture of `emission`.
    pub emission_map: Option<Spanned<MapSection>>,
    /// Texture of `exponent`.
    pub exponent_map: Option<Spanned<MapSection>>,
    /// Texture of `roughness`.
    pub roughness_map: Option<Spanned<MapSection>>,
    /// Texture of `metallic`.
    pub metallic_map: Option<Spanned<MapSection>>,
    /// Texture of `opacity`.
    pub opacity_map: Option<Spanned<MapSection>>,
    /// Heights.
    pub bump_map: Option<Spanned<MapSection>>,
    /// Normals in the frame of the texture coordinates.
    pub normal_map: Option<Spanned<MapSection>>,
}

/// Sets the keys that another section says over those of this one.
macro_rules! set_over {
    ($section:ident, $other:ident: $($key:ident),*) => {{
        let MaterialSection { $($key),* } = $other;
        $($section.$key = $key.or($section.$key.take());)*
    }};
}

impl MaterialSection {
    /// Whether this changes a material of a library instead of replacing it.
    pub fn is_patch(&self) -> bool {
        self.patch.as_ref().is_some_and(|patch| *patch.get_ref())
    }

    /// Sets the keys that `other` says over those of this section.
    pub(super) fn set_over(&mut self, other: Self) {
        set_over!(self, other: patch, preset, diffuse, specular, model, exponent, roughness, metallic, anisotropy, anisotropy_rotation, clearcoat, clearcoat_roughness, sheen, eta, k, transmission, ior, abbe, absorption, absorption_depth, thin, emission, opacity, diffuse_map, specular_map, emission_map, exponent_map, roughness_map, metallic_map, opacity_map, bump_map, normal_map);
    }

    /// `old` as the preset has it; `old` itself without a preset.
    fn preset_over<'a>(&self, old: &'a FileMaterial, file: &Source) -> Result<Cow<'a, FileMaterial>, FileError> {
        let Some(name) = &self.preset else {
            return Ok(Cow::Borrowed(old));
        };
        let section = Named {
            name: &old.material.name,
            file,
        };
        let preset =
            Preset::of_name(name.get_ref()).ok_or_else(|| section.unknown_preset(name.get_ref(), name.span()))?;
        let new = preset.section().material(&old.material.name, file)?;
        Ok(Cow::Owned(preset::applied(new, old)))
    }

    /// The keys of textures with their slots, in the order of the slots.
    fn slots(&self) -> [(&Option<Spanned<MapSection>>, MapSlot); 9] {
        [
            (&self.diffuse_map, MapSlot::Diffuse),
            (&self.specular_map, MapSlot::Specular),
            (&self.emission_map, MapSlot::Emission),
            (&self.exponent_map, MapSlot::Exponent),
            (&self.roughness_map, MapSlot::Roughness),
            (&self.metallic_map, MapSlot::Metallic),
            (&self.opacity_map, MapSlot::Opacity),
            (&self.bump_map, MapSlot::Bump),
            (&self.normal_map, MapSlot::Normal),
        ]
    }

    /// All keys of textures.
    pub fn maps_mut(&mut self) -> [&mut Option<Spanned<MapSection>>; 9] {
        [
            &mut self.diffuse_map,
            &mut self.specular_map,
            &mut self.emission_map,
            &mut self.exponent_map,
            &mut self.roughness_map,
            &mut self.metallic_map,
            &mut self.opacity_map,
            &mut self.bump_map,
            &mut self.normal_map,
        ]
    }
}

/// The texture that a key gives: none where it is left out, or `false`.
fn texture(map: &Option<Spanned<MapSection>>) -> Option<&Spanned<MapSection>> {
    map.as_ref().filter(|map| !map.get_ref().is_none)
}

/// Where a quantity is given: its number, or else its texture.
fn place_of(number: &Option<Spanned<f32>>, map: &Option<Spanned<MapSection>>) -> Option<Range<usize>> {
    number.as_ref().map(Spanned::span).or(texture(map).map(Spanned::span))
}
