//! Camera settings. They describe the camera, together with a guess if settings are missing.

use crate::accel::Accel;
use crate::camera::{
    Aperture, Camera, CameraAttributes, CameraDescription, CameraError, CameraMotion, CameraParameters, Distortion,
    Intrinsics, Pose, Projection, ProjectionKind, Stereo,
};
use crate::geometry::Hit;
use crate::guess::{CameraFinder, CameraGuess, CameraRequest, FileAxes, SiblingFiles, near_distance};
use crate::io::{FileError, Finding};
use crate::lint::{inspect_place, inspect_view};
use crate::math::{DVec3, UVec2, Vec2, Vec3, nearest_axis};
use crate::options::CameraOptions;
use crate::parameter::Value;
use crate::scene::Scene;
use crate::scene_file::{SceneFile, Viewpoint};
use std::ops::{Deref, DerefMut};

/// Default vertical field of view in degrees, for a camera whose position and target are given.
const DEFAULT_FOV: f32 = 40.0;

/// Camera settings. Missing settings are guessed from the scene (`crate::guess`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct CameraSettings {
    /// Camera options of the scene file and of flags.
    pub options: CameraOptions,
    /// Length in metres of one unit of the OBJ file, if the comments of the file state it. Guesses
    /// use this length.
    pub unit: Option<f32>,
    /// Axes according to the comments of the OBJ file. Guesses use these axes.
    pub axes: FileAxes,
    /// Point in OBJ coordinates that is the origin of the scene. Messages use this point to print
    /// OBJ coordinates.
    pub origin: DVec3,
}

impl Deref for CameraSettings {
    type Target = CameraOptions;

    fn deref(&self) -> &CameraOptions {
        &self.options
    }
}

impl DerefMut for CameraSettings {
    fn deref_mut(&mut self) -> &mut CameraOptions {
        &mut self.options
    }
}

impl CameraSettings {
    /// Camera settings of the scene file.
    pub fn of(file: &SceneFile) -> Self {
        Self {
            options: file.options.camera.placed(),
            unit: file.unit(),
            axes: file.axes(),
            origin: file.origin(),
        }
    }

    /// Viewpoint according to these settings, before the scene is loaded. The up direction of the
    /// scene is +z if the coordinate axis nearest to the camera's up is +z. Else it is +y, because
    /// a camera that rolls or views straight down may have another axis as its up.
    pub(crate) fn viewpoint(&self) -> Viewpoint {
        let is_nearest_to_z = |up: &Vec3| up.z > up.x.abs() && up.z > up.y.abs();
        Viewpoint {
            back: self
                .position
                .zip(self.look_at)
                .map(|(position, at)| (position - at).as_vec3a()),
            up: self.up,
            scene_up: self.up.filter(is_nearest_to_z).map(|_| Vec3::Z),
        }
    }

    /// The origin as `x,y,z`; `None` if the scene has the origin of the OBJ file.
    pub(crate) fn origin_text(&self) -> Option<String> {
        let list = || self.origin.to_array().map(|x| x.to_string()).join(",");
        (self.origin != DVec3::ZERO).then(list)
    }

    /// Properties of `camera` as attributes of image files. If the unit of the scene is unknown, it
    /// is taken as the metre. If the settings have a sensor height or an f-number, the sensor has
    /// the height `sensor_height`, in scene units. Else it is a full-frame sensor, 24 mm high. The
    /// camera of a stereo picture is in the middle of the eyes.
    pub(crate) fn attributes(&self, camera: &Camera) -> CameraAttributes {
        const FULL_FRAME: f32 = 0.024;
        let metres = self.unit.unwrap_or(1.0);
        let is_of_scene = self.sensor_height.is_some() || self.f_stop.is_some();
        let sensor = if is_of_scene {
            self.sensor_height() * metres
        } else {
            FULL_FRAME
        };
        camera.attributes(sensor, metres)
    }

    /// Returns true if the camera depends on the scene: it needs a guess, or rays traced in the
    /// scene.
    pub(super) fn needs_scene(&self) -> bool {
        self.position.is_none() || self.look_at.is_none() || self.focus_at.is_some()
    }

