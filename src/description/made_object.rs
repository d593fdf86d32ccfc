use crate::geometry::Mesh;
use std::sync::Arc;

/// A mesh made in code that a program adds to a scene description, in addition to objects from
/// files.
#[derive(Clone, Debug)]
pub struct MadeObject {
    /// Name of the object.
    pub name: String,
    /// Triangles, in world space.
    pub mesh: Arc<Mesh>,
    /// Name of its material: of a section `[material.NAME]`, or in a library of the scene's OBJ
    /// files. `None` for the default material.
    pub material: Option<String>,
}
