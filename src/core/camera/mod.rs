//! The camera. It maps a point on the film and a point on the lens to a ray. The module
//! `importance` has the inverse, for light paths that reach the lens.

mod aperture;
mod attributes;
mod description;
mod error;
mod importance;
mod projection;
mod stereo;
mod views;

pub use aperture::{Aperture, BLADES};
pub use attributes::{CameraAttributes, Matrix};
pub use description::{CameraDescription, CameraMotion, CameraParameters, Pose};
pub use error::CameraError;
pub use importance::{Importance, LensKind, LensPoint};
pub use projection::{
    Distortion, FACE_NAMES, FisheyeMapping, Intrinsics, Projection, ProjectionKind, ScreenWindow, cube_faces,
};
pub use stereo::{Stereo, StereoLayout};
pub use views::View;

use crate::math::{Ray, UVec2, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;
use projection::{Face, Film};
use std::borrow::Cow;

/// A camera of any projection. Its rays pass through a pinhole, or through an ideal thin lens if
/// the radius of the lens is positive.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    film: Film,
    resolution: UVec2,
    lens_radius: f32,
    /// Shape of the lens's opening; `None` for a disk.
    aperture: Option<Aperture>,
    focus_distance: f32,
    /// Poses at the times 0 and 1.
    path: Option<[Pose; 2]>,
    /// Times of shutter open and close.
    shutter: [f32; 2],
    /// Face of a cube map towards which the camera looks.
    face: Face,
    /// For an eye of a stereo perspective: offset of this eye along the axis `right` from the
    /// middle between the eyes, in scene units. For other cameras 0. `position` includes this
    /// offset.
    eye: f32,
}

impl Camera {
    /// Camera for an image of `resolution` pixels. Returns an error if a parameter is out of range.
    pub fn new(parameters: CameraParameters, resolution: UVec2) -> Result<Self, CameraError> {
        let c = parameters;
        let error = |parameter, message: &str| {
            Err(CameraError {
                parameter,
                message: message.into(),
                help: None,
            })
        };
        for (parameter, v) in [("position", c.position), ("look_at", c.look_at), ("up", c.up)] {
            if !v.is_finite() {
                return error(parameter, &format!("must be finite numbers, not {v}"));
            }
        }
        if !(c.vertical_fov > 0.0 && c.vertical_fov < 180.0) {
            let message = format!("must lie between 0 and 180 degrees, not {}", c.vertical_fov);
            return error("vertical_fov", &message);
        }
        if !(c.lens_radius >= 0.0 && c.lens_radius.is_finite()) {
            return error("lens_radius", &format!("must be 0 or more, not {}", c.lens_radius));
        }
        if !(c.focus_distance > 0.0 && c.focus_distance.is_finite()) {
            return Err(CameraError::not_positive("focus_distance", c.focus_distance));
        }
        let Some(forward) = (c.look_at - c.position).try_normalize() else {
            return error("look_at", "must not be the camera's position");
        };
        let right = c.up.try_normalize().and_then(|up| forward.cross(up).try_normalize());
        let Some(right) = right else {
            return error("up", "must not be zero or parallel to the view direction");
        };
        let up = right.cross(forward);

        Ok(Self {
            position: c.position,
            right,
            up,
            forward,
            film: Film::new(Projection::default(), c.vertical_fov, resolution)?,
            resolution,
            lens_radius: c.lens_radius,
            aperture: None,
            focus_distance: c.focus_distance,
            path: None,
            shutter: [0.0, 1.0],
            face: Face::Front,
            eye: 0.0,
        })
    }

    /// Moving camera with `parameters` at time 0. Returns an error if the motion is invalid.
    pub fn moving(parameters: CameraParameters, motion: CameraMotion, resolution: UVec2) -> Result<Self, CameraError> {
        let mut camera = Self::new(parameters, resolution)?;
        let [open, close] = motion.shutter;
        if !(0.0 <= open && open <= close && close <= 1.0) {
            return Err(CameraError {
                parameter: "shutter",
                message: format!("must be two times from 0 to 1, the opening first, not {open} and {close}"),
                help: None,
            });
        }
        camera.shutter = motion.shutter;
        if let Some(last) = motion.close {
            let first = Pose {
                position: parameters.position,
                look_at: parameters.look_at,
                up: parameters.up,
            };
            // Check the pose at several times.
            const PLACES: u32 = 64;
            let places = (0..=PLACES).map(|i| i as f32 / PLACES as f32);
            for place in places {
                if first.lerp(&last, place).axes().is_none() {
                    return Err(CameraError {
                        parameter: "close",
                        message: format!(
                            "pose cannot be reached: at time {place} the camera would look along `up`, or `position` would be `look_at`"
                        ),
                        help: Some("change `position_close`, `look_at_close` or `up_close`".into()),
                    });
                }
            }
            camera.path = Some([first, last]);
        }
        Ok(camera)
    }

