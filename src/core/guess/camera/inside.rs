//! Cameras inside: views of interiors, and cameras at given places.

use super::{CameraFinder, CameraGuess, CameraRequest, MAX_CANDIDATES, position_text, short};
use crate::camera::CameraError;
use crate::guess::floors::{Floors, PLACES};
use crate::guess::interior::{self, InteriorView, PlaceKind};
use crate::guess::plan::{self, Cut, Plan};
use crate::guess::scale::Scale;
use crate::guess::stand::{self, Stand};
use crate::guess::views::NamedView;
use crate::math::Vec3;

/// Horizontal field of view of interiors in a square image, in degrees.
const INTERIOR_FOV: f32 = 62.0;
/// Vertical field of view of an interior that is seen from outside, through a side without a wall,
/// in degrees.
const OPEN_SIDE_FOV: f32 = 40.0;
/// Hint for users: flags for other cameras of an interior.
const OTHERS: &str =
    "--view iso shows the scene from outside, `embrasure views SCENE -o views.png` shows other cameras";
/// Limits for two similar views of an interior: maximum distance, as a fraction of the scene's
/// width, and minimum cosine between the directions. Only one of several similar views is a
/// candidate.
const ALIKE: (f32, f32) = (0.2, 0.5);
/// Minimum eye height of a view of an interior, as a fraction of the eye height of the best view.
/// Lower eyes are under a table or a stair.
const MIN_HEIGHT: f32 = 0.35;
/// Maximum fraction of the rays of an interior view that leave the scene, unless the fraction of
/// the best view is larger.
const MAX_MISSING: f32 = 0.5;
/// Maximum number of candidates inside an interior. One more candidate is outside.
const INSIDE_CANDIDATES: usize = MAX_CANDIDATES - 1;
/// Number of places along each side of the floor, in the search for small rooms of a large scene.
const MANY_PLACES: u32 = 4 * PLACES;

