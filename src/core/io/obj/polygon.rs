//! Triangulation of polygons.
//!
//! A fan from the first corner is used if all its triangles have the orientation of the polygon. It
//! is then correct, and no test for convexity is needed. For other polygons, ears are clipped one
//! by one. Ear clipping computes in f64 with two of the three coordinates, without a rotation, so
//! collinear corners stay exactly collinear. A k-d tree (`corner_tree`) finds the corners near an
//! ear, so n corners take n log n time. The triangles are the same as with a search through all
//! corners.

mod corner_tree;

use crate::io::normals::area_vector;
use crate::math::Vec3;
use corner_tree::CornerTree;
use std::array;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// Maximum number of corners for ear clipping. Faces with more corners are cut as fans, even if the
/// triangles overlap.
pub(super) const MAX_CLIPPED: usize = 10_000;

/// Cuts a polygon of n corners into n − 2 triangles of the same winding. Calls `emit` with the
/// indices of their corners.
///
/// A fan from the first corner is used if all its triangles have the polygon's orientation, as in
/// every convex polygon. The triangles then do not overlap, because the sum of their areas is the
/// polygon's area. In other polygons, ears are clipped one after the other (Meisters 1975), in the
/// plane of Newell's normal. A polygon that crosses itself is also triangulated, but some of its
/// triangles overlap.
pub(super) fn triangulate(points: &[Vec3], emit: &mut impl FnMut([usize; 3])) {
    let n = points.len();
    let normal = area_vector(points);
    let triangles = (2..n).map(|i| [0, i - 1, i]);
    let keeps_winding = |t: [usize; 3]| area_vector(&t.map(|i| points[i])).dot(normal) > 0.0;
    if n <= 3 || n > MAX_CLIPPED || triangles.clone().all(keeps_winding) {
        triangles.for_each(emit);
        return;
    }

    // Drop the axis along which the normal is longest. The other two coordinates stay exact.
    let [x, y, z] = normal.abs().to_array();
    let (first, second, along) = match (x >= y && x >= z, y >= z) {
        (true, _) => (1, 2, normal.x),
        (_, true) => (2, 0, normal.y),
        _ => (0, 1, normal.z),
    };
    let turn = if along < 0.0 { -1.0 } else { 1.0 };
    let flat = |p: &Vec3| [p[first] as f64, turn * p[second] as f64];
    Ring::new(points.iter().map(flat).collect()).clip_ears(emit);
}

/// The polygon that remains while ears are clipped. It is counter-clockwise.
struct Ring {
    points: Vec<[f64; 2]>,
    /// Previous corner of each corner.
    previous: Vec<usize>,
    /// Next corner of each corner.
    next: Vec<usize>,
    /// Number of remaining corners.
    len: usize,
    /// Corners that may be ears. At first, these are all corners. If a check finds that a corner is
    /// not an ear, the corner is removed. If a neighbour of the corner changes, the corner is added
    /// again.
    open: BTreeSet<usize>,
    /// Tree of the remaining corners, by position.
    tree: CornerTree,
    /// The remaining corners, sorted by the signed areas of their triangles. Empty until a polygon
    /// that crosses itself needs the list.
    areas: BTreeSet<(Area, usize)>,
}

impl Ring {
    fn new(points: Vec<[f64; 2]>) -> Self {
        let len = points.len();
        Self {
            previous: (0..len).map(|i| (i + len - 1) % len).collect(),
            next: (0..len).map(|i| (i + 1) % len).collect(),
            len,
            open: (0..len).collect(),
            tree: CornerTree::new(&points),
            areas: BTreeSet::new(),
            points,
        }
    }

    /// Clips ears until no corner is left.
    ///
    /// A corner is checked again only if its neighbours have changed, because clipping an ear of a
    /// simple polygon makes no ear elsewhere. There are fewer than 3 n checks, and each check tests
    /// only the few corners near the ear.
    fn clip_ears(mut self, emit: &mut impl FnMut([usize; 3])) {
        let mut corner = 0;
        while self.len > 3 {
            // Find the next ear. If there is none, the polygon crosses itself: use the most convex
            // corner.
            let ear = loop {
                match first_from(&self.open, corner) {
                    None => break self.most_convex(corner),
                    Some(open) if self.is_spike(open) || self.is_ear(open) => break open,
                    Some(open) => _ = self.open.remove(&open),
                }
            };
            let [before, _, after] = self.triangle(ear);
            emit([before, ear, after]);
            self.clip(ear);
            // Remove a spike first. Otherwise ears outside of the remaining polygon would be found.
            corner = if self.is_spike(before) { before } else { after };
        }
        emit(self.triangle(corner));
    }

