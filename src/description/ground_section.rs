use super::ColorValue;
use super::exact_list::numbers;
use crate::math::Vec3;
use crate::scene::{BuildError, GroundPlane};
use serde::{Deserialize, Serialize};
use std::ops::Range;
use toml::Spanned;

/// `[ground]`: a plane that catches shadows; it is there where the section is, also without any key.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct GroundSection {
    /// A point of the plane; just below the scene's lowest point along `up` if this is left out.
    #[serde(default, deserialize_with = "numbers")]
    pub point: Option<Spanned<[f32; 3]>>,
    /// The side of the plane that catches shadows; `up` if this is left out.
    #[serde(default, deserialize_with = "numbers")]
    pub normal: Option<Spanned<[f32; 3]>>,
    /// Direction against which things fall; +y if this is left out.
    #[serde(default, deserialize_with = "numbers")]
    pub up: Option<Spanned<[f32; 3]>>,
    /// Radius around the point, scene units; 50 times that of the scene if this is left out.
    pub radius: Option<Spanned<f32>>,
    /// Albedo for all rays but those of the camera.
    pub albedo: Option<Spanned<ColorValue>>,
}

impl GroundSection {
    /// The plane, with defaults for what the section does not say.
    pub fn plane(&self) -> GroundPlane {
        let vector = |key: &Option<Spanned<[f32; 3]>>| key.as_ref().map(|v| Vec3::from(*v.get_ref()));
        let usual = GroundPlane::default();
        GroundPlane {
            point: vector(&self.point),
            normal: vector(&self.normal),
            up: vector(&self.up).unwrap_or(usual.up),
            radius: self.radius.as_ref().map(|r| *r.get_ref()),
            albedo: self
                .albedo
                .as_ref()
                .map_or(usual.albedo, |albedo| albedo.get_ref().0.into()),
        }
    }

    /// The place of the key that an error is about, if the section has it.
    pub(super) fn span_of(&self, error: &BuildError) -> Option<Range<usize>> {
        let BuildError::BadGround { key, .. } = error else {
            return None;
        };
        match *key {
            "point" => self.point.as_ref().map(Spanned::span),
            "normal" => self.normal.as_ref().map(Spanned::span),
            "up" => self.up.as_ref().map(Spanned::span),
            "radius" => self.radius.as_ref().map(Spanned::span),
            "albedo" => self.albedo.as_ref().map(Spanned::span),
            _ => None,
        }
    }
}
