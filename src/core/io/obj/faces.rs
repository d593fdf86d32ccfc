use super::outline::{FaceRange, Outline};
use super::polygon::triangulate;
use super::{CHUNK_BYTES, read_text};
use super::{chunk::DataSelection, counts::Chunks, parse::parse};
use crate::io::FileError;
use crate::io::PartFilter;
use crate::io::normals::area_vector;
use crate::io::statements::{split_keyword, statements};
use crate::math::{DVec3, Vec2, Vec3};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Bound on the rounding error of an area in f64, as a fraction of the area of the polygon.
const ROUNDING: f64 = 1e-9;

/// Faces of an OBJ file before triangulation, each with its line.
pub struct ObjFaces {
    outline: Outline,
    materials: Vec<FaceMaterial>,
    /// Runs of consecutive faces with the same material, in the order of the file: index of the
    /// section, range of faces, and index of the material.
    runs: Vec<(usize, FaceRange, usize)>,
}

/// Name of the material of faces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaceMaterial {
    /// Name in `usemtl`; `None` before the first `usemtl`.
    pub name: Option<String>,
    /// Line of the first `usemtl` with that name; 0 if there is none.
    pub line: usize,
}

/// A face of at least three corners. Its indices of positions are valid.
#[derive(Clone, Copy, Debug)]
pub struct Face<'a> {
    /// Line of the face.
    pub line: usize,
    /// Index of its material in [`ObjFaces::materials`].
    pub material: usize,
    /// Index of each corner's position.
    pub positions: &'a [u32],
    /// Index of each corner's normal. The index of a corner without a normal is out of range. The
    /// list is empty if no corner has a normal.
    pub normals: &'a [u32],
    /// Index of each corner's texture coordinates. The index of a corner without texture
    /// coordinates is out of range. The list is empty if no corner has texture coordinates.
    pub uvs: &'a [u32],
    /// True if every corner has texture coordinates.
    pub has_uvs: bool,
}

impl ObjFaces {
    /// Reads a file as a render reads it. Wrong statements are left out. `defined` are the names of
    /// the materials that the libraries of the file define.
    pub fn read(path: &Path, parts: &PartFilter, defined: &HashSet<&str>) -> Result<Self, FileError> {
        let selection = DataSelection {
            origin: DVec3::ZERO,
            keep_lines: true,
            keep_wires: false,
            keep_names: false,
            parts,
        };
        let text = read_text(path)?;
        let mut outline = parse(path, &Chunks::count(&text, CHUNK_BYTES), selection, &|_| ())?;
        outline.set_whole_names(defined);
        let (mut materials, mut runs) = (Vec::new(), Vec::new());
        let mut index_of: HashMap<Option<&str>, usize> = HashMap::new();
        let (mut name, mut line) = (None, 0);
        for (section, content) in outline.sections.iter().enumerate() {
            for (state_change, faces) in content.states() {
                if state_change.material.is_some() {
                    (name, line) = (state_change.material.as_deref(), state_change.line);
                }
                if faces.is_empty() {
                    continue;
                }
                let index = *index_of.entry(name).or_insert_with(|| {
                    let name = name.map(str::to_string);
                    materials.push(FaceMaterial { name, line });
                    materials.len() - 1
                });
                runs.push((section, faces, index));
            }
        }
        Ok(Self {
            outline,
            materials,
            runs,
        })
    }

    /// Materials in the order of first use.
    pub fn materials(&self) -> &[FaceMaterial] {
        &self.materials
    }

    /// Values of all `v` lines.
    pub fn positions(&self) -> &[Vec3] {
        &self.outline.vertices.positions
    }

    /// Values of all `vt` lines.
    pub fn uvs(&self) -> &[Vec2] {
        &self.outline.vertices.uvs
    }

    /// Values of all `vn` lines, normalised. Zero if the normal in the file is invalid.
    pub fn normals(&self) -> &[Vec3] {
        &self.outline.vertices.normals
    }

    /// All faces, in the order of the file.
    pub fn faces(&self) -> impl Iterator<Item = Face<'_>> {
        self.runs.iter().flat_map(|(section, range, material)| {
            let section = &self.outline.sections[*section];
            let faces = section.faces(range).zip(section.lines(range));
            faces.map(|(corners, line)| Face {
                line,
                material: *material,
                positions: section.positions(corners.clone()),
                normals: section.normals(corners.clone()),
                uvs: section.uvs(corners.clone()),
                has_uvs: section.have_uvs(corners),
            })
        })
    }

    /// Returns true if all triangles into which the polygon `corners` is cut have the orientation
    /// of the polygon. The triangles then do not overlap.
    pub fn is_simple(corners: &[Vec3]) -> bool {
        let normal = area_vector(corners);
        let min = -ROUNDING * normal.length_squared();
        let mut is_simple = true;
        triangulate(corners, &mut |triangle| {
            let [a, b, c] = triangle.map(|i| corners.get(i).copied().unwrap_or_default());
            is_simple &= area_vector(&[a, b, c]).dot(normal) >= min;
        });
        is_simple
    }

    /// Line numbers of `v` statements in a file. `indices` are the indices of the statements,
    /// counted from 0 and sorted. The file is read again. The result is empty if the file cannot be
    /// read.
    pub fn lines_of_positions(path: &Path, indices: &[usize]) -> Vec<usize> {
        let Ok(text) = read_text(path) else {
            return Vec::new();
        };
        let all = statements(&text).filter(|(_, statement)| split_keyword(statement).0 == "v");
        let wanted = all.enumerate().filter(|(i, _)| indices.binary_search(i).is_ok());
        wanted.map(|(_, (line, _))| line).take(indices.len()).collect()
    }
}
