//! Cameras read from files: NeRF's `transforms.json`, COLMAP models, glTF scenes, and lists in TOML
//! or CSV. Positions of cameras are in coordinates of the OBJ file.

mod colmap;
mod gltf;
mod list;
mod transforms;

use super::{FileError, Position};
use crate::camera::{CameraDescription, Distortion, FisheyeMapping, Intrinsics, ProjectionKind};
use crate::math::{DMat3, DVec3, UVec2, Vec2};
use crate::options::{CameraOptions, DistortionCoefficients, PoseConvention, PoseMatrix};
use crate::parameter::{Value, nearest};
use std::path::{Path, PathBuf};

/// Maximum number of camera names that an error lists.
const MAX_NAMES: usize = 12;

/// A camera read from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FileCamera {
    /// Name of the picture that the camera took, or of the camera.
    pub name: String,
    /// Width and height of the camera's picture in pixels, if the file has them.
    pub size: Option<UVec2>,
    /// Camera options as in `[camera]`. Intrinsics are in pixels of a picture of `size`.
    pub options: CameraOptions,
    /// Horizontal field of view in radians, if the file has no vertical field of view.
    pub horizontal_fov: Option<f64>,
}

impl FileCamera {
    /// Reads all cameras of the file or folder `path`.
    ///
    /// # Errors
    ///
    /// The file cannot be read, has an unknown format, or has no cameras.
    pub fn read_all(path: &Path) -> Result<Vec<Self>, FileError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let cameras = match extension.as_str() {
            _ if path.is_dir() => colmap::read(path)?,
            "txt" | "bin" => colmap::read(path.parent().unwrap_or(Path::new("")))?,
            "json" => transforms::read(path)?,
            "gltf" | "glb" => gltf::read(path)?,
            "toml" => list::read_toml(path)?,
            "csv" => list::read_csv(path)?,
            _ => {
                let help = "give a transforms.json, a folder of COLMAP, or a .gltf, .glb, .toml or .csv file";
                return Err(FileError::new(path, "this is no camera file, by its name").help(help));
            }
        };
        if cameras.is_empty() {
            return Err(FileError::new(path, "the file has no cameras").help("give a file with a camera"));
        }
        Ok(cameras)
    }

    /// Reads the camera `name` of `path`. If `name` is `None`, `path` must have only one camera.
    ///
    /// `name` is the name of the camera in the file. If that name is a path, the file name alone
    /// also selects the camera, with or without its extension.
    ///
    /// # Errors
    ///
    /// Errors of [`FileCamera::read_all`]. The name is unknown, or several cameras have this name.
    pub fn read(path: &Path, name: Option<&str>) -> Result<Self, FileError> {
        let cameras = Self::read_all(path)?;
        let Some(name) = name else {
            return match <[Self; 1]>::try_from(cameras) {
                Ok([camera]) => Ok(camera),
                Err(cameras) => {
                    let message = format!("the file has {} cameras", cameras.len());
                    Err(FileError::new(path, message).help(format!("choose one with --camera: {}", list_of(&cameras))))
                }
            };
        };
        let stem = |camera: &Self| {
            let last = Path::new(&camera.name).file_stem();
            last.map(|stem| stem.to_string_lossy().into_owned())
        };
        let last = |camera: &Self| {
            let last = Path::new(&camera.name).file_name();
            last.map(|last| last.to_string_lossy().into_owned())
        };
        let rules: [&dyn Fn(&Self) -> bool; 3] = [
            &|camera| camera.name == name,
            &|camera| last(camera).as_deref() == Some(name),
            &|camera| stem(camera).as_deref() == Some(name),
        ];
        for rule in rules {
            let found: Vec<&Self> = cameras.iter().filter(|camera| rule(camera)).collect();
            match *found {
                [] => {}
                [camera] => return Ok(camera.clone()),
                [..] => {
                    let message = format!("{} cameras are called `{name}`", found.len());
                    return Err(FileError::new(path, message).help("give each camera a name of its own"));
                }
            }
        }
        let names = cameras.iter().map(|camera| camera.name.as_str());
        let near = nearest(name, names).map(|near| format!("did you mean {near}? "));
        let help = format!("{}the file has {}", near.unwrap_or_default(), list_of(&cameras));
        Err(FileError::new(path, format!("there is no camera `{name}`")).help(help))
    }

    /// Camera options as in `[camera]`, for a picture of `size` pixels. Intrinsics are scaled to
    /// this size.
    pub fn options(&self, size: UVec2) -> CameraOptions {
        let mut options = self.options;
        if let (Some(intrinsics), Some(own)) = (&mut options.intrinsics, self.size) {
            for axis in 0..2 {
                let factor = f64::from(size[axis]) / f64::from(own[axis]);
                intrinsics.focal[axis] *= factor;
                intrinsics.center[axis] *= factor;
            }
        }
        if let Some(angle) = self.horizontal_fov {
            let half = (0.5 * angle).tan() * f64::from(size.y) / f64::from(size.x);
            options.vertical_fov = Some((2.0 * half.atan()).to_degrees() as f32);
        }
        options
    }

    /// A camera to write to a file, from `description` and the size `size` of its picture in
    /// pixels. `origin` is the point in OBJ coordinates that is the scene's origin.
    pub fn of(name: String, description: &CameraDescription, size: UVec2, origin: DVec3) -> Self {
        let parameters = &description.parameters;
        let described = CameraOptions::of(description);
        let [position, look_at] = [parameters.position, parameters.look_at].map(|point| point.as_dvec3());
        let back = (position - look_at).normalize_or(DVec3::Z);
        let right = parameters.up.as_dvec3().cross(back).normalize_or(DVec3::X);
        let axes = DMat3::from_cols(right, back.cross(right), back);
        let position = position + origin;
        let rows = [0, 1, 2].map(|row| {
            let [x, y, z] = [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis[row]);
            [x, y, z, position[row]]
        });
        let options = CameraOptions {
            pose: Some(PoseMatrix {
                convention: PoseConvention::Blender,
                rows,
            }),
            position: None,
            look_at: None,
            up: None,
            ..described
        };
        Self {
            name,
            size: Some(size),
            options,
            horizontal_fov: None,
        }
    }

    /// Writes the camera to `path`: to a `.json` file in the format of NeRF's `transforms.json`, or
    /// to a folder as a COLMAP model. An existing camera of the same name is replaced. Other
    /// existing cameras are kept.
    ///
    /// # Errors
    ///
    /// The format does not support the projection, an existing file has other contents, or writing
    /// fails.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        if let Some(layout) = self.options.stereo {
            let message = format!("the file cannot store a camera with stereo `{}`", layout.text());
            let help = "leave out --stereo; --dump-scene writes every camera";
            return Err(FileError::new(path, message).help(help));
        }
        if is_transforms(path) {
            transforms::write(path, self)
        } else {
            colmap::write(path, self)
        }
    }

    /// Files that [`FileCamera::write`] writes for `path`: the `.json` file, or the files of the
    /// COLMAP model.
    ///
    /// # Errors
    ///
    /// The name of `path` belongs to a format that is not written.
    pub fn files(path: &Path) -> Result<Vec<PathBuf>, FileError> {
        if is_transforms(path) {
            return Ok(vec![path.into()]);
        }
        if path.extension().is_some() && !path.is_dir() {
            let help = "give a .json file, or a folder for a COLMAP model";
            return Err(FileError::new(path, "cameras are not written in this format").help(help));
        }
        Ok(colmap::FILES.map(|name| path.join(name)).into())
    }

    /// Intrinsics and distortion of a camera that is written; `None` if the projection has no
    /// intrinsics.
    fn calibration(&self, size: UVec2) -> Option<(Intrinsics, Distortion)> {
        let options = &self.options;
        let is_fisheye = options.projection == Some(ProjectionKind::Fisheye);
        if let Some(intrinsics) = options.intrinsics {
            let none = if is_fisheye {
                Distortion::Fisheye([0.0; 4])
            } else {
                Distortion::Pinhole([0.0; 5])
            };
            let given = options.distortion.and_then(|given| given.distortion(is_fisheye));
            return Some((intrinsics, given.unwrap_or(none)));
        }
        let size = size.as_dvec2();
        let center = 0.5 * size;
        match options.projection() {
            ProjectionKind::Perspective => {
                let fov = f64::from(options.vertical_fov?).to_radians();
                let focal = 0.5 * size.y / (0.5 * fov).tan();
                let shift = size.y * options.shift.unwrap_or(Vec2::ZERO).as_dvec2();
                let intrinsics = Intrinsics {
                    focal: [focal; 2],
                    center: [center.x - shift.x, center.y + shift.y],
                };
                Some((intrinsics, Distortion::Pinhole([0.0; 5])))
            }
            // The fisheye model of OpenCV has only the equidistant mapping
            ProjectionKind::Fisheye if options.fisheye_mapping() == FisheyeMapping::Equidistant => {
                let focal = size.y / f64::from(options.fisheye_fov()).to_radians();
                let intrinsics = Intrinsics {
                    focal: [focal; 2],
                    center: center.into(),
                };
                Some((intrinsics, Distortion::Fisheye([0.0; 4])))
            }
            _ => None,
        }
    }

    /// Error that the format of `path` does not support the camera's projection. `possible` is the
    /// help.
    fn no_projection(&self, path: &Path, possible: &str) -> FileError {
        let message = format!(
            "the file cannot store a camera with the projection `{}`",
            self.options.projection().text()
        );
        FileError::new(path, message).help(format!("{possible}; --dump-scene writes every camera"))
    }

    /// Size of the picture in pixels, and pose matrix from the camera to the world.
    fn written(&self) -> (UVec2, [[f64; 4]; 3]) {
        let rows = self.options.pose.map_or([[0.0; 4]; 3], |pose| pose.rows);
        (self.size.unwrap_or(UVec2::ONE), rows)
    }
}

/// Error of a JSON file, with its line and column.
fn json_error(path: &Path, error: &serde_json::Error) -> FileError {
    let place = Position {
        line: error.line(),
        column: Some(error.column()),
    };
    FileError::new(path, error.to_string()).at(place)
}

fn is_transforms(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// Options of a calibrated camera with these intrinsics and this distortion.
fn calibrated(intrinsics: Intrinsics, distortion: Distortion) -> CameraOptions {
    let is_fisheye = matches!(distortion, Distortion::Fisheye(_));
    CameraOptions {
        projection: is_fisheye.then_some(ProjectionKind::Fisheye),
        intrinsics: Some(intrinsics),
        distortion: DistortionCoefficients::of(distortion),
        ..CameraOptions::default()
    }
}

/// Text that lists the names of the first [`MAX_NAMES`] cameras, and the number of further cameras.
fn list_of(cameras: &[FileCamera]) -> String {
    let names: Vec<&str> = cameras.iter().take(MAX_NAMES).map(|camera| &*camera.name).collect();
    let more = cameras.len().saturating_sub(MAX_NAMES);
    let rest = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    names.join(", ") + &rest
}

#[cfg(test)]
mod tests;
