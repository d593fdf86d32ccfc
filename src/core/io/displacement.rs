//! Displacement: vertices move along their normals by the heights of a texture.
//!
//! All vertices at one position move by the mean of their displacements, even if they differ in
//! mesh, normal or texture coordinates. Surfaces therefore do not tear. Normals are recomputed from
//! the displaced faces. A vertex that was split along a sharp edge stays split.

use crate::geometry::{Mesh, triangle_normal};
use crate::math::{DVec3, Vec2, Vec3};
use crate::texture::{Mapping, Texture, TextureFilter};
use std::collections::HashMap;

/// Approximate memory per vertex during displacement, in bytes.
pub const BYTES_OF_VERTEX: u64 = 160;

/// Texture that displaces the vertices of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct HeightMap<'a> {
    /// Texture with the heights.
    pub texture: &'a Texture,
    /// Mapping of the texture. The displacement is `mapping.bump` times the mapped value, in units
    /// of the mesh.
    pub mapping: Mapping,
    /// Filter of the texture: `Mip` averages over the distance to neighbouring vertices, `Bilinear`
    /// does not.
    pub filter: TextureFilter,
}

/// Displaces the meshes of an object, each by its map. Returns the minimum and the maximum of the
/// displacements. `None` if no mesh has a map and texture coordinates.
pub fn displace(meshes: &mut [&mut Mesh], maps: &[Option<HeightMap>]) -> Option<[f32; 2]> {
    let map_of = |i: usize| maps.get(i).copied().flatten();
    let heights: Vec<Vec<f32>> = (meshes.iter().enumerate())
        .map(|(i, mesh)| map_of(i).map_or(Vec::new(), |map| map.heights(mesh)))
        .collect();
    let all = heights.iter().flatten();
    let range = all.fold([f32::INFINITY, f32::NEG_INFINITY], |[min, max], &h| {
        [min.min(h), max.max(h)]
    });
    if range[0] > range[1] {
        return None;
    }
    let open: Vec<Shape> = meshes.iter().map(|mesh| Shape::open(mesh)).collect();
    let close: Vec<Shape> = meshes.iter().map(|mesh| Shape::close(mesh)).collect();
    let moves = close.iter().any(|shape| !shape.positions.is_empty());
    let new_open = displaced(&open, &heights);
    let new_close = if moves { displaced(&close, &heights) } else { Vec::new() };
    for (mesh, (positions, normals)) in meshes.iter_mut().zip(new_open) {
        (mesh.positions, mesh.normals) = (positions, normals);
    }
    for (mesh, (positions, normals)) in meshes.iter_mut().zip(new_close) {
        (mesh.positions_close, mesh.normals_close) = (positions, normals);
    }
    Some(range)
}

impl HeightMap<'_> {
    /// Displacement of each vertex of `mesh`. Empty if the mesh has no texture coordinates.
    fn heights(&self, mesh: &Mesh) -> Vec<f32> {
        let footprints = match self.filter {
            TextureFilter::Mip => distances(mesh),
            TextureFilter::Bilinear => vec![0.0; mesh.uvs.len()],
        };
        let height =
            |(&uv, footprint): (&Vec2, f32)| self.mapping.bump * self.mapping.value(self.texture, uv, footprint);
        mesh.uvs.iter().zip(footprints).map(height).collect()
    }
}

/// Mean distance of each vertex from its neighbours, in texture coordinates.
fn distances(mesh: &Mesh) -> Vec<f32> {
    let mut sums = vec![(0.0f32, 0.0f32); mesh.uvs.len()];
    for &[a, b, c] in &mesh.triangles {
        for [a, b] in [[a, b], [b, c], [c, a]].map(|side| side.map(|i| i as usize)) {
            let distance = mesh.uvs[a].distance(mesh.uvs[b]);
            for i in [a, b] {
                sums[i].0 += distance;
                sums[i].1 += 1.0;
            }
        }
    }
    sums.into_iter().map(|(sum, count)| sum / count.max(1.0)).collect()
}

/// Vertices and triangles of a mesh at shutter open or at shutter close.
struct Shape<'a> {
    positions: &'a [Vec3],
    /// Normals of the vertices. Empty if the mesh is flat-shaded.
    normals: &'a [Vec3],
    triangles: &'a [[u32; 3]],
}

impl<'a> Shape<'a> {
    fn open(mesh: &'a Mesh) -> Self {
        Self {
            positions: &mesh.positions,
            normals: &mesh.normals,
            triangles: &mesh.triangles,
        }
    }

