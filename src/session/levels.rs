//! Numbers of subdivision steps that depend on the camera (`subdivision = "pixels:1.5"`).
//!
//! The number of steps is the smallest number after which no edge of the object is longer in the
//! picture than the given number of pixels. Each step halves the edges. A limit for a percentile of
//! the edges would ignore the few near edges of a large ground, which fill the picture. The length
//! of an edge in pixels is computed as if the edge were parallel to the image plane, at the
//! distance of its nearest point. Edges outside the picture count, because reflections and shadows
//! show them. The number therefore does not depend on the crop.

use super::lighting::settled;
use super::{Error, LitWords, Session, Settings};
use crate::camera::{Camera, CameraDescription};
use crate::description::{LEVELS, ObjectCage, SceneFile};
use crate::geometry::MAX_STEPS;
use crate::guess::{CameraGuess, SiblingFiles};
use crate::io::{Cage, LoadObserver, Warning};
use crate::math::{Affine3A, Bounds3, Vec3};
use std::collections::BTreeMap;

/// Minimum distance of edges from the camera, as a fraction of the diagonal of the object. Without
/// this minimum, an edge that passes close to the camera would need an unlimited number of
/// subdivision steps.
const NEAR: f32 = 0.01;
/// Tolerance of the number of subdivision steps. The length of an edge may be exactly a power of
/// two times the maximum, and a rounding error must not add a step.
const ROUNDING: f32 = 1e-3;
/// Maximum number of objects in a message.
const MAX_NAMES: usize = 8;

/// Camera, light and settings found in a session of the scene without subdivision.
struct Coarse {
    file: SceneFile,
    settings: Settings,
    description: CameraDescription,
    camera_guess: Option<CameraGuess>,
    siblings: SiblingFiles,
    given_camera: super::CameraSettings,
    lit_words: Option<LitWords>,
    guess_seconds: f64,
}

impl Session {
    /// Session for a file with numbers of subdivision steps that depend on the camera. If the
    /// camera or the light is guessed, it is guessed in the scene without these steps.
    pub(super) fn load_by_pixels(
        file: &SceneFile,
        settings: Settings,
        observer: &dyn LoadObserver,
    ) -> Result<Self, Error> {
        let cages = file.cages()?;
        let is_given =
            !settings.camera.needs_scene() && settings.camera.elevation.is_none() && settings.print.is_none();
        if is_given {
            let found = settings.camera.found(None, settings.resolution);
            // If the camera has an error, loading the scene reports the error with its place in the
            // file
            if let Ok(found) = found {
                let levels = levels(&cages, &found.description, &settings)?;
                drop(cages);
                let file = file.with_levels(&levels);
                let mut session = Self::load(&file, settings, observer)?;
                session.say_levels(&file, &levels);
                session.lit_file.get_or_insert(file);
                return Ok(session);
            }
        }
        let coarse = Self::load(&file.with_levels(&BTreeMap::new()), settings, observer)?;
        let coarse = Coarse {
            file: coarse.lit_file.unwrap_or_else(|| file.clone()),
            settings: settled(&coarse.settings, &coarse.description.parameters),
            description: coarse.description,
            camera_guess: coarse.camera_guess,
            siblings: coarse.siblings,
            given_camera: coarse.given_camera,
            lit_words: coarse.lit_words,
            guess_seconds: coarse.guess_seconds,
        };
        let levels = levels(&cages, &coarse.description, &coarse.settings)?;
        drop(cages);
        let file = coarse.file.with_levels(&levels);
        let mut session = Self {
            camera_guess: coarse.camera_guess,
            siblings: coarse.siblings,
            given_camera: coarse.given_camera,
            lit_words: coarse.lit_words,
            ..Self::load(&file, coarse.settings, observer)?
        };
        session.guess_seconds += coarse.guess_seconds;
        session.say_levels(&file, &levels);
        session.lit_file = Some(file);
        Ok(session)
    }

    /// Adds a note with the number of subdivision steps of each object.
    fn say_levels(&mut self, file: &SceneFile, levels: &BTreeMap<usize, u32>) {
        let name = |(&index, level): (&usize, &u32)| {
            let path = file.object.get(index)?.obj.get_ref();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            Some(format!("{level} for {name}"))
        };
        let mut names: Vec<String> = levels.iter().take(MAX_NAMES).filter_map(name).collect();
        if levels.len() > MAX_NAMES {
            names.push(format!("and so on for {} objects", levels.len()));
        }
        if !names.is_empty() {
            let text = format!("subdivision by pixels: steps {}", names.join(", "));
            self.warnings.push(Warning::new(LEVELS, text));
        }
    }
}

