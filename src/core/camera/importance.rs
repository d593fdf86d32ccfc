//! Importance of pixels along rays from the lens, for paths from lights.

use super::Camera;
use super::projection::{FilmMap, PlaneScale};
use crate::math::{Ray, Vec2, Vec3};
use std::f32::consts::PI;

/// Importance of a pixel along a ray from the lens. It is the weight in the pixel of the light that
/// arrives along the ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Importance {
    /// Film position in pixels, origin top left. It may lie outside the image.
    pub film: Vec2,
    /// Importance for a pixel with the box filter, per area of the lens and solid angle, m⁻²·sr⁻¹.
    /// The weight of the ray's radiance in the pixel's value is this importance times cos θ, where
    /// θ is the angle with [`LensPoint::normal`]. For a lens of area A the importance is `pdf /
    /// (cos θ A)`. For a perspective with pixels of width s at distance 1 it is `1 / (s² cos⁴ θ A)`
    /// (Pharr, Jakob and Humphreys 2016, §16.1.1, where the whole film is one pixel).
    pub we: f32,
    /// Density of the ray's direction per solid angle, if film points are uniform with a density of
    /// one per pixel: `1 / (s² cos³ θ)` for a perspective with pixels of width s at distance 1. For
    /// parallel rays, it is the density per area perpendicular to the rays: `1 / (s² cos θ)` for
    /// pixels of width s. Here θ is the angle of the ray with the view axis.
    ///
    /// For an eye of a stereo panorama, the start of a ray changes with its direction. The density
    /// is nevertheless the density of a panorama from one point, with the distance from the start
    /// of the ray.
    pub pdf: f32,
}

/// Kind of a lens, by the starts of the camera rays that hit a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LensKind {
    /// Each point of the lens has a ray to each point that the camera sees.
    Fixed,
    /// Parallel rays. The lens is infinitely distant: each point of the scene has a ray of its own,
    /// and all rays have one direction.
    Far,
    /// Circle of an eye of a stereo panorama. Each point of the scene has one ray, a tangent of the
    /// circle.
    Circle,
}

impl LensKind {
    /// Returns true if the start of a camera ray does not depend on the point that the ray hits.
    pub fn is_fixed(self) -> bool {
        self == Self::Fixed
    }
}

/// Point on the lens at which a path ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensPoint {
    /// Position in world space.
    pub p: Vec3,
    /// Unit normal of the lens for cosines: the view direction, or the direction of parallel rays.
    /// Zero for panoramas, cube maps and fisheyes, which use no cosine.
    pub normal: Vec3,
    /// Kind of the lens. With parallel rays, the point stands for a point of the lens, through
    /// which each film point has a ray. On a circle, the point is the centre of the circle until
    /// [`Camera::lens_facing`] moves it.
    pub kind: LensKind,
}

impl Camera {
    /// Samples a lens point at `time`, uniformly over the area of the lens. Returns the pinhole if
    /// there is no lens.
    pub fn lens_point(&self, u: Vec2, time: f32) -> LensPoint {
        let camera = self.at(time);
        let lens = if self.has_lens() { camera.on_lens(u) } else { Vec3::ZERO };
        let to_focus = || camera.focus_distance * camera.forward - lens;
        camera.lens_end(camera.position + lens, || to_focus().normalize())
    }

    /// Lens point from which the camera's `ray` starts.
    pub fn lens_of(&self, ray: &Ray) -> LensPoint {
        self.at(ray.time).lens_end(ray.origin, || ray.direction)
    }

    /// Lens point at `p`, for a camera that does not move. `direction` returns the direction of the
    /// rays. It is called only for parallel rays.
    fn lens_end(&self, p: Vec3, direction: impl FnOnce() -> Vec3) -> LensPoint {
        let (normal, kind) = if self.film.is_parallel() {
            (direction(), LensKind::Far)
        } else if self.film.panorama_of_eye().is_some() {
            (Vec3::ZERO, LensKind::Circle)
        } else if self.film.is_curved() {
            (Vec3::ZERO, LensKind::Fixed)
        } else {
            (self.forward, LensKind::Fixed)
        };
        LensPoint { p, normal, kind }
    }

