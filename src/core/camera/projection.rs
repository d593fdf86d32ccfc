//! Projections: the ray of a film point.
//!
//! Film coordinates are pixels from the top left corner. The camera's axes are right, up and
//! forward.

use super::CameraError;
use super::attributes::Plane;
use super::calibration::{CalibratedLens, Distortion, Intrinsics};
use super::cubemap::{CubeLayout, FACE_FOV};
use crate::math::{DVec2, UVec2, Vec2, Vec3, encode_variants};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Projection of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Central projection onto a plane.
    Perspective {
        /// Shift of the picture plane in picture heights, y up. Unlike a tilt of the camera, a
        /// shift keeps vertical lines vertical in the picture.
        shift: Vec2,
    },
    /// Parallel projection: all rays have the direction of the view axis.
    Orthographic {
        /// Height of the picture in scene units.
        height: f32,
        /// Shift of the picture in picture heights, y up.
        shift: Vec2,
    },
    /// All directions: longitude horizontally, latitude vertically (equirectangular). The view axis
    /// is in the middle.
    Panorama,
    /// A circle around the view axis. Pixels outside are black.
    Fisheye {
        /// Mapping from the angle between a ray and the view axis to the distance from the middle
        /// of the circle.
        mapping: FisheyeMapping,
        /// Angle across the circle in degrees; the circle's diameter is the height of the picture.
        fov: f32,
    },
    /// A calibrated camera: a pinhole or a fisheye, depending on its distortion.
    Calibrated {
        /// Focal lengths and principal point.
        intrinsics: Intrinsics,
        /// Model and coefficients of the lens.
        distortion: Distortion,
    },
    /// All directions on the six faces of a cube, each a perspective of 90 degrees. The faces are
    /// in a row, a column or two rows, in the order right, left, up, down, front, back.
    Cubemap,
}

encode_variants!(Projection {
    0 => Perspective { shift },
    1 => Orthographic { height, shift },
    2 => Panorama,
    3 => Fisheye { mapping, fov },
    4 => Calibrated { intrinsics, distortion },
    5 => Cubemap,
});

impl Default for Projection {
    fn default() -> Self {
        Self::Perspective { shift: Vec2::ZERO }
    }
}

/// Name of a [`Projection`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProjectionKind {
    /// [`Projection::Perspective`].
    #[default]
    Perspective,
    /// [`Projection::Orthographic`].
    Orthographic,
    /// [`Projection::Panorama`].
    Panorama,
    /// [`Projection::Cubemap`].
    Cubemap,
    /// [`Projection::Fisheye`].
    Fisheye,
}

impl ProjectionKind {
    /// Names that users type.
    pub const NAMES: &[(&str, Self)] = &[
        ("perspective", Self::Perspective),
        ("orthographic", Self::Orthographic),
        ("panorama", Self::Panorama),
        ("cubemap", Self::Cubemap),
        ("fisheye", Self::Fisheye),
    ];
}

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

/// A projection for an image of a given size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    projection: Projection,
    /// Width of a pixel. For a perspective, it is measured on the plane at distance 1; for parallel
    /// rays, in scene units; for all others, in radians at the middle of the picture.
    pub scale: f32,
    /// Position of the view axis on the film in the units of `scale`, y downwards. The film point
    /// `p` is at `p · scale − offset` from the axis.
    pub offset: Vec2,
    /// Size of the image in pixels.
    size: Vec2,
    /// Lens of a calibrated camera.
    pub lens: Option<CalibratedLens>,
    /// Positions of the faces of a cube map.
    pub cube: Option<CubeLayout>,
    /// Radius of the circle on which an eye of a stereo panorama moves: positive for the right eye,
    /// negative for the left eye. 0 if all rays have one origin.
    pub eye: f32,
}

