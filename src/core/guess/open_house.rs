//! Rooms without a ceiling, seen from above: dolls' houses and furnished floor plans. The view is
//! from a side whose outer wall is low, open or missing.

use super::floors::{Floors, PLACES};
use super::scene_tracer::SceneTracer;
use crate::math::{Horizon, Vec3};

/// Elevation of the view of rooms without a ceiling, in degrees.
const ELEVATION: f32 = 35.0;
/// The same elevation for a file with the name of rooms, if less than the fraction [`SHOWN`] of the
/// places is visible from [`ELEVATION`]: its walls are high.
const HIGH_ELEVATION: f32 = 55.0;
const SHOWN: f32 = 0.6;
/// Maximum ratio of a scene's height to its smaller width: cups and crates are higher. The second
/// ratio is for files with the name of rooms.
const LOW: [f32; 2] = [0.6, 1.2];
/// Maximum height of the highest surface at a place inside, as a fraction of the scene's height.
const INSIDE: f32 = 0.6;
/// Height above the ground at which walls are searched, as a fraction of the scene's height.
const WALL: f32 = 0.5;
/// Minimum number of walls around a place inside, of 8 directions.
const WALLS: usize = 5;
/// Minimum fraction of the places that are inside.
const ROOMS: f32 = 0.3;
/// Height of test points above the highest surface of a place, as a fraction of the scene's height.
const OFF_SURFACE: f32 = 0.02;
/// Azimuths from the front that are tried, in degrees, the nearest first.
const TURNS: [f32; 12] = [
    30.0, -30.0, 60.0, -60.0, 0.0, 90.0, -90.0, 120.0, -120.0, 150.0, -150.0, 180.0,
];
/// A later azimuth is used if its fraction of visible places is larger by more than `MORE`.
const MORE: f32 = 0.04;

/// Azimuth and elevation from which most of the rooms is visible, in degrees; `None` if the scene
/// has no rooms without a ceiling. `is_named` is true if the file has the name of rooms.
pub(super) fn angles(tracer: &SceneTracer, horizon: &Horizon, front: f32, is_named: bool) -> Option<(f32, f32)> {
    let floors = Floors::new(tracer, horizon);
    let (bounds, height) = (floors.bounds(), floors.height());
    let size = bounds.max - bounds.min;
    if height > LOW[usize::from(is_named)] * size.x.min(size.z) {
        return None;
    }
    let places = floors.places(PLACES);
    let count = places.len();
    let inside = |(x, z): (f32, f32)| {
        let top = floors.at(x, z).into_iter().next()?;
        let eye = Vec3::new(x, (bounds.min.y + WALL * height).max(top.y + OFF_SURFACE * height), z);
        let has_wall = |i: &u8| {
            let way = horizon.direction(f32::from(*i) * 45.0, 0.0);
            tracer.trace(horizon.point(eye), way).is_some()
        };
        let is_inside = top.y < bounds.min.y + INSIDE * height && (0..8).filter(has_wall).count() >= WALLS;
        is_inside.then(|| horizon.point(Vec3::new(x, top.y + OFF_SURFACE * height, z)))
    };
    let points: Vec<Vec3> = places.into_iter().filter_map(inside).collect();
    if (points.len() as f32) < ROOMS * count as f32 {
        return None;
    }
    let best_of = |elevation: f32| {
        let mut best = (front, f32::NEG_INFINITY);
        for turn in TURNS {
            let back = horizon.direction(front + turn, elevation);
            let shown = points.iter().filter(|&&p| tracer.trace(p, back).is_none()).count();
            let share = shown as f32 / points.len() as f32;
            if share > best.1 + MORE {
                best = (front + turn, share);
            }
        }
        best
    };
    let (azimuth, share) = best_of(ELEVATION);
    Some(if is_named && share < SHOWN {
        (best_of(HIGH_ELEVATION).0, HIGH_ELEVATION)
    } else {
        (azimuth, ELEVATION)
    })
}
