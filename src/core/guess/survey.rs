//! Survey of a scene: is it an object, seen from outside, or an interior, seen from inside?

use super::file_axes::FileAxes;
use super::floors::Floors;
use super::groups::groups;
use super::interior::{PlaceKind, is_corner_of_room};
use super::region::Region;
use super::rooms::Rooms;
use super::scene_tracer::SceneTracer;
use super::up::{SiblingFiles, UpScores};
use crate::math::{Bounds3, Horizon, Vec3};

/// Properties of a scene on which guesses depend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Survey {
    /// Up, and azimuths around it.
    pub horizon: Horizon,
    /// True if the scene is an interior, modelled to be seen from inside.
    pub is_interior: bool,
    /// Fraction of the rays from points inside of rooms that leave the scene, through windows or
    /// missing walls and ceilings.
    pub openness: f32,
    /// Bounds of the part that guesses use, if triangles far away are left out.
    pub part: Option<Bounds3>,
    /// Scores of the upright axes, if the axis is guessed.
    pub up_scores: Option<UpScores>,
}

impl Survey {
    /// Minimum fraction of the rays from inside that leave an interior, if the interior has
    /// daylight.
    const MIN_OPENNESS: f32 = 0.003;

    /// Returns true if too little daylight enters an interior.
    pub(super) fn is_closed(&self) -> bool {
        self.openness < Self::MIN_OPENNESS
    }

    /// Surveys the scene. Returns the survey, the region that guesses use, and the kind of places
    /// that count as inside. The region is the region of `tracer`, or the part of it that is an
    /// interior. If `up` is given, the upright axis is not guessed. `axes` are from comments of the
    /// file. If `needs_inside`, the camera is inside for any kind of scene.
    pub(super) fn new(
        tracer: &SceneTracer,
        up: Option<Vec3>,
        axes: &FileAxes,
        needs_inside: bool,
    ) -> (Self, Region, PlaceKind) {
        let said_up = up.and_then(Vec3::try_normalize);
        let scores = |tracer: &SceneTracer, rooms: Option<&[Vec3]>| match said_up {
            Some(_) => None,
            None => Some(UpScores::new(tracer, rooms, axes)),
        };
        let whole = tracer.region;
        let survey = |up_scores: Option<UpScores>, interior: Option<(f32, Region)>| {
            let best = up_scores.map(|scores| scores.best());
            let (openness, region) = interior.unwrap_or((1.0, whole));
            let survey = Self {
                horizon: Horizon::new(said_up.or(best).unwrap_or(Vec3::Y)),
                up_scores,
                is_interior: interior.is_some(),
                openness,
                part: (whole.left_out > 0).then_some(whole.bounds),
            };
            (survey, region)
        };
        let of_object = |up_scores| {
            let (survey, region) = survey(up_scores, None);
            (survey, region, PlaceKind::RoofedRooms)
        };
        if whole.bounds.is_empty() {
            return of_object(None);
        }
        let mut found = (*tracer, Rooms::of(tracer));
        if !found.1.are_interior(axes.thing) {
            for region in groups(tracer) {
                let group = SceneTracer { region, ..*tracer };
                let rooms = Rooms::of(&group);
                if rooms.are_interior(axes.thing) {
                    found = (group, rooms);
                    break;
                }
                if needs_inside && rooms.points.len() > found.1.points.len() {
                    found = (group, rooms);
                }
            }
        }
        let (place, rooms) = found;
        if rooms.are_interior(axes.thing) {
            let up_scores = scores(&place, Some(&rooms.points));
            let (survey, region) = survey(up_scores, Some((rooms.openness, place.region)));
            if Floors::new(&place, &survey.horizon).has_wide_floor() {
                if !needs_inside && is_corner_of_room(&place, &survey.horizon) {
                    return of_object(survey.up_scores);
                }
                return (survey, region, PlaceKind::Anywhere);
            }
        }
        let up_scores = scores(tracer, None);
        if !needs_inside {
            return of_object(up_scores);
        }
        let openness = if rooms.points.is_empty() { 1.0 } else { rooms.openness };
        let (survey, region) = survey(up_scores, Some((openness, place.region)));
        (survey, region, PlaceKind::RoofedRooms)
    }

    /// Returns true if other files of the folder can change the upright axis of an object.
    pub(super) fn is_unsure_of_up(&self) -> bool {
        !self.is_interior && self.up_scores.is_some_and(|scores| scores.are_close())
    }

    /// The survey with the evidence of `siblings` for the upright axis, which interiors ignore.
    /// Also returns true if the axis changed.
    pub(super) fn with(self, siblings: &SiblingFiles) -> (Self, bool) {
        let Some(scores) = self.up_scores.filter(|_| !self.is_interior) else {
            return (self, false);
        };
        let (alone, up) = (scores.best(), scores.with(siblings).best());
        let horizon = if up == alone { self.horizon } else { Horizon::new(up) };
        (Self { horizon, ..self }, up != alone)
    }
}
