//! Points of an object in coordinates of its sides.

use super::surfaces::Point;
use crate::math::{Bounds3, Horizon};
use std::collections::BTreeSet;

/// Azimuths of the sides, in degrees.
pub(super) const SIDES: [f32; 4] = [0.0, 90.0, 180.0, 270.0];
/// Fraction of the values that are left out at each end of a range.
pub(super) const TAIL: f32 = 0.02;
/// Minimum |cos| between up and the normals of a level surface, such as a seat.
const LEVEL: f32 = 0.8;
/// Number of grid cells along an axis, for comparing the halves of an object.
const HALF_CELLS: f32 = 12.0;

/// A point in coordinates of one side: to the right, up and to the front.
#[derive(Clone, Copy)]
pub(super) struct SidePoint {
    pub right: f32,
    pub height: f32,
    pub front: f32,
    /// True if the surface is horizontal.
    pub is_level: bool,
}

/// Converts points to coordinates of the side at `azimuth`, relative to the middle of the box.
/// Heights are from 0 to 1.
pub(super) fn placed(points: &[Point], bounds: Bounds3, horizon: &Horizon, azimuth: f32) -> Vec<SidePoint> {
    let [front, right] = [azimuth, azimuth + 90.0].map(|azimuth| {
        let way = horizon.coordinates(horizon.direction(azimuth, 0.0));
        way.round()
    });
    let (center, height) = (bounds.center(), bounds.max.y - bounds.min.y);
    let place = |point: &Point| {
        let p = horizon.coordinates(point.p) - center;
        SidePoint {
            right: p.dot(right),
            height: p.y / height + 0.5,
            front: p.dot(front),
            is_level: point.n.dot(horizon.up()).abs() > LEVEL,
        }
    };
    points.iter().map(place).collect()
}

/// Range of values without [`TAIL`] at each end; `None` if there are fewer than `min` values.
pub(super) fn range(values: impl Iterator<Item = f32>, min: usize) -> Option<(f32, f32)> {
    range_without(values, TAIL, min)
}

/// Range of values without the fraction `tail` at each end; `None` if there are fewer than `min`
/// values.
pub(super) fn range_without(values: impl Iterator<Item = f32>, tail: f32, min: usize) -> Option<(f32, f32)> {
    let mut values: Vec<f32> = values.collect();
    values.sort_unstable_by(f32::total_cmp);
    let tail = (tail * values.len() as f32) as usize;
    (values.len() >= min.max(1)).then(|| (values[tail], values[values.len() - 1 - tail]))
}

/// Axis of the frame of the horizon that is nearest to the direction at `azimuth`: 0 = x, 2 = z.
pub(super) fn axis_of(azimuth: f32) -> usize {
    if (azimuth / 90.0).round().rem_euclid(2.0) == 0.0 {
        2
    } else {
        0
    }
}

/// Similarity of the object and its mirror image along the axis `axis` of the frame of the horizon,
/// 0 to 1.
pub(super) fn likeness(points: &[Point], bounds: Bounds3, horizon: &Horizon, axis: usize) -> f32 {
    let size = bounds.max - bounds.min;
    let cells: BTreeSet<[i32; 3]> = points
        .iter()
        .map(|point| {
            let place = (horizon.coordinates(point.p) - bounds.min) / size * HALF_CELLS;
            place.to_array().map(|x| (x as i32).clamp(0, HALF_CELLS as i32 - 1))
        })
        .collect();
    let mirrored = |cell: &&[i32; 3]| {
        let mut cell = **cell;
        cell[axis] = HALF_CELLS as i32 - 1 - cell[axis];
        cells.contains(&cell)
    };
    cells.iter().filter(mirrored).count() as f32 / (cells.len() as f32).max(1.0)
}
