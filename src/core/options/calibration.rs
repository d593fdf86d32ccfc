//! Values of calibrated cameras that users write: intrinsics, distortion, and poses in the
//! convention of another program.

use crate::camera::{Distortion, Intrinsics};
use crate::math::{DMat3, DVec3};
use crate::parameter::{Named, Value, name_of, numbers};
use serde_json::json;

impl Value for Intrinsics {
    const PLACEHOLDER: &'static str = "FX,FY,CX,CY";
    const KIND: &'static str = "two focal lengths and the principal point in pixels, as in 800,800,320,240";
    const IS_NUMBER: bool = false;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        let [fx, fy, cx, cy] = numbers(text)?.try_into().ok()?;
        Some(Self {
            focal: [fx, fy],
            center: [cx, cy],
        })
    }

    fn text(&self) -> String {
        let [[fx, fy], [cx, cy]] = [self.focal, self.center];
        format!("{fx},{fy},{cx},{cy}")
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": { "type": "number" }, "minItems": 4, "maxItems": 4 })
    }

    fn is_finite(&self) -> bool {
        self.focal.iter().chain(&self.center).all(|number| number.is_finite())
    }
}

/// Coefficients of a lens distortion in OpenCV's order. Their meaning depends on the projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistortionCoefficients {
    /// The first four coefficients: k1, k2, p1, p2 of a perspective camera, or k1, k2, k3, k4 of a
    /// fisheye camera.
    first: [f64; 4],
    /// The fifth coefficient: k3 of a perspective camera.
    last: Option<f64>,
}

impl DistortionCoefficients {
    /// Coefficients of `distortion`; `None` if there is no distortion.
    pub fn of(distortion: Distortion) -> Option<Self> {
        let (first, last) = match distortion {
            Distortion::Pinhole([k1, k2, p1, p2, k3]) => ([k1, k2, p1, p2], Some(k3)),
            Distortion::Fisheye(k) => (k, None),
        };
        let is_none = first == [0.0; 4] && last.unwrap_or(0.0) == 0.0;
        (!is_none).then_some(Self { first, last })
    }

    /// Distortion of a perspective camera, or of a fisheye camera if `is_fisheye`; `None` if the
    /// number of coefficients is wrong.
    pub fn distortion(&self, is_fisheye: bool) -> Option<Distortion> {
        let [k1, k2, p1, p2] = self.first;
        match (is_fisheye, self.last) {
            (true, None) => Some(Distortion::Fisheye(self.first)),
            (true, Some(_)) => None,
            (false, k3) => Some(Distortion::Pinhole([k1, k2, p1, p2, k3.unwrap_or(0.0)])),
        }
    }
}

impl Value for DistortionCoefficients {
    const PLACEHOLDER: &'static str = "K1,K2,P1,P2,K3";
    const KIND: &'static str = "four or five numbers, as in -0.28,0.07,0,0,0";
    const IS_NUMBER: bool = false;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        let all: Vec<f64> = numbers(text)?;
        let (first, last) = all.split_at_checked(4)?;
        let last = match last {
            [] => None,
            [k3] => Some(*k3),
            _ => return None,
        };
        Some(Self {
            first: first.try_into().ok()?,
            last,
        })
    }

    fn text(&self) -> String {
        let all = self.first.iter().chain(&self.last);
        all.map(|number| number.to_string()).collect::<Vec<_>>().join(",")
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "array", "items": { "type": "number" }, "minItems": 4, "maxItems": 5 })
    }

    fn is_finite(&self) -> bool {
        self.first.iter().chain(&self.last).all(|number| number.is_finite())
    }
}

/// Convention of a pose matrix: whether the matrix maps the world to the camera or the camera to
/// the world, and the axes of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseConvention {
    /// The matrix maps the world to the camera. The camera has x right, y down and z forward.
    OpenCv,
    /// The matrix maps the world to the camera. The camera has x right, y up and z backward.
    OpenGl,
    /// The matrix maps the camera to the world. The camera has x right, y up and z backward.
    Blender,
}

impl Named for PoseConvention {
    const NAMES: &'static [(&'static str, Self)] = &[
        ("opencv", Self::OpenCv),
        ("opengl", Self::OpenGl),
        ("blender", Self::Blender),
    ];
}

/// Position and directions of a camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the lens, world space.
    pub position: DVec3,
    /// A point on the view axis in front of the lens, world space.
    pub look_at: DVec3,
    /// Upward direction in the image.
    pub up: DVec3,
}

/// Maximum relative deviation of a pose's axes from right angles, and of their lengths from each
/// other.
const TOLERANCE: f64 = 1e-3;

/// Pose matrix of a camera in a convention: three rows of four numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseMatrix {
    /// Convention of the matrix.
    pub convention: PoseConvention,
    /// Rows of the matrix.
    pub rows: [[f64; 4]; 3],
}