    /// Shape at shutter close. Has no vertices if the mesh does not deform.
    fn close(mesh: &'a Mesh) -> Self {
        Self {
            positions: &mesh.positions_close,
            normals: &mesh.normals_close,
            triangles: if mesh.deforms() { &mesh.triangles } else { &[] },
        }
    }

    fn corners(&self, triangle: [u32; 3]) -> [Vec3; 3] {
        triangle.map(|i| self.positions[i as usize])
    }
}

/// Calls `add` for each corner of a triangle, with the triangle's normal multiplied by the
/// triangle's angle at the corner (Thürmer and Wüthrich 1998).
fn add_normals(corners: [Vec3; 3], mut add: impl FnMut(usize, DVec3)) {
    let [a, b, c] = corners;
    let normal = triangle_normal(a, b, c).as_dvec3();
    for i in 0..3 {
        let at = |k: usize| corners[(i + k) % 3].as_dvec3();
        let (to, from) = (at(1) - at(0), at(2) - at(0));
        let angle = to.cross(from).length().atan2(to.dot(from));
        add(i, normal * angle);
    }
}

/// New positions and normals of each mesh, after its vertices have moved by `heights` along their
/// normals. A mesh with an empty list of heights moves only at the positions that it shares with
/// another mesh.
fn displaced(shapes: &[Shape], heights: &[Vec<f32>]) -> Vec<(Vec<Vec3>, Vec<Vec3>)> {
    // Number the distinct positions of all meshes. Adding 0 turns -0 into 0
    let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
    let places: Vec<Vec<u32>> = (shapes.iter())
        .map(|shape| {
            let place = |p: &Vec3| {
                let new = index_of.len() as u32;
                *index_of
                    .entry((*p + Vec3::ZERO).to_array().map(f32::to_bits))
                    .or_insert(new)
            };
            shape.positions.iter().map(place).collect()
        })
        .collect();
    let count = index_of.len();
    drop(index_of);

    // Compute normals at the distinct positions, for flat-shaded meshes
    let is_flat = |(shape, heights): (&Shape, &Vec<f32>)| shape.normals.is_empty() && !heights.is_empty();
    let mut of_places = Vec::new();
    if shapes.iter().zip(heights).any(is_flat) {
        of_places = vec![DVec3::ZERO; count];
        for (shape, places) in shapes.iter().zip(&places) {
            for &triangle in shape.triangles {
                add_normals(shape.corners(triangle), |corner, normal| {
                    of_places[places[triangle[corner] as usize] as usize] += normal;
                });
            }
        }
    }

    // Compute the mean displacement at each distinct position
    let mut sums = vec![(DVec3::ZERO, 0u32); count];
    for ((shape, places), heights) in shapes.iter().zip(&places).zip(heights) {
        for (i, &place) in places.iter().enumerate() {
            let normal = match shape.normals.get(i) {
                Some(normal) => normal.as_dvec3(),
                None if of_places.is_empty() => DVec3::ZERO,
                None => of_places[place as usize].normalize_or_zero(),
            };
            let height = heights.get(i).copied().unwrap_or(0.0);
            let sum = &mut sums[place as usize];
            sum.0 += normal * f64::from(height);
            sum.1 += 1;
        }
    }
    let moves: Vec<DVec3> = sums.iter().map(|(sum, count)| *sum / f64::from(*count)).collect();
    let moved = |(shape, places): (&Shape, &Vec<u32>)| -> Vec<Vec3> {
        let new = |(p, &place): (&Vec3, &u32)| (p.as_dvec3() + moves[place as usize]).as_vec3a();
        shape.positions.iter().zip(places).map(new).collect()
    };
    let positions: Vec<Vec<Vec3>> = shapes.iter().zip(&places).map(moved).collect();
    let normals = new_normals(shapes, &places, &positions, &moves);
    positions.into_iter().zip(normals).collect()
}