impl Film {
    /// Film of `projection`. Only a perspective uses `vertical_fov`, in degrees.
    pub fn new(projection: Projection, vertical_fov: f32, resolution: UVec2) -> Result<Self, CameraError> {
        let size = resolution.as_vec2();
        let lens = match projection {
            Projection::Calibrated { intrinsics, distortion } => {
                Some(CalibratedLens::new(intrinsics, distortion, resolution)?)
            }
            _ => None,
        };
        let cube = match projection {
            Projection::Cubemap => {
                let refused = || {
                    let (width, height) = (resolution.x, resolution.y);
                    let message = format!(
                        "`cubemap` needs a picture that six squares fill in a row, in a column, or in two rows, not {width}x{height} pixels"
                    );
                    let help = format!("use --size with one of {}", CubeLayout::sizes(resolution));
                    CameraError::no_place("projection", message, help)
                };
                Some(CubeLayout::of(resolution).ok_or_else(refused)?)
            }
            _ => None,
        };
        let scale = match projection {
            // The height of the image plane at distance 1 is 2 tan(fov/2).
            Projection::Perspective { .. } => 2.0 * (0.5 * vertical_fov.to_radians()).tan() / size.y,
            Projection::Orthographic { height, .. } => {
                if !(height > 0.0 && height.is_finite()) {
                    return Err(CameraError::not_positive("ortho_height", height));
                }
                height / size.y
            }
            Projection::Panorama => TAU / size.x,
            Projection::Fisheye { mapping, fov } => {
                if !(fov > 0.0 && fov <= mapping.max_fov()) {
                    let message = format!("must lie above 0 and be at most {}, not {fov}", mapping.max_fov());
                    return Err(CameraError::wrong("fisheye_fov", message));
                }
                2.0 * mapping.radius(0.5 * fov.to_radians()) / size.y
            }
            Projection::Calibrated { .. } => lens.as_ref().map_or(1.0, CalibratedLens::scale),
            Projection::Cubemap => {
                let side = cube.map_or(size.y, |cube| cube.side as f32);
                2.0 * (0.5 * FACE_FOV.to_radians()).tan() / side
            }
        };
        let shift = match projection {
            Projection::Perspective { shift } | Projection::Orthographic { shift, .. } => shift,
            _ => Vec2::ZERO,
        };
        if !shift.is_finite() {
            return Err(CameraError::wrong(
                "shift",
                format!("must be finite numbers, not {shift}"),
            ));
        }
        let shift = Vec2::new(-shift.x, shift.y) * size.y;
        Ok(Self {
            projection,
            scale,
            offset: scale * (0.5 * size + shift),
            size,
            lens,
            cube,
            eye: 0.0,
        })
    }

    /// Returns true if film points beyond the borders have directions that the picture already
    /// shows.
    pub fn repeats(&self) -> bool {
        matches!(self.projection, Projection::Panorama)
    }

    /// Returns true if all rays are parallel.
    pub fn is_parallel(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// Returns true if the projection is not onto a plane. Depths are then distances along the
    /// rays.
    pub fn is_curved(&self) -> bool {
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => false,
            Projection::Panorama | Projection::Fisheye { .. } | Projection::Cubemap => true,
            Projection::Calibrated { distortion, .. } => matches!(distortion, Distortion::Fisheye(_)),
        }
    }

