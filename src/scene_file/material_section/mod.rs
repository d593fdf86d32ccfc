//! Materials of a scene file.
//!
//! `MaterialSection` is the only table of the keys of a material, and [`range_of`] has the ranges
//! of their values. `patch` changes a material by the keys of a section. If a section replaces a
//! material, it patches a black material. `describe` writes a material as a section; patching the
//! material with this section changes nothing. `mistakes` has the errors about keys that cannot be
//! combined.

mod describe;
mod mistakes;
mod patch;
mod preset;

#[cfg(test)]
mod tests;

use super::FileError;
use super::mtl::{FileMaterial, MapSlot};
use super::presets::{PRESETS, Preset};
use super::section::{section, value};
use super::source::Source;
use super::{ChannelValues, ColorValue, MapSection};
use crate::material::{Gloss, Material, range_of};
use crate::options::Range as Numbers;
use mistakes::NamedMaterial;
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;

section! {
    /// `[material.NAME]` or `[patch."GLOB"]`. In a section that is not a patch, a missing key is 0,
    /// or the default of the model.
    #[derive(Default)]
    #[serde(expecting = "a table with keys of a material")]
    pub struct MaterialSection {
        required {}
        /// true: changes the material of that name instead of replacing it
        ///
        /// See below.
        patch: bool, default "false";
        /// Material that the other keys change
        ///
        /// See [Presets](materials.md#presets).
        preset: String, default "none", schema serde_json::json!({ "enum": preset_names() });
        /// Diffuse reflectance; the base colour with metallic
        diffuse: ColorValue, default "0", in range_of;
        /// Factor of the glossy or mirror reflection
        specular: ColorValue, default "0; 1 with eta and k, and with metallic", in range_of;
        /// Model of the glossy or mirror reflection
        model: String, default "phong; ggx with roughness or metallic", names &["phong", "blinn", "ggx", "mirror"];
        /// Exponent of phong and blinn
        exponent: f32, default "10", in range_of;
        /// Roughness of ggx, and of transmission unless the material is thin
        ///
        /// The square root of the GGX width `α`; 0 is smooth.
        roughness: f32, default "0", in range_of;
        /// Fraction of metal in the metallic-roughness model
        metallic: f32, default "none", in range_of;
        /// Elongation of highlights
        ///
        /// `α` is roughness² / r along the tangent and roughness² · r across it, where r is the
        /// square root of `1 − 0.9 anisotropy`.
        anisotropy: f32, default "0", in range_of;
        /// Degrees about the normal from the direction of increasing u to the tangent
        ///
        /// Without texture coordinates the tangent is arbitrary.
        anisotropy_rotation: f32, default "0", in range_of;
        /// Factor of the reflection of a coat with index 1.5 over all other lobes
        clearcoat: f32, default "0", in range_of;
        /// Roughness of the coat
        clearcoat_roughness: f32, default "0", in range_of;
        /// Factor of the light scattered by fibres between coat and base
        sheen: ColorValue, default "0", in range_of;
        /// Index of refraction of a metal by channel; with k
        ///
        /// For `blinn`, `ggx` and `mirror`.
        eta: ChannelValues, default "none", in range_of;
        /// Extinction coefficient of a metal by channel; with eta
        k: ChannelValues, default "none", in range_of;
        /// Factor of the transmitted light
        transmission: ColorValue, default "0", in range_of;
        /// Index of refraction behind the surface
        ///
        /// For `blinn` and `ggx`, this key also adds a Fresnel term; without it they have none.
        ior: f32, default "1.5", in range_of;
        /// Abbe number of smooth glass; `ior` is then the index at 587.56 nm
        ///
        /// See [Dispersion](materials.md#dispersion).
        abbe: f32, default "no dispersion", in range_of;
        /// Absorption coefficient inside a body, per scene unit
        ///
        /// See [Absorption](materials.md#absorption).
        absorption: ChannelValues, default "0", in range_of;
        /// Distance through a body after which transmission is the remaining light
        ///
        /// In scene units. The colour of the surface becomes the colour of the body.
        absorption_depth: f32, default "off", in Numbers::Above(0.0);
        /// true: thin dielectric, which does not change the direction of light
        ///
        /// The surface is then a sheet with two faces, not the boundary of a body; see
        /// [Window panes](materials.md#window-panes-and-thin-glass).
        thin: bool, default "false";
        /// Radiance of the front, W·sr⁻¹·m⁻²
        emission: ColorValue, default "0", in range_of;
        /// Opacity
        ///
        /// The emission is multiplied by `opacity`.
        opacity: f32, default "1", in range_of;
        /// false: rays from the camera pass through the surface, but light meets it
        ///
        /// Mirrors and shadows show it.
        camera_visible: bool, default "true";
        /// Texture that multiplies diffuse; an omitted diffuse is 1
        diffuse_map: MapSection, default "none";
        /// Texture that multiplies specular; an omitted specular is 1
        specular_map: MapSection, default "none";
        /// Texture that multiplies emission; an omitted emission is 1
        emission_map: MapSection, default "none";
        /// Texture that multiplies exponent; an omitted exponent is 1
        exponent_map: MapSection, default "none";
        /// Texture that multiplies roughness; an omitted roughness is 1
        roughness_map: MapSection, default "none";
        /// Texture that multiplies metallic; an omitted metallic is 1
        metallic_map: MapSection, default "none";
        /// Texture that multiplies opacity
        opacity_map: MapSection, default "none";
        /// Height map (bump map); white is one texel width above black
        bump_map: MapSection, default "none";
        /// Tangent-space normal map; it takes precedence over `bump_map`
        normal_map: MapSection, default "none";
        /// Texture of displacements along the normal, `height` scene units at white
        ///
        /// Vertices move, so the object needs `subdivision` or small faces.
        displacement_map: MapSection, default "none";
    }
}

