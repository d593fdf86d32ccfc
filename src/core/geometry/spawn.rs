//! Ray origins that are moved off a surface. Bounds on rounding errors replace a fixed epsilon.
//!
//! Intersectors return barycentrics, and points are interpolated from the mesh's own corners. A new
//! ray starts off the surface: the origin is moved along the normal by the point's ray offset, to
//! the side of the ray's direction. The offset is the sum of two parts, where γₙ is the bound on
//! the error of n roundings:
//!
//! - γ₉ · |n| · Σ |bᵢ pᵢ|: the error of the interpolation and of the move itself, along the normal
//!   n.
//! - γ₆ times the maximum coordinate difference between the first corner and the others, because an
//!   intersector rounds edges of this length. Rounding tilts very narrow triangles, so this part is
//!   multiplied by the ratio of the longest edge to the width, if the ratio is more than 1. The
//!   product is at most half the width. This part is stored with each triangle's normal.
//!
//! The second part is needed on planes through the origin, where the first part vanishes. From a
//! start on the plane itself, an intersector that includes t = 0 would hit the surface again.
//!
//! A triangle of a curved surface has a second offset, the height of the curved surface over the
//! triangle (`SurfacePoint::curvature_offset`). Only directions on different sides of the two
//! normals need this offset. Such a direction is below the plane of the facet but above the curved
//! surface. In all other directions, no neighbouring facet of a convex surface is in the way, so
//! rays start on the mesh up to rounding. This is the same for all light transport methods.
//! `integrator/world.rs` prevents that a raised start is inside another object.
//!
//! A shadow ray has the full distance as its direction, and ends at t = 1 − γ₁₆. The point on the
//! light is moved off the surface of the light by the same rule.

use super::SurfacePoint;
use crate::math::{Ray, Vec3, float::gamma};

/// A side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Side of the geometric normal.
    Front,
    /// Opposite side.
    Back,
}

impl Side {
    /// Side of a direction whose z coordinate is `z`, in a frame with the normal along z.
    #[inline(always)]
    pub fn of(z: f32) -> Self {
        if z < 0.0 { Self::Back } else { Self::Front }
    }
}

impl SurfacePoint {
    /// Returns true if the shading normal and the geometric normal agree on the side of the surface
    /// to which the unit direction `w` points. If not, only paths from the camera find light from
    /// this direction, because a path from a light hits the other side.
    #[inline(always)]
    pub fn sides_agree(&self, w: Vec3) -> bool {
        Side::of(w.dot(self.ns)) == Side::of(w.dot(self.ng))
    }

    /// Returns true if the unit direction `w` points to `side`. The geometric normal decides.
    #[inline(always)]
    pub fn is_above(&self, side: Side, w: Vec3) -> bool {
        Side::of(w.dot(self.ng)) == side
    }

    /// Height of the curved surface over the facet, on `side`; 0 if the triangle is flat.
    #[inline(always)]
    pub fn height(&self, side: Side) -> f32 {
        match side {
            Side::Front => self.curvature_offset[0],
            Side::Back => self.curvature_offset[1],
        }
    }

    /// Position moved off the surface to `side`, by the ray offset plus `height`.
    #[inline(always)]
    pub fn raised(&self, side: Side, height: f32) -> Vec3 {
        match side {
            Side::Front => self.p + self.ng * (self.ray_offset + height),
            Side::Back => self.p - self.ng * (self.ray_offset + height),
        }
    }
}

/// Position of `s`, moved off the surface along the normal to `side`, just beyond the rounding
/// error.
///
/// A ray from the moved point to that side cannot hit the surface of the point, and skips nothing
/// wider than the rounding error (PBR4 §6.8.6; the rounding of the sum itself is part of the bound
/// here).
#[inline(always)]
pub fn offset_to(s: &SurfacePoint, side: Side) -> Vec3 {
    s.raised(side, 0.0)
}

/// Origin of a ray from the surface point `s` in the direction `w`, moved off the surface to the
/// side of `w`.
pub fn offset_origin(s: &SurfacePoint, w: Vec3) -> Vec3 {
    offset_to(s, Side::of(w.dot(s.ng)))
}

/// Ray from the surface at `s` in direction `w`.
pub fn ray_towards(s: &SurfacePoint, w: Vec3) -> Ray {
    Ray::new(offset_origin(s, w), w).when(s.time)
}

/// Segment from the surface at `s` to the point `target`, which the segment does not reach.
///
/// If `target` is on a surface, the caller must move `target` off that surface first
/// ([`offset_origin`]).
pub fn ray_between(s: &SurfacePoint, target: Vec3) -> Ray {
    segment(offset_origin(s, target - s.p), target).when(s.time)
}

/// Segment from `origin` to the point `target`, which the segment does not reach, at time 0.
#[inline(always)]
pub fn segment(origin: Vec3, target: Vec3) -> Ray {
    Ray {
        // The segment ends a little before `target`, because `t` of an intersector has an error of
        // a few roundings of the full length.
        t_max: 1.0 - gamma(16),
        ..Ray::new(origin, target - origin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Mesh, PrimId};

    #[test]
    fn origins_leave_on_the_side_of_the_direction() {
        let mesh = Mesh {
            positions: vec![
                Vec3::new(1e3, 0.0, 0.0),
                Vec3::new(1e3, 1.0, 0.0),
                Vec3::new(1e3, 0.0, 1.0),
            ],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let s = mesh.surface_point(PrimId(0), 0.25, 0.5);
        assert_eq!(s.ng, Vec3::X);
        let right = offset_origin(&s, Vec3::new(0.1, 5.0, 0.0)).x - 1e3;
        let left = 1e3 - offset_origin(&s, Vec3::new(-0.1, 5.0, 0.0)).x;
        // The distances equal the ray offset up to the rounding of the sum: half a unit in the last
        // place of 1000.
        for distance in [left, right] {
            assert!(
                (distance - s.ray_offset).abs() <= 3.1e-5 && distance > 0.0,
                "{distance} against {}",
                s.ray_offset
            );
        }
        // A plane through the origin
        let flat = Mesh {
            positions: vec![Vec3::ZERO, Vec3::Z, Vec3::X],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let floor = flat.surface_point(PrimId(0), 0.2, 0.2);
        assert!(offset_origin(&floor, Vec3::Y).y > 0.0 && offset_origin(&floor, Vec3::NEG_Y).y < 0.0);
        let ray = ray_between(&s, Vec3::new(2e3, 0.0, 0.0));
        assert!(ray.t_max < 1.0 && ray.t_max > 0.99999);
    }
}
