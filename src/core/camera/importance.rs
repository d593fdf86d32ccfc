//! Importance of pixels along rays from the lens, for paths from lights.

use super::Camera;
use super::projection::Film;
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
        if self.has_lens() {
            camera.position + camera.on_lens(u)
        } else {
            camera.position
        }
    }

    /// Area of the lens, in squares of scene units; 1 for a pinhole, whose point is a delta.
    pub fn lens_area(&self) -> f32 {
        if self.has_lens() {
            self.aperture.map_or(PI, |aperture| aperture.area()) * self.lens_radius * self.lens_radius
        } else {
            1.0
        }
    }

    /// Unit direction of view at `time`.
    pub fn forward(&self, time: f32) -> Vec3 {
        self.at(time).forward
    }

    /// How a pixel sees along the ray from the lens point `p` in the unit direction `w` out into the scene, at `time`: the inverse of
    /// [`Camera::ray`]. `None` behind the camera, and for other projections than a perspective.
    pub fn importance(&self, p: Vec3, w: Vec3, time: f32) -> Option<Importance> {
        let camera = self.at(time);
        let cos = w.dot(camera.forward);
        // The ray meets the plane of focus where that through the centre of the lens does, which is the film's.
        let mut image = Vec2::new(w.dot(camera.right), -w.dot(camera.up)) / cos;
        if camera.has_lens() {
            let lens = p - camera.position;
            image += Vec2::new(lens.dot(camera.right), -lens.dot(camera.up)) / camera.focus_distance;
        }
        let Film { scale, offset, .. } = camera.film;
        let pdf = 1.0 / (scale * scale * cos * cos * cos);
        let film = (image + offset) / scale;
        let we = pdf / (cos * self.lens_area());
        // Along the lens, both are beyond what numbers hold.
        (self.is_perspective() && cos > 0.0 && we.is_finite() && film.is_finite()).then_some(Importance {
            film,
            we,
            pdf,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Aperture, CameraMotion, CameraParameters, Pose};
    use crate::math::{Frame, UVec2};
    use crate::sampler::{Dimension, Independent, SampleKey, Sampler};
    use crate::sampling::warp::{uniform_cone, uniform_cone_pdf};

    /// A pinhole, a lens, one with five blades, and a lens that moves, with images of `resolution`.
    fn cameras(resolution: UVec2) -> [Camera; 4] {
        let pinhole = CameraParameters {
            position: Vec3::new(1.0, 2.0, 3.0),
            look_at: Vec3::new(-2.0, 1.5, -7.0),
            up: Vec3::new(0.1, 1.0, 0.0),
            vertical_fov: 55.0,
            lens_radius: 0.0,
            focus_distance: 4.0,
        };
        let lens = CameraParameters {
            lens_radius: 0.3,
            ..pinhole
        };
        let blades = Aperture {
            blades: 5,
            rotation: 10.0,
        };
        let close = Pose {
            position: Vec3::new(2.0, 2.0, 1.0),
            look_at: Vec3::new(3.0, 2.5, -5.0),
            up: Vec3::new(0.3, 1.0, 0.0),
        };
        let motion = CameraMotion {
            close: Some(close),
            shutter: [0.0, 1.0],
        };
        [
            Camera::new(pinhole, resolution).unwrap(),
            Camera::new(lens, resolution).unwrap(),
            (Camera::new(lens, resolution).and_then(|camera| camera.with_aperture(blades))).unwrap(),
            Camera::moving(lens, motion, resolution).unwrap(),
        ]
    }

    /// Four pairs of numbers.
    fn numbers(index: u32) -> [Vec2; 4] {
        let mut sampler = Independent::new(5);
        sampler.start(SampleKey::new(0, 0, index));
        [0, 1, 2, 3].map(|i| sampler.get_2d(Dimension::PIXEL.nth(i)))
    }

    #[test]
    fn importance_is_the_inverse_of_rays() {
        let size = UVec2::new(200, 100);
        for camera in cameras(size) {
            for i in 0..2000 {
                let [place, lens, other, _] = numbers(i);
                // Outside of the image too
                let film = (1.5 * place - 0.25) * size.as_vec2();
                let time = other.x;
                let ray = camera.ray(film, lens, time);
                assert_eq!(camera.lens_point(lens, time), ray.origin);
                let seen = camera.importance(ray.origin, ray.direction, time).unwrap();
                assert!(seen.film.distance(film) < 1e-3, "{film} {seen:?}");
                let cos = ray.direction.dot(camera.forward(time));
                assert!((seen.we * cos * camera.lens_area() / seen.pdf - 1.0).abs() < 1e-6);
                assert_eq!(camera.importance(ray.origin, -ray.direction, time), None);
                // The solid angle of a part of a pixel, by the directions of its edges
                let edge = |step: Vec2| {
                    let [a, b] = [-step, step].map(|s| camera.ray(film + s, lens, time).direction.as_dvec3());
                    b - a
                };
                let solid_angle = edge(Vec2::new(0.5, 0.0)).cross(edge(Vec2::new(0.0, 0.5))).length();
                assert!((seen.pdf as f64 * solid_angle - 1.0).abs() < 1e-3, "{film} {seen:?}");
            }
            let time = 0.5;
            let then = camera.at(time);
            let behind = (then.right - 1e-6 * then.forward).normalize();
            let lens = camera.lens_point(Vec2::ZERO, time);
            assert_eq!(camera.importance(lens, behind, time), None);
        }
    }

    /// Over lens and directions, what a pixel sees of a world of radiance 1 is 1; an image of few pixels shows what the angles to the axis do.
    #[test]
    fn a_pixel_sees_one() {
        const N: u32 = 200_000;
        let size = UVec2::new(4, 3);
        for camera in cameras(size) {
            let time = 0.7;
            for pixel in [Vec2::ZERO, Vec2::new(2.0, 1.0), Vec2::new(3.0, 2.0)] {
                let to = |film: Vec2| camera.ray(film, Vec2::splat(0.5), time).direction;
                let axis = to(pixel + 0.5);
                // Directions from all of the lens: its radius, seen from the plane of focus, is less than 0.1.
                let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|c| to(pixel + c).dot(axis));
                let cos_cone = (corners.into_iter().fold(1.0, f32::min).acos() + 0.1).cos();
                let frame = Frame::from_z(axis);
                let (mut sum, mut squares) = (0.0, 0.0);
                for i in 0..N {
                    let [u, lens, ..] = numbers(i);
                    let w = frame.to_world(uniform_cone(u, cos_cone));
                    let p = camera.lens_point(lens, time);
                    let seen = camera.importance(p, w, time).unwrap();
                    let within = seen.film - pixel;
                    if within.cmpge(Vec2::ZERO).all() && within.cmplt(Vec2::ONE).all() {
                        let cos = w.dot(camera.forward(time));
                        let value = (seen.we * cos * camera.lens_area() / uniform_cone_pdf(cos_cone)) as f64;
                        sum += value;
                        squares += value * value;
                    }
                }
                let mean = sum / N as f64;
                let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
                assert!(
                    (mean - 1.0).abs() < 4.0 * error && error < 0.01,
                    "{pixel}: {mean} ± {error}"
                );
            }
        }
    }
}