/// Number of subdivision steps of each object of `cages`, by the object's index.
fn levels(
    cages: &[ObjectCage],
    description: &CameraDescription,
    settings: &Settings,
) -> Result<BTreeMap<usize, u32>, Error> {
    let views = description.views(settings.resolution)?;
    let cameras: Vec<Camera> = views.iter().map(|view| view.camera).collect();
    Ok(cages.iter().map(|cage| (cage.object, level(cage, &cameras))).collect())
}

/// Number of subdivision steps that the object of `cage` needs in the pictures of `cameras`. It is
/// the maximum over all placements, at both ends of the motion.
fn level(cage: &ObjectCage, cameras: &[Camera]) -> u32 {
    let mut level = 0;
    for placement in &cage.placements {
        let moves = placement.is_moving() || cage.close.is_some() || cameras.iter().any(Camera::is_moving);
        let ends = [(0.0, &cage.open), (1.0, cage.close.as_ref().unwrap_or(&cage.open))];
        for &(time, shape) in &ends[..if moves { 2 } else { 1 }] {
            let transform = placement.at(time);
            for camera in cameras {
                let view = CameraAt::new(camera, time, shape, &transform);
                // Skip the edges of a copy that surely needs no more steps than the copies before
                if steps(view.max_pixels(shape, &transform) / cage.pixels) > level {
                    let pixels = shape
                        .ends()
                        .map(|ends| view.pixels(ends.map(|p| transform.transform_point3a(p))));
                    level = level.max(steps(pixels.fold(0.0, f32::max) / cage.pixels));
                }
            }
        }
    }
    level
}

/// Smallest number of subdivision steps for an edge whose length is `excess` times the maximum
/// length: after these steps, the parts of the edge are not longer than the maximum.
fn steps(excess: f32) -> u32 {
    (excess.log2() - ROUNDING).ceil().clamp(0.0, MAX_STEPS as f32) as u32
}

/// A camera at one time of the shutter, with the minimum width of a pixel for an object.
struct CameraAt<'a> {
    camera: &'a Camera,
    time: f32,
    position: Vec3,
    /// Bounding box of the object.
    bounds: Bounds3,
    /// Minimum width of a pixel, in scene units.
    min_width: f32,
}

impl<'a> CameraAt<'a> {
    /// `camera` at `time`, for an object with the edges `shape` and the placement `transform`.
    fn new(camera: &'a Camera, time: f32, shape: &Cage, transform: &Affine3A) -> Self {
        let corners = shape.bounds.corners().into_iter();
        let bounds: Bounds3 = corners.map(|corner| transform.transform_point3a(corner)).collect();
        Self {
            camera,
            time,
            position: camera.position(time),
            min_width: NEAR * 2.0 * bounds.radius() * camera.pixel_width_by_distance(),
            bounds,
        }
    }

    /// Width of a pixel at the distance of `p`, in scene units.
    fn width(&self, p: Vec3) -> f32 {
        self.camera.pixel_width(p, self.time).max(self.min_width)
    }

    /// Length of an edge in pixels.
    fn pixels(&self, [a, b]: [Vec3; 2]) -> f32 {
        let along = b - a;
        let share = (self.position - a).dot(along) / along.length_squared();
        let nearest = a + share.clamp(0.0, 1.0) * along;
        // An edge without length has no nearest point
        let width = self.width(if nearest.is_finite() { nearest } else { a });
        along.length() / width
    }

    /// Upper bound of the length of an edge of `shape` in pixels.
    fn max_pixels(&self, shape: &Cage, transform: &Affine3A) -> f32 {
        // The largest eigenvalue of AᵀA is at most the largest sum of absolute values of a column
        let square = transform.matrix3.transpose() * transform.matrix3;
        let columns = [square.x_axis, square.y_axis, square.z_axis];
        let stretch = columns
            .map(|column| column.abs().element_sum())
            .into_iter()
            .fold(0.0, f32::max);
        let nearest = self.position.clamp(self.bounds.min, self.bounds.max);
        shape.longest * stretch.sqrt() / self.width(nearest)
    }
}
