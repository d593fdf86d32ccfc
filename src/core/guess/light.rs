//! Guess of the light of a scene whose own emitters do not light it, by the kind of scene.

use super::emitters::{self, Requirement};
use super::rooms::Surroundings;
use super::scene_tracer::SceneTracer;
use super::spread::points_inside;
use super::survey::Survey;
use crate::light::Light;
use crate::math::{Horizon, Vec3};

/// Number of azimuths at which the sun is tried.
const AZIMUTHS: u32 = 24;
/// Elevations at which the sun is tried, in degrees. If all suns are equal, the first is used.
const ELEVATIONS: [f32; 3] = [40.0, 28.0, 55.0];
/// Minimum fraction of the points that are in rooms. If the fraction is lower, only the points in
/// rooms decide on the sun.
const FEW: f32 = 0.2;
/// Edge of the lamp of a closed room, and its distance from the ceiling, as fractions of the room's
/// height.
const LAMP: (f32, f32) = (0.4, 0.03);
/// Places of that lamp that are tried, as fractions of the way from the camera to its target.
const WAYS: [f32; 4] = [0.5, 0.35, 0.2, 0.0];
/// Minimum height of the room at the lamp, as a fraction of the height at the camera.
const MIN_HEIGHT: f32 = 0.4;

/// Minimum lighting by the emitting surfaces of an object or an interior. If there is less, a light
/// is guessed. A staged scene with a lamp has this lighting; an object with some emitting parts
/// does not.
const OBJECT: Requirement = Requirement {
    share: 0.8,
    irradiance: 1.0 / 32.0,
};
const INTERIOR: Requirement = Requirement {
    share: 0.65,
    irradiance: 1.0 / 64.0,
};
/// Half angle of the cone in which an interior is seen, in degrees.
const INTERIOR_CONE: f32 = 35.0;

/// Light for a scene whose emitters do not light it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightGuess {
    /// Soft lamps around an object, on a ground that catches its shadow.
    Studio,
    /// Sky and sun through the openings of an interior; azimuth and elevation of the sun in
    /// degrees.
    Daylight([f32; 2]),
    /// A square lamp below the ceiling of a closed room.
    Lamp {
        /// Centre, world space.
        position: Vec3,
        /// Unit vector in which the lamp shines.
        direction: Vec3,
        /// Length of the edges, scene units.
        size: f32,
    },
}

impl LightGuess {
    /// Light for a camera at `position` that looks at `target`; `None` if the scene's own emitters
    /// light the view of the camera.
    pub(super) fn new(tracer: &SceneTracer, survey: &Survey, position: Vec3, target: Vec3) -> Option<Self> {
        if is_lit(tracer, survey, position, target) {
            return None;
        }
        if !survey.is_interior {
            return Some(Self::Studio);
        }
        if !survey.is_closed() {
            return Some(Self::Daylight(sun_through_openings(tracer, &survey.horizon)));
        }
        let lamp = lamp(tracer, &survey.horizon, position, target);
        Some(lamp.unwrap_or(Self::Daylight([-45.0, ELEVATIONS[0]])))
    }
}

/// Returns true if the scene's emitting surfaces light the view of a camera at `position`.
fn is_lit(tracer: &SceneTracer, survey: &Survey, position: Vec3, target: Vec3) -> bool {
    if tracer.scene.lights().iter().all(Light::is_infinite) {
        return false;
    }
    let bounds = tracer.region.bounds;
    let (way, half_angle, requirement) = if survey.is_interior {
        (target - position, INTERIOR_CONE.to_radians(), INTERIOR)
    } else {
        let way = bounds.center() - position;
        let sine = bounds.radius() / way.length().max(bounds.radius());
        (way, sine.asin().min(1.0), OBJECT)
    };
    let direction = way.try_normalize().unwrap_or(Vec3::NEG_Z);
    emitters::light(tracer, position, (direction, half_angle), requirement)
}

/// Azimuth and elevation in degrees of the sun that lights the most points. If few points are in
/// rooms, only the points in rooms are used, because points outside of the walls are in the sun
/// anyway.
fn sun_through_openings(tracer: &SceneTracer, horizon: &Horizon) -> [f32; 2] {
    let points: Vec<Vec3> = points_inside(tracer.region.bounds).collect();
    let is_room = |&(i, p): &(u32, Vec3)| Surroundings::of(tracer, p, horizon.up(), i).is_room();
    let rooms = (0..).zip(points.iter().copied()).filter(is_room);
    let rooms: Vec<Vec3> = rooms.map(|(_, p)| p).collect();
    let are_few = (rooms.len() as f32) < FEW * points.len() as f32;
    let in_rooms = are_few.then(|| best_sun(tracer, horizon, &rooms)).flatten();
    in_rooms
        .or_else(|| best_sun(tracer, horizon, &points))
        .unwrap_or([-45.0, ELEVATIONS[0]])
}

/// The sun that lights the most of `points`; `None` if no sun lights any point.
fn best_sun(tracer: &SceneTracer, horizon: &Horizon, points: &[Vec3]) -> Option<[f32; 2]> {
    let mut best = (None, 0);
    for elevation in ELEVATIONS {
        for i in 0..AZIMUTHS {
            // Turn the sun a few degrees away from the walls, which mostly stand along the axes
            let azimuth = -150.0 + 360.0 * (i as f32) / AZIMUTHS as f32 + 7.0;
            let direction = horizon.direction(azimuth, elevation);
            let lit = points.iter().filter(|&&p| tracer.escapes(p, direction)).count();
            // Another sun must light a tenth more points, so that rounding does not decide
            if lit * 10 > best.1 * 11 {
                best = (Some([azimuth, elevation]), lit);
            }
        }
    }
    best.0
}

/// A lamp below the ceiling, between the camera and its target. The camera sees the place below the
/// lamp, and the room there is not much lower than at the camera: the edge of a floor, or a shelf,
/// would keep the light. `None` if there is no ceiling.
fn lamp(tracer: &SceneTracer, horizon: &Horizon, position: Vec3, target: Vec3) -> Option<LightGuess> {
    let room = |p: Vec3| {
        let above = tracer.trace(p, horizon.up())?.distance;
        let below = tracer.trace(p, -horizon.up()).map_or(above, |floor| floor.distance);
        Some((above, above + below))
    };
    let at_camera = room(position).map_or(0.0, |(_, height)| height);
    let place = |&share: &f32| {
        let p = position.lerp(target, share);
        let way = p - position;
        let is_seen = way
            .try_normalize()
            .and_then(|direction| tracer.trace(position, direction))
            .is_none_or(|seen| seen.distance >= way.length());
        let (above, height) = room(p).filter(|&(_, height)| is_seen && height >= MIN_HEIGHT * at_camera)?;
        Some((p, above, height))
    };
    let (p, above, height) = WAYS.iter().find_map(place)?;
    Some(LightGuess::Lamp {
        position: p + (above - LAMP.1 * height) * horizon.up(),
        direction: -horizon.up(),
        size: LAMP.0 * height,
    })
}
