//! Guess of the camera, except for the parts that are given.

mod inside;

use super::elevation::drawing_axes;
use super::exporter;
use super::far_ground::{without_far_ground, without_strays_below};
use super::file_axes::FileAxes;
use super::framing::Framing;
use super::groups;
use super::interior::{self, PlaceKind, upright_bounds};
use super::light::LightGuess;
use super::object::{self, Front};
use super::region::{Region, WideGround};
use super::scene_tracer::SceneTracer;
use super::stand::Stand;
use super::survey::Survey;
use super::up::SiblingFiles;
use super::views::{NamedView, Orbit};
use crate::accel::Accel;
use crate::camera::{CameraError, CameraParameters};
use crate::math::{DVec3, Horizon, Vec3, nearest_axis, significant};
use crate::scene::Scene;

/// Vertical field of view for objects, in degrees.
const OBJECT_FOV: f32 = 35.0;
/// Fraction of the width or height of the image that an object fills.
const FILL: f32 = 0.84;
/// Maximum number of triangles that are used to frame a scene. They are spread evenly over all
/// triangles.
const MAX_TRIANGLES: u64 = 1 << 23;
/// Maximum number of candidate cameras.
const MAX_CANDIDATES: usize = 12;

/// Margin of the best upright axis over the second best, as a natural logarithm of odds. If the
/// margin is smaller, the message calls the axis probable.
const UNSURE: f32 = 2.0;

/// Parts of a camera that are given by flags or a scene file.
#[derive(Clone, Copy, Debug, Default)]
pub struct CameraRequest {
    /// Centre of the lens, world space.
    pub position: Option<Vec3>,
    /// Point in the middle of the image, world space.
    pub look_at: Option<Vec3>,
    /// Up direction in the image.
    pub up: Option<Vec3>,
    /// Vertical field of view in degrees.
    pub vertical_fov: Option<f32>,
    /// Side from which the scene is seen; used without a position.
    pub view: NamedView,
    /// Azimuth and elevation, instead of a named view.
    pub orbit: Option<Orbit>,
    /// Place on the floor, instead of a position.
    pub stand: Option<Stand>,
    /// Azimuth of the view direction of a standing camera, in degrees.
    pub yaw: Option<f32>,
    /// Length of the file's unit in metres, if the file has it.
    pub unit: Option<f32>,
    /// Axes from the comments of the file.
    pub axes: FileAxes,
    /// Evidence for the upright axis from other files of the folder.
    pub siblings: SiblingFiles,
    /// Origin of the scene, in the file's coordinates. The flags of a guess are in file
    /// coordinates.
    pub origin: DVec3,
}

/// A camera with guessed parts. Its numbers are rounded as they are printed.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraGuess {
    /// Centre of the lens, world space.
    pub position: Vec3,
    /// Point in the middle of the image, world space.
    pub look_at: Vec3,
    /// Up direction in the image.
    pub up: Vec3,
    /// Up in the scene, a unit vector. It differs from `up` if the camera looks straight up or
    /// down.
    pub scene_up: Vec3,
    /// Vertical field of view in degrees.
    pub vertical_fov: f32,
    /// Up direction to try if `scene_up` is wrong; `None` if `scene_up` is certain.
    pub other_up: Option<Vec3>,
    /// Description of the guess for users.
    pub words: String,
}

impl CameraGuess {
    /// Sentence about an uncertain up direction, with the flag that changes it. `None` if the
    /// direction is certain.
    pub fn doubt_about_up(&self) -> Option<String> {
        let [x, y, z] = self.other_up?.to_array();
        Some(format!(
            "{} is probably up: if the model lies on its side or is upside down, add --up {x},{y},{z} (or another axis)",
            axis_text(self.scene_up)
        ))
    }

    /// Parameters of a pinhole camera, in focus at the target.
    pub fn parameters(&self) -> CameraParameters {
        CameraParameters {
            position: self.position,
            look_at: self.look_at,
            up: self.up,
            vertical_fov: self.vertical_fov,
            lens_radius: 0.0,
            focus_distance: self.position.distance(self.look_at).max(f32::MIN_POSITIVE),
        }
    }

