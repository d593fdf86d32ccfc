//! The barrel of a gun, which points to the front of a tank.

use super::side_points::{SidePoint, range, range_without};

/// Minimum number of points of the body, and of the part that stands on the ground.
const MIN_POINTS: usize = 40;
/// Maximum height of the part that stands on the ground, as a fraction of the object's height.
const ON_GROUND: f32 = 0.08;
/// Minimum length and width of the part that stands on the ground, as fractions of the object's
/// length and width.
const BASE: [f32; 2] = [0.45, 0.6];
/// Fraction of the base's length or width that belongs to a corner of the base.
const CORNER: f32 = 0.2;
/// Minimum fraction of the base's points in each corner: tracks end in corners. Pans and jugs are
/// round.
const IN_CORNER: f32 = 0.05;
/// Half the length of the middle of the base, as a fraction of its length.
const MIDDLE: f32 = 0.17;
/// Minimum fraction of the base's points in its middle. Animals have no legs there: their tails are
/// thin too.
const IN_MIDDLE: f32 = 0.2;
/// Minimum ratio of the object's length, with its barrel, to its width.
const LONG: f32 = 1.3;
/// Number of slices across the object's length.
const SLICES: usize = 24;
/// Minimum number of slices that show only the barrel.
const MIN_SLICES: usize = 2;
/// Minimum number of points of a slice.
const MIN_IN_SLICE: usize = 3;
/// Maximum width and height of the barrel, as fractions of the object's width and height.
const THIN: [f32; 2] = [0.25, 0.25];
/// Minimum height of the barrel above the ground, as a fraction of the object's height.
const ABOVE: f32 = 0.3;
/// Minimum width of the opposite end of the object, as a fraction of its width.
const WIDE_END: f32 = 0.4;

/// Returns true if the object is long, stands on tracks, and has a thin horizontal part that sticks
/// out at the front. `points` are in coordinates of the side that is taken as the front.
///
/// Of 490 public files, 5 of 11 tanks and nothing else have this shape. The guns of the other tanks
/// are wide or end above the hull.
pub(super) fn barrel_sticks_out(points: &[SidePoint]) -> bool {
    let low = || points.iter().filter(|p| p.height <= ON_GROUND);
    let (Some((back, front)), Some((left, right)), Some(along), Some(across)) = (
        range_without(points.iter().map(|p| p.front), 0.0, MIN_POINTS),
        range(points.iter().map(|p| p.right), MIN_POINTS),
        range(low().map(|p| p.front), MIN_POINTS),
        range(low().map(|p| p.right), MIN_POINTS),
    ) else {
        return false;
    };
    let (length, width) = (front - back, right - left);
    let (base_length, base_width) = (along.1 - along.0, across.1 - across.0);
    if width <= 0.0 || length < LONG * width || base_length < BASE[0] * length || base_width < BASE[1] * width {
        return false;
    }
    let share = |is_in: &dyn Fn(&SidePoint) -> bool| {
        low().filter(|&p| is_in(p)).count() as f32 / (low().count() as f32).max(1.0)
    };
    let middle = 0.5 * (along.0 + along.1);
    let has_corner = |(end, side): (f32, f32)| {
        let is_in = |p: &SidePoint| {
            (p.front - end).abs() <= CORNER * base_length && (p.right - side).abs() <= CORNER * base_width
        };
        share(&is_in) >= IN_CORNER
    };
    let corners = [along.0, along.1].map(|end| [(end, across.0), (end, across.1)]);
    let stands = share(&|p| (p.front - middle).abs() <= MIDDLE * base_length) >= IN_MIDDLE
        && corners.into_iter().flatten().all(has_corner);
    if !stands {
        return false;
    }
    let mut slices = vec![Vec::new(); SLICES];
    for p in points {
        let place = ((front - p.front) / length * SLICES as f32) as usize;
        slices[place.min(SLICES - 1)].push(p);
    }
    let extent = |slice: &[&SidePoint], of: fn(&SidePoint) -> f32| {
        range_without(slice.iter().map(|p| of(p)), 0.0, MIN_IN_SLICE).map(|(min, max)| max - min)
    };
    let is_barrel = |slice: &Vec<&SidePoint>| {
        let mean = slice.iter().map(|p| p.height).sum::<f32>() / (slice.len() as f32).max(1.0);
        let thin = extent(slice, |p| p.right).zip(extent(slice, |p| p.height));
        mean >= ABOVE && thin.is_some_and(|(wide, high)| wide <= THIN[0] * width && high <= THIN[1])
    };
    let end = slices.last().and_then(|slice| extent(slice, |p| p.right));
    slices.iter().take_while(|slice| is_barrel(slice)).count() >= MIN_SLICES
        && end.is_some_and(|wide| wide >= WIDE_END * width)
}
