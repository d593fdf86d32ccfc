//! Polygonal opening of a lens.

use super::CameraError;
use crate::math::{Vec2, encode_fields};
use std::f32::consts::TAU;

/// Minimum and maximum number of blades of an aperture.
pub const BLADES: [u32; 2] = [3, 32];

/// Opening of a diaphragm with straight blades: a regular polygon with corners on the rim of the
/// lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aperture {
    /// Number of blades, equal to the number of sides of the polygon; within [`BLADES`].
    pub blades: u32,
    /// Angle of the first corner in degrees: 0 is to the right of the image, and angles grow
    /// counter-clockwise as seen by the camera.
    pub rotation: f32,
}

encode_fields!(Aperture { blades, rotation });

impl Aperture {
    /// Returns an error if the values are out of range.
    pub(super) fn check(&self) -> Result<(), CameraError> {
        let [min, max] = BLADES;
        let error = |parameter, message| {
            Err(CameraError {
                parameter,
                message,
                help: None,
            })
        };
        if !(min..=max).contains(&self.blades) {
            let message = format!("must be from {min} to {max}, not {}", self.blades);
            return error("aperture_blades", message);
        }
        if !self.rotation.is_finite() {
            let message = format!("must be a finite number of degrees, not {}", self.rotation);
            return error("aperture_rotation", message);
        }
        Ok(())
    }

    /// Samples a point of the polygon with circumradius 1, uniformly over its area. `u` chooses a
    /// triangle between the centre and two neighbouring corners, and a point in this triangle.
    pub(super) fn sample(&self, u: Vec2) -> Vec2 {
        let side = u.x * self.blades as f32;
        let first = (side as u32).min(self.blades - 1);
        let (a, b) = (self.corner(first), self.corner(first + 1));
        // Take the square root, because the area within the fraction r of the triangle's height
        // grows with r².
        (side - first as f32).clamp(0.0, 1.0).sqrt() * a.lerp(b, u.y)
    }

    /// Area of the polygon with circumradius 1.
    pub(super) fn area(&self) -> f32 {
        let blades = self.blades as f32;
        0.5 * blades * (TAU / blades).sin()
    }

    fn corner(&self, index: u32) -> Vec2 {
        let turn = (index % self.blades) as f32 / self.blades as f32;
        Vec2::from_angle(self.rotation.rem_euclid(360.0).to_radians() + TAU * turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points sampled with a lattice of numbers have the moments of a regular polygon: the mean is
    /// 0, and the mean squared distance from the centre is R²/6 · (2 + cos 2π/n).
    #[test]
    fn points_are_uniform_over_the_polygon() {
        const N: u32 = 1 << 20;
        let golden = 0.5 * (5f64.sqrt() - 1.0);
        for blades in [3, 4, 5, 8, 32] {
            let aperture = Aperture { blades, rotation: 17.0 };
            aperture.check().unwrap();
            let (mut mean, mut squared, mut inside) = ([0.0f64; 2], 0.0, 0);
            let apothem = (std::f32::consts::PI / blades as f32).cos();
            for i in 0..N {
                let u = Vec2::new((i as f32 + 0.5) / N as f32, (f64::from(i) * golden).fract() as f32);
                let p = aperture.sample(u);
                mean = [mean[0] + f64::from(p.x), mean[1] + f64::from(p.y)];
                squared += f64::from(p.length_squared());
                inside += u32::from(p.length() < 0.5 * apothem);
            }
            let n = f64::from(N);
            let expected = (2.0 + (TAU as f64 / blades as f64).cos()) / 6.0;
            assert!(mean[0].hypot(mean[1]) / n < 1e-4, "{blades}");
            assert!((squared / n / expected - 1.0).abs() < 1e-3, "{blades}: {squared}");
            // The fraction of the points in a disk around the centre is the disk's fraction of the
            // area.
            let share = std::f64::consts::PI * (0.5 * apothem as f64).powi(2) / aperture.area() as f64;
            assert!((f64::from(inside) / n / share - 1.0).abs() < 5e-3, "{blades}: {inside}");
        }
    }

    #[test]
    fn invalid_apertures_are_errors() {
        for (blades, rotation) in [(0, 0.0), (2, 0.0), (33, 0.0), (6, f32::NAN), (6, f32::INFINITY)] {
            assert!(Aperture { blades, rotation }.check().is_err(), "{blades} {rotation}");
        }
    }
}
