//! Uniform sampling of the solid angle of a rectangle (Ureña, Fajardo and King 2013, "An Area-Preserving Parametrization for Spherical Rectangles").

use crate::math::{DVec3, Vec2, Vec3};
use std::f64::consts::PI;

/// A rectangle as seen from a point: the region that its directions take on the unit sphere.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// Unit vectors along the edges and from the rectangle's plane to the point.
    axes: [DVec3; 3],
    /// Where the edges are along the first two axes, seen from the point, and the plane along the third: below 0.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// z of the normals of the planes through the point and the lower and the upper edge along x.
    normals: [f64; 2],
    /// `2π` less the interior angles between the upper edge and its neighbours.
    rest: f64,
    solid_angle: f64,
}

impl SphericalRectangle {
    /// The rectangle with the corner `corner` and two orthogonal edges, seen from `p`; `None` in its plane.
    pub fn new(corner: Vec3, edges: [Vec3; 2], p: Vec3) -> Option<Self> {
        let edges = edges.map(Vec3::as_dvec3);
        let [x_axis, y_axis] = [edges[0].try_normalize()?, edges[1].try_normalize()?];
        let to = corner.as_dvec3() - p.as_dvec3();
        let side = -1f64.copysign(to.dot(x_axis.cross(y_axis)));
        let z_axis = side * x_axis.cross(y_axis);
        let z = to.dot(z_axis);
        let [x0, y0] = [to.dot(x_axis), to.dot(y_axis)];
        let (x, y) = ([x0, x0 + edges[0].length()], [y0, y0 + edges[1].length()]);
        // Normals of the planes through the point and an edge: their one component in the rectangle's plane, and that along z
        let lower = DVec3::new(0.0, z, -y[0]).try_normalize()?;
        let right = DVec3::new(-z, 0.0, x[1]).try_normalize()?;
        let upper = DVec3::new(0.0, -z, y[1]).try_normalize()?;
        let left = DVec3::new(z, 0.0, -x[0]).try_normalize()?;
        let angle = |a: DVec3, b: DVec3| (-a.dot(b)).clamp(-1.0, 1.0).acos();
        let interior = [
            angle(lower, right),
            angle(right, upper),
            angle(upper, left),
            angle(left, lower),
        ];
        let solid_angle = interior.iter().sum::<f64>() - 2.0 * PI;
        (z < 0.0 && solid_angle > 0.0).then(|| Self {
            axes: [x_axis, y_axis, z_axis],
            x,
            y,
            z,
            normals: [lower.z, upper.z],
            rest: 2.0 * PI - interior[2] - interior[3],
            solid_angle,
        })
    }

    /// Solid angle, sr.
    pub fn solid_angle(&self) -> f64 {
        self.solid_angle
    }

    /// From the point to a place of the rectangle, whose direction is uniform over the solid angle.
    pub fn sample(&self, u: Vec2) -> DVec3 {
        // The x that cuts the first number's share off the solid angle
        let (sin, cos) = (f64::from(u.x) * self.solid_angle + self.rest).sin_cos();
        let f = (cos * self.normals[0] - self.normals[1]) / sin;
        let c = (1.0 / (f * f + self.normals[0].powi(2)).sqrt())
            .copysign(f)
            .clamp(-1.0, 1.0);
        let x = -(c * self.z) / (1.0 - c * c).max(f64::MIN_POSITIVE).sqrt();
        let x = x.clamp(self.x[0], self.x[1]);
        // On the line there, the sine of the height is uniform.
        let squared = x * x + self.z * self.z;
        let [h0, h1] = self.y.map(|y| y / (squared + y * y).sqrt());
        let h = h0 + f64::from(u.y) * (h1 - h0);
        let y = (h * (squared / (1.0 - h * h).max(f64::MIN_POSITIVE)).sqrt()).clamp(self.y[0], self.y[1]);
        x * self.axes[0] + y * self.axes[1] + self.z * self.axes[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::float::ALMOST_ONE;
    use crate::sampling::spherical_triangle::SphericalTriangle;

    const CORNER: Vec3 = Vec3::new(-0.4, 0.3, 1.5);
    const EDGES: [Vec3; 2] = [Vec3::new(0.8, 0.6, 0.0), Vec3::new(-0.9, 1.2, 0.0)];

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
            let rectangle = SphericalRectangle::new(CORNER, EDGES, p).unwrap();
            let triangle = |corners| SphericalTriangle::new(corners, p).unwrap().solid_angle();
            let both = triangle([CORNER, CORNER + a, CORNER + a + b]) + triangle([CORNER, CORNER + a + b, CORNER + b]);
            assert!(
                (rectangle.solid_angle() / both - 1.0).abs() < 1e-5,
                "{p}: {both} {rectangle:?}"
            );
        }
        assert!(SphericalRectangle::new(CORNER, EDGES, Vec3::new(5.0, 1.0, 1.5)).is_none());
    }

    /// Moments of directions over a grid of numbers against those of the area, weighted by what a part of it takes of the sphere.
    #[test]
    fn directions_are_uniform() {
        const N: usize = 400;
        let place = |i: usize| (i as f32 + 0.5) / N as f32;
        let grid = || (0..N * N).map(|i| Vec2::new(place(i % N), place(i / N)));
        for p in [Vec3::ZERO, Vec3::new(0.1, 0.9, 1.2), Vec3::new(2.0, -1.0, 2.5)] {
            let rectangle = SphericalRectangle::new(CORNER, EDGES, p).unwrap();
            let [a, b] = EDGES.map(Vec3::as_dvec3);
            let (mut found, mut expected, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for u in grid() {
                let to = rectangle.sample(u);
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
            assert!((weight / (N * N) as f64 / rectangle.solid_angle() - 1.0).abs() < 1e-3);
        }
    }

    /// Corners of the square are corners of the rectangle.
    #[test]
    fn all_of_the_rectangle_is_sampled() {
        let rectangle = SphericalRectangle::new(CORNER, EDGES, Vec3::ZERO).unwrap();
        let corner = |x, y| rectangle.sample(Vec2::new(x, y)).as_vec3a();
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
