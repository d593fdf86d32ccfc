//! Meshes from the faces of an OBJ file. Faces are in the same mesh if they have the same material
//! and the same list of scene-file rules that change the material. Faces with texture coordinates
//! and faces without are in two meshes.
//!
//! Faces are cut into triangles (`polygon`), and each distinct triple of indices becomes a vertex.
//! If only some corners have normals, the other corners get normals from smoothing groups
//! (`smoothing`) or from the triangle. These normals are stored after the normals of the file and
//! also get indices. So the rule that each distinct triple of indices is a vertex is valid for
//! them, too.

use super::Group;
use super::colors::Colors;
use super::outline::{FaceRange, NONE, Outline, Section, VertexData};
use super::parts::MaterialRules;
use super::polygon::triangulate;
use super::twins::{CoincidentFaces, Twins};
use crate::geometry::{Mesh, UNNAMED, triangle_normal};
use crate::math::{Vec2, Vec3};
use std::collections::HashMap;

/// Faces of one material and one list of rules.
pub(super) struct Faces {
    /// Name in the `usemtl` statement; `None` before the first `usemtl`.
    pub material: Option<String>,
    /// Line of the first `usemtl` with that name; 0 if there is none.
    pub line: usize,
    /// Index of the list of rules that apply to the parts of these faces.
    pub rules: u32,
    /// Runs of faces in the order of the file.
    pub runs: Vec<FaceRun>,
}

/// Consecutive faces of one material and one smoothing group.
pub(super) struct FaceRun {
    /// Index of the section with the faces.
    pub section: usize,
    /// Faces of the run.
    pub faces: FaceRange,
    /// Smoothing group of the faces; 0 for none.
    pub smoothing: u32,
}

/// Faces by material, rules and existence of texture coordinates, in the order of first use.
pub(super) fn by_material(sections: &[Section], rules: &MaterialRules) -> Vec<Faces> {
    let mut all: Vec<Faces> = Vec::new();
    let mut index_of: HashMap<(Option<&str>, u32, bool), usize> = HashMap::new();
    let (mut material, mut line, mut smoothing) = (None, 0, 0);
    for (index, section) in sections.iter().enumerate() {
        for (state_change, faces) in section.states() {
            if state_change.material.is_some() {
                (material, line) = (state_change.material.as_deref(), state_change.line);
            }
            smoothing = state_change.smoothing.unwrap_or(smoothing);
            if faces.is_empty() {
                continue;
            }
            let ranges = if rules.is_empty() {
                vec![(0, faces)]
            } else {
                section.split_by(&faces, |part| rules.list_of(part))
            };
            let ranges = ranges.into_iter().flat_map(|(rules, faces)| {
                let by_uvs = section.split_by_uvs(faces).into_iter();
                by_uvs.map(move |(has_uvs, faces)| (rules, has_uvs, faces))
            });
            for (rules, has_uvs, faces) in ranges {
                let group = *index_of.entry((material, rules, has_uvs)).or_insert_with(|| {
                    all.push(Faces {
                        material: material.map(str::to_string),
                        line,
                        rules,
                        runs: Vec::new(),
                    });
                    all.len() - 1
                });
                all[group].runs.push(FaceRun {
                    section: index,
                    faces,
                    smoothing,
                });
            }
        }
    }
    all
}

impl Faces {
    /// Converts the faces to triangles. `index` is the index of the group in `coincident`.
    pub fn into_group(
        self,
        index: usize,
        (outline, colors): (&Outline, &Colors),
        rules: &MaterialRules,
        coincident: &CoincidentFaces,
    ) -> Group {
        Group {
            rules: rules.list(self.rules).to_vec(),
            mesh: mesh(outline, colors, &self.runs),
            twins: self.twins(index, outline, coincident),
            material: self.material,
            line: self.line,
        }
    }

    /// Triangles of the faces that lie on the back of each other.
    fn twins(&self, index: usize, outline: &Outline, coincident: &CoincidentFaces) -> Twins {
        let twins_of = coincident.twins_of(index);
        if twins_of.is_empty() {
            return Twins::default();
        }
        let mut pairs = vec![[0..0, 0..0]; twins_of.len() / 2];
        let mut first = 0;
        for run in &self.runs {
            for face in outline.sections[run.section].faces(&run.faces) {
                let end = first + face.len() as u32 - 2;
                if let Some(&(pair, side)) = twins_of.get(&(run.section, face.start)) {
                    pairs[pair][side] = first..end;
                }
                first = end;
            }
        }
        let gap = coincident.gap();
        Twins { pairs, gap }
    }
}

