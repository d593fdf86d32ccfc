//! Attributes of a camera for image files: matrices and lens, in the conventions of OpenEXR.
//!
//! Source: OpenEXR, Standard Attributes, "Position and Orientation" and "Lens State". Points are
//! row vectors, so a matrix stands to the right of a point. Camera space is left-handed: x right, y
//! up, z along the view axis. NDC are 0, 0 in the upper left corner of the display window and 1, 1
//! in the lower right corner.
//!
//! The screen window is the rectangle of the picture on the plane z = 1 (OpenEXR, Technical
//! Introduction, "Projection, camera coordinate system and screen window"). The x axis of that
//! section is to the left, but the x axis of `worldToCamera` is to the right. The display driver
//! for RenderMan by the authors of OpenEXR computes the window from the matrices, with x to the
//! right, and also for parallel rays. This module does the same.

use super::Camera;
use super::projection::{Face, Plane, ScreenWindow};
use crate::math::{DVec2, DVec3, Encode, Vec3};

/// A 4 × 4 matrix, by rows.
pub type Matrix = [f32; 16];

/// Attributes of a camera in image files.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraAttributes {
    /// Transform from world space to camera space.
    pub world_to_camera: Matrix,
    /// Transform from world space to the image plane; `None` for projections without a matrix.
    pub world_to_ndc: Option<Matrix>,
    /// Rectangle of the picture on the plane of the projection; `None` for projections without a
    /// matrix.
    pub screen_window: Option<ScreenWindow>,
    /// Focal length of a perspective in millimetres.
    pub focal_length: Option<f32>,
    /// Width and height of the sensor of a perspective in millimetres.
    pub sensor: Option<[f32; 2]>,
    /// F-number of a perspective with a lens.
    pub f_number: Option<f32>,
    /// Distance of the plane of focus in metres; `None` unless the projection is onto a plane.
    pub focus: Option<f32>,
}

impl Encode for CameraAttributes {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        let Self {
            world_to_camera,
            world_to_ndc,
            screen_window: _,
            focal_length,
            sensor,
            f_number,
            focus,
        } = self;
        // The screen window follows from both matrices. It is not encoded, so that the digests of
        // files without it stay valid
        world_to_camera.encode(sink);
        world_to_ndc.encode(sink);
        focal_length.encode(sink);
        sensor.encode(sink);
        f_number.encode(sink);
        focus.encode(sink);
    }
}

impl CameraAttributes {
    /// Attributes of the face with this index, in the order of [`FACE_NAMES`](super::FACE_NAMES).
    /// `self` are the attributes of the whole cube map. A face is a perspective of 90 degrees. Its
    /// sensor has the height of full-frame film. `None` if there is no such face.
    pub fn of_face(&self, index: usize) -> Option<Self> {
        /// Height of full-frame film in millimetres.
        const HEIGHT: f32 = 24.0;
        let axes = Face::ALL.get(index)?.axes([Vec3::X, Vec3::Y, Vec3::Z]);
        let (front, rows) = (self.world_to_camera, [0, 1, 2, 3]);
        // Columns of the matrix to the space of the face. Each maps a point to its coordinate along
        // an axis of the face.
        let [right, up, depth] = axes.map(|axis| {
            rows.map(|row: usize| {
                let [x, y, z] = [0, 1, 2].map(|column| front[4 * row + column]);
                axis.dot(Vec3::new(x, y, z))
            })
        });
        let matrix = |columns: [[f32; 4]; 4]| std::array::from_fn(|i| columns[i % 4][i / 4]);
        let half = |a: [f32; 4]| rows.map(|row| 0.5 * (a[row] + depth[row]));
        let [x, y, z, one] = depth;
        let planes = [half(right), half(up.map(|v| -v)), [x, y, z, one - 1.0], depth];
        Some(Self {
            world_to_camera: matrix([right, up, depth, [0.0, 0.0, 0.0, 1.0]]),
            world_to_ndc: Some(matrix(planes)),
            screen_window: Some(ScreenWindow {
                center: [0.0; 2],
                width: 2.0,
            }),
            focal_length: Some(0.5 * HEIGHT),
            sensor: Some([HEIGHT; 2]),
            f_number: None,
            focus: None,
        })
    }
}

