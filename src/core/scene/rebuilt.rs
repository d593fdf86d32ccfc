//! Rebuilding of a scene with other lights. Triangles, parts and textures of the first scene are
//! moved to the second scene, so that no file is read twice.

use super::{Scene, SceneBuilder};
use crate::material::MaterialId;
use std::sync::Arc;

/// State of a builder before lights were added. Triangles and textures are left out, because the
/// built scene contains them.
#[derive(Debug)]
pub struct UnlitBuilder {
    builder: SceneBuilder,
    /// Number of meshes that are not part of a prototype, and number of meshes of each prototype.
    world_mesh_count: usize,
    prototypes: Vec<usize>,
    /// Number of meshes in the scene that are not part of a prototype, including meshes of lamps.
    world_meshes_in_scene: usize,
}

impl UnlitBuilder {
    /// Copies materials, texture filter and treatment of panes from `lit`, which is the same
    /// builder after its lights and textures were added.
    pub fn complete(&mut self, lit: &SceneBuilder) {
        let count = self.builder.materials.len();
        self.builder.materials = lit.materials.iter().take(count).cloned().collect();
        self.builder.texture_filter = lit.texture_filter;
        self.builder.panes = lit.panes;
        self.world_meshes_in_scene = lit.meshes.len();
    }

    /// Moves the triangles and textures of `scene` to this builder and returns the builder. `scene`
    /// was built from a copy of this builder. `None` if the triangles of `scene` cannot be moved:
    /// the scene is compact, has panes, has other meshes than this builder, or shares its meshes
    /// with other code.
    pub fn with_parts_of(self, scene: Scene) -> Option<SceneBuilder> {
        let Self {
            mut builder,
            world_mesh_count,
            prototypes,
            world_meshes_in_scene,
        } = self;
        let ground = usize::from(scene.ground.is_some());
        let is_as_built = !scene.is_compact
            && scene.panes == 0
            && scene.world_meshes().len() == world_meshes_in_scene + ground
            && scene
                .prototypes
                .iter()
                .map(|range| range.len())
                .eq(prototypes.iter().copied());
        if !is_as_built {
            return None;
        }
        let materials: Vec<MaterialId> = scene.shapes.iter().map(|shape| shape.material).collect();
        let meshes = Arc::try_unwrap(scene.meshes).ok()?;
        let mut all = meshes.into_iter().zip(materials);
        builder.meshes = all.by_ref().take(world_mesh_count).collect();
        let lamps = world_meshes_in_scene + ground - world_mesh_count;
        all.by_ref().take(lamps).for_each(drop);
        builder.prototypes = prototypes
            .into_iter()
            .map(|count| all.by_ref().take(count).collect())
            .collect();
        builder.textures = scene.textures;
        builder.parts = scene.parts;
        Some(builder)
    }
}

impl SceneBuilder {
    /// State of this builder without triangles and textures.
    pub fn unlit(&self) -> UnlitBuilder {
        UnlitBuilder {
            world_mesh_count: self.meshes.len(),
            prototypes: self.prototypes.iter().map(Vec::len).collect(),
            world_meshes_in_scene: self.meshes.len(),
            builder: self.without_parts(),
        }
    }
}