    /// Finder of the camera in `scene`, with rays traced by `accel` and the evidence of `siblings`.
    pub(crate) fn finder<'a>(
        &self,
        scene: &'a Scene,
        accel: &'a dyn Accel,
        resolution: UVec2,
        siblings: SiblingFiles,
    ) -> CameraFinder<'a> {
        let request = CameraRequest {
            position: self.position.map(|position| position.as_vec3a()),
            look_at: self.look_at.map(|look_at| look_at.as_vec3a()),
            up: self.up,
            vertical_fov: self.fov(resolution),
            view: self.view.unwrap_or_default(),
            orbit: self.orbit,
            stand: self.stand,
            yaw: self.yaw,
            unit: self.unit,
            axes: self.axes,
            siblings,
            origin: self.origin,
        };
        let view = self.view_size(resolution);
        CameraFinder::new(scene, accel, request, view.x as f32 / view.y as f32)
    }

    /// Returns the description of the camera, and the guess if one was made. If
    /// [`Self::needs_scene`] returns true, `finder` must be given. `finder` must come from these
    /// settings.
    fn describe(
        &self,
        finder: Option<&CameraFinder>,
        resolution: UVec2,
    ) -> Result<(CameraDescription, Option<CameraGuess>), CameraError> {
        if let Some(intrinsics) = self.intrinsics {
            intrinsics.check()?;
        }
        if let Some(Err(message)) = self.pose.map(|matrix| matrix.pose()) {
            return Err(CameraError::wrong("pose", message));
        }
        let (guess, pose) = match (self.position, self.look_at, finder) {
            (Some(position), Some(look_at), _) => {
                let [position, look_at] = [position, look_at].map(|point| point.as_vec3a());
                let up = self.up.unwrap_or(Vec3::Y);
                (
                    None,
                    (
                        Pose { position, look_at, up },
                        self.fov(resolution).unwrap_or(DEFAULT_FOV),
                    ),
                )
            }
            (.., Some(finder)) => {
                let guess = finder.camera()?;
                let CameraGuess {
                    position,
                    look_at,
                    up,
                    vertical_fov,
                    ..
                } = guess;
                (Some(guess), (Pose { position, look_at, up }, vertical_fov))
            }
            _ => return Err(CameraError::unknown("position")),
        };
        let (Pose { position, look_at, up }, vertical_fov) = pose;
        let mut parameters = CameraParameters {
            position,
            look_at,
            up,
            vertical_fov,
            lens_radius: self.radius(vertical_fov)?,
            focus_distance: self.focus_distance.unwrap_or_else(|| distance(position, look_at)),
        };
        if let (Some(at), Some(finder)) = (self.focus_at, finder) {
            let view = self.view_size(resolution);
            // `at` is a pixel of one view. For a stereo picture, the rays come from the camera in
            // the middle of the eyes.
            let last = (resolution / view).saturating_sub(UVec2::ONE).as_vec2();
            let corner = (at / view.as_vec2()).floor().clamp(Vec2::ZERO, last) * view.as_vec2();
            let at = at - corner;
            parameters.focus_distance = focus_distance(parameters, finder.accel(), at, view)?;
        }
        let motion = self.motion(&parameters);
        let aperture = self.aperture_blades.map(|blades| Aperture {
            blades,
            rotation: self.aperture_rotation(),
        });
        let description = CameraDescription {
            parameters,
            motion,
            aperture,
            projection: self.described_projection(&parameters)?,
            stereo: self.described_stereo()?,
        };
        Ok((description, guess))
    }

    /// Vertical field of view in degrees; `None` if it is not given. For a calibrated camera it is
    /// computed from the focal length.
    fn fov(&self, resolution: UVec2) -> Option<f32> {
        let of = |intrinsics: Intrinsics| {
            2.0 * (0.5 * f64::from(self.view_size(resolution).y) / intrinsics.focal[1])
                .atan()
                .to_degrees()
        };
        self.intrinsics
            .map(|intrinsics| of(intrinsics) as f32)
            .or(self.vertical_fov)
    }

    /// Projection for the camera of `parameters`. Returns an error if a key of another projection
    /// is set.
    fn described_projection(&self, parameters: &CameraParameters) -> Result<Projection, CameraError> {
        use ProjectionKind::{Cubemap, Fisheye, Orthographic, Panorama, Perspective};
        let kind = self.projection();
        let keys = [
            ("ortho_height", self.ortho_height.is_some(), kind == Orthographic),
            (
                "shift",
                self.shift.is_some(),
                matches!(kind, Perspective | Orthographic),
            ),
            (
                "intrinsics",
                self.intrinsics.is_some(),
                matches!(kind, Perspective | Fisheye),
            ),
            ("fisheye_fov", self.fisheye_fov.is_some(), kind == Fisheye),
            ("fisheye_mapping", self.fisheye_mapping.is_some(), kind == Fisheye),
        ];
        if let Some((key, ..)) = keys.into_iter().find(|(_, is_given, fits)| *is_given && !fits) {
            let message = format!("has no meaning in the projection `{}`", kind.text());
            return Err(CameraError::wrong(key, message));
        }
        let shift = self.shift.unwrap_or(Vec2::ZERO);
        if let Some(intrinsics) = self.intrinsics {
            let distortion = match self.distortion {
                Some(coefficients) => coefficients.distortion(kind == Fisheye),
                None if kind == Fisheye => Some(Distortion::Fisheye([0.0; 4])),
                None => Some(Distortion::Pinhole([0.0; 5])),
            };
            let distortion = distortion.ok_or_else(|| {
                CameraError::wrong("distortion", "has five numbers, but a fisheye needs four: k1,k2,k3,k4")
            })?;
            return Ok(Projection::Calibrated { intrinsics, distortion });
        }
        if self.distortion.is_some() {
            return Err(CameraError::wrong("distortion", "needs `intrinsics`"));
        }
        Ok(match kind {
            Perspective => Projection::Perspective { shift },
            Orthographic => {
                let distance = parameters.position.distance(parameters.look_at);
                let height = 2.0 * distance * (0.5 * parameters.vertical_fov.to_radians()).tan();
                Projection::Orthographic {
                    height: self.ortho_height.unwrap_or(height),
                    shift,
                }
            }
            Panorama => Projection::Panorama,
            Cubemap => Projection::Cubemap,
            Fisheye => Projection::Fisheye {
                mapping: self.fisheye_mapping(),
                fov: self.fisheye_fov(),
            },
        })
    }

    /// Size in pixels of one view of a picture of `resolution` pixels. A stereo picture has a view
    /// for each eye. Else the picture itself is the view.
    fn view_size(&self, resolution: UVec2) -> UVec2 {
        self.stereo.map_or(resolution, |layout| layout.view_size(resolution))
    }

    /// Pair of eyes; `None` if the picture is not a stereo picture. Returns an error if a key of
    /// stereo pictures is set for another picture.
    fn described_stereo(&self) -> Result<Option<Stereo>, CameraError> {
        /// Distance of the eyes of a person in metres.
        const EYE_DISTANCE: f32 = 0.064;
        let keys = [("eye_distance", self.eye_distance), ("convergence", self.convergence)];
        let Some(layout) = self.stereo else {
            let given = keys.into_iter().find_map(|(key, value)| Some((key, value?)));
            return given.map_or(Ok(None), |(key, value)| {
                let message = format!("is {value}, but the picture has no `stereo`");
                let help = "add --stereo side-by-side or --stereo top-bottom, or leave it out";
                Err(CameraError::no_place(key, message, help.into()))
            });
        };
        Ok(Some(Stereo {
            layout,
            eye_distance: self.eye_distance.unwrap_or(EYE_DISTANCE / self.unit.unwrap_or(1.0)),
            convergence: self.convergence,
        }))
    }

    /// Radius of the lens in scene units. If an f-number N is given, the radius is `f / 2N`. The
    /// focal length f is computed from `sensor_height` and the field of view, for a lens focused at
    /// infinity.
    fn radius(&self, vertical_fov: f32) -> Result<f32, CameraError> {
        let height = self.sensor_height();
        for (parameter, value) in [("f_stop", self.f_stop), ("sensor_height", Some(height))] {
            if let Some(value) = value.filter(|value| !(*value > 0.0 && value.is_finite())) {
                return Err(CameraError::not_positive(parameter, value));
            }
        }
        let Some(f_stop) = self.f_stop else {
            return Ok(self.lens_radius.unwrap_or(0.0));
        };
        let focal_length = 0.5 * height / (0.5 * vertical_fov.to_radians()).tan();
        Ok(0.5 * focal_length / f_stop)
    }

    /// Checks a camera whose position does not depend on the scene. If the position depends on the
    /// scene, the camera is not checked.
    #[cfg(feature = "view")]
    pub(crate) fn check(&self, resolution: UVec2) -> Result<(), CameraError> {
        if self.position.is_some() && self.look_at.is_some() {
            self.found(None, resolution).map(drop)
        } else {
            Ok(())
        }
    }

    /// Finds the camera for an image of `resolution` pixels.
    pub(crate) fn found(&self, finder: Option<&CameraFinder>, resolution: UVec2) -> Result<FoundCamera, CameraError> {
        let (description, guess) = self.describe(finder, resolution)?;
        Ok(FoundCamera {
            camera: description.camera(resolution)?,
            description,
            guess,
            siblings: finder.map(CameraFinder::siblings).unwrap_or_default(),
        })
    }

    /// Motion and shutter times for the camera of `parameters`; `None` if no key sets them.
    fn motion(&self, parameters: &CameraParameters) -> Option<CameraMotion> {
        let moves = self.position_close.or(self.look_at_close).or(self.up_close).is_some();
        (moves || self.shutter.is_some()).then(|| CameraMotion {
            close: moves.then(|| Pose {
                position: self.position_close.unwrap_or(parameters.position),
                look_at: self.look_at_close.unwrap_or(parameters.look_at),
                up: self.up_close.unwrap_or(parameters.up),
            }),
            shutter: self.shutter().0,
        })
    }
}