impl Camera {
    /// Attributes of the camera at shutter open, for image files. `metres` is the length of a scene
    /// unit in metres. `sensor_height` is the height of the sensor in metres.
    pub fn attributes(&self, sensor_height: f32, metres: f32) -> CameraAttributes {
        let [open, _] = self.shutter;
        let still = self.at(open);
        let axes = [still.right, still.up, still.forward].map(|axis| axis.as_dvec3());
        let position = still.position.as_dvec3();
        let plane = self.film.plane();
        let size = self.resolution.as_dvec2();
        let perspective = plane.filter(|plane| !plane.is_parallel);
        let height = f64::from(sensor_height);
        let focal = perspective.map(|plane| plane.scale.y * height / size.y);
        let diameter = 2.0 * f64::from(self.lens_radius) * f64::from(metres);
        CameraAttributes {
            world_to_camera: world_to_camera(axes, position),
            world_to_ndc: plane.map(|plane| world_to_ndc(axes, position, plane, size)),
            screen_window: self.film.screen_window(self.resolution),
            focal_length: focal.map(|focal| (1000.0 * focal) as f32),
            sensor: perspective.map(|_| [size.x / size.y, 1.0].map(|side| (1000.0 * height * side) as f32)),
            f_number: focal.filter(|_| diameter > 0.0).map(|focal| (focal / diameter) as f32),
            focus: (!self.film.is_curved()).then_some(self.focus_distance * metres),
        }
    }
}

/// Matrix with these columns, each an axis and a constant. A column maps a point to the dot product
/// of the point and the axis, plus the constant.
fn matrix(columns: [(DVec3, f64); 4]) -> Matrix {
    let entry = |i: usize| {
        let (axis, constant) = columns[i % 4];
        let row = i / 4;
        if row < 3 { axis[row] as f32 } else { constant as f32 }
    };
    std::array::from_fn(entry)
}

fn world_to_camera(axes: [DVec3; 3], position: DVec3) -> Matrix {
    let [x, y, z] = axes.map(|axis| (axis, -axis.dot(position)));
    matrix([x, y, z, (DVec3::ZERO, 1.0)])
}

