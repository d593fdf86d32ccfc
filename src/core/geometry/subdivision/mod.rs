//! Subdivision surfaces: the smooth surface of a control mesh of polygons.
//!
//! `topology` divides faces, `refine` computes vertex positions, and `limit` moves the vertices
//! onto the limit surface and computes normals. The result consists of triangles, so all backends
//! have the same surface. All faces are divided in the same number of steps, so there are no
//! cracks. Positions are connected by their indices in the file, independent of seams in texture
//! coordinates.
//!
//! - Meshes that have only triangles use Loop's scheme. All other meshes use the scheme of Catmull
//!   and Clark.
//! - Boundaries are smooth curves. A boundary vertex that belongs to a single face keeps its
//!   position, as in OpenSubdiv's `EDGE_AND_CORNER`.
//! - Edges of three or more faces, and edges between faces of opposite orientation, stay sharp.
//! - Texture coordinates are smooth inside the islands of a texture and linear along the boundaries
//!   of islands. The colour of a new vertex is the mean of the neighbouring colours.
//! - Many programs write a separate vertex for each normal and texture coordinate. Vertices at one
//!   position are therefore joined, if this closes boundaries and creates no irregular edges.

mod limit;
mod refine;
mod topology;

#[cfg(test)]
mod tests;

use crate::math::{DVec2, DVec3, Vec2, Vec3};
use refine::{Rule, around_vertices};
use std::collections::HashMap;
pub use topology::{IrregularEdges, Scheme};
use topology::{NONE, Topology};

/// Maximum number of steps: a face then becomes 4¹² faces.
pub const MAX_STEPS: u32 = 12;

/// Polygons, by the indices of their vertices.
#[derive(Clone, Copy, Debug, Default)]
pub struct ControlMesh<'a> {
    /// Vertex positions.
    pub positions: &'a [Vec3],
    /// Texture coordinates.
    pub uvs: &'a [Vec2],
    /// Colour and opacity of each position, linear; empty if there are none.
    pub colors: &'a [[f32; 4]],
    /// Number of corners of each face, at least 3.
    pub sizes: &'a [u32],
    /// Position index of each corner.
    pub corners: &'a [u32],
    /// Index of the texture coordinates of each corner; out of range if the corner has none. Empty
    /// if no corner has any.
    pub uv_corners: &'a [u32],
    /// Crease angle in degrees. An edge stays sharp if the angle between the normals of its faces
    /// is larger. A vertex keeps its position if the sharp curve through this vertex turns by a
    /// larger angle. If `None`, no edge is sharp because of its angle.
    pub crease_angle: Option<f32>,
}

/// Triangles of a subdivided mesh. Each face of the control mesh becomes a range of consecutive
/// triangles. The ranges have the order of the faces.
#[derive(Clone, Debug, Default)]
pub struct SubdividedMesh {
    /// Vertices on the limit surface.
    pub positions: Vec<Vec3>,
    /// Unit normals of the limit surface; zero if undefined.
    pub normals: Vec<Vec3>,
    /// Texture coordinates.
    pub uvs: Vec<Vec2>,
    /// Colour and opacity of each position; empty if there are none.
    pub colors: Vec<[f32; 4]>,
    /// Indices of the positions of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Indices of the texture coordinates of each triangle; out of range if a corner has none.
    /// Empty if no corner has any.
    pub uv_triangles: Vec<[u32; 3]>,
    /// Indices of the normals of each triangle.
    pub normal_triangles: Vec<[u32; 3]>,
    /// Numbers of irregular edges. The surface is not smooth there.
    pub irregular: IrregularEdges,
}

