//! Sixteen numbers or vectors at once, as arrays whose loops the compiler vectorises.

// Loops use one index for all arrays, so that the compiler can vectorise them.
#![allow(clippy::needless_range_loop)]

use super::Vec3;

/// Number of lanes.
pub const LANES: usize = 16;

/// A number for each lane.
pub type Lane = [f32; LANES];

/// A vector for each lane.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // Coordinates
pub struct Vec3Lanes {
    pub x: Lane,
    pub y: Lane,
    pub z: Lane,
}

impl Vec3Lanes {
    /// Zero in all lanes.
    pub const ZERO: Self = Self {
        x: [0.0; LANES],
        y: [0.0; LANES],
        z: [0.0; LANES],
    };

    /// Vector `v` in all lanes.
    #[inline(always)]
    pub fn splat(v: Vec3) -> Self {
        Self {
            x: [v.x; LANES],
            y: [v.y; LANES],
            z: [v.z; LANES],
        }
    }

    /// Vector of a lane below [`LANES`].
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Sets the vector of a lane below [`LANES`].
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        self.x[lane] = v.x;
        self.y[lane] = v.y;
        self.z[lane] = v.z;
    }

    /// Dot products by lane, with the same rounding as single vectors.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> Lane {
        let mut dot = [0.0; LANES];
        for i in 0..LANES {
            dot[i] = self.x[i] * other.x[i] + self.y[i] * other.y[i] + self.z[i] * other.z[i];
        }
        dot
    }

    /// Vectors from `self` to the point `p`.
    #[inline(always)]
    pub fn to(&self, p: Vec3) -> Self {
        let mut d = *self;
        for i in 0..LANES {
            d.x[i] = p.x - d.x[i];
            d.y[i] = p.y - d.y[i];
            d.z[i] = p.z - d.z[i];
        }
        d
    }

    /// The vectors in opposite direction.
    #[inline(always)]
    pub fn reversed(mut self) -> Self {
        self.scale(&[-1.0; LANES]);
        self
    }

    /// Multiplies the vector of each lane by the number in the same lane of `factor`.
    #[inline(always)]
    pub fn scale(&mut self, factor: &Lane) {
        for i in 0..LANES {
            self.x[i] *= factor[i];
            self.y[i] *= factor[i];
            self.z[i] *= factor[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Frame;

    /// Operations on lanes and on single vectors have bit-identical results.
    #[test]
    fn lanes_and_vectors_are_bit_identical() {
        let number = |k: usize| (k as f32 * 0.618_034).fract() * 2.0 - 1.0;
        let vector = |k: usize| Vec3::new(number(k), number(7 * k + 3), number(13 * k + 5));
        let mut lanes = [Vec3Lanes::ZERO; 2];
        for lane in 0..LANES {
            lanes[0].set(lane, vector(lane));
            lanes[1].set(lane, vector(lane + 100));
        }
        let [v, w] = lanes;
        let p = vector(50);
        let frame = Frame::from_z(vector(60).normalize());
        let (dot, to, local, mut scaled) = (v.dot(&w), v.to(p), frame.to_local_lanes(&v), v);
        scaled.scale(&w.x);
        for lane in 0..LANES {
            let (one, other) = (vector(lane), vector(lane + 100));
            assert_eq!((v.get(lane), dot[lane]), (one, one.dot(other)));
            assert_eq!((to.get(lane), local.get(lane)), (p - one, frame.to_local(one)));
            assert_eq!((scaled.get(lane), v.reversed().get(lane)), (one * other.x, -one));
        }
        assert_eq!(Vec3Lanes::splat(p).get(3), p);
    }
}
