//! Cameras that frame points.

use super::look::Looker;
use super::triangles::for_each_triangle;
use crate::math::{Horizon, Vec2, Vec3};

/// The smallest pyramid of view, of fixed directions, that holds points: half-spaces that the points push outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    right: Vec3,
    up: Vec3,
    /// From what is seen to the eye.
    back: Vec3,
    /// Tangents of half the horizontal and the vertical angle that the points may fill.
    slope: Vec2,
    /// Largest `±x + slope · z` and `±y + slope · z` of the points.
    sides: [f32; 4],
    /// Nearest and farthest `z`.
    depth: [f32; 2],
}

impl Frustum {
    /// One that sees along `-back`, where `up` is up and points may fill the angles of `slope`.
    pub fn new(back: Vec3, up: Vec3, slope: Vec2) -> Self {
        let right = up.cross(back).normalize();
        Self {
            right,
            up: back.cross(right),
            back,
            slope,
            sides: [f32::NEG_INFINITY; 4],
            depth: [f32::NEG_INFINITY, f32::INFINITY],
        }
    }

    /// Takes in a point.
    pub fn extend(&mut self, p: Vec3) {
        let (x, y, z) = (p.dot(self.right), p.dot(self.up), p.dot(self.back));
        let pushed = [x, -x, y, -y];
        for (i, (side, pushed)) in self.sides.iter_mut().zip(pushed).enumerate() {
            *side = side.max(pushed + self.slope[i / 2] * z);
        }
        self.depth = [self.depth[0].max(z), self.depth[1].min(z)];
    }

    /// Where the eye is, and the point in the middle of what it sees. The tighter of both angles decides on the distance; in the other one the points are
    /// in the middle. The middle of the nearest and the farthest point is in the middle.
    pub fn camera(&self) -> (Vec3, Vec3) {
        let [right, left, top, bottom] = self.sides;
        let distance = |a: f32, b: f32, slope: f32| 0.5 * (a + b) / slope;
        let z = distance(right, left, self.slope.x).max(distance(top, bottom, self.slope.y));
        let axis = 0.5 * (right - left) * self.right + 0.5 * (top - bottom) * self.up;
        let middle = 0.5 * self.depth[0] + 0.5 * self.depth[1];
        (axis + z * self.back, axis + middle * self.back)
    }
}

/// How a scene is framed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Vertical field of view, degrees.
    pub fov: f32,
    /// Width of the image over its height.
    pub aspect: f32,
    /// Share of the image's width or height that the scene fills.
    pub fill: f32,
}

impl Frame {
    /// Position and target of the camera that sees the scene from `back`, a unit vector towards the eye. `max` of the scene's
    /// triangles are looked at.
    pub fn place(&self, looker: &Looker, max: u64, horizon: &Horizon, back: Vec3) -> (Vec3, Vec3) {
        let slope = self.fill * (0.5 * self.fov.clamp(1.0, 179.0)).to_radians().tan();
        let mut frustum = Frustum::new(back, horizon.image_up(back), Vec2::new(slope * self.aspect, slope));
        for_each_triangle(looker.scene, max, |triangle| {
            if looker.region.holds(&triangle.corners) {
                triangle.corners.iter().for_each(|&p| frustum.extend(p));
            }
        });
        let (eye, target) = frustum.camera();
        // A single point, or a scene of none, is seen from some distance.
        match eye.distance(target) > 0.0 && eye.is_finite() {
            true => (eye, target),
            false => {
                let target = looker.region.bounds.center();
                (target + back * (1.0 + target.abs().max_element()), target)
            }
        }
    }
}
