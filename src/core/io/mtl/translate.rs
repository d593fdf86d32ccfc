//! Translation of a program's statements to the materials that it meant, as statements of the
//! format and of the PBR extension (`Pr Pm Pc …`). The extension is valid in every dialect.
//!
//! - Blender: `source/blender/io/wavefront_obj` of its sources (from 3.1),
//!   `io_scene_obj/export_obj.py` of its add-ons (to 3.6), and the files that bpy 5.0.1 writes and
//!   reads; `benches/peers/mtl_blender.py` compares the result with Blender.
//! - 3ds Max: its reference, "Diffuse Color Map" (the colours of a map replace the colour) and
//!   "Standard Material", whose default glossiness of 10 % is written as `Ns 10`.
//! - Maya: `objExport` writes `illum 4`, `Ni 1.00` and `Tf 1.00 1.00 1.00` for an opaque Lambert
//!   surface, `Ns` is the cosine power of a Phong surface.
//! - SketchUp: a surface has a colour, a picture and an opacity; `Ks 0.33 0.33 0.33` is a constant
//!   of the exporter.
//! - Cinema 4D: its manual, "OBJ Export: Material", states that its materials cannot be written
//!   without loss. It had specular channels, and `Ks` and `Ns` are read as these channels. Its
//!   files have `illum 7` for every material, mostly with neither `Tf`, `Ni` nor `d`: such a
//!   surface is opaque.
//! - MeshLab: `wrap/io_trimesh/export_obj.h` and `io_material.h` of VCGLIB, whose defaults are
//!   `Ks 1 1 1`, `Ns 0` and, until its issue 213 of 2023, `Tr 1` for opaque surfaces.
//! - Rhino: its files have the comment `# Rhino` and, for every material, `Ks 1 1 1`, `Tf 0 0 0`,
//!   `d` and, without gloss, `Ns 0`; other programs write the same (`honeybee` of Ladybug Tools,
//!   `dash_obj_in_3dmesh`).
//! - Wings 3D: `e3d/e3d_obj.erl` of its sources, which writes the colours of an OpenGL material,
//!   and its shininess times 100.
//! - 3dfier: `resources/3dfier.mtl` of its sources has one colour as `Ka`, `Kd` and `Ks`, and
//!   `Ns 60`.
//! - Assimp: `code/AssetLib/Obj/ObjExporter.cpp` of its sources, which writes the colours of an
//!   OpenGL material for every source format; `Tf` is a colour that does not depend on `d`.
//!
//! Except in Blender, the highlight is a reflection of lamps only, not of all light around the
//! surface. It becomes the highlight of a dielectric. A highlight of exponent 0 has no shape:
//! programs write it for surfaces without a highlight.

use super::map::MapSlot;
use super::reflectance::{MAX_F0, f0_of_ior};
use super::section::{DEFAULT_EXPONENT, DEFAULT_IOR, Section};
use super::writer::{BlenderExport, Writer};
use crate::color::Spectrum;

/// Reflectance along the normal of a specular level of 1 (Burley 2012, "Physically Based Shading at
/// Disney", section 5.4).
const LEVEL_F0: f32 = 0.08;
/// Roughness of Blender's principled surface if the file has none.
const BLENDER_ROUGHNESS: f32 = 0.5;
/// Glossiness of new materials of 3ds Max, in percent.
const MAX_GLOSSINESS: f32 = 10.0;
/// Cosine power of new Phong surfaces of Maya.
const MAYA_COSINE_POWER: f32 = 20.0;
/// `Pc` of a full coat, as Blender writes it: its exporter multiplies by 4.
pub(super) const BLENDER_COAT: f32 = 4.0;

