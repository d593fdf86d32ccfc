//! Views of an interior: level, at eye height, in the direction with the most to see.

pub(super) use super::floors::upright_bounds;
use super::floors::{Floors, PLACES, Surface};
use super::rooms::Surroundings;
use super::scene_tracer::{HitStatistics, SceneTracer, SurfaceHit};
use super::spread::directions;
use crate::math::{Horizon, Vec3};
use rayon::prelude::*;
use std::f32::consts::TAU;

/// Number of azimuths in a panorama, all around.
const COLUMNS: usize = 72;
/// Number of elevations in a panorama.
const ROWS: usize = 16;
/// Elevations of a panorama are between `-PITCH` and `PITCH`, in degrees.
const PITCH: f32 = 32.0_f32;
/// Width of the image in columns of the panorama: 60°.
const WINDOW: usize = 12;
/// Minimum fraction of the directions above the horizon that hit a surface, in a room with a
/// ceiling.
const ROOFED: f32 = 0.75;
/// Minimum difference in height between the floors of two storeys, in room heights.
const STOREY: f32 = 0.8;
/// Minimum fraction of all directions that hit a surface, in a closed place.
const CLOSED: f32 = 0.62;
/// Eye height as a fraction of the room's height, and its maximum as a fraction of the scene's
/// width.
const EYE: [f32; 2] = [0.5, 0.2];
/// Minimum distance to the nearest surface around the eye, as a fraction of the eye height.
const FREE_DISTANCE: f32 = 0.3;
/// Distance, in eye heights, below which a surface blocks a view.
const NEAR: f32 = 0.8;

/// Limits of a surface in the foreground: fraction of the distance of the floor in the same
/// direction, and distance in eye heights. A table before the camera has smaller values.
const FOREGROUND: [f32; 2] = [0.75, 1.6];
/// Fraction of the directions near the horizon that may leave the scene without lowering the score
/// of a place: doors and windows. More of them leave it at places outside of the walls.
const OPEN_SIDES: f32 = 0.2;
/// Fraction of the image that a foreground may cover without lowering the score of a view.
const FREE_FOREGROUND: f32 = 0.12;

/// A view from inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct InteriorView {
    pub position: Vec3,
    /// Horizontal unit vector.
    pub direction: Vec3,
    /// Median distance of the visible surfaces.
    pub distance: f32,
    /// Height of the eye above the floor; 0 if the eye does not stand on a floor.
    pub height: f32,
    /// Fraction of the rays that leave the scene.
    pub missing: f32,
    pub score: f32,
}

impl InteriorView {
    /// Height of the floor below the eye, in the frame of `horizon`.
    pub fn floor(&self, horizon: &Horizon) -> f32 {
        horizon.coordinates(self.position).y - self.height
    }

    /// Point in the middle of the image, at the median distance.
    pub fn target(&self) -> Vec3 {
        self.position + self.distance * self.direction
    }
}

/// Kind of the places that are searched for views from inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlaceKind {
    /// All places: the scene is an interior.
    Anywhere,
    /// Places that surfaces enclose with their fronts.
    Rooms,
    /// Rooms with a ceiling.
    RoofedRooms,
    /// Places in a hull with an opening: on the inside, its walls show their backs.
    Hulls,
}

/// Best view from each place of the floor where a person can stand, sorted by decreasing score. The
/// floor has `count` places along each side.
pub(super) fn views(tracer: &SceneTracer, horizon: &Horizon, inside: PlaceKind, count: u32) -> Vec<InteriorView> {
    let floors = Floors::new(tracer, horizon);
    let width = floors.width();
    let mut views: Vec<InteriorView> = floors
        .places(count)
        .par_iter()
        .flat_map_iter(|&(x, z)| {
            let eyes = eyes(&floors, x, z).into_iter();
            let eyes = eyes.filter(|&(eye, _)| is_inside(tracer, horizon, eye, inside));
            eyes.filter_map(|(eye, height)| best_direction(tracer, horizon, eye, height, width))
        })
        .collect();
    // Stable sort: among equal views the first place wins.
    views.sort_by(|a, b| b.score.total_cmp(&a.score));
    views
}

