//! The camera where not all of it is said.

use super::floors::{Floors, PLACES};
use super::framing::Frame;
use super::interior::{self, Inside, InteriorView, upright_bounds};
use super::light::LightGuess;
use super::look::Looker;
use super::object;
use super::plan::{self, Cut, Plan};
use super::region::Region;
use super::scale::Scale;
use super::stand::{self, Stand};
use super::survey::Survey;
use super::up::Sisters;
use crate::accel::Accel;
use crate::camera::{CameraError, CameraParameters};
use crate::math::{DVec3, Horizon, Vec3, encode_fields, encode_variants};
use crate::scene::Scene;

/// Vertical field of view of objects, degrees.
const OBJECT_FOV: f32 = 35.0;
/// Horizontal field of view of interiors in a square image, degrees.
const INTERIOR_FOV: f32 = 62.0;
/// Vertical field of view of an interior that is seen from outside, through a side without a wall, degrees.
const OPEN_SIDE_FOV: f32 = 40.0;
/// How other cameras of an interior are had.
const OTHERS: &str = "--view iso shows it from outside, `embrasure views SCENE -o views.png` other cameras";
/// Share of the width or height of the image that an object fills.
const FILL: f32 = 0.84;
/// Triangles by which a scene is framed at most, evenly spread over its own.
const MAX_TRIANGLES: u64 = 1 << 23;
/// Elevation of an isometric view, degrees: its three axes are equally short.
const ISOMETRIC: f32 = 35.264_39;
/// Views of an interior that stand and look alike, as a share of the scene's width and as a cosine; only one of them is a candidate.
const ALIKE: (f32, f32) = (0.2, 0.5);
/// Minimum height of the eye of an interior's view, as a share of that of the best one: eyes under a table or a stair are lower.
const MIN_HEIGHT: f32 = 0.35;
/// Maximum share of the rays of an interior's view that leave the scene, unless the best one has more.
const MAX_MISSING: f32 = 0.5;
/// Candidates at most.
const MAX_CANDIDATES: usize = 12;
/// Candidates inside of an interior at most; one view from outside fits beside them.
const INSIDE_CANDIDATES: usize = MAX_CANDIDATES - 1;
/// Places along each side of the floor where small rooms of a large scene are looked for.
const MANY_PLACES: u32 = 4 * PLACES;

/// A view by its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum View {
    /// By the kind of scene: an object from its front, right or left, and above; an interior from inside.
    #[default]
    Auto,
    /// From the front, level.
    Front,
    /// From behind, level.
    Back,
    /// From the viewer's left of the front, level.
    Left,
    /// From the viewer's right of the front, level.
    Right,
    /// From above; the front is at the bottom.
    Top,
    /// From 45° right of the front, where all three axes look equally short.
    Iso,
    /// From inside, at eye height.
    Inside,
}

impl View {
    /// Each by the name that users type, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("auto", Self::Auto),
        ("front", Self::Front),
        ("back", Self::Back),
        ("left", Self::Left),
        ("right", Self::Right),
        ("top", Self::Top),
        ("iso", Self::Iso),
        ("inside", Self::Inside),
    ];

    /// Degrees of azimuth from the front, and of elevation; `None` where the scene decides.
    fn angles(self) -> Option<(f32, f32)> {
        match self {
            Self::Auto | Self::Inside => None,
            Self::Front => Some((0.0, 0.0)),
            Self::Back => Some((180.0, 0.0)),
            Self::Left => Some((-90.0, 0.0)),
            Self::Right => Some((90.0, 0.0)),
            Self::Top => Some((0.0, 90.0)),
            Self::Iso => Some((45.0, ISOMETRIC)),
        }
    }
}

encode_variants!(View {
    0 => Auto,
    1 => Front,
    2 => Back,
    3 => Left,
    4 => Right,
    5 => Top,
    6 => Iso,
    7 => Inside,
});

/// A camera on a sphere around what it looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Degrees, from +z towards +x where +y is up, and from −y towards +x where +z is up.
    pub azimuth: f32,
    /// Degrees above the horizon.
    pub elevation: f32,
    /// Scene units from the target, or else from the middle of the scene's box; `None` where the scene fills the image.
    pub distance: Option<f32>,
}

encode_fields!(Orbit {
    azimuth,
    elevation,
    distance
});

