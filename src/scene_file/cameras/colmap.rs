//! COLMAP models: a folder with the files `cameras` and `images`, as text or binary.
//!
//! Source: COLMAP's documentation, "Output Format". Poses are transforms from the world to the
//! camera, with the axes of OpenCV. The centre of the first pixel is at (0.5, 0.5).

use super::{FileCamera, calibrated};
use crate::camera::{Distortion, Intrinsics};
use crate::files::input::read_bytes;
use crate::files::{Output, create_folder, read_text};
use crate::math::{DMat3, DQuat, DVec3, UVec2, excerpt};
use crate::options::{CameraOptions, PoseConvention, PoseMatrix};
use crate::scene_file::{FileError, Position};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;

/// Files of a model in text format.
pub(super) const FILES: [&str; 3] = ["cameras.txt", "images.txt", "points3D.txt"];

/// Camera models: name and number of parameters. The index in this list is COLMAP's id of the
/// model.
const MODELS: [(&str, usize); 11] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
];

/// Lens of a camera, from the file `cameras`.
#[derive(Clone)]
struct Lens {
    size: UVec2,
    options: CameraOptions,
}

/// Picture and its pose, from the file `images`.
struct Picture {
    name: String,
    camera: u32,
    /// Rotation as a quaternion (w, x, y, z), and translation, from the world to the camera.
    rotation: [f64; 4],
    translation: [f64; 3],
}

/// Reads the cameras of the model in the folder `folder`: one for each picture.
pub(super) fn read(folder: &Path) -> Result<Vec<FileCamera>, FileError> {
    let is_there = |name: &str| folder.join(name).is_file();
    let (lenses, pictures, images) = if is_there("cameras.txt") && is_there("images.txt") {
        let images = folder.join("images.txt");
        (
            cameras_of_text(&folder.join("cameras.txt"))?,
            pictures_of_text(&images)?,
            images,
        )
    } else if is_there("cameras.bin") && is_there("images.bin") {
        let images = folder.join("images.bin");
        (
            cameras_of_bytes(&folder.join("cameras.bin"))?,
            pictures_of_bytes(&images)?,
            images,
        )
    } else {
        let message =
            "no COLMAP model: the folder has neither cameras.txt and images.txt nor cameras.bin and images.bin";
        return Err(FileError::new(folder, message).help("give the folder of a model, such as sparse/0"));
    };
    let camera = |picture: Picture| {
        let wrong = |message: String| {
            let message = format!("image `{}`: {message}", excerpt(&picture.name));
            FileError::new(&images, message).help("export the model again")
        };
        let Some(Lens { size, options }) = lenses.get(&picture.camera).cloned() else {
            return Err(wrong(format!("there is no camera {}", picture.camera)));
        };
        let [w, x, y, z] = picture.rotation;
        let rotation = DQuat::from_xyzw(x, y, z, w);
        let is_rotation = rotation.length() > 1e-6 && rotation.is_finite();
        if !is_rotation {
            return Err(wrong(format!("{w} {x} {y} {z} is not a rotation")));
        }
        let axes = DMat3::from_quat(rotation.normalize());
        let row = |row: usize| {
            let [x, y, z] = axes.row(row).into();
            [x, y, z, picture.translation[row]]
        };
        let pose = PoseMatrix {
            convention: PoseConvention::OpenCv,
            rows: [row(0), row(1), row(2)],
        };
        pose.pose().map_err(wrong)?;
        let options = CameraOptions {
            pose: Some(pose),
            ..options
        };
        Ok(FileCamera {
            name: picture.name,
            size: Some(size),
            options,
            horizontal_fov: None,
        })
    };
    pictures.into_iter().map(camera).collect()
}