/// The floor of a storey.
#[derive(Clone, Copy, Debug)]
struct UsualFloor {
    /// Height in the frame of the horizon.
    pub y: f32,
    /// Height of the room above.
    room: f32,
}

/// Median floor height and room height of `views`; `None` without views.
fn usual_floor(horizon: &Horizon, views: &[InteriorView]) -> Option<UsualFloor> {
    let median = |of: &dyn Fn(&InteriorView) -> f32| {
        let mut values: Vec<f32> = views.iter().map(of).collect();
        values.sort_by(f32::total_cmp);
        values.get(values.len() / 2).copied()
    };
    Some(UsualFloor {
        y: median(&|view| view.floor(horizon))?,
        room: median(&|view| view.height / EYE[0])?.max(f32::MIN_POSITIVE),
    })
}

/// Median floor height of the views in the storey of the best view. `views` are sorted, the best
/// first.
pub(super) fn floor_of_best(horizon: &Horizon, views: &[InteriorView]) -> Option<f32> {
    let room = usual_floor(horizon, views)?.room;
    let best = views.first()?.floor(horizon);
    let is_near = |view: &&InteriorView| (view.floor(horizon) - best).abs() < STOREY * room;
    let storey: Vec<InteriorView> = views.iter().filter(is_near).copied().collect();
    Some(usual_floor(horizon, &storey)?.y)
}

fn is_inside(tracer: &SceneTracer, horizon: &Horizon, eye: Vec3, inside: PlaceKind) -> bool {
    let around = || Surroundings::of(tracer, eye, horizon.up(), 0);
    let has = |is: fn(Surroundings) -> bool| is(around());
    match inside {
        PlaceKind::Anywhere => true,
        PlaceKind::Rooms => has(|around| around.is_room()),
        PlaceKind::RoofedRooms => has(|around| around.is_room() && around.above >= ROOFED),
        PlaceKind::Hulls => has(|around| around.above >= ROOFED && (CLOSED..1.0).contains(&around.closed())),
    }
}

/// Openness of a room with a ceiling: fraction of the rays from points around `position` that reach
/// daylight. `None` if `position` is not in such a room. The rays start around `position` because
/// windows may be invisible from `position` itself.
pub(super) fn openness_of_room(tracer: &SceneTracer, horizon: &Horizon, position: Vec3) -> Option<f32> {
    if !is_inside(tracer, horizon, position, PlaceKind::RoofedRooms) {
        return None;
    }
    let (mut open, mut count) = (0.0, 0.0f32);
    for (i, way) in (1..).zip(directions(0)) {
        let distance = tracer.trace(position, way).map_or(0.0, |seen| seen.distance);
        let p = position + 0.5 * distance * way;
        for direction in directions(i) {
            count += 1.0;
            open += f32::from(u8::from(sees_daylight(tracer, horizon, p, direction)));
        }
    }
    Some(open / count.max(1.0))
}

/// Returns true if a ray leaves the scene, or hits a surface below the open sky.
fn sees_daylight(tracer: &SceneTracer, horizon: &Horizon, p: Vec3, direction: Vec3) -> bool {
    let is_below_sky = || {
        let seen = tracer.trace(p, direction);
        seen.is_some_and(|seen| tracer.escapes(p + 0.999 * seen.distance * direction, horizon.up()))
    };
    tracer.escapes(p, direction) || is_below_sky()
}

