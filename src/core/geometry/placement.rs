//! Placements of prototypes (instances) and their motion.
//!
//! Meshes are in world space or belong to a prototype, which instances place. There is one level of
//! instances, because common builds of Embree support only one. Meshes in world space have
//! precomputed facets. A placed or moving triangle is transformed at each hit (`PlacedTriangle`),
//! so that instances with 10⁸ triangles in total need no memory for these triangles.
//!
//! A ray has the same ray parameter in world space and in the space of a prototype. The transform p
//! → M p + t has an error of some roundings of |M| |M⁻¹| (|p| + |t|), so the ray offset is larger
//! if an instance is far from the origin. Points also keep at least a distance of this bound from
//! the edges of their triangle (`PlacedTriangle::point`). Nearer to an edge, a ray could start
//! behind the neighbouring triangle because of rounding, and paths would leak
//! (docs/notebook/2026-11.md, "Leaks in instances").
//!
//! A moving placement is a list of matrices with linear interpolation, as in Embree. Backends and
//! shading use the same motion. When a scene is read, each rotation is divided into so many steps
//! that linear interpolation is accurate enough. Time is a field of `Ray` and of `SurfacePoint`.

use super::SurfacePoint;
use super::mesh::Facet;
use crate::math::{Affine3A, Bounds3, Encode, Mat3A, Vec3, float::gamma};
use std::sync::Arc;

/// Transform of an instance, which may change between the times 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub enum Placement {
    /// Constant transform.
    Still(Affine3A),
    /// At least two transforms, at equal intervals from time 0 to time 1. In between, each element
    /// of the matrix changes linearly.
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
    /// Maximum number of steps of a motion, a limit of Embree.
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

    /// Transforms at all steps.
    pub fn steps(&self) -> &[Affine3A] {
        match self {
            Self::Still(placement) => std::slice::from_ref(placement),
            Self::Moving(steps) => steps,
        }
    }

    /// Returns true if the placement moves.
    pub fn is_moving(&self) -> bool {
        matches!(self, Self::Moving(_))
    }

    /// Bounding box in world space, over all times, of everything that is inside `bounds` in the
    /// space of the prototype. It includes rounding errors.
    pub fn bounds(&self, bounds: Bounds3) -> Bounds3 {
        // Between two steps, a point moves linearly, so the positions at the steps bound the
        // motion.
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

/// Linear interpolation of each element.
fn lerp(a: &Affine3A, b: &Affine3A, t: f32) -> Affine3A {
    Affine3A {
        matrix3: a.matrix3 * (1.0 - t) + b.matrix3 * t,
        translation: a.translation * (1.0 - t) + b.translation * t,
    }
}

/// Bound on the rounding error of a hit at the world point `p`, on an instance with the transform
/// `m`. The result has the half-widths of a box around `p`.
///
/// An intersector transforms the origin `o` of a ray into the space of the mesh: `M⁻¹ (o − t)`,
/// where `t` is the translation. In f32, the result has an error of some roundings of `|M⁻¹| (|o| +
/// |t|)`. In world space this is `|M| |M⁻¹| (|o| + |t|)` (Higham 2002, §3.5, componentwise).
pub fn rounding(m: &Affine3A, p: Vec3) -> Vec3 {
    let abs = |m: Mat3A| Mat3A::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let inverse = abs(m.matrix3.inverse());
    gamma(16) * (abs(m.matrix3) * (inverse * (p.abs() + m.translation.abs())))
}

/// A triangle in world space at some time. Corners run counter-clockwise seen from the front, even
/// if the placement mirrors the triangle.
#[derive(Clone, Copy, Debug)]
pub struct PlacedTriangle {
    /// Corners in world space.
    pub corners: [Vec3; 3],
    /// Unit shading normals at the corners, if any.
    normals: Option<[Vec3; 3]>,
    /// Transform of the triangle's instance, if any.
    placement: Option<Affine3A>,
    /// True if the second and the third corner are swapped.
    is_mirrored: bool,
}

impl PlacedTriangle {
    /// Triangle with these corners and normals of a mesh, placed by `placement`. All arguments are
    /// for the same time.
    pub fn new(corners: [Vec3; 3], normals: Option<[Vec3; 3]>, placement: Option<Affine3A>) -> Self {
        let Some(m) = placement else {
            return Self {
                corners,
                normals,
                placement,
                is_mirrored: false,
            };
        };
        // Normals transform by the inverse transpose.
        let of_normals = m.matrix3.inverse().transpose();
        let mut placed = Self {
            corners: corners.map(|p| m.transform_point3a(p)),
            normals: normals.map(|n| n.map(|n| (of_normals * n).normalize_or(n))),
            placement,
            is_mirrored: m.matrix3.determinant() < 0.0,
        };
        // Swap two corners, so that the front stays the front
        if placed.is_mirrored {
            placed.corners.swap(1, 2);
            if let Some(normals) = &mut placed.normals {
                normals.swap(1, 2);
            }
        }
        placed
    }

    /// Returns true if the second and the third corner are swapped.
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// Point at the barycentric coordinates `b1`, `b2` of the mesh's second and third corner.
    ///
    /// If the triangle belongs to an instance, the distance of the point from the edges is at least
    /// the bound on the error of an intersector. Nearer to an edge, rays could start behind the
    /// neighbouring triangle.
    pub fn point(&self, b1: f32, b2: f32) -> SurfacePoint {
        let (b1, b2) = if self.is_mirrored { (b2, b1) } else { (b1, b2) };
        let mut b = [1.0 - b1 - b2, b1, b2];
        let facet = Facet::new(self.corners);
        let mut point = SurfacePoint::new(self.corners, facet, b1, b2);
        // This module and the intersector interpolate the corners in time. Include the rounding
        // errors of both.
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

    /// Bound on the distance between the triangle and a hit of an intersector.
    pub fn rounding(&self) -> f32 {
        let of = |p: Vec3| gamma(4) * p.abs() + self.placement.map_or(Vec3::ZERO, |m| rounding(&m, p));
        self.corners.map(|p| of(p).length()).into_iter().fold(0.0, f32::max)
    }
}

/// Returns barycentric weights of a point that is at least `distance` away from each edge, and as
/// near as possible to the point with the weights `b`. If the triangle is too narrow for this, the
/// point moves by at most four times `distance`.
fn inside([p0, p1, p2]: [Vec3; 3], b: [f32; 3], distance: f32) -> [f32; 3] {
    let twice_area = (p1 - p0).cross(p2 - p0).length();
    // The weight of a corner is the distance of the point from the opposite edge, relative to the
    // height of the corner above this edge.
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
    fn points_keep_a_distance_from_edges() {
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
        // Points of a very narrow triangle move only a little.
        let sliver = [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 1e-3, 0.0)];
        let p = inside(sliver, [0.9, 0.1, 0.0], 0.01);
        let x = p[1] + 0.5 * p[2];
        assert!(p.iter().all(|w| *w > 0.0) && (x - 0.1).abs() < 0.041, "{p:?}");
    }
}
