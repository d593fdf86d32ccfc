//! Uniform sampling of the solid angle of a triangle.

use crate::math::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// The region of the unit sphere that a triangle covers, seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    corners: [DVec3; 3],
    solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle with the corners `corners`, seen from the point `p`; `None` if `p` is a corner.
    pub fn new(corners: [Vec3; 3], p: Vec3) -> Option<Self> {
        let [a, b, c] = corners.map(|q| (q.as_dvec3() - p.as_dvec3()).try_normalize());
        let (a, b, c) = (a?, b?, c?);
        // Formula of Van Oosterom and Strackee 1983. It has no difference of nearly equal angles,
        // so the result is accurate even for tiny triangles.
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        Some(Self {
            corners: [a, b, c],
            solid_angle,
        })
    }

    /// Solid angle of the triangle, sr.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// Samples a direction uniformly over the solid angle (Arvo 1995, "Stratified Sampling of
    /// Spherical Triangles"). `None` if the point lies in the triangle's plane.
    pub fn sample(&self, u: Vec2) -> Option<DVec3> {
        let [a, b, c] = self.corners;
        // Interior angles at the vertices A, B and C
        let (ab, bc, ca) = (
            a.cross(b).try_normalize()?,
            b.cross(c).try_normalize()?,
            c.cross(a).try_normalize()?,
        );
        let angle = |x: DVec3, y: DVec3| (-x.dot(y)).clamp(-1.0, 1.0).acos();
        let (alpha, beta, gamma) = (angle(ca, ab), angle(ab, bc), angle(bc, ca));
        let (sin_alpha, cos_alpha) = alpha.sin_cos();

        // Move C along the arc AC until the triangle has the fraction u.x of the area.
        let area = u.x as f64 * (alpha + beta + gamma - PI);
        let (s, t) = (area - alpha).sin_cos();
        let (uu, v) = (t - cos_alpha, s + sin_alpha * a.dot(b));
        let q = ((v * t - uu * s) * cos_alpha - v) / ((v * s + uu * t) * sin_alpha);
        // `q` is 0/0 if the fraction is 0: the moved C is then at A.
        let q = if q.is_finite() { q.clamp(-1.0, 1.0) } else { 1.0 };
        let c_moved = q * a + (1.0 - q * q).sqrt() * orthogonal(c, a)?;

        // Select the point on the arc from B to the moved C by u.y
        let z = 1.0 - u.y as f64 * (1.0 - c_moved.dot(b));
        let across = orthogonal(c_moved, b).unwrap_or(DVec3::ZERO);
        Some((z * b + (1.0 - z * z).max(0.0).sqrt() * across).normalize_or_zero())
    }
}

/// Unit vector along the component of `x` orthogonal to the unit vector `y`; `None` if both are
/// parallel.
fn orthogonal(x: DVec3, y: DVec3) -> Option<DVec3> {
    (x - x.dot(y) * y).try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::float::ALMOST_ONE;

    fn corners(scale: f32) -> [Vec3; 3] {
        [
            Vec3::new(-0.5, 0.2, 1.0),
            Vec3::new(0.9, -0.1, 1.3),
            Vec3::new(0.1, 0.8, 0.7),
        ]
        .map(|p| p * Vec3::new(scale, scale, 1.0))
    }

    #[test]
    fn solid_angles_match_closed_forms() {
        // An octant of the unit sphere
        let octant = SphericalTriangle::new([Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO).unwrap();
        assert!((octant.solid_angle() - PI / 2.0).abs() < 1e-12);
        // Far away, the solid angle is the area times the cosine over the squared distance
        let far = SphericalTriangle::new([Vec3::ZERO, Vec3::X, Vec3::Y], Vec3::new(0.0, 0.0, 1e4)).unwrap();
        assert!((far.solid_angle() / 0.5e-8 - 1.0).abs() < 1e-3);
    }

    /// The mean of a function over the samples equals its mean over the solid angle, computed by
    /// sampling the area.
    #[test]
    fn samples_cover_the_solid_angle_uniformly() {
        for scale in [1.0, 0.1] {
            let corners = corners(scale);
            let [p0, p1, p2] = corners.map(Vec3::as_dvec3);
            let triangle = SphericalTriangle::new(corners, Vec3::ZERO).unwrap();
            let normal = (p1 - p0).cross(p2 - p0);
            let (mut moments, mut expected, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            const N: usize = 300;
            for i in 0..N {
                for j in 0..N {
                    let u = Vec2::new((i as f32 + 0.5) / N as f32, (j as f32 + 0.5) / N as f32);
                    let w = triangle.sample(u).unwrap();
                    assert!((w.length() - 1.0).abs() < 1e-9);
                    moments += w * w / (N * N) as f64;
                    // Compute the expected mean with points that are uniform over the area
                    let (b1, b2) = crate::sampling::warp::uniform_triangle(u);
                    let q = p0 + (p1 - p0) * b1 as f64 + (p2 - p0) * b2 as f64;
                    let w = q.normalize();
                    let weight = 0.5 * w.dot(normal).abs() / q.length_squared() / (N * N) as f64;
                    expected += w * w * weight;
                    total += weight;
                }
            }
            assert!(
                (total / triangle.solid_angle() - 1.0).abs() < 1e-3,
                "{total} {triangle:?}"
            );
            assert!(
                (moments - expected / total).length() < 1e-3 * scale as f64,
                "{moments} {expected}"
            );
        }
    }

    #[test]
    fn borders_of_unit_square_give_unit_vectors() {
        let triangle = SphericalTriangle::new(corners(1.0), Vec3::ZERO).unwrap();
        for x in [0.0, 0.5, ALMOST_ONE] {
            for y in [0.0, 0.5, ALMOST_ONE] {
                assert!(triangle.sample(Vec2::new(x, y)).unwrap().is_normalized());
            }
        }
        assert!(SphericalTriangle::new(corners(1.0), corners(1.0)[1]).is_none());
    }
}