impl Orbit {
    /// Orbit of azimuth, elevation between -90 and 90 and, if there is a third number, distance above 0.
    pub fn of(numbers: &[f32]) -> Option<Self> {
        let (azimuth, elevation, distance) = match *numbers {
            [azimuth, elevation] => (azimuth, elevation, None),
            [azimuth, elevation, distance] => (azimuth, elevation, Some(distance)),
            _ => return None,
        };
        let is_distance = |distance: f32| distance > 0.0 && distance.is_finite();
        let is_orbit = azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) && distance.is_none_or(is_distance);
        is_orbit.then_some(Self {
            azimuth,
            elevation,
            distance,
        })
    }
}

/// Parts of a camera that flags or a scene file give.
#[derive(Clone, Copy, Debug, Default)]
pub struct Asked {
    /// Centre of the lens.
    pub position: Option<Vec3>,
    /// The point in the middle of the image.
    pub look_at: Option<Vec3>,
    /// Up in the image.
    pub up: Option<Vec3>,
    /// Degrees.
    pub vertical_fov: Option<f32>,
    /// Side from which the scene is seen, if no position is given.
    pub view: View,
    /// Azimuth and elevation, in place of a named view.
    pub orbit: Option<Orbit>,
    /// Place on the floor, in place of a position.
    pub stand: Option<Stand>,
    /// Azimuth towards which a standing camera looks, degrees.
    pub yaw: Option<f32>,
    /// Length of the file's unit in metres, if the file names it.
    pub unit: Option<f32>,
    /// Axis that is up in most files of the program that wrote the scene.
    pub usual_up: Option<Vec3>,
    /// Evidence of other files of the folder on the upright axis.
    pub sisters: Sisters,
    /// Point of the file's coordinates that is the scene's origin, for flags.
    pub origin: DVec3,
}

/// A camera of which something was guessed. Its numbers are as short as they are printed.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraGuess {
    /// Centre of the lens.
    pub position: Vec3,
    /// The point in the middle of the image.
    pub look_at: Vec3,
    /// Up in the image.
    pub up: Vec3,
    /// Up in the scene, a unit vector: another one than in the image where the camera looks straight up or down.
    pub scene_up: Vec3,
    /// Degrees.
    pub vertical_fov: f32,
    /// Description of the guess for users.
    pub words: String,
}

impl CameraGuess {
    /// A pinhole, in focus at the target.
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

    /// The flags that give this camera in the file whose point `origin` is the scene's.
    pub fn flags(&self, origin: DVec3) -> String {
        let list = |v: Vec3| v.to_array().map(|x| x.to_string()).join(",");
        let [position, look_at] = [self.position, self.look_at].map(|p| position_text(p, origin).join(","));
        let mut flags = format!("--position {position} --look-at {look_at}");
        if self.up != Vec3::Y {
            flags += &format!(" --up {}", list(self.up));
        }
        flags + &format!(" --fov {}", self.vertical_fov)
    }
}

/// A scene whose camera is to be found.
pub struct CameraFinder<'a> {
    looker: Looker<'a>,
    survey: Survey,
    /// Whether the upright axis is another one than by the scene alone.
    is_up_of_sisters: bool,
    /// Places that are inside.
    inside: Inside,
    asked: Asked,
    /// Width of the image over its height.
    aspect: f32,
}

impl<'a> CameraFinder<'a> {
    /// Surveys the scene.
    pub fn new(scene: &'a Scene, accel: &'a dyn Accel, asked: Asked, aspect: f32) -> Self {
        let mut looker = Looker {
            scene,
            accel,
            region: Region::of(scene),
        };
        let up = asked.up.or(height_axis(asked.origin));
        let wants_inside = asked.stand.is_some() || asked.orbit.is_none() && asked.view == View::Inside;
        let (survey, region, inside) = Survey::new(&looker, up, asked.usual_up, wants_inside);
        let (survey, is_up_of_sisters) = survey.with(&asked.sisters);
        looker.region = region;
        Self {
            survey,
            is_up_of_sisters,
            inside,
            looker,
            asked,
            aspect,
        }
    }

    /// Returns true if other files of the folder can change the upright axis.
    pub fn is_unsure_of_up(&self) -> bool {
        self.survey.is_unsure_of_up()
    }

    /// The finder with the evidence of `sisters`, in place of that of `asked`.
    #[must_use]
    pub fn with(mut self, sisters: Sisters) -> Self {
        self.asked.sisters = sisters;
        (self.survey, self.is_up_of_sisters) = self.survey.with(&sisters);
        self
    }