/// Lens of the camera model `model` with the parameters `parameters`.
fn lens(model: &str, [width, height]: [u64; 2], parameters: &[f64]) -> Result<Lens, String> {
    let side = |side: u64| u32::try_from(side).ok().filter(|side| (1..=65536).contains(side));
    let size = side(width).zip(side(height)).map(UVec2::from);
    let size = size.ok_or_else(|| format!("{width} x {height} is not a size in pixels"))?;
    let pinhole = |focal, center, k: [f64; 5]| (Intrinsics { focal, center }, Distortion::Pinhole(k));
    let fisheye = |focal, center, k: [f64; 4]| (Intrinsics { focal, center }, Distortion::Fisheye(k));
    let (intrinsics, distortion) = match (model, parameters) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => pinhole([f, f], [cx, cy], [0.0; 5]),
        ("PINHOLE", &[fx, fy, cx, cy]) => pinhole([fx, fy], [cx, cy], [0.0; 5]),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => pinhole([f, f], [cx, cy], [k, 0.0, 0.0, 0.0, 0.0]),
        ("RADIAL", &[f, cx, cy, k1, k2]) => pinhole([f, f], [cx, cy], [k1, k2, 0.0, 0.0, 0.0]),
        ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => pinhole([fx, fy], [cx, cy], [k1, k2, p1, p2, 0.0]),
        ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
            if [k4, k5, k6] != [0.0; 3] {
                return Err("the coefficients k4, k5 and k6 of FULL_OPENCV are not supported".into());
            }
            pinhole([fx, fy], [cx, cy], [k1, k2, p1, p2, k3])
        }
        ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => fisheye([fx, fy], [cx, cy], [k1, k2, k3, k4]),
        ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => fisheye([f, f], [cx, cy], [k, 0.0, 0.0, 0.0]),
        ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => fisheye([f, f], [cx, cy], [k1, k2, 0.0, 0.0]),
        _ => {
            let numbers = MODELS
                .iter()
                .find(|(name, _)| *name == model)
                .map(|(_, numbers)| *numbers);
            return Err(match numbers {
                Some(numbers) if numbers != parameters.len() => {
                    format!("{model} has {numbers} parameters, not {}", parameters.len())
                }
                _ => format!(
                    "the camera model `{}` is not supported; possible are SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, OPENCV, FULL_OPENCV, OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE and RADIAL_FISHEYE",
                    excerpt(model)
                ),
            });
        }
    };
    intrinsics.check().map_err(|error| error.to_string())?;
    Ok(Lens {
        size,
        options: calibrated(intrinsics, distortion),
    })
}

/// Error about the line `line` of a file.
fn of_line(path: &Path, line: usize, message: impl Into<String>) -> FileError {
    let error = FileError::new(path, message).at(Position::line(line + 1));
    error.help("export the model again, as text")
}

/// Lines that are not comments, each with its index from 0.
fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().enumerate();
    lines.filter(|(_, line)| !line.trim_start().starts_with('#'))
}

fn cameras_of_text(path: &Path) -> Result<BTreeMap<u32, Lens>, FileError> {
    let text = read_text(path, "the file of cameras")?;
    let camera = |(number, line): (usize, &str)| {
        let wrong = |message: String| of_line(path, number, message);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let [id, model, width, height, ref parameters @ ..] = *words else {
            return Err(wrong("CAMERA_ID MODEL WIDTH HEIGHT PARAMS expected".into()));
        };
        let whole = |word: &str| {
            word.parse::<u64>()
                .map_err(|_| wrong(format!("`{}` is not a whole number", excerpt(word))))
        };
        let number = |word: &&str| {
            word.parse::<f64>()
                .map_err(|_| wrong(format!("`{}` is not a number", excerpt(word))))
        };
        let parameters: Vec<f64> = parameters.iter().map(number).collect::<Result<_, _>>()?;
        let id = u32::try_from(whole(id)?).map_err(|_| wrong(format!("`{id}` is not the number of a camera")))?;
        let lens = lens(model, [whole(width)?, whole(height)?], &parameters).map_err(wrong)?;
        Ok((id, lens))
    };
    lines(&text)
        .filter(|(_, line)| !line.trim().is_empty())
        .map(camera)
        .collect()
}

