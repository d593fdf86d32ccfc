//! Shared parts of samplers that draw directions from point sets on the unit sphere.

use super::hash::{numbered, unit_f32};
use crate::math::{Frame, Quat, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;
use std::f32::consts::TAU;

/// Base-2 logarithm of the maximum number of points of a set.
pub(super) const MAX_BITS: u32 = 10;

/// Base-2 logarithm of the size of the point set for `count` samples. The size is the largest power
/// of 2 up to `count`, at most 2^[`MAX_BITS`].
pub(super) fn set_bits(count: u32) -> u32 {
    count.max(1).ilog2().min(MAX_BITS)
}

/// Moves the unit vector `base` on a disk of radius `radius` in its tangent plane, and projects the
/// result back to the unit sphere. `u` selects a uniform position on the disk.
pub(super) fn moved_on_disk(base: Vec3, u: Vec2, radius: f32) -> Vec3 {
    let moved = radius * uniform_disk(u);
    Frame::from_z(base).to_world(moved.extend(1.0).into()).normalize()
}

/// A uniform random rotation, selected by `key` (Shoemake 1992, "Uniform Random Rotations").
pub(super) fn rotation(key: u64) -> Quat {
    let (share, turns) = (pair(numbered(key, 0)).x, pair(numbered(key, 1)));
    let xy = (1.0 - share).sqrt() * Vec2::from_angle(TAU * turns.x);
    let zw = share.sqrt() * Vec2::from_angle(TAU * turns.y);
    Quat::from_xyzw(xy.x, xy.y, zw.x, zw.y)
}

/// Two uniform variates from 64 random bits.
pub(super) fn pair(bits: u64) -> Vec2 {
    Vec2::new(unit_f32((bits >> 32) as u32), unit_f32(bits as u32))
}
