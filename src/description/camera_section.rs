//! `[camera]`: its keys.

use super::exact_list::numbers;
use crate::guess::{Orbit, Stand, View};
use crate::math::excerpt;
use crate::options::{join_names, name_of};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};
use std::ops::Range;
use toml::Spanned;

/// `[camera]`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSection {
    /// Side from which the scene is seen.
    pub view: Option<Spanned<NamedView>>,
    /// Azimuth, elevation and distance of the camera, in place of a named view.
    pub orbit: Option<Spanned<OrbitAngles>>,
    /// Place on the floor on which the camera stands.
    pub stand: Option<Spanned<StandPlace>>,
    /// Azimuth towards which a standing camera looks, degrees.
    pub yaw: Option<Spanned<f32>>,
    /// Centre of the lens.
    #[serde(default, deserialize_with = "numbers")]
    pub position: Option<Spanned<[f32; 3]>>,
    /// The point in the middle of the image.
    #[serde(default, deserialize_with = "numbers")]
    pub look_at: Option<Spanned<[f32; 3]>>,
    /// Up in the image.
    #[serde(default, deserialize_with = "numbers")]
    pub up: Option<Spanned<[f32; 3]>>,
    /// Degrees.
    pub vertical_fov: Option<Spanned<f32>>,
    /// 0 for a pinhole.
    pub lens_radius: Option<Spanned<f32>>,
    /// F-number, in place of `lens_radius`.
    pub f_stop: Option<Spanned<f32>>,
    /// Height of the sensor, scene units, for `f_stop`.
    pub sensor_height: Option<Spanned<f32>>,
    /// Straight blades of the lens's opening.
    pub aperture_blades: Option<Spanned<u32>>,
    /// Degrees.
    pub aperture_rotation: Option<Spanned<f32>>,
    /// Along the view axis.
    pub focus_distance: Option<Spanned<f32>>,
    /// The point of the image, in pixels, that is in focus.
    #[serde(default, deserialize_with = "numbers")]
    pub focus_at: Option<Spanned<[f32; 2]>>,
    /// Centre of the lens at shutter close, if the camera moves.
    #[serde(default, deserialize_with = "numbers")]
    pub position_close: Option<Spanned<[f32; 3]>>,
    /// Point in the middle of the image at shutter close.
    #[serde(default, deserialize_with = "numbers")]
    pub look_at_close: Option<Spanned<[f32; 3]>>,
    /// Up in the image at shutter close.
    #[serde(default, deserialize_with = "numbers")]
    pub up_close: Option<Spanned<[f32; 3]>>,
    /// When the shutter opens and closes, from 0 to 1.
    #[serde(default, deserialize_with = "numbers")]
    pub shutter: Option<Spanned<[f32; 2]>>,
}

/// `view = "NAME"`
#[derive(Clone, Copy, Debug)]
pub struct NamedView(pub View);

impl<'de> Deserialize<'de> for NamedView {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let found = View::NAMES.iter().find(|(known, _)| *known == name);
        let names = || join_names(View::NAMES);
        found
            .map(|(_, view)| Self(*view))
            .ok_or_else(|| Error::custom(format!("unknown view `{}`; choose from {}", excerpt(&name), names())))
    }
}

impl Serialize for NamedView {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(name_of(View::NAMES, self.0))
    }
}

/// `orbit = [AZIMUTH, ELEVATION]` or `[AZIMUTH, ELEVATION, DISTANCE]`
#[derive(Clone, Copy, Debug)]
pub struct OrbitAngles(pub Orbit);

impl<'de> Deserialize<'de> for OrbitAngles {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f32>::deserialize(deserializer)?;
        Orbit::of(&numbers)
            .map(Self)
            .map_err(|help| Error::custom(format!("orbit: {help}")))
    }
}

impl Serialize for OrbitAngles {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Orbit {
            azimuth,
            elevation,
            distance,
        } = self.0;
        let angles = [Some(azimuth), Some(elevation), distance];
        serializer.collect_seq(angles.into_iter().flatten())
    }
}

/// `stand = [X, Z]` or `[X, Z, HEIGHT]`
#[derive(Clone, Copy, Debug)]
pub struct StandPlace(pub Stand);

impl<'de> Deserialize<'de> for StandPlace {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        Stand::of(&numbers)
            .map(Self)
            .map_err(|help| Error::custom(format!("stand: {help}")))
    }
}

impl Serialize for StandPlace {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Stand { place: [x, z], height } = self.0;
        let numbers = [Some(x), Some(z), height.map(f64::from)];
        serializer.collect_seq(numbers.into_iter().flatten())
    }
}

impl CameraSection {
    /// Where two keys say the same thing: the bytes of the one that is too much, what is wrong, and how to put it right.
    pub(super) fn contradiction(&self) -> Option<(Range<usize>, &'static str, &'static str)> {
        if let (Some(_), Some(f_stop)) = (&self.lens_radius, &self.f_stop) {
            return Some((f_stop.span(), "both `lens_radius` and `f_stop`", "keep one of them"));
        }
        let places = [
            ("view", self.view.as_ref().map(Spanned::span)),
            ("orbit", self.orbit.as_ref().map(Spanned::span)),
            ("stand", self.stand.as_ref().map(Spanned::span)),
        ];
        let mut places = places.into_iter().filter_map(|(key, span)| Some((key, span?)));
        let first = places.next();
        let message = match (&first, places.next()) {
            (Some(_), _) if self.position.is_some() => {
                "a camera with a `position` has no `view`, no `orbit` and no `stand`"
            }
            (Some(("view", _)), Some(("orbit", _))) => "both `view` and `orbit`",
            (Some(("view", _)), Some(_)) => "both `view` and `stand`",
            (Some(_), Some(_)) => "both `orbit` and `stand`",
            _ => {
                let yaw = self.yaw.as_ref()?;
                let message = match (&self.stand, &self.look_at) {
                    (None, _) => "`yaw` needs `stand`",
                    (Some(_), Some(_)) => "both `yaw` and `look_at`",
                    _ => return None,
                };
                let help = if self.stand.is_some() {
                    "keep one of them"
                } else {
                    "add stand = [X, Z]"
                };
                return Some((yaw.span(), message, help));
            }
        };
        Some((first?.1, message, "keep one of them"))
    }
}
