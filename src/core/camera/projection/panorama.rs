//! Panoramas: all directions, with the longitude horizontally and the latitude vertically.
//!
//! The eyes of a stereo panorama are on a circle around the position of the camera. The ray of each
//! film point is a tangent of this circle.

use super::{Axes, Mapping};
use crate::math::{Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// A panorama for an image of a given size.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct Panorama {
    /// Width of a pixel in radians of longitude.
    pub scale: f32,
    size: Vec2,
    /// Longitude from the left border of the picture to the view axis.
    middle: f32,
    /// Radius of the circle on which an eye of a stereo panorama moves: positive for the right eye,
    /// negative for the left eye. 0 if all rays have one origin.
    pub eye: f32,
}

impl Panorama {
    /// Panorama for an image of `size` pixels.
    pub fn new(size: Vec2) -> Self {
        let scale = TAU / size.x;
        Self {
            scale,
            size,
            middle: scale * (0.5 * size.x),
            eye: 0.0,
        }
    }

    /// Start of the ray that hits the point `to`. Both are relative to the position of the camera,
    /// along right, up and forward. `None` if `to` is not farther from the vertical axis than the
    /// eye, because no tangent of the circle then goes through `to`.
    ///
    /// A ray of the longitude φ has the horizontal direction f = (sin φ, cos φ), and starts at e r.
    /// Here r = (cos φ, −sin φ) is the direction to the right of f, and e is the radius `eye`. The
    /// ray passes through `to` if the horizontal part of `to` is e r + l f, where l = √(d² − e²)
    /// and d is the horizontal distance of `to`. With complex numbers, whose real axis is forward
    /// and whose imaginary axis is right, r is i f. So f is `to` / (l + i e).
    ///
    /// The same ray at the latitude λ is at the point p = e r + s (cos λ f + sin λ u) after the
    /// distance s, where u is up. The derivatives of r and f by φ are −f and r. The determinant of
    /// the derivatives of p by φ, λ and s is therefore −s² cos λ. The eye adds −e f to the
    /// derivative by φ, and this vector is in the plane of the other two derivatives. So a surface
    /// has the same area per film area as in a panorama whose rays all start at one point, at the
    /// distance s. [`Mapping::density`] needs no term for the eye.
    pub fn start_towards(&self, to: Vec3) -> Option<Vec3> {
        let [x, z, e] = [to.x, to.z, self.eye].map(f64::from);
        let squared = x * x + z * z;
        let l = (squared > e * e).then(|| (squared - e * e).sqrt())?;
        let [sin, cos] = [(x * l - z * e) / squared, (z * l + x * e) / squared];
        Some(Vec3::new((e * cos) as f32, 0.0, (-e * sin) as f32))
    }
}

impl Mapping for Panorama {
    fn ray(&self, film: Vec2, [right, up, forward]: Axes) -> (Vec3, Vec3) {
        let latitude = (0.5 - film.y / self.size.y) * PI;
        let (sin, cos) = (film.x * self.scale - self.middle).sin_cos();
        let level = sin * right + cos * forward;
        let start = if self.eye == 0.0 {
            Vec3::ZERO
        } else {
            self.eye * (cos * right - sin * forward)
        };
        (start, latitude.cos() * level + latitude.sin() * up)
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        if self.eye == 0.0 {
            return self.place_of_direction(to);
        }
        // The ray to the point is a tangent of the circle on which the eye moves
        let squared = to.x * to.x + to.z * to.z - self.eye * self.eye;
        let level = (squared > 0.0).then_some(squared)?.sqrt();
        let longitude = to.x.atan2(to.z) - self.eye.atan2(level);
        let turns = (longitude / TAU).round();
        Some(Vec2::new(
            (longitude - TAU * turns) / self.scale + 0.5 * self.size.x,
            (0.5 - to.y.atan2(level) / PI) * self.size.y,
        ))
    }

    fn place_of_direction(&self, to: Vec3) -> Option<Vec2> {
        let latitude = to.y.atan2(to.x.hypot(to.z));
        let film = Vec2::new(to.x.atan2(to.z) / self.scale, (0.5 - latitude / PI) * self.size.y);
        (to != Vec3::ZERO).then_some(film + Vec2::new(0.5 * self.size.x, 0.0))
    }

    fn density(&self, to: Vec3) -> f32 {
        self.size.y / (self.scale * PI * to.x.hypot(to.z))
    }
}