/// Reason for a missing view from inside, for users.
pub(super) fn reason_for_none(tracer: &SceneTracer, horizon: &Horizon) -> &'static str {
    let floors = Floors::new(tracer, horizon);
    let (mut count, mut closed, mut backs) = (0, 0, 0);
    for (x, z) in floors.places(PLACES) {
        for (eye, _) in eyes(&floors, x, z) {
            let around = Surroundings::of(tracer, eye, horizon.up(), 0);
            count += 1;
            closed += u32::from(around.closed() >= CLOSED);
            backs += u32::from(around.backs > around.fronts);
        }
    }
    if count == 0 {
        "there is no floor with room above it"
    } else if 2 * backs > count && closed > 0 {
        "the scene is a closed body, and shows the backs of its surfaces inside"
    } else if closed == 0 {
        "no place on a floor is enclosed by walls"
    } else {
        "no place with a floor has room for a camera"
    }
}

/// Number of rays along each edge of a side of the scene's box, for finding openings.
const SIDE_RAYS: u32 = 12;
/// Minimum fraction of the rays that pass the side, and minimum length of their paths, as a
/// fraction of the box's depth.
const OPEN: (f32, f32) = (0.75, 0.15);
/// Minimum fraction of the places without a surface above half the height of the scene, if there is
/// no ceiling: walls cover the other places.
const OPEN_ABOVE: f32 = 0.8;
/// Minimum fraction of the side's width and height that the image shows. If the aspect ratios of
/// side and image differ, the image crops the side.
const SHOWN: f32 = 0.7;

/// Azimuths of the sides of the scene's box, in the order in which they are tried.
const SIDES: [f32; 4] = [0.0, 90.0, 270.0, 180.0];

/// A side of the scene's box, in the frame of the horizon.
struct BoxSide {
    center: Vec3,
    /// Half of the box's extents.
    half: Vec3,
    /// Unit vector out of the box.
    out: Vec3,
}

impl BoxSide {
    fn new(tracer: &SceneTracer, horizon: &Horizon, azimuth: f32) -> Self {
        let box_ = upright_bounds(tracer.region.bounds, horizon);
        Self {
            center: 0.5 * box_.min + 0.5 * box_.max,
            half: 0.5 * (box_.max - box_.min),
            out: horizon.coordinates(horizon.direction(azimuth, 0.0)).round(),
        }
    }

    /// Half of the box's extent across the side.
    fn depth(&self) -> f32 {
        (self.half * self.out).length()
    }

    /// Horizontal unit vector along the side.
    fn across(&self) -> Vec3 {
        Vec3::new(self.out.z, 0.0, -self.out.x)
    }

    /// Half of the side's width.
    fn width(&self) -> f32 {
        (self.half * self.across()).length()
    }

    /// Returns true if most rays pass the side, and go far into the box.
    fn is_open(&self, tracer: &SceneTracer, horizon: &Horizon) -> bool {
        let (depth, width) = (self.depth(), self.width());
        let place = |u: f32, v: f32| {
            self.center + self.out * depth * 1.01 + self.across() * width * u + Vec3::Y * self.half.y * v
        };
        let share = |i: u32| (i as f32 + 0.5) / SIDE_RAYS as f32 * 1.9 - 0.95;
        let goes_in = |i: &u32| {
            let origin = horizon.point(place(share(i % SIDE_RAYS), share(i / SIDE_RAYS)));
            let seen = tracer.trace(origin, -horizon.point(self.out));
            seen.is_some_and(|seen| seen.is_front && seen.distance > 2.0 * OPEN.1 * depth)
        };
        let count = (0..SIDE_RAYS * SIDE_RAYS).filter(goes_in).count();
        count as f32 >= OPEN.0 * (SIDE_RAYS * SIDE_RAYS) as f32
    }
}

/// Returns true if the scene is the corner of a room: two sides that adjoin have no walls, and
/// there is no ceiling.
pub(super) fn is_corner_of_room(tracer: &SceneTracer, horizon: &Horizon) -> bool {
    let is_open = SIDES.map(|azimuth| BoxSide::new(tracer, horizon, azimuth).is_open(tracer, horizon));
    // In `SIDES`, the second and the third side adjoin the first and the last side.
    if !(is_open[0] || is_open[3]) || !(is_open[1] || is_open[2]) {
        return false;
    }
    let floors = Floors::new(tracer, horizon);
    let middle = 0.5 * (floors.bounds().min.y + floors.bounds().max.y);
    let places = floors.places(PLACES);
    let is_below_sky = |&&(x, z): &&(f32, f32)| {
        let p = horizon.point(Vec3::new(x, middle, z));
        tracer.trace(p, horizon.up()).is_none()
    };
    places.iter().filter(is_below_sky).count() as f32 >= OPEN_ABOVE * places.len() as f32
}

