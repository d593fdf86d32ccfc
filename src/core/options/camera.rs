//! Camera options: keys of `[camera]`, and flags.

use super::calibration::{DistortionCoefficients, Pose, PoseMatrix};
use crate::camera::{
    Aperture, BLADES, CameraDescription, Distortion, FisheyeMapping, Intrinsics, Projection, ProjectionKind,
    StereoLayout,
};
use crate::guess::{Elevation, NamedView, Orbit, Stand};
use crate::math::{DVec3, Vec2, Vec3};
use crate::parameter::{Range, Value, numbers, parameters};
use serde_json::json;

parameters! {
    /// The camera. Unset options are guessed from the scene, if they change the view.
    pub struct CameraOptions, heading "Camera", values camera {
        /// Side from which the scene is seen; auto chooses one
        ///
        /// The camera is guessed, from this side; not with `position` or `orbit`.
        view: NamedView, default "auto";
        /// Elevation: an orthographic view of front, back, left or right, or a plan
        ///
        /// It shows the whole box of the scene. `plan` is the view from above, with the front
        /// below. The upright axis is the axis nearest to `up`. Without `up` it is the axis that
        /// the comments of the OBJ file declare, or else +y.
        elevation: Elevation, default "off";
        /// Camera at this azimuth, elevation and distance, degrees and scene units
        ///
        /// It looks at `look_at`, or at the middle of the scene's box; not with `position` or
        /// `view`.
        orbit: Orbit, default "guessed; the scene fills the image";
        /// Stand on the floor at X,Z (X,Y if z is up), with the eyes HEIGHT above it
        ///
        /// The two horizontal coordinates of the OBJ file; eyes are 1.6 m above the floor. Not with
        /// `position`, `view` or `orbit`.
        stand: Stand, default "off";
        /// Azimuth towards which a standing camera looks, degrees
        ///
        /// It needs `stand`; not with `look_at`.
        yaw: f32, default "the direction that shows most", in Range::Any;
        /// Projection of the camera
        ///
        /// `panorama` shows all directions, twice as wide as high. `cubemap` shows them on six
        /// squares in a row, in a column, or in two rows. `fisheye` shows a circle.
        projection: ProjectionKind = ProjectionKind::Perspective;
        /// Height of an orthographic picture in scene units
        ortho_height: f32, default "the height of a perspective view at look_at", in Range::Above(0.0);
        /// Shift of the picture to the right and up, as fractions of its height
        ///
        /// For perspective and orthographic cameras. Vertical lines stay vertical.
        shift: Vec2, default "0,0";
        /// Angle in degrees across the circle of a fisheye
        fisheye_fov: f32 = 180.0, in Range::FromTo(1.0, 360.0);
        /// Mapping of a fisheye: equidistant, equisolid, stereographic or orthographic
        fisheye_mapping: FisheyeMapping = FisheyeMapping::Equidistant;
        /// Stereo picture: the left eye's view at the left, or at the top
        ///
        /// For perspectives, fisheyes and calibrated cameras with parallel axes, and for panoramas,
        /// whose eyes turn with the direction. Each view has half of the picture.
        stereo: StereoLayout, default "off";
        /// Distance of the eyes of a stereo picture in scene units
        eye_distance: f32, default "0.064 m; the unit is that of the OBJ file, or the metre", in Range::Above(0.0);
        /// Depth of objects without disparity, in scene units
        ///
        /// It shifts the pictures of the eyes, and turns no axis. For a stereo perspective without
        /// distortion.
        convergence: f32, default "infinite: no shift", in Range::Above(0.0);
        /// Focal lengths and principal point of a calibrated camera
        ///
        /// In pixels of the picture, or of a view of a stereo picture; the first pixel has its
        /// centre at 0.5, 0.5. For perspective and fisheye cameras, in place of `vertical_fov` and
        /// `shift`.
        intrinsics: Intrinsics, default "off";
        /// Distortion of a calibrated camera, by OpenCV's coefficients
        ///
        /// `k1,k2,p1,p2` or `k1,k2,p1,p2,k3` of a perspective, `k1,k2,k3,k4` of a fisheye. It needs
        /// `intrinsics`.
        distortion: DistortionCoefficients, default "none";
        /// Pose of the camera as a matrix, by rows: CONVENTION:NUMBERS
        ///
        /// `opencv` (x right, y down, z forward) and `opengl` (x right, y up, z backward) take the
        /// world to the camera. `blender` is the camera's matrix_world, with the axes of `opengl`.
        /// In place of `position`, `look_at` and `up`.
        pose: PoseMatrix, default "off";
        /// Camera position: the centre of the lens
        ///
        /// See [Camera](guesses.md#camera).
        position: DVec3, default "guessed";
        /// Point in the middle of the image
        look_at: DVec3, default "guessed";
        /// Direction that is up in the image
        ///
        /// It is not parallel to the view direction.
        up: Vec3, default "0,1,0; guessed with the camera";
        /// Vertical field of view in degrees
        vertical_fov: f32, default "40; 35 or 62 with a guessed camera", in Range::Between(0.0, 180.0), flag "fov";
        /// Radius of the lens in scene units; 0 is a pinhole
        lens_radius: f32, default "0", in Range::AtLeast(0.0);
        /// F-number N: the lens radius is half the focal length divided by N
        ///
        /// In place of `lens_radius`. The focal length follows from `vertical_fov` and
        /// `sensor_height`, for a lens focused at infinity.
        f_stop: f32, default "off", in Range::Above(0.0);
        /// Height of the sensor in scene units, for the f-number
        ///
        /// Full frame is 0.024 in metres, 24 in millimetres.
        sensor_height: f32 = 0.024, in Range::Above(0.0);
        /// Straight blades of the aperture
        ///
        /// The opening is a regular polygon with its corners on the rim of the lens.
        aperture_blades: u32, default "a disk", in Range::FromTo(BLADES[0], BLADES[1]);
        /// Angle of the first corner of the aperture polygon, degrees
        ///
        /// It is measured counter-clockwise from the right of the image.
        aperture_rotation: f32 = 0.0, in Range::Any;
        /// Distance along the view axis to the plane in focus
        focus_distance: f32, default "distance of look_at", in Range::Above(0.0);
        /// Focus on the surface at this pixel
        ///
        /// Pixels count from the top left corner; in place of `focus_distance`.
        focus_at: Vec2, default "off";
        /// Times at which the shutter opens and closes, 0 to 1
        ///
        /// All motion runs from 0 to 1.
        shutter: Shutter = Shutter([0.0, 1.0]);
        /// Position at time 1, if the camera moves
        ///
        /// It changes linearly.
        position_close: Vec3, default "as at time 0", flag "";
        /// Point in the middle of the image at time 1
        look_at_close: Vec3, default "as at time 0", flag "";
        /// Direction that is up in the image at time 1
        up_close: Vec3, default "as at time 0", flag "";
    }
}

