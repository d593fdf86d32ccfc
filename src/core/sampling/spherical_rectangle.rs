//! Uniform sampling of the solid angle of a rectangle (Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles").

use crate::math::{Vec2, Vec3};
use std::f32::consts::TAU;

/// A rectangle as seen from a point: the region that its directions take on the unit sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// Unit vectors along the edges and from the rectangle's plane to the point.
    axes: [Vec3; 3],
    /// Where the edges are along the first two axes, seen from the point, and the plane along the third: below 0.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// A complex number whose argument is the sum of the two interior angles at the left edge.
    left: [f64; 2],
    solid_angle: f32,
}

impl SphericalRectangle {
    /// The rectangle with the corner `corner` and two orthogonal edges along unit vectors, of these lengths, seen from `p`; `None` in its plane.
    #[inline]
    pub fn new(corner: Vec3, edges: [Vec3; 2], lengths: [f32; 2], p: Vec3) -> Option<Self> {
        let to = corner - p;
        let normal = edges[0].cross(edges[1]);
        let height = to.dot(normal);
        let z = f64::from(-height.abs());
        let [x, y] = [0, 1].map(|i| {
            let start = to.dot(edges[i]);
            [f64::from(start), f64::from(start + lengths[i])]
        });
        // The interior angle at the corner (x, y) is the argument of ± x y + i |z| r, r being the corner's distance, and complex numbers add their arguments
        // as they are multiplied: one arc tangent is enough. The four angles sum to the solid angle and a full turn. Shares of the width have no overflow.
        let scale = 1.0 / f64::from(lengths[0] + lengths[1]);
        let corners = [
            (x[1], y[0], 1.0),
            (x[1], y[1], -1.0),
            (x[0], y[1], 1.0),
            (x[0], y[0], -1.0),
        ];
        let [a, b, c, d] = corners.map(|(x, y, sign)| {
            let (x, y, z) = (x * scale, y * scale, z * scale);
            let r = ((x * x + y * y + z * z) as f32).sqrt();
            [sign * x * y, -z * f64::from(r)]
        });
        let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
        let left = times(c, d);
        let [re, im] = times(times(a, b), left);
        let angle = (im as f32).atan2(re as f32);
        let solid_angle = if angle < 0.0 { angle + TAU } else { angle };
        (z < 0.0 && solid_angle > 0.0).then_some(Self {
            axes: [edges[0], edges[1], -normal * 1f32.copysign(height)],
            x,
            y,
            z,
            left,
            solid_angle,
        })
    }

    /// Whether its solid angle is known to enough digits to be sampled: few are right of small ones, and of nearly the half sphere.
    #[inline]
    pub fn is_accurate(&self) -> bool {
        (0.01..6.2).contains(&self.solid_angle)
    }