/// The view from outside through a side of the scene's box without a wall: some rooms are modelled
/// to be seen like this. If several sides have no wall, the first of the azimuths 0, 90, 270 and
/// 180 is used. `fov` is vertical, in degrees. `aspect` is the aspect ratio of the image, which the
/// side fills.
pub(super) fn through_open_side(
    tracer: &SceneTracer,
    horizon: &Horizon,
    fov: f32,
    aspect: f32,
) -> Option<InteriorView> {
    SIDES.into_iter().find_map(|azimuth| {
        let side = BoxSide::new(tracer, horizon, azimuth);
        if !side.is_open(tracer, horizon) {
            return None;
        }
        let (depth, out) = (side.depth(), side.out);
        let slope = (0.5 * fov.clamp(1.0, 179.0)).to_radians().tan();
        // Move back until the side just fills the image, or further, until the image shows at least
        // the fraction `SHOWN` of the side's width and height.
        let (by_height, by_width) = (side.half.y / slope, side.width() / (slope * aspect));
        let away = by_height.min(by_width).max(SHOWN * by_height.max(by_width));
        Some(InteriorView {
            position: horizon.point(side.center + out * (depth + away)),
            direction: -horizon.point(out),
            distance: away + depth,
            height: 0.0,
            missing: 0.0,
            score: f32::INFINITY,
        })
    })
}

/// The best level view at `position`, for the eye height `height` in a scene of the width `width`.
/// `None` if a surface is too near to the eye.
pub(super) fn best_direction(
    tracer: &SceneTracer,
    horizon: &Horizon,
    position: Vec3,
    height: f32,
    width: f32,
) -> Option<InteriorView> {
    let panorama = Panorama::take(tracer, horizon, position);
    let has_place = panorama.nearest() >= FREE_DISTANCE * height;
    has_place.then(|| panorama.best_view(horizon, position, height, width))
}

/// The best level view at `position`, even if a surface is near the eye.
pub(super) fn best_view(
    tracer: &SceneTracer,
    horizon: &Horizon,
    position: Vec3,
    height: f32,
    width: f32,
) -> InteriorView {
    Panorama::take(tracer, horizon, position).best_view(horizon, position, height, width)
}

/// The level view at `position` towards `azimuth`, in degrees.
pub(super) fn view_towards(
    tracer: &SceneTracer,
    horizon: &Horizon,
    position: Vec3,
    azimuth: f32,
    width: f32,
) -> InteriorView {
    let column = (azimuth / 360.0 * COLUMNS as f32).rem_euclid(COLUMNS as f32).round() as usize % COLUMNS;
    let view = Panorama::take(tracer, horizon, position).view(horizon, position, column, 0.0, width);
    InteriorView {
        direction: horizon.direction(azimuth, 0.0),
        ..view
    }
}

/// Positions of eyes above (`x`, `z`), one above each flat surface with room above it, and the
/// height of each eye above its floor.
fn eyes(floors: &Floors, x: f32, z: f32) -> Vec<(Vec3, f32)> {
    let surfaces = floors.at(x, z).into_iter();
    let with_room = surfaces.filter(|surface| surface.is_flat() && surface.room > floors.min_room());
    let eye = |surface: Surface| {
        let eye = (EYE[0] * surface.room).min(EYE[1] * floors.width());
        (floors.horizon.point(Vec3::new(x, surface.y + eye, z)), eye)
    };
    with_room.map(eye).collect()
}

