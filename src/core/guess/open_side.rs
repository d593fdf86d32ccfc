//! The open side of an object, which is its front. Sofas, chairs, shelves and beds have a high back
//! and a deep front. Cupboards and football goals are hollow, and open at the front.

use super::side_points::{SIDES, SidePoint, TAIL, axis_of, likeness, placed, range_without};
use super::surfaces::Point;
use crate::math::{Bounds3, Horizon};

/// Number of cells of a depth map along each edge.
const CELLS: usize = 24;
/// Minimum number of points of a depth map.
const MIN_POINTS: usize = 40;
/// Maximum depth of a cell that belongs to a flat side.
const FLAT: f32 = 0.06;
/// Minimum fraction of flat cells, and maximum mean depth, of a flat back: it stands at a wall.
const FLAT_BACK: f32 = 0.4;
const BACK_DEPTH: f32 = 0.1;
/// Minimum difference between the mean depths of the open side and of a flat back.
const DEEPER: f32 = 0.2;
/// The same difference if the back is not flat, as behind the net of a goal or behind a screen with
/// a keyboard in front of it. The object is then at least `WIDE` times as wide as deep: animals are
/// long, and deep from behind. `SLOPED` is the maximum mean depth of such a back.
const DEEPER_THAN_SLOPE: f32 = 0.3;
const WIDE: f32 = 0.9;
const SLOPED: f32 = 0.3;
/// Minimum depth of the object, as a fraction of its smaller extent across: a screen is a plate.
const THICK: f32 = 0.25;
/// Minimum ratio of height to depth. Lower objects are seen from above.
const HIGH: f32 = 0.25;
/// Minimum similarity of the left and right halves.
const ALIKE: f32 = 0.65;

/// Depths of the surfaces that are visible from one side, below the front of the object's box, as
/// fractions of the depth of the box.
pub(super) struct DepthMap {
    /// Mean depth over the cells that show a surface.
    pub mean: f32,
    /// Fraction of the cells that are less than [`FLAT`] deep.
    flat: f32,
    /// Extents of the box to the right and to the back, scene units.
    width: f32,
    depth: f32,
}

impl DepthMap {
    /// Depths of `points`, which are in coordinates of one side. The box leaves out the fraction
    /// `tail` of the points at each end. `None` if the box is empty.
    pub fn new(points: &[SidePoint], tail: f32) -> Option<Self> {
        let (back, front) = range_without(points.iter().map(|p| p.front), tail, MIN_POINTS)?;
        let (left, right) = range_without(points.iter().map(|p| p.right), tail, MIN_POINTS)?;
        let (width, depth) = (right - left, front - back);
        if width <= 0.0 || depth <= 0.0 {
            return None;
        }
        let mut depths = vec![None; CELLS * CELLS];
        for p in points {
            let cell = |share: f32| ((share * CELLS as f32) as usize).min(CELLS - 1);
            let at = &mut depths[cell(p.height) * CELLS + cell((p.right - left) / width)];
            let below = ((front - p.front) / depth).clamp(0.0, 1.0);
            *at = Some(at.map_or(below, |first: f32| first.min(below)));
        }
        let shown: Vec<f32> = depths.into_iter().flatten().collect();
        let count = shown.len() as f32;
        Some(Self {
            mean: shown.iter().sum::<f32>() / count,
            flat: shown.iter().filter(|&&depth| depth < FLAT).count() as f32 / count,
            width,
            depth,
        })
    }

    /// Difference between the mean depths of this side and of the opposite side `back`, if this
    /// side is open and `back` is a back.
    fn deeper_than(&self, back: &Self, height: f32) -> Option<f32> {
        let difference = self.mean - back.mean;
        let is_body = self.depth >= THICK * self.width.min(height) && height >= HIGH * self.depth;
        let is_flat = back.flat >= FLAT_BACK && back.mean <= BACK_DEPTH && difference >= DEEPER;
        let is_sloped = self.width >= WIDE * self.depth && back.mean <= SLOPED && difference >= DEEPER_THAN_SLOPE;
        (is_body && (is_flat || is_sloped)).then_some(difference)
    }
}

/// Azimuth of the open side, in degrees; `None` if no side is open, or if the left and right halves
/// of the object differ.
pub(super) fn open_side(points: &[Point], bounds: Bounds3, horizon: &Horizon) -> Option<f32> {
    let height = bounds.max.y - bounds.min.y;
    let maps = SIDES.map(|azimuth| DepthMap::new(&placed(points, bounds, horizon, azimuth), TAIL));
    let open = |i: usize| {
        let (side, back) = maps[i].as_ref().zip(maps[(i + 2) % SIDES.len()].as_ref())?;
        let difference = side.deeper_than(back, height)?;
        let is_alike = likeness(points, bounds, horizon, axis_of(SIDES[i] + 90.0)) >= ALIKE;
        is_alike.then_some((SIDES[i], difference))
    };
    let sides = (0..SIDES.len()).filter_map(open);
    sides
        .max_by(|(_, a), (_, b)| a.total_cmp(b))
        .map(|(azimuth, _)| azimuth)
}
