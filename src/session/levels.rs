//! Numbers of subdivision steps that depend on the camera (`subdivision = "pixels:1.5"`).
//!
//! The number of steps is the smallest number after which no edge of the object is longer in the
//! picture than the given number of pixels. Each step halves the edges. A limit for a percentile of
//! the edges would ignore the few near edges of a large ground, which fill the picture. The length
//! of an edge in pixels is computed as if the edge were parallel to the image plane, at the
//! distance of its nearest point. Edges outside the picture count, because reflections and shadows
//! show them. The number therefore does not depend on the crop.

use super::lighting::{LitWords, settled};
use super::{Error, Session, Settings};
use crate::camera::{Camera, CameraDescription};
use crate::geometry::MAX_STEPS;
use crate::guess::{CameraGuess, SiblingFiles};
use crate::io::{Cage, CageNode, LoadObserver, Warning};
use crate::math::{Affine3A, Bounds3, Vec3};
use crate::scene_file::{LEVELS, ObjectCage, SceneFile};
use std::collections::BTreeMap;

/// Minimum distance of edges from the camera, as a fraction of the diagonal of the object. Without
/// this minimum, an edge that passes close to the camera would need an unlimited number of
/// subdivision steps.
const NEAR: f32 = 0.01;
/// Tolerance of the number of subdivision steps. The length of an edge may be exactly a power of
/// two times the maximum, and a rounding error must not add a step.
const ROUNDING: f32 = 1e-3;
/// Maximum number of edges that are measured. If a scene has more edges near the camera, an upper
/// bound of their lengths replaces the lengths of the further edges.
const MAX_EDGES: u64 = 1 << 27;
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
        let is_given =
            !settings.camera.needs_scene() && settings.camera.elevation.is_none() && settings.print.is_none();
        if is_given {
            let found = settings.camera.found(None, settings.resolution);
            // If the camera has an error, loading the scene reports the error with its place in the
            // file
            if let Ok(found) = found {
                let levels = levels(&file.cages()?, &found.description, &settings)?;
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
        // The coarse scene is no longer in memory here.
        let levels = levels(&file.cages()?, &coarse.description, &coarse.settings)?;
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
    let mut edges_left = MAX_EDGES;
    let mut level_of = |cage: &ObjectCage| (cage.object, level(cage, &cameras, &mut edges_left));
    Ok(cages.iter().map(&mut level_of).collect())
}

/// Number of subdivision steps that the object of `cage` needs in the pictures of `cameras`. It is
/// the maximum over all placements, at both ends of the motion. At most `edges_left` edges are
/// measured. This number is reduced by the number of measured edges.
fn level(cage: &ObjectCage, cameras: &[Camera], edges_left: &mut u64) -> u32 {
    let mut level = 0;
    for placement in &cage.placements {
        let moves = placement.is_moving() || cage.close.is_some() || cameras.iter().any(Camera::is_moving);
        let ends = [(0.0, &cage.open), (1.0, cage.close.as_ref().unwrap_or(&cage.open))];
        for &(time, shape) in &ends[..if moves { 2 } else { 1 }] {
            let transform = placement.at(time);
            for camera in cameras {
                let view = CameraAt::new(camera, time, shape, &transform);
                level = level.max(view.level_above(level, shape, cage.pixels, edges_left));
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
    transform: &'a Affine3A,
    /// Upper bound of the factor by which the transform makes an edge longer.
    stretch: f32,
    /// Minimum width of a pixel, in scene units.
    min_width: f32,
}

impl<'a> CameraAt<'a> {
    /// `camera` at `time`, for an object with the edges `shape` and the placement `transform`.
    fn new(camera: &'a Camera, time: f32, shape: &Cage, transform: &'a Affine3A) -> Self {
        let bounds = placed(&shape.bounds, transform);
        // The largest eigenvalue of AᵀA is at most the largest sum of absolute values of a column
        let square = transform.matrix3.transpose() * transform.matrix3;
        let columns = [square.x_axis, square.y_axis, square.z_axis];
        let stretch = columns
            .map(|column| column.abs().element_sum())
            .into_iter()
            .fold(0.0, f32::max);
        Self {
            camera,
            time,
            position: camera.position(time),
            transform,
            stretch: stretch.sqrt(),
            min_width: NEAR * 2.0 * bounds.radius() * camera.pixel_width_by_distance(),
        }
    }

    /// Number of subdivision steps for the edges of `shape`, if it is above `level`. Otherwise
    /// returns `level`. Skips nodes whose edges surely need no more steps.
    fn level_above(&self, mut level: u32, shape: &Cage, max: f32, edges_left: &mut u64) -> u32 {
        let mut index = 0;
        while let Some(node) = shape.nodes().get(index) {
            let bound = steps(self.max_pixels(node) / max);
            if bound <= level {
                index = node.next;
                continue;
            }
            let ends = shape.ends_in(node);
            let count = ends.len() as u64;
            if count > *edges_left {
                level = bound;
                index = node.next;
                continue;
            }
            *edges_left -= count;
            let pixels = ends.map(|ends| self.pixels(ends.map(|p| self.transform.transform_point3a(p))));
            level = level.max(steps(pixels.fold(0.0, f32::max) / max));
            index += 1;
        }
        level
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

    /// Upper bound of the length of an edge of `node` in pixels.
    fn max_pixels(&self, node: &CageNode) -> f32 {
        let bounds = placed(&node.bounds, self.transform);
        let nearest = self.position.clamp(bounds.min, bounds.max);
        node.longest * self.stretch / self.width(nearest)
    }
}

/// Bounding box of `bounds` after the transform.
fn placed(bounds: &Bounds3, transform: &Affine3A) -> Bounds3 {
    let corners = bounds.corners().into_iter();
    corners.map(|corner| transform.transform_point3a(corner)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraParameters;
    use crate::geometry::Placement;
    use crate::io::LoadOptions;
    use crate::math::{Quat, UVec2};
    use std::sync::Arc;

    /// Cage of a height field of `n` × `n` quads around the origin.
    fn field(n: usize) -> Cage {
        let mut text = String::new();
        for i in 0..(n + 1) * (n + 1) {
            let (x, y) = (i % (n + 1), i / (n + 1));
            let height = (7 * x + 3 * y) % 5;
            text += &format!(
                "v {} 0.{height} {}\n",
                x as f32 - 0.5 * n as f32,
                y as f32 - 0.5 * n as f32
            );
        }
        for i in (0..n * n).map(|i| i / n * (n + 1) + i % n + 1) {
            text += &format!("f {i} {} {} {}\n", i + n + 1, i + n + 2, i + 1);
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        Cage::read(&path, &LoadOptions::default(), 0).unwrap().unwrap()
    }

    fn camera() -> Camera {
        let parameters = CameraParameters {
            position: Vec3::new(0.3, 4.0, 0.2),
            look_at: Vec3::new(1.0, 0.0, 2.0),
            up: Vec3::Y,
            vertical_fov: 60.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        Camera::new(parameters, UVec2::splat(256)).unwrap()
    }

    /// Copies of `cage` on a ring around the camera, turned and scaled in different ways.
    fn copies(cage: Cage, count: usize) -> ObjectCage {
        let placement = |i: usize| {
            let angle = i as f32;
            let scale = Vec3::new(1.0, 0.5 + 0.25 * (i % 3) as f32, 1.0 + (i % 2) as f32);
            let center = Vec3::new(60.0 * angle.cos(), 0.0, 60.0 * angle.sin());
            let transform = Affine3A::from_scale_rotation_translation(
                scale.into(),
                Quat::from_rotation_y(1.7 * angle),
                center.into(),
            );
            Placement::Still(transform)
        };
        ObjectCage {
            object: 0,
            pixels: 2.0,
            open: Arc::new(cage),
            close: None,
            placements: (0..count).map(placement).collect(),
        }
    }

    /// The tree of edges gives the number of steps of all edges, and measures few of them.
    #[test]
    fn tree_finds_the_level_of_all_edges() {
        let (cage, camera) = (copies(field(40), 300), camera());
        let shape = &cage.open;
        let mut expected = 0;
        for placement in &cage.placements {
            let transform = placement.at(0.0);
            let view = CameraAt::new(&camera, 0.0, shape, &transform);
            for ends in shape.nodes().iter().flat_map(|node| shape.ends_in(node)) {
                let pixels = view.pixels(ends.map(|p| transform.transform_point3a(p)));
                expected = expected.max(steps(pixels / cage.pixels));
            }
        }
        let mut left = MAX_EDGES;
        assert_eq!(level(&cage, &[camera], &mut left), expected);
        assert!((1..MAX_STEPS).contains(&expected), "{expected}");
        let measured = MAX_EDGES - left;
        assert!(measured < 300 * 2 * 40 * 41 / 20, "{measured}");
        // Without any edge left, the bound of the lengths is used.
        let bound = level(&cage, &[camera], &mut 0);
        assert!((expected..=expected + 2).contains(&bound), "{bound}");
    }
}
