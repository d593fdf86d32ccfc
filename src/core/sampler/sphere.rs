//! Shared parts of samplers that draw directions from point sets on the unit sphere.

use super::hash::{numbered, unit_f32};
use crate::math::{Frame, Quat, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;
use std::f32::consts::TAU;

/// Maximum number of points of a set, as the exponent of 2.
pub(super) const MAX_BITS: u32 = 10;

/// Number of points of the set for `count` samples, as the exponent of 2: the largest power of 2 up
/// to `count`.
pub(super) fn set_bits(count: u32) -> u32 {
    count.max(1).ilog2().min(MAX_BITS)
}

/// The unit vector `base`, moved to the point `u` of a disk in its tangent plane and projected back
/// to the sphere.
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

/// Two uniform variates from 64 random bits.
pub(super) fn pair(bits: u64) -> Vec2 {
    Vec2::new(unit_f32((bits >> 32) as u32), unit_f32(bits as u32))
}
