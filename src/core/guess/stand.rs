//! Position of a camera that stands at a given place on the floor.

use super::floors::{Floors, Surface};
use super::rooms::Surroundings;
use super::scale::Scale;
use crate::math::{DVec3, Vec3, encode_fields};

/// Maximum height of a step of the floor, in metres; higher surfaces are furniture.
const STEP: f32 = 0.4;
/// Minimum distance from the eyes to surfaces above and below, in metres.
const FREE: [f32; 2] = [0.05, 0.3];
/// Half the width of a floor to stand on, and the maximum difference of its heights, in metres.
const FEET: (f32, f32) = (0.3, 0.25);
/// Factor by which the distance to a storey above is multiplied when the nearest floor is chosen.
const UPSTAIRS: f32 = 3.0;

/// A place on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// The two horizontal coordinates of the file, in the order of its axes.
    pub place: [f64; 2],
    /// Height of the eyes above the floor, in the file's units; `None` for the height of a person.
    pub height: Option<f32>,
}

encode_fields!(Stand { place, height });

impl Stand {
    /// A place from two coordinates and an optional height of the eyes. The error is the expected
    /// format.
    pub fn of(numbers: &[f64]) -> Result<Self, &'static str> {
        let (place, height) = match *numbers {
            [x, z] => ([x, z], None),
            [x, z, height] => ([x, z], Some(height as f32)),
            _ => {
                return Err(
                    "the two horizontal coordinates of the file are expected, with an optional height of the eyes above 0, as in 2,-3 or 2,-3,1.7",
                );
            }
        };
        if !place.iter().all(|x| x.is_finite()) {
            return Err("both coordinates must be finite");
        }
        if height.is_some_and(|height| !(height > 0.0 && height.is_finite())) {
            return Err("the height of the eyes must be above 0");
        }
        Ok(Self { place, height })
    }

    /// The place as users type it, without the height.
    pub fn place_text(&self) -> String {
        self.place.map(|x| x.to_string()).join(",")
    }

    /// The place in the frame of the horizon. `origin` is the point of the file that is the scene's
    /// origin.
    pub(super) fn coordinates(&self, floors: &Floors, origin: DVec3) -> Vec3 {
        let axis = floors.horizon.up().abs().max_position();
        let mut p = Vec3::ZERO;
        let across = (0..3).filter(|&other| other != axis);
        for (other, x) in across.zip(self.place) {
            p[other] = (x - origin[other]) as f32;
        }
        floors.horizon.coordinates(p)
    }
}

/// Height of the floor at `place`, in the frame of the horizon. `None` if there is no floor with
/// free space for eyes at `height` above it. `usual` is the floor height of a guessed camera in a
/// room. The result is the highest floor that is not much above `usual`, or else the nearest floor.
/// A floor above `usual` without a ceiling is a roof.
pub(super) fn floor(floors: &Floors, scale: &Scale, place: Vec3, height: f32, usual: Option<f32>) -> Option<f32> {
    let surfaces = floors.at(place.x, place.z);
    // A ceiling shows its back from above. The lowest surface is not a ceiling: the bottom of
    // furniture may lie in the floor.
    let has_fronts = surfaces.iter().any(|surface| surface.is_flat() && surface.is_front);
    let lowest = surfaces.last().map_or(0.0, |surface| surface.y);
    let is_floor = |surface: &&Surface| surface.is_flat() && (surface.is_front || !has_fronts || surface.y <= lowest);
    let flat = || surfaces.iter().filter(is_floor);
    let has_room = |surface: &&Surface| has_free_eyes(floors, scale, place, (surface.y, height));
    let is_outside = |surface: &&Surface| !is_in_body(floors, place, surface.y + height);
    let mut levels: Vec<&Surface> = flat().filter(has_room).filter(is_outside).collect();
    if levels.is_empty() {
        // If all places are inside bodies, use them: walls may be inside out.
        levels = flat().filter(has_room).collect();
    }
    if levels.iter().any(|surface| is_wide(floors, scale, place, surface.y)) {
        levels.retain(|surface| is_wide(floors, scale, place, surface.y));
    }
    let step = scale.length(STEP);
    if let Some(usual) = usual {
        levels.retain(|surface| surface.y <= usual + step || has_ceiling(floors, place, surface.y + height));
    }
    let usual = usual.or_else(|| Some(levels.last()?.y))?;
    let off = |y: f32| match y - usual {
        above if above > step => UPSTAIRS * above,
        // Within the height of a step, the higher floor is better.
        near if near >= -step => -near,
        below => -below,
    };
    let nearest = levels.into_iter().min_by(|a, b| off(a.y).total_cmp(&off(b.y)))?;
    Some(nearest.y)
}

/// Returns true if no surface is near above and below the eyes, `height` above `y`.
fn has_free_eyes(floors: &Floors, scale: &Scale, place: Vec3, (y, height): (f32, f32)) -> bool {
    let up = floors.horizon.up();
    let eye = floors.horizon.point(Vec3::new(place.x, y + height, place.z));
    let is_free = |way: Vec3, distance: f32| {
        let seen = floors.tracer.trace(eye, way);
        seen.is_none_or(|seen| seen.distance >= distance)
    };
    is_free(up, scale.length(FREE[0])) && is_free(-up, scale.length(FREE[1]).min(0.5 * height))
}

/// Returns true if there is a surface above eyes at the height `y`.
fn has_ceiling(floors: &Floors, place: Vec3, y: f32) -> bool {
    let eye = floors.horizon.point(Vec3::new(place.x, y, place.z));
    floors.tracer.trace(eye, floors.horizon.up()).is_some()
}

/// Returns true if most surfaces around the eyes show their backs.
fn is_in_body(floors: &Floors, place: Vec3, y: f32) -> bool {
    let eye = floors.horizon.point(Vec3::new(place.x, y, place.z));
    let around = Surroundings::of(floors.tracer, eye, floors.horizon.up(), 0);
    around.backs > 0.5 && around.fronts < 0.1
}

/// Returns true if the floor at the height `y` is wide enough for feet, or is a stair.
fn is_wide(floors: &Floors, scale: &Scale, place: Vec3, y: f32) -> bool {
    let (half, even) = (scale.length(FEET.0), scale.length(FEET.1));
    let knee = Vec3::new(place.x, y + 1.5 * even, place.z);
    let sides = [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z];
    let holds = |side: &&Vec3| {
        let below = floors.below(knee + half * **side);
        below.is_some_and(|below| (below - y).abs() <= even)
    };
    sides.iter().filter(holds).count() >= 2
}
