use crate::camera::Camera;
use crate::math::{Ball, Vec3};

/// Radius within which photons, or vertices of light paths, count for a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchRadius {
    /// One radius for the whole scene, scene units.
    Fixed(f32),
    /// Widths of a pixel at the point's distance from the camera, so that near and far look alike.
    Pixels(f32),
}

/// Maximum change of a radius per length: with few pixels a pixel's width grows as fast as the distance.
const MAX_SLOPE: f32 = 0.5;

/// Minimum radius over the size of the scene; coordinates tell so small lengths apart.
const MIN_SHARE: f32 = 1.0 / (1 << 20) as f32;

/// [`SearchRadius`] in a scene, as seen by a camera.
#[derive(Clone, Copy, Debug)]
pub struct Radii<'a> {
    camera: &'a Camera,
    /// Width by distance, where it is not fixed.
    slope: f32,
    fixed: Option<f32>,
    min: f32,
    max: f32,
}

impl<'a> Radii<'a> {
    /// `radius` times `factor`, in a scene that `ball` holds.
    pub fn new(radius: SearchRadius, factor: f32, camera: &'a Camera, ball: &Ball) -> Self {
        let size = (ball.center.abs().max_element() + ball.radius).min(1e30);
        let (fixed, pixels) = match radius {
            SearchRadius::Fixed(radius) => (Some(radius * factor), 0.0),
            SearchRadius::Pixels(pixels) => (None, pixels),
        };
        Self {
            camera,
            slope: factor * (pixels * camera.pixel_width_by_distance()).min(MAX_SLOPE),
            fixed,
            min: MIN_SHARE * size,
            max: size,
        }
    }

    /// Maximum change of a radius per length.
    pub fn slope(&self) -> f32 {
        self.slope
    }

    /// The radius at `p` at `time`.
    pub fn at(&self, p: Vec3, time: f32) -> f32 {
        let radius = self.fixed.unwrap_or_else(|| {
            let distance = self.camera.pixel_width(p, time) / self.camera.pixel_width_by_distance();
            self.slope * distance
        });
        // A NaN becomes the minimum.
        radius.max(self.min).min(self.max)
    }
}
