//! Survey of a scene: whether it is an object, seen from outside, or an interior, seen from inside.

use super::look::{Looker, Tally};
use super::spread::{POINTS, directions, points_inside};
use super::up::{Sisters, UpScores};
use crate::math::{Bounds3, Horizon, Vec3};

/// Share of the rays from a point that must meet fronts for the point to be inside of a room.
const ENCLOSED: f32 = 0.62;
/// Share of the points that must be in an interior, and in one of which much more shows inside.
const MIN_ROOM: f32 = 0.2;
const MIN_DETAILED_ROOM: f32 = 0.12;
/// Share of the hits of rays from outside that meet fronts below which the scene is a hull that was
/// not made for being seen from there.
const HULL: f32 = 0.75;
/// Bits that more must show inside than outside: of a hull; of a hull of which little is room; and
/// of a body, which is closed on the outside. Hollow bricks and cupboards are bodies.
const MORE_INSIDE: [f32; 3] = [-0.3, 1.0, 2.5];

/// Properties of a scene on which guesses depend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// Up, and azimuths around it.
    pub horizon: Horizon,
    /// Whether the scene is an interior, modelled to be seen from inside.
    pub is_interior: bool,
    /// Share of the rays from points inside of a room that leave the scene: through windows, or where there is no wall or ceiling.
    pub openness: f32,
    /// Bounds of the part that guesses are for, if triangles far away are left out.
    pub part: Option<Bounds3>,
    /// Scores of the directions as upright axis, if that is guessed.
    pub up_scores: Option<UpScores>,
}

impl Survey {
    /// Surveys the scene; `up` is not guessed where it is given. `usual_up` is up in most files of
    /// the program that wrote the scene, if that is known.
    pub(super) fn new(looker: &Looker, up: Option<Vec3>, usual_up: Option<Vec3>) -> Self {
        let said_up = up.and_then(Vec3::try_normalize);
        let scores = |rooms: Option<&[Vec3]>| match said_up {
            Some(_) => None,
            None => Some(UpScores::new(looker, rooms, usual_up)),
        };
        let horizon = |scores: Option<UpScores>| {
            let best = scores.map(|scores| scores.best());
            Horizon::new(said_up.or(best).unwrap_or(Vec3::Y))
        };
        let bounds = looker.region.bounds;
        if bounds.is_empty() {
            return Self {
                horizon: horizon(None),
                is_interior: false,
                openness: 1.0,
                part: None,
                up_scores: None,
            };
        }
        // From inside
        let (mut within, mut rooms, mut escaped) = (Tally::default(), Vec::new(), 0);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            let mut around = Tally::default();
            let seen: Vec<_> = directions(i).map(|direction| looker.look(p, direction)).collect();
            seen.iter().for_each(|seen| around.add(seen.as_ref()));
            if around.fronts as f32 >= ENCLOSED * around.rays as f32 {
                rooms.push(p);
                escaped += directions(i).filter(|&direction| looker.escapes(p, direction)).count();
                seen.iter().for_each(|seen| within.add(seen.as_ref()));
            }
        }

        // From outside, at random points of it
        let mut without = Tally::default();
        let reach = 2.0 * bounds.radius().max(f32::MIN_POSITIVE);
        for (i, p) in (0..).zip(points_inside(bounds)) {
            for direction in directions(i) {
                without.add(looker.look(p - reach * direction, direction).as_ref());
            }
        }
        let share = rooms.len() as f32 / POINTS as f32;
        let detail = |tally: &Tally| tally.entropies().iter().sum::<f32>();
        let is_interior = is_made_for_inside(share, without.front_share(), detail(&within) - detail(&without));
        let up_scores = scores(is_interior.then_some(&rooms));
        Self {
            horizon: horizon(up_scores),
            up_scores,
            is_interior,
            openness: escaped as f32 / within.rays.max(1) as f32,
            part: (looker.region.left_out > 0).then_some(bounds),
        }
    }
}

impl Survey {
    /// Returns true if other files of the folder can change the upright axis of an object.
    pub(super) fn is_unsure_of_up(&self) -> bool {
        !self.is_interior && self.up_scores.is_some_and(|scores| scores.are_close())
    }

    /// The survey with the upright axis by `sisters` too, which interiors do without. Returns true
    /// beside it if they changed that axis.
    pub(super) fn with(self, sisters: &Sisters) -> (Self, bool) {
        let Some(scores) = self.up_scores.filter(|_| !self.is_interior) else {
            return (self, false);
        };
        let (alone, up) = (scores.best(), scores.with(sisters).best());
        let horizon = match up == alone {
            true => self.horizon,
            false => Horizon::new(up),
        };
        (Self { horizon, ..self }, up != alone)
    }
}

/// Returns true if a scene was made for being seen from inside: of its points this share lies in
/// rooms, of the hits from outside this share meets fronts, and inside these more bits show.
fn is_made_for_inside(rooms: f32, fronts: f32, more: f32) -> bool {
    let [hull, partly, body] = MORE_INSIDE;
    match fronts < HULL {
        true => rooms >= MIN_ROOM && more > hull || rooms >= MIN_DETAILED_ROOM && more > partly,
        false => rooms >= MIN_ROOM && more > body,
    }
}
