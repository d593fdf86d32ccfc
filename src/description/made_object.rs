use crate::geometry::Mesh;
use std::sync::Arc;

/// A mesh that a program brings into a scene description, beside the objects that are read from files.
#[derive(Clone, Debug)]
pub struct MadeObject {
    /// Name of the object.
    pub name: String,
    /// Triangles, in world space.
    pub mesh: Arc<Mesh>,
    /// Name of its material: that of a section `[material.NAME]`, or of a library of the scene's OBJ files; `None` for the default one.
    pub material: Option<String>,
}