/// Calls the macro `$use` with the names of keys that are also names of material fields.
macro_rules! fields {
    ($use:ident) => {
        $use! {
            diffuse,
            specular,
            roughness,
            anisotropy,
            anisotropy_rotation,
            clearcoat,
            clearcoat_roughness,
            sheen,
            transmission,
            ior,
            absorption,
            thin,
            emission,
            opacity,
            camera_visible
        }
    };
}
use fields;

/// Lists all keys: `fields!`, and the keys that `patch` and `describe` treat one by one. A key that
/// is in neither list is a compile error.
macro_rules! all_keys {
    ($($field:ident),+) => {
        const _: fn(MaterialSection) = |MaterialSection {
            $($field: _,)+
            patch: _,
            preset: _,
            model: _,
            exponent: _,
            metallic: _,
            eta: _,
            k: _,
            abbe: _,
            absorption_depth: _,
            diffuse_map: _,
            specular_map: _,
            emission_map: _,
            exponent_map: _,
            roughness_map: _,
            metallic_map: _,
            opacity_map: _,
            bump_map: _,
            normal_map: _,
            displacement_map: _,
        }| ();
    };
}
fields!(all_keys);

fn preset_names() -> Vec<&'static str> {
    PRESETS.iter().map(|preset| preset.name).collect()
}

impl MaterialSection {
    /// Returns true if the section changes a material of a library instead of replacing it.
    pub fn is_patch(&self) -> bool {
        value(&self.patch) == Some(true)
    }

    /// `old` changed by the preset of the section; `old` unchanged if the section has no preset.
    fn preset_over<'a>(&self, old: &'a FileMaterial, file: &Source) -> Result<Cow<'a, FileMaterial>, FileError> {
        let Some(name) = &self.preset else {
            return Ok(Cow::Borrowed(old));
        };
        let section = NamedMaterial {
            name: &old.material.name,
            file,
        };
        let preset =
            Preset::of_name(name.get_ref()).ok_or_else(|| section.unknown_preset(name.get_ref(), name.span()))?;
        let new = preset.section().material(&old.material.name, file)?;
        Ok(Cow::Owned(preset::applied(new, old)))
    }

    /// Values of the texture keys with their slots, in the order of the slots.
    fn slots(&self) -> [(&Option<Spanned<MapSection>>, MapSlot); 10] {
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
            (&self.displacement_map, MapSlot::Displacement),
        ]
    }

    /// Mutable values of the texture keys with their slots.
    pub fn maps_mut(&mut self) -> [(MapSlot, &mut Option<Spanned<MapSection>>); 10] {
        [
            (MapSlot::Diffuse, &mut self.diffuse_map),
            (MapSlot::Specular, &mut self.specular_map),
            (MapSlot::Emission, &mut self.emission_map),
            (MapSlot::Exponent, &mut self.exponent_map),
            (MapSlot::Roughness, &mut self.roughness_map),
            (MapSlot::Metallic, &mut self.metallic_map),
            (MapSlot::Opacity, &mut self.opacity_map),
            (MapSlot::Bump, &mut self.bump_map),
            (MapSlot::Normal, &mut self.normal_map),
            (MapSlot::Displacement, &mut self.displacement_map),
        ]
    }
}

/// Texture of a key's value; `None` if the key is missing or `false`.
fn texture(map: &Option<Spanned<MapSection>>) -> Option<&Spanned<MapSection>> {
    map.as_ref().filter(|map| !matches!(map.get_ref(), MapSection::None))
}

/// Span of a quantity in the file: the span of its number, or else of its texture.
fn place_of(number: &Option<Spanned<f32>>, map: &Option<Spanned<MapSection>>) -> Option<Range<usize>> {
    number.as_ref().map(Spanned::span).or(texture(map).map(Spanned::span))
}