fn pictures_of_text(path: &Path) -> Result<Vec<Picture>, FileError> {
    let text = read_text(path, "the file of images")?;
    let mut pictures = Vec::new();
    let mut lines = lines(&text);
    while let Some((number, line)) = lines.next() {
        if line.trim().is_empty() {
            continue;
        }
        let mut rest = line;
        let mut word = || {
            rest = rest.trim_start();
            let end = rest.find(|c: char| c.is_ascii_whitespace()).unwrap_or(rest.len());
            let (word, after) = rest.split_at(end);
            rest = after;
            word
        };
        let words: [&str; 9] = std::array::from_fn(|_| word());
        let name = rest.trim();
        let numbers: Vec<f64> = words[..8].iter().filter_map(|word| word.parse().ok()).collect();
        let camera = words[8].parse().ok();
        let (&[_, qw, qx, qy, qz, tx, ty, tz], Some(camera), false) = (&numbers[..], camera, name.is_empty()) else {
            let message = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME expected";
            return Err(of_line(path, number, message));
        };
        pictures.push(Picture {
            name: name.into(),
            camera,
            rotation: [qw, qx, qy, qz],
            translation: [tx, ty, tz],
        });
        // Skip the line with the points of the picture, which may be empty
        lines.next();
    }
    Ok(pictures)
}

/// Bytes of a binary file that were not read yet.
struct Bytes<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], FileError> {
        let Some((head, rest)) = self.rest.split_first_chunk() else {
            let error = FileError::new(self.path, "the file ends within an entry");
            return Err(error.help("copy the file again, or export the model as text"));
        };
        self.rest = rest;
        Ok(*head)
    }

    fn u32(&mut self) -> Result<u32, FileError> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, FileError> {
        self.take().map(u64::from_le_bytes)
    }

    fn f64(&mut self) -> Result<f64, FileError> {
        self.take().map(f64::from_le_bytes)
    }

    fn f64s<const N: usize>(&mut self) -> Result<[f64; N], FileError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Ok(numbers)
    }

    fn skip(&mut self, bytes: u64) -> Result<(), FileError> {
        let rest = usize::try_from(bytes).ok().and_then(|bytes| self.rest.get(bytes..));
        match rest {
            Some(rest) => self.rest = rest,
            // Too few bytes are left: return the error that the file ends too early
            None => {
                self.rest = &[];
                self.take::<1>()?;
            }
        }
        Ok(())
    }
}

fn cameras_of_bytes(path: &Path) -> Result<BTreeMap<u32, Lens>, FileError> {
    let all = read_bytes(path, "the file of cameras")?;
    let mut bytes = Bytes { path, rest: &all };
    let mut lenses = BTreeMap::new();
    for _ in 0..bytes.u64()? {
        let (id, model) = (bytes.u32()?, bytes.u32()?);
        let wrong = |message: String| {
            let message = format!("camera {id}: {message}");
            FileError::new(path, message).help("export the model as text")
        };
        let size = [bytes.u64()?, bytes.u64()?];
        let Some(&(name, count)) = MODELS.get(model as usize) else {
            return Err(wrong(format!("the camera model {model} is not known")));
        };
        let parameters: Vec<f64> = (0..count).map(|_| bytes.f64()).collect::<Result<_, _>>()?;
        lenses.insert(id, lens(name, size, &parameters).map_err(wrong)?);
    }
    Ok(lenses)
}

