//! The unit of length of a file, for human measures: the height of eyes, and the distance of a near
//! wall.

use crate::accel::Accel;
use crate::math::{Ray, Vec3};

/// Distance below which a surface is too near for a camera, in metres.
const NEAR: f32 = 0.05;
/// Height of the eyes of a standing person, in metres.
const EYES: f32 = 1.6;
/// Usual height of a room, in metres.
const ROOM: f32 = 2.7;
/// Height of the eyes as a fraction of the room's height, if no unit fits.
const SHARE: f32 = 0.6;
/// Minimum and maximum height of a room for a plausible unit, in metres.
const BELIEVED: [f32; 2] = [1.2, 40.0];
/// Units that are guessed from the heights of rooms, with their length in metres.
const UNITS: [(f32, &str); 4] = [
    (1.0, "metre"),
    (0.0254, "inch"),
    (0.01, "centimetre"),
    (0.001, "millimetre"),
];
/// Additional unit that files may name. It is not guessed.
const FOOT: (f32, &str) = (0.3048, "foot");

/// 5 cm in the file's units, for a camera at `position` with the up direction `up`. The unit is
/// read from the file or guessed from the height of the room. `None` in the open if the file has no
/// unit: the scale is unknown.
pub fn near_distance(accel: &dyn Accel, position: Vec3, up: Vec3, unit: Option<f32>) -> Option<f32> {
    let up = up.try_normalize()?;
    let distance = |way: Vec3| accel.intersect(&Ray::new(position, way)).map(|hit| hit.t);
    let room = distance(up).zip(distance(-up)).map(|(above, below)| above + below);
    let height = room.or(unit.map(|_| 0.0))?;
    Some(Scale::new(unit, room, height).length(NEAR))
}

/// Length of a metre in the units of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Height of the eyes of a standing person, in the file's units.
    pub eyes: f32,
    /// Name of the unit and the reason for it.
    unit: Option<(&'static str, &'static str)>,
    /// What the height of the eyes is a share of, if the unit is unknown: the room or the scene.
    whole: &'static str,
}

impl Scale {
    /// The scale of a file: from the length of its unit in metres (`named`), or from the height of
    /// its rooms (`room`). A scene without rooms is in metres, unless its `height` is below the
    /// height of eyes.
    pub fn new(named: Option<f32>, room: Option<f32>, height: f32) -> Self {
        let of = |(metres, name): (f32, &'static str), why| Self {
            eyes: EYES / metres,
            unit: Some((name, why)),
            whole: "",
        };
        let unknown = |height: f32, whole| Self {
            eyes: SHARE * height,
            unit: None,
            whole,
        };
        if let Some(metres) = named {
            let is_named = |unit: &&(f32, &str)| (unit.0 / metres - 1.0).abs() < 0.01;
            if let Some(&unit) = UNITS.iter().chain([&FOOT]).find(is_named) {
                return of(unit, "as the file or --unit names it");
            }
        }
        match room {
            Some(room) => {
                let off = |unit: &(f32, &str)| (unit.0 * room / ROOM).ln().abs();
                let nearest = UNITS.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
                let is_believed = |unit: &(f32, &str)| (BELIEVED[0]..BELIEVED[1]).contains(&(unit.0 * room));
                nearest.filter(is_believed).map_or(unknown(room, "room"), |unit| {
                    of(unit, "as the height of the rooms shows")
                })
            }
            None if height > EYES => of(UNITS[0], "the usual unit"),
            None => unknown(height, "scene"),
        }
    }

    /// Length of `metres` in the file's units. If the unit is unknown, the length is proportional
    /// to the eye height.
    pub fn length(&self, metres: f32) -> f32 {
        metres * self.eyes / EYES
    }

    /// Description of the eye height for users.
    pub fn words(&self) -> String {
        match self.unit {
            Some((name, why)) => format!("{EYES} m; the unit is the {name}, {why}"),
            None => format!("0.6 of the height of the {}, since no unit is known", self.whole),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_named_or_follow_from_the_height_of_rooms() {
        for (named, room, height, eyes) in [
            (None, Some(2.7), 3.0, 1.6),
            (None, Some(12.0), 12.0, 1.6),
            (None, Some(270.0), 300.0, 160.0),
            (None, Some(2500.0), 2600.0, 1600.0),
            (None, Some(100.0), 100.0, 1.6 / 0.0254),
            (Some(0.0254), Some(2.7), 3.0, 1.6 / 0.0254),
            (Some(0.3048), None, 9.0, 1.6 / 0.3048),
            (None, Some(0.5), 1.0, 0.3),
            (None, None, 40.0, 1.6),
            (None, None, 1.0, 0.6),
        ] {
            let scale = Scale::new(named, room, height);
            assert!(
                (scale.eyes / eyes - 1.0).abs() < 1e-5,
                "{named:?} {room:?} {height}: {scale:?}"
            );
        }
    }
}
