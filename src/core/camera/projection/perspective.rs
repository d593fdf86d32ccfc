//! Perspectives: a central projection onto a plane.

use super::{Axes, Mapping, Plane, PlaneScale, ScreenWindow};
use crate::camera::CameraError;
use crate::math::{Vec2, Vec3};

/// A perspective for an image of a given size. The plane is at distance 1.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct Perspective(pub PlaneScale);

impl Perspective {
    /// Perspective for an image of `size` pixels. `vertical_fov` is in degrees. `shift` is in
    /// picture heights, y up.
    pub fn new(vertical_fov: f32, shift: Vec2, size: Vec2) -> Result<Self, CameraError> {
        // The height of the image plane at distance 1 is 2 tan(fov/2)
        let scale = 2.0 * (0.5 * vertical_fov.to_radians()).tan() / size.y;
        Ok(Self(PlaneScale::new(scale, shift, size)?))
    }

    /// Direction of depth 1 of the ray through `film`.
    #[inline]
    pub fn direction(&self, film: Vec2, [right, up, forward]: Axes) -> Vec3 {
        let image = self.0.point(film);
        image.x * right - image.y * up + forward
    }
}

impl Mapping for Perspective {
    fn ray(&self, film: Vec2, axes: Axes) -> (Vec3, Vec3) {
        (Vec3::ZERO, self.direction(film, axes))
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        let image = (to.z > 0.0).then(|| Vec2::new(to.x, -to.y) / to.z)?;
        Some(self.0.film(image))
    }

    fn plane(&self) -> Option<Plane> {
        Some(self.0.plane(false))
    }

    fn screen_window(&self, size: Vec2) -> Option<ScreenWindow> {
        Some(self.0.window(size))
    }
}