    /// Evidence of other files of the folder.
    pub fn sisters(&self) -> Sisters {
        self.asked.sisters
    }

    /// The acceleration structure of the scene.
    pub fn accel(&self) -> &'a dyn Accel {
        self.looker.accel
    }

    /// The survey of the scene.
    pub fn survey(&self) -> &Survey {
        &self.survey
    }

    /// The camera: what is said of it, and guesses for the rest.
    ///
    /// # Errors
    ///
    /// A place inside that the scene does not have.
    pub fn camera(&self) -> Result<CameraGuess, CameraError> {
        let Asked { view, orbit, stand, .. } = self.asked;
        if let Some(stand) = stand {
            return self.standing(stand);
        }
        let is_inside = orbit.is_none() && view.angles().is_none() && self.survey.is_interior;
        if is_inside {
            match self.inside() {
                Some(inside) => return Ok(inside),
                None if view == View::Inside => return Err(self.nothing_inside()),
                None => {}
            }
        }
        Ok(self.view_from_outside())
    }

    /// The camera around the scene.
    fn view_from_outside(&self) -> CameraGuess {
        let Asked {
            position,
            look_at,
            orbit,
            ..
        } = self.asked;
        let (azimuth, elevation, words) = self.angles();
        let back = self.horizon().direction(azimuth, elevation);
        let (mut eye, mut target) = self.frame().place(&self.looker, MAX_TRIANGLES, self.horizon(), back);
        if let Some(distance) = orbit.and_then(|orbit| orbit.distance) {
            // One target for all azimuths, with the digits that suit the scene: the frames of a turntable do not jump.
            target = short(self.looker.region.bounds.center(), self.size());
            eye = target + distance * back;
        }
        if let Some(look_at) = look_at {
            (eye, target) = (look_at + (eye - target), look_at);
        }
        if let Some(position) = position {
            eye = position;
        }
        self.guess(eye, target, self.frame().fov, words)
    }

    /// Light for the scene, seen from `position` towards `target`; `None` if its own emitters light
    /// it. The scene has no other lights. In a room of a house the light is that of an interior.
    pub fn light(&self, position: Vec3, target: Vec3) -> Option<LightGuess> {
        let mut survey = self.survey;
        if self.inside != Inside::Anywhere {
            if let Some(openness) = interior::openness_of_room(&self.looker, self.horizon(), position) {
                (survey.is_interior, survey.openness) = (true, openness);
            }
        }
        LightGuess::new(&self.looker, &survey, position, target)
    }

    /// Cameras to choose from, each with the shortest flags that name it.
    pub fn candidates(&self) -> Vec<(String, CameraGuess)> {
        let of = |asked: Asked| {
            Self {
                asked: Asked {
                    up: self.asked.up,
                    vertical_fov: self.asked.vertical_fov,
                    origin: self.asked.origin,
                    ..asked
                },
                ..*self
            }
            .view_from_outside()
        };
        let mut candidates = Vec::new();
        if self.survey.is_interior {
            for view in self.distinct_views() {
                let guess = self.inside_guess(view);
                candidates.push((guess.flags(self.asked.origin), guess));
            }
        }
        let inside = candidates.len();
        let front = object::front(&self.looker, self.horizon(), &self.frame());
        let (azimuth, elevation) = object::three_quarter(&self.looker, self.horizon(), &self.frame(), front);
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
                of(Asked {
                    orbit,
                    ..Asked::default()
                }),
            ));
        }
        for (name, view) in View::NAMES.iter().filter(|(_, view)| view.angles().is_some()) {
            candidates.push((
                format!("--view {name}"),
                of(Asked {
                    view: *view,
                    ..Asked::default()
                }),
            ));
        }
        if inside > 0 && self.survey.is_closed() {
            // Its light does not leave the room: from outside all is black.
            candidates.truncate(inside);
        }
        if inside > 0 {
            // From outside, an interior shows mostly blank walls: the isometric view tells the best how it lies.
            candidates[inside..].sort_by_key(|(flags, _)| flags != "--view iso");
        }
        candidates.truncate(MAX_CANDIDATES);
        candidates
    }

    /// The plan of an interior with `cameras`, `size` pixels along its larger edge; `None` of an object.
    pub fn plan(&self, cameras: &[CameraGuess], size: usize) -> Option<Plan> {
        if !self.survey.is_interior {
            return None;
        }
        let floors = Floors::new(&self.looker, self.horizon());
        let floor = interior::floor_of_best(self.horizon(), &self.views_inside());
        let floor = floor.unwrap_or(floors.bounds().min.y);
        let cut = Cut::above(floor, &self.scale(&floors));
        let cameras: Vec<_> = cameras.iter().map(|camera| (camera.position, camera.look_at)).collect();
        Some(plan::plan(&floors, cut, &cameras, size))
    }

    /// The coordinates of the edges of a plan in the file, in words.
    pub fn edges_text(&self, plan: &Plan) -> String {
        let text = |from: Vec3, to: Vec3, [from_side, to_side]: [&str; 2]| {
            let axis = (to - from).abs().max_position();
            let [from, to] = [from, to].map(|p| position_text(short(p, self.size()), self.asked.origin)[axis].clone());
            format!("{} from {from} {from_side} to {to} {to_side}", ["x", "y", "z"][axis])
        };
        let [top_left, top_right, bottom_left] = plan.corners;
        format!(
            "{}, {}",
            text(top_left, top_right, ["on the left", "on the right"]),
            text(top_left, bottom_left, ["at the top", "at the bottom"])
        )
    }

    fn horizon(&self) -> &Horizon {
        &self.survey.horizon
    }

    fn frame(&self) -> Frame {
        Frame {
            fov: self.asked.vertical_fov.unwrap_or(OBJECT_FOV),
            aspect: self.aspect,
            fill: FILL,
        }
    }

    /// Azimuth and elevation of the view of an object, and words on it.
    fn angles(&self) -> (f32, f32, String) {
        let Asked {
            view, orbit, position, ..
        } = self.asked;
        if let Some(orbit) = orbit {
            let words = format!(
                "around the scene at azimuth {}°, elevation {}°",
                orbit.azimuth, orbit.elevation
            );
            return (orbit.azimuth, orbit.elevation, words);
        }
        if position.is_some() {
            return (0.0, 0.0, "towards the middle of the scene".into());
        }
        let front = object::front(&self.looker, self.horizon(), &self.frame());
        match view.angles() {
            Some((turn, elevation)) => {
                let azimuth = wrapped(front + turn);
                (
                    azimuth,
                    elevation,
                    format!(
                        "the object from azimuth {azimuth}°, elevation {elevation}°; its front is at azimuth {front}°"
                    ),
                )
            }
            None => {
                let (azimuth, elevation) = object::three_quarter(&self.looker, self.horizon(), &self.frame(), front);
                let azimuth = wrapped(azimuth);
                let words = format!(
                    "an object, from azimuth {azimuth}°, elevation {elevation}° (--orbit AZ,EL or --view NAME changes that); its front is at azimuth {front}°"
                );
                (azimuth, elevation, words)
            }
        }
    }

    fn inside(&self) -> Option<CameraGuess> {
        let Asked {
            position,
            look_at,
            view,
            ..
        } = self.asked;
        let (horizon, width) = (self.horizon(), self.width());
        let view = match (position, look_at) {
            (Some(position), None) => interior::best_direction(&self.looker, horizon, position, 0.0, width)?,
            (Some(_), Some(_)) => return None,
            (None, None) => {
                let fov = self.asked.vertical_fov.unwrap_or(OPEN_SIDE_FOV);
                let open_side = || interior::through_open_side(&self.looker, horizon, fov, self.aspect);
                if let Some(view) = (view == View::Auto).then(open_side).flatten() {
                    let words = format!("an interior, through its open side ({OTHERS})");
                    return Some(self.guess(view.position, view.target(), fov, words));
                }
                *self.views_inside().first()?
            }
            (None, Some(target)) => {
                let sees = |view: &InteriorView| {
                    let way = target - view.position;
                    let seen = way
                        .try_normalize()
                        .and_then(|direction| self.looker.look(view.position, direction));
                    seen.is_none_or(|seen| seen.distance >= 0.99 * way.length())
                };
                let view = self.views_inside().into_iter().find(sees)?;
                return Some(self.guess(
                    view.position,
                    target,
                    self.inside_fov(),
                    "an interior, from inside".into(),
                ));
            }
        };
        Some(self.inside_guess(view))
    }

    /// Views from inside, the best first. If the scene is not an interior, these are views of its
    /// rooms, of those with a ceiling if there are any.
    fn views_inside(&self) -> Vec<InteriorView> {
        let views = |inside, count| interior::views(&self.looker, self.horizon(), inside, count);
        if self.inside == Inside::Anywhere {
            return views(Inside::Anywhere, PLACES);
        }
        let kinds = [Inside::RoofedRooms, Inside::Rooms, Inside::Hulls];
        let mut tries = kinds.into_iter().flat_map(|kind| [(kind, PLACES), (kind, MANY_PLACES)]);
        tries
            .find_map(|(kind, count)| Some(views(kind, count)).filter(|views| !views.is_empty()))
            .unwrap_or_default()
    }

    fn inside_guess(&self, view: InteriorView) -> CameraGuess {
        let words = format!("an interior, from inside at eye height ({OTHERS})");
        self.guess(view.position, view.target(), self.inside_fov(), words)
    }

    /// The error of a scene that has no inside.
    fn nothing_inside(&self) -> CameraError {
        let reason = match self.asked.look_at {
            Some(_) if !self.views_inside().is_empty() => "no place inside sees the point of --look-at",
            _ => interior::reason_for_none(&self.looker, self.horizon()),
        };
        CameraError::no_place(
            "view",
            format!("inside: there is nothing to stand in: {reason}"),
            "leave --view out to see it from outside, or choose a place by --stand X,Z or --position X,Y,Z".into(),
        )
    }

    /// The camera that stands on the floor at a place.
    fn standing(&self, stand: Stand) -> Result<CameraGuess, CameraError> {
        let Asked {
            look_at, yaw, origin, ..
        } = self.asked;
        let horizon = self.horizon();
        let floors = Floors::new(&self.looker, horizon);
        let scale = self.scale(&floors);
        let height = stand.height.unwrap_or(scale.eyes);
        let usual = match self.inside {
            Inside::Anywhere => interior::floor_of_best(horizon, &self.views_inside()),
            _ => None,
        };
        let place = stand.coordinates(&floors, origin);
        let Some(floor) = stand::floor(&floors, &scale, place, height, usual) else {
            return Err(self.no_floor(&floors, &stand));
        };
        let eye = horizon.point(Vec3::new(place.x, floor + height, place.z));
        let target = look_at.unwrap_or_else(|| {
            let view = match yaw {
                Some(yaw) => interior::view_towards(&self.looker, horizon, eye, yaw, floors.width()),
                None => interior::best_view(&self.looker, horizon, eye, height, floors.width()),
            };
            view.target()
        });
        let words = match stand.height {
            Some(height) => format!("stands on the floor, eyes {height} above it"),
            None => format!(
                "stands on the floor, eyes {} above it ({}; --stand {},HEIGHT changes that)",
                short_number(scale.eyes),
                scale.words(),
                stand.place_text()
            ),
        };
        Ok(self.guess(eye, target, self.inside_fov(), words))
    }

    /// The unit of the file, by what it says and by the height of its rooms.
    fn scale(&self, floors: &Floors) -> Scale {
        Scale::new(self.asked.unit, floors.room_height(), floors.height())
    }

    /// The error of a place without a floor.
    fn no_floor(&self, floors: &Floors, stand: &Stand) -> CameraError {
        let bounds = self.looker.region.bounds;
        let axis = self.horizon().up().abs().max_position();
        let across: Vec<String> = (0..3)
            .filter(|&other| other != axis)
            .map(|other| {
                let [min, max] = [bounds.min, bounds.max]
                    .map(|p| position_text(short(p, self.size()), self.asked.origin)[other].clone());
                format!("{} from {min} to {max}", ["x", "y", "z"][other])
            })
            .collect();
        let is_anywhere = floors.at_any(stand.coordinates(floors, self.asked.origin));
        let reason = match is_anywhere {
            true => "has no floor with room for a camera above it",
            false => "has no floor",
        };
        CameraError::no_place(
            "stand",
            format!("{}: this place {reason}", stand.place_text()),
            format!(
                "choose another place ({}), a lower HEIGHT, or one of `embrasure views SCENE -o views.png`",
                across.join(", ")
            ),
        )
    }

    /// Views of an interior that differ, the best first.
    fn distinct_views(&self) -> Vec<InteriorView> {
        let mut distinct: Vec<InteriorView> = Vec::new();
        for view in self.views_inside() {
            let best = distinct.first().unwrap_or(&view);
            if view.height < MIN_HEIGHT * best.height || view.missing > MAX_MISSING.max(best.missing) {
                continue;
            }
            let is_like = |other: &InteriorView| {
                view.position.distance(other.position) < ALIKE.0 * self.width()
                    && view.direction.dot(other.direction) > ALIKE.1
            };
            if !distinct.iter().any(is_like) {
                distinct.push(view);
            }
            if distinct.len() == INSIDE_CANDIDATES {
                break;
            }
        }
        distinct
    }

    fn inside_fov(&self) -> f32 {
        let narrowed = (0.5 * INTERIOR_FOV.to_radians()).tan() / self.aspect.clamp(0.25, 4.0).sqrt();
        self.asked
            .vertical_fov
            .unwrap_or_else(|| (2.0 * narrowed.atan()).to_degrees().round())
    }

    fn width(&self) -> f32 {
        let bounds = upright_bounds(self.looker.region.bounds, self.horizon());
        (bounds.max.x - bounds.min.x).max(bounds.max.z - bounds.min.z)
    }

    /// Radius of the scene, above 0.
    fn size(&self) -> f32 {
        self.looker.region.bounds.radius().max(f32::MIN_POSITIVE)
    }

    /// Words on the triangles that the camera does not frame.
    fn left_out(&self) -> String {
        let Region {
            left_out, left_out_at, ..
        } = self.looker.region;
        let place = || {
            let scale = left_out_at.abs().max_element().max(self.size());
            position_text(short(left_out_at, scale), self.asked.origin).join(",")
        };
        match left_out {
            0 => String::new(),
            1 => format!("; 1 triangle that reaches to {} is left out of the view", place()),
            n => format!("; {n} triangles far away, around {}, are left out of the view", place()),
        }
    }

    /// The camera with short numbers; what was said stays as it is.
    fn guess(&self, eye: Vec3, target: Vec3, fov: f32, words: String) -> CameraGuess {
        let scale = eye.distance(target).min(self.size());
        let horizon = self.horizon();
        let up = horizon.image_up((eye - target).normalize_or_zero());
        let Asked {
            position,
            look_at,
            up: said_up,
            ..
        } = self.asked;
        let (position, look_at) = (
            position.unwrap_or(short(eye, scale)),
            look_at.unwrap_or(short(target, scale)),
        );
        let words = match said_up {
            None => {
                let axis = horizon.up().abs().max_position();
                let sign = if horizon.up()[axis] < 0.0 { '-' } else { '+' };
                let other = if horizon.up() == Vec3::Y { "0,0,1" } else { "0,1,0" };
                format!(
                    "{words}; {sign}{} is up{} (--up {other} changes that)",
                    ["x", "y", "z"][axis],
                    if self.is_up_of_sisters {
                        " as in other files of its folder"
                    } else {
                        ""
                    }
                )
            }
            Some(_) => words,
        };
        let words = words + &self.left_out();
        // A camera that looks along what is up has another direction at the top of its image.
        let is_across =
            |said: &Vec3| said.cross(position - look_at).length() > 1e-3 * said.length() * position.distance(look_at);
        CameraGuess {
            position,
            look_at,
            up: said_up.filter(is_across).unwrap_or(up),
            scene_up: horizon.up(),
            vertical_fov: fov,
            words,
        }
    }
}