    /// Solid angle, sr.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// Vector from the point to a place of the rectangle, whose direction is uniform over the solid angle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec3 {
        let squared = self.z * self.z;
        // The x that cuts the first number's share off the solid angle
        let (s, c) = (u.x * self.solid_angle).sin_cos();
        let (s, c) = (f64::from(s), f64::from(c));
        let [left_cos, left_sin] = self.left;
        let length = (left_cos * left_cos + left_sin * left_sin).sqrt();
        let (sin, cos) = (s * left_cos - c * left_sin, c * left_cos + s * left_sin);
        let [lower, upper] = [-self.y[0], self.y[1]].map(|y| y / (squared + y * y).sqrt());
        let f = (cos * lower - upper * length) / sin;
        let below = (f * f - squared / (squared + self.y[0] * self.y[0])).max(f64::MIN_POSITIVE);
        let x = (-self.z / below.sqrt()).copysign(f).clamp(self.x[0], self.x[1]);
        // On the line there, the sine of the height is uniform.
        let squared = squared + x * x;
        let [h0, h1] = self.y.map(|y| y / (squared + y * y).sqrt());
        let h = h0 + f64::from(u.y) * (h1 - h0);
        let y = (h * (squared / (1.0 - h * h).max(f64::MIN_POSITIVE)).sqrt()).clamp(self.y[0], self.y[1]);
        x as f32 * self.axes[0] + y as f32 * self.axes[1] + self.z as f32 * self.axes[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{DVec3, float::ALMOST_ONE};
    use crate::sampling::spherical_triangle::SphericalTriangle;

    const CORNER: Vec3 = Vec3::new(-0.4, 0.3, 1.5);
    const EDGES: [Vec3; 2] = [Vec3::new(0.8, 0.6, 0.0), Vec3::new(-0.9, 1.2, 0.0)];

    fn seen(p: Vec3) -> Option<SphericalRectangle> {
        SphericalRectangle::new(CORNER, EDGES.map(Vec3::normalize), EDGES.map(Vec3::length), p)
    }

    /// Its solid angle is that of two triangles, from near and from afar.
    #[test]
    fn solid_angles_are_those_of_two_triangles() {
        let [a, b] = EDGES;
        for p in [
            Vec3::ZERO,
            Vec3::new(3.0, -2.0, 1.0),
            Vec3::new(0.1, 0.9, 1.49),
            Vec3::new(0.2, 0.8, 9.0),
        ] {
            let rectangle = seen(p).unwrap();
            let triangle = |corners| SphericalTriangle::new(corners, p).unwrap().solid_angle();
            let both = triangle([CORNER, CORNER + a, CORNER + a + b]) + triangle([CORNER, CORNER + a + b, CORNER + b]);
            assert!(
                (f64::from(rectangle.solid_angle()) / both - 1.0).abs() < 1e-5,
                "{p}: {both} {rectangle:?}"
            );
        }
        assert!(seen(Vec3::new(5.0, 1.0, 1.5)).is_none());
    }

    /// Moments of directions over a grid of numbers against those of the area, weighted by what a part of it takes of the sphere.
    #[test]
    fn directions_are_uniform() {
        const N: usize = 400;
        let place = |i: usize| (i as f32 + 0.5) / N as f32;
        let grid = || (0..N * N).map(|i| Vec2::new(place(i % N), place(i / N)));
        for p in [Vec3::ZERO, Vec3::new(0.1, 0.9, 1.2), Vec3::new(2.0, -1.0, 2.5)] {
            let rectangle = seen(p).unwrap();
            let [a, b] = EDGES.map(Vec3::as_dvec3);
            let (mut found, mut expected, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for u in grid() {
                let to = rectangle.sample(u).as_dvec3();
                found += to.normalize() * to.normalize() / (N * N) as f64;
                let q = (CORNER - p).as_dvec3() + f64::from(u.x) * a + f64::from(u.y) * b;
                let part = q.dot(a.cross(b)).abs() / q.length().powi(3);
                expected += q.normalize() * q.normalize() * part;
                weight += part;
            }
            assert!(
                (found - expected / weight).length() < 1e-3,
                "{p}: {found} {}",
                expected / weight
            );
            assert!((weight / (N * N) as f64 / f64::from(rectangle.solid_angle()) - 1.0).abs() < 1e-3);
        }
    }

    /// Corners of the square are corners of the rectangle.
    #[test]
    fn all_of_the_rectangle_is_sampled() {
        let rectangle = seen(Vec3::ZERO).unwrap();
        let corner = |x, y| rectangle.sample(Vec2::new(x, y));
        let [a, b] = EDGES;
        for (x, y, expected) in [
            (0.0, 0.0, CORNER),
            (ALMOST_ONE, 0.0, CORNER + a),
            (0.0, ALMOST_ONE, CORNER + b),
            (ALMOST_ONE, ALMOST_ONE, CORNER + a + b),
        ] {
            assert!(corner(x, y).distance(expected) < 1e-4, "{} {expected}", corner(x, y));
        }
    }
}
