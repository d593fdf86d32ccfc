//! Shading normals that smooth edges below a given angle (`smooth_by_angle`), and functions that
//! are also used for the smoothing groups of OBJ files. A shading normal is a mean of the normals
//! around a point, weighted by the angles of the faces at the point. This mean does not depend on
//! how a surface is divided into triangles.

use crate::geometry::Mesh;
use crate::math::{DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Computes shading normals of `mesh`. The normal at a corner of a triangle is the mean over the
/// triangles around this point, weighted by their angles at the point (Thürmer and Wüthrich 1998).
/// A triangle is left out if the angle between its normal and the normal of the corner's own
/// triangle is `degrees` or more.
///
/// Vertices with equal coordinates are one point, even if their indices differ. A vertex that gets
/// several normals is split, and its texture coordinates are kept. Existing normals are replaced.
/// The time grows with the square of the number of triangles at a point.
pub fn smooth_by_angle(mesh: &mut Mesh, degrees: f32) {
    let min_cosine = (degrees as f64).to_radians().cos();
    let points = weld(&mesh.positions);
    let corners = |t: &[u32; 3]| t.map(|v| mesh.positions[v as usize]);
    let normals: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|t| area_vector(&corners(t)).normalize_or_zero())
        .collect();

    // For each point, list the triangles around it in file order, with their angles at the point
    let mut around: Vec<Vec<(u32, f64)>> = vec![Vec::new(); mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for (&v, angle) in triangle.iter().zip(corner_angles(&corners(triangle), normals[t])) {
            around[points[v as usize] as usize].push((t as u32, angle));
        }
    }

    let mut smooth = Mesh::default();
    let mut vertices: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let own = normals[t];
        let new = triangle.map(|v| {
            let near = around[points[v as usize] as usize]
                .iter()
                .filter(|&&(other, _)| other as usize == t || own.dot(normals[other as usize]) > min_cosine);
            let sum: DVec3 = near.map(|&(other, angle)| angle * normals[other as usize]).sum();
            // Triangles without area have no normal. They are never visible, so use any vector.
            let normal = sum
                .try_normalize()
                .unwrap_or(own)
                .try_normalize()
                .unwrap_or(DVec3::Z)
                .as_vec3a();
            *vertices.entry((v, bits(normal))).or_insert_with(|| {
                smooth.positions.push(mesh.positions[v as usize]);
                smooth.uvs.extend(mesh.uvs.get(v as usize));
                smooth.colors.extend(mesh.colors.get(v as usize));
                smooth.alphas.extend(mesh.alphas.get(v as usize));
                smooth.normals.push(normal);
                smooth.positions.len() as u32 - 1
            })
        });
        smooth.triangles.push(new);
    }
    smooth.parts = std::mem::take(&mut mesh.parts);
    *mesh = smooth;
}

/// For each position, the index of the first equal position.
pub fn weld(positions: &[Vec3]) -> Vec<u32> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let index = |(i, &p): (usize, &Vec3)| *first.entry(bits(p)).or_insert(i as u32);
    positions.iter().enumerate().map(index).collect()
}