/// Surfaces all around a point: columns by azimuth, each with rows from the bottom.
struct Panorama(Vec<[Option<SurfaceHit>; ROWS]>);

impl Panorama {
    fn take(tracer: &SceneTracer, horizon: &Horizon, position: Vec3) -> Self {
        let column = |column: usize| {
            let azimuth = 360.0 * column as f32 / COLUMNS as f32;
            std::array::from_fn(|row| tracer.trace(position, horizon.direction(azimuth, elevation(row))))
        };
        Self((0..COLUMNS).map(column).collect())
    }

    fn nearest(&self) -> f32 {
        let distances = self.0.iter().flatten().flatten().map(|seen| seen.distance);
        distances.fold(f32::INFINITY, f32::min)
    }

    /// Fraction of the directions near the horizon that hit no surface.
    fn openness(&self) -> f32 {
        let level = |column: &[Option<SurfaceHit>; ROWS]| [column[ROWS / 2 - 1], column[ROWS / 2]];
        let open = self.0.iter().flat_map(level).filter(Option::is_none).count();
        open as f32 / (2 * COLUMNS) as f32
    }

    /// The view with the largest score.
    fn best_view(&self, horizon: &Horizon, position: Vec3, height: f32, width: f32) -> InteriorView {
        let view = |column| self.view(horizon, position, column, height, width);
        let others = (2..COLUMNS).step_by(2).map(view);
        others.fold(view(0), |best, view| if best.score >= view.score { best } else { view })
    }

    /// The view whose middle is between `column` and the column before it. The score is the visible
    /// information in bits plus a term for the distance. Near surfaces that block the view lower
    /// the score, and so do near surfaces above the floor in the lower half of the image, and open
    /// sides of the place. Backs of surfaces lower it too, because they are not meant to be seen.
    fn view(&self, horizon: &Horizon, position: Vec3, column: usize, height: f32, width: f32) -> InteriorView {
        let mut tally = HitStatistics::default();
        let (mut distances, mut near, mut foreground) = (Vec::with_capacity(WINDOW * ROWS), 0, 0);
        for i in 0..WINDOW {
            let column = (column + COLUMNS + i - WINDOW / 2) % COLUMNS;
            for (row, seen) in self.0[column].iter().enumerate() {
                tally.add(seen.as_ref());
                distances.extend(seen.map(|seen| seen.distance));
                near += u32::from(seen.is_some_and(|seen| seen.distance < NEAR * height));
                let down = -elevation(row).to_radians().sin();
                let [share, heights] = FOREGROUND;
                let limit = (heights * height).min(share * height / down.max(f32::MIN_POSITIVE));
                foreground += u32::from(down > 0.0 && seen.is_some_and(|seen| seen.distance < limit));
            }
        }
        distances.sort_by(f32::total_cmp);
        let distance = distances.get(distances.len() / 2).copied().unwrap_or(width);
        let share = |count: u32| count as f32 / tally.rays as f32;
        let [normals, materials, triangles] = tally.entropies();
        let shows = normals + materials + 0.3 * triangles;
        let reaches = 1.5 * (distance / width).clamp(0.02, 1.0).log2();
        let missing = share(tally.rays - tally.hits);
        let backs = share(tally.hits - tally.fronts);
        let turned = (column as f32 - 0.5) / COLUMNS as f32 * TAU;
        InteriorView {
            position,
            direction: horizon.direction(turned.to_degrees(), 0.0),
            distance,
            height,
            missing,
            score: shows + reaches
                - 6.0 * share(near)
                - 8.0 * (share(foreground) - FREE_FOREGROUND).max(0.0)
                - 3.0 * (self.openness() - OPEN_SIDES).max(0.0)
                - 6.0 * (missing - 0.25).max(0.0)
                - 4.0 * backs,
        }
    }
}

/// Elevation of a row of a panorama, in degrees.
fn elevation(row: usize) -> f32 {
    PITCH * (2.0 * (row as f32 + 0.5) / ROWS as f32 - 1.0)
}
