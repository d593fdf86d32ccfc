//! Placements of prototypes (instances) and their motion.
//!
//! Meshes stand in the world or belong to a prototype, which instances place: one level, as Embree's libraries are built. Meshes in the world have
//! their facets ready. A triangle that is placed or moves is made anew at each hit (`PlacedTriangle`), so that 10⁸ triangles of copies need no
//! memory.
//!
//! Rays keep their parameter in the space of a prototype. The transform loses digits, by some roundings of |M| |M⁻¹| (|p| + |t|), so rays start
//! further off where an instance is far from the origin. By the same bound, points keep off the edges of their triangle (`PlacedTriangle::point`): nearer,
//! roundings may put the start of a ray behind the neighbour, and paths leak (docs/benchmarks.md, "Leaks in instances").
//!
//! A moving placement is a list of matrices with linear motion in between, because that is what Embree interpolates. Backends and shading see the
//! same motion; rotations are cut finely enough when they are read. Time is a field of `Ray` and of `SurfacePoint`.

use super::SurfacePoint;
use super::mesh::Facet;
use crate::math::{Affine3A, Bounds3, Encode, Mat3A, Vec3, float::gamma};
use std::sync::Arc;

/// Where an instance stands in the world, which may change between the times 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// It stays there.
    Still(Affine3A),
    /// It passes these, two at least, at equal intervals from time 0 to time 1. In between, each element of the matrix changes linearly.
    Moving(Arc<[Affine3A]>),
}

impl Encode for Placement {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Still(placement) => {
                sink(&[0]);
                placement.encode(sink);
            }
            Self::Moving(steps) => {
                sink(&[1]);
                steps.as_ref().encode(sink);
            }
        }
    }
}

impl Placement {
    /// Maximum number of steps that a motion may have; Embree takes no more.
    pub const MAX_STEPS: usize = 129;

    /// Transform at `time` in [0, 1].
    pub fn at(&self, time: f32) -> Affine3A {
        match self {
            Self::Still(placement) => *placement,
            Self::Moving(steps) => {
                let last = steps.len() - 2;
                let place = time * (steps.len() - 1) as f32;
                let step = (place as usize).min(last);
                lerp(&steps[step], &steps[step + 1], place - step as f32)
            }
        }
    }

    /// All that it passes.
    pub fn steps(&self) -> &[Affine3A] {
        match self {
            Self::Still(placement) => std::slice::from_ref(placement),
            Self::Moving(steps) => steps,
        }
    }

    /// Whether it changes.
    pub fn is_moving(&self) -> bool {
        matches!(self, Self::Moving(_))
    }

    /// A box in the world around what is in `bounds` at any time, roundings included.
    pub fn bounds(&self, bounds: Bounds3) -> Bounds3 {
        // A point moves on straight lines between its places at the steps.
        let mut all = Bounds3::EMPTY;
        if bounds.is_empty() {
            return all;
        }
        for step in self.steps() {
            for corner in bounds.corners() {
                let p = step.transform_point3a(corner);
                let error = rounding(step, p);
                all.extend(p - error);
                all.extend(p + error);
            }
        }
        all
    }
}

/// Element by element.
fn lerp(a: &Affine3A, b: &Affine3A, t: f32) -> Affine3A {
    Affine3A {
        matrix3: a.matrix3 * (1.0 - t) + b.matrix3 * t,
        translation: a.translation * (1.0 - t) + b.translation * t,
    }
}

/// Half-width of a box around the world point `p` in which an intersector may find a point placed by `m`.
///
/// It moves the ray into the space of the mesh, `M⁻¹ (o − t)`; in f32 that point, and the inverse itself, are off by some roundings of
/// `|M⁻¹| (|o| + |t|)`, which is `|M| |M⁻¹| (|o| + |t|)` in the world (Higham 2002, §3.5, componentwise).
pub fn rounding(m: &Affine3A, p: Vec3) -> Vec3 {
    let abs = |m: Mat3A| Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let inverse = abs(m.matrix3.inverse());
    gamma(16) * (abs(m.matrix3) * (inverse * (p.abs() + m.translation.abs())))
}

/// A triangle in its place in the world at some time. Corners run counter-clockwise seen from the front, mirrored or not.
#[derive(Clone, Copy, Debug)]
pub struct PlacedTriangle {
    /// Corners in world space.
    pub corners: [Vec3; 3],
    /// Unit shading normals there, if there are any.
    normals: Option<[Vec3; 3]>,
    /// Where it is, if it has been moved there.
    placement: Option<Affine3A>,
    /// Whether the second and the third corner have changed places.
    is_mirrored: bool,
}

