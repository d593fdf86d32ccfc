use super::Camera;
use crate::math::{Vec2, Vec3};
use std::f32::consts::PI;

/// How a pixel sees along a ray from the lens: what light that arrives there counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Importance {
    /// Where on the film: pixels, origin top left. It may lie outside of the image.
    pub film: Vec2,
    /// Importance in a pixel of the box filter, m⁻²·sr⁻¹: what radiance along the ray, times the cosine at the lens, counts in the pixel's
    /// value per area of the lens and solid angle. `1 / (s² cos⁴ θ A)`, for pixels of width s at distance 1 and a lens of area A (Pharr, Jakob and
    /// Humphreys 2016, §16.1.1, where the whole film counts as one).
    pub we: f32,
    /// Density per solid angle of the direction if film points are uniform, one to a pixel: `1 / (s² cos³ θ)`.
    pub pdf: f32,
}

impl Camera {
    /// A point of the lens at `time`, world space, uniform over its area; the pinhole itself.
    pub fn lens_point(&self, u: Vec2, time: f32) -> Vec3 {
        let camera = self.at(time);
        match self.has_lens() {
            true => camera.position + camera.on_lens(u),
            false => camera.position,
        }
    }

    /// Area of the lens, in squares of scene units; 1 for a pinhole, whose point is a delta.
    pub fn lens_area(&self) -> f32 {
        match self.has_lens() {
            true => PI * self.lens_radius * self.lens_radius,
            false => 1.0,
        }
    }

    /// Unit direction of view at `time`.
    pub fn forward(&self, time: f32) -> Vec3 {
        self.at(time).forward
    }

    /// How a pixel sees along the ray from the lens point `p` in the unit direction `w` out into the scene, at `time`: the inverse of
    /// [`Camera::ray`]. `None` behind the camera.
    pub fn importance(&self, p: Vec3, w: Vec3, time: f32) -> Option<Importance> {
        let camera = self.at(time);
        let cos = w.dot(camera.forward);
        // The ray meets the plane of focus where that through the centre of the lens does, which is the film's.
        let mut image = Vec2::new(w.dot(camera.right), -w.dot(camera.up)) / cos;
        if camera.has_lens() {
            let lens = p - camera.position;
            image += Vec2::new(lens.dot(camera.right), -lens.dot(camera.up)) / camera.focus_distance;
        }
        let pdf = 1.0 / (camera.scale * camera.scale * cos * cos * cos);
        let film = (image + camera.offset) / camera.scale;
        let we = pdf / (cos * self.lens_area());
        // Along the lens, both are beyond what numbers hold.
        (cos > 0.0 && we.is_finite() && film.is_finite()).then_some(Importance { film, we, pdf })
    }
}