    /// Returns the lens point from which `seen` is visible at `time`. For parallel rays, this is
    /// `lens` moved to the ray through `seen`, or `None` if `seen` is behind the camera. For an eye
    /// of a stereo panorama, it is the point of the circle whose ray hits `seen`, or `None` if
    /// `seen` is not farther from the axis than the eye. For other cameras, it is `lens`.
    pub fn lens_facing(&self, lens: LensPoint, seen: Vec3, time: f32) -> Option<LensPoint> {
        let p = match lens.kind {
            LensKind::Fixed => return Some(lens),
            LensKind::Far => {
                let forward = self.at(time).forward;
                let distance = (seen - lens.p).dot(forward) / lens.normal.dot(forward);
                (distance > 0.0).then(|| seen - distance * lens.normal)?
            }
            LensKind::Circle => {
                let camera = self.at(time);
                let to = seen - camera.position;
                let to = Vec3::new(to.dot(camera.right), to.dot(camera.up), to.dot(camera.forward));
                let start = camera.film.panorama_of_eye()?.start_towards(to)?;
                camera.position + start.x * camera.right + start.z * camera.forward
            }
        };
        Some(LensPoint { p, ..lens })
    }

    /// Area of the lens in squares of scene units; 1 for a pinhole, which is a delta distribution.
    pub fn lens_area(&self) -> f32 {
        if self.has_lens() {
            self.aperture.map_or(PI, |aperture| aperture.area()) * self.lens_radius * self.lens_radius
        } else {
            1.0
        }
    }