impl CameraOptions {
    /// Pairs of keys that exclude each other.
    pub const EXCLUSIVE: &[[&'static str; 2]] = &[
        ["position", "view"],
        ["position", "orbit"],
        ["orbit", "view"],
        ["position", "stand"],
        ["view", "stand"],
        ["orbit", "stand"],
        ["look_at", "yaw"],
        ["lens_radius", "f_stop"],
        ["pose", "position"],
        ["pose", "look_at"],
        ["pose", "up"],
        ["pose", "view"],
        ["pose", "orbit"],
        ["pose", "stand"],
        ["elevation", "position"],
        ["elevation", "look_at"],
        ["elevation", "view"],
        ["elevation", "orbit"],
        ["elevation", "stand"],
        ["elevation", "pose"],
        ["elevation", "ortho_height"],
        ["intrinsics", "vertical_fov"],
        ["intrinsics", "shift"],
        ["intrinsics", "fisheye_fov"],
        ["intrinsics", "fisheye_mapping"],
    ];

    /// Replaces the option `pose` by the position and the directions of its matrix. An invalid
    /// matrix is kept, and becomes an error when the camera is made.
    pub fn placed(self) -> Self {
        let Some(Ok(Pose { position, look_at, up })) = self.pose.map(|matrix| matrix.pose()) else {
            return self;
        };
        Self {
            pose: None,
            position: Some(position),
            look_at: Some(look_at),
            up: Some(up.as_vec3a()),
            ..self
        }
    }

    /// Only the options of aperture, focus and shutter.
    pub fn opening(self) -> Self {
        Self {
            lens_radius: self.lens_radius,
            f_stop: self.f_stop,
            sensor_height: self.sensor_height,
            aperture_blades: self.aperture_blades,
            aperture_rotation: self.aperture_rotation,
            focus_distance: self.focus_distance,
            focus_at: self.focus_at,
            shutter: self.shutter,
            ..Self::default()
        }
    }

    /// All options that describe the view of the camera `description`.
    pub fn of(description: &CameraDescription) -> Self {
        let (parameters, motion) = (&description.parameters, description.motion);
        let (aperture, close) = (description.aperture, motion.and_then(|motion| motion.close));
        let of_projection = match description.projection {
            Projection::Perspective { shift } => Self {
                shift: (shift != Vec2::ZERO).then_some(shift),
                ..Self::default()
            },
            Projection::Orthographic { height, shift } => Self {
                projection: Some(ProjectionKind::Orthographic),
                ortho_height: Some(height),
                shift: (shift != Vec2::ZERO).then_some(shift),
                ..Self::default()
            },
            Projection::Panorama => Self {
                projection: Some(ProjectionKind::Panorama),
                ..Self::default()
            },
            Projection::Cubemap => Self {
                projection: Some(ProjectionKind::Cubemap),
                ..Self::default()
            },
            Projection::Fisheye { mapping, fov } => Self {
                projection: Some(ProjectionKind::Fisheye),
                fisheye_fov: Some(fov),
                fisheye_mapping: Some(mapping),
                ..Self::default()
            },
            Projection::Calibrated { intrinsics, distortion } => Self {
                projection: matches!(distortion, Distortion::Fisheye(_)).then_some(ProjectionKind::Fisheye),
                intrinsics: Some(intrinsics),
                distortion: DistortionCoefficients::of(distortion),
                ..Self::default()
            },
        };
        // Leave out the field of view of calibrated cameras, because it follows from the focal
        // length
        let is_calibrated = of_projection.intrinsics.is_some();
        Self {
            position: Some(parameters.position.as_dvec3()),
            look_at: Some(parameters.look_at.as_dvec3()),
            up: Some(parameters.up),
            vertical_fov: (!is_calibrated).then_some(parameters.vertical_fov),
            lens_radius: Some(parameters.lens_radius),
            aperture_blades: aperture.map(|Aperture { blades, .. }| blades),
            aperture_rotation: aperture.map(|Aperture { rotation, .. }| rotation),
            focus_distance: Some(parameters.focus_distance),
            shutter: motion.map(|motion| Shutter(motion.shutter)),
            stereo: description.stereo.map(|stereo| stereo.layout),
            eye_distance: description.stereo.map(|stereo| stereo.eye_distance),
            convergence: description.stereo.and_then(|stereo| stereo.convergence),
            position_close: close.map(|pose| pose.position),
            look_at_close: close.map(|pose| pose.look_at),
            up_close: close.map(|pose| pose.up),
            projection: of_projection.projection,
            ortho_height: of_projection.ortho_height,
            shift: of_projection.shift,
            fisheye_fov: of_projection.fisheye_fov,
            fisheye_mapping: of_projection.fisheye_mapping,
            intrinsics: of_projection.intrinsics,
            distortion: of_projection.distortion,
            // A description has the results of these options
            view: None,
            elevation: None,
            orbit: None,
            stand: None,
            yaw: None,
            pose: None,
            f_stop: None,
            sensor_height: None,
            focus_at: None,
        }
    }
}

/// Times at which the shutter opens and closes, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shutter(pub [f32; 2]);

impl Value for Shutter {
    const PLACEHOLDER: &'static str = "OPEN,CLOSE";
    const KIND: &'static str = "two numbers from 0 to 1";
    const IS_NUMBER: bool = false;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        let times: [f32; 2] = numbers(text)?.try_into().ok()?;
        let is_time = |time: &f32| (0.0..=1.0).contains(time);
        times.iter().all(is_time).then_some(Self(times))
    }

