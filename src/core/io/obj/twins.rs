//! Pairs of faces at the same place, as `sides` finds them.

use crate::geometry::Mesh;
use crate::math::Vec3;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// Pairs of faces of one mesh that lie at the same place, with opposite orders of their corners.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Twins {
    /// Ranges of the triangles of both faces, for each pair.
    pub pairs: Vec<[Range<u32>; 2]>,
    /// Distance by which [`Twins::move_apart`] moves a face.
    pub gap: f32,
}

impl Twins {
    /// Moves both faces of each pair apart, each along its normal. Vertices of these faces are
    /// copied, so that other faces do not move.
    pub fn move_apart(&self, mesh: &mut Mesh) {
        for face in self.pairs.iter().flatten() {
            let triangles = face.start as usize..face.end as usize;
            let Some(corners) = mesh.triangles.get(triangles.clone()).map(<[_]>::to_vec) else {
                continue;
            };
            let offset = |positions: &[Vec3]| {
                let areas = corners.iter().map(|triangle| {
                    let [a, b, c] = triangle.map(|i| positions[i as usize]);
                    (b - a).cross(c - a)
                });
                self.gap * areas.sum::<Vec3>().normalize_or_zero()
            };
            let open = offset(&mesh.positions);
            let close = (!mesh.positions_close.is_empty()).then(|| offset(&mesh.positions_close));
            let mut copies: BTreeMap<u32, u32> = BTreeMap::new();
            for (triangle, corners) in triangles.zip(corners) {
                mesh.triangles[triangle] =
                    corners.map(|old| *copies.entry(old).or_insert_with(|| copy_vertex(mesh, old, open, close)));
            }
        }
    }

    /// Moves both faces of each pair apart, and removes them from `mesh`. Returns a mesh of these
    /// faces that rays from behind pass. From each side, a ray then hits only one face of a pair.
    pub fn split_off(&self, mesh: &mut Mesh) -> Mesh {
        self.move_apart(mesh);
        let mut is_of_pair = vec![false; mesh.triangles.len()];
        for face in self.pairs.iter().flatten() {
            if let Some(of_face) = is_of_pair.get_mut(face.start as usize..face.end as usize) {
                of_face.fill(true);
            }
        }
        let side = |is_of_pair: &[bool], of_pairs: bool| {
            let chosen = || (0..).zip(is_of_pair).filter(move |(_, of_pair)| **of_pair == of_pairs);
            let triangles = chosen().map(|(i, _): (usize, _)| mesh.triangles[i]).collect();
            let parts = if mesh.parts.len() > 1 {
                chosen().map(|(i, _)| mesh.parts[i]).collect()
            } else {
                mesh.parts.clone()
            };
            mesh.with_triangles(triangles, parts)
        };
        let [of_pairs, rest] = [true, false].map(|of_pairs| side(&is_of_pair, of_pairs));
        *mesh = rest;
        Mesh {
            is_front_only: true,
            ..of_pairs
        }
    }
}

/// Appends a copy of the vertex `old`, moved by `open`, and at time 1 by `close`. Returns the index
/// of the copy.
fn copy_vertex(mesh: &mut Mesh, old: u32, open: Vec3, close: Option<Vec3>) -> u32 {
    fn copy<T: Copy>(values: &mut Vec<T>, old: u32) {
        values.extend(values.get(old as usize).copied());
    }
    let new = mesh.positions.len() as u32;
    mesh.positions.push(mesh.positions[old as usize] + open);
    if let Some(close) = close {
        mesh.positions_close.push(mesh.positions_close[old as usize] + close);
    }
    copy(&mut mesh.normals, old);
    copy(&mut mesh.normals_close, old);
    copy(&mut mesh.uvs, old);
    copy(&mut mesh.colors, old);
    copy(&mut mesh.alphas, old);
    new
}

/// Pairs of faces at the same place.
#[derive(Default)]
pub(super) struct CoincidentFaces {
    /// Number of pairs of two materials, which were moved apart.
    separated: usize,
    /// Pairs of one material, for each group with such pairs. A face is the index of its section
    /// and its first corner there.
    twins: HashMap<usize, Vec<[(usize, usize); 2]>>,
    /// Distance by which a face of a pair is moved.
    gap: f32,
}

impl CoincidentFaces {
    /// `separated` pairs of two materials were moved apart, each face by `gap`.
    pub fn new(separated: usize, gap: f32) -> Self {
        Self {
            separated,
            twins: HashMap::new(),
            gap,
        }
    }

    /// Adds a pair of one material of the group with the index `group`.
    pub fn add_twins(&mut self, group: usize, faces: [(usize, usize); 2]) {
        self.twins.entry(group).or_default().push(faces);
    }

    /// Number of pairs of two materials, which were moved apart.
    pub fn separated(&self) -> usize {
        self.separated
    }

    /// Index of each twin face of a group: the pair, and the face of the pair.
    pub fn twins_of(&self, group: usize) -> HashMap<(usize, usize), (usize, usize)> {
        let pairs = self.twins.get(&group).into_iter().flatten().enumerate();
        let faces = pairs.flat_map(|(pair, faces)| [0, 1].map(|side| (faces[side], (pair, side))));
        faces.collect()
    }

    /// Distance by which a face of a pair is moved.
    pub fn gap(&self) -> f32 {
        self.gap
    }
}
