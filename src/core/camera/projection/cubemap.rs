//! Cube maps: six perspectives of 90 degrees, laid out in one picture.
//!
//! Faces are in the order of OpenGL, Vulkan and Direct3D: +x, -x, +y, -y, +z, -z. These axes are
//! left-handed: x right, y up and z along the view axis (OpenGL 4.6 core profile, §8.13, table
//! 8.19). Each face is the picture that a viewer at the centre sees. For the faces up and down, the
//! viewer looks to the front and then tilts the head. The top edge of the face up is therefore
//! behind the viewer, and the top edge of the face down is in front.

use super::{Axes, Mapping};
use crate::camera::CameraError;
use crate::math::{UVec2, Vec2, Vec3};

/// Field of view of a face in degrees.
pub(in crate::camera) const FACE_FOV: f32 = 90.0;

/// Number of columns of faces in each layout: a row, a column, and two rows of three.
const COLUMNS: [u32; 3] = [6, 1, 3];

/// Names of the faces, in the order of the picture.
pub const FACE_NAMES: [&str; 6] = ["right", "left", "up", "down", "front", "back"];

/// Returns the side of a face in pixels, and the first pixel of each face, for a cube map of
/// `resolution` pixels. `None` if the picture does not consist of six squares.
pub fn cube_faces(resolution: UVec2) -> Option<(u32, [UVec2; 6])> {
    let layout = CubeLayout::of(resolution)?;
    Some((layout.side, std::array::from_fn(|index| layout.corner(index))))
}

/// A face of a cube map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::camera) enum Face {
    Right,
    Left,
    Up,
    Down,
    Front,
    Back,
}

impl Face {
    /// All faces, in the order of the picture.
    pub const ALL: [Self; 6] = [Self::Right, Self::Left, Self::Up, Self::Down, Self::Front, Self::Back];

    /// Axes right, up and forward of the face. `axes` are the same axes of the camera.
    pub fn axes(self, axes: [Vec3; 3]) -> [Vec3; 3] {
        let [right, up, forward] = axes;
        let turned = match self {
            Self::Right => [-forward, up, right],
            Self::Left => [forward, up, -right],
            Self::Up => [right, -forward, up],
            Self::Down => [right, forward, -up],
            Self::Front => return axes,
            Self::Back => [-right, up, -forward],
        };
        // Turn −0 into +0, so that the axes are bit-identical to the axes of a camera that looks in
        // this direction
        turned.map(|axis| axis + Vec3::ZERO)
    }

    /// Face that shows the direction `to`, in coordinates along right, up and forward.
    fn of(to: Vec3) -> Self {
        let size = to.abs();
        if size.z >= size.x && size.z >= size.y {
            if to.z > 0.0 { Self::Front } else { Self::Back }
        } else if size.x >= size.y {
            if to.x > 0.0 { Self::Right } else { Self::Left }
        } else if to.y > 0.0 {
            Self::Up
        } else {
            Self::Down
        }
    }
}

/// Positions of the six faces in a picture.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct CubeLayout {
    /// Width and height of a face in pixels.
    pub side: u32,
    columns: u32,
}

impl CubeLayout {
    /// Layout of a picture of `resolution` pixels; `None` if the picture does not consist of six
    /// squares.
    pub fn of(resolution: UVec2) -> Option<Self> {
        let layout = |columns: u32| {
            let side = resolution.x / columns;
            let size = UVec2::new(side * columns, side.checked_mul(6 / columns)?);
            (size == resolution).then_some(Self { side, columns })
        };
        COLUMNS.into_iter().find_map(layout)
    }

    /// Layout of a picture of `resolution` pixels. Returns an error if the picture does not consist
    /// of six squares.
    pub fn new(resolution: UVec2) -> Result<Self, CameraError> {
        let refused = || {
            let (width, height) = (resolution.x, resolution.y);
            let message = format!(
                "`cubemap` needs a picture that six squares fill in a row, in a column, or in two rows, not {width}x{height} pixels"
            );
            let help = format!("use --size with one of {}", Self::sizes(resolution));
            CameraError::no_place("projection", message, help)
        };
        Self::of(resolution).ok_or_else(refused)
    }

    /// Width of a pixel on the plane of its face at distance 1.
    pub fn scale(&self) -> f32 {
        2.0 * (0.5 * FACE_FOV.to_radians()).tan() / self.side as f32
    }

