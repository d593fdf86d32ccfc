//! Conversion of presets to materials. The module `presets` lists the presets and their keys.

use super::{FileMaterial, MapSlot, MaterialSection};
use crate::color::Spectrum;
use crate::material::{Gloss, Material};
use crate::scene_file::mtl::MapRequest;
use crate::scene_file::presets::Preset;

impl Preset {
    /// Material section with the keys of the preset.
    pub(super) fn section(&self) -> MaterialSection {
        toml::from_str(self.keys).unwrap_or_default()
    }
}

/// `old` changed by a preset. `new` is the material that the preset defines without `old`. Opacity,
/// and bump, normal and displacement maps of `old` are kept. The diffuse texture of `old` is kept
/// if the preset has a diffuse reflection.
pub(super) fn applied(new: FileMaterial, old: &FileMaterial) -> FileMaterial {
    let has_pigment = has_pigment(&new.material);
    let stays = |request: &&MapRequest| match request.statement.slot {
        MapSlot::Opacity | MapSlot::Bump | MapSlot::Normal | MapSlot::Displacement => true,
        MapSlot::Diffuse => has_pigment,
        _ => false,
    };
    let is_textured = has_pigment && old.has_map(MapSlot::Diffuse);
    FileMaterial {
        material: Material {
            name: old.material.name.clone(),
            opacity: old.material.opacity,
            diffuse: if is_textured {
                old.material.diffuse
            } else {
                new.material.diffuse
            },
            ..new.material
        },
        maps: old.maps.iter().filter(stays).cloned().collect(),
        ..old.clone()
    }
}

/// Returns true if the colour of the material comes from its diffuse reflection.
fn has_pigment(material: &Material) -> bool {
    let is_metal = matches!(material.gloss, Gloss::Metallic(1.0));
    !is_metal && material.transmission == Spectrum::ZERO
}

#[cfg(test)]
mod tests;