    /// The camera with a different aperture. Returns an error if the aperture is invalid.
    pub fn with_aperture(self, aperture: Aperture) -> Result<Self, CameraError> {
        aperture.check()?;
        Ok(Self {
            aperture: Some(aperture),
            ..self
        })
    }

    /// The camera with a different projection. Returns an error if the projection is invalid.
    pub fn with_projection(self, projection: Projection, vertical_fov: f32) -> Result<Self, CameraError> {
        let film = Film::new(projection, vertical_fov, self.resolution)?;
        if film.is_curved() && self.lens_radius > 0.0 {
            let message = format!(
                "must be 0, not {}: panoramas, cubemaps and fisheyes have no lens",
                self.lens_radius
            );
            return Err(CameraError::wrong("lens_radius", message));
        }
        Ok(Self { film, ..self })
    }

    /// Returns true if film points beyond the borders have directions that the picture already
    /// shows, as in panoramas.
    pub fn repeats(&self) -> bool {
        self.film.repeats()
    }

    /// Returns true if the point `film` belongs to the picture. Points outside the circle of a
    /// fisheye do not.
    #[inline]
    pub fn sees(&self, film: Vec2) -> bool {
        self.film.sees(film)
    }

    /// Columns and rows of the image.
    pub fn resolution(&self) -> UVec2 {
        self.resolution
    }

    /// Returns true if the camera moves while the shutter is open.
    pub fn is_moving(&self) -> bool {
        self.path.is_some()
    }

    /// Time for `u` in [0, 1), uniform between shutter open and close.
    pub fn time(&self, u: f32) -> f32 {
        let [open, close] = self.shutter;
        open + u * (close - open)
    }