/// A camera with its description, and with the guess from which it was made.
pub(crate) struct FoundCamera {
    pub camera: Camera,
    pub description: CameraDescription,
    /// Guess of the camera, if one was needed.
    pub guess: Option<CameraGuess>,
    /// Evidence about the upright axis from other files of the folder, if it was needed.
    pub siblings: SiblingFiles,
}

impl FoundCamera {
    /// Viewpoint of the camera. `settings` are the settings with which the camera was found.
    pub fn viewpoint(&self, settings: &CameraSettings) -> Viewpoint {
        let said = settings.viewpoint();
        let Some(guess) = &self.guess else { return said };
        Viewpoint {
            back: Some(guess.position - guess.look_at),
            up: Some(guess.up),
            // The camera may roll, so its up need not be an axis: take the nearest axis as the up
            // direction of the scene
            scene_up: said.scene_up.or_else(|| nearest_axis(guess.scene_up)),
        }
    }
}

/// Finding about the view of the camera, if there is one. Else a finding about the position of the
/// camera, if `settings` have `position` or `stand`. `None` if there is nothing to report.
pub(crate) fn inspect_camera(
    settings: &CameraSettings,
    (scene, accel): (&Scene, &dyn Accel),
    (camera, resolution): (&Camera, UVec2),
    whole: &dyn Fn(String) -> FileError,
) -> Option<Finding> {
    let seen = inspect_view(accel, scene, camera, resolution, whole);
    if seen.is_some() {
        return seen;
    }
    let position = match settings.stand {
        Some(_) => camera.position(0.0),
        None => settings.position?.as_vec3a(),
    };
    let near = near_distance(accel, position, settings.up.unwrap_or(Vec3::Y), settings.unit);
    inspect_place(accel, scene, camera, (resolution, near), whole)
}