    /// Flags that select this camera. `origin` is the point of the file that is the scene's origin.
    pub fn flags(&self, origin: DVec3) -> String {
        format!("{} --fov {}", self.place_flags(origin), self.vertical_fov)
    }

    /// [`CameraGuess::flags`] without the field of view, for projections that have none.
    pub fn place_flags(&self, origin: DVec3) -> String {
        let list = |v: Vec3| v.to_array().map(|x| x.to_string()).join(",");
        let [position, look_at] = [self.position, self.look_at].map(|p| position_text(p, origin).join(","));
        let mut flags = format!("--position {position} --look-at {look_at}");
        if self.up != Vec3::Y {
            flags += &format!(" --up {}", list(self.up));
        }
        flags
    }
}

/// Finds a camera for a scene.
pub struct CameraFinder<'a> {
    tracer: SceneTracer<'a>,
    survey: Survey,
    /// True if other files of the folder changed the upright axis.
    is_up_of_siblings: bool,
    /// Kind of the places that count as inside, for views from inside.
    inside: PlaceKind,
    request: CameraRequest,
    /// Width of the image over its height.
    aspect: f32,
}

impl<'a> CameraFinder<'a> {
    /// Makes a finder for `scene` and determines the kind and the upright axis of the scene.
    /// `aspect` is the width of the image divided by its height.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accel, request: CameraRequest, aspect: f32) -> Self {
        let mut tracer = SceneTracer {
            scene,
            accel,
            region: Region::of(scene),
        };
        let declared = request.axes.declared.map(|axes| axes.up);
        let only = request.axes.only_up.or_else(|| exporter::only_up(scene));
        let given = request.up.or(declared).or(only);
        let up = given.or(height_axis(request.origin));
        let needs_inside = request.stand.is_some() || request.orbit.is_none() && request.view == NamedView::Inside;
        let (survey, region, inside) = Survey::new(&tracer, up, &request.axes, needs_inside);
        let (mut survey, is_up_of_siblings) = survey.with(&request.siblings);
        tracer.region = region;
        if !survey.is_interior {
            let region = groups::without_sheets(&tracer, &survey.horizon);
            tracer.region = match region.ground {
                Some(_) => region,
                None => without_far_ground(&tracer, &survey.horizon),
            };
            if tracer.region.ground.is_some() {
                survey.part = without_strays_below(&tracer, &survey.horizon).or(survey.part);
            }
        }
        Self {
            survey,
            is_up_of_siblings,
            inside,
            tracer,
            request,
            aspect,
        }
    }

    /// Returns true if other files of the folder can change the upright axis.
    pub fn is_unsure_of_up(&self) -> bool {
        self.survey.is_unsure_of_up()
    }

    /// Replaces the evidence of other files by `siblings`.
    #[must_use]
    pub fn with(mut self, siblings: SiblingFiles) -> Self {
        self.request.siblings = siblings;
        (self.survey, self.is_up_of_siblings) = self.survey.with(&siblings);
        self
    }

    /// Evidence of other files of the folder.
    pub fn siblings(&self) -> SiblingFiles {
        self.request.siblings
    }

    /// The acceleration structure of the scene.
    pub fn accel(&self) -> &'a dyn Accel {
        self.tracer.accel
    }

    /// The survey of the scene.
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// The camera: given parts, and guesses for the rest.
    ///
    /// # Errors
    ///
    /// There is no place inside the scene for the requested camera.
    pub fn camera(&self) -> Result<CameraGuess, CameraError> {
        let CameraRequest { view, orbit, stand, .. } = self.request;
        if let Some(stand) = stand {
            return self.standing(stand);
        }
        let is_inside = orbit.is_none() && view.angles().is_none() && self.survey.is_interior;
        if is_inside {
            match self.inside() {
                Some(inside) => return Ok(inside),
                None if view == NamedView::Inside => return Err(self.nothing_inside()),
                None => {}
            }
        }
        Ok(self.view_from_outside())
    }

    /// The camera outside of the scene.
    fn view_from_outside(&self) -> CameraGuess {
        let CameraRequest {
            position,
            look_at,
            orbit,
            ..
        } = self.request;
        let (azimuth, elevation, [words, remark]) = self.angles();
        let back = self.horizon().direction(azimuth, elevation);
        let (mut eye, mut target) = self.frame().place(&self.tracer, MAX_TRIANGLES, self.horizon(), back);
        if let Some(distance) = orbit.and_then(|orbit| orbit.distance) {
            // The target is the same for all azimuths and is rounded for the size of the scene, so
            // that the images of a turntable do not jump.
            target = short(self.tracer.region.bounds.center(), self.size());
            eye = target + distance * back;
        }
        if let Some(look_at) = look_at {
            (eye, target) = (look_at + (eye - target), look_at);
        }
        if let Some(position) = position {
            return self.guess(position, target, self.frame().fov, words);
        }
        let distance = significant(eye.distance(target).into(), 3);
        let words = format!("{words}, distance {distance}{remark}");
        self.guess(eye, target, self.frame().fov, words)
    }

    /// Guesses the light to add to the scene for a camera at `position` that looks at `target`.
    /// `None` if the emitting surfaces light the view. The scene must have no other lights. In a
    /// room of a house, the light is the light of an interior.
    pub fn light(&self, position: Vec3, target: Vec3) -> Option<LightGuess> {
        let mut survey = self.survey;
        if self.inside != PlaceKind::Anywhere {
            if let Some(openness) = interior::openness_of_room(&self.tracer, self.horizon(), position) {
                (survey.is_interior, survey.openness) = (true, openness);
            }
        }
        LightGuess::new(&self.tracer, &survey, position, target)
    }

    /// Candidate cameras, each with the shortest flags that select it.
    pub fn candidates(&self) -> Vec<(String, CameraGuess)> {
        let of = |request: CameraRequest| {
            Self {
                request: CameraRequest {
                    up: self.request.up,
                    vertical_fov: self.request.vertical_fov,
                    origin: self.request.origin,
                    axes: self.request.axes,
                    ..request
                },
                ..*self
            }
            .view_from_outside()
        };
        let mut candidates = Vec::new();
        if self.survey.is_interior {
            for view in self.distinct_views() {
                let guess = self.inside_guess(view);
                candidates.push((guess.flags(self.request.origin), guess));
            }
        }
        let inside = candidates.len();
        let front = self.front().azimuth;
        let (azimuth, elevation) =
            object::three_quarter(&self.tracer, self.horizon(), &self.frame(), front, &self.request.axes);
        let mirrored = 2.0 * front - azimuth;
        for azimuth in [azimuth, mirrored, azimuth + 180.0, mirrored + 180.0] {
            let azimuth = wrapped(azimuth);
            let orbit = Some(Orbit {
                azimuth,
                elevation,
                distance: None,
            });
            candidates.push((
                format!("--orbit {azimuth},{elevation}"),
                of(CameraRequest {
                    orbit,
                    ..CameraRequest::default()
                }),
            ));
        }
        for (name, view) in NamedView::NAMES.iter().filter(|(_, view)| view.angles().is_some()) {
            candidates.push((
                format!("--view {name}"),
                of(CameraRequest {
                    view: *view,
                    ..CameraRequest::default()
                }),
            ));
        }
        if inside > 0 && self.survey.is_closed() {
            // Light inside a closed room does not leave the room, so all is black from outside.
            candidates.truncate(inside);
        }
        if inside > 0 {
            // From outside, an interior shows mostly blank walls: the isometric view shows its
            // layout best.
            candidates[inside..].sort_by_key(|(flags, _)| flags != "--view iso");
        }
        candidates.truncate(MAX_CANDIDATES);
        candidates
    }

    fn horizon(&self) -> &Horizon {
        &self.survey.horizon
    }

    fn frame(&self) -> Framing {
        Framing {
            fov: self.request.vertical_fov.unwrap_or(OBJECT_FOV),
            aspect: self.aspect,
            fill: FILL,
        }
    }

    /// Azimuth and elevation of the view of an object, and the parts of the message before and
    /// after the distance.
    fn angles(&self) -> (f32, f32, [String; 2]) {
        let CameraRequest {
            view, orbit, position, ..
        } = self.request;
        if let Some(orbit) = orbit {
            let words = format!(
                "around the scene at azimuth {}°, elevation {}°",
                orbit.azimuth, orbit.elevation
            );
            return (orbit.azimuth, orbit.elevation, [words, String::new()]);
        }
        if position.is_some() {
            return (0.0, 0.0, ["towards the middle of the scene".into(), String::new()]);
        }
        let front = self.front();
        let (azimuth, elevation, what) = match view.angles() {
            Some((turn, elevation)) => (wrapped(front.azimuth + turn), elevation, "the object"),
            None => {
                let (azimuth, elevation) = object::three_quarter(
                    &self.tracer,
                    self.horizon(),
                    &self.frame(),
                    front.azimuth,
                    &self.request.axes,
                );
                (wrapped(azimuth), elevation, "an object,")
            }
        };
        let change = match view.angles() {
            Some(_) => "",
            None => " (--orbit AZ,EL or --view NAME changes that)",
        };
        let words = format!("{what} from azimuth {azimuth}°, elevation {elevation}°");
        let remark = format!("{change}; {}", front_words(&front, azimuth, elevation));
        (azimuth, elevation, [words, remark])
    }

    /// Upright axis of drawings, and direction of the front of the scene: coordinate axes. An
    /// interior has no front, and gets the usual front.
    pub fn drawing_axes(&self) -> [Vec3; 2] {
        let usual = drawing_axes(Some(self.horizon().up()), &self.request.axes);
        if self.survey.is_interior {
            return usual;
        }
        let [up, _] = usual;
        let front = nearest_axis(self.horizon().direction(self.front().azimuth, 0.0));
        front
            .filter(|front| front.dot(up) == 0.0)
            .map_or(usual, |front| [up, front])
    }

    /// Front of the object. A backdrop hides the object from behind, so the open side of the
    /// backdrop replaces this front.
    fn front(&self) -> Front {
        let front = Front::of(&self.tracer, self.horizon(), &self.frame(), &self.request.axes);
        let Some(WideGround::Backdrop(open)) = self.tracer.region.ground else {
            return front;
        };
        let is_hidden = self.horizon().direction(front.azimuth, 0.0).dot(open) < -0.5;
        let azimuth = self.horizon().azimuth(open).filter(|_| is_hidden && !front.is_declared);
        azimuth.map_or(front, |azimuth| Front {
            azimuth: (azimuth / 90.0).round().rem_euclid(4.0) * 90.0,
            is_declared: false,
            is_clear: true,
        })
    }

    fn width(&self) -> f32 {
        let bounds = upright_bounds(self.tracer.region.bounds, self.horizon());
        (bounds.max.x - bounds.min.x).max(bounds.max.z - bounds.min.z)
    }

    /// Radius of the scene, above 0.
    fn size(&self) -> f32 {
        self.tracer.region.bounds.radius().max(f32::MIN_POSITIVE)
    }

    /// Description of the triangles that the camera does not frame.
    fn left_out(&self) -> String {
        let Region {
            left_out, left_out_at, ..
        } = self.tracer.region;
        let place = || {
            let scale = left_out_at.abs().max_element().max(self.size());
            position_text(short(left_out_at, scale), self.request.origin).join(",")
        };
        let ground = match self.tracer.region.ground {
            Some(WideGround::Flat) => "; its ground reaches beyond the view",
            Some(WideGround::Backdrop(_)) => "; its backdrop reaches beyond the view",
            None => "",
        };
        match left_out {
            0 => ground.into(),
            1 => format!("; 1 triangle that reaches to {} is left out of the view", place()),
            n => format!("; {n} triangles far away, around {}, are left out of the view", place()),
        }
    }

    /// The camera with rounded numbers. Given parts do not change.
    fn guess(&self, eye: Vec3, target: Vec3, fov: f32, words: String) -> CameraGuess {
        let scale = eye.distance(target).min(self.size());
        let horizon = self.horizon();
        let up = horizon.image_up((eye - target).normalize_or_zero());
        let CameraRequest {
            position,
            look_at,
            up: said_up,
            ..
        } = self.request;
        let (position, look_at) = (
            position.unwrap_or(short(eye, scale)),
            look_at.unwrap_or(short(target, scale)),
        );
        let mut other_up = None;
        let words = match said_up {
            None => {
                let usual_other = if horizon.up() == Vec3::Y { Vec3::Z } else { Vec3::Y };
                let (doubt, reason) = match self.survey.up_scores {
                    _ if self.request.axes.declared.is_some() => ("", " as the file says"),
                    _ if self.is_up_of_siblings => ("", " as in other files of its folder"),
                    Some(scores) if scores.margin() < UNSURE => {
                        other_up = Some(scores.alternative());
                        ("probably ", "")
                    }
                    _ => ("", ""),
                };
                let axis = axis_text(horizon.up());
                let [x, y, z] = other_up.unwrap_or(usual_other).to_array();
                format!("{words}; {doubt}{axis} is up{reason} (--up {x},{y},{z} changes that)")
            }
            Some(_) => words,
        };
        let words = words + &self.left_out();
        // If the camera looks along the given up direction, the image needs another up direction.
        let is_across =
            |said: &Vec3| said.cross(position - look_at).length() > 1e-3 * said.length() * position.distance(look_at);
        CameraGuess {
            position,
            look_at,
            up: said_up.filter(is_across).unwrap_or(up),
            scene_up: horizon.up(),
            vertical_fov: fov,
            other_up,
            words,
        }
    }
}

