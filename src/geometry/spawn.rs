use super::SurfacePoint;
use crate::math::{Ray, Vec3, float::gamma};

/// Moves a point off its surface along the normal, to the side that `w` points to, just beyond its rounding error.
///
/// A ray that starts there cannot meet the surface it left, and skips nothing wider than the rounding error
/// (PBR4 §6.8.6; the rounding of the sum itself is part of the bound here).
pub fn offset_origin(s: &SurfacePoint, w: Vec3) -> Vec3 {
    let side = w.dot(s.ng);
    let lift = if side < 0.0 { s.lift[1] } else { s.lift[0] };
    s.p + s.ng * (s.clearance + lift).copysign(side)
}

/// The ray that leaves the surface at `s` in direction `w`.
pub fn ray_towards(s: &SurfacePoint, w: Vec3) -> Ray {
    Ray::new(offset_origin(s, w), w)
}

/// The segment from the surface at `s` to the point `target`, which it does not reach.
///
/// `target` lies off its own surface already where it has one ([`offset_origin`]).
pub fn ray_between(s: &SurfacePoint, target: Vec3) -> Ray {
    let origin = offset_origin(s, target - s.p);
    Ray {
        // An intersector's t is off by a few roundings of the whole length: that much is left out.
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
        // Up to the rounding of the sum, half a unit in the last place of 1000.
        for distance in [left, right] {
            assert!(
                (distance - s.clearance).abs() <= 3.1e-5 && distance > 0.0,
                "{distance} against {}",
                s.clearance
            );
        }
        // On a plane through the origin too.
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
