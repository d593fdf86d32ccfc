//! Fisheyes: a circle around the view axis.

use super::{Axes, Mapping};
use crate::camera::CameraError;
use crate::math::{Vec2, Vec3, encode_variants};
use std::f32::consts::FRAC_PI_2;

/// Mapping of a fisheye from the angle θ between a ray and the view axis to the distance r from the
/// middle of the circle. The unit of r is the focal length.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FisheyeMapping {
    /// r = θ.
    #[default]
    Equidistant,
    /// r = 2 sin(θ/2): equal areas are equal solid angles.
    Equisolid,
    /// r = 2 tan(θ/2): small circles stay circles.
    Stereographic,
    /// r = sin θ; up to 180°.
    Orthographic,
}

encode_variants!(FisheyeMapping {
    0 => Equidistant,
    1 => Equisolid,
    2 => Stereographic,
    3 => Orthographic,
});

impl FisheyeMapping {
    /// Names that users type.
    pub const NAMES: &[(&str, Self)] = &[
        ("equidistant", Self::Equidistant),
        ("equisolid", Self::Equisolid),
        ("stereographic", Self::Stereographic),
        ("orthographic", Self::Orthographic),
    ];

    fn radius(self, angle: f32) -> f32 {
        match self {
            Self::Equidistant => angle,
            Self::Equisolid => 2.0 * (0.5 * angle).sin(),
            Self::Stereographic => 2.0 * (0.5 * angle).tan(),
            Self::Orthographic => angle.sin(),
        }
    }

    fn angle(self, radius: f32) -> f32 {
        match self {
            Self::Equidistant => radius,
            Self::Equisolid => 2.0 * (0.5 * radius).min(1.0).asin(),
            Self::Stereographic => 2.0 * (0.5 * radius).atan(),
            Self::Orthographic => radius.min(1.0).asin(),
        }
    }

    /// Area of the picture per solid angle, `r r' / sin θ`, in squares of the focal length. `angle`
    /// is the angle θ to the axis, and `sin` is the sine of θ.
    fn stretch(self, angle: f32, sin: f32) -> f32 {
        match self {
            Self::Equidistant if sin == 0.0 => 1.0,
            Self::Equidistant => angle / sin,
            Self::Equisolid => 1.0,
            Self::Stereographic => (0.5 * angle).cos().powi(-4),
            Self::Orthographic => angle.cos(),
        }
    }

    /// Maximum angle across the circle in degrees.
    fn max_fov(self) -> f32 {
        match self {
            Self::Equidistant | Self::Equisolid => 360.0,
            Self::Stereographic => 350.0,
            Self::Orthographic => 180.0,
        }
    }
}

/// A fisheye for an image of a given size.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct Fisheye {
    mapping: FisheyeMapping,
    /// Angle across the circle in degrees.
    fov: f32,
    /// Width of a pixel in focal lengths, which is the width in radians in the middle.
    pub scale: f32,
    /// Middle of the circle, in the units of `scale` from the upper left corner.
    middle: Vec2,
}

impl Fisheye {
    /// Fisheye for an image of `size` pixels. `fov` is the angle across the circle in degrees.
    pub fn new(mapping: FisheyeMapping, fov: f32, size: Vec2) -> Result<Self, CameraError> {
        if !(fov > 0.0 && fov <= mapping.max_fov()) {
            let message = format!("must lie above 0 and be at most {}, not {fov}", mapping.max_fov());
            return Err(CameraError::wrong("fisheye_fov", message));
        }
        let scale = 2.0 * mapping.radius(0.5 * fov.to_radians()) / size.y;
        Ok(Self {
            mapping,
            fov,
            scale,
            middle: scale * (0.5 * size),
        })
    }
}

impl Mapping for Fisheye {
    fn ray(&self, film: Vec2, [right, up, forward]: Axes) -> (Vec3, Vec3) {
        let image = film * self.scale - self.middle;
        let radius = image.length();
        if radius == 0.0 {
            return (Vec3::ZERO, forward);
        }
        let (sin, cos) = self.mapping.angle(radius).sin_cos();
        let across = (image.x * right - image.y * up) / radius;
        (Vec3::ZERO, sin * across + cos * forward)
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        let plane = Vec2::new(to.x, -to.y);
        let across = plane.length();
        let angle = across.atan2(to.z);
        let is_beyond = self.mapping == FisheyeMapping::Orthographic && angle > FRAC_PI_2;
        if to == Vec3::ZERO || is_beyond {
            return None;
        }
        let radius = self.mapping.radius(angle);
        let image = if across > 0.0 {
            plane * (radius / across)
        } else {
            Vec2::ZERO
        };
        Some((image + self.middle) / self.scale)
    }

    fn sees(&self, film: Vec2) -> bool {
        (film * self.scale - self.middle).length() <= self.mapping.radius(0.5 * self.fov.to_radians())
    }

    fn density(&self, to: Vec3) -> f32 {
        let sin = to.x.hypot(to.y);
        self.mapping.stretch(sin.atan2(to.z), sin) / (self.scale * self.scale)
    }
}
