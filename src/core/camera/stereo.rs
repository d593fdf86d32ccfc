//! Stereo pictures: one view for each eye.
//!
//! The eyes of a perspective camera are to the left and to the right of the position of the camera,
//! each at half of the eye distance. The axes of both eyes are parallel, so an object at the depth
//! z has the disparity f b / z, for the focal length f in pixels and the eye distance b. If a
//! convergence depth is given, the picture planes of both eyes are shifted (off-axis projection),
//! so that objects at this depth have no disparity. The axes stay parallel, so there is no vertical
//! disparity.
//!
//! The eyes of a fisheye and of a calibrated camera are at the same positions, with parallel axes.
//! The intrinsics of a calibrated camera are those of a view. If its lens distorts the picture, or
//! is a fisheye, no shift removes the disparity of a whole plane, so there is no convergence depth.
//!
//! The eyes of a panorama are on a circle around the position of the camera (omni-directional
//! stereo: Peleg, Ben-Ezra and Pritch 2001, "Omnistereo: Panoramic Stereo Imaging"). The ray of
//! each pixel is a tangent of the circle (`projection/panorama.rs`).

use super::{CameraError, Projection};
use crate::math::{UVec2, encode_fields, encode_variants};

/// Arrangement of the two views of a stereo picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StereoLayout {
    /// The left half is the view of the left eye.
    SideBySide,
    /// The upper half is the view of the left eye.
    TopBottom,
}

encode_variants!(StereoLayout { 0 => SideBySide, 1 => TopBottom });

impl StereoLayout {
    /// Names that users type.
    pub const NAMES: &[(&str, Self)] = &[("side-by-side", Self::SideBySide), ("top-bottom", Self::TopBottom)];

    /// Columns and rows of views.
    fn grid(self) -> UVec2 {
        match self {
            Self::SideBySide => UVec2::new(2, 1),
            Self::TopBottom => UVec2::new(1, 2),
        }
    }

    /// Size of a picture whose views have `view` pixels.
    pub fn picture_size(self, view: UVec2) -> UVec2 {
        view.saturating_mul(self.grid())
    }

    /// Size of a view of a picture of `resolution` pixels. An odd width or height is rounded down.
    pub fn view_size(self, resolution: UVec2) -> UVec2 {
        (resolution / self.grid()).max(UVec2::ONE)
    }
}

/// A pair of eyes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    /// Arrangement of the views in the picture.
    pub layout: StereoLayout,
    /// Distance of the eyes in scene units.
    pub eye_distance: f32,
    /// Depth along the view axis, in scene units, at which objects have no disparity; `None` if the
    /// picture planes are not shifted. Only for perspectives and for calibrated cameras without
    /// distortion.
    pub convergence: Option<f32>,
}

encode_fields!(Stereo {
    layout,
    eye_distance,
    convergence,
});

/// Returns true if a shift of the picture of `projection` can remove the disparity of a plane.
fn can_converge(projection: &Projection) -> bool {
    match projection {
        Projection::Perspective { .. } => true,
        Projection::Calibrated { distortion, .. } => distortion.is_none(),
        _ => false,
    }
}

impl Stereo {
    /// Returns an error if a value is out of range, if the projection cannot have two eyes, or if
    /// the picture cannot be divided into two views.
    pub(super) fn check(&self, projection: &Projection, resolution: UVec2) -> Result<(), CameraError> {
        let values = [
            ("eye_distance", Some(self.eye_distance)),
            ("convergence", self.convergence),
        ];
        for (parameter, value) in values {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(CameraError::not_positive(parameter, value));
            }
        }
        match projection {
            Projection::Orthographic { .. } => {
                let message = "has no meaning in the projection `orthographic`: both eyes would see one picture";
                let help = "render two pictures with --orbit, whose azimuths differ by a few degrees";
                return Err(CameraError::no_place("stereo", message.into(), help.into()));
            }
            Projection::Cubemap => {
                let message = "is not possible in the projection `cubemap`: the disparity would change at each edge";
                let help = "use --projection panorama for a stereo picture of all directions";
                return Err(CameraError::no_place("stereo", message.into(), help.into()));
            }
            Projection::Perspective { .. } | Projection::Panorama => {}
            Projection::Fisheye { .. } | Projection::Calibrated { .. } => {}
        }
        if self.convergence.is_some() && !can_converge(projection) {
            let message = "needs a perspective without distortion, because it shifts a plane";
            let help = "leave out --convergence: the axes of the eyes are then parallel";
            return Err(CameraError::no_place("convergence", message.into(), help.into()));
        }
        let (side, size) = match self.layout {
            StereoLayout::SideBySide => ("width", resolution.x),
            StereoLayout::TopBottom => ("height", resolution.y),
        };
        match size % 2 {
            0 => Ok(()),
            _ => Err(CameraError {
                parameter: "stereo",
                message: format!("needs an even {side} of the picture, for two equal views, not {size} pixels"),
                help: Some(format!("use --size with a {side} of {}", size.saturating_add(1))),
            }),
        }
    }

    /// Returns the first pixel of the view of each eye, and the offset of each eye along the axis
    /// `right` of the camera. The left eye is first.
    pub(super) fn eyes(&self, resolution: UVec2) -> [(UVec2, f32); 2] {
        let second = match self.layout {
            StereoLayout::SideBySide => UVec2::new(resolution.x / 2, 0),
            StereoLayout::TopBottom => UVec2::new(0, resolution.y / 2),
        };
        let half = 0.5 * self.eye_distance;
        [(UVec2::ZERO, -half), (second, half)]
    }

    /// Projection of the eye at the offset `eye` along the axis `right`. `projection` is the
    /// projection of the camera in the middle between the eyes. `vertical_fov` is in degrees.
    pub(super) fn projection(&self, eye: f32, projection: Projection, vertical_fov: f32) -> Projection {
        match (projection, self.convergence) {
            (Projection::Perspective { mut shift }, Some(depth)) => {
                let height = 2.0 * (0.5 * vertical_fov.to_radians()).tan();
                shift.x -= eye / (depth * height);
                Projection::Perspective { shift }
            }
            (
                Projection::Calibrated {
                    mut intrinsics,
                    distortion,
                },
                Some(depth),
            ) => {
                intrinsics.center[0] += f64::from(eye) / f64::from(depth) * intrinsics.focal[0];
                Projection::Calibrated { intrinsics, distortion }
            }
            (projection, _) => projection,
        }
    }
}
