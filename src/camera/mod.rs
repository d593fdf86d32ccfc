//! From a point on the film and a point on the lens to a ray.

use crate::math::{Ray, UVec2, Vec2, Vec3};
use crate::sampling::warp::uniform_disk;
use thiserror::Error;

/// A perspective camera: a pinhole, or an ideal thin lens when its radius is positive.
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    position: Vec3,
    right: Vec3,
    up: Vec3,
    forward: Vec3,
    /// From pixel coordinates to the plane at distance 1: `(x, y) → x · scale − offset`, y downwards.
    scale: f32,
    offset: Vec2,
    lens_radius: f32,
    focus_distance: f32,
}

/// What a camera is made from. Lengths are scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraParameters {
    /// Centre of the lens.
    pub position: Vec3,
    /// The point in the middle of the image.
    pub look_at: Vec3,
    /// A direction that is up in the image; not parallel to the view axis.
    pub up: Vec3,
    /// Vertical field of view in degrees, inside (0, 180).
    pub vertical_fov: f32,
    /// Radius of the lens; 0 for a pinhole.
    pub lens_radius: f32,
    /// Distance from the lens, along the view axis, to the plane in focus.
    pub focus_distance: f32,
}

/// A camera parameter that no camera can have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("camera {parameter} {message}")]
pub struct CameraError {
    /// The field of [`CameraParameters`].
    pub parameter: &'static str,
    message: String,
}

impl Camera {
    /// A camera for an image of `resolution` pixels.
    ///
    /// A parameter that no camera can have is an error.
    pub fn new(parameters: CameraParameters, resolution: UVec2) -> Result<Self, CameraError> {
        let c = parameters;
        let error = |parameter, message: &str| {
            Err(CameraError {
                parameter,
                message: message.into(),
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
            return error("focus_distance", &format!("must be positive, not {}", c.focus_distance));
        }
        let Some(forward) = (c.look_at - c.position).try_normalize() else {
            return error("look_at", "must not be the camera's position");
        };
        let right = c.up.try_normalize().and_then(|up| forward.cross(up).try_normalize());
        let Some(right) = right else {
            return error("up", "must not be zero or parallel to the view direction");
        };
        let up = right.cross(forward);

        // The image plane at distance 1 is 2 tan(fov/2) high.
        let (width, height) = (resolution.x as f32, resolution.y as f32);
        let scale = 2.0 * (0.5 * c.vertical_fov.to_radians()).tan() / height;
        Ok(Self {
            position: c.position,
            right,
            up,
            forward,
            scale,
            offset: 0.5 * scale * Vec2::new(width, height),
            lens_radius: c.lens_radius,
            focus_distance: c.focus_distance,
        })
    }

    /// The ray through `film` (pixels; origin top left, pixel centres at .5) from the lens point drawn with `u_lens`.
    ///
    /// All rays of one film point meet in the plane of focus. The direction is a unit vector.
    pub fn ray(&self, film: Vec2, u_lens: Vec2) -> Ray {
        // Direction through the centre of the lens, with depth 1 along the axis.
        let image = film * self.scale - self.offset;
        let through_center = image.x * self.right - image.y * self.up + self.forward;
        if self.lens_radius == 0.0 {
            return Ray::new(self.position, through_center.normalize());
        }
        // The point in focus is common to all lens points.
        let lens = self.lens_radius * uniform_disk(u_lens);
        let lens = lens.x * self.right + lens.y * self.up;
        let to_focus = self.focus_distance * through_center - lens;
        Ray::new(self.position + lens, to_focus.normalize())
    }

    /// Width of a pixel at the distance of `p`, scene units.
    pub fn pixel_width(&self, p: Vec3) -> f32 {
        self.scale * p.distance(self.position)
    }

    /// Whether rays start from more than a single point.
    pub fn has_lens(&self) -> bool {
        self.lens_radius > 0.0
    }

    /// Distance of `p` from the camera along the view axis.
    pub fn depth(&self, p: Vec3) -> f32 {
        (p - self.position).dot(self.forward)
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
        let towards = |x, y| camera.ray(Vec2::new(x, y), Vec2::ZERO).direction;
        assert!(towards(100.0, 50.0).distance(Vec3::NEG_Z) < 1e-6);
        // Top edge: 45° up. Right edge: twice as far in x.
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
        let center = pinhole.ray(film, Vec2::ZERO);
        let focus = center.origin + center.direction * (4.0 / -center.direction.z);
        for u in [Vec2::new(0.1, 0.9), Vec2::new(0.7, 0.3), Vec2::ZERO] {
            let ray = camera.ray(film, u);
            assert!(ray.origin.distance(p.position) <= 0.5 + 1e-6);
            let at = ray.origin + ray.direction * (4.0 / -ray.direction.z);
            assert!(at.distance(focus) < 1e-5, "{at} {focus}");
        }
    }

    #[test]
    fn impossible_cameras_are_refused() {
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
