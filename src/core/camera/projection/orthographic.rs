//! Orthographic projections: all rays have the direction of the view axis.

use super::{Axes, Mapping, Plane, PlaneScale, ScreenWindow};
use crate::camera::CameraError;
use crate::math::{Vec2, Vec3};

/// An orthographic projection for an image of a given size. Its plane is in scene units.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct Orthographic(pub PlaneScale);

impl Orthographic {
    /// Projection for an image of `size` pixels with the `height` in scene units. `shift` is in
    /// picture heights, y up.
    pub fn new(height: f32, shift: Vec2, size: Vec2) -> Result<Self, CameraError> {
        if !(height > 0.0 && height.is_finite()) {
            return Err(CameraError::not_positive("ortho_height", height));
        }
        Ok(Self(PlaneScale::new(height / size.y, shift, size)?))
    }
}

impl Mapping for Orthographic {
    fn ray(&self, film: Vec2, [right, up, forward]: Axes) -> (Vec3, Vec3) {
        let image = self.0.point(film);
        (image.x * right - image.y * up, forward)
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        (to.z > 0.0).then(|| self.0.film(Vec2::new(to.x, -to.y)))
    }

    fn plane(&self) -> Option<Plane> {
        Some(self.0.plane(true))
    }

    fn screen_window(&self, size: Vec2) -> Option<ScreenWindow> {
        Some(self.0.window(size))
    }
}
