//! Lines of drawings (`--aov lines`): edges of objects, parts and materials, creases, and
//! silhouettes.
//!
//! A sample lies on a line if a film point near the sample shows a different surface (Choudhury and
//! Parker 2009, "Ray tracing NPR-style feature lines", §3). The film points lie on rings around the
//! sample, at most half the width of a line away. So a line has the same width in every projection,
//! and lies on both sides of an edge. The pixel filter makes the line smooth.
//!
//! Two film points show the same surface if
//!
//! - object, part and material are the same,
//! - the surface has no step between them,
//! - and the shading normals differ by less than the angle of a crease.
//!
//! A step and an edge differ in the tangent planes of the two surface points. At a step, the far
//! point lies behind the tangent plane of the near point, and the near point lies in front of the
//! tangent plane of the far point. At a convex edge, each point lies behind the tangent plane of
//! the other point. At a concave edge, each point lies in front of the tangent plane of the other
//! point.
//!
//! Surfaces of opacity 0.5 and more have lines, including glass. The ground counts as background.

use super::{RayKind, Sink, World};
use crate::accel::Accel;
use crate::film::LineStyle;
use crate::geometry::{Hit, SurfacePoint};
use crate::math::{Ray, Vec2};
use crate::sampler::Sampler;
use std::f32::consts::TAU;

/// Minimum opacity of surfaces with lines.
const OPAQUE: f32 = 0.5;
/// Number of points on the inner ring. Ring n has n times as many points, so that neighbours are at
/// most 0.8 pixels apart.
const POINTS_OF_RING: u32 = 8;
/// Minimum height of a step that is drawn, relative to the distance between the two film points at
/// the depth of the surface.
const STEP: f32 = 0.5;

/// Surface that a film point shows.
struct FilmSurface {
    /// Ids of object, part and material.
    ids: [u32; 3],
    /// Surface point, with normals that face the camera.
    point: SurfacePoint,
}

impl<A: Accel> World<'_, A> {
    /// Calls [`Sink::line`] if the film point `film` lies on a line at `time`.
    #[inline(never)]
    pub(super) fn draw_lines(
        &self,
        style: LineStyle,
        film: Vec2,
        time: f32,
        sampler: &impl Sampler,
        out: &mut impl Sink,
    ) {
        let min_cos = style.angle.to_radians().cos();
        let center = self.film_surface(&self.ray_through(film, time, sampler), out);
        let is_on_line = ring_points(0.5 * style.width).any(|offset| {
            let other = film + offset;
            self.camera.sees(other) && {
                let other = self.film_surface(&self.ray_through(other, time, sampler), out);
                match (&center, &other) {
                    (None, None) => false,
                    (Some(a), Some(b)) => {
                        let distance = offset.length() * self.camera.pixel_width(a.point.p, time);
                        a.is_separate(b, distance, min_cos)
                    }
                    _ => true,
                }
            }
        });
        if is_on_line {
            out.line();
        }
    }

    /// Surface with lines that `ray` hits first; `None` for the background.
    fn film_surface(&self, ray: &Ray, out: &mut impl Sink) -> Option<FilmSurface> {
        out.ray(RayKind::Camera);
        let first = self.accel.intersect(ray);
        let is_drawn = |hit: &Hit| self.scene.opacity(hit) >= OPAQUE;
        let hit = if self.lets_pass(RayKind::Camera) {
            self.first_that(is_drawn, *ray, first, RayKind::Camera, out)?
        } else {
            first?
        };
        if self.scene.ground().is_some_and(|ground| ground.is_at(&hit)) {
            return None;
        }
        let mut point = self.scene.surface_point_along(&hit, ray);
        for normal in [&mut point.ng, &mut point.ns] {
            if normal.dot(ray.direction) > 0.0 {
                *normal = -*normal;
            }
        }
        Some(FilmSurface {
            ids: [
                self.scene.object(&hit),
                self.scene.part(&hit),
                self.scene.material_id(&hit),
            ],
            point,
        })
    }
}

