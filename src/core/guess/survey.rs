//! Survey of a scene: whether it is an object, seen from outside, or an interior, seen from inside.

use super::floors::Floors;
use super::groups::groups;
use super::interior::Inside;
use super::look::Looker;
use super::region::Region;
use super::rooms::Rooms;
use super::up::guess_up;
use crate::math::{Bounds3, Horizon, Vec3};

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
}

impl Survey {
    /// Share of the rays from inside that must leave an interior for daylight to come in.
    const MIN_OPENNESS: f32 = 0.003;

    /// Returns true if too little daylight comes into an interior.
    pub(super) fn is_closed(&self) -> bool {
        self.openness < Self::MIN_OPENNESS
    }

    /// Surveys the scene, and finds the region that guesses are for: that of the looker, or the part
    /// of it that is an interior, and the places that are inside. `up` is not guessed where it is
    /// given. `usual_up` is up in most files of the program that wrote the scene, if that is known.
    /// If `wants_inside`, the camera is inside whatever the scene is.
    pub(super) fn new(
        looker: &Looker,
        up: Option<Vec3>,
        usual_up: Option<Vec3>,
        wants_inside: bool,
    ) -> (Self, Region, Inside) {
        let horizon = |looker: &Looker, rooms: Option<&[Vec3]>| {
            let said = up.and_then(Vec3::try_normalize);
            Horizon::new(said.unwrap_or_else(|| guess_up(looker, rooms, usual_up)))
        };
        let whole = looker.region;
        let survey = |horizon, interior: Option<(f32, Region)>| {
            let (openness, region) = interior.unwrap_or((1.0, whole));
            let survey = Self {
                horizon,
                is_interior: interior.is_some(),
                openness,
                part: (whole.left_out > 0).then_some(whole.bounds),
            };
            (survey, region)
        };
        let of_object = |horizon| {
            let (survey, region) = survey(horizon, None);
            (survey, region, Inside::RoofedRooms)
        };
        if whole.bounds.is_empty() {
            return of_object(horizon(looker, None));
        }
        let mut found = (*looker, Rooms::of(looker));
        if !found.1.are_interior() {
            for region in groups(looker) {
                let group = Looker { region, ..*looker };
                let rooms = Rooms::of(&group);
                if rooms.are_interior() {
                    found = (group, rooms);
                    break;
                }
                if wants_inside && rooms.points.len() > found.1.points.len() {
                    found = (group, rooms);
                }
            }
        }
        let (place, rooms) = found;
        if rooms.are_interior() {
            let upright = horizon(&place, Some(&rooms.points));
            if Floors::new(&place, &upright).has_wide_floor() {
                let (survey, region) = survey(upright, Some((rooms.openness, place.region)));
                return (survey, region, Inside::Anywhere);
            }
        }
        let upright = horizon(looker, None);
        if !wants_inside {
            return of_object(upright);
        }
        let openness = if rooms.points.is_empty() { 1.0 } else { rooms.openness };
        let (survey, region) = survey(upright, Some((openness, place.region)));
        (survey, region, Inside::RoofedRooms)
    }
}