impl ControlMesh<'_> {
    /// Subdivision scheme of the mesh.
    pub fn scheme(&self) -> Scheme {
        Scheme::of(self.sizes)
    }

    /// Number of triangles of a face of `size` corners after `steps` steps.
    pub fn triangles_of_face(scheme: Scheme, size: u32, steps: u32) -> u64 {
        let size = u64::from(size);
        match (scheme, steps) {
            (_, 0) => size - 2,
            (Scheme::Loop, _) => 1 << (2 * steps),
            (Scheme::CatmullClark, _) => (2 * size) << (2 * (steps - 1)),
        }
    }

    /// Number of triangles after `steps` steps.
    pub fn triangles(&self, steps: u32) -> u64 {
        let scheme = self.scheme();
        let of_faces = self
            .sizes
            .iter()
            .map(|&size| Self::triangles_of_face(scheme, size, steps));
        of_faces.sum()
    }

    /// Upper estimate of the bytes of a subdivision in `steps` steps, including the result.
    pub fn bytes(&self, steps: u32) -> u64 {
        let per_triangle = match self.scheme() {
            // Bytes per triangle, measured in the test of memory
            Scheme::CatmullClark => 150,
            Scheme::Loop => 170,
        };
        let of_uvs = if self.uv_corners.is_empty() { 0 } else { 70 };
        let of_colors = if self.colors.is_empty() { 0 } else { 40 };
        self.triangles(steps) * (per_triangle + of_uvs + of_colors)
    }

    /// Returns true if the indices of the mesh after `steps` steps fit in 32 bits.
    pub fn fits_indices(&self, steps: u32) -> bool {
        // A step makes up to 6 entries for each triangle
        steps <= MAX_STEPS && self.triangles(steps).saturating_mul(6) < u64::from(u32::MAX)
    }

    /// Subdivides the mesh in `steps` steps, at least 1.
    pub fn subdivided(&self, steps: u32) -> SubdividedMesh {
        let scheme = self.scheme();
        let corners = self.joined_corners();
        let count = self.positions.len() as u32;
        let (mut topology, irregular) = Topology::new(self.sizes, corners, count);
        let mut positions: Vec<DVec3> = self.positions.iter().map(|p| p.as_dvec3()).collect();
        self.make_creases(&mut topology);
        let mut uvs = UvMesh::new(self, &topology);
        let (mut rgb, mut alphas) = (Vec::new(), Vec::new());
        for &[r, g, b, a] in self.colors {
            rgb.push(Vec3::new(r, g, b).as_dvec3());
            alphas.push(DVec2::new(a.into(), 0.0));
        }
        for _ in 0..steps.min(MAX_STEPS) {
            let around = around_vertices(&topology);
            let next = topology.refined(scheme);
            positions = refine::refined(&topology, scheme, Rule::Surface, &positions, &around);
            if !rgb.is_empty() {
                rgb = refine::refined(&topology, scheme, Rule::Linear, &rgb, &around);
                alphas = refine::refined(&topology, scheme, Rule::Linear, &alphas, &around);
            }
            drop(around);
            topology = next;
            if let Some(uvs) = &mut uvs {
                uvs.refine(scheme);
            }
        }
        let around = around_vertices(&topology);
        let (normals, of_corners) = limit::normals(&topology, scheme, &positions, &around);
        let limits = limit::positions(&topology, scheme, &positions, &around);
        let mut subdivided = SubdividedMesh {
            positions: limits.iter().map(|p| p.as_vec3a()).collect(),
            normals: normals.iter().map(|n| n.as_vec3a()).collect(),
            triangles: triangles(&topology.vertices, scheme),
            normal_triangles: triangles(&of_corners, scheme),
            colors: (rgb.iter().zip(&alphas))
                .map(|(c, a)| [c.x as f32, c.y as f32, c.z as f32, a.x as f32])
                .collect(),
            irregular,
            ..SubdividedMesh::default()
        };
        if let Some(uvs) = uvs {
            subdivided.uv_triangles = triangles(&uvs.corners(self, scheme, steps), scheme);
            subdivided.uvs = uvs.values.iter().map(|uv| uv.as_vec2()).collect();
        }
        subdivided
    }

    /// Index of the position of each corner. Equal positions get the same index if this improves
    /// the surface.
    fn joined_corners(&self) -> Vec<u32> {
        let own = self.corners.to_vec();
        let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(self.positions.len());
        let key = |p: Vec3| (p + Vec3::ZERO).to_array().map(f32::to_bits);
        let index = |(i, &p): (u32, &Vec3)| *first.entry(key(p)).or_insert(i);
        let places: Vec<u32> = (0..).zip(self.positions).map(index).collect();
        if (0..).zip(&places).all(|(i, &place)| i == place) {
            return own;
        }
        let joined: Vec<u32> = own.iter().map(|&corner| places[corner as usize]).collect();
        let count = self.positions.len() as u32;
        let boundaries = |corners: &[u32]| {
            let (topology, irregular) = Topology::new(self.sizes, corners.to_vec(), count);
            let sharp = topology.sharpness.iter().filter(|&&sharpness| sharpness > 0.0);
            (sharp.count() as u64, irregular)
        };
        let (own_sharp, before) = boundaries(&own);
        let (joined_sharp, after) = boundaries(&joined);
        let is_better = after.non_manifold <= before.non_manifold && after.flipped <= before.flipped;
        if is_better && joined_sharp < own_sharp {
            joined
        } else {
            own
        }
    }

    /// Makes edges sharp if the angle between the normals of their faces is above `crease_angle`.
    /// Pins a vertex if the curve of its two sharp edges turns there by more than this angle.
    fn make_creases(&self, topology: &mut Topology) {
        let Some(degrees) = self.crease_angle else { return };
        let min_cosine = f64::from(degrees).to_radians().cos();
        let normal = |face: u32| {
            let corners = topology.corners(face);
            let at = |corner: u32| self.positions[topology.vertex(corner) as usize].as_dvec3();
            let first = at(corners.start);
            let pairs = corners.clone().zip(corners.skip(1));
            let sum: DVec3 = pairs.map(|(a, b)| (at(a) - first).cross(at(b) - first)).sum();
            sum.normalize_or_zero()
        };
        let normals: Vec<DVec3> = (0..topology.face_count()).map(normal).collect();
        let is_sharp = |&[first, second]: &[u32; 2]| {
            let of_corner = |corner: u32| normals[topology.face(corner) as usize];
            second != NONE && of_corner(first).dot(of_corner(second)) < min_cosine
        };
        let sharp: Vec<bool> = topology.edge_corners.iter().map(is_sharp).collect();
        for (sharpness, is_sharp) in topology.sharpness.iter_mut().zip(sharp) {
            if is_sharp {
                *sharpness = f32::INFINITY;
            }
        }
        // Find vertices at which a curve of two sharp edges turns. If the curve is straight there,
        // the sum of the directions of the two edges away from the vertex is 0
        let mut sums = vec![(0, DVec3::ZERO); self.positions.len()];
        let sharp = (0..)
            .zip(&topology.sharpness)
            .filter(|(_, sharpness)| **sharpness > 0.0);
        for (edge, _) in sharp {
            let [a, b] = topology.ends(edge).map(|vertex| vertex as usize);
            let along = (self.positions[b] - self.positions[a]).as_dvec3().normalize_or_zero();
            for (vertex, direction) in [(a, along), (b, -along)] {
                sums[vertex].0 += 1;
                sums[vertex].1 += direction;
            }
        }
        // If the curve turns by θ, the squared length of the sum is 2 − 2 cos θ
        let max_square = 2.0 - 2.0 * min_cosine;
        let turns = |&(count, sum): &(u32, DVec3)| count == 2 && sum.length_squared() > max_square;
        topology.pinned = sums.iter().map(turns).collect();
    }
}