impl Section {
    /// Replaces the statements by statements with the meaning that they have in the program
    /// `writer`.
    pub(super) fn translate(&mut self, writer: Writer) {
        self.is_literal = writer == Writer::Spec;
        // In Blender, a highlight of exponent 0 has a meaning: a valid roughness.
        let has_meaning = matches!(writer, Writer::Spec | Writer::Blender(_));
        if self.has_flat_highlight() && !has_meaning {
            self.drop_highlight();
        }
        if self.is_transparent_by_mistake() && matches!(writer, Writer::Unknown | Writer::Highlight) {
            (self.illum, self.filter) = (Some(2), None);
        }
        match writer {
            Writer::Spec | Writer::Unknown => {}
            Writer::Blender(export) => self.translate_blender(export),
            Writer::Max => self.translate_max(),
            Writer::Maya => self.translate_maya(),
            Writer::Sketchup => self.drop_highlight(),
            Writer::Cinema4d => {
                let is_glass = self.filter.is_some() || self.ior.is_some() || self.dissolve.is_given();
                if !is_glass {
                    self.illum = Some(2);
                }
                self.make_phong_highlight(MAYA_COSINE_POWER);
            }
            Writer::Rhino | Writer::Assimp => {
                self.filter = None;
                self.make_phong_highlight(DEFAULT_EXPONENT);
            }
            Writer::Wings3d | Writer::Threedfier | Writer::Highlight => self.make_phong_highlight(DEFAULT_EXPONENT),
            Writer::Meshlab if self.exponent.is_none() && !self.has_map(MapSlot::Specular) => self.drop_highlight(),
            Writer::Meshlab => self.make_phong_highlight(DEFAULT_EXPONENT),
        }
    }

    fn translate_blender(&mut self, export: BlenderExport) {
        let is_extended = self.is_physical();
        // In Blender, a linked picture replaces the constant.
        if self.has_map(MapSlot::Diffuse) {
            self.diffuse = None;
        }
        self.rename_map(MapSlot::Exponent, MapSlot::Roughness);
        if export != BlenderExport::Internal {
            // Blender writes only pictures of normals as `map_Bump`.
            self.rename_map(MapSlot::Bump, MapSlot::Normal);
        }

        // Blender writes metallic as `Ka` if the illumination model reflects.
        if self.metallic.is_none() && !self.has_map(MapSlot::Metallic) {
            let share = self.ambient.map_or(1.0, Spectrum::mean).min(1.0);
            let reflects = matches!(self.illum, Some(3..=8));
            self.metallic = Some(if reflects { share } else { 0.0 });
        }
        if self.roughness.is_none() && !self.has_map(MapSlot::Roughness) {
            let range = match export {
                BlenderExport::Python => 900.0,
                _ => 1000.0,
            };
            let roughness = |ns: f32| 1.0 - (ns.min(range) / range).sqrt();
            self.roughness = Some(self.exponent.map_or(BLENDER_ROUGHNESS, roughness));
        }

        let level = match (
            self.specular.take().map(Spectrum::mean),
            self.has_map(MapSlot::Specular),
        ) {
            (Some(level), true) if export == BlenderExport::Internal && level > 0.0 => level,
            (_, true) => 1.0,
            (level, false) => level.unwrap_or(0.0),
        };
        let full = match export {
            BlenderExport::Native { before_4: false } => 2.0 * f0_of_ior(self.ior.unwrap_or(DEFAULT_IOR)),
            _ => LEVEL_F0,
        };
        self.f0 = Some((level * full).min(MAX_F0));
        // In Blender, `Tf` is the weight of transmission. It is written only with the PBR
        // extension.
        let filter = self.filter.take();
        self.transmitted = filter.filter(|_| is_extended).map(|w| w.mean().min(1.0));
        self.clearcoat /= BLENDER_COAT;
        self.exponent = None;
        self.illum = Some(2);
    }

    fn translate_max(&mut self) {
        if self.has_map(MapSlot::Diffuse) {
            self.diffuse = None;
        }
        let glossiness = self.exponent.unwrap_or(MAX_GLOSSINESS).min(100.0) / 100.0;
        if self.make_highlight(1.0 - glossiness) {
            // The picture contains glossiness: roughness is 1 minus glossiness.
            for map in self.maps.iter_mut().filter(|m| m.statement.slot == MapSlot::Exponent) {
                let mapping = &mut map.statement.mapping;
                (mapping.base, mapping.gain) = (1.0 - mapping.base, -mapping.gain);
            }
            self.rename_map(MapSlot::Exponent, MapSlot::Roughness);
            if self.has_map(MapSlot::Roughness) {
                self.roughness = None;
            }
        }
    }

    fn translate_maya(&mut self) {
        if self.illum == Some(4) {
            self.illum = Some(2);
        }
        // Maya writes the opacity as `Tf`. It may have a colour, so its mean is used.
        if let Some(opacity) = self.filter.take() {
            let opacity = opacity.mean().min(1.0);
            self.dissolve.d = Some(self.dissolve.d.unwrap_or(1.0) * opacity);
        }
        // Maya writes black as the colour of a surface with a picture.
        if self.has_map(MapSlot::Diffuse) && self.diffuse.is_some_and(Spectrum::is_black) {
            self.diffuse = None;
        }
        self.make_phong_highlight(MAYA_COSINE_POWER);
    }