/// Normals of the meshes at their new positions. Vertices that had the same position and normal
/// before also get the same new normal, which is the mean over the faces around them. The normal of
/// a vertex does not change if no face around the vertex has moved.
fn new_normals(shapes: &[Shape], places: &[Vec<u32>], positions: &[Vec<Vec3>], moves: &[DVec3]) -> Vec<Vec<Vec3>> {
    let mut index_of: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    let of_vertices: Vec<Vec<u32>> = (shapes.iter().zip(places))
        .map(|(shape, places)| {
            let index = |(normal, &place): (&Vec3, &u32)| {
                let new = index_of.len() as u32;
                *index_of
                    .entry((place, (*normal + Vec3::ZERO).to_array().map(f32::to_bits)))
                    .or_insert(new)
            };
            shape.normals.iter().zip(places).map(index).collect()
        })
        .collect();
    let mut sums = vec![(DVec3::ZERO, false); index_of.len()];
    drop(index_of);
    for (i, shape) in shapes.iter().enumerate().filter(|(_, shape)| !shape.normals.is_empty()) {
        for &triangle in shape.triangles {
            let vertices = triangle.map(|vertex| vertex as usize);
            let is_moved = vertices.iter().any(|&v| moves[places[i][v] as usize] != DVec3::ZERO);
            // The normals of a mesh may point to the other side than the winding of its triangles
            let facet = shape.corners(triangle);
            let facet = triangle_normal(facet[0], facet[1], facet[2]);
            add_normals(vertices.map(|v| positions[i][v]), |corner, normal| {
                let vertex = vertices[corner];
                let side = f64::from(1f32.copysign(shape.normals[vertex].dot(facet)));
                let sum = &mut sums[of_vertices[i][vertex] as usize];
                sum.0 += normal * side;
                sum.1 |= is_moved;
            });
        }
    }
    let new = |(shape, indices): (&Shape, &Vec<u32>)| -> Vec<Vec3> {
        let normal = |(&old, &index): (&Vec3, &u32)| match sums[index as usize] {
            (sum, true) => sum.try_normalize().map_or(old, |normal| normal.as_vec3a()),
            (_, false) => old,
        };
        shape.normals.iter().zip(indices).map(normal).collect()
    };
    shapes.iter().zip(&of_vertices).map(new).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{ControlMesh, PrimId};
    use crate::texture::{Curve, Texels, Wrap};

    /// A texture with one row of `texels`, which are linear numbers.
    fn texture(texels: &[u8]) -> Texture {
        Texture::new(
            texels.len(),
            1,
            1,
            Texels::Bytes(texels.to_vec(), Curve::Linear),
            Wrap::Clamp,
        )
        .unwrap()
    }

    fn heights(texture: &Texture, bump: f32) -> HeightMap<'_> {
        HeightMap {
            texture,
            mapping: Mapping {
                bump,
                ..Mapping::default()
            },
            filter: TextureFilter::Bilinear,
        }
    }

    /// A unit sphere of `n` × 2n quads by longitude and latitude, with a seam and two poles.
    fn globe(n: usize) -> Mesh {
        let mut mesh = Mesh::default();
        for row in 0..=n {
            for column in 0..=2 * n {
                let (u, v) = ((column % (2 * n)) as f32 / (2 * n) as f32, row as f32 / n as f32);
                let (theta, phi) = (v * std::f32::consts::PI, u * std::f32::consts::TAU);
                let ring = if row % n == 0 { 0.0 } else { theta.sin() };
                let p = Vec3::new(ring * phi.cos(), ring * phi.sin(), theta.cos());
                mesh.positions.push(p);
                mesh.normals.push(p);
                mesh.uvs.push(Vec2::new(column as f32 / (2 * n) as f32, v));
                let a = (row * (2 * n + 1) + column) as u32;
                let below = a + 2 * n as u32 + 1;
                if row < n && column < 2 * n {
                    mesh.triangles.extend([[a, below, below + 1], [a, below + 1, a + 1]]);
                }
            }
        }
        mesh
    }

    #[test]
    fn sphere_displaced_by_a_constant_is_a_larger_sphere() {
        let grey = texture(&[128]);
        for bump in [0.5, -0.25] {
            let mut mesh = globe(32);
            let distance = bump * 128.0 / 255.0;
            let range = displace(&mut [&mut mesh], &[Some(heights(&grey, bump))]).unwrap();
            assert!(range.iter().all(|h| (h - distance).abs() < 1e-6), "{range:?}");
            for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
                assert!((p.length() - (1.0 + distance)).abs() < 1e-6, "{p}");
                assert!(n.dot(p.normalize()) > 0.998, "{n} at {p}");
            }
        }
    }

    /// Although heights differ on the two sides of the seam and at the poles, the displaced surface
    /// stays closed.
    #[test]
    fn seams_stay_closed() {
        let ramp = texture(&[0, 80, 255]);
        let mut mesh = globe(8);
        let old = mesh.clone();
        displace(&mut [&mut mesh], &[Some(heights(&ramp, 1.0))]).unwrap();
        let mut moved = 0;
        for (i, p) in old.positions.iter().enumerate() {
            for (k, q) in old.positions.iter().enumerate().filter(|(_, q)| *q == p) {
                assert_eq!(mesh.positions[i], mesh.positions[k], "{p} {q}");
                assert_eq!(mesh.normals[i], mesh.normals[k]);
            }
            moved += u32::from(*p != mesh.positions[i]);
        }
        assert!(moved > 100);
    }

    /// A flat-shaded mesh moves along the mean normals of its faces and stays flat-shaded. A second
    /// mesh that touches the first mesh moves, too.
    #[test]
    fn flat_meshes_and_neighbours_follow() {
        let square = |x: f32, has_uvs: bool| Mesh {
            positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
                .map(|[u, v]| Vec3::new(x + u, v, 0.0))
                .to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            uvs: if has_uvs { vec![Vec2::ZERO; 4] } else { Vec::new() },
            ..Mesh::default()
        };
        let (mut a, mut b) = (square(0.0, true), square(1.0, true));
        let white = texture(&[255]);
        displace(&mut [&mut a, &mut b], &[Some(heights(&white, 0.5)), None]).unwrap();
        let z = |mesh: &Mesh| [0, 1, 2, 3].map(|i: usize| mesh.positions[i].z);
        assert_eq!(z(&a), [0.5, 0.25, 0.25, 0.5]);
        assert_eq!(z(&b), [0.25, 0.0, 0.0, 0.25]);
        assert!(a.normals.is_empty());
        // A mesh without texture coordinates does not move.
        let mut mesh = square(0.0, false);
        assert!(displace(&mut [&mut mesh], &[Some(heights(&white, 0.5))]).is_none());
        assert_eq!(mesh, square(0.0, false));
    }

    /// A moving mesh is displaced at shutter open and at shutter close.
    #[test]
    fn moving_meshes_follow() {
        let white = texture(&[255]);
        let mut mesh = globe(8);
        mesh.positions_close = mesh.positions.iter().map(|p| *p * 2.0).collect();
        mesh.normals_close.clone_from(&mesh.normals);
        displace(&mut [&mut mesh], &[Some(heights(&white, 0.5))]).unwrap();
        assert!(mesh.positions.iter().all(|p| (p.length() - 1.5).abs() < 1e-6));
        assert!(mesh.positions_close.iter().all(|p| (p.length() - 2.5).abs() < 1e-6));
    }

    /// A sharp edge stays sharp: the faces on its two sides keep different normals.
    #[test]
    fn sharp_edges_stay() {
        let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let positions: Vec<Vec3> = (0..8).map(|i| Vec3::new(side(0, i), side(1, i), side(2, i))).collect();
        let corners = [0, 2, 3, 1, 4, 5, 7, 6, 0, 1, 5, 4, 2, 6, 7, 3, 0, 4, 6, 2, 1, 3, 7, 5];
        let fine = ControlMesh {
            positions: &positions,
            sizes: &[4; 6],
            corners: &corners,
            crease_angle: Some(30.0),
            ..ControlMesh::default()
        }
        .subdivided(2);
        let mut mesh = Mesh::default();
        let all = fine
            .triangles
            .iter()
            .flatten()
            .zip(fine.normal_triangles.iter().flatten());
        for (&p, &n) in all {
            mesh.positions.push(fine.positions[p as usize]);
            mesh.normals.push(fine.normals[n as usize]);
            mesh.uvs.push(Vec2::ZERO);
        }
        mesh.triangles = (0..mesh.positions.len() as u32 / 3)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect();
        displace(&mut [&mut mesh], &[Some(heights(&texture(&[255]), 0.25))]).unwrap();
        for prim in (0..mesh.triangles.len() as u32).map(PrimId) {
            let [a, b, c] = mesh.corners(prim);
            let facet = triangle_normal(a, b, c);
            for n in mesh.normals_at(prim, 0.0).unwrap() {
                assert!(n.dot(facet) > 0.9, "{n} {facet}");
            }
        }
        // Each corner of the cube moves by the mean of the displacements of its three faces.
        assert!(mesh.positions.iter().all(|p| p.abs().max_element() > 1.08));
    }
}
