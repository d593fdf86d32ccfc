//! `[camera]`: its keys.

use super::exact_list::numbers;
use crate::guess::{Orbit, View};
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

impl CameraSection {
    /// Where two keys say the same thing: the bytes of the one that is too much, what is wrong, and how to put it right.
    pub(super) fn contradiction(&self) -> Option<(Range<usize>, &'static str, &'static str)> {
        if let (Some(_), Some(f_stop)) = (&self.lens_radius, &self.f_stop) {
            return Some((f_stop.span(), "both `lens_radius` and `f_stop`", "keep one of them"));
        }
        let place = self
            .view
            .as_ref()
            .map(Spanned::span)
            .or_else(|| Some(self.orbit.as_ref()?.span()))?;
        let message = if self.position.is_some() {
            "a camera with a `position` has no `view` and no `orbit`"
        } else if self.view.is_some() && self.orbit.is_some() {
            "both `view` and `orbit`"
        } else {
            return None;
        };
        Some((place, message, "keep one of them"))
    }
}