    /// Returns true if `Ks` can be a highlight with this illumination model. Surfaces without a
    /// highlight, mirrors, glass and materials of the PBR extension keep their meaning.
    pub(super) fn may_have_highlight(&self) -> bool {
        !self.is_physical() && !matches!(self.illum, Some(0 | 1 | 3..=7))
    }

    /// Returns true if the surface has a picture of its colour, but would transmit all light
    /// straight, so that the picture would be invisible. Such a surface is glass of index 1 without
    /// any filter, as Maya writes opaque surfaces.
    pub(super) fn is_transparent_by_mistake(&self) -> bool {
        matches!(self.illum, Some(4 | 6 | 7))
            && self.ior == Some(1.0)
            && self.filter.is_none_or(|filter| filter == Spectrum::ONE)
            && self.has_map(MapSlot::Diffuse)
            && !self.dissolve.is_given()
            && !self.is_physical()
    }

    /// Returns true if there is a highlight of exponent 0.
    pub(super) fn has_flat_highlight(&self) -> bool {
        let has_map = self.has_map(MapSlot::Specular) || self.has_map(MapSlot::Exponent);
        let shines = self.specular.is_some_and(|ks| !ks.is_black());
        shines && self.exponent == Some(0.0) && !has_map && self.may_have_highlight()
    }

    /// Calls [`Section::make_highlight`] with the roughness of a Phong lobe. The exponent of the
    /// lobe is `Ns`, or `default` if there is no `Ns`.
    fn make_phong_highlight(&mut self, default: f32) {
        let exponent = self.exponent.unwrap_or(default);
        self.make_highlight(roughness_of_phong(exponent));
    }

    /// Converts `Ks` to the specular level of a dielectric with the roughness `roughness` or, if
    /// `Kd` is black, to the colour of a metal. Returns true if there was a highlight.
    fn make_highlight(&mut self, roughness: f32) -> bool {
        let level = match self.specular {
            Some(color) if !color.is_black() => color.mean(),
            _ if self.has_map(MapSlot::Specular) => 1.0,
            _ => 0.0,
        };
        if level == 0.0 || !self.may_have_highlight() {
            return false;
        }
        let is_bare = self.diffuse.is_some_and(Spectrum::is_black) && !self.has_map(MapSlot::Diffuse);
        let color = self.specular.take().filter(|color| is_bare && !color.is_black());
        self.metallic = Some(if color.is_some() { 1.0 } else { 0.0 });
        self.diffuse = color.or(self.diffuse);
        self.f0 = Some((level * LEVEL_F0).min(MAX_F0));
        self.roughness = Some(roughness);
        self.exponent = None;
        true
    }

    fn drop_highlight(&mut self) {
        if !self.is_physical() {
            (self.specular, self.exponent) = (None, None);
        }
    }

    /// Moves the picture in the slot `from` to the slot `to`, unless `to` has a picture.
    fn rename_map(&mut self, from: MapSlot, to: MapSlot) {
        if self.has_map(to) {
            return;
        }
        for map in self.maps.iter_mut().filter(|m| m.statement.slot == from) {
            map.statement.slot = to;
        }
    }
}

/// Roughness of facets whose highlights are as wide as the highlights of a Phong lobe. An exponent
/// n around the mirror direction corresponds to an exponent of about 4 n around the normal (Lewis
/// 1994, "Making Shaders More Physically Plausible"). A distribution with this exponent has the
/// width α² = 2/(4 n + 2) (Walter et al. 2007, "Microfacet Models for Refraction through Rough
/// Surfaces", section 5.2).
fn roughness_of_phong(exponent: f32) -> f32 {
    (2.0 / (4.0 * exponent + 2.0)).powf(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phong_lobes_become_smoother_with_their_exponent() {
        assert_eq!(roughness_of_phong(0.0), 1.0);
        let widths = [1.0, 10.0, 100.0, 1e4, 1e30].map(roughness_of_phong);
        assert!(widths.is_sorted_by(|a, b| a > b), "{widths:?}");
    }
}
