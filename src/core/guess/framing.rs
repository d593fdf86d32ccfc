//! Cameras that frame points.

use super::scene_tracer::SceneTracer;
use super::triangles::for_each_triangle;
use crate::math::{Horizon, Vec2, Vec3};

/// The smallest view pyramid, for given directions and angles, that contains all points. It is
/// stored as half-spaces, which each new point may move outwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frustum {
    right: Vec3,
    up: Vec3,
    /// Unit vector from the scene to the eye.
    back: Vec3,
    /// Tangents of half the horizontal and the vertical angle that the points may fill.
    slope: Vec2,
    /// Maximum of `±x + slope · z` and `±y + slope · z` over the points.
    sides: [f32; 4],
    /// Nearest and farthest `z` of the points.
    depth: [f32; 2],
}

impl Frustum {
    /// An empty pyramid that looks along `-back`, with the up direction `up`. `slope` has the
    /// tangents of half its horizontal and vertical angles.
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

    /// Extends the pyramid by a point.
    pub fn extend(&mut self, p: Vec3) {
        let (x, y, z) = (p.dot(self.right), p.dot(self.up), p.dot(self.back));
        let pushed = [x, -x, y, -y];
        for (i, (side, pushed)) in self.sides.iter_mut().zip(pushed).enumerate() {
            *side = side.max(pushed + self.slope[i / 2] * z);
        }
        self.depth = [self.depth[0].max(z), self.depth[1].min(z)];
    }

    /// Position of the eye, and the point in the middle of the image. The tighter of both angles
    /// determines the distance. Along the other angle the points are centred. The target is in the
    /// middle between the nearest and the farthest point.
    pub fn camera(&self) -> (Vec3, Vec3) {
        let [right, left, top, bottom] = self.sides;
        let distance = |a: f32, b: f32, slope: f32| 0.5 * (a + b) / slope;
        let z = distance(right, left, self.slope.x).max(distance(top, bottom, self.slope.y));
        let axis = 0.5 * (right - left) * self.right + 0.5 * (top - bottom) * self.up;
        let middle = 0.5 * self.depth[0] + 0.5 * self.depth[1];
        (axis + z * self.back, axis + middle * self.back)
    }
}

/// Framing of a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Framing {
    /// Vertical field of view in degrees.
    pub fov: f32,
    /// Aspect ratio of the image: width divided by height.
    pub aspect: f32,
    /// Fraction of the image's width or height that the scene fills.
    pub fill: f32,
}

impl Framing {
    /// Position and target of the camera that sees the scene from `back`, a unit vector towards the
    /// eye. Uses at most `max` of the scene's triangles.
    pub fn place(&self, tracer: &SceneTracer, max: u64, horizon: &Horizon, back: Vec3) -> (Vec3, Vec3) {
        let slope = self.fill * (0.5 * self.fov.clamp(1.0, 179.0)).to_radians().tan();
        let mut frustum = Frustum::new(back, horizon.image_up(back), Vec2::new(slope * self.aspect, slope));
        for_each_triangle(tracer.scene, max, |triangle| {
            if tracer.region.contains(&triangle.corners) {
                triangle.corners.iter().for_each(|&p| frustum.extend(p));
            }
        });
        let (eye, target) = frustum.camera();
        // Use a default distance for a single point and for an empty scene
        if eye.distance(target) > 0.0 && eye.is_finite() {
            (eye, target)
        } else {
            let target = tracer.region.bounds.center();
            (target + back * (1.0 + target.abs().max_element()), target)
        }
    }
}
