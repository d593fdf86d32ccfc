//! Rooms: points of a scene that surfaces enclose with their fronts.

use super::file_axes::NamedThing;
use super::scene_tracer::{HitStatistics, SceneTracer};
use super::spread::{POINTS, directions, points_inside};
use crate::math::Vec3;

/// A point is in a room if at least this fraction of its rays hits the front side of a surface.
const ENCLOSED: f32 = 0.62;
/// Minimum fraction of the points that are in rooms, for an interior.
const MIN_ROOM: f32 = 0.2;
/// Minimum fraction of the points that are in rooms, for an interior with much more detail inside
/// than outside.
const MIN_DETAILED_ROOM: f32 = 0.12;
/// Fraction of the hits from outside that are on fronts. If it is lower, the scene is a hull that
/// is not made to be seen from outside.
const HULL: f32 = 0.6;
/// Minimum additional information inside compared to outside, in bits: for a hull; for a hull with
/// little room; and for a body, which is closed on the outside. Hollow bricks and cupboards are
/// bodies.
const MORE_INSIDE: [f32; 3] = [-0.3, 1.0, 2.5];
/// The same limits for a file with the name of rooms.
const MORE_IN_NAMED: [f32; 3] = [-0.3, 1.0, 0.0];
/// Minimum additional information inside compared to outside, in bits, for a body with the name of
/// rooms, and minimum fraction of its points that are in rooms: plain rooms with thick walls look
/// alike from inside and from outside. Named buildings have details outside.
const MORE_IN_PLAIN: f32 = -0.6;
const PLAIN_ROOM: f32 = 0.7;
/// Minimum additional information inside compared to outside, in bits, for a closed hull: bodies
/// whose faces are all turned over look alike from inside and from outside.
const MORE_IN_CLOSED: f32 = 0.5;
/// Maximum openness of a closed hull.
const CLOSED: f32 = 0.003;
/// Maximum fraction of the points in rooms, for such a body: rooms fill their boxes.
const FILLED: f32 = 0.8;

/// Minimum fraction of the scene's corners in a group of parts that is a room among other groups.
const MIN_GROUP: f32 = 0.5;
/// Minimum fraction of a group's points that are in rooms, if the group is a room among other
/// groups. Courtyards of buildings are smaller.
const MIN_ROOM_OF_GROUP: f32 = 0.4;
/// Maximum openness of a group that is a room among other groups. Courtyards of buildings are open.
const MAX_OPENNESS: f32 = 0.1;

/// Surroundings of a point: fractions of the directions that hit surfaces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings {
    /// Fraction of all directions that hit a front.
    pub fronts: f32,
    /// Fraction of all directions that hit a back.
    pub backs: f32,
    /// Fraction of the directions above the horizon that hit a surface.
    pub above: f32,
}

impl Surroundings {
    /// Surroundings of `p` along set `i` of the directions, with the up direction `up`.
    pub fn of(tracer: &SceneTracer, p: Vec3, up: Vec3, i: u32) -> Self {
        let (mut fronts, mut backs, mut above) = (0.0, 0.0, [0.0, 0.0f32]);
        let mut count = 0.0f32;
        for direction in directions(i) {
            let seen = tracer.trace(p, direction);
            count += 1.0;
            if direction.dot(up) > 0.0 {
                above[1] += 1.0;
                above[0] += f32::from(u8::from(seen.is_some()));
            }
            match seen {
                Some(seen) if seen.is_front => fronts += 1.0,
                Some(_) => backs += 1.0,
                None => {}
            }
        }
        Self {
            fronts: fronts / count,
            backs: backs / count,
            above: above[0] / above[1].max(1.0),
        }
    }

    /// Fraction of all directions that hit a surface.
    pub fn closed(&self) -> f32 {
        self.fronts + self.backs
    }

    /// Returns true if fronts enclose the point.
    pub fn is_room(&self) -> bool {
        self.fronts >= ENCLOSED
    }
}