    /// Fraction of the shutter interval that has passed at `time`, 0 to 1; 0 if the interval is
    /// empty.
    pub fn share_of_shutter(&self, time: f32) -> f32 {
        let [open, close] = self.shutter;
        let share = (time - open) / (close - open);
        if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 }
    }

    /// Still camera with the pose at `time`: this camera itself, if it does not move.
    #[inline]
    fn at(&self, time: f32) -> Cow<'_, Self> {
        match self.path {
            None => Cow::Borrowed(self),
            Some(path) => self.moved(path, time),
        }
    }

    /// Still camera with the pose at `time` of a camera that moves along `path`.
    fn moved(&self, [first, last]: [Pose; 2], time: f32) -> Cow<'_, Self> {
        let pose = first.lerp(&last, time);
        match pose.axes() {
            None => Cow::Borrowed(self),
            Some(axes) => {
                let [right, up, forward] = self.face.axes(axes);
                let position = if self.eye == 0.0 {
                    pose.position
                } else {
                    pose.position + self.eye * right
                };
                Cow::Owned(Self {
                    position,
                    right,
                    up,
                    forward,
                    path: None,
                    ..*self
                })
            }
        }
    }

    /// Returns this camera, turned to a face of a cube map. This camera must face the front.
    fn turned(self, face: Face) -> Self {
        let [right, up, forward] = face.axes([self.right, self.up, self.forward]);
        Self {
            right,
            up,
            forward,
            face,
            ..self
        }
    }

    /// Returns this camera as one eye of a pair, moved by `eye` along the axis `right`. In a
    /// panorama, the eye moves on a circle with the radius `eye`. The function must not be called
    /// for a camera that is already an eye.
    fn with_eye(self, eye: f32) -> Self {
        if let Some(film) = self.film.with_eye(eye) {
            return Self { film, ..self };
        }
        Self {
            position: self.position + eye * self.right,
            eye,
            ..self
        }
    }

    /// Ray through `film` (pixels; origin top left, pixel centres at .5) from the lens point
    /// sampled with `u_lens`, at `time`.
    ///
    /// All rays of one film point meet in the plane of focus. The direction is a unit vector.
    // ANCHOR: ray
    #[inline]
    pub fn ray(&self, film: Vec2, u_lens: Vec2, time: f32) -> Ray {
        if self.is_moving() {
            self.at(time).ray_of_still(film, u_lens, time)
        } else {
            self.ray_of_still(film, u_lens, time)
        }
    }

    #[inline]
    fn ray_of_still(&self, film: Vec2, u_lens: Vec2, time: f32) -> Ray {
        // `through_center` is the direction through the centre of the lens. If the projection is
        // onto a plane, this direction has depth 1.
        let (place, through_center) = self.film.ray(film, [self.right, self.up, self.forward]);
        if self.lens_radius == 0.0 {
            return Ray::new(self.position + place, through_center.normalize()).when(time);
        }
        // All rays of this film point meet in one point of the plane of focus.
        let lens = self.on_lens(u_lens);
        let to_focus = self.focus_distance * through_center - lens;
        Ray::new(self.position + place + lens, to_focus.normalize()).when(time)
    }
    // ANCHOR_END: ray

    /// Lens point sampled with `u`, relative to the centre.
    fn on_lens(&self, u: Vec2) -> Vec3 {
        let opening = match &self.aperture {
            None => uniform_disk(u),
            Some(aperture) => aperture.sample(u),
        };
        let lens = self.lens_radius * opening;
        lens.x * self.right + lens.y * self.up
    }

    /// Position at `time`: the centre of the lens.
    pub fn position(&self, time: f32) -> Vec3 {
        self.at(time).position
    }

    /// Direction from the camera to `p` at `time`, not normalised. For parallel rays, the direction
    /// of the rays.
    pub fn view_of(&self, p: Vec3, time: f32) -> Vec3 {
        let camera = self.at(time);
        if camera.film.is_parallel() {
            return camera.forward;
        }
        p - camera.position
    }

    /// Width of a pixel in scene units, for a surface as far from the camera as `p` at `time`.
    pub fn pixel_width(&self, p: Vec3, time: f32) -> f32 {
        if self.film.is_parallel() {
            return self.film.scale;
        }
        self.film.scale * p.distance(self.at(time).position)
    }

    /// Width of a pixel in scene units at distance 1: the amount by which the width grows per scene
    /// unit of distance. 0 for parallel rays.
    pub fn pixel_width_by_distance(&self) -> f32 {
        if self.film.is_parallel() { 0.0 } else { self.film.scale }
    }

    /// Returns true if the camera has a lens with a positive radius.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Film position of `p` at `time`, through the centre of the lens: pixels, origin top left.
    /// `None` behind the camera.
    pub fn film_of(&self, p: Vec3, time: f32) -> Option<Vec2> {
        let camera = self.at(time);
        let to = p - camera.position;
        let to = Vec3::new(to.dot(camera.right), to.dot(camera.up), to.dot(camera.forward));
        camera.film.place(to)
    }

    /// Times of shutter open and close.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    /// Depth of `p` at `time`: the distance from the camera along the view axis. For panoramas,
    /// cube maps and fisheyes, it is the distance along the ray. The
    /// [views](CameraDescription::views) of a cube map are perspectives, whose view axis is the
    /// axis of their face.
    pub fn depth(&self, p: Vec3, time: f32) -> f32 {
        let camera = self.at(time);
        if camera.film.is_curved() {
            let Some(panorama) = camera.film.panorama_of_eye() else {
                return p.distance(camera.position);
            };
            let squared = p.distance_squared(camera.position) - panorama.eye * panorama.eye;
            return squared.max(0.0).sqrt();
        }
        (p - camera.position).dot(camera.forward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> CameraParameters {
        CameraParameters {
            position: Vec3::new(1.0, 2.0, 3.0),
            look_at: Vec3::new(1.0, 2.0, -7.0),
            up: Vec3::Y,
            vertical_fov: 90.0,
            lens_radius: 0.0,
            focus_distance: 4.0,
        }
    }

    #[test]
    fn image_axes() {
        let camera = Camera::new(parameters(), UVec2::new(200, 100)).unwrap();
        let towards = |x, y| camera.ray(Vec2::new(x, y), Vec2::ZERO, 0.0).direction;
        assert!(towards(100.0, 50.0).distance(Vec3::NEG_Z) < 1e-6);
        // At the top edge, the direction is 45° up. At the right edge, x is twice as large as y at
        // the top edge.
        assert!(towards(100.0, 0.0).distance(Vec3::new(0.0, 1.0, -1.0).normalize()) < 1e-6);
        assert!(towards(200.0, 50.0).distance(Vec3::new(2.0, 0.0, -1.0).normalize()) < 1e-6);
    }

    #[test]
    fn lens_rays_meet_in_the_plane_of_focus() {
        let p = CameraParameters {
            lens_radius: 0.5,
            ..parameters()
        };
        let camera = Camera::new(p, UVec2::new(200, 100)).unwrap();
        let pinhole = Camera::new(parameters(), UVec2::new(200, 100)).unwrap();
        let film = Vec2::new(31.0, 77.5);
        let center = pinhole.ray(film, Vec2::ZERO, 0.0);
        let focus = center.origin + center.direction * (4.0 / -center.direction.z);
        for u in [Vec2::new(0.1, 0.9), Vec2::new(0.7, 0.3), Vec2::ZERO] {
            let ray = camera.ray(film, u, 0.0);
            assert!(ray.origin.distance(p.position) <= 0.5 + 1e-6);
            let at = ray.origin + ray.direction * (4.0 / -ray.direction.z);
            assert!(at.distance(focus) < 1e-5, "{at} {focus}");
        }
    }

    /// At each time, a moving camera equals a still camera with the pose at this time.
    #[test]
    fn moving_camera_equals_a_still_camera_at_each_time() {
        let p = CameraParameters {
            lens_radius: 0.2,
            ..parameters()
        };
        let close = Pose {
            position: Vec3::new(2.0, 2.0, 1.0),
            look_at: Vec3::new(3.0, 2.5, -5.0),
            up: Vec3::new(0.3, 1.0, 0.0),
        };
        let motion = CameraMotion {
            close: Some(close),
            shutter: [0.25, 0.75],
        };
        let moving = Camera::moving(p, motion, UVec2::new(200, 100)).unwrap();
        assert_eq!((moving.time(0.0), moving.time(0.5)), (0.25, 0.5));
        for time in [0.0, 0.3, 1.0] {
            let still = CameraParameters {
                position: p.position.lerp(close.position, time),
                look_at: p.look_at.lerp(close.look_at, time),
                up: p.up.lerp(close.up, time),
                ..p
            };
            let still = Camera::new(still, UVec2::new(200, 100)).unwrap();
            let (film, lens) = (Vec2::new(31.0, 77.5), Vec2::new(0.1, 0.9));
            let [a, b] = [moving.ray(film, lens, time), still.ray(film, lens, time)];
            assert!(
                a.origin.distance(b.origin) < 1e-5 && a.direction.distance(b.direction) < 1e-5,
                "{a:?} {b:?}"
            );
            let q = Vec3::new(4.0, -3.0, -8.0);
            assert!((moving.depth(q, time) - still.depth(q, time)).abs() < 1e-4);
        }
        // Invalid motions: through the `look_at` point, or with a shutter that closes before it
        // opens
        let through = Pose {
            position: Vec3::new(1.0, 2.0, -17.0),
            ..close
        };
        let bad = [
            CameraMotion {
                close: Some(Pose {
                    look_at: p.look_at,
                    ..through
                }),
                ..motion
            },
            CameraMotion {
                shutter: [0.5, 0.4],
                ..motion
            },
            CameraMotion {
                shutter: [f32::NAN, 1.0],
                ..motion
            },
        ];
        for motion in bad {
            assert!(Camera::moving(p, motion, UVec2::new(8, 8)).is_err(), "{motion:?}");
        }
    }

    #[test]
    fn invalid_cameras_are_errors() {
        let bad = [
            CameraParameters {
                look_at: parameters().position,
                ..parameters()
            },
            CameraParameters {
                up: Vec3::Z,
                ..parameters()
            },
            CameraParameters {
                up: Vec3::ZERO,
                ..parameters()
            },
            CameraParameters {
                vertical_fov: 180.0,
                ..parameters()
            },
            CameraParameters {
                vertical_fov: f32::NAN,
                ..parameters()
            },
            CameraParameters {
                lens_radius: -1.0,
                ..parameters()
            },
            CameraParameters {
                focus_distance: 0.0,
                ..parameters()
            },
            CameraParameters {
                position: Vec3::NAN,
                ..parameters()
            },
        ];
        for p in bad {
            assert!(Camera::new(p, UVec2::new(8, 8)).is_err(), "{p:?}");
        }
    }
}