    /// Removes a corner.
    fn clip(&mut self, corner: usize) {
        let [before, _, after] = self.triangle(corner);
        let has_areas = !self.areas.is_empty();
        if has_areas {
            for changed in [before, corner, after] {
                self.areas.remove(&(self.area(changed), changed));
            }
        }
        (self.next[before], self.previous[after]) = (after, before);
        self.tree.remove(corner);
        self.open.remove(&corner);
        self.open.extend([before, after]);
        if has_areas {
            self.areas
                .extend([before, after].map(|changed| (self.area(changed), changed)));
        }
        self.len -= 1;
    }

    /// The previous corner, `corner`, and the next corner.
    fn triangle(&self, corner: usize) -> [usize; 3] {
        [self.previous[corner], corner, self.next[corner]]
    }

    /// Returns true if the previous and the next corner are at the same point, so that the two
    /// edges of the corner are the same line, there and back.
    fn is_spike(&self, corner: usize) -> bool {
        self.points[self.previous[corner]] == self.points[self.next[corner]]
    }

    /// Returns true if the corner is convex, and no other part of the polygon lies in its triangle
    /// or touches the new edge.
    fn is_ear(&self, corner: usize) -> bool {
        let triangle = self.triangle(corner);
        let [a, b, c] = triangle.map(|i| self.points[i]);
        if signed_area(a, b, c) <= 0.0 {
            return false;
        }
        self.tree.all_near([a, b, c], &mut |other| {
            let p = self.points[other];
            // The polygon may touch itself at b, so check the edges there. At a and c it cannot
            // enter the triangle without crossing an edge.
            if triangle.contains(&other) {
                true
            } else if p == b {
                [self.previous[other], self.next[other]].iter().all(|&i| {
                    let q = self.points[i];
                    signed_area(b, c, q) <= 0.0 || signed_area(b, q, a) <= 0.0
                })
            } else {
                let is_outside = signed_area(a, b, p) < 0.0 || signed_area(b, c, p) < 0.0 || signed_area(c, a, p) < 0.0;
                is_outside || p == a || p == c
            }
        })
    }

    /// Signed area of a corner's triangle.
    fn area(&self, corner: usize) -> Area {
        let [a, b, c] = self.triangle(corner).map(|i| self.points[i]);
        Area(signed_area(a, b, c))
    }

    /// Remaining corner whose triangle has the largest signed area. If there are several, the first
    /// after `start`.
    fn most_convex(&mut self, start: usize) -> usize {
        if self.areas.is_empty() {
            let rest = std::iter::successors(Some(start), |&i| Some(self.next[i])).take(self.len);
            self.areas = rest.map(|i| (self.area(i), i)).collect();
        }
        let Some(&(largest, last)) = self.areas.last() else {
            return start;
        };
        let mut from_start = self.areas.range((largest, start)..);
        let first = || self.areas.range((largest, 0)..).next();
        from_start.next().or_else(first).map_or(last, |&(_, corner)| corner)
    }
}

/// Smallest number of the set that is at least `start`. If there is none, the smallest number of
/// the set.
fn first_from(set: &BTreeSet<usize>, start: usize) -> Option<usize> {
    set.range(start..).next().or_else(|| set.first()).copied()
}

/// A number that can be a key of sorted sets. −0 equals 0.
#[derive(Clone, Copy)]
struct Area(f64);

impl Ord for Area {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.0 + 0.0).total_cmp(&(other.0 + 0.0))
    }
}