/// Rooms in a region, and the information inside and outside of the region.
pub(super) struct Rooms {
    /// Points in rooms.
    pub points: Vec<Vec3>,
    /// Fraction of the rays from points in rooms that leave the scene.
    pub openness: f32,
    /// Fraction of the hits from outside that are on fronts.
    fronts: f32,
    /// Additional information inside compared to outside, in bits.
    more: f32,
    /// Fraction of the corners, if the region is a group of parts among others.
    group: Option<f32>,
}

impl Rooms {
    pub fn of(tracer: &SceneTracer) -> Self {
        let bounds = tracer.region.bounds;
        // Trace rays from points inside
        let (mut within, mut points, mut escaped) = (HitStatistics::default(), Vec::new(), 0);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            let mut around = HitStatistics::default();
            let seen: Vec<_> = directions(i).map(|direction| tracer.trace(p, direction)).collect();
            seen.iter().for_each(|seen| around.add(seen.as_ref()));
            if around.fronts as f32 >= ENCLOSED * around.rays as f32 {
                points.push(p);
                escaped += directions(i).filter(|&direction| tracer.escapes(p, direction)).count();
                seen.iter().for_each(|seen| within.add(seen.as_ref()));
            }
        }

        // Trace rays from outside towards points of the region
        let mut without = HitStatistics::default();
        let reach = 2.0 * bounds.radius().max(f32::MIN_POSITIVE);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            for direction in directions(i) {
                let reach = if tracer.region.group.is_some() {
                    distance_to_surface(tracer, p, -direction)
                } else {
                    reach
                };
                without.add(tracer.trace(p - reach * direction, direction).as_ref());
            }
        }
        let detail = |tally: &HitStatistics| tally.entropies().iter().sum::<f32>();
        Self {
            points,
            openness: escaped as f32 / within.rays.max(1) as f32,
            fronts: without.front_share(),
            more: detail(&within) - detail(&without),
            group: tracer.region.group,
        }
    }

    /// Returns true if the region was made to be seen from inside. `thing` is the thing that the
    /// file name names.
    pub fn are_interior(&self, thing: Option<NamedThing>) -> bool {
        let kinds = [
            NamedThing::Tall,
            NamedThing::Standing,
            NamedThing::Several,
            NamedThing::Long,
        ];
        if thing.is_some_and(|thing| kinds.contains(&thing)) {
            return false;
        }
        let rooms = self.points.len() as f32 / POINTS as f32;
        let is_open = || rooms < MIN_ROOM_OF_GROUP || self.openness > MAX_OPENNESS;
        if self.group.is_some_and(|share| share < MIN_GROUP || is_open()) {
            return false;
        }
        let is_named = thing == Some(NamedThing::Rooms);
        let is_body = self.openness < CLOSED && rooms < FILLED && self.more < MORE_IN_CLOSED;
        if is_body && !is_named {
            return false;
        }
        let [hull, partly, mut body] = if is_named { MORE_IN_NAMED } else { MORE_INSIDE };
        if is_named && rooms >= PLAIN_ROOM {
            body = MORE_IN_PLAIN;
        }
        if self.fronts < HULL {
            rooms >= MIN_ROOM && self.more > hull || rooms >= MIN_DETAILED_ROOM && self.more > partly
        } else {
            rooms >= MIN_ROOM && self.more > body
        }
    }
}

/// Distance from a point inside to the surface of the region's box, plus a margin.
fn distance_to_surface(tracer: &SceneTracer, p: Vec3, direction: Vec3) -> f32 {
    let bounds = tracer.region.bounds;
    let margin = 1e-3 * bounds.radius();
    let way = |axis: usize| {
        let end = if direction[axis] > 0.0 { bounds.max } else { bounds.min };
        if direction[axis] == 0.0 {
            f32::INFINITY
        } else {
            (end[axis] - p[axis]) / direction[axis]
        }
    };
    way(0).min(way(1)).min(way(2)).max(0.0) + margin
}
