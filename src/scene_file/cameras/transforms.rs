//! NeRF's `transforms.json` (Mildenhall et al. 2020, "NeRF"), with the keys of instant-ngp and
//! nerfstudio.
//!
//! Poses are transforms from the camera to the world, with the axes of OpenGL. The centre of the
//! first pixel is at (0.5, 0.5). Keys of a frame override keys of the file.

use super::{FileCamera, calibrated, json_error};
use crate::camera::{Distortion, Intrinsics, ProjectionKind};
use crate::files::{Output, read_text};
use crate::math::UVec2;
use crate::options::{CameraOptions, PoseConvention, PoseMatrix};
use crate::scene_file::FileError;
use serde::Deserialize;
use serde_json::{Map, Number, Value, json};
use std::io::Write;
use std::path::Path;

/// Keys of the lens, which are given for the whole file or for one frame.
#[derive(Clone, Default, Deserialize)]
struct Lens {
    camera_model: Option<String>,
    camera_angle_x: Option<f64>,
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    is_fisheye: Option<bool>,
}

#[derive(Deserialize)]
struct Frame {
    file_path: Option<String>,
    transform_matrix: Vec<Vec<f64>>,
    #[serde(flatten)]
    lens: Lens,
}

#[derive(Deserialize)]
struct Transforms {
    frames: Vec<Frame>,
    #[serde(flatten)]
    lens: Lens,
}

impl Lens {
    fn or(self, other: &Self) -> Self {
        let other = other.clone();
        Self {
            camera_model: self.camera_model.or(other.camera_model),
            camera_angle_x: self.camera_angle_x.or(other.camera_angle_x),
            fl_x: self.fl_x.or(other.fl_x),
            fl_y: self.fl_y.or(other.fl_y),
            cx: self.cx.or(other.cx),
            cy: self.cy.or(other.cy),
            w: self.w.or(other.w),
            h: self.h.or(other.h),
            k1: self.k1.or(other.k1),
            k2: self.k2.or(other.k2),
            k3: self.k3.or(other.k3),
            k4: self.k4.or(other.k4),
            p1: self.p1.or(other.p1),
            p2: self.p2.or(other.p2),
            is_fisheye: self.is_fisheye.or(other.is_fisheye),
        }
    }

    /// Size of the picture; `None` if it is missing. Returns an error if only one side is given, or
    /// if a side is not a whole number of pixels.
    fn size(&self) -> Result<Option<UVec2>, String> {
        let side = |name: &str, side: f64| match side {
            1.0..=65536.0 if side.fract() == 0.0 => Ok(side as u32),
            _ => Err(format!("`{name}` is {side}, not a number of pixels")),
        };
        match (self.w, self.h) {
            (Some(w), Some(h)) => Ok(Some(UVec2::new(side("w", w)?, side("h", h)?))),
            (None, None) => Ok(None),
            _ => Err("`w` or `h` is missing".into()),
        }
    }

    /// Camera options as in `[camera]`, and the horizontal field of view, if the file has no
    /// vertical one.
    fn options(&self, size: Option<UVec2>) -> Result<(CameraOptions, Option<f64>), String> {
        let model = self.camera_model.as_deref().unwrap_or("OPENCV");
        let is_fisheye = match model {
            "OPENCV" | "PINHOLE" | "SIMPLE_PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "PERSPECTIVE" => {
                self.is_fisheye == Some(true)
            }
            "OPENCV_FISHEYE" => true,
            "EQUIRECTANGULAR" => {
                let panorama = CameraOptions {
                    projection: Some(ProjectionKind::Panorama),
                    ..CameraOptions::default()
                };
                return Ok((panorama, None));
            }
            _ => {
                return Err(format!(
                    "the camera model `{model}` is not supported; possible are OPENCV, OPENCV_FISHEYE, PINHOLE and EQUIRECTANGULAR"
                ));
            }
        };
        let k = [self.k1, self.k2, self.k3, self.k4].map(|k| k.unwrap_or(0.0));
        let p = [self.p1, self.p2].map(|p| p.unwrap_or(0.0));
        let distortion = match is_fisheye {
            true if p != [0.0; 2] => return Err("`p1` and `p2` have no meaning in a fisheye".into()),
            true => Distortion::Fisheye(k),
            false if k[3] != 0.0 => return Err("`k4` has no meaning in a pinhole camera".into()),
            false => Distortion::Pinhole([k[0], k[1], p[0], p[1], k[2]]),
        };
        let is_distorted = k != [0.0; 4] || p != [0.0; 2];
        let angle = self.camera_angle_x;
        let Some(size) = size else {
            return match (angle, self.fl_x, is_distorted || is_fisheye) {
                (Some(angle), None, false) => Ok((CameraOptions::default(), Some(angle))),
                _ => Err("`w` and `h` are missing, which `fl_x` and the distortion need".into()),
            };
        };
        let size = size.as_dvec2();
        let of_angle = || angle.map(|angle| 0.5 * size.x / (0.5 * angle).tan());
        let Some(fx) = self.fl_x.or_else(of_angle) else {
            return Err("`fl_x` and `camera_angle_x` are missing".into());
        };
        let intrinsics = Intrinsics {
            focal: [fx, self.fl_y.unwrap_or(fx)],
            center: [self.cx.unwrap_or(0.5 * size.x), self.cy.unwrap_or(0.5 * size.y)],
        };
        intrinsics.check().map_err(|error| error.to_string())?;
        Ok((calibrated(intrinsics, distortion), None))
    }
}

