//! Uniform sampling of the solid angle of a rectangle (Ureña, Fajardo and King 2013, "An
//! Area-Preserving Parametrization for Spherical Rectangles").

use crate::math::{Vec2, Vec3, atan2, sin_cos_turns};
use std::f32::consts::TAU;

/// The region of the unit sphere that a rectangle covers, seen from a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    /// Unit vectors: along the two edges, and along the normal from the rectangle's plane to the
    /// point.
    axes: [Vec3; 3],
    /// Coordinates relative to the point. `x` and `y` are the positions of the edges along the
    /// first two axes. `z` is the position of the rectangle's plane along the third axis; it is
    /// negative.
    x: [f64; 2],
    y: [f64; 2],
    z: f64,
    /// A complex number whose argument is the sum of the two interior angles at the left edge.
    left: [f64; 2],
    /// Modulus of `left`, divided by the two distances of the point from the lines of the lower
    /// edge and of the upper edge.
    left_modulus: f64,
    solid_angle: f32,
}

impl SphericalRectangle {
    /// The rectangle with the corner `corner` and two orthogonal edges, seen from the point `p`.
    /// The unit vectors `edges` are the directions of the edges, and `lengths` are their lengths.
    /// `None` if `p` lies in the rectangle's plane.
    #[inline(always)]
    pub fn new(corner: Vec3, edges: [Vec3; 2], lengths: [f32; 2], p: Vec3) -> Option<Self> {
        let to = corner - p;
        let normal = edges[0].cross(edges[1]);
        let height = to.dot(normal);
        let z = f64::from(-height.abs());
        let [x, y] = [0, 1].map(|i| {
            let start = to.dot(edges[i]);
            [f64::from(start), f64::from(start + lengths[i])]
        });
        // The interior angle at the corner (x, y) is the argument of ± x y + i |z| r, with the
        // corner's distance r. Arguments add when complex numbers are multiplied, so one arc
        // tangent is enough. The sum of the four angles is the solid angle plus a full turn. Scaled
        // coordinates cannot overflow.
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
        let angle = atan2(im as f32, re as f32);
        let solid_angle = angle + [0.0, TAU][usize::from(angle < 0.0)];
        (z < 0.0 && solid_angle > 0.0).then_some(Self {
            axes: [edges[0], edges[1], -normal * 1f32.copysign(height)],
            x,
            y,
            z,
            left,
            left_modulus: (scale * scale) * (scale * scale) * (x[0] * x[0] + z * z),
            solid_angle,
        })
    }

    /// Returns `true` if the solid angle is accurate enough for sampling. Small solid angles, and
    /// solid angles near 2π, have few correct digits.
    #[inline]
    pub fn is_accurate(&self) -> bool {
        (0.01..6.2).contains(&self.solid_angle)
    }

    /// Solid angle of the rectangle, sr.
    #[inline]
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// Samples directions uniformly over the solid angle, one for each element of `u`. Returns the
    /// vector from the point to the sampled point of the rectangle, and its direction (a unit
    /// vector).
    ///
    /// Several samples take little more time than one, because they share the latency of each step.
    #[inline(always)]
    pub fn sample<const N: usize>(&self, u: [Vec2; N]) -> [(Vec3, Vec3); N] {
        let ([x0, x1], [y0, y1]) = (self.x, self.y);
        let z_squared = self.z * self.z;
        // Find x such that the rectangle up to x has the fraction u.x of the solid angle. In the
        // paper this is |z| / √(f² − b₀²). In the paper, f and b₀ have the distance from the line
        // of the lower edge as denominator. We cancel this distance and the sine of f, so that only
        // one square root is left.
        let (mut sin, mut cos) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let (s, c) = sin_cos_turns(u[i].x * self.solid_angle * (1.0 / TAU));
            (sin[i], cos[i]) = (f64::from(s), f64::from(c));
        }
        let [left_cos, left_sin] = self.left;
        let lower = z_squared + y0 * y0;
        let (mut x, mut squared) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let (s, c) = (
                sin[i] * left_cos - cos[i] * left_sin,
                cos[i] * left_cos + sin[i] * left_sin,
            );
            let f = c * y0 + self.left_modulus * y1 * lower;
            let b = self.z * s;
            let below = larger((f - b) * (f + b), f64::MIN_POSITIVE);
            // Select the sign without a branch. The sign is random, so branches would be
            // mispredicted.
            let side = -f * s;
            let max_x = [x0, x1][usize::from(side > 0.0)];
            let x_squared = smaller(b * b * lower / below, max_x * max_x);
            x[i] = smaller(larger(x_squared.sqrt().copysign(side), x0), x1);
            squared[i] = z_squared + x_squared;
        }
        // On the line with this x, the sine of the elevation is uniform.
        let (mut y, mut nearness) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            let [h0, h1] = self.y.map(|y| y / (squared[i] + y * y).sqrt());
            let h = h0 + f64::from(u[i].y) * (h1 - h0);
            let cos_squared = larger(1.0 - h * h, f64::MIN_POSITIVE);
            let distance = (squared[i] / cos_squared).sqrt();
            y[i] = smaller(larger(h * distance, y0), y1);
            nearness[i] = distance * (cos_squared / squared[i]);
        }
        let mut places = [(Vec3::ZERO, Vec3::ZERO); N];
        for i in 0..N {
            let to = x[i] as f32 * self.axes[0] + y[i] as f32 * self.axes[1] + self.z as f32 * self.axes[2];
            places[i] = (to, to * nearness[i] as f32);
        }
        places
    }
}

/// The larger of `a` and `b`, or `b` if `a` is NaN. Compiles to one instruction, unlike `f64::max`.
#[inline(always)]
fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The smaller of `a` and `b`, or `b` if `a` is NaN.
#[inline(always)]
fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
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

    /// The solid angle equals the sum of the solid angles of two triangles, seen from near and from
    /// far.
    #[test]
    fn solid_angles_equal_sums_of_two_triangles() {
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

    /// Moments of directions sampled with a grid of numbers equal moments over the area, weighted
    /// by solid angle.
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
                let (to, direction) = rectangle.sample([u])[0];
                assert!(direction.distance(to.normalize()) < 5e-7, "{to} {direction}");
                let to = direction.as_dvec3();
                found += to * to / (N * N) as f64;
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

    /// Corners of the unit square map to corners of the rectangle.
    #[test]
    fn corners_of_square_map_to_corners_of_rectangle() {
        let rectangle = seen(Vec3::ZERO).unwrap();
        let corner = |x, y| rectangle.sample([Vec2::new(x, y)])[0].0;
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
