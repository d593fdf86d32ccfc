//! Ground that reaches far beyond the objects on it, such as a river of a city map or a plate under
//! a house. If it consists of a few low triangles around all others, the framing of an object
//! ignores it.
//!
//! Unlike a separate sheet (`groups`), such a ground may share corners with the rest, and may
//! consist of triangles of several parts.

use super::floors::upright_bounds;
use super::region::{Region, WideGround, middle_bounds};
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
/// Minimum fraction of the ground's area that is low: a few of its triangles may belong to bridges
/// or ramps.
const LOW_SHARE: f32 = 0.95;
/// Maximum fraction of the triangles that may belong to the ground.
const FEW: f32 = 0.05;
/// Minimum ratio of the outline area of the scene to the outline area without the ground.
const WIDER: f32 = 4.0;
/// Minimum ratio of the scene's width to its height: fins of rockets and feet of towers are not a
/// ground.
const WIDE: f32 = 2.0;
/// Minimum number of triangles that do not belong to the ground.
const MIN_REST: usize = 30;

/// Maximum fraction of the area that triangles far below the ground may have.
const STRAYS: f32 = 0.05;

/// Box of the object that the region of `tracer` frames, and of the ground below it, if a few other
/// triangles reach deeper below the ground than the object is high: a plane below them would be far
/// below the ground. `None` if there are no such triangles.
pub(super) fn without_strays_below(tracer: &SceneTracer, horizon: &Horizon) -> Option<Bounds3> {
    let mut object = upright_bounds(tracer.region.bounds, horizon);
    let mut lowest: Vec<(f32, f64)> = Vec::new();
    for_each_triangle(tracer.scene, MAX_TRIANGLES, |triangle| {
        let heights = triangle.corners.map(|p| horizon.coordinates(p).y);
        lowest.push((heights.into_iter().fold(f32::INFINITY, f32::min), triangle.area));
    });
    lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let most = f64::from(STRAYS) * lowest.iter().map(|(_, area)| area).sum::<f64>();
    let mut below = 0.0;
    let is_ground = |&&(_, area): &&(f32, f64)| {
        below += area;
        below > most
    };
    let (bottom, _) = *lowest.iter().find(is_ground)?;
    let (deepest, height) = (lowest.first()?.0, object.max.y - object.min.y);
    object.min.y = bottom.min(object.max.y);
    let bounds = object.corners().map(|p| horizon.point(p)).into_iter().collect();
    (bottom - deepest > height).then_some(bounds)
}

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
    let (mut ground, mut others, mut rest) = (Vec::new(), 0, Bounds3::EMPTY);
    visit(MAX_TRIANGLES, &mut |triangle| {
        let corners = triangle.corners.map(|p| horizon.coordinates(p));
        if corners.into_iter().any(is_beyond) {
            let highest = corners.iter().fold(f32::NEG_INFINITY, |highest, p| highest.max(p.y));
            ground.push((highest, triangle.area));
        } else {
            others += 1;
            triangle.corners.iter().for_each(|&p| rest.extend(p));
        }
    });
    let count = ground.len() as f32;
    let is_few = others >= MIN_REST && count <= FEW * (count + others as f32);
    if ground.is_empty() || !is_few || rest.is_empty() {
        return whole;
    }
    let area = |bounds: Bounds3| (bounds.max.x - bounds.min.x) * (bounds.max.z - bounds.min.z);
    let object = upright_bounds(rest, horizon);
    // A stray corner far below the scene makes the outline high, but not the middle of the scene.
    let top = top.max(core.min.y + LOW * (object.max.y - object.min.y));
    let all: f64 = ground.iter().map(|(_, area)| area).sum();
    let low: f64 = ground
        .iter()
        .filter(|(highest, _)| *highest <= top)
        .map(|(_, area)| area)
        .sum();
    let is_low = low >= f64::from(LOW_SHARE) * all;
    if is_low && area(object) > 0.0 && area(outline) >= WIDER * area(object) {
        whole.on_ground(rest, WideGround::Flat)
    } else {
        whole
    }
}
