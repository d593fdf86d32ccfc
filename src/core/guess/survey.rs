//! Survey of a scene: whether it is an object, seen from outside, or an interior, seen from inside.

use super::look::{Looker, Tally};
use super::up::guess_up;
use crate::math::{Bounds3, Horizon, Vec2, Vec3};
use crate::sampling::warp::uniform_sphere;

/// Points inside of the scene's bounds, and rays from each.
const POINTS: u32 = 256;
const RAYS: u32 = 48;
/// Share of the rays from a point that must meet fronts for the point to be inside of a room.
const ENCLOSED: f32 = 0.62;
/// Share of the points that must be.
const MIN_ROOM: f32 = 0.2;
/// Share of the rays from outside that meet the backs of surfaces, from which on the scene was not made for being seen from there.
const BACKS: f32 = 0.25;

/// Properties of a scene on which guesses depend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// Up, and azimuths around it.
    pub horizon: Horizon,
    /// Whether the scene is an interior, modelled to be seen from inside.
    pub is_interior: bool,
    /// Share of the rays from points inside of a room that leave the scene: through windows, or where there is no wall or ceiling.
    pub openness: f32,
    /// Reflectance of what is seen from outside, on average; textured surfaces count as 0.5.
    pub reflectance: f32,
}

impl Survey {
    /// Surveys the scene; `up` is not guessed where it is given.
    pub(super) fn new(looker: &Looker, up: Option<Vec3>) -> Self {
        let horizon = |is_interior: bool| {
            let said = up.and_then(Vec3::try_normalize);
            Horizon::new(said.unwrap_or_else(|| guess_up(looker.scene, is_interior)))
        };
        let bounds = looker.scene.bounds();
        if bounds.is_empty() {
            return Self {
                horizon: horizon(false),
                is_interior: false,
                openness: 1.0,
                reflectance: 0.5,
            };
        }
        // From inside
        let (mut within, mut rooms, mut escaped) = (Tally::default(), 0, 0);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            let mut around = Tally::default();
            let seen: Vec<_> = directions(i).map(|direction| looker.look(p, direction)).collect();
            seen.iter().for_each(|seen| around.add(seen.as_ref()));
            if around.fronts as f32 >= ENCLOSED * around.rays as f32 {
                rooms += 1;
                escaped += directions(i).filter(|&direction| looker.escapes(p, direction)).count();
                seen.iter().for_each(|seen| within.add(seen.as_ref()));
            }
        }

        // From outside, at random points of it
        let (mut without, mut reflected) = (Tally::default(), 0.0);
        let reach = 2.0 * bounds.radius().max(f32::MIN_POSITIVE);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            for direction in directions(i) {
                let seen = looker.look(p - reach * direction, direction);
                without.add(seen.as_ref());
                reflected += seen.map_or(0.0, |seen| f64::from(looker.reflectance(&seen)));
            }
        }
        let is_room = rooms as f32 >= MIN_ROOM * POINTS as f32;
        let detail = |tally: &Tally| tally.entropies().iter().sum::<f32>();
        let is_made_for_inside = 1.0 - without.front_share() > BACKS || detail(&within) > detail(&without);
        let is_interior = is_room && is_made_for_inside;
        Self {
            horizon: horizon(is_interior),
            is_interior,
            reflectance: (reflected / f64::from(without.hits.max(1))) as f32,
            openness: escaped as f32 / within.rays.max(1) as f32,
        }
    }
}

/// Points all over the inside of `bounds`: those of Halton's sequence.
pub(super) fn points_inside(bounds: Bounds3) -> impl Iterator<Item = Vec3> {
    (0..POINTS).map(move |i| {
        let share = Vec3::from([radical_inverse(2, i), radical_inverse(3, i), radical_inverse(5, i)]);
        bounds.min + (bounds.max - bounds.min) * (0.04 + 0.92 * share)
    })
}

/// Directions all over the sphere, other ones for each `i`.
fn directions(i: u32) -> impl Iterator<Item = Vec3> {
    let shift = Vec2::new(radical_inverse(7, i), radical_inverse(11, i));
    (0..RAYS).map(move |k| {
        let even = Vec2::new((k as f32 + 0.5) / RAYS as f32, radical_inverse(2, k));
        uniform_sphere((even + shift) - (even + shift).floor())
    })
}

/// Van der Corput's radical inverse of `i + 1`, in [0, 1).
fn radical_inverse(base: u32, i: u32) -> f32 {
    let (mut rest, mut inverse, mut place) = (i + 1, 0.0, 1.0);
    while rest > 0 {
        place /= base as f32;
        inverse += place * (rest % base) as f32;
        rest /= base;
    }
    inverse
}