    /// Returns the film position and the importance of the ray that leaves the lens point `p` in
    /// the unit direction `w` at `time`. This is the inverse of [`Camera::ray`]. `None` if no film
    /// point has this ray: behind the camera, or outside the circle of a fisheye.
    pub fn importance(&self, p: Vec3, w: Vec3, time: f32) -> Option<Importance> {
        let camera = self.at(time);
        if camera.film.is_curved() {
            let to = Vec3::new(w.dot(camera.right), w.dot(camera.up), w.dot(camera.forward));
            let film = camera.film.place_of_direction(to).filter(|film| camera.sees(*film))?;
            let pdf = camera.film.density(to);
            return pdf.is_finite().then_some(Importance { film, we: pdf, pdf });
        }
        let cos = w.dot(camera.forward);
        let plane = |v: Vec3| Vec2::new(v.dot(camera.right), -v.dot(camera.up));
        // For a central projection, the ray from `p`, and the ray of the same film point through
        // the centre of the lens, cross in the plane of focus.
        let central = || {
            let mut image = plane(w) / cos;
            if camera.has_lens() {
                image += plane(p - camera.position) / camera.focus_distance;
            }
            image
        };
        let (film, pdf, over_cos) = match &camera.film.map {
            FilmMap::Orthographic(parallel) => {
                let PlaneScale { scale, .. } = parallel.0;
                let from_center = p - camera.position;
                // The position on the film follows from the point in which the ray crosses the
                // plane of focus.
                let image = if camera.has_lens() {
                    plane(from_center) + plane(w) * (camera.focus_distance / cos)
                } else {
                    plane(from_center)
                };
                (parallel.0.film(image), 1.0 / (scale * scale * cos), 1.0)
            }
            FilmMap::Perspective(perspective) => {
                let PlaneScale { scale, .. } = perspective.0;
                let pdf = 1.0 / (scale * scale * cos * cos * cos);
                (perspective.0.film(central()), pdf, cos)
            }
            FilmMap::Calibrated(lens) => {
                let (film, area) = lens.plane_film(central()).filter(|_| cos > 0.0)?;
                (film, area / (cos * cos * cos), cos)
            }
            FilmMap::Panorama(_) | FilmMap::Fisheye(_) | FilmMap::Cubemap(_) => return None,
        };
        let we = pdf / (over_cos * self.lens_area());
        // For directions in the plane of the lens, `we` and `film` overflow.
        (cos > 0.0 && we.is_finite() && film.is_finite()).then_some(Importance { film, we, pdf })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::projection::CubeLayout;
    use crate::camera::{
        Aperture, CameraDescription, CameraMotion, CameraParameters, FisheyeMapping, Pose, Projection,
    };
    use crate::math::{Frame, UVec2};
    use crate::sampler::{Dimension, Independent, SampleKey, Sampler};
    use crate::sampling::warp::{uniform_cone, uniform_cone_pdf, uniform_disk};

    /// Cameras of all projections with images of `resolution`: pinholes, a lens, a lens with five
    /// blades, and moving lenses.
    fn cameras(resolution: UVec2) -> Vec<Camera> {
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
        let motion = Some(CameraMotion {
            close: Some(close),
            shutter: [0.0, 1.0],
        });
        let shift = Vec2::new(0.25, -0.5);
        let fisheye = |fov| move |&(_, mapping): &_| Projection::Fisheye { mapping, fov };
        let perspective = Projection::default();
        let parallel = Projection::Orthographic { height: 4.0, shift };
        let mut all = vec![
            (pinhole, None, None, perspective),
            (lens, None, None, perspective),
            (lens, None, Some(blades), perspective),
            (lens, motion, None, perspective),
            (lens, motion, None, Projection::Perspective { shift }),
            (pinhole, None, None, parallel),
            (lens, None, Some(blades), parallel),
            (lens, motion, None, parallel),
            (pinhole, motion, None, Projection::Panorama),
        ];
        all.push((pinhole, motion, None, Projection::Cubemap));
        let fisheyes = FisheyeMapping::NAMES.iter().map(fisheye(170.0));
        let wide = FisheyeMapping::NAMES[..3].iter().map(fisheye(300.0));
        all.extend(
            fisheyes
                .chain(wide)
                .map(|projection| (pinhole, motion, None, projection)),
        );
        let camera = |(parameters, motion, aperture, projection)| {
            let description = CameraDescription {
                parameters,
                motion,
                aperture,
                projection,
                stereo: None,
            };
            // The picture of a cube map must consist of six squares
            let resolution = match projection {
                Projection::Cubemap => 2 * resolution.y / 3 * UVec2::new(3, 2),
                _ => resolution,
            };
            description.camera(resolution).unwrap()
        };
        let eyes = [-0.4, 0.4].map(|eye| camera((pinhole, motion, None, Projection::Panorama)).with_eye(eye));
        all.into_iter().map(camera).chain(eyes).collect()
    }

    /// Four pairs of random numbers.
    fn numbers(index: u32) -> [Vec2; 4] {
        let mut sampler = Independent::new(5);
        sampler.start(SampleKey::new(0, 0, index));
        [0, 1, 2, 3].map(|i| sampler.get_2d(Dimension::PIXEL.nth(i)))
    }

    #[test]
    fn importance_is_the_inverse_of_rays() {
        let size = UVec2::new(200, 100);
        for camera in cameras(size) {
            let is_flat = !camera.film.is_curved();
            for i in 0..2000 {
                let [place, lens, other, _] = numbers(i);
                // Test film points outside the image too, for projections onto a plane
                let margin = if is_flat { 0.25 } else { 0.0 };
                let film = ((1.0 + 2.0 * margin) * place - margin) * camera.resolution().as_vec2();
                let time = other.x;
                // The mapping from film points to directions has a kink at the border of two faces,
                // so skip film points there.
                let border = |cube: CubeLayout| {
                    let side = cube.side as f32;
                    let within = film - side * (film / side).floor();
                    within.min_element().min(side - within.max_element()) < 0.1
                };
                let is_border = matches!(camera.film.map, FilmMap::Cubemap(cube) if border(cube));
                if !camera.sees(film) || is_border {
                    continue;
                }
                let ray = camera.ray(film, lens, time);
                let end = camera.lens_of(&ray);
                let drawn = camera.lens_point(lens, time);
                assert_eq!((end.normal, end.kind), (drawn.normal, drawn.kind));
                assert_eq!(end.p, ray.origin);
                // For a point on the ray, the facing lens point is the start of the ray.
                let facing = camera.lens_facing(drawn, ray.at(7.0), time).unwrap();
                // Rays towards the zenith and the nadir are almost tangents of a cylinder, so the
                // starts of such rays are less exact
                let error = if end.kind == LensKind::Circle { 1e-3 } else { 1e-5 };
                assert!(facing.p.distance(ray.origin) < error, "{facing:?} {ray:?}");
                let is_far = end.kind == LensKind::Far;
                assert_eq!(camera.lens_facing(drawn, ray.at(-1.0), time).is_none(), is_far);
                let seen = camera.importance(ray.origin, ray.direction, time).unwrap();
                assert!(seen.film.distance(film) < 3e-3, "{camera:?}: {film} {seen:?}");
                let cos = if end.normal == Vec3::ZERO {
                    1.0
                } else {
                    ray.direction.dot(end.normal)
                };
                assert!((seen.we * cos * camera.lens_area() / seen.pdf - 1.0).abs() < 1e-6);
                if is_flat {
                    assert_eq!(camera.importance(ray.origin, -ray.direction, time), None);
                }
                // Compare the density with the solid angle of a square of the film, divided by the
                // area of the square. The solid angle follows from the directions of the edges of
                // the square. For parallel rays, use the area perpendicular to the rays instead.
                // The square is small for curved projections, because the mapping is strongly
                // curved near the rim of a fisheye.
                let half = if is_flat { 0.5 } else { 0.02 };
                let edge = |step: Vec2| {
                    let at = |s| camera.ray(film + s, lens, time);
                    let [a, b] = [-step, step].map(|s| {
                        if is_far {
                            at(s).origin.as_dvec3().reject_from(ray.direction.as_dvec3())
                        } else {
                            at(s).direction.as_dvec3()
                        }
                    });
                    b - a
                };
                let square = edge(Vec2::new(half, 0.0)).cross(edge(Vec2::new(0.0, half))).length();
                let size = square / f64::from(4.0 * half * half);
                // For curved projections, the directions of a square of the film do not lie in a
                // plane, so the test is less exact.
                let error = if is_flat { 1e-3 } else { 1e-2 };
                assert!(
                    (seen.pdf as f64 * size - 1.0).abs() < error,
                    "{camera:?}: {film} {seen:?}"
                );
            }
            if is_flat {
                let time = 0.5;
                let then = camera.at(time);
                let behind = (then.right - 1e-6 * then.forward).normalize();
                let lens = camera.lens_point(Vec2::ZERO, time);
                assert_eq!(camera.importance(lens.p, behind, time), None);
            }
        }
    }

    /// For an eye of a stereo panorama, compares the density per area of a surface with the area of
    /// a square of the film on the surface. The edges of the square follow from rays through the
    /// film, so the test includes the motion of the starts of rays.
    #[test]
    fn density_of_an_eye_is_the_area_of_the_film_on_a_surface() {
        let all = cameras(UVec2::new(200, 100));
        let eyes = all.iter().filter(|camera| camera.film.panorama_of_eye().is_some());
        assert_eq!(eyes.clone().count(), 2);
        for camera in eyes {
            for i in 0..2000 {
                let [place, turn, other, _] = numbers(i);
                let film = (place * 0.98 + 0.01) * camera.resolution().as_vec2();
                let time = other.x;
                // A plane through a point of the ray. The normal is at most 60° from the ray
                let ray = camera.ray(film, Vec2::ZERO, time);
                let seen = ray.at(0.3 + 4.0 * other.y);
                let normal = Frame::from_z(ray.direction)
                    .to_world(uniform_cone(turn, 0.5))
                    .as_dvec3();
                let on_plane = |step: Vec2| {
                    let ray = camera.ray(film + step, Vec2::ZERO, time);
                    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                    let distance = (seen.as_dvec3() - origin).dot(normal) / direction.dot(normal);
                    origin + distance * direction
                };
                let edge = |step: Vec2| on_plane(step) - on_plane(-step);
                let half = 0.02;
                let square = edge(Vec2::new(half, 0.0)).cross(edge(Vec2::new(0.0, half))).length();
                let area = square / f64::from(4.0 * half * half);
                let lens = camera
                    .lens_facing(camera.lens_point(Vec2::ZERO, time), seen, time)
                    .unwrap();
                let w = (seen - lens.p).normalize();
                let found = camera.importance(lens.p, w, time).unwrap();
                assert!(found.film.distance(film) < 3e-2, "{film} {found:?}");
                let cos = w.as_dvec3().dot(normal).abs();
                let density = f64::from(found.pdf) * cos / f64::from(seen.distance_squared(lens.p));
                assert!((density * area - 1.0).abs() < 1e-2, "{film}: {density} {area}");
            }
            // Points on the axis, and nearer to the axis than the eye, are not seen
            let then = camera.at(0.5);
            let lens = camera.lens_point(Vec2::ZERO, 0.5);
            for (x, z, is_seen) in [
                (0.0, 0.0, false),
                (0.2, -0.3, false),
                (0.3, 0.3, true),
                (0.0, -0.41, true),
            ] {
                let seen = then.position + x * then.right + 2.0 * then.up + z * then.forward;
                assert_eq!(camera.lens_facing(lens, seen, 0.5).is_some(), is_seen, "{x},{z}");
            }
        }
    }

    /// The integral of the importance of a pixel over the lens and over all directions is 1. The
    /// test image has few pixels, so that the angles to the axis are large.
    #[test]
    fn importance_of_a_pixel_integrates_to_one() {
        const N: u32 = 200_000;
        let size = UVec2::new(4, 3);
        for camera in cameras(size) {
            let time = 0.7;
            for pixel in [Vec2::ZERO, Vec2::new(2.0, 1.0), Vec2::new(3.0, 2.0)] {
                // Corners of a fisheye's picture have no rays.
                let corners = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|corner| pixel + corner);
                if !corners.into_iter().all(|film| camera.sees(film)) {
                    continue;
                }
                let to = |film: Vec2| camera.ray(film, Vec2::splat(0.5), time);
                let middle = to(pixel + 0.5);
                let is_far = camera.lens_of(&middle).kind == LensKind::Far;
                let axis = middle.direction;
                // Include the directions from the whole lens. Seen from the plane of focus, the
                // radius of the lens is an angle below 0.1.
                let cosines = corners.map(|corner| to(corner).direction.dot(axis));
                let angle = cosines.into_iter().fold(1.0, f32::min).acos() + 0.1;
                // The borders of pixels of panoramas and fisheyes are curved, so sample all
                // directions.
                let angle = if camera.film.is_curved() { PI } else { angle };
                let frame = Frame::from_z(axis);
                let across = corners.map(|corner| to(corner).origin.distance(middle.origin));
                let radius = across.into_iter().fold(0.0, f32::max) + 1.0;
                let (mut sum, mut squares) = (0.0, 0.0);
                for i in 0..N {
                    let [u, lens, ..] = numbers(i);
                    let lens = camera.lens_point(lens, time);
                    // For parallel rays, sample a position around the ray `middle`. For other rays,
                    // sample a direction
                    let (p, w, pdf) = if is_far {
                        let disk = radius * uniform_disk(u);
                        let frame = Frame::from_z(lens.normal);
                        let seen = middle.at(5.0) + frame.to_world(Vec3::new(disk.x, disk.y, 0.0));
                        (seen, lens.normal, 1.0 / (PI * radius * radius))
                    } else {
                        let w = frame.to_world(uniform_cone(u, angle.cos()));
                        (lens.p, w, uniform_cone_pdf(angle.cos()))
                    };
                    let faces = if is_far {
                        camera.lens_facing(lens, p + w, time)
                    } else {
                        Some(lens)
                    };
                    let Some(lens) = faces else { continue };
                    let Some(seen) = camera.importance(lens.p, w, time) else {
                        continue;
                    };
                    let within = seen.film - pixel;
                    if within.cmpge(Vec2::ZERO).all() && within.cmplt(Vec2::ONE).all() {
                        let cos = if lens.normal == Vec3::ZERO {
                            1.0
                        } else {
                            w.dot(lens.normal)
                        };
                        let value = (seen.we * cos * camera.lens_area() / pdf) as f64;
                        sum += value;
                        squares += value * value;
                    }
                }
                let mean = sum / N as f64;
                let error = ((squares / N as f64 - mean * mean) / N as f64).sqrt();
                assert!(
                    (mean - 1.0).abs() < 4.0 * error && error < 0.02,
                    "{camera:?}, {pixel}: {mean} ± {error}"
                );
            }
        }
    }
}
