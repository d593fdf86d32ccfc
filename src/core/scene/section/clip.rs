//! Clipping of a mesh by a plane into a kept and a removed half. A vertex in the plane belongs to
//! the removed half.

use super::plane::SectionPlane;
use crate::geometry::{Mesh, UNNAMED};
use crate::math::Vec3;
use half::f16;
use std::collections::HashMap;

/// Edge along which a plane cuts a triangle. Seen with the plane's normal pointing to the viewer,
/// the inside of the solid is on the left of the edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CutEdge {
    pub from: Vec3,
    pub to: Vec3,
    /// Part to which the triangle belongs.
    pub part: u32,
}

/// The two halves of a mesh that a plane cuts, and the edges in the plane.
#[derive(Debug, Default)]
pub(super) struct Halves {
    pub kept: Mesh,
    pub removed: Mesh,
    pub edges: Vec<CutEdge>,
}

/// Triangles of one half, and the part of each triangle.
#[derive(Default)]
struct Half {
    triangles: Vec<[u32; 3]>,
    parts: Vec<u32>,
}

impl Half {
    fn push(&mut self, triangle: [u32; 3], part: Option<u32>) {
        self.triangles.push(triangle);
        self.parts.extend(part);
    }
}

/// Cuts `mesh` by `plane`. The mesh must not deform.
pub(super) fn clip(mesh: &Mesh, plane: &SectionPlane) -> Halves {
    let distances: Vec<f64> = mesh.positions.iter().map(|&p| plane.distance(p)).collect();
    let is_kept = |i: u32| distances[i as usize] < 0.0;
    let mut all = Mesh {
        triangles: Vec::new(),
        parts: Vec::new(),
        ..mesh.clone()
    };
    // Indices of new vertices in the plane. The key has the two end vertices of the edge that is
    // cut: the kept one, then the removed one.
    let mut cuts: HashMap<[u32; 2], u32> = HashMap::new();
    let mut cut = |all: &mut Mesh, a: u32, b: u32| {
        let [kept, removed] = if is_kept(a) { [a, b] } else { [b, a] };
        *cuts.entry([kept, removed]).or_insert_with(|| {
            let end = |i: u32| (mesh.positions[i as usize], distances[i as usize]);
            let (p, share) = plane.crossing(end(kept), end(removed));
            push_between(all, [kept, removed], share, p)
        })
    };
    let (mut kept, mut removed) = (Half::default(), Half::default());
    let mut edges = Vec::new();
    for (i, &triangle) in mesh.triangles.iter().enumerate() {
        let part = (mesh.parts.len() > 1).then(|| mesh.parts[i]);
        let sides = triangle.map(is_kept);
        let (lone, rest) = match sides.iter().filter(|kept| **kept).count() {
            0 => {
                removed.push(triangle, part);
                continue;
            }
            1 => (&mut kept, &mut removed),
            2 => (&mut removed, &mut kept),
            _ => {
                kept.push(triangle, part);
                continue;
            }
        };
        // Rotate the triangle so that the corner that is alone on its side comes first
        let is_lone_kept = sides.iter().filter(|kept| **kept).count() == 1;
        let first = sides.iter().position(|&kept| kept == is_lone_kept).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|k| triangle[(first + k) % 3]);
        let (ab, ac) = (cut(&mut all, a, b), cut(&mut all, a, c));
        lone.push([a, ab, ac], part);
        rest.push([ab, b, c], part);
        rest.push([ab, c, ac], part);
        let [from, to] = if is_lone_kept { [ac, ab] } else { [ab, ac] };
        edges.push(CutEdge {
            from: all.positions[from as usize],
            to: all.positions[to as usize],
            part: part.or(mesh.parts.first().copied()).unwrap_or(UNNAMED),
        });
    }
    let half = |half: Half| {
        let parts = if mesh.parts.len() > 1 {
            half.parts
        } else {
            mesh.parts.clone()
        };
        all.with_triangles(half.triangles, parts)
    };
    Halves {
        kept: half(kept),
        removed: half(removed),
        edges,
    }
}

/// Adds a vertex at the position `p`. Its attributes are interpolated between the two vertices
/// `ends`: `share` is 0 for the first and 1 for the second.
fn push_between(mesh: &mut Mesh, ends: [u32; 2], share: f32, p: Vec3) -> u32 {
    let [a, b] = ends.map(|i| i as usize);
    let index = mesh.positions.len() as u32;
    mesh.positions.push(p);
    let mix = |a: f16, b: f16| f16::from_f32(a.to_f32() + share * (b.to_f32() - a.to_f32()));
    if !mesh.normals.is_empty() {
        let (first, last) = (mesh.normals[a], mesh.normals[b]);
        let normal = first.lerp(last, share).try_normalize();
        mesh.normals.push(normal.unwrap_or(first));
    }
    if !mesh.uvs.is_empty() {
        mesh.uvs.push(mesh.uvs[a].lerp(mesh.uvs[b], share));
    }
    if !mesh.colors.is_empty() {
        let (first, last) = (mesh.colors[a], mesh.colors[b]);
        mesh.colors.push([0, 1, 2].map(|c| mix(first[c], last[c])));
    }
    if !mesh.alphas.is_empty() {
        mesh.alphas.push(mix(mesh.alphas[a], mesh.alphas[b]));
    }
    index
}
