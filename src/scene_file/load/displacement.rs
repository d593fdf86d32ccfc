//! Displacement of the objects of a scene by the textures of their materials.

use super::Loader;
use super::textures::{kind_of, mapping_of_tiles};
use crate::geometry::Mesh;
use crate::io::displacement::{BYTES_OF_VERTEX, HeightMap, displace};
use crate::io::{DisplacementUse, Tiles};
use crate::material::MaterialId;
use crate::math::significant;
use crate::scene_file::mtl::{MapRequest, MapSlot};
use crate::scene_file::texture::{TextureRequest, load_textures_within};
use crate::scene_file::{FileError, Finding, Severity};
use crate::texture::{Mapping, Texture, TextureFilter};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Height map of a material.
#[derive(Clone, Debug)]
pub(super) struct DisplacementMap {
    texture: Rc<Texture>,
    mapping: Mapping,
}

impl DisplacementMap {
    fn map(&self, filter: TextureFilter) -> HeightMap<'_> {
        HeightMap {
            texture: &self.texture,
            mapping: self.mapping,
            filter,
        }
    }
}

impl Loader<'_> {
    /// Displaces the meshes of an object of the file `obj` whose materials have a height map.
    /// `is_fine` is true if the object was subdivided.
    pub(super) fn displace_object(
        &mut self,
        meshes: &mut [(Mesh, MaterialId)],
        obj: &Path,
        is_fine: bool,
    ) -> Result<(), FileError> {
        let mut heights = Vec::with_capacity(meshes.len());
        for (mesh, material) in meshes.iter() {
            heights.push(self.heights_of(*material, mesh, obj, is_fine)?);
        }
        if heights.iter().all(Option::is_none) {
            return Ok(());
        }
        let vertices: u64 = meshes.iter().map(|(mesh, _)| mesh.positions.len() as u64).sum();
        self.allowance.check(obj, vertices * BYTES_OF_VERTEX)?;
        let filter = self.file.load.parameters.texture_filter();
        let maps: Vec<Option<HeightMap>> = heights
            .iter()
            .map(|heights| heights.as_ref().map(|heights| heights.map(filter)))
            .collect();
        let mut of_object: Vec<&mut Mesh> = meshes.iter_mut().map(|(mesh, _)| mesh).collect();
        if let Some([min, max]) = displace(&mut of_object, &maps) {
            let [low, high] = [min, max].map(|height| significant(height.into(), 3));
            let message = format!("displacement: vertices move by {low} to {high} units along their normals");
            let error = FileError::new(obj, message);
            let error = error.help("--displacement off does not move the vertices");
            self.findings.add(Severity::Note, "displacement", error);
        }
        Ok(())
    }

    /// Height map of a material for `mesh`; `None` if the material has no height map.
    fn heights_of(
        &mut self,
        material: MaterialId,
        mesh: &Mesh,
        obj: &Path,
        is_fine: bool,
    ) -> Result<Option<DisplacementMap>, FileError> {
        let id = material.0 as usize;
        let Some(source) = self.materials.get(id) else {
            return Ok(None);
        };
        let is_map = |request: &&MapRequest| request.statement.slot == MapSlot::Displacement;
        let Some(request) = source.found.maps.iter().find(is_map).cloned() else {
            return Ok(None);
        };
        let name = source.name.clone();
        match self.file.load.parameters.displacement() {
            DisplacementUse::Off => return Ok(None),
            DisplacementUse::Auto if !is_fine && !request.is_literal => {
                self.report_idle(&request);
                return Ok(None);
            }
            DisplacementUse::Auto | DisplacementUse::On => {}
        }
        if mesh.uvs.is_empty() {
            let warning = request.remark("displaces nothing: the faces have no texture coordinates");
            let warning = warning.help("export the mesh with its texture coordinates (`vt` lines)");
            self.findings.add(Severity::Warning, "idle-displacement", warning);
            return Ok(None);
        }
        if let Some(known) = self.heights.get(&material) {
            return Ok(known.clone());
        }
        let heights = self.read_heights(&request, &name, obj)?;
        if let Some((_, path)) = &heights {
            let maps = &mut self.materials[id].found.maps;
            let of_slot = maps
                .iter_mut()
                .filter(|map| map.statement.slot == MapSlot::Displacement);
            of_slot.for_each(|map| map.path = Some(path.clone()));
        }
        let heights = heights.map(|(heights, _)| heights);
        self.heights.insert(material, heights.clone());
        Ok(heights)
    }

    /// Reads the texture that the material `name` requests. Also returns the path of the texture's
    /// file.
    fn read_heights(
        &mut self,
        request: &MapRequest,
        name: &str,
        obj: &Path,
    ) -> Result<Option<(DisplacementMap, PathBuf)>, FileError> {
        let Some(path) = self.find_texture(request, name, obj) else {
            return Ok(None);
        };
        let mut mapping = request.statement.mapping;
        if let Some(tiles) = Tiles::of_path(&path) {
            mapping = mapping_of_tiles(mapping, &tiles);
        }
        let wanted = TextureRequest {
            path: path.clone(),
            kind: kind_of(request),
            wrap: mapping.wrap,
            is_mean: false,
        };
        let loaded = load_textures_within(&[wanted], self.allowance, self.observer)?;
        for warning in loaded.warnings {
            self.findings.add(Severity::Warning, "bad-texels", warning);
        }
        self.files.push(path.clone());
        match loaded.ids.into_iter().next() {
            Some(Err(error)) => {
                let error = FileError {
                    message: format!("{}: {}", error.file.display(), error.message),
                    help: error.help,
                    ..request.place.clone()
                };
                self.findings
                    .add(self.file.load.severity_of_lack(), "unreadable-texture", error);
                Ok(None)
            }
            _ => Ok(loaded.textures.into_iter().next().map(|texture| {
                let texture = Rc::new(texture);
                (DisplacementMap { texture, mapping }, path)
            })),
        }
    }

    /// Reports a displacement statement of a library that has no effect, once for each library.
    fn report_idle(&mut self, request: &MapRequest) {
        let file = &request.place.file;
        let is_same = |finding: &Finding| finding.code == "idle-displacement" && finding.error.file == *file;
        if self.findings.iter().any(is_same) {
            return;
        }
        let warning = request.remark("displaces nothing: the object is not subdivided");
        let warning =
            warning.help("use --subdivide 5 for small faces, or --displacement on to displace the faces of the file");
        self.findings.add(Severity::Warning, "idle-displacement", warning);
    }
}
