//! Projections: the ray of a film point.
//!
//! Film coordinates are pixels from the top left corner. The camera's axes are right, up and
//! forward. Each projection has a file, and implements [`Mapping`]. [`Film`] is a projection for an
//! image of a given size.

mod calibrated;
mod cubemap;
mod fisheye;
mod orthographic;
mod panorama;
mod perspective;

pub use calibrated::{Distortion, Intrinsics};
pub(super) use cubemap::{CubeLayout, FACE_FOV, Face};
pub use cubemap::{FACE_NAMES, cube_faces};
pub use fisheye::FisheyeMapping;

use super::CameraError;
use crate::math::{DVec2, UVec2, Vec2, Vec3, encode_variants};
use calibrated::CalibratedLens;
use fisheye::Fisheye;
use orthographic::Orthographic;
use panorama::Panorama;
use perspective::Perspective;

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

/// Axes right, up and forward of a camera.
type Axes = [Vec3; 3];

/// Mapping between film points and rays, for an image of a given size.
trait Mapping {
    /// Returns the origin and the direction of the ray through `film`. The origin is relative to
    /// the position of the camera. For a projection onto a plane, the direction has depth 1. For
    /// other projections, the direction is a unit vector.
    fn ray(&self, film: Vec2, axes: Axes) -> (Vec3, Vec3);

    /// Film point of the point `to` relative to the camera, in coordinates along right, up and
    /// forward; `None` if no film point shows the point.
    fn place(&self, to: Vec3) -> Option<Vec2>;

    /// Film point of the direction `to`, in coordinates along right, up and forward. `None` if no
    /// film point has the direction.
    fn place_of_direction(&self, to: Vec3) -> Option<Vec2> {
        self.place(to)
    }

    /// Returns true if the point `film` belongs to the picture.
    fn sees(&self, _film: Vec2) -> bool {
        true
    }

    /// Density of film points per solid angle in the unit direction `to`, if there is one film
    /// point per pixel. `to` has coordinates along right, up and forward. The result is 0 for
    /// projections onto a plane.
    fn density(&self, _to: Vec3) -> f32 {
        0.0
    }

    /// Plane of the projection; `None` if the projection is not onto a plane, or if a lens distorts
    /// the picture.
    fn plane(&self) -> Option<Plane> {
        None
    }

    /// Screen window of an image of `size` pixels; `None` if there is no [`Mapping::plane`].
    fn screen_window(&self, _size: Vec2) -> Option<ScreenWindow> {
        None
    }
}

/// Rectangle of a picture on the plane of its projection. For a perspective the plane is at
/// distance 1, and for parallel rays it is in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenWindow {
    /// Middle of the rectangle, relative to the view axis, x right and y up.
    pub center: [f32; 2],
    /// Width of the rectangle.
    pub width: f32,
}

/// A projection onto a plane. A point (x, y) of camera space has the pixel coordinates `scale * (x,
/// -y) / w + middle`, where w is the depth for a perspective and 1 for parallel rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub scale: DVec2,
    pub middle: DVec2,
    pub is_parallel: bool,
}

/// Linear mapping between film points and points of a plane, y downwards.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaneScale {
    /// Width of a pixel on the plane.
    pub scale: f32,
    /// Position of the view axis on the film in the units of `scale`. The film point `p` is at `p ·
    /// scale − offset` from the axis.
    offset: Vec2,
}

impl PlaneScale {
    /// Mapping for an image of `size` pixels. `shift` is in picture heights, y up. Returns an error
    /// if the shift is not finite.
    fn new(scale: f32, shift: Vec2, size: Vec2) -> Result<Self, CameraError> {
        if !shift.is_finite() {
            let message = format!("must be finite numbers, not {shift}");
            return Err(CameraError::wrong("shift", message));
        }
        let shift = Vec2::new(-shift.x, shift.y) * size.y;
        let offset = scale * (0.5 * size + shift);
        Ok(Self { scale, offset })
    }

    /// Point of the plane at `film`.
    #[inline]
    fn point(&self, film: Vec2) -> Vec2 {
        film * self.scale - self.offset
    }

    /// Film point of a `point` of the plane.
    pub fn film(&self, point: Vec2) -> Vec2 {
        (point + self.offset) / self.scale
    }

    fn window(&self, size: Vec2) -> ScreenWindow {
        let center = self.scale * (0.5 * size) - self.offset;
        ScreenWindow {
            center: [center.x, 0.0 - center.y],
            width: self.scale * size.x,
        }
    }

    fn plane(&self, is_parallel: bool) -> Plane {
        let scale = f64::from(self.scale).recip();
        Plane {
            scale: DVec2::splat(scale),
            middle: self.offset.as_dvec2() * scale,
            is_parallel,
        }
    }
}

/// A projection for an image of a given size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    pub map: FilmMap,
    /// Width of a pixel. For a perspective, it is measured on the plane at distance 1; for parallel
    /// rays, in scene units; for all others, in radians at the middle of the picture.
    pub scale: f32,
}

/// Mapping of each kind of projection.
#[derive(Clone, Copy, Debug)]
pub(super) enum FilmMap {
    Perspective(Perspective),
    Orthographic(Orthographic),
    Panorama(Panorama),
    Fisheye(Fisheye),
    Calibrated(CalibratedLens),
    Cubemap(CubeLayout),
}

