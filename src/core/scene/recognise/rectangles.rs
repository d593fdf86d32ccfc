//! Rectangles among emitting triangles. Each rectangle becomes a single light instead of two
//! triangles.
//!
//! This has three advantages (docs/notebook/2026-11.md, "Rectangles"). Points sampled on the light
//! are stratified over the whole rectangle. For receiving points near the rectangle, directions are
//! sampled uniformly over the rectangle's solid angle. The tables for the selection of lights have
//! half as many entries. A quad of an OBJ file becomes two consecutive triangles, and only
//! consecutive triangles are checked.

use crate::geometry::{Mesh, PrimId};
use crate::math::{Vec3, float::gamma};

/// The angle between two edges counts as a right angle if its cosine is at most this number. The
/// tolerance covers the rounding error of six digits in an OBJ file.
const RIGHT: f32 = 1e-5;

/// A light of an emitting mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) enum EmitterShape {
    Triangle(PrimId),
    /// A rectangle of two triangles: a corner, and the two edges from the corner. The cross product
    /// of the edges points along the normal.
    Rectangle(Vec3, [Vec3; 2]),
}

/// Lights of the emitting mesh `mesh`, in order: rectangles and other triangles. Also returns the
/// index of the light of each triangle.
pub(in crate::scene) fn parts(mesh: &Mesh) -> (Vec<EmitterShape>, Vec<u32>) {
    let count = mesh.triangles.len() as u32;
    let (mut parts, mut numbers) = (Vec::new(), Vec::new());
    let mut prim = 0;
    while prim < count {
        let number = parts.len() as u32;
        let corners = mesh.corners(PrimId(prim));
        let next = (prim + 1 < count).then(|| mesh.corners(PrimId(prim + 1)));
        match next.and_then(|next| rectangle(corners, next)) {
            Some((corner, edges)) => {
                parts.push(EmitterShape::Rectangle(corner, edges));
                numbers.extend([number; 2]);
                prim += 2;
            }
            None => {
                parts.push(EmitterShape::Triangle(PrimId(prim)));
                numbers.push(number);
                prim += 1;
            }
        }
    }
    (parts, numbers)
}

/// The rectangle that two triangles form: a corner and two edges; `None` if they do not form a
/// rectangle.
fn rectangle(one: [Vec3; 3], other: [Vec3; 3]) -> Option<(Vec3, [Vec3; 2])> {
    let corner = |of: &[Vec3; 3], i: usize| of[i % 3];
    for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
        // Find the shared diagonal: it has opposite directions in both triangles
        let [p, a, b] = [0, 1, 2].map(|k| corner(&one, i + k));
        let [q, c, d] = [0, 1, 2].map(|k| corner(&other, j + k));
        if (a, b) != (d, c) {
            continue;
        }
        let edges = [a - p, b - p];
        // Accept a fourth corner that is displaced by less than the distance at which rays start
        // off the surface
        let largest = one
            .iter()
            .chain(&other)
            .fold(Vec3::ZERO, |largest, p| largest.max(p.abs()));
        let is_closed = (p + edges[0] + edges[1] - q).abs().max_element() <= gamma(8) * largest.max_element();
        let lengths = edges[0].length() * edges[1].length();
        let is_right = edges[0].dot(edges[1]).abs() <= RIGHT * lengths;
        return (is_closed && is_right && lengths > 0.0 && lengths.is_finite()).then_some((p, edges));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.iter().map(|p| Vec3::from_array(*p)).collect(),
            triangles: triangles.to_vec(),
            ..Mesh::default()
        }
    }

    const SQUARE: [[f32; 3]; 4] = [[1.0, 1.0, 0.0], [4.0, 1.0, 0.0], [4.0, 3.0, 0.0], [1.0, 3.0, 0.0]];

    /// The rectangle has the corners and the normal of its triangles, whichever corner of a
    /// triangle comes first.
    #[test]
    fn two_triangles_are_a_rectangle() {
        for (first, second) in (0..9).map(|k| (k / 3, k % 3)) {
            let turned = |t: [u32; 3], by: usize| [t[by % 3], t[(by + 1) % 3], t[(by + 2) % 3]];
            for diagonal in [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]], [[2, 1, 0], [3, 2, 0]]] {
                let mesh = mesh(&SQUARE, &[turned(diagonal[0], first), turned(diagonal[1], second)]);
                let (parts, numbers) = parts(&mesh);
                assert_eq!(numbers, [0, 0]);
                let [EmitterShape::Rectangle(corner, [a, b])] = parts[..] else {
                    panic!("no rectangle")
                };
                let normal = mesh.surface_point(PrimId(0), 0.3, 0.3).ng;
                assert_eq!(a.cross(b), 6.0 * normal);
                assert!(mesh.positions.contains(&corner) && mesh.positions.contains(&(corner + a + b)));
            }
        }
    }

    #[test]
    fn other_quads_stay_triangles() {
        let quads: [(&str, [[f32; 3]; 4]); 4] = [
            (
                "slanted",
                [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.5, 1.0, 0.0], [0.5, 1.0, 0.0]],
            ),
            (
                "bent",
                [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.01], [0.0, 1.0, 0.0]],
            ),
            (
                "uneven",
                [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.1, 0.0], [0.0, 1.0, 0.0]],
            ),
            ("empty", [[0.0; 3]; 4]),
        ];
        for (name, corners) in quads {
            let (parts, numbers) = parts(&mesh(&corners, &[[0, 1, 2], [0, 2, 3]]));
            assert_eq!(
                parts,
                [EmitterShape::Triangle(PrimId(0)), EmitterShape::Triangle(PrimId(1))],
                "{name}"
            );
            assert_eq!(numbers, [0, 1], "{name}");
        }
        // If the windings are opposite, the diagonal has the same direction in both triangles.
        let (parts, _) = parts(&mesh(&SQUARE, &[[0, 1, 2], [0, 3, 2]]));
        assert_eq!(parts.len(), 2);
    }

    /// In a mesh with rectangles between triangles, each triangle has the index of its part.
    #[test]
    fn triangles_have_the_index_of_their_part() {
        let triangles = [
            [0, 1, 3],
            [0, 1, 2],
            [0, 2, 3],
            [1, 2, 0],
            [1, 2, 3],
            [1, 3, 0],
            [0, 1, 3],
        ];
        let (parts, numbers) = parts(&mesh(&SQUARE, &triangles));
        assert_eq!(numbers, [0, 1, 1, 2, 3, 3, 4]);
        assert!(matches!(parts[1], EmitterShape::Rectangle(..)) && matches!(parts[3], EmitterShape::Rectangle(..)));
        assert_eq!(parts[2], EmitterShape::Triangle(PrimId(3)));
    }
}