impl FilmSurface {
    /// Returns `true` if a line separates the two surfaces. `distance` is the distance between
    /// their film points at the depth of `self`, in scene units. `min_cos` is the cosine of the
    /// minimum angle of a crease.
    fn is_separate(&self, other: &Self, distance: f32, min_cos: f32) -> bool {
        let (a, b) = (&self.point, &other.point);
        let chord = b.p - a.p;
        // Heights of each point over the tangent plane of the other point
        let heights = [chord.dot(a.ng), -chord.dot(b.ng)];
        let is_step = heights[0] * heights[1] < 0.0 && heights.iter().all(|h| h.abs() > STEP * distance);
        self.ids != other.ids || is_step || a.ns.dot(b.ns) <= min_cos
    }
}

/// Points on rings around the origin, at most `radius` away, from the outermost ring inwards.
/// Rings are at most one pixel apart.
fn ring_points(radius: f32) -> impl Iterator<Item = Vec2> {
    let rings = radius.ceil().max(1.0) as u32;
    (1..=rings).rev().flat_map(move |ring| {
        let (radius, points) = (radius * ring as f32 / rings as f32, POINTS_OF_RING * ring);
        (0..points).map(move |i| radius * Vec2::from_angle(TAU * i as f32 / points as f32))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Vec3;

    fn surface(p: [f32; 3], n: [f32; 3]) -> FilmSurface {
        let n = Vec3::from(n).normalize();
        let point = SurfacePoint {
            p: p.into(),
            time: 0.0,
            ray_offset: 0.0,
            curvature_offset: [0.0; 2],
            ng: n,
            ns: n,
        };
        FilmSurface { ids: [0; 3], point }
    }

    /// Cases computed by hand. The camera looks along −z. The distance between the film points is
    /// 1.
    #[test]
    fn steps_and_creases_separate_surfaces() {
        let cos_30 = 30f32.to_radians().cos();
        let floor = surface([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let near = |x: f32, z: f32, n: [f32; 3]| surface([x, 0.0, z], n);
        for (other, is_separate) in [
            // Same plane; small and large steps
            (near(1.0, 0.0, [0.0, 0.0, 1.0]), false),
            (near(1.0, 0.4, [0.0, 0.0, 1.0]), false),
            (near(1.0, 0.6, [0.0, 0.0, 1.0]), true),
            (near(1.0, -5.0, [0.0, 0.0, 1.0]), true),
            // Convex and concave edges of 20° and 45°
            (near(1.0, -0.2, [0.36, 0.0, 1.0]), false),
            (near(1.0, 0.2, [-0.36, 0.0, 1.0]), false),
            (near(1.0, -0.5, [1.0, 0.0, 1.0]), true),
            (near(1.0, 0.5, [-1.0, 0.0, 1.0]), true),
        ] {
            let p = other.point.p;
            assert_eq!(floor.is_separate(&other, 1.0, cos_30), is_separate, "{p}");
            assert_eq!(other.is_separate(&floor, 1.0, cos_30), is_separate, "{p}");
        }
        // Another part of the same plane
        let part = FilmSurface {
            ids: [0, 1, 0],
            ..near(1.0, 0.0, [0.0, 0.0, 1.0])
        };
        assert!(floor.is_separate(&part, 1.0, cos_30));
    }

    #[test]
    fn ring_points_reach_radius_without_gaps() {
        for radius in [0.1, 0.75, 1.0, 2.5, 8.0] {
            let points: Vec<Vec2> = ring_points(radius).collect();
            let max = points.iter().map(|p| p.length()).fold(0.0, f32::max);
            assert!((max - radius).abs() < 1e-5);
            for point in &points {
                let others = points.iter().filter(|other| *other != point);
                let nearest = others.map(|other| other.distance(*point)).fold(f32::MAX, f32::min);
                assert!(nearest <= 0.8, "{radius}: {nearest}");
            }
        }
    }
}