/// Reads the cameras of a file: one for each frame.
pub(super) fn read(path: &Path) -> Result<Vec<FileCamera>, FileError> {
    let text = read_text(path, "the file of cameras")?;
    let help = "give a transforms.json, as NeRF, instant-ngp and nerfstudio write it";
    let all: Transforms = serde_json::from_str(&text).map_err(|error| json_error(path, &error).help(help))?;
    let camera = |(index, frame): (usize, Frame)| {
        let name = frame.file_path.unwrap_or_else(|| index.to_string());
        let wrong = |message: String| {
            let message = format!("frame {index} (`{name}`): {message}");
            FileError::new(path, message).help("correct the frame, or the keys of the file")
        };
        let rows: Vec<[f64; 4]> = frame
            .transform_matrix
            .iter()
            .filter_map(|row| row[..].try_into().ok())
            .collect();
        let is_matrix = rows.len() == frame.transform_matrix.len() && (3..=4).contains(&rows.len());
        if !is_matrix {
            return Err(wrong("`transform_matrix` is not 3 or 4 rows of 4 numbers".into()));
        }
        let pose = PoseMatrix {
            convention: PoseConvention::Blender,
            rows: [rows[0], rows[1], rows[2]],
        };
        pose.pose()
            .map_err(|message| wrong(format!("`transform_matrix` {message}")))?;
        let lens = frame.lens.or(&all.lens);
        let size = lens.size().map_err(wrong)?;
        let (options, horizontal_fov) = lens.options(size).map_err(wrong)?;
        let options = CameraOptions {
            pose: Some(pose),
            ..options
        };
        Ok(FileCamera {
            name: name.clone(),
            size,
            options,
            horizontal_fov,
        })
    };
    all.frames.into_iter().enumerate().map(camera).collect()
}

/// Writes `camera` as a frame with all its keys. The new frame replaces a frame of the same name.
pub(super) fn write(path: &Path, camera: &FileCamera) -> Result<(), FileError> {
    let mut file = Map::new();
    if path.exists() {
        // Check the existing file; its other frames are kept as they were read
        read(path)?;
        let text = read_text(path, "the file of cameras")?;
        if let Ok(Value::Object(read)) = serde_json::from_str(&text) {
            file = read;
        }
    }
    let (size, rows) = camera.written();
    let mut frame = Map::new();
    let mut set = |key: &str, value: Value| frame.insert(key.into(), value);
    set("file_path", camera.name.as_str().into());
    set("w", size.x.into());
    set("h", size.y.into());
    let number = |x: f64| Number::from_f64(x).map_or(Value::Null, Value::Number);
    match camera.calibration(size) {
        Some((Intrinsics { focal, center }, distortion)) => {
            let (model, names, values) = match distortion {
                Distortion::Pinhole([k1, k2, p1, p2, k3]) => {
                    ("OPENCV", &["k1", "k2", "p1", "p2", "k3"][..], vec![k1, k2, p1, p2, k3])
                }
                Distortion::Fisheye(k) => ("OPENCV_FISHEYE", &["k1", "k2", "k3", "k4"][..], k.to_vec()),
            };
            set("camera_model", model.into());
            for (key, value) in ["fl_x", "fl_y", "cx", "cy"].into_iter().zip([focal, center].concat()) {
                set(key, number(value));
            }
            for (key, value) in names.iter().zip(values) {
                set(key, number(value));
            }
        }
        None if camera.options.projection == Some(ProjectionKind::Panorama) => {
            set("camera_model", "EQUIRECTANGULAR".into());
        }
        None => {
            let possible = "a transforms.json stores perspectives, equidistant fisheyes and panoramas";
            return Err(camera.no_projection(path, possible));
        }
    }
    let [x, y, z] = rows;
    set("transform_matrix", json!([x, y, z, [0.0, 0.0, 0.0, 1.0]]));

    let frames = file.entry("frames").or_insert_with(|| json!([]));
    if let Value::Array(frames) = frames {
        let is_old = |old: &Value| old.get("file_path").and_then(Value::as_str) == Some(&camera.name);
        match frames.iter_mut().find(|old| is_old(old)) {
            Some(old) => *old = Value::Object(frame),
            None => frames.push(Value::Object(frame)),
        }
    }
    let text = format!("{:#}\n", Value::Object(file));
    Output::prepare(path)?.write(|writer| writer.write_all(text.as_bytes()))
}
