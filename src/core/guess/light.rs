//! The light of a scene without any, by what kind of scene it is.

use super::look::Looker;
use super::survey::{Survey, points_inside};
use crate::math::{Horizon, Vec3};

/// Share of the rays from inside that must leave an interior for daylight to come in.
const MIN_OPENNESS: f32 = 0.003;
/// Azimuths at which the sun is tried, and its elevations in degrees; the first is taken where all give as much.
const AZIMUTHS: u32 = 24;
const ELEVATIONS: [f32; 3] = [40.0, 28.0, 55.0];
/// Edge of the lamp of a closed room as a share of the room's height, and its distance from the ceiling.
const LAMP: (f32, f32) = (0.4, 0.03);

/// Light for a scene in which nothing emits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightGuess {
    /// Soft lamps around an object, on a ground that catches its shadow.
    Studio,
    /// Sky and sun through the openings of an interior; azimuth and elevation of the sun, degrees.
    Daylight([f32; 2]),
    /// A square lamp below the ceiling of a closed room.
    Lamp {
        /// Centre.
        position: Vec3,
        /// Unit vector in which it shines.
        direction: Vec3,
        /// Length of its edges, scene units.
        size: f32,
    },
}

impl LightGuess {
    /// For a camera at `position` that looks at `target`.
    pub(super) fn new(looker: &Looker, survey: &Survey, position: Vec3, target: Vec3) -> Self {
        if !survey.is_interior {
            return Self::Studio;
        }
        if survey.openness >= MIN_OPENNESS {
            return Self::Daylight(sun_through_openings(looker, &survey.horizon));
        }
        lamp(looker, &survey.horizon, position, target).unwrap_or(Self::Daylight([-45.0, ELEVATIONS[0]]))
    }
}

/// Azimuth and elevation of the sun from which light reaches the most points inside.
fn sun_through_openings(looker: &Looker, horizon: &Horizon) -> [f32; 2] {
    let points: Vec<Vec3> = points_inside(looker.scene.bounds()).collect();
    let mut best = ([-45.0, ELEVATIONS[0]], 0);
    for elevation in ELEVATIONS {
        for i in 0..AZIMUTHS {
            // A few degrees off the walls, which mostly stand along the axes
            let azimuth = -150.0 + 360.0 * (i as f32) / AZIMUTHS as f32 + 7.0;
            let direction = horizon.direction(azimuth, elevation);
            let lit = points.iter().filter(|&&p| looker.escapes(p, direction)).count();
            // A tenth more is needed to prefer another one, so that roundings do not decide.
            if lit * 10 > best.1 * 11 {
                best = ([azimuth, elevation], lit);
            }
        }
    }
    best.0
}

/// A lamp below the ceiling, between the camera and what it looks at; `None` where there is no ceiling.
fn lamp(looker: &Looker, horizon: &Horizon, position: Vec3, target: Vec3) -> Option<LightGuess> {
    let middle = position.midpoint(target);
    let above = looker.look(middle, horizon.up())?.distance;
    let below = looker.look(middle, -horizon.up()).map_or(above, |floor| floor.distance);
    let height = above + below;
    Some(LightGuess::Lamp {
        position: middle + (above - LAMP.1 * height) * horizon.up(),
        direction: -horizon.up(),
        size: LAMP.0 * height,
    })
}