impl CameraFinder<'_> {
    pub(super) fn inside(&self) -> Option<CameraGuess> {
        let CameraRequest {
            position,
            look_at,
            view,
            ..
        } = self.request;
        let (horizon, width) = (self.horizon(), self.width());
        let view = match (position, look_at) {
            (Some(position), None) => interior::best_direction(&self.tracer, horizon, position, 0.0, width)?,
            (Some(_), Some(_)) => return None,
            (None, None) => {
                let fov = self.request.vertical_fov.unwrap_or(OPEN_SIDE_FOV);
                let open_side = || interior::through_open_side(&self.tracer, horizon, fov, self.aspect);
                if let Some(view) = (view == NamedView::Auto).then(open_side).flatten() {
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
                        .and_then(|direction| self.tracer.trace(view.position, direction));
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
    /// rooms. If any room has a ceiling, only views of rooms with a ceiling are returned.
    fn views_inside(&self) -> Vec<InteriorView> {
        let views = |inside, count| interior::views(&self.tracer, self.horizon(), inside, count);
        if self.inside == PlaceKind::Anywhere {
            return views(PlaceKind::Anywhere, PLACES);
        }
        let kinds = [PlaceKind::RoofedRooms, PlaceKind::Rooms, PlaceKind::Hulls];
        let mut tries = kinds.into_iter().flat_map(|kind| [(kind, PLACES), (kind, MANY_PLACES)]);
        tries
            .find_map(|(kind, count)| Some(views(kind, count)).filter(|views| !views.is_empty()))
            .unwrap_or_default()
    }

    pub(super) fn inside_guess(&self, view: InteriorView) -> CameraGuess {
        let words = format!("an interior, from inside at eye height ({OTHERS})");
        self.guess(view.position, view.target(), self.inside_fov(), words)
    }

    /// Error: no place inside of the scene is suitable for a camera.
    pub(super) fn nothing_inside(&self) -> CameraError {
        let reason = match self.request.look_at {
            Some(_) if !self.views_inside().is_empty() => "no place inside sees the point of --look-at",
            _ => interior::reason_for_none(&self.tracer, self.horizon()),
        };
        CameraError::no_place(
            "view",
            format!("`inside` has no place for the camera: {reason}"),
            "leave --view out to see the scene from outside, or choose a place by --stand X,Z or --position X,Y,Z"
                .into(),
        )
    }

    /// The camera that stands on the floor at the place `stand`.
    pub(super) fn standing(&self, stand: Stand) -> Result<CameraGuess, CameraError> {
        let CameraRequest {
            look_at, yaw, origin, ..
        } = self.request;
        let horizon = self.horizon();
        let floors = Floors::new(&self.tracer, horizon);
        let scale = self.scale(&floors);
        let height = stand.height.unwrap_or(scale.eyes);
        let usual = match self.inside {
            PlaceKind::Anywhere => interior::floor_of_best(horizon, &self.views_inside()),
            _ => None,
        };
        let place = stand.coordinates(&floors, origin);
        let Some(floor) = stand::floor(&floors, &scale, place, height, usual) else {
            let has_floor = |place| stand::floor(&floors, &scale, place, height, usual).is_some();
            return Err(self.no_floor(&floors, &stand, has_floor));
        };
        let eye = horizon.point(Vec3::new(place.x, floor + height, place.z));
        let target = look_at.unwrap_or_else(|| {
            let view = match yaw {
                Some(yaw) => interior::view_towards(&self.tracer, horizon, eye, yaw, floors.width()),
                None => interior::best_view(&self.tracer, horizon, eye, height, floors.width()),
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

    /// Unit of the file, from the file itself or from the height of the rooms.
    fn scale(&self, floors: &Floors) -> Scale {
        Scale::new(self.request.unit, floors.room_height(), floors.height())
    }

    /// Error for a place without a floor. `has_floor` takes a place in the frame of the horizon.
    fn no_floor(&self, floors: &Floors, stand: &Stand, has_floor: impl Fn(Vec3) -> bool) -> CameraError {
        let origin = self.request.origin;
        let is_anywhere = floors.at_any(stand.coordinates(floors, origin));
        let reason = if is_anywhere {
            "has no floor with room for a camera above it"
        } else {
            "has no floor"
        };
        let height = stand.height.map_or(String::new(), |height| format!(",{height}"));
        let near = self.places().filter(|near| has_floor(near.coordinates(floors, origin)));
        let distance = |near: &Stand| {
            let [x, z] = [0, 1].map(|i| near.place[i] - stand.place[i]);
            x.hypot(z)
        };
        let nearest = near.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let other = match nearest {
            Some(near) => format!("--stand {}{height} is the nearest floor; or choose", near.place_text()),
            None => "choose".into(),
        };
        CameraError::no_place(
            "stand",
            format!("{}: this place {reason}", stand.place_text()),
            format!("{other} a lower HEIGHT, or a camera that `embrasure views SCENE -o views.png` shows"),
        )
    }

    /// Places on a grid over the whole scene.
    fn places(&self) -> impl Iterator<Item = Stand> {
        /// Number of places along each axis.
        const PLACES: usize = 24;
        let bounds = self.tracer.region.bounds;
        let up = self.horizon().up().abs().max_position();
        let origin = self.request.origin;
        let across: Vec<usize> = (0..3).filter(|&axis| axis != up).collect();
        let place = move |at: [usize; 2]| {
            let along = at.map(|i| (i as f32 + 0.5) / PLACES as f32);
            let [u, v] = [0, 1].map(|i| {
                let axis = across[i];
                let x = bounds.min[axis] + along[i] * (bounds.max[axis] - bounds.min[axis]);
                let text = &position_text(short(Vec3::splat(x), bounds.radius()), origin)[axis];
                text.parse().unwrap_or(f64::from(x) + origin[axis])
            });
            Stand {
                place: [u, v],
                height: None,
            }
        };
        (0..PLACES * PLACES).map(move |i| place([i % PLACES, i / PLACES]))
    }

    /// Dissimilar views of an interior, the best first.
    pub(super) fn distinct_views(&self) -> Vec<InteriorView> {
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
        self.request
            .vertical_fov
            .unwrap_or_else(|| (2.0 * narrowed.atan()).to_degrees().round())
    }

    /// Plan of an interior with `cameras`, `size` pixels along its larger edge; `None` for an
    /// object.
    pub fn plan(&self, cameras: &[CameraGuess], size: usize) -> Option<Plan> {
        if !self.survey.is_interior {
            return None;
        }
        let floors = Floors::new(&self.tracer, self.horizon());
        let floor = interior::floor_of_best(self.horizon(), &self.views_inside());
        let floor = floor.unwrap_or(floors.bounds().min.y);
        let cut = Cut::above(floor, &self.scale(&floors));
        let cameras: Vec<_> = cameras.iter().map(|camera| (camera.position, camera.look_at)).collect();
        Some(plan::plan(&floors, cut, &cameras, size))
    }

    /// Description of the file coordinates of a plan's edges.
    pub fn edges_text(&self, plan: &Plan) -> String {
        let text = |from: Vec3, to: Vec3, [from_side, to_side]: [&str; 2]| {
            let axis = (to - from).abs().max_position();
            let [from, to] =
                [from, to].map(|p| position_text(short(p, self.size()), self.request.origin)[axis].clone());
            format!("{} from {from} {from_side} to {to} {to_side}", ["x", "y", "z"][axis])
        };
        let [top_left, top_right, bottom_left] = plan.corners;
        format!(
            "{}, {}",
            text(top_left, top_right, ["on the left", "on the right"]),
            text(top_left, bottom_left, ["at the top", "at the bottom"])
        )
    }
}

/// `x` with four significant digits.
fn short_number(x: f32) -> String {
    short(Vec3::splat(x), x).x.to_string()
}