impl PartialOrd for Area {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Area {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Area {}

/// Twice the area of a triangle, negative if it is clockwise.
fn signed_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    let [ab, ac]: [[f64; 2]; 2] = [b, c].map(|p| array::from_fn(|i| p[i] - a[i]));
    ab[0] * ac[1] - ab[1] * ac[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangle_area;
    use crate::math::{Frame, hash::mix};

    fn cut(points: &[Vec3]) -> Vec<[usize; 3]> {
        let mut triangles = Vec::new();
        triangulate(points, &mut |t| triangles.push(t));
        triangles
    }

    /// A polygon in the plane z = 0 with integer coordinates.
    fn plane(corners: &[[i32; 2]]) -> Vec<Vec3> {
        corners
            .iter()
            .map(|&[x, y]| Vec3::new(x as f32, y as f32, 0.0))
            .collect()
    }

    /// Area of a polygon in the plane z = 0, by the shoelace formula.
    fn shoelace(points: &[Vec3]) -> f64 {
        let pairs = points.iter().zip(points.iter().cycle().skip(1));
        let doubled: f64 = pairs
            .map(|(p, q)| p.x as f64 * q.y as f64 - q.x as f64 * p.y as f64)
            .sum();
        0.5 * doubled
    }

    /// Checks, for all orientations of the polygon, that the areas of its triangles sum to its area
    /// and that no triangle is turned over. The triangles then do not overlap.
    fn assert_tiles(what: &str, points: &[Vec3], degenerate: usize) {
        let area = shoelace(points).abs();
        let n = points.len();
        let frames = [
            Vec3::Z,
            -Vec3::Z,
            Vec3::Y,
            -Vec3::X,
            Vec3::new(1.0, -2.0, 3.0).normalize(),
        ];
        for (k, axis) in frames.into_iter().enumerate() {
            let frame = Frame::from_z(axis);
            for reversed in [false, true] {
                for shift in 0..n {
                    let mut turned: Vec<Vec3> = points.iter().map(|&p| frame.to_world(p)).collect();
                    turned.rotate_left(shift);
                    if reversed {
                        turned.reverse();
                    }
                    let triangles = cut(&turned);
                    assert_eq!(triangles.len(), n - 2, "{what}");
                    let areas = triangles
                        .iter()
                        .map(|&[a, b, c]| triangle_area(turned[a], turned[b], turned[c]));
                    let sum: f64 = areas.clone().sum();
                    assert!(
                        (sum - area).abs() < 1e-5 * area,
                        "{what}, shift {shift}: {sum} of {area}"
                    );
                    // For exact coordinates, the number of triangles without area is exact.
                    let empty = areas.filter(|&a| a == 0.0).count();
                    assert!(
                        k == 4 || empty == degenerate,
                        "{what}, shift {shift}: {empty} without area"
                    );
                }
            }
        }
    }

    #[test]
    fn concave_polygons_keep_their_area() {
        let l = plane(&[[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]);
        assert_eq!(shoelace(&l), 7.0);
        assert_tiles("L", &l, 0);
        let star = plane(&[[0, 9], [2, 2], [9, 0], [2, -2], [0, -9], [-2, -2], [-9, 0], [-2, 2]]);
        assert_tiles("star", &star, 0);
        let comb = plane(&[
            [0, 0],
            [9, 0],
            [9, 5],
            [7, 1],
            [6, 5],
            [5, 1],
            [4, 5],
            [3, 1],
            [2, 5],
            [1, 1],
        ]);
        assert_tiles("comb", &comb, 0);
        let arrow = plane(&[[0, 0], [4, -3], [1, 0], [4, 3]]);
        assert_tiles("arrow", &arrow, 0);
    }

    #[test]
    fn spirals_keep_their_area() {
        // The spiral goes outwards along its inner wall, and back along its outer wall.
        let wall = |radius: f32| {
            move |i: i32| {
                let (sin, cos) = (i as f32 * 0.35).sin_cos();
                let r = radius + 0.2 * i as f32;
                Vec3::new(r * cos, r * sin, 0.0)
            }
        };
        let spiral: Vec<Vec3> = (0..60).map(wall(1.6)).chain((0..60).rev().map(wall(1.0))).collect();
        assert_tiles("spiral", &spiral, 0);
    }

    #[test]
    fn corners_on_a_line_give_no_empty_triangles() {
        assert_tiles(
            "square",
            &plane(&[[0, 0], [1, 0], [2, 0], [2, 2], [1, 2], [0, 2], [0, 1]]),
            0,
        );
        let triangle = plane(&[[0, 0], [1, 0], [2, 0], [4, 0], [2, 2], [1, 3], [0, 4], [0, 3], [0, 1]]);
        assert_tiles("triangle", &triangle, 0);
        assert_tiles(
            "L",
            &plane(&[[0, 0], [4, 0], [4, 1], [3, 1], [1, 1], [1, 2], [1, 4], [0, 4]]),
            0,
        );
        // A corner given twice
        assert_tiles("twice", &plane(&[[0, 0], [4, 0], [4, 0], [4, 4], [0, 4]]), 1);
    }

    #[test]
    fn polygons_that_touch_themselves_keep_their_area() {
        // Two squares that share a corner
        assert_tiles(
            "bow",
            &plane(&[[0, 0], [2, 0], [2, 2], [4, 2], [4, 4], [2, 4], [2, 2], [0, 2]]),
            2,
        );
        // A square with a square hole, reached by a slit
        let hole = [
            [0, 0],
            [6, 0],
            [6, 6],
            [0, 6],
            [0, 0],
            [2, 2],
            [2, 4],
            [4, 4],
            [4, 2],
            [2, 2],
        ];
        assert_eq!(shoelace(&plane(&hole)), 32.0);
        assert_tiles("hole", &plane(&hole), 0);
        // A square with a hole that touches a corner of the square; a slit leads to the hole from
        // the opposite corner
        let touching = [
            [0, 0],
            [4, 0],
            [4, 4],
            [3, 3],
            [3, 2],
            [0, 0],
            [2, 3],
            [3, 3],
            [4, 4],
            [0, 4],
        ];
        assert_tiles("touching", &plane(&touching), 2);
    }

    #[test]
    fn random_stars_keep_their_area() {
        for seed in 0..1000 {
            let n = 4 + seed % 20;
            let star = |size: u64, key: u64| -> Vec<Vec3> {
                let corner = |i: u64| {
                    let radius = (size + mix(seed * 100 + key + i) % (4 * size)) as f32;
                    let (sin, cos) = (i as f32 / n as f32 * std::f32::consts::TAU).sin_cos();
                    Vec3::new(radius * cos, radius * sin, 0.0)
                };
                (0..n).map(corner).collect()
            };
            // A star, and the star with a smaller star as a hole, connected by a slit
            let (outer, hole) = (star(5, 0), star(1, 50));
            let inner = hole.iter().rev().cycle().skip(n as usize - 1).take(n as usize + 1);
            let holed: Vec<Vec3> = outer.iter().chain(&outer[..1]).chain(inner).copied().collect();
            for polygon in [outer, holed] {
                let areas = cut(&polygon)
                    .into_iter()
                    .map(|[a, b, c]| triangle_area(polygon[a], polygon[b], polygon[c]));
                let (sum, area) = (areas.sum::<f64>(), shoelace(&polygon));
                assert!((sum - area).abs() < 1e-5 * area, "seed {seed}: {sum} of {area}");
            }
        }
    }

    #[test]
    fn random_polygon_has_as_many_triangles_as_a_fan() {
        let random = |seed: u64, n: usize, size: u64| -> Vec<Vec3> {
            let number = |i: u64| (mix(seed * 1000 + i) % size) as f32;
            (0..n as u64)
                .map(|i| Vec3::new(number(3 * i), number(3 * i + 1), number(3 * i + 2)))
                .collect()
        };
        for seed in 0..2000 {
            let n = 3 + (seed % 12) as usize;
            let points = random(seed, n, 2 + seed % 7);
            let triangles = cut(&points);
            assert_eq!(triangles.len(), n - 2);
            // There are as many triangles as in a fan, and all corners are used.
            let mut used: Vec<usize> = triangles.concat();
            used.sort();
            used.dedup();
            assert_eq!(used.len(), n, "{points:?}");
        }
        let nothing = [Vec3::ONE; 9];
        assert_eq!(cut(&nothing).len(), 7);
    }

    #[test]
    fn worst_cases_are_fast() {
        // Worst case for sorting: every other corner is concave.
        let saw = |n: i32| -> Vec<Vec3> {
            let teeth = (0..n - 2).map(|i| Vec3::new(-i as f32, (i % 2) as f32, 0.0));
            let base = [Vec3::new(2.0 - n as f32, -9.0, 0.0), Vec3::new(0.0, -9.0, 0.0)];
            teeth.chain(base).collect()
        };
        let clipped = saw(2000);
        let areas = cut(&clipped)
            .into_iter()
            .map(|[a, b, c]| triangle_area(clipped[a], clipped[b], clipped[c]));
        assert!((areas.sum::<f64>() - shoelace(&clipped).abs()).abs() < 1e-3);
        assert_eq!(cut(&saw(MAX_CLIPPED as i32)).len(), MAX_CLIPPED - 2);
        assert_eq!(cut(&saw(200_000)).len(), 200_000 - 2);
        // Worst case for a polygon that crosses itself: hardly any corner is an ear.
        let tangle = |seed: u64| -> Vec<Vec3> {
            let number = |i: u64| (mix(seed << 32 | i) % 100_000) as f32;
            let corners = 0..MAX_CLIPPED as u64;
            corners
                .map(|i| Vec3::new(number(2 * i), number(2 * i + 1), 0.0))
                .collect()
        };
        for seed in 0..3 {
            assert_eq!(cut(&tangle(seed)).len(), MAX_CLIPPED - 2);
        }
    }
}
