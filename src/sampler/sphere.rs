//! Parts of samplers that take directions from point sets on the unit sphere.

use super::hash::{numbered, unit_f32};
use crate::math::{Frame, Quat, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;
use std::f32::consts::TAU;

/// Maximum number of points of a set, as a power of two.
pub(super) const MAX_BITS: u32 = 10;

/// Number of points of the set for `count` samples, as a power of two: the largest that is no more than `count`.
pub(super) fn set_bits(count: u32) -> u32 {
    count.max(1).ilog2().min(MAX_BITS)
}

/// The unit vector `base`, moved to the place `u` of a disk in its tangent plane and back to the sphere.
pub(super) fn moved_on_disk(base: Vec3, u: Vec2, radius: f32) -> Vec3 {
    let moved = radius * uniform_disk(u);
    Frame::from_z(base).to_world(moved.extend(1.0).into()).normalize()
}

/// A uniform rotation (Shoemake 1992, "Uniform Random Rotations"), chosen by `key`.
pub(super) fn rotation(key: u64) -> Quat {
    let (share, turns) = (pair(numbered(key, 0)).x, pair(numbered(key, 1)));
    let xy = (1.0 - share).sqrt() * Vec2::from_angle(TAU * turns.x);
    let zw = share.sqrt() * Vec2::from_angle(TAU * turns.y);
    Quat::from_xyzw(xy.x, xy.y, zw.x, zw.y)
}

/// Two uniform variates of 64 random bits.
pub(super) fn pair(bits: u64) -> Vec2 {
    Vec2::new(unit_f32((bits >> 32) as u32), unit_f32(bits as u32))
}

/// Largest difference between the share of `points` in a spherical cap and the cap's share of the sphere, over 512 axes and 199 heights.
#[cfg(test)]
pub(super) fn cap_discrepancy(points: &[Vec3]) -> f64 {
    use crate::sampling::warp::uniform_sphere;
    let axes = (0..512).map(|i| uniform_sphere(pair(numbered(1, i))));
    let of_axis = |axis: Vec3| {
        let heights = (1..200).map(|i| i as f32 / 100.0 - 1.0);
        let mut cosines: Vec<f32> = points.iter().map(|p| p.dot(axis)).collect();
        cosines.sort_by(f32::total_cmp);
        let difference = |cos: f32| {
            let inside = cosines.len() - cosines.partition_point(|&c| c <= cos);
            (inside as f64 / cosines.len() as f64 - 0.5 * (1.0 - cos as f64)).abs()
        };
        heights.map(difference).fold(0.0, f64::max)
    };
    axes.map(of_axis).fold(0.0, f64::max)
}