/// Texture coordinates, and the topology of the faces that they connect (islands).
struct UvMesh {
    topology: Topology,
    values: Vec<DVec2>,
}

impl UvMesh {
    /// Texture coordinates of `mesh`, whose positions have the topology `topology`; `None` without
    /// texture coordinates.
    fn new(mesh: &ControlMesh, topology: &Topology) -> Option<Self> {
        if mesh.uv_corners.is_empty() {
            return None;
        }
        let count = mesh.uvs.len() as u32;
        // All corners without texture coordinates refer to one additional entry, which no triangle
        // uses in the end
        let corners = mesh.uv_corners.iter().map(|&uv| uv.min(count)).collect();
        let (mut uvs, _) = Topology::new(mesh.sizes, corners, count + 1);
        for (corners, sharpness) in uvs.edge_corners.iter_mut().zip(&mut uvs.sharpness) {
            let [first, second] = *corners;
            let of_positions = topology.edges[first as usize];
            *sharpness = sharpness.max(topology.sharpness[of_positions as usize]);
            // Islands may overlap. If two faces have a common edge in the texture that is not a
            // common edge of the mesh, separate the faces
            if second != NONE && topology.edges[second as usize] != of_positions {
                *sharpness = f32::INFINITY;
                corners[1] = NONE;
            }
        }
        let mut values: Vec<DVec2> = mesh.uvs.iter().map(|uv| uv.as_dvec2()).collect();
        values.push(DVec2::ZERO);
        Some(Self { topology: uvs, values })
    }

    fn refine(&mut self, scheme: Scheme) {
        let around = around_vertices(&self.topology);
        self.values = refine::refined(&self.topology, scheme, Rule::Inside, &self.values, &around);
        self.topology = self.topology.refined(scheme);
    }

    /// Index of the texture coordinates of each corner after `steps` steps. [`NONE`] for all
    /// corners of a face of `mesh` if one of its corners has no texture coordinates.
    fn corners(&self, mesh: &ControlMesh, scheme: Scheme, steps: u32) -> Vec<u32> {
        let mut corners = self.topology.vertices.clone();
        let count = mesh.uvs.len() as u32;
        if mesh.uv_corners.iter().all(|&uv| uv < count) {
            return corners;
        }
        let per_triangle = if scheme == Scheme::CatmullClark { 2 } else { 3 };
        let (mut start, mut end) = (0, 0);
        for &size in mesh.sizes {
            let length = ControlMesh::triangles_of_face(scheme, size, steps) as usize * per_triangle;
            let face = start..start + size as usize;
            if mesh.uv_corners[face.clone()].iter().any(|&uv| uv >= count) {
                corners[end..end + length].fill(NONE);
            }
            (start, end) = (face.end, end + length);
        }
        corners
    }
}

/// Triangles of the faces whose corners have the indices `corners`. Each quad is divided by the
/// diagonal from its first corner. The triangles of positions, normals and texture coordinates
/// therefore match.
fn triangles(corners: &[u32], scheme: Scheme) -> Vec<[u32; 3]> {
    match scheme {
        Scheme::CatmullClark => (corners.chunks_exact(4))
            .flat_map(|quad| [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]])
            .collect(),
        Scheme::Loop => (corners.chunks_exact(3))
            .map(|triangle| [triangle[0], triangle[1], triangle[2]])
            .collect(),
    }
}
