//! OBJ and MTL files read by the tobj crate. It is a second implementation, with which the test
//! tests/it/files/readers.rs compares the program's own reader.
//!
//! Values, faces and statements of materials are as tobj reads them. Polygons are cut as fans,
//! smoothing groups and continued lines are not supported, and a library is found by its exact name
//! only. `mtl` interprets the statements of materials for both readers. tobj reports no line
//! numbers. It panics on some files, and these panics are caught. docs/guide/reference/obj-mtl.md
//! lists the differences.

mod materials;

use super::mtl::{FileMaterial, ObjContext, Signature, library_path};
use super::obj::{FacelessFile, Group, ObjFile, Twins, chosen_origin, no_faces};
use super::{FileError, Findings, LoadObserver, LoadOptions, Severity};
use crate::files::input::Input;
use crate::files::memory::Allowance;
use crate::files::{guarded, read_text};
use crate::geometry::{Mesh, triangle_normal};
use crate::math::{Vec2, Vec3};
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::BufRead;
use std::path::{Path, PathBuf};

const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: true,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Memory of tobj and its meshes, in bytes per byte of the file. Only files with very short lines
/// need more: 24 bytes per byte for lines of 8 bytes.
const BYTES_OF_A_BYTE: u64 = 12;

/// Triangles that are consecutive in the file and share a material.
struct MaterialRun {
    /// Name of the material. `None` if there is none, or if no library before the `usemtl` defines
    /// it.
    material: Option<String>,
    /// The triangles. Texture coordinates or normals are left out if some corners lack them.
    mesh: Mesh,
}

/// Result of reading a library with tobj: the materials with their indices by name, or an error.
type Materials = tobj::MTLLoadResult;

/// Reads an OBJ file. `library` is a function that reads the library with a given name. The error
/// is the reason why tobj cannot read the file.
fn read_parts(
    reader: &mut impl BufRead,
    library: &dyn Fn(&Path) -> Materials,
) -> Result<(Vec<MaterialRun>, Vec<tobj::Material>), String> {
    let (models, materials) = guarded(|| tobj::load_obj_buf(reader, &OPTIONS, library))
        .map_err(panicked)?
        .map_err(|error| error.to_string())?;
    // If no material was read, `materials` is the error of the last library.
    let materials = materials.unwrap_or_default();
    let name = |id: usize| materials.get(id).map(|material| material.name.clone());
    let parts = models.into_iter().map(|model| MaterialRun {
        material: model.mesh.material_id.and_then(name),
        mesh: mesh(model.mesh),
    });
    let parts = parts.filter(|part| !part.mesh.triangles.is_empty()).collect();
    Ok((parts, materials))
}

/// Reads a library. The error is the reason why tobj cannot read it.
fn read_library(reader: &mut impl BufRead) -> Result<Materials, String> {
    let read = guarded(|| tobj::load_mtl_buf(reader)).map_err(panicked)?;
    match read {
        Ok(read) => Ok(Ok(read)),
        Err(error) => Err(error.to_string()),
    }
}

fn panicked(message: String) -> String {
    format!("it panics: {message}")
}

/// Converts a mesh of tobj. Texture coordinates and normals are used only if there are as many of
/// them as positions, because tobj leaves out missing values.
fn mesh(read: tobj::Mesh) -> Mesh {
    let positions: Vec<Vec3> = read.positions.chunks_exact(3).map(Vec3::from_slice).collect();
    let mut uvs: Vec<Vec2> = read.texcoords.chunks_exact(2).map(Vec2::from_slice).collect();
    for uv in uvs.iter_mut().filter(|uv| !uv.is_finite()) {
        *uv = Vec2::ZERO;
    }
    let unit = |n: &[f32]| Vec3::from_slice(n).as_dvec3().normalize_or_zero().as_vec3a();
    let mut normals: Vec<Vec3> = read.normals.chunks_exact(3).map(unit).collect();
    if uvs.len() != positions.len() {
        uvs.clear();
    }
    if normals.len() != positions.len() || normals.contains(&Vec3::ZERO) {
        normals.clear();
    }
    let triangle = |t: &[u32]| [t[0], t[1], t[2]];
    Mesh {
        positions,
        triangles: read.indices.chunks_exact(3).map(triangle).collect(),
        normals,
        uvs,
        ..Mesh::default()
    }
}