    /// Plane of the projection; `None` if the projection is not onto a plane, or if a lens distorts
    /// the picture.
    pub fn plane(&self) -> Option<Plane> {
        let is_parallel = self.is_parallel();
        let plane = |scale, middle| Plane {
            scale,
            middle,
            is_parallel,
        };
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => {
                let scale = f64::from(self.scale).recip();
                Some(plane(DVec2::splat(scale), self.offset.as_dvec2() * scale))
            }
            Projection::Panorama | Projection::Fisheye { .. } | Projection::Cubemap => None,
            Projection::Calibrated { .. } => {
                let (focal, center) = self.lens.as_ref()?.undistorted()?;
                Some(plane(focal, center))
            }
        }
    }

    /// Returns true if the point `film` belongs to the picture.
    #[inline]
    pub fn sees(&self, film: Vec2) -> bool {
        match self.projection {
            Projection::Fisheye { mapping, fov } => {
                (film * self.scale - self.offset).length() <= mapping.radius(0.5 * fov.to_radians())
            }
            Projection::Calibrated { .. } => self.lens.as_ref().is_none_or(|lens| lens.sees(film)),
            _ => true,
        }
    }

    /// Returns the origin and the direction of the ray through `film`, for a camera with the axes
    /// right, up and forward. The origin is relative to the position of the camera. For a
    /// projection onto a plane, the direction has depth 1. For other projections, the direction is
    /// a unit vector.
    #[inline]
    pub fn ray(&self, film: Vec2, [right, up, forward]: [Vec3; 3]) -> (Vec3, Vec3) {
        if let Projection::Perspective { .. } = self.projection {
            let image = film * self.scale - self.offset;
            return (Vec3::ZERO, image.x * right - image.y * up + forward);
        }
        self.ray_of_any(film, [right, up, forward])
    }

    /// [`Film::ray`] for every projection. It is not inlined, so that perspectives stay fast.
    #[inline(never)]
    fn ray_of_any(&self, film: Vec2, [right, up, forward]: [Vec3; 3]) -> (Vec3, Vec3) {
        let image = film * self.scale - self.offset;
        match self.projection {
            Projection::Perspective { .. } => (Vec3::ZERO, image.x * right - image.y * up + forward),
            Projection::Orthographic { .. } => (image.x * right - image.y * up, forward),
            Projection::Panorama => {
                let latitude = (0.5 - film.y / self.size.y) * PI;
                let (sin, cos) = image.x.sin_cos();
                let level = sin * right + cos * forward;
                let place = if self.eye == 0.0 {
                    Vec3::ZERO
                } else {
                    self.eye * (cos * right - sin * forward)
                };
                (place, latitude.cos() * level + latitude.sin() * up)
            }
            Projection::Fisheye { mapping, .. } => {
                let radius = image.length();
                if radius == 0.0 {
                    return (Vec3::ZERO, forward);
                }
                let (sin, cos) = mapping.angle(radius).sin_cos();
                let across = (image.x * right - image.y * up) / radius;
                (Vec3::ZERO, sin * across + cos * forward)
            }
            Projection::Calibrated { .. } => match &self.lens {
                Some(lens) if lens.is_fisheye() => {
                    let (angle, across) = lens.angle(film);
                    let (sin, cos) = angle.sin_cos();
                    let across = across.x * right - across.y * up;
                    (Vec3::ZERO, sin * across + cos * forward)
                }
                Some(lens) => {
                    let point = lens.plane_point(film);
                    (Vec3::ZERO, point.x * right - point.y * up + forward)
                }
                None => (Vec3::ZERO, forward),
            },
            Projection::Cubemap => match &self.cube {
                Some(cube) => {
                    let (face, image) = cube.at(film);
                    let [right, up, forward] = face.axes([right, up, forward]);
                    let to = image.x * right - image.y * up + forward;
                    (Vec3::ZERO, to.normalize())
                }
                None => (Vec3::ZERO, forward),
            },
        }
    }

    /// Density of film points per solid angle in the unit direction `to`, if there is one film
    /// point per pixel. `to` has coordinates along right, up and forward. The result is 0 for
    /// projections onto a plane.
    pub fn density(&self, to: Vec3) -> f32 {
        match self.projection {
            Projection::Perspective { .. } | Projection::Orthographic { .. } => 0.0,
            Projection::Panorama => self.size.y / (self.scale * PI * to.x.hypot(to.z)),
            Projection::Fisheye { mapping, .. } => {
                let sin = to.x.hypot(to.y);
                mapping.stretch(sin.atan2(to.z), sin) / (self.scale * self.scale)
            }
            Projection::Calibrated { .. } => {
                let sin = to.x.hypot(to.y);
                let lens = self.lens.as_ref().filter(|lens| lens.is_fisheye());
                lens.map_or(0.0, |lens| lens.density(sin.atan2(to.z), sin))
            }
            Projection::Cubemap => (self.scale * self.scale * to.abs().max_element().powi(3)).recip(),
        }
    }

    /// Film position of the direction `to`, in coordinates along right, up and forward. `None` if
    /// no film position has the direction.
    pub fn place_of_direction(&self, to: Vec3) -> Option<Vec2> {
        Self { eye: 0.0, ..*self }.place(to)
    }

    /// Film position of the point `to` relative to the camera, in coordinates along right, up and
    /// forward; `None` if no film position shows the point.
    pub fn place(&self, to: Vec3) -> Option<Vec2> {
        let plane = Vec2::new(to.x, -to.y);
        let image = match self.projection {
            Projection::Perspective { .. } => (to.z > 0.0).then(|| plane / to.z)?,
            Projection::Orthographic { .. } => (to.z > 0.0).then_some(plane)?,
            Projection::Panorama if self.eye != 0.0 => {
                // The ray to the point is a tangent of the circle on which the eye moves.
                let squared = to.x * to.x + to.z * to.z - self.eye * self.eye;
                let level = (squared > 0.0).then_some(squared)?.sqrt();
                let longitude = to.x.atan2(to.z) - self.eye.atan2(level);
                let turns = (longitude / TAU).round();
                let film = Vec2::new(
                    (longitude - TAU * turns) / self.scale + 0.5 * self.size.x,
                    (0.5 - to.y.atan2(level) / PI) * self.size.y,
                );
                return Some(film);
            }
            Projection::Panorama => {
                let latitude = to.y.atan2(to.x.hypot(to.z));
                let film = Vec2::new(to.x.atan2(to.z) / self.scale, (0.5 - latitude / PI) * self.size.y);
                return (to != Vec3::ZERO).then_some(film + Vec2::new(0.5 * self.size.x, 0.0));
            }
            Projection::Fisheye { mapping, .. } => {
                let across = plane.length();
                let angle = across.atan2(to.z);
                let is_beyond = mapping == FisheyeMapping::Orthographic && angle > FRAC_PI_2;
                if to == Vec3::ZERO || is_beyond {
                    return None;
                }
                let radius = mapping.radius(angle);
                if across > 0.0 {
                    plane * (radius / across)
                } else {
                    Vec2::ZERO
                }
            }
            Projection::Calibrated { .. } => {
                let lens = self.lens.as_ref()?;
                if lens.is_fisheye() {
                    let angle = plane.length().atan2(to.z);
                    return (to != Vec3::ZERO).then(|| lens.angle_film(angle, plane.normalize_or_zero()))?;
                }
                let point = (to.z > 0.0).then(|| plane / to.z)?;
                return lens.plane_film(point).map(|(film, _)| film);
            }
            Projection::Cubemap => return self.cube.as_ref()?.place(to),
        };
        Some((image + self.offset) / self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

    fn all() -> Vec<Film> {
        let shift = Vec2::new(0.25, -0.5);
        let mut all = vec![
            Projection::Perspective { shift },
            Projection::Orthographic { height: 3.0, shift },
            Projection::Panorama,
        ];
        let cube = Film::new(Projection::Cubemap, 70.0, UVec2::new(72, 48)).unwrap();
        for &(_, mapping) in FisheyeMapping::NAMES {
            all.push(Projection::Fisheye {
                mapping,
                fov: mapping.max_fov().min(300.0),
            });
        }
        let intrinsics = Intrinsics {
            focal: [50.0, 45.0],
            center: [30.0, 27.0],
        };
        for distortion in [
            Distortion::Pinhole([-0.1, 0.02, 0.003, -0.004, 0.01]),
            Distortion::Fisheye([0.05, -0.02, 0.01, 0.002]),
        ] {
            all.push(Projection::Calibrated { intrinsics, distortion });
        }
        let film = |projection| Film::new(projection, 70.0, UVec2::new(64, 48)).unwrap();
        let eyes = [-0.3, 0.3].map(|eye| Film {
            eye,
            ..film(Projection::Panorama)
        });
        let plain = all.into_iter().map(film);
        plain.chain(eyes).chain([cube]).collect()
    }

    /// The film position of the ray of a film point is this film point.
    #[test]
    fn film_positions_match_rays() {
        for film in all() {
            for point in [[0.5, 0.5], [31.0, 17.0], [32.0, 24.0], [63.5, 47.5], [20.0, 40.0]].map(Vec2::from) {
                if !film.sees(point) {
                    continue;
                }
                let (origin, direction) = film.ray(point, AXES);
                let back = film.place(origin + 2.5 * direction).unwrap();
                assert!(back.distance(point) < 2e-3, "{film:?}: {point} becomes {back}");
            }
        }
    }

    #[test]
    fn directions_worked_out_by_hand() {
        let film = |projection| Film::new(projection, 90.0, UVec2::new(200, 100)).unwrap();
        let towards = |film: &Film, x, y| film.ray(Vec2::new(x, y), AXES).1;
        let panorama = film(Projection::Panorama);
        assert!(towards(&panorama, 100.0, 50.0).distance(Vec3::Z) < 1e-6);
        assert!(towards(&panorama, 150.0, 50.0).distance(Vec3::X) < 1e-6);
        assert!(towards(&panorama, 0.0, 50.0).distance(Vec3::NEG_Z) < 1e-6);
        assert!(towards(&panorama, 30.0, 0.0).distance(Vec3::Y) < 1e-6);
        let fisheye = film(Projection::Fisheye {
            mapping: FisheyeMapping::Equidistant,
            fov: 360.0,
        });
        // A quarter of the height is 90° from the axis.
        assert!(towards(&fisheye, 125.0, 50.0).distance(Vec3::X) < 1e-6);
        assert!(towards(&fisheye, 100.0, 25.0).distance(Vec3::Y) < 1e-6);
        assert!(fisheye.sees(Vec2::new(149.0, 50.0)) && !fisheye.sees(Vec2::new(151.0, 50.0)));
        // The shift is half a picture height to the right, and up.
        let shifted = film(Projection::Perspective {
            shift: Vec2::new(0.5, 0.5),
        });
        assert!(towards(&shifted, 100.0, 50.0).distance(Vec3::new(1.0, 1.0, 1.0)) < 1e-6);
        let parallel = film(Projection::Orthographic {
            height: 4.0,
            shift: Vec2::ZERO,
        });
        assert_eq!(
            parallel.ray(Vec2::new(150.0, 25.0), AXES),
            (Vec3::new(2.0, 1.0, 0.0), Vec3::Z)
        );
    }
}
