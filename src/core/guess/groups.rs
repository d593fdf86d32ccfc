//! Groups of connected parts of a scene, separated by gaps.

use super::floors::upright_bounds;
use super::parts::SceneParts;
use super::region::{Region, WideGround, extent};
use super::scene_tracer::SceneTracer;
use crate::math::{Bounds3, Horizon, Vec3};

/// Minimum ratio of a ground's extents to the object's width, if the framing of the object ignores
/// the ground.
const WIDE_GROUND: f32 = 3.0;
/// Maximum height of a wide ground above the bottom of the object, as a fraction of the object's
/// height.
const AT_BOTTOM: f32 = 0.05;
/// Maximum thickness of a sheet, such as a ground, as a fraction of its extent.
const SHEET: f32 = 0.02;
/// Maximum fraction of a sheet's extents that the rest of the scene covers. If the rest covers
/// more, the sheet is not around the rest.
const COVERED: f32 = 0.8;
/// Maximum distance of parts of one group, as a fraction of the smaller part's extent.
const NEAR: f32 = 0.1;
/// Maximum fraction of the region's volume that a group fills. A larger group is about the region
/// itself.
const SMALLER: f32 = 0.7;
/// Maximum number of parts that are grouped: the largest parts.
const MAX_PARTS: usize = 2048;
/// Maximum number of sheets that the framing ignores: a ground and a paved place on it.
const MAX_SHEETS: usize = 2;
/// Maximum number of groups.
const MAX_GROUPS: usize = 3;

/// Groups of connected parts of the region of `tracer`, the largest group first. For example, a
/// room is a group if it stands on a separate ground, with lamps and trees around it. A sheet that
/// is around all other parts belongs to no group.
pub(super) fn groups(tracer: &SceneTracer) -> Vec<Region> {
    let whole = tracer.region;
    let mut boxes = SceneParts::of(tracer).boxes();
    boxes.sort_by(|a, b| extent(&b.0).total_cmp(&extent(&a.0)));
    boxes.truncate(MAX_PARTS);
    while let [first, others @ ..] = boxes.as_slice() {
        if others.is_empty() || !is_around(&first.0, others) {
            break;
        }
        boxes.remove(0);
    }
    let mut groups: Vec<(Bounds3, usize)> = Vec::new();
    for part in boxes {
        let (near, apart): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| are_near(&group.0, &part.0));
        groups = apart;
        groups.push(
            near.iter()
                .fold(part, |all, group| (union(all.0, &group.0), all.1 + group.1)),
        );
    }
    let corners: usize = groups.iter().map(|(_, corners)| corners).sum();
    groups.sort_by(|a, b| volume(&b.0).total_cmp(&volume(&a.0)));
    groups.retain(|(group, _)| volume(group) > 0.0 && volume(group) < SMALLER * volume(&whole.bounds));
    groups.truncate(MAX_GROUPS);
    let region = |(bounds, count): (Bounds3, usize)| whole.with_group(bounds, count as f32 / corners as f32);
    groups.into_iter().map(region).collect()
}

/// Region of `tracer` without grounds that are much wider than the objects on them: flat sheets, of
/// which one may be bent upwards behind the objects.
pub(super) fn without_sheets(tracer: &SceneTracer, horizon: &Horizon) -> Region {
    let whole = tracer.region;
    let parts = SceneParts::of(tracer);
    let mut boxes: Vec<(usize, Bounds3)> = (0..).zip(parts.boxes()).map(|(i, (part, _))| (i, part)).collect();
    boxes.sort_by(|a, b| extent(&b.1).total_cmp(&extent(&a.1)));
    for count in 1..=MAX_SHEETS {
        let Some((sheets, others)) = boxes.split_at_checked(count) else {
            break;
        };
        let Some(rest) = others.iter().map(|(_, part)| *part).reduce(|a, b| union(a, &b)) else {
            break;
        };
        let object = upright_bounds(rest, horizon);
        let ground = |&(number, sheet): &(usize, Bounds3)| {
            let sheet = upright_bounds(sheet, horizon);
            if !is_wide_below(&sheet, &object) {
                return None;
            }
            let is_flat = sheet.max.y - sheet.min.y <= SHEET * extent(&sheet);
            if is_flat && sheet.max.y <= object.min.y + AT_BOTTOM * (object.max.y - object.min.y) {
                return Some(WideGround::Flat);
            }
            let is_within = |axis: usize| (sheet.min[axis]..sheet.max[axis]).contains(&object.center()[axis]);
            let open = || parts.open_side_of_backdrop(number, sheet, horizon);
            (is_within(0) && is_within(2))
                .then(open)
                .flatten()
                .map(WideGround::Backdrop)
        };
        let grounds: Option<Vec<WideGround>> = sheets.iter().map(ground).collect();
        if let Some(grounds) = grounds {
            let is_bent = |ground: &&WideGround| **ground != WideGround::Flat;
            let bent = grounds.iter().find(is_bent).copied();
            return whole.on_ground(rest, bent.unwrap_or(WideGround::Flat));
        }
    }
    whole
}

/// Returns true if `sheet` is much wider than `object`, and its bottom is not above the object's
/// bottom.
fn is_wide_below(sheet: &Bounds3, object: &Bounds3) -> bool {
    let (size, around) = (object.max - object.min, sheet.max - sheet.min);
    let is_wide = around.x.min(around.z) >= WIDE_GROUND * size.x.max(size.z) && size.x.min(size.z) > 0.0;
    is_wide && sheet.min.y <= object.min.y + AT_BOTTOM * size.y
}

/// Returns true if `sheet` is flat, and reaches far beyond `others` along its plane.
fn is_around(sheet: &Bounds3, others: &[(Bounds3, usize)]) -> bool {
    let rest = others.iter().fold(others[0].0, |all, (part, _)| union(all, part));
    let (size, rest) = (sheet.max - sheet.min, rest.max - rest.min);
    let thin = (-size).max_position();
    let is_wider = |axis: usize| rest[axis] < COVERED * size[axis];
    size[thin] <= SHEET * extent(sheet) && (0..3).filter(|&axis| axis != thin).all(is_wider)
}

/// Returns true if two boxes touch or nearly touch.
fn are_near(a: &Bounds3, b: &Bounds3) -> bool {
    let margin = Vec3::splat(NEAR * extent(a).min(extent(b)));
    a.min.cmple(b.max + margin).all() && b.min.cmple(a.max + margin).all()
}

/// The box around two boxes.
fn union(mut a: Bounds3, b: &Bounds3) -> Bounds3 {
    a.extend(b.min);
    a.extend(b.max);
    a
}

fn volume(bounds: &Bounds3) -> f32 {
    (bounds.max - bounds.min).to_array().iter().product()
}
