//! Mistakes that exporters make in material libraries, and their correction. A library that is read
//! literally is not corrected.

use super::{Loader, MaterialSource};
use crate::material::{Material, MaterialId};
use crate::math::excerpt_of_name;
use crate::scene_file::mtl::{FileMaterial, MapSlot, default_material};
use crate::scene_file::{FileError, Position, Severity};
use crate::texture::Channel;
use std::path::Path;

/// File extensions of pictures without alpha.
const WITHOUT_ALPHA: [&str; 3] = ["jpg", "jpeg", "jfif"];

impl Loader<'_> {
    /// Makes all materials opaque if all of them are invisible: exporters write `d 0` for opaque
    /// surfaces by mistake. User settings and the literal reading of the MTL file have priority.
    pub(super) fn make_visible(&mut self) {
        let is_invisible = |source: &MaterialSource| {
            let found = &source.found;
            found.opacity.is_some() && found.material.opacity == 0.0
        };
        let Some((first, names)) = self.mistake_of_all(is_invisible) else {
            return;
        };
        let message = format!(
            "all materials of the scene ({names}) have the opacity 0 and would be invisible; they are rendered opaque"
        );
        let line = first.opacity.map_or(first.line, |opacity| opacity.line);
        let error = FileError::new(&first.library, message).at(Position::line(line));
        let error = error.help("write `d 1` in the library; --strict keeps the materials invisible");
        self.warn("invisible-scene", error);
        for (id, source) in (0..).map(MaterialId).zip(&mut self.materials) {
            source.found.material.opacity = 1.0;
            self.builder.set_opacity(id, 1.0);
        }
    }

    /// Makes all materials grey if none of them reflects, transmits or emits light. Exporters write
    /// `Kd 0` for a colour that a texture gives, and the texture is then lost. User settings and
    /// the literal reading of the MTL file have priority.
    pub(super) fn lighten_black(&mut self) {
        let is_patched = self.has_patched;
        let is_lost = |source: &MaterialSource| {
            let found = &source.found;
            !is_patched && found.line > 0 && found.maps.is_empty() && is_black(&found.material)
        };
        let Some((first, names)) = self.mistake_of_all(is_lost) else {
            return;
        };
        let grey = default_material("").diffuse;
        let message = format!(
            "no material of the scene ({names}) reflects light or has a texture; all are rendered in a plain grey (diffuse {:.1})",
            grey.max_component()
        );
        let error = FileError::new(&first.library, message).at(Position::line(first.line));
        let error = error.help("write `Kd` in the library, or name a texture; --strict keeps the materials black");
        self.warn("black-scene", error);
        for (id, source) in (0..).map(MaterialId).zip(&mut self.materials) {
            source.found.material.diffuse = grey;
            self.builder.set_diffuse(id, grey);
        }
    }

    /// First material, and text with the names, if all materials are of libraries and have the
    /// mistake `has_mistake`. `None` if libraries are read literally.
    fn mistake_of_all(&self, has_mistake: impl Fn(&MaterialSource) -> bool) -> Option<(&FileMaterial, String)> {
        let is_wrong = |source: &MaterialSource| source.obj.is_some() && has_mistake(source);
        if self.file.load.is_literal() || !self.materials.iter().all(is_wrong) {
            return None;
        }
        let first = self.materials.first()?;
        let others = match self.materials.len() - 1 {
            0 => String::new(),
            1 => " and another one".into(),
            n => format!(" and {n} others"),
        };
        Some((&first.found, format!("`{}`{others}", excerpt_of_name(&first.name))))
    }

    /// Leaves out an opacity texture that is also the colour texture, if the format of the picture
    /// has no alpha. Exporters write `map_d` for every colour texture, and mean its alpha.
    pub(super) fn leave_out_color_as_opacity(&mut self, found: &mut FileMaterial) {
        let of = |slot| found.maps.iter().rev().find(|map| map.statement.slot == slot);
        let (Some(color), Some(opacity)) = (of(MapSlot::Diffuse), of(MapSlot::Opacity)) else {
            return;
        };
        let statement = &opacity.statement;
        let extension = Path::new(&statement.file).extension().and_then(|e| e.to_str());
        let has_alpha = !extension.is_some_and(|e| WITHOUT_ALPHA.contains(&&*e.to_lowercase()));
        if statement.file != color.statement.file || statement.mapping.channel.is_some() || has_alpha {
            return;
        }
        let note = opacity.remark("is the colour texture and has no alpha, so the opacity does not follow it");
        let note =
            note.help("name a picture of the opacity in `map_d`; --mtl-dialect spec uses the brightness of this one");
        self.findings.add(Severity::Note, "color-as-opacity", note);
        found.maps.retain(|map| map.statement.slot != MapSlot::Opacity);
    }
}

/// Returns true if a material without textures reflects, transmits and emits no light.
fn is_black(material: &Material) -> bool {
    let has_base = !material.diffuse.is_black() || !material.specular.is_black();
    let has_layers = material.clearcoat > 0.0 || !material.sheen.is_black();
    !has_base && !has_layers && !material.emits_or_transmits()
}

/// Uses the alpha of the colour texture as the opacity of an opaque material, if the texture is a
/// cut-out: a picture with transparent regions.
pub(super) fn add_cut_out(found: &mut FileMaterial) {
    if found.material.emits_or_transmits() || found.has_map(MapSlot::Opacity) {
        return;
    }
    let mut colors = found.maps.iter().filter(|map| map.statement.slot == MapSlot::Diffuse);
    let Some(request) = colors.next_back() else { return };
    let mut request = request.clone();
    request.if_cut_out = true;
    request.statement.slot = MapSlot::Opacity;
    let mapping = &mut request.statement.mapping;
    (mapping.channel, mapping.base, mapping.gain) = (Some(Channel::Matte), 0.0, 1.0);
    found.maps.push(request);
}