/// Cuts faces into triangles, and joins equal corners into vertices.
fn mesh(outline: &Outline, colors: &Colors, runs: &[FaceRun]) -> Mesh {
    let Outline { vertices, sections, .. } = outline;
    let all = || {
        runs.iter().flat_map(|run| {
            let section = &sections[run.section];
            section.faces(&run.faces).map(move |face| (section, face))
        })
    };
    let parts = || runs.iter().flat_map(|run| sections[run.section].parts(&run.faces));
    let any_corner = |has: &dyn Fn(&Section, usize) -> bool| all().any(|(s, mut face)| face.any(|i| has(s, i)));
    let has_uvs = any_corner(&|section, i| section.corner(i)[1] != NONE);
    let has_normals = any_corner(&|section, i| vertices.has_normal(section, i));
    let triangles: usize = all().map(|(_, face)| face.len() - 2).sum();
    let mut builder = MeshBuilder {
        vertices,
        colors,
        has_uvs,
        has_normals,
        index_of: VertexIndex::new(!has_uvs && !has_normals, 3 * triangles, vertices.positions.len()),
        mesh: Mesh {
            triangles: Vec::with_capacity(triangles),
            ..Mesh::default()
        },
    };
    // If all faces belong to one part, the mesh needs no list of parts.
    let mut of_faces = parts();
    let first = of_faces.next().unwrap_or(UNNAMED);
    let has_parts = of_faces.any(|part| part != first);
    let mut of_triangles = Vec::with_capacity(if has_parts { triangles } else { 0 });
    if !has_parts {
        of_triangles.extend(Some(first).filter(|&part| part != UNNAMED));
    }
    let mut corners: Vec<Vec3> = Vec::new();
    for ((section, face), part) in all().zip(parts()) {
        let before = builder.mesh.triangles.len();
        if face.len() > 3 {
            corners.clear();
            corners.extend(face.clone().map(|i| vertices.position(section, i)));
            triangulate(&corners, &mut |t| builder.add(section, t.map(|k| face.start + k)));
        } else {
            builder.add(section, [face.start, face.start + 1, face.start + 2]);
        }
        if has_parts {
            let added = builder.mesh.triangles.len() - before;
            of_triangles.extend(std::iter::repeat_n(part, added));
        }
    }
    builder.mesh.parts = of_triangles;
    builder.mesh
}

struct MeshBuilder<'a> {
    vertices: &'a VertexData,
    colors: &'a Colors,
    has_uvs: bool,
    has_normals: bool,
    index_of: VertexIndex,
    mesh: Mesh,
}

impl MeshBuilder<'_> {
    /// Adds the triangle with the corners `corners` of a section.
    fn add(&mut self, section: &Section, corners: [usize; 3]) {
        let flat = self.vertices.normals.len() + self.mesh.triangles.len();
        let keys = corners.map(|i| match section.corner(i) {
            key if self.vertices.has_normal(section, i) => key,
            // Each triangle has a separate flat normal, with an index after the normals of the
            // file.
            [v, vt, _] if self.has_normals => [v, vt, flat as u32],
            [v, vt, _] => [v, vt, NONE],
        });
        let triangle = keys.map(|key| self.vertex(key, keys));
        self.mesh.triangles.push(triangle);
    }

    /// Returns the vertex for a corner of `triangle`, and adds it if it is new. `key` has the
    /// corner's indices of position, texture coordinates and normal.
    fn vertex(&mut self, key: [u32; 3], triangle: [[u32; 3]; 3]) -> u32 {
        let new = self.mesh.positions.len() as u32;
        let index = self.index_of.find_or_add(key, new);
        if index == new {
            let position = |[v, ..]: [u32; 3]| self.vertices.positions[v as usize];
            let [_, vt, vn] = key.map(|i| i as usize);
            self.mesh.positions.push(position(key));
            let v = key[0] as usize;
            self.mesh.colors.extend(self.colors.rgb.get(v));
            self.mesh.alphas.extend(self.colors.alpha.get(v));
            if self.has_uvs {
                self.mesh
                    .uvs
                    .push(self.vertices.uvs.get(vt).copied().unwrap_or(Vec2::ZERO));
            }
            if self.has_normals {
                let normal = self.vertices.normals.get(vn).copied().unwrap_or_else(|| {
                    let [p0, p1, p2] = triangle.map(position);
                    // Triangles without area have no normal. They are never visible, so use any
                    // vector.
                    Some(triangle_normal(p0, p1, p2))
                        .filter(|&n| n != Vec3::ZERO)
                        .unwrap_or(Vec3::Z)
                });
                self.mesh.normals.push(normal);
            }
        }
        index
    }
}

/// Finds the vertex of a corner's position, texture coordinates and normal.
enum VertexIndex {
    /// Table with one entry per position, if corners have only positions.
    Table(Vec<u32>),
    Map(HashMap<[u32; 3], u32>),
}

impl VertexIndex {
    /// Index for a mesh of `corners` corners, of a file with `positions` positions. `is_plain` is
    /// true if the corners have only positions.
    fn new(is_plain: bool, corners: usize, positions: usize) -> Self {
        // For a small part of a file, a table would take more memory than the part.
        if is_plain && positions <= 4 * corners {
            Self::Table(vec![NONE; positions])
        } else {
            Self::Map(HashMap::new())
        }
    }

    /// Returns the vertex with the key `key`, or inserts `new` and returns it if there is none.
    fn find_or_add(&mut self, key: [u32; 3], new: u32) -> u32 {
        match self {
            Self::Table(of_position) => {
                let slot = &mut of_position[key[0] as usize];
                if *slot == NONE {
                    *slot = new;
                }
                *slot
            }
            Self::Map(of_key) => *of_key.entry(key).or_insert(new),
        }
    }
}