/// Name of the coordinate axis nearest to `direction`, with its sign, such as `+y`.
fn axis_text(direction: Vec3) -> String {
    let axis = direction.abs().max_position();
    let sign = if direction[axis] < 0.0 { '-' } else { '+' };
    format!("{sign}{}", ["x", "y", "z"][axis])
}

/// Description of the front of an object that is seen from `azimuth` and `elevation`.
fn front_words(front: &Front, azimuth: f32, elevation: f32) -> String {
    let side = format!("its front is at azimuth {}°", front.azimuth);
    if front.is_declared {
        return format!("{side} as the file says");
    }
    if front.is_clear {
        return side;
    }
    let behind = wrapped(azimuth + 180.0);
    format!("probably {side} (--orbit {behind},{elevation} shows the other side)")
}

/// Upright axis of a file whose scene lies far from the file's origin, at `origin`: the axis with
/// the smallest coordinate, because national grids have large eastings and northings, and small
/// heights. `None` for other files.
fn height_axis(origin: DVec3) -> Option<Vec3> {
    let axis = origin.abs().min_position();
    (origin != DVec3::ZERO).then(|| Vec3::AXES[axis])
}

/// File coordinates of the scene point `p`, with the number of decimals of `p`. `origin` is the
/// point of the file that is the scene's origin.
pub fn position_text(p: Vec3, origin: DVec3) -> [String; 3] {
    [0, 1, 2].map(|axis| {
        let short = p[axis].to_string();
        if origin[axis] == 0.0 {
            short
        } else {
            let decimals = short.split('.').nth(1).map_or(0, str::len).min(9);
            format!("{:.decimals$}", f64::from(p[axis]) + origin[axis])
        }
    })
}

/// `v`, rounded so that the last decimal is about a thousandth of `scale`.
fn short(v: Vec3, scale: f32) -> Vec3 {
    let digits = 3.0 - scale.log10().floor();
    let decimals = digits.clamp(0.0, 45.0) as usize;
    let round = |x: f32| {
        let step = 10f64.powi(-digits.min(0.0) as i32);
        let rounded = if digits < 0.0 {
            (f64::from(x) / step).round() * step
        } else {
            f64::from(x)
        };
        format!("{rounded:.decimals$}").parse().unwrap_or(x)
    };
    // Avoid negative zeros
    Vec3::from(v.to_array().map(round)) + Vec3::ZERO
}

/// `azimuth` in degrees, wrapped to the range from -180 to 180.
fn wrapped(azimuth: f32) -> f32 {
    (azimuth + 180.0).rem_euclid(360.0) - 180.0
}