impl PoseMatrix {
    /// Position and directions of the camera; an error if the matrix is singular, mirrored or
    /// skewed.
    pub fn pose(&self) -> Result<Pose, String> {
        let axis = |column: usize| DVec3::from(self.rows.map(|row| row[column]));
        let (axes, offset) = (DMat3::from_cols(axis(0), axis(1), axis(2)), axis(3));
        let determinant = axes.determinant();
        // Divide by the common length of the axes, because the scale of a pose has no meaning
        let scale = determinant.cbrt();
        let size = axes
            .to_cols_array()
            .into_iter()
            .fold(0.0, |size: f64, x| size.max(x.abs()));
        let is_regular = determinant.abs() > 1e-12 * size.powi(3);
        if !is_regular || !offset.is_finite() {
            return Err(format!("has a singular matrix, whose determinant is {determinant}"));
        }
        if determinant < 0.0 {
            return Err(format!(
                "mirrors the scene, since the determinant of its matrix is {determinant}, not above 0"
            ));
        }
        let rotation = axes * scale.recip();
        let error = (rotation * rotation.transpose() - DMat3::IDENTITY).to_cols_array();
        if error.iter().any(|x| x.abs() > TOLERANCE) {
            return Err("has axes that are not at right angles, or of different lengths".into());
        }
        let (to_world, position) = match self.convention {
            PoseConvention::Blender => (rotation, offset),
            _ => (rotation.transpose(), -(rotation.transpose() * offset) / scale),
        };
        let (down, forward) = match self.convention {
            PoseConvention::OpenCv => (to_world.y_axis, to_world.z_axis),
            _ => (-to_world.y_axis, -to_world.z_axis),
        };
        // Choose a point so far away that its rounding does not turn the view axis
        let distance = position.abs().max_element().max(1.0);
        Ok(Pose {
            position,
            look_at: position + distance * forward,
            up: -down,
        })
    }
}

impl Value for PoseMatrix {
    const PLACEHOLDER: &'static str = "MATRIX";
    const KIND: &'static str =
        "opencv, opengl or blender with 12 or 16 numbers by rows, as in blender:1,0,0,0,0,1,0,0,0,0,1,5";
    const IS_STRING: bool = true;
    const IS_NUMBER: bool = false;

    fn of_text(text: &str) -> Option<Self> {
        let (name, list) = text.split_once(':')?;
        let convention = PoseConvention::of_text(name.trim())?;
        let mut all: Vec<f64> = numbers(list)?;
        if all.len() == 16 && all.split_off(12) != [0.0, 0.0, 0.0, 1.0] {
            return None;
        }
        let all: [f64; 12] = all.try_into().ok()?;
        let row = |i: usize| [0, 1, 2, 3].map(|j| all[4 * i + j]);
        Some(Self {
            convention,
            rows: [row(0), row(1), row(2)],
        })
    }

    fn text(&self) -> String {
        let numbers = self.rows.as_flattened().iter().map(|number| number.to_string());
        let name = name_of(PoseConvention::NAMES, self.convention);
        format!("{name}:{}", numbers.collect::<Vec<_>>().join(","))
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "string", "pattern": "^ *(opencv|opengl|blender) *:" })
    }

    fn is_finite(&self) -> bool {
        self.rows.as_flattened().iter().all(|number| number.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One camera in three conventions. It is at (1, 2, 3) and views towards −x, with z up.
    #[test]
    fn conventions_give_the_same_pose() {
        for text in [
            "opencv: 0,1,0,-2, 0,0,-1,3, -1,0,0,1",
            "opengl:0,1,0,-2,0,0,1,-3,1,0,0,-1",
            "blender:0,0,1,1,1,0,0,2,0,1,0,3,0,0,0,1",
            "opencv: 0,2,0,-4, 0,0,-2,6, -2,0,0,2",
        ] {
            let matrix = PoseMatrix::of_text(text).unwrap();
            let Pose { position, look_at, up } = matrix.pose().unwrap();
            assert!(
                position.distance(DVec3::new(1.0, 2.0, 3.0)) < 1e-12,
                "{text}: {position}"
            );
            assert!(
                (look_at - position).normalize().distance(DVec3::NEG_X) < 1e-12,
                "{text}"
            );
            assert!(up.distance(DVec3::Z) < 1e-12, "{text}: {up}");
            assert_eq!(PoseMatrix::of_text(&matrix.text()), Some(matrix));
        }
    }

    #[test]
    fn invalid_matrices_are_errors() {
        for (text, words) in [
            ("opencv:1,0,0,0,0,1,0,0,1,1,0,0", "singular"),
            ("opencv:0,0,0,0,0,0,0,0,0,0,0,0", "singular"),
            ("opengl:1,0,0,0,0,1,0,0,0,0,-1,0", "mirrors"),
            ("blender:1,0.5,0,0,0,1,0,0,0,0,1,0", "right angles"),
            ("blender:1,0,0,0,0,3,0,0,0,0,1,0", "different lengths"),
        ] {
            let error = PoseMatrix::of_text(text).unwrap().pose().unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
        for text in [
            "maya:1,0,0,0,0,1,0,0,0,0,1,0",
            "opencv:1,2,3",
            "opencv:1,0,0,0,0,1,0,0,0,0,1,0,0,0,1,1",
            "",
        ] {
            assert_eq!(PoseMatrix::of_text(text), None, "{text}");
        }
    }
}