    fn text(&self) -> String {
        self.0.map(|time| time.to_string()).join(",")
    }

    fn schema() -> serde_json::Value {
        let time = json!({ "type": "number", "minimum": 0, "maximum": 1 });
        json!({ "type": "array", "items": time, "minItems": 2, "maxItems": 2 })
    }
}

impl Value for Stand {
    const PLACEHOLDER: &'static str = "X,Z[,HEIGHT]";
    const KIND: &'static str = "the two horizontal coordinates of the file, with an optional height of the eyes above 0, as in 2,-3 or 2,-3,1.7";
    const IS_NUMBER: bool = false;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        Self::of(&numbers::<f64>(text)?).ok()
    }

    fn text(&self) -> String {
        let height = self.height.map(|height| format!(",{height}"));
        self.place_text() + &height.unwrap_or_default()
    }

    fn schema() -> serde_json::Value {
        let coordinate = json!({ "type": "number" });
        let height = json!({ "type": "number", "exclusiveMinimum": 0 });
        json!({ "type": "array", "items": [coordinate, coordinate, height], "additionalItems": false, "minItems": 2 })
    }
}

impl Value for Orbit {
    const PLACEHOLDER: &'static str = "AZ,EL[,D]";
    const KIND: &'static str = "an azimuth, an elevation between -90 and 90 degrees and, if at all, a distance above 0, as in 30,20 or 30,20,5";
    const IS_NUMBER: bool = false;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        Self::of(&numbers::<f32>(text)?)
    }

    fn text(&self) -> String {
        let angles = [Some(self.azimuth), Some(self.elevation), self.distance];
        let angles: Vec<String> = angles.into_iter().flatten().map(|number| number.to_string()).collect();
        angles.join(",")
    }

    fn schema() -> serde_json::Value {
        let [azimuth, elevation] = [
            json!({ "type": "number" }),
            json!({ "type": "number", "minimum": -90, "maximum": 90 }),
        ];
        let distance = json!({ "type": "number", "exclusiveMinimum": 0 });
        json!({ "type": "array", "items": [azimuth, elevation, distance], "additionalItems": false, "minItems": 2 })
    }
}