fn world_to_ndc([right, up, forward]: [DVec3; 3], position: DVec3, plane: Plane, size: DVec2) -> Matrix {
    // The last column is the divisor of x, y and z. Users of the matrix need x and y only. z is 1 −
    // 1/depth, so that the matrix is invertible.
    let divisor = if plane.is_parallel { DVec3::ZERO } else { forward };
    let one = f64::from(u8::from(plane.is_parallel));
    let constant_of_depth = -forward.dot(position);
    let (scale, middle) = (plane.scale / size, plane.middle / size);
    let w = (divisor, one + if plane.is_parallel { 0.0 } else { constant_of_depth });
    let along = |axis: DVec3, scale: f64, middle: f64| {
        let column = scale * axis;
        (column + middle * w.0, -column.dot(position) + middle * w.1)
    };
    let z = if plane.is_parallel {
        constant_of_depth
    } else {
        w.1 - 1.0
    };
    matrix([
        along(right, scale.x, middle.x),
        along(up, -scale.y, middle.y),
        (forward, z),
        w,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{CameraDescription, CameraParameters, Distortion, Intrinsics, Projection};
    use crate::math::{UVec2, Vec2};

    fn camera_parameters() -> CameraParameters {
        CameraParameters {
            position: Vec3::new(1.0, 2.0, 3.0),
            look_at: Vec3::new(-2.0, 1.0, -4.0),
            up: Vec3::new(0.1, 1.0, 0.0),
            vertical_fov: 50.0,
            lens_radius: 0.01,
            focus_distance: 4.0,
        }
    }

    fn camera(projection: Projection) -> Camera {
        let description = CameraDescription {
            projection,
            ..CameraDescription::still(camera_parameters())
        };
        description.camera(UVec2::new(120, 80)).unwrap()
    }

    /// Product of the point `p` and the matrix `m`, divided by the last coordinate of the product.
    fn times(p: Vec3, m: Matrix) -> [f64; 3] {
        let of = |column: usize| {
            let row = |row: usize, x: f32| f64::from(x) * f64::from(m[4 * row + column]);
            row(0, p.x) + row(1, p.y) + row(2, p.z) + row(3, 1.0)
        };
        [0, 1, 2].map(|column| of(column) / of(3))
    }

    /// The matrices project points to the same pixels as the camera.
    #[test]
    fn matrices_project_as_the_camera_does() {
        let shift = Vec2::new(0.2, -0.3);
        let calibrated = |distortion| Projection::Calibrated {
            intrinsics: Intrinsics {
                focal: [90.0, 100.0],
                center: [50.0, 47.0],
            },
            distortion,
        };
        for projection in [
            Projection::Perspective { shift },
            Projection::Orthographic { height: 7.0, shift },
            calibrated(Distortion::Pinhole([0.0; 5])),
        ] {
            let camera = camera(projection);
            let attributes = camera.attributes(0.024, 1.0);
            for p in [[0.0, 0.0, 0.0], [-1.0, 2.0, -3.0], [0.5, 1.0, -9.0]].map(Vec3::from) {
                let expected = camera.film_of(p, 0.0).unwrap();
                let [x, y, _] = times(p, attributes.world_to_ndc.unwrap());
                let distance = (120.0 * x - f64::from(expected.x)).hypot(80.0 * y - f64::from(expected.y));
                assert!(distance < 1e-3, "{projection:?}: {p} is {distance} pixels off");
                let [.., z] = times(p, attributes.world_to_camera);
                assert!((z - f64::from(camera.depth(p, 0.0))).abs() < 1e-5, "{projection:?}");
            }
            let [x, y, z] = times(Vec3::new(1.0, 2.0, 3.0), attributes.world_to_camera);
            assert!(x.abs() + y.abs() + z.abs() < 1e-5);
            // The corners of the screen window are the corners of the picture
            let ScreenWindow { center, width } = attributes.screen_window.unwrap();
            let height = match projection {
                Projection::Calibrated { .. } => width * 80.0 / 120.0 * 90.0 / 100.0,
                _ => width * 80.0 / 120.0,
            };
            let depth = if matches!(projection, Projection::Orthographic { .. }) {
                1.0
            } else {
                3.0
            };
            for (corner, [u, v]) in [([0.0, 0.0], [-0.5, 0.5]), ([120.0, 80.0], [0.5, -0.5])] {
                let [x, y] = [center[0] + u * width, center[1] + v * height].map(|x| depth * x);
                let p = camera.position + x * camera.right + y * camera.up + 3.0 * camera.forward;
                let film = camera.film_of(p, 0.0).unwrap();
                assert!(film.distance(corner.into()) < 1e-3, "{projection:?}: {film} {corner:?}");
            }
        }
        let window = camera(Projection::default())
            .attributes(0.024, 1.0)
            .screen_window
            .unwrap();
        assert_eq!(window.center, [0.0; 2]);
        assert!((window.width - 3.0 * 25f32.to_radians().tan()).abs() < 1e-6);
        let distorted = camera(calibrated(Distortion::Pinhole([-0.1, 0.0, 0.0, 0.0, 0.0])));
        assert_eq!(distorted.attributes(0.024, 1.0).world_to_ndc, None);
        assert_eq!(distorted.attributes(0.024, 1.0).screen_window, None);
    }

    /// The attributes of each face of a cube map are those of a perspective that looks towards the
    /// face.
    #[test]
    fn faces_have_the_attributes_of_perspectives() {
        let whole = CameraDescription {
            projection: Projection::Cubemap,
            ..CameraDescription::still(CameraParameters {
                lens_radius: 0.0,
                ..camera_parameters()
            })
        };
        let size = UVec2::new(90, 60);
        let attributes = whole.camera(size).unwrap().attributes(0.024, 1.0);
        let views = whole.views(size).unwrap();
        assert_eq!(views.len(), 6);
        for (index, view) in views.iter().enumerate() {
            let [found, expected] = [attributes.of_face(index).unwrap(), view.camera.attributes(0.024, 1.0)];
            let matrices = [
                (found.world_to_camera, expected.world_to_camera),
                (found.world_to_ndc.unwrap(), expected.world_to_ndc.unwrap()),
            ];
            for (found, expected) in matrices {
                for (found, expected) in found.into_iter().zip(expected) {
                    assert!((found - expected).abs() < 1e-5, "{index}: {found:?} {expected:?}");
                }
            }
            assert!((found.focal_length.unwrap() - expected.focal_length.unwrap()).abs() < 1e-4);
            assert_eq!(found.sensor, expected.sensor);
            let [found, expected] = [found, expected].map(|attributes| attributes.screen_window.unwrap());
            assert_eq!(found.center, expected.center);
            assert!((found.width - expected.width).abs() < 1e-6);
        }
        assert_eq!(attributes.of_face(6), None);
    }

    /// A sensor of 24 mm and 50° has a focal length of 12 mm / tan 25°.
    #[test]
    fn lenses_have_millimetres_and_metres() {
        let attributes = camera(Projection::default()).attributes(0.024, 0.1);
        let focal = 12.0 / 25f32.to_radians().tan();
        assert!((attributes.focal_length.unwrap() - focal).abs() < 1e-4);
        assert!((attributes.f_number.unwrap() - focal / 2.0).abs() < 1e-4);
        assert!((attributes.focus.unwrap() - 0.4).abs() < 1e-6);
        let [width, height] = attributes.sensor.unwrap();
        assert!((width - 36.0).abs() < 1e-4 && (height - 24.0).abs() < 1e-5);
    }
}
