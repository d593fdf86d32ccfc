//! Tests of the OBJ reader: statements and their errors, meshes from faces, material libraries, and
//! random files.

mod libraries;
mod meshes;
mod random_files;
mod statements;

use super::*;
use crate::geometry::PrimId;
use crate::io::load_obj::load_obj;
use crate::math::Vec3;

/// Contents of an OBJ file, and the warnings about it.
#[derive(Debug)]
struct ReadObj {
    groups: Vec<Group>,
    materials: Vec<FileMaterial>,
    warnings: Vec<String>,
}

fn load_file(path: &Path, options: &LoadOptions) -> Result<ReadObj, FileError> {
    let mut findings = Findings::default();
    let ObjFile { groups, materials, .. } = load_obj(path, options, Allowance::default(), &(), &mut findings)?;
    match findings.first_error() {
        Some(error) => Err(error.clone()),
        None => Ok(ReadObj {
            groups,
            materials,
            warnings: findings.warnings().into_iter().map(|w| w.text).collect(),
        }),
    }
}

fn load_with(text: impl AsRef<[u8]>, options: &LoadOptions) -> Result<ReadObj, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.obj");
    fs::write(&path, text).unwrap();
    load_file(&path, options)
}

fn load(text: impl AsRef<[u8]>) -> Result<ReadObj, FileError> {
    load_with(text, &LoadOptions::default())
}

/// Reads a file. A wrong statement is an error.
fn load_strictly(text: impl AsRef<[u8]>) -> Result<ReadObj, FileError> {
    let options = LoadOptions {
        strict: true,
        ..LoadOptions::default()
    };
    load_with(text, &options)
}

/// Mesh of a file of one material, read without a warning.
fn mesh(text: &str) -> Mesh {
    let mut file = load(text).unwrap();
    assert_eq!((file.groups.len(), &file.warnings), (1, &vec![]), "{text}");
    file.groups.remove(0).mesh
}

/// Positions of the corners of triangle `t`.
fn corners(mesh: &Mesh, t: u32) -> [Vec3; 3] {
    mesh.corners(PrimId(t))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