/// Bits of a vector: equal vectors have equal bits.
fn bits(v: Vec3) -> [u32; 3] {
    // Adding 0 turns -0 into 0.
    (v + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Normal of a counter-clockwise polygon by Newell's method (Sutherland, Sproull and Schumacker
/// 1974). The length of the normal is twice the area of the polygon. The method also works for
/// polygons that are not convex or not quite flat. The normal is zero if the area is zero.
pub fn area_vector(points: &[Vec3]) -> DVec3 {
    let Some((first, rest)) = points.split_first() else {
        return DVec3::ZERO;
    };
    // Subtract the first corner, because products of large coordinates would lose digits
    let from_first = |p: &Vec3| p.as_dvec3() - first.as_dvec3();
    let pairs = rest.iter().zip(rest.iter().skip(1));
    pairs.map(|(p, q)| from_first(p).cross(from_first(q))).sum()
}

/// Inner angles of a polygon with this unit normal, in radians from 0 to 2π.
pub(super) fn corner_angles(points: &[Vec3], normal: DVec3) -> impl Iterator<Item = f64> {
    let n = points.len();
    (0..n).map(move |i| {
        let [before, at, after] = [i + n - 1, i, i + 1].map(|k| points[k % n].as_dvec3());
        let (to, from) = (after - at, before - at);
        let angle = to.cross(from).dot(normal).atan2(to.dot(from));
        if angle < 0.0 { angle + TAU } else { angle }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec2;

    /// A cube from -1 to 1 with twelve triangles and eight vertices.
    fn cube() -> Mesh {
        let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        Mesh {
            positions: (0..8).map(|i| Vec3::new(side(0, i), side(1, i), side(2, i))).collect(),
            triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
            uvs: (0..8).map(|i| Vec2::splat(i as f32)).collect(),
            ..Mesh::default()
        }
    }

    fn smoothed(mut mesh: Mesh, degrees: f32) -> Mesh {
        smooth_by_angle(&mut mesh, degrees);
        mesh
    }

    #[test]
    fn cube_is_flat_below_90_degrees_and_round_above() {
        let original = cube();
        assert!(original.triangles.iter().all(|&[a, b, c]| {
            let [a, b, c] = [a, b, c].map(|i| original.positions[i as usize]);
            (b - a).cross(c - a).dot(a) > 0.0
        }));
        for degrees in [0.0, 30.0, 89.0, f32::NAN] {
            let flat = smoothed(cube(), degrees);
            // Four corners on each of six sides
            assert_eq!((flat.positions.len(), flat.triangles.len()), (24, 12), "{degrees}");
            for (t, triangle) in flat.triangles.iter().enumerate() {
                let facet = flat.facet(crate::geometry::PrimId(t as u32));
                assert!(triangle.iter().all(|&i| flat.normals[i as usize] == facet.normal()));
            }
        }
        for degrees in [91.0, 180.0] {
            let round = smoothed(cube(), degrees);
            assert_eq!(round.positions.len(), 8);
            // By symmetry, the normals point along the diagonals of the cube, for any triangulation
            // of its sides.
            for (p, n) in round.positions.iter().zip(&round.normals) {
                assert!((*n * 3f32.sqrt() - *p).length() < 1e-6, "{n} at {p}");
            }
        }
    }

    #[test]
    fn smoothing_keeps_positions_and_texture_coordinates() {
        let (before, after) = (cube(), smoothed(cube(), 30.0));
        let all = |m: &Mesh| -> Vec<_> {
            let corners = m.triangles.iter().flatten().map(|&i| i as usize);
            corners.map(|i| (m.positions[i], m.uvs[i])).collect()
        };
        assert_eq!(all(&before), all(&after));
        assert!(after.normals.iter().all(|n| n.is_normalized()));
    }

    #[test]
    fn vertices_with_equal_positions_are_one_point() {
        let whole = smoothed(cube(), 91.0);
        let mut soup = cube();
        soup.positions = soup
            .triangles
            .iter()
            .flatten()
            .map(|&i| cube().positions[i as usize])
            .collect();
        soup.triangles = (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        soup.uvs.clear();
        let soup = smoothed(soup, 91.0);
        assert_eq!(soup.positions.len(), 36);
        let normals =
            |m: &Mesh| -> Vec<Vec3> { m.triangles.iter().flatten().map(|&i| m.normals[i as usize]).collect() };
        assert_eq!(normals(&whole), normals(&soup));
        assert!(soup.uvs.is_empty());
        assert_eq!(weld(&[Vec3::ZERO, Vec3::X, -Vec3::ZERO, Vec3::X]), [0, 1, 0, 1]);
    }

    #[test]
    fn triangles_without_area_are_ignored() {
        let mut mesh = cube();
        mesh.triangles.insert(0, [0, 0, 1]);
        mesh.triangles.push([0, 7, 7]);
        let mesh = smoothed(mesh, 91.0);
        assert!(mesh.normals.iter().all(|n| n.is_normalized()));
        assert_eq!(smoothed(Mesh::default(), 30.0).triangles.len(), 0);
    }

    #[test]
    fn angles_of_polygons() {
        let l = [[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]].map(|[x, y]| Vec3::new(x as f32, y as f32, 5.0));
        assert_eq!(area_vector(&l), DVec3::new(0.0, 0.0, 14.0));
        let degrees: Vec<f64> = corner_angles(&l, DVec3::Z).map(f64::to_degrees).collect();
        let expected = [90.0, 90.0, 90.0, 270.0, 90.0, 90.0];
        assert!(
            degrees.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
            "{degrees:?}"
        );
    }
}
