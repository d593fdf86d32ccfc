use super::ColorValue;
use super::section::{Section, section, value};
use crate::math::Vec3;
use crate::options::Range as Numbers;
use crate::scene::{BuildError, GroundPlane};
use std::ops::Range;

section! {
    /// `[ground]`: a plane that catches shadows. An empty section adds the plane, too.
    #[derive(Default)]
    pub struct GroundSection {
        required {}
        /// Point of the ground
        ///
        /// An empty `[ground]` adds a ground too.
        point: [f32; 3], default "just below the scene's lowest point along up", in Numbers::FromTo(-1e10, 1e10);
        /// Upward direction
        up: [f32; 3], default "0 1 0";
        /// Side of the ground that shows shadows
        normal: [f32; 3], default "up";
        /// Radius, scene units
        radius: f32, default "50 times the radius of the scene", in Numbers::FromTo(1e-9, 1e10);
        /// Radius at which shadows end, scene units
        shadow_radius: f32, default "the radius, or the border of a bare OBJ's picture", in Numbers::FromTo(1e-9, 1e10);
        /// Albedo for all rays except camera rays
        albedo: ColorValue, default "0.5", in Numbers::FromTo(0.01, 1.0);
    }
}

impl GroundSection {
    /// Ground plane with defaults for missing keys.
    pub fn plane(&self) -> GroundPlane {
        let usual = GroundPlane::default();
        GroundPlane {
            point: value(&self.point).map(Vec3::from),
            normal: value(&self.normal).map(Vec3::from),
            up: value(&self.up).map_or(usual.up, Vec3::from),
            radius: value(&self.radius),
            shadow_radius: value(&self.shadow_radius),
            albedo: value(&self.albedo).map_or(usual.albedo, |albedo| albedo.0.into()),
        }
    }

    /// Span of the key that causes `error`, if the section has the key.
    pub(super) fn place_of(&self, error: &BuildError) -> Option<Range<usize>> {
        match error {
            BuildError::BadGround { key, .. } => self.span_of(key),
            _ => None,
        }
    }
}
