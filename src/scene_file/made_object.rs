use crate::geometry::Mesh;
use std::sync::Arc;

/// A mesh that a program made in code. The program adds it to a scene description, in addition to
/// objects from files.
#[derive(Clone, Debug)]
pub struct MadeObject {
    /// Name of the object.
    pub name: String,
    /// Triangles of the object, in world space.
    pub mesh: Arc<Mesh>,
    /// Name of the material: a section `[material.NAME]`, or a material in a library of the scene's
    /// OBJ files. `None` for the default material.
    pub material: Option<String>,
}
