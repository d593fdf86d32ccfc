//! Ground that reaches far beyond the objects on it, such as a river of a city map or a plate under
//! a house. If it consists of a few low triangles around all others, the framing of an object
//! ignores it.
//!
//! Unlike a separate sheet (`groups`), such a ground may share corners with the rest, and may
//! consist of triangles of several parts.

use super::floors::upright_bounds;
use super::region::{Region, middle_bounds};
use super::scene_tracer::SceneTracer;
use super::triangles::{Triangle, for_each_triangle};
use crate::math::{Bounds3, Horizon, Vec3};

/// Maximum number of triangles that are tested, evenly spread over the scene's triangles.
const MAX_TRIANGLES: u64 = 1 << 20;
/// Maximum number of triangles whose corners define the middle of the scene.
const SAMPLES: u64 = 1 << 15;
/// Margin around the middle 90 % of the corners, as a multiple of their extent. Triangles within
/// the margin do not belong to the ground.
const MARGIN: f32 = 0.5;
/// Maximum height of a ground, as a fraction of the scene's height.
const LOW: f32 = 0.2;
/// Maximum fraction of the triangles that may belong to the ground.
const FEW: f32 = 0.05;
/// Minimum ratio of the outline area of the scene to the outline area without the ground.
const WIDER: f32 = 4.0;
/// Minimum ratio of the scene's width to its height: fins of rockets and feet of towers are not a
/// ground.
const WIDE: f32 = 2.0;
/// Minimum number of triangles that do not belong to the ground.
const MIN_REST: usize = 30;

/// Region of `tracer` without a ground that reaches far beyond the rest.
pub(super) fn without_far_ground(tracer: &SceneTracer, horizon: &Horizon) -> Region {
    let whole = tracer.region;
    let visit = |max, visit: &mut dyn FnMut(&Triangle)| {
        for_each_triangle(tracer.scene, max, |triangle| {
            if whole.contains(&triangle.corners) {
                visit(triangle);
            }
        });
    };
    let mut corners: Vec<Vec3> = Vec::new();
    visit(SAMPLES, &mut |triangle| {
        corners.extend(triangle.corners.map(|p| horizon.coordinates(p)));
    });
    let (core, outline) = (middle_bounds(&corners), upright_bounds(whole.bounds, horizon));
    let size = outline.max - outline.min;
    if size.x.max(size.z) < WIDE * size.y {
        return whole;
    }
    let margin = MARGIN * (core.max - core.min).with_y(0.0).max_element();
    let top = outline.min.y + LOW * size.y;
    let is_beyond = |p: Vec3| {
        p.x < core.min.x - margin || p.x > core.max.x + margin || p.z < core.min.z - margin || p.z > core.max.z + margin
    };
    let (mut ground, mut others, mut rest, mut is_ground) = (0, 0, Bounds3::EMPTY, true);
    visit(MAX_TRIANGLES, &mut |triangle| {
        let corners = triangle.corners.map(|p| horizon.coordinates(p));
        if corners.into_iter().any(is_beyond) {
            ground += 1;
            is_ground &= corners.iter().all(|p| p.y <= top);
        } else {
            others += 1;
            triangle.corners.iter().for_each(|&p| rest.extend(p));
        }
    });
    let is_few = others >= MIN_REST && ground as f32 <= FEW * (ground + others) as f32;
    if ground == 0 || !is_ground || !is_few || rest.is_empty() {
        return whole;
    }
    let area = |bounds: Bounds3| (bounds.max.x - bounds.min.x) * (bounds.max.z - bounds.min.z);
    let object = upright_bounds(rest, horizon);
    if area(object) > 0.0 && area(outline) >= WIDER * area(object) {
        whole.on_ground(rest)
    } else {
        whole
    }
}