impl Film {
    /// Film of `projection`. Only a perspective uses `vertical_fov`, in degrees.
    pub fn new(projection: Projection, vertical_fov: f32, resolution: UVec2) -> Result<Self, CameraError> {
        let size = resolution.as_vec2();
        let map = match projection {
            Projection::Perspective { shift } => FilmMap::Perspective(Perspective::new(vertical_fov, shift, size)?),
            Projection::Orthographic { height, shift } => {
                FilmMap::Orthographic(Orthographic::new(height, shift, size)?)
            }
            Projection::Panorama => FilmMap::Panorama(Panorama::new(size)),
            Projection::Fisheye { mapping, fov } => FilmMap::Fisheye(Fisheye::new(mapping, fov, size)?),
            Projection::Calibrated { intrinsics, distortion } => {
                FilmMap::Calibrated(CalibratedLens::new(intrinsics, distortion, resolution)?)
            }
            Projection::Cubemap => FilmMap::Cubemap(CubeLayout::new(resolution)?),
        };
        let scale = match &map {
            FilmMap::Perspective(perspective) => perspective.0.scale,
            FilmMap::Orthographic(parallel) => parallel.0.scale,
            FilmMap::Panorama(panorama) => panorama.scale,
            FilmMap::Fisheye(fisheye) => fisheye.scale,
            FilmMap::Calibrated(lens) => lens.scale(),
            FilmMap::Cubemap(cube) => cube.scale(),
        };
        Ok(Self { map, scale })
    }

    fn mapping(&self) -> &dyn Mapping {
        match &self.map {
            FilmMap::Perspective(perspective) => perspective,
            FilmMap::Orthographic(parallel) => parallel,
            FilmMap::Panorama(panorama) => panorama,
            FilmMap::Fisheye(fisheye) => fisheye,
            FilmMap::Calibrated(lens) => lens,
            FilmMap::Cubemap(cube) => cube,
        }
    }

    /// The film of an eye of a stereo panorama, which moves on a circle with the radius `eye`.
    /// `None` if the projection is not a panorama.
    pub fn with_eye(self, eye: f32) -> Option<Self> {
        let FilmMap::Panorama(mut panorama) = self.map else {
            return None;
        };
        panorama.eye = eye;
        let map = FilmMap::Panorama(panorama);
        Some(Self { map, ..self })
    }

    /// Panorama of an eye of a stereo panorama; `None` for other films.
    pub fn panorama_of_eye(&self) -> Option<&Panorama> {
        match &self.map {
            FilmMap::Panorama(panorama) if panorama.eye != 0.0 => Some(panorama),
            _ => None,
        }
    }

    /// Returns true if film points beyond the borders have directions that the picture already
    /// shows.
    pub fn repeats(&self) -> bool {
        matches!(self.map, FilmMap::Panorama(_))
    }

    /// Returns true if all rays are parallel.
    pub fn is_parallel(&self) -> bool {
        matches!(self.map, FilmMap::Orthographic(_))
    }

    /// Returns true if the projection is not onto a plane. Depths are then distances along the
    /// rays.
    pub fn is_curved(&self) -> bool {
        match &self.map {
            FilmMap::Perspective(_) | FilmMap::Orthographic(_) => false,
            FilmMap::Panorama(_) | FilmMap::Fisheye(_) | FilmMap::Cubemap(_) => true,
            FilmMap::Calibrated(lens) => lens.is_fisheye(),
        }
    }

    /// Plane of the projection; `None` if the projection is not onto a plane, or if a lens distorts
    /// the picture.
    pub fn plane(&self) -> Option<Plane> {
        self.mapping().plane()
    }

    /// Screen window of an image of `resolution` pixels; `None` if there is no [`Film::plane`].
    pub fn screen_window(&self, resolution: UVec2) -> Option<ScreenWindow> {
        self.mapping().screen_window(resolution.as_vec2())
    }

    /// Returns true if the point `film` belongs to the picture.
    #[inline]
    pub fn sees(&self, film: Vec2) -> bool {
        match &self.map {
            FilmMap::Perspective(_) => true,
            _ => self.mapping().sees(film),
        }
    }

    /// Returns the origin and the direction of the ray through `film`, for a camera with the axes
    /// right, up and forward. The origin is relative to the position of the camera. For a
    /// projection onto a plane, the direction has depth 1. For other projections, the direction is
    /// a unit vector.
    #[inline]
    pub fn ray(&self, film: Vec2, axes: Axes) -> (Vec3, Vec3) {
        if let FilmMap::Perspective(perspective) = &self.map {
            return (Vec3::ZERO, perspective.direction(film, axes));
        }
        self.ray_of_any(film, axes)
    }

    /// [`Film::ray`] for every projection. It is not inlined, so that perspectives stay fast.
    #[inline(never)]
    fn ray_of_any(&self, film: Vec2, axes: Axes) -> (Vec3, Vec3) {
        self.mapping().ray(film, axes)
    }

    /// Density of film points per solid angle in the unit direction `to`, if there is one film
    /// point per pixel. `to` has coordinates along right, up and forward. The result is 0 for
    /// projections onto a plane.
    pub fn density(&self, to: Vec3) -> f32 {
        self.mapping().density(to)
    }

    /// Film position of the direction `to`, in coordinates along right, up and forward. `None` if
    /// no film position has the direction.
    pub fn place_of_direction(&self, to: Vec3) -> Option<Vec2> {
        self.mapping().place_of_direction(to)
    }

    /// Film position of the point `to` relative to the camera, in coordinates along right, up and
    /// forward; `None` if no film position shows the point.
    pub fn place(&self, to: Vec3) -> Option<Vec2> {
        self.mapping().place(to)
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
                fov: if mapping == FisheyeMapping::Orthographic {
                    180.0
                } else {
                    300.0
                },
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
        let eyes = [-0.3, 0.3].map(|eye| film(Projection::Panorama).with_eye(eye).unwrap());
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