/// Returns an error if the shift of the picture plane moves the whole scene out of the picture. The
/// error has the range of possible shifts. Only the box of the scene is compared with the picture,
/// so there is no error if the box is in the picture, but its contents are not.
pub(super) fn check_shift(
    description: &CameraDescription,
    scene: &Scene,
    resolution: UVec2,
) -> Result<(), CameraError> {
    /// Distance in pixels from which pixel filters collect light.
    const MARGIN: f32 = 4.0;
    let zero = Vec2::ZERO;
    let (shift, projection) = match description.projection {
        Projection::Perspective { shift } => (shift, Projection::Perspective { shift: zero }),
        Projection::Orthographic { height, shift } => (shift, Projection::Orthographic { height, shift: zero }),
        _ => return Ok(()),
    };
    let is_sharp = description.parameters.lens_radius == 0.0 && description.motion.is_none();
    let has_box = scene.triangle_count() > 0 && scene.ground().is_none() && !scene.is_moving();
    if shift == zero || !is_sharp || !has_box {
        return Ok(());
    }
    let straight = CameraDescription {
        projection,
        stereo: None,
        ..*description
    };
    let size = description.view_size(resolution);
    let camera = straight.camera(size)?;
    let size = size.as_vec2();
    let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
    let bounds = scene.bounds();
    for index in 0..8 {
        let side = |bit: u32| if index >> bit & 1 == 0 { 0.0 } else { 1.0 };
        let corner = bounds.min + Vec3::new(side(0), side(1), side(2)) * (bounds.max - bounds.min);
        let Some(film) = camera.film_of(corner, 0.0) else {
            return Ok(());
        };
        (low, high) = (low.min(film), high.max(film));
    }
    let shows_box = |move_by: Vec2| {
        (low + move_by).cmple(size + MARGIN).all() && (high + move_by).cmpge(Vec2::splat(-MARGIN)).all()
    };
    if !shows_box(zero) || shows_box(Vec2::new(-shift.x, shift.y) * size.y) {
        return Ok(());
    }
    let [left, right] = [low.x - size.x, high.x].map(|x| x / size.y);
    let [down, up] = [-high.y, size.y - low.y].map(|y| y / size.y);
    Err(CameraError::no_place(
        "shift",
        format!(
            "is {},{}, which moves the whole scene out of the picture",
            shift.x, shift.y
        ),
        format!("use an X from {left:.2} to {right:.2}, and a Y from {down:.2} to {up:.2}"),
    ))
}

