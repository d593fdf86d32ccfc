use crate::io::PartFilter;
use crate::io::mtl::FileMaterial;
use crate::io::obj::ObjFile;
use crate::io::{Findings, Position};
use crate::scene::Scene;
use std::path::PathBuf;

/// Name of the material of faces that name none.
pub const DEFAULT_MATERIAL: &str = "default";

/// What the files of a scene say, wrong or not.
#[derive(Debug)]
pub struct Inspection {
    /// The scene as far as it can be had: what is wrong is left out of it, or replaced by a default.
    pub scene: Option<Scene>,
    /// Errors, missing parts, repairs and assumptions, in the order of their discovery.
    pub findings: Findings,
    /// The scene's materials, by their id.
    pub materials: Vec<MaterialSource>,
    /// The OBJ files that could be read.
    pub objs: Vec<ObjSource>,
    /// Parts of OBJ files that were read.
    pub parts: PartFilter,
    /// Files of the scene's textures, by their id.
    pub textures: Vec<PathBuf>,
    /// All files that were read; nothing may be written over them.
    pub files: Vec<PathBuf>,
}

/// Where a material of the scene is from.
#[derive(Clone, Debug)]
pub struct MaterialSource {
    /// Name of the material.
    pub name: String,
    /// The OBJ file whose faces use it; `None` where it is the scene file's and thus that of all of them.
    pub obj: Option<PathBuf>,
    /// Place of the definition; `None` for the default one.
    pub place: Option<(PathBuf, Position)>,
    /// Material as defined, patches included, before its textures are read.
    pub found: FileMaterial,
}

/// An OBJ file of the scene, and what its libraries define.
#[derive(Clone, Debug)]
pub struct ObjSource {
    /// The file.
    pub path: PathBuf,
    /// Names of materials, in the order of their libraries, with library and line.
    pub materials: Vec<(String, PathBuf, usize)>,
}

impl ObjSource {
    /// Inspection of `obj`, which was read from `path`.
    pub fn new(path: PathBuf, obj: &ObjFile) -> Self {
        let named = |m: &FileMaterial| (m.material.name.clone(), m.library.clone(), m.line);
        let materials = obj.materials.iter().map(named).collect();
        Self { path, materials }
    }
}