impl PlacedTriangle {
    /// The triangle of these corners and normals, as the mesh has them at that time.
    pub fn new(corners: [Vec3; 3], normals: Option<[Vec3; 3]>, placement: Option<Affine3A>) -> Self {
        let Some(m) = placement else {
            return Self {
                corners,
                normals,
                placement,
                is_mirrored: false,
            };
        };
        // Normals are planes: they go by the inverse transpose.
        let of_normals = m.matrix3.inverse().transpose();
        let mut placed = Self {
            corners: corners.map(|p| m.transform_point3a(p)),
            normals: normals.map(|n| n.map(|n| (of_normals * n).normalize_or(n))),
            placement,
            is_mirrored: m.matrix3.determinant() < 0.0,
        };
        // The front stays the front.
        if placed.is_mirrored {
            placed.corners.swap(1, 2);
            if let Some(normals) = &mut placed.normals {
                normals.swap(1, 2);
            }
        }
        placed
    }

    /// Whether the second and the third corner have changed places.
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// The point at barycentric coordinates `b1`, `b2` of the mesh's second and third corner.
    ///
    /// Where an instance places the triangle, the point keeps off its edges by as much as an intersector may be wrong: nearer to an edge, rays could start behind the
    /// triangle beyond it.
    pub fn point(&self, b1: f32, b2: f32) -> SurfacePoint {
        let (b1, b2) = if self.is_mirrored { (b2, b1) } else { (b1, b2) };
        let mut b = [1.0 - b1 - b2, b1, b2];
        let facet = Facet::new(self.corners);
        let mut point = SurfacePoint::new(self.corners, facet, b1, b2);
        // Corners may have been interpolated in time, by our roundings or by an intersector's.
        let mut error = gamma(4) * point.p.abs();
        if let Some(m) = &self.placement {
            error += rounding(m, point.p);
            b = inside(self.corners, b, error.length());
            point = SurfacePoint::new(self.corners, facet, b[1], b[2]);
        }
        point.ray_offset += point.ng.abs().dot(error);
        match self.normals {
            Some(normals) => point.curved(self.corners, normals, b),
            None => point,
        }
    }

    /// Bound on the distance at which an intersector finds its points.
    pub fn rounding(&self) -> f32 {
        let of = |p: Vec3| gamma(4) * p.abs() + self.placement.map_or(Vec3::ZERO, |m| rounding(&m, p));
        self.corners.map(|p| of(p).length()).into_iter().fold(0.0, f32::max)
    }
}

/// The weights `b` of a triangle's corners, changed as little as it takes for their point to be at least `distance` from each edge; where the triangle is too narrow for that, as far
/// from them as it can be without a longer way than four times `distance`.
fn inside([p0, p1, p2]: [Vec3; 3], b: [f32; 3], distance: f32) -> [f32; 3] {
    let twice_area = (p1 - p0).cross(p2 - p0).length();
    // A weight is the distance from the edge opposite to the corner, over the corner's.
    let lowest = [p2 - p1, p0 - p2, p1 - p0].map(|edge| (distance * edge.length() / twice_area).min(1.0 / 3.0));
    if (0..3).all(|i| b[i] >= lowest[i]) || !lowest.iter().all(|w| w.is_finite()) {
        return b;
    }
    let above = [0, 1, 2].map(|i| (b[i] - lowest[i]).max(0.0));
    let (sum, left): (f32, f32) = (above.iter().sum(), 1.0 - lowest.iter().sum::<f32>());
    let share = if sum > 0.0 { left.max(0.0) / sum } else { 0.0 };
    let change = [0, 1, 2].map(|i| lowest[i] + above[i] * share - b[i]);
    let way = (change[0] * p0 + change[1] * p1 + change[2] * p2).length();
    let part = (4.0 * distance / way).min(1.0);
    [0, 1, 2].map(|i| b[i] + part * change[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_keep_off_the_edges() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let away = [0.2, 0.3, 0.5];
        assert_eq!(inside(corners, away, 0.01), away);
        for b in [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.5],
            [0.98, 0.01, 0.01],
        ] {
            let inner = inside(corners, b, 0.02);
            let p = inner[1] * Vec3::X + inner[2] * Vec3::Y;
            let from_hypotenuse = (1.0 - p.x - p.y) / 2f32.sqrt();
            assert!(p.x.min(p.y).min(from_hypotenuse) >= 0.0199, "{b:?}: {inner:?}");
            assert!((inner.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{b:?}: {inner:?}");
            let moved = p.distance(b[1] * Vec3::X + b[2] * Vec3::Y);
            assert!(moved < 0.06, "{b:?}: {inner:?}");
        }
        // Along a sliver they stay where they are, or nearly.
        let sliver = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-3, 0.0)];
        let p = inside(sliver, [0.9, 0.1, 0.0], 0.01);
        let x = p[1] + 0.5 * p[2];
        assert!(p.iter().all(|w| *w > 0.0) && (x - 0.1).abs() < 0.041, "{p:?}");
    }
}