/// The upright axis of a file that lies far from its own origin, at `origin`: national grids have
/// large eastings and northings, and small heights. `None` of other files.
fn height_axis(origin: DVec3) -> Option<Vec3> {
    let axis = origin.abs().min_position();
    (origin != DVec3::ZERO).then(|| Vec3::AXES[axis])
}

/// Coordinates of `p` in the file whose point `origin` is the scene's, as short as those of `p`.
pub fn position_text(p: Vec3, origin: DVec3) -> [String; 3] {
    [0, 1, 2].map(|axis| {
        let short = p[axis].to_string();
        match origin[axis] == 0.0 {
            true => short,
            false => {
                let decimals = short.split('.').nth(1).map_or(0, str::len).min(9);
                format!("{:.decimals$}", f64::from(p[axis]) + origin[axis])
            }
        }
    })
}

/// `x` with four digits.
fn short_number(x: f32) -> String {
    short(Vec3::splat(x), x).x.to_string()
}

/// `v` rounded to decimals of a thousandth of `scale`.
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
    // No negative zeros
    Vec3::from(v.to_array().map(round)) + Vec3::ZERO
}

/// `azimuth` plus a multiple of 360 degrees, between -180 and 180.
fn wrapped(azimuth: f32) -> f32 {
    (azimuth + 180.0).rem_euclid(360.0) - 180.0
}
