use crate::io::PartFilter;
use crate::io::mtl::FileMaterial;
use crate::io::obj::ObjFile;
use crate::io::{Findings, Position};
use crate::scene::Scene;
use std::path::PathBuf;

/// Name of the material of faces without `usemtl`.
pub const DEFAULT_MATERIAL: &str = "default";

/// Contents of the files of a scene, including their errors.
#[derive(Debug)]
pub struct Inspection {
    /// The scene. Invalid parts are left out or replaced by defaults. `None` if no scene can be
    /// built.
    pub scene: Option<Scene>,
    /// Errors, missing parts, repairs and assumptions, in the order of their discovery.
    pub findings: Findings,
    /// Origins of the materials of the scene, indexed by the id of the material.
    pub materials: Vec<MaterialSource>,
    /// The OBJ files that were read without an error.
    pub objs: Vec<ObjSource>,
    /// Filter that selected which parts of the OBJ files were read.
    pub parts: PartFilter,
    /// Files of the scene's textures, indexed by the id of the texture.
    pub textures: Vec<PathBuf>,
    /// All files that were read. Outputs must not overwrite them.
    pub files: Vec<PathBuf>,
}

/// Origin of a material of the scene.
#[derive(Clone, Debug)]
pub struct MaterialSource {
    /// Name of the material.
    pub name: String,
    /// OBJ file whose faces use the material. `None` if the scene file defines the material, for
    /// all OBJ files.
    pub obj: Option<PathBuf>,
    /// File and position of the definition; `None` for the default material.
    pub place: Option<(PathBuf, Position)>,
    /// The material as its file defines it, with the patches of the scene file, before its textures
    /// are read.
    pub found: FileMaterial,
}

/// An OBJ file of the scene, and the materials of its libraries.
#[derive(Clone, Debug)]
pub struct ObjSource {
    /// Path of the file.
    pub path: PathBuf,
    /// Name, library and line of each material, in the order of the libraries.
    pub materials: Vec<(String, PathBuf, usize)>,
}

impl ObjSource {
    /// Path and materials of the OBJ file `obj`, which was read from `path`.
    pub fn new(path: PathBuf, obj: &ObjFile) -> Self {
        let named = |m: &FileMaterial| (m.material.name.clone(), m.library.clone(), m.line);
        let materials = obj.materials.iter().map(named).collect();
        Self { path, materials }
    }
}