fn pictures_of_bytes(path: &Path) -> Result<Vec<Picture>, FileError> {
    /// Number of bytes of an image point of a picture: two coordinates and an id.
    const POINT: u64 = 24;
    let all = read_bytes(path, "the file of images")?;
    let mut bytes = Bytes { path, rest: &all };
    let mut pictures = Vec::new();
    for _ in 0..bytes.u64()? {
        bytes.u32()?;
        let (rotation, translation) = (bytes.f64s()?, bytes.f64s()?);
        let camera = bytes.u32()?;
        let end = bytes.rest.iter().position(|&byte| byte == 0);
        let name = String::from_utf8_lossy(&bytes.rest[..end.unwrap_or(0)]).into_owned();
        bytes.skip(end.map_or(u64::MAX, |end| end as u64 + 1))?;
        let points = bytes.u64()?;
        bytes.skip(points.saturating_mul(POINT))?;
        pictures.push(Picture {
            name,
            camera,
            rotation,
            translation,
        });
    }
    Ok(pictures)
}

/// Writes `camera` to the model in `folder`. The camera replaces a picture of the same name.
pub(super) fn write(folder: &Path, camera: &FileCamera) -> Result<(), FileError> {
    let files = FILES.map(|name| folder.join(name));
    let mut cameras = Vec::new();
    if files[..2].iter().all(|file| file.is_file()) {
        cameras = read(folder)?;
    }
    match cameras.iter_mut().find(|old| old.name == camera.name) {
        Some(old) => old.clone_from(camera),
        None => cameras.push(camera.clone()),
    }
    let (mut lenses, mut pictures) = (String::new(), String::new());
    for (id, camera) in (1..).zip(&cameras) {
        let (size, _) = camera.written();
        let Some((Intrinsics { focal, center }, distortion)) = camera.calibration(size) else {
            return Err(camera.no_projection(folder, "COLMAP stores perspectives and equidistant fisheyes"));
        };
        let [[fx, fy], [cx, cy]] = [focal, center];
        let (model, more) = match distortion {
            Distortion::Pinhole([0.0, 0.0, 0.0, 0.0, 0.0]) => ("PINHOLE", vec![]),
            Distortion::Pinhole([k1, k2, p1, p2, 0.0]) => ("OPENCV", vec![k1, k2, p1, p2]),
            Distortion::Pinhole([k1, k2, p1, p2, k3]) => ("FULL_OPENCV", vec![k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]),
            Distortion::Fisheye(k) => ("OPENCV_FISHEYE", k.to_vec()),
        };
        let more: String = more.iter().map(|k| format!(" {k}")).collect();
        lenses += &format!("{id} {model} {} {} {fx} {fy} {cx} {cy}{more}\n", size.x, size.y);
        let (rotation, [x, y, z]) = world_to_camera(camera);
        let DQuat {
            x: qx,
            y: qy,
            z: qz,
            w: qw,
        } = rotation;
        pictures += &format!("{id} {qw} {qx} {qy} {qz} {x} {y} {z} {id} {}\n\n", camera.name);
    }
    create_folder(folder)?;
    let texts = [
        format!("# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n{lenses}"),
        format!("# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, then a line of points\n{pictures}"),
        "# POINT3D_ID X Y Z R G B ERROR TRACK[]\n".into(),
    ];
    for (file, text) in files.iter().zip(texts) {
        // Keep the 3-D points of an existing model
        if !(file.ends_with(FILES[2]) && file.exists()) {
            Output::prepare(file)?.write(|writer| writer.write_all(text.as_bytes()))?;
        }
    }
    Ok(())
}

/// Rotation and translation of a camera from the world to the camera, in COLMAP's convention.
fn world_to_camera(camera: &FileCamera) -> (DQuat, [f64; 3]) {
    let pose = camera.options.pose.and_then(|pose| pose.pose().ok());
    let Some(pose) = pose else {
        return (DQuat::IDENTITY, [0.0; 3]);
    };
    let forward = (pose.look_at - pose.position).normalize_or(DVec3::Z);
    let right = forward.cross(pose.up).normalize_or(DVec3::X);
    let to_world = DMat3::from_cols(right, forward.cross(right), forward);
    let to_camera = to_world.transpose();
    let translation = -(to_camera * pose.position);
    (DQuat::from_mat3(&to_camera), translation.into())
}
