//! Evenly spread points and directions, the same in every run.

use crate::math::{Bounds3, Vec2, Vec3};
use crate::sampling::warp::uniform_sphere;

/// Number of points inside of a box.
pub(super) const POINTS: u32 = 256;
/// Number of directions from a point.
const DIRECTIONS: u32 = 48;

/// Points all over the inside of `bounds`, from Halton's sequence.
pub(super) fn points_inside(bounds: Bounds3) -> impl Iterator<Item = Vec3> {
    (0..POINTS).map(move |i| {
        let share = Vec3::from([radical_inverse(2, i), radical_inverse(3, i), radical_inverse(5, i)]);
        bounds.min + (bounds.max - bounds.min) * (0.04 + 0.92 * share)
    })
}

/// Directions all over the sphere, different for each `i`.
pub(super) fn directions(i: u32) -> impl Iterator<Item = Vec3> {
    let shift = Vec2::new(radical_inverse(7, i), radical_inverse(11, i));
    (0..DIRECTIONS).map(move |k| {
        let even = Vec2::new((k as f32 + 0.5) / DIRECTIONS as f32, radical_inverse(2, k));
        uniform_sphere((even + shift) - (even + shift).floor())
    })
}

/// Van der Corput's radical inverse of `i + 1`, in [0, 1).
pub(super) fn radical_inverse(base: u32, i: u32) -> f32 {
    let (mut rest, mut inverse, mut place) = (i + 1, 0.0, 1.0);
    while rest > 0 {
        place /= base as f32;
        inverse += place * (rest % base) as f32;
        rest /= base;
    }
    inverse
}
