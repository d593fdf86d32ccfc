//! Descriptions of cameras without the size of the image: pose, lens, motion and projection.

use super::{Aperture, Camera, CameraError, Projection, Stereo};
use crate::math::{Encode, UVec2, Vec3, encode_fields};

/// Position and orientation of a camera. Lengths are in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of the lens.
    pub position: Vec3,
    /// Point in the middle of the image.
    pub look_at: Vec3,
    /// Up direction in the image; not parallel to the view axis.
    pub up: Vec3,
}

impl Pose {
    /// Pose at `time`, interpolated linearly from `self` at time 0 to `close` at time 1.
    pub(super) fn lerp(&self, close: &Self, time: f32) -> Self {
        Self {
            position: self.position.lerp(close.position, time),
            look_at: self.look_at.lerp(close.look_at, time),
            up: self.up.lerp(close.up, time),
        }
    }

    /// Right, up and forward as unit vectors; `None` if they are undefined.
    pub(super) fn axes(&self) -> Option<[Vec3; 3]> {
        let forward = (self.look_at - self.position).try_normalize()?;
        let right = forward.cross(self.up.try_normalize()?).try_normalize()?;
        Some([right, right.cross(forward), forward])
    }
}

/// Motion and shutter of a camera. Times are from 0 to 1. At time 0 all objects are at their first
/// position, at time 1 at their last position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraMotion {
    /// Pose at time 1, if the camera moves.
    pub close: Option<Pose>,
    /// Times at which the shutter opens and closes. Light has the same weight at all times in
    /// between.
    pub shutter: [f32; 2],
}

/// Parameters of a camera. Lengths are in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraParameters {
    /// Centre of the lens.
    pub position: Vec3,
    /// Point in the middle of the image.
    pub look_at: Vec3,
    /// Up direction in the image; not parallel to the view axis.
    pub up: Vec3,
    /// Vertical field of view in degrees, inside (0, 180).
    pub vertical_fov: f32,
    /// Radius of the lens; 0 for a pinhole. With an [`Aperture`], the corners of the polygon have
    /// this distance from the centre of the lens.
    pub lens_radius: f32,
    /// Distance from the lens, along the view axis, to the plane in focus.
    pub focus_distance: f32,
}

/// Complete description of a camera, without the size of its image.
#[derive(Clone, Copy, Debug)]
pub struct CameraDescription {
    /// Position, direction, field of view and lens at time 0.
    pub parameters: CameraParameters,
    /// Motion and shutter; `None` for a still camera with its shutter always open.
    pub motion: Option<CameraMotion>,
    /// Shape of the lens's opening; `None` for a disk.
    pub aperture: Option<Aperture>,
    /// Projection. Only a perspective uses the `vertical_fov` of the parameters.
    pub projection: Projection,
    /// Pair of eyes; `None` if the picture has one view.
    pub stereo: Option<Stereo>,
}

impl CameraDescription {
    /// Still camera with the full disk of its lens.
    pub fn still(parameters: CameraParameters) -> Self {
        Self {
            parameters,
            motion: None,
            aperture: None,
            projection: Projection::default(),
            stereo: None,
        }
    }

    /// Camera for an image of `resolution` pixels. For a stereo picture, the camera is in the
    /// middle between the eyes. The intrinsics of a stereo picture are those of a view, so the
    /// image of this camera is then a view that is stretched to `resolution`.
    pub fn camera(&self, resolution: UVec2) -> Result<Camera, CameraError> {
        let camera = match self.motion {
            None => Camera::new(self.parameters, resolution),
            Some(motion) => Camera::moving(self.parameters, motion, resolution),
        };
        let projection = match (self.projection, self.stereo) {
            (Projection::Calibrated { intrinsics, distortion }, Some(_)) => {
                let factor = resolution.as_dvec2() / self.view_size(resolution).as_dvec2();
                let intrinsics = intrinsics.scaled(factor);
                Projection::Calibrated { intrinsics, distortion }
            }
            (projection, _) => projection,
        };
        let camera = camera?.with_projection(projection, self.parameters.vertical_fov)?;
        match self.aperture {
            None => Ok(camera),
            Some(aperture) => camera.with_aperture(aperture),
        }
    }
}

encode_fields!(Pose { position, look_at, up });
encode_fields!(CameraMotion { close, shutter });
encode_fields!(CameraParameters {
    position,
    look_at,
    up,
    vertical_fov,
    lens_radius,
    focus_distance,
});

impl Encode for CameraDescription {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        let Self {
            parameters,
            motion,
            aperture,
            projection,
            stereo,
        } = self;
        parameters.encode(sink);
        motion.encode(sink);
        aperture.encode(sink);
        projection.encode(sink);
        // Encode `stereo` only if it is given, so that the hashes of other cameras are the same as
        // without this field
        if let Some(stereo) = stereo {
            stereo.encode(sink);
        }
    }
}