    /// Text for an error message: sizes of pictures that would be cube maps. The side of their
    /// faces is the shorter side of `resolution`.
    pub fn sizes(resolution: UVec2) -> String {
        let side = resolution.min_element().max(1);
        let sizes = COLUMNS.map(|columns| {
            let [width, height] = [columns, 6 / columns].map(|count| side.saturating_mul(count));
            format!("{width}x{height}")
        });
        sizes.join(", ")
    }

    /// First pixel of the face with index `index`.
    pub fn corner(&self, index: usize) -> UVec2 {
        self.side * UVec2::new(index as u32 % self.columns, index as u32 / self.columns)
    }

    /// Returns the face at the film point `film`, and the position of this point on the plane of
    /// the face at distance 1, y downwards. Points outside of the picture are on the plane of the
    /// nearest face.
    pub fn at(&self, film: Vec2) -> (Face, Vec2) {
        let side = self.side as f32;
        let last = UVec2::new(self.columns, 6 / self.columns).as_vec2() - 1.0;
        let cell = (film / side).floor().clamp(Vec2::ZERO, last);
        let index = cell.y as usize * self.columns as usize + cell.x as usize;
        let face = Face::ALL.get(index).copied().unwrap_or(Face::Front);
        (face, (film - side * cell) * (2.0 / side) - 1.0)
    }
}

impl Mapping for CubeLayout {
    fn ray(&self, film: Vec2, axes: Axes) -> (Vec3, Vec3) {
        let (face, image) = self.at(film);
        let [right, up, forward] = face.axes(axes);
        let to = image.x * right - image.y * up + forward;
        (Vec3::ZERO, to.normalize())
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        let face = Face::of(to);
        let [right, up, forward] = face.axes([Vec3::X, Vec3::Y, Vec3::Z]).map(|axis| axis.dot(to));
        let corner = self
            .corner(Face::ALL.iter().position(|other| *other == face)?)
            .as_vec2();
        let image = Vec2::new(right, -up) / forward;
        (forward > 0.0).then_some(corner + (image + 1.0) * (0.5 * self.side as f32))
    }

    fn density(&self, to: Vec3) -> f32 {
        let scale = self.scale();
        (scale * scale * to.abs().max_element().powi(3)).recip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layouts_are_six_squares() {
        let layout = |x, y| CubeLayout::of(UVec2::new(x, y)).map(|layout| (layout.side, layout.columns));
        assert_eq!(layout(60, 10), Some((10, 6)));
        assert_eq!(layout(10, 60), Some((10, 1)));
        assert_eq!(layout(30, 20), Some((10, 3)));
        for [x, y] in [[512, 512], [61, 10], [60, 11], [20, 30], [40, 30], [1, 1], [6, 2]] {
            assert_eq!(layout(x, y), None, "{x}x{y}");
        }
        assert_eq!(CubeLayout::sizes(UVec2::new(512, 640)), "3072x512, 512x3072, 1536x1024");
    }

    /// Pixels next to a common edge of two faces have directions next to each other. Points on the
    /// film are compared with the coordinates of the table 8.19 of OpenGL: the major axis, and the
    /// numerators of s and t.
    #[test]
    fn faces_have_the_orientation_of_opengl() {
        type Table = (Vec3, fn(Vec3) -> [f32; 2]);
        let table: [Table; 6] = [
            (Vec3::X, |r| [-r.z, -r.y]),
            (Vec3::NEG_X, |r| [r.z, -r.y]),
            (Vec3::Y, |r| [r.x, r.z]),
            (Vec3::NEG_Y, |r| [r.x, -r.z]),
            (Vec3::Z, |r| [r.x, -r.y]),
            (Vec3::NEG_Z, |r| [-r.x, -r.y]),
        ];
        let layout = CubeLayout::of(UVec2::new(600, 100)).unwrap();
        for (index, (major, st)) in table.into_iter().enumerate() {
            for image in [[0.3, -0.6], [-0.9, 0.1]].map(Vec2::from) {
                let film = layout.corner(index).as_vec2() + 50.0 * (image + 1.0);
                let (face, on_plane) = layout.at(film);
                assert!(on_plane.distance(image) < 1e-5, "{on_plane} {image}");
                let [right, up, forward] = face.axes([Vec3::X, Vec3::Y, Vec3::Z]);
                let to = image.x * right - image.y * up + forward;
                assert!((to.dot(major) - 1.0).abs() < 1e-6);
                assert!(Vec2::from(st(to)).distance(image) < 1e-6, "{face:?}");
                assert!(layout.place(3.0 * to).unwrap().distance(film) < 1e-3, "{face:?}");
            }
        }
        assert_eq!(layout.place(Vec3::ZERO), None);
    }
}
