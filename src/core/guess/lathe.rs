//! Bodies of revolution as evidence for the upright axis. Bottles, vases, mugs and lamps stand on
//! their axis, and the opening of a vessel is at the top.

use super::scene_tracer::SceneTracer;
use super::spread::radical_inverse;
use crate::math::{Bounds3, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;

/// Minimum squared length of a normal's component across the axis, on the sides of a body.
const SIDE: f32 = 0.1;
/// If less than this fraction of the points lies on the sides of the body, the likeness is reduced.
const ENOUGH_SIDES: f32 = 0.2;
/// Number of iterations that find the axis.
const STEPS: u32 = 8;
/// A line along a normal has half of the full weight at this distance from the axis, in radii.
const NEAR: f32 = 0.1;
/// Sine of the angle between a normal and the direction away from the axis, for which the likeness
/// is 0. Octagons have a mean of 0.19.
const NOT_ROUND: f32 = 0.4;
/// Number of rays along the axis.
const RAYS: u32 = 64;
/// Radius of the disk that contains the rays, in radii of the body.
const CORE: f32 = 0.3;

/// The body of revolution most similar to the scene.
#[derive(Clone, Copy)]
pub(super) struct Lathe {
    /// Similarity of the scene and the body, 0 to 1.
    pub likeness: f32,
    /// A point of the axis.
    center: Vec3,
    axis: usize,
}

impl Lathe {
    /// Body of revolution around a line parallel to the coordinate axis `axis` (0 = x). The line is
    /// placed where it is closest to the lines along the normals, because all normals of a body of
    /// revolution meet its axis. `points` are pairs of position and normal.
    pub fn new(points: &[(Vec3, Vec3)], bounds: Bounds3, axis: usize) -> Self {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let across = |v: Vec3| Vec2::new(v[a], v[b]);
        let is_side = |(_, n): &&(Vec3, Vec3)| across(*n).length_squared() > SIDE;
        let sides: Vec<(Vec2, Vec2)> = points
            .iter()
            .filter(is_side)
            .map(|(p, n)| (across(*p), across(*n).normalize().perp()))
            .collect();
        let radius = 0.5 * across(bounds.max - bounds.min).min_element().max(f32::MIN_POSITIVE);
        let mut center = across(bounds.center());
        for _ in 0..STEPS {
            center = nearest_to_lines(&sides, center, NEAR * radius).unwrap_or(center);
        }
        let round: f32 = sides
            .iter()
            .map(|(p, tangent)| {
                let sine = (*p - center).normalize_or_zero().dot(*tangent).abs();
                (1.0 - sine / NOT_ROUND).max(0.0)
            })
            .sum();
        let enough = (ENOUGH_SIDES * points.len() as f32).max(sides.len() as f32).max(1.0);
        let mut point = bounds.center();
        (point[a], point[b]) = (center.x, center.y);
        Self {
            likeness: round / enough,
            center: point,
            axis,
        }
    }

    /// Mean depth of the first surfaces around the axis, seen from its end in the direction `up`,
    /// as a fraction of the scene's extent.
    pub fn depth(&self, tracer: &SceneTracer, up: Vec3) -> f32 {
        let bounds = tracer.region.bounds;
        let (axis, extent) = (self.axis, bounds.max - bounds.min);
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        let radius = CORE * 0.5 * extent[a].min(extent[b]);
        let height = extent[axis].max(f32::MIN_POSITIVE);
        let depth = |i: u32| {
            let offset = radius * uniform_disk(Vec2::new(radical_inverse(2, i), radical_inverse(3, i)));
            let mut middle = self.center;
            middle[a] += offset.x;
            middle[b] += offset.y;
            // The ray starts half an extent above the top.
            let seen = tracer.trace(middle + height * up, -up);
            seen.map_or(1.0, |seen| (seen.distance / height - 0.5).clamp(0.0, 1.0))
        };
        (0..RAYS).map(depth).sum::<f32>() / RAYS as f32
    }
}

/// The point with the smallest sum of squared distances from lines, given as pairs of a position
/// `p` and the unit vector `t` across the line. Lines farther than `near` from `point` have less
/// weight. `None` if all lines are parallel.
fn nearest_to_lines(lines: &[(Vec2, Vec2)], point: Vec2, near: f32) -> Option<Vec2> {
    let (mut xx, mut xy, mut yy, mut sum) = (0.0, 0.0, 0.0, Vec2::ZERO);
    for (p, t) in lines {
        let off = (*p - point).dot(*t) / near;
        let weight = 1.0 / (1.0 + off * off);
        xx += weight * t.x * t.x;
        xy += weight * t.x * t.y;
        yy += weight * t.y * t.y;
        sum += weight * p.dot(*t) * *t;
    }
    let determinant = xx * yy - xy * xy;
    let found = Vec2::new(yy * sum.x - xy * sum.y, xx * sum.y - xy * sum.x) / determinant;
    (determinant > 1e-6 * (xx + yy) * (xx + yy) && found.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// Likenesses of the bodies around the three axes. The box contains `points` and, if given,
    /// `more`.
    fn likenesses(points: &[(Vec3, Vec3)], more: Option<Vec3>) -> [f32; 3] {
        let bounds: Bounds3 = points.iter().map(|(p, _)| *p).chain(more).collect();
        [0, 1, 2].map(|axis| Lathe::new(points, bounds, axis).likeness)
    }

    /// Points of a cylinder of radius 1 around y, with a cap at the bottom.
    fn cylinder(center: Vec3) -> Vec<(Vec3, Vec3)> {
        let mut points = Vec::new();
        for i in 0..600 {
            let (u, v) = (radical_inverse(2, i), radical_inverse(3, i));
            let (sin, cos) = (TAU * u).sin_cos();
            let outwards = Vec3::new(cos, 0.0, sin);
            points.push((center + outwards + 2.0 * v * Vec3::Y, outwards));
            if i % 3 == 0 {
                points.push((center + v.sqrt() * outwards, Vec3::NEG_Y));
            }
        }
        points
    }

    #[test]
    fn likeness_of_cylinders_is_high_around_their_axis() {
        let handle = Vec3::new(6.5, 1.0, 3.0);
        for more in [None, Some(handle)] {
            let [x, y, z] = likenesses(&cylinder(Vec3::new(4.0, 0.0, 3.0)), more);
            assert!(y > 0.95 && x < 0.4 && z < 0.4, "{x} {y} {z}");
        }
    }

    #[test]
    fn likeness_is_low_for_cubes_and_high_for_spheres() {
        let (mut cube, mut sphere) = (Vec::new(), Vec::new());
        for i in 0..600 {
            let [u, v, side] = [2, 3, 5].map(|base| radical_inverse(base, i));
            let axis = (6.0 * side) as usize;
            let mut p = Vec3::ZERO;
            p[axis % 3] = if axis < 3 { 1.0 } else { -1.0 };
            p[(axis + 1) % 3] = 2.0 * u - 1.0;
            p[(axis + 2) % 3] = 2.0 * v - 1.0;
            cube.push((p, p[axis % 3] * Vec3::AXES[axis % 3]));
            let n = crate::sampling::warp::uniform_sphere(Vec2::new(u, v));
            sphere.push((n, n));
        }
        assert!(likenesses(&cube, None).iter().all(|likeness| *likeness < 0.35));
        assert!(likenesses(&sphere, None).iter().all(|likeness| *likeness > 0.95));
        assert_eq!(likenesses(&[], None), [0.0; 3]);
    }
}
