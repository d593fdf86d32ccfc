//! The radius within which photons are found, and within which `vcm` merges vertices. This module
//! has the radius of the first iteration, and the reduction of the radius in later iterations.
//!
//! A radius is a fixed length (`--photon-radius`) or, by default, a multiple of the width of a
//! pixel ([`PHOTON_PIXELS`], [`MERGING_PIXELS`]). In progressive methods the radius of an iteration
//! is [`shrinkage`] times the first radius. `photon-map` gathers a fixed number of photons instead.
//! The maximum distances of these photons are `FAR_SHARE` and `NEAR_SHARE` in
//! `photon/photon_map.rs`.
//!
//! This module is not in `photon`, because the weights of `bidirectional/connection` need the
//! merging radius, and `bidirectional` uses no other family.

use crate::camera::Camera;
use crate::math::{Ball, Vec3};

/// Search radius: maximum distance between a point and the photons, or vertices of light subpaths,
/// that are used at the point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SearchRadius {
    /// One radius for the whole scene, in scene units.
    Fixed(f32),
    /// Radius as a multiple of the width of a pixel at the distance of the point. The blur is then
    /// equally wide in the picture on near and far surfaces.
    Pixels(f32),
}

/// Search radius of progressive methods, which shrinks from iteration to iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgressiveRadius {
    /// Search radius in the first iteration.
    pub first: SearchRadius,
    /// Radius reduction parameter α: from 0 (smallest bias) to 1 (constant radius).
    pub alpha: f32,
}

impl ProgressiveRadius {
    /// Search radii of iteration `iteration`, counted from 0. `ball` encloses the scene.
    pub(crate) fn of_iteration<'a>(&self, iteration: u32, camera: &'a Camera, ball: &Ball) -> Radii<'a> {
        Radii::new(self.first, shrinkage(iteration, self.alpha), camera, ball)
    }
}

/// Radius of the first iteration of `sppm`, in widths of a pixel (docs/notebook/2026-11.md,
/// "Photons").
pub const PHOTON_PIXELS: f32 = 3.0;

/// Radius of the first iteration of `vcm`, in widths of a pixel. It is small because connections
/// find most of the light, and merging loses light at the edges of surfaces.
pub const MERGING_PIXELS: f32 = 1.0;

/// Maximum change of a radius per unit of distance from the camera. The limit matters in images
/// with few pixels, in which the width of a pixel grows nearly as fast as the distance.
const MAX_SLOPE: f32 = 0.5;

/// Minimum radius relative to the size of the scene. Coordinates do not resolve smaller lengths.
const MIN_SHARE: f32 = 1.0 / (1 << 20) as f32;

/// Radius of iteration `iteration`, counted from 0, divided by the radius of the first iteration.
/// The ratio is in (0, 1]. It is the square root of `∏ (i + α) / (i + 1)`, with i from 1 to
/// `iteration` (Knaus and Zwicker 2011). If `alpha` is 1, the radius does not change.
fn shrinkage(iteration: u32, alpha: f32) -> f32 {
    let alpha = alpha as f64;
    let ratio = |i: u32| (i as f64 + alpha) / (i as f64 + 1.0);
    (1..=iteration).map(ratio).product::<f64>().sqrt() as f32
}

/// Search radii of one scene and camera, from a [`SearchRadius`].
#[derive(Clone, Copy, Debug)]
pub struct Radii<'a> {
    camera: &'a Camera,
    /// Ratio of the radius to the distance from the camera; 0 if the radius is fixed.
    slope: f32,
    fixed: Option<f32>,
    /// Radius in widths of a pixel, for cameras with parallel rays.
    pixels: f32,
    min: f32,
    max: f32,
}

impl<'a> Radii<'a> {
    /// `factor` times the search radii that `radius` describes. `ball` encloses the scene.
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
            pixels: factor * pixels,
            min: MIN_SHARE * size,
            max: size,
        }
    }

    /// Maximum change of the radius per unit of distance between two points.
    pub fn slope(&self) -> f32 {
        self.slope
    }

    /// Search radius at the point `p` at `time`, in scene units.
    pub fn at(&self, p: Vec3, time: f32) -> f32 {
        let radius = self.fixed.unwrap_or_else(|| {
            if self.camera.pixel_width_by_distance() == 0.0 {
                return self.pixels * self.camera.pixel_width(p, time);
            }
            let distance = self.camera.pixel_width(p, time) / self.camera.pixel_width_by_distance();
            self.slope * distance
        });
        // If the radius is NaN, the minimum is used.
        radius.max(self.min).min(self.max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squared_radius_falls_as_power_of_iterations() {
        assert_eq!(shrinkage(0, 0.5), 1.0);
        assert!((shrinkage(1, 0.5).powi(2) - 0.75).abs() < 1e-6);
        assert_eq!(shrinkage(1000, 1.0), 1.0);
        // The squared radius falls as n^(α − 1)
        for alpha in [0.3, 2.0 / 3.0, 0.9] {
            let n = 20_000;
            let slope = (shrinkage(2 * n, alpha) / shrinkage(n, alpha)).powi(2).log2();
            assert!((slope - (alpha - 1.0)).abs() < 1e-3, "{alpha}: {slope}");
        }
    }
}
