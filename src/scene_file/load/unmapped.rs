//! Faces of textured materials that have no texture coordinates. They show the means of the
//! textures.

use super::{Loader, UsedMaterial};
use crate::geometry::Mesh;
use crate::material::MaterialId;
use crate::math::excerpt_of_name;
use crate::scene_file::mtl::{FileMaterial, MapSlot};
use crate::scene_file::{FileError, Severity};
use std::path::Path;

/// Triangles of a textured material that have no texture coordinates.
#[derive(Default)]
pub(super) struct UnmappedTriangles {
    triangles: usize,
    /// True if vertices have colours, which then replace the texture of the diffuse colour.
    is_colored: bool,
}

impl Loader<'_> {
    /// The material `used`, if it was added before. If it has no textures, faces with and without
    /// texture coordinates share it.
    pub(super) fn known_material(&self, used: &UsedMaterial) -> Option<MaterialId> {
        let known = self.used.get(used).copied();
        let shared = || {
            let of_others = UsedMaterial {
                lacks_uvs: false,
                ..used.clone()
            };
            let id = *self.used.get(&of_others)?;
            let source = self.materials.get(id.0 as usize)?;
            (!has_textures(&source.found)).then_some(id)
        };
        known.or_else(|| used.lacks_uvs.then(shared).flatten())
    }

    /// Prepares the textured material `found` of the OBJ file `path` for faces without texture
    /// coordinates, of which `mesh` consists.
    pub(super) fn unmap(&mut self, found: &mut FileMaterial, path: &Path, mesh: &Mesh) {
        let key = (path.to_path_buf(), found.material.name.clone());
        let is_colored = !mesh.colors.is_empty();
        self.unmapped.entry(key).or_default().is_colored = is_colored;
        // A texture without coordinates does not give the colour, so the vertices give it.
        let is_left_out = |slot: MapSlot| slot == MapSlot::Diffuse && is_colored;
        found
            .maps
            .retain(|request| !request.if_cut_out && !is_left_out(request.statement.slot));
    }

    /// Counts the triangles of `mesh`, if its material `id` has textures that need texture
    /// coordinates.
    pub(super) fn count_unmapped(&mut self, id: MaterialId, mesh: &Mesh) {
        let key = self.unmapped_materials.get(&id);
        if let Some(unmapped) = key.and_then(|key| self.unmapped.get_mut(key)) {
            unmapped.triangles += mesh.triangles.len();
        }
    }

    /// Reports textured materials whose faces have no texture coordinates, once for each material.
    /// `embrasure check` reports them with the lines of the faces.
    pub(super) fn report_unmapped(&mut self) {
        for ((path, name), unmapped) in std::mem::take(&mut self.unmapped) {
            if self.continues_after_errors || unmapped.triangles == 0 {
                continue;
            }
            let (triangles, verb) = match unmapped.triangles {
                1 => ("1 triangle".to_string(), "has"),
                n => (format!("{n} triangles"), "have"),
            };
            let look = if unmapped.is_colored {
                "the colours of their vertices, and the mean of each other texture"
            } else {
                "the mean colour of the texture"
            };
            let message = format!(
                "{triangles} of the textured material `{}` {verb} no texture coordinates; {} {look}",
                excerpt_of_name(&name),
                if unmapped.triangles == 1 {
                    "it shows"
                } else {
                    "they show"
                }
            );
            let error = FileError::new(&path, message).help("export texture coordinates (`vt`)");
            self.findings
                .add(Severity::Warning, "missing-texture-coordinates", error);
        }
    }
}

/// Returns true if a material has textures that surfaces show. Displacement does not count.
pub(super) fn has_textures(found: &FileMaterial) -> bool {
    let mut maps = found.maps.iter();
    maps.any(|request| request.statement.slot != MapSlot::Displacement && !request.if_cut_out)
}