/// Converts `error` to an error that points to the key that causes it, or else to the key of the
/// camera's position. `None` if the scene file has neither key.
pub(super) fn blame(file: &SceneFile, error: &CameraError) -> Option<FileError> {
    let close = ["position_close", "look_at_close", "up_close"];
    let keys = match error.parameter {
        "close" => &close[..],
        parameter => &[parameter],
    };
    let message = error.to_string();
    let mut errors = keys
        .iter()
        .chain(&["position"])
        .filter_map(|key| file.camera_error(key, &message));
    Some(
        errors
            .next()?
            .help(error.help.as_deref().unwrap_or("correct the [camera]")),
    )
}

/// Distance along the view axis to the surface that is visible at the pixel position `at`. If no
/// surface is visible there, it is the focus distance of `parameters`.
fn focus_distance(
    parameters: CameraParameters,
    accel: &dyn Accel,
    at: Vec2,
    resolution: UVec2,
) -> Result<f32, CameraError> {
    let pinhole = CameraParameters {
        lens_radius: 0.0,
        ..parameters
    };
    let camera = Camera::new(pinhole, resolution)?;
    let ray = camera.ray(at, Vec2::splat(0.5), 0.0);
    let depth = |hit: Hit| camera.depth(ray.at(hit.t), 0.0);
    Ok(accel.intersect(&ray).map_or(parameters.focus_distance, depth))
}

/// Default focus distance: the distance to `look_at`, or 1 if this distance is 0.
fn distance(position: Vec3, look_at: Vec3) -> f32 {
    Some(position.distance(look_at)).filter(|&d| d > 0.0).unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lens is a normal lens of a full-frame camera: focal length 50 mm, vertical field of view
    /// 26.99°. At f/2 its radius is 12.5 mm: 0.0125 in a scene in metres, and 12.5 in a scene in
    /// millimetres, whose `sensor_height` is 24.
    #[test]
    fn an_f_number_is_a_radius() {
        let mut settings = CameraSettings {
            options: CameraOptions {
                f_stop: Some(2.0),
                ..CameraOptions::default()
            },
            ..CameraSettings::default()
        };
        let fov = 2.0 * (12f32 / 50.0).atan().to_degrees();
        assert!((settings.radius(fov).unwrap() - 0.0125).abs() < 1e-7);
        let mut millimetres = settings;
        millimetres.sensor_height = Some(24.0);
        assert!((millimetres.radius(fov).unwrap() - 12.5).abs() < 1e-4);
        assert_eq!(CameraSettings::default().radius(fov), Ok(0.0));
        for f_stop in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            settings.f_stop = Some(f_stop);
            assert!(settings.radius(fov).is_err());
        }
    }
}