/// Reads an OBJ file and its libraries. The option `smooth` is not applied; `load_obj` applies it.
pub(super) fn read_obj(
    path: &Path,
    options: &LoadOptions,
    allowance: Allowance,
    observer: &dyn LoadObserver,
    findings: &mut Findings,
) -> Result<ObjFile, FileError> {
    let input = Input::open(path, "the OBJ file")?;
    let (length, failure) = (input.length(), input.failure());
    allowance.check(path, BYTES_OF_A_BYTE * length)?;
    observer.begin(&format!("reading {} by tobj", path.display()), length);
    // Collect the libraries in the order of their lines, each with its materials.
    let libraries: RefCell<Vec<(PathBuf, Vec<tobj::Material>)>> = RefCell::default();
    let lacks: RefCell<Findings> = RefCell::default();
    let library = |name: &Path| {
        let path = library_path(path, &name.to_string_lossy());
        match open_library(path.clone(), options, &mut lacks.borrow_mut()) {
            Some(read) => {
                if let Ok((materials, _)) = &read {
                    libraries.borrow_mut().push((path, materials.clone()));
                }
                read
            }
            None => Ok(Default::default()),
        }
    };
    let read = read_parts(&mut std::io::BufReader::new(input), &library);
    let (parts, _) = read.map_err(|refusal| failure.or(path, refused(path, &refusal)))?;
    observer.advance(length);
    findings.extend(lacks.into_inner());
    // Read the text again, because the comments name the program that wrote the file and tobj skips
    // comments
    let text = read_text(path, "the OBJ file").ok();
    let context = ObjContext {
        signature: text.and_then(|text| Signature::find(&text)),
        ..ObjContext::default()
    };
    let (mut materials, mut files): (Vec<FileMaterial>, Vec<PathBuf>) = Default::default();
    for (file, read) in libraries.into_inner() {
        if !files.contains(&file) {
            let read = materials::load(&file, &context, &read, options.library_options(), findings);
            materials.extend(read);
            files.push(file);
        }
    }
    let mut groups = into_groups(parts);
    // tobj has already rounded the coordinates to 32 bits, so the origin is subtracted in 32 bits.
    let origin = chosen_origin(path, options).as_vec3a();
    if origin != Vec3::ZERO {
        groups
            .iter_mut()
            .flat_map(|group| &mut group.mesh.positions)
            .for_each(|p| *p -= origin);
    }
    if groups.is_empty() {
        return Err(no_faces(path, FacelessFile::default()));
    }
    let is_finite = |group: &Group| group.mesh.positions.iter().all(|p| p.is_finite());
    if !groups.iter().all(is_finite) {
        let error = FileError::new(path, "a coordinate of a vertex is not finite");
        return Err(error.help(HELP));
    }
    Ok(ObjFile::new(groups, materials, files))
}

const HELP: &str = "--obj-reader own names the wrong line, and reads more files";

fn refused(path: &Path, refusal: &str) -> FileError {
    FileError::new(path, format!("tobj refuses this file: {refusal}")).help(HELP)
}

/// Reads the library `path` with tobj. If it cannot be read, adds a finding and returns `None`.
fn open_library(path: PathBuf, options: &LoadOptions, findings: &mut Findings) -> Option<Materials> {
    if !path.metadata().is_ok_and(|metadata| !metadata.is_dir()) {
        let missing = FileError::new(&path, "this material library is missing");
        let help = "put the file there; until then the default material replaces its materials";
        findings.add(options.severity_of_lack(), "missing-library", missing.help(help));
        return None;
    }
    let opened = Input::open(&path, "the material library");
    let read = opened.and_then(|input| {
        let failure = input.failure();
        let read = read_library(&mut std::io::BufReader::new(input));
        read.map_err(|refusal| failure.or(&path, refused(&path, &refusal)))
    });
    read.map_err(|error| findings.add(Severity::Error, "unreadable-file", error))
        .ok()
}

/// Triangles of each material, in the order of first use. Triangles without texture coordinates are
/// in another group than triangles with texture coordinates.
fn into_groups(parts: Vec<MaterialRun>) -> Vec<Group> {
    let mut members: Vec<Vec<MaterialRun>> = Vec::new();
    let mut index_of: HashMap<(Option<String>, bool), usize> = HashMap::new();
    for part in parts {
        let key = (part.material.clone(), !part.mesh.uvs.is_empty());
        let index = *index_of.entry(key).or_insert(members.len());
        match members.get_mut(index) {
            Some(members) => members.push(part),
            None => members.push(vec![part]),
        }
    }
    members.into_iter().map(joined).collect()
}

/// Joins parts of one material to a group. Either all parts have texture coordinates, or none has.
/// If some parts have normals, the other parts get the normals of their triangles.
fn joined(parts: Vec<MaterialRun>) -> Group {
    let material = parts.first().and_then(|part| part.material.clone());
    let has_normals = parts.iter().any(|part| !part.mesh.normals.is_empty());
    let mut meshes = parts.into_iter().map(|part| completed(part.mesh, has_normals));
    let mut mesh = meshes.next().unwrap_or_default();
    for mut more in meshes {
        let first = mesh.positions.len() as u32;
        mesh.triangles
            .extend(more.triangles.iter().map(|t| t.map(|v| first + v)));
        mesh.positions.append(&mut more.positions);
        mesh.normals.append(&mut more.normals);
        mesh.uvs.append(&mut more.uvs);
    }
    Group {
        rules: Vec::new(),
        material,
        line: 0,
        mesh,
        twins: Twins::default(),
    }
}

/// If `has_normals` is true and `mesh` has no normals, computes the normals of its triangles.
fn completed(mesh: Mesh, has_normals: bool) -> Mesh {
    if !has_normals || !mesh.normals.is_empty() {
        return mesh;
    }
    let mut flat = Mesh::default();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners;
        let normal = Some(triangle_normal(a, b, c)).filter(|&n| n != Vec3::ZERO);
        let first = flat.positions.len() as u32;
        flat.triangles.push([first, first + 1, first + 2]);
        flat.positions.extend(corners);
        flat.normals.extend([normal.unwrap_or(Vec3::Z); 3]);
        flat.uvs
            .extend(triangle.iter().filter_map(|&v| mesh.uvs.get(v as usize)));
    }
    flat
}

#[cfg(test)]
mod tests;
