//! Light sections that the program makes: for flags, and for scenes without lights.

use super::{ColorValue, LightSection};
use crate::color::Spectrum;
use crate::light::sky::sun_color;
use crate::math::{Horizon, Vec3};
use crate::scene::RectangleParameters;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;

/// Angular diameter of the sun's disc in degrees.
const SUN_ANGLE: f32 = 0.53;
/// Azimuth and elevation of the key light relative to the camera, and angular diameter of its disc,
/// all in degrees.
const KEY_LIGHT: [f32; 3] = [-40.0, 40.0, 30.0];

/// Light sections. Errors about them point to the bytes `span` of a file
/// ([`super::SceneFile::flag_span`]). Angles are in degrees, in the frame of [`Horizon`]. If `up`
/// is `None`, it is +y.
impl LightSection {
    /// An environment with the same `radiance` in all directions.
    pub fn constant(span: Range<usize>, radiance: [f32; 3]) -> Self {
        Self {
            radiance: Some(Spanned::new(span.clone(), ColorValue(radiance))),
            ..Self::of_type("constant", span)
        }
    }

    /// An environment from a latitude-longitude picture.
    pub fn environment(span: Range<usize>, image: PathBuf) -> Self {
        Self {
            image: Some(Spanned::new(span.clone(), image)),
            ..Self::of_type("environment", span)
        }
    }

    /// A daylight sky. `sun` is the azimuth and elevation of its sun.
    pub fn sky(span: Range<usize>, sun: [f32; 2], up: Option<Vec3>) -> Self {
        Self {
            sun: Some(Spanned::new(span.clone(), sun)),
            up: up.map(|up| Spanned::new(span.clone(), up.to_array())),
            ..Self::of_type("sky", span)
        }
    }

    /// A studio whose front is at the azimuth `front`, where the camera stands.
    pub fn studio(span: Range<usize>, front: f32, up: Option<Vec3>) -> Self {
        Self {
            front: Some(Spanned::new(span.clone(), front)),
            up: up.map(|up| Spanned::new(span.clone(), up.to_array())),
            ..Self::of_type("studio", span)
        }
    }

    /// A sun at the azimuth and elevation `at`. `strength` is the luminance of the irradiance,
    /// W·m⁻², of a surface that faces the sun. The colour is the colour of sunlight through air of
    /// the turbidity `turbidity`.
    pub fn sun(span: Range<usize>, at: [f32; 2], strength: f32, turbidity: f32, up: Option<Vec3>) -> Self {
        let towards = horizon(up).direction(at[0], at[1]);
        Self::directional(span, -towards, sun_color(at[1], turbidity) * strength, SUN_ANGLE)
    }

    /// A soft light from the upper left of the camera, with the irradiance `irradiance` in W·m⁻².
    /// `back` is the direction from the target to the camera. If `back` is `None`, the camera is at
    /// azimuth 0.
    pub fn key_light(span: Range<usize>, back: Option<Vec3>, up: Option<Vec3>, irradiance: f32) -> Self {
        let towards = key_direction(back, up);
        Self::directional(span, -towards, Spectrum::splat(irradiance), KEY_LIGHT[2])
    }

    /// Light that travels in `direction`, from a disc of the angular diameter `angle`.
    pub fn directional(span: Range<usize>, direction: Vec3, irradiance: Spectrum, angle: f32) -> Self {
        Self {
            direction: Some(Spanned::new(span.clone(), direction.to_array())),
            irradiance: Some(Spanned::new(span.clone(), irradiance.into())),
            angle: Some(Spanned::new(span.clone(), angle)),
            ..Self::of_type("directional", span)
        }
    }

    /// A rectangle that emits on one side.
    pub fn rectangle(span: Range<usize>, rectangle: &RectangleParameters) -> Self {
        let vector = |v: Vec3| Some(Spanned::new(span.clone(), v.to_array()));
        Self {
            position: vector(rectangle.position),
            direction: vector(rectangle.direction),
            size: Some(Spanned::new(span.clone(), rectangle.size)),
            up: rectangle.up.and_then(vector),
            radiance: Some(Spanned::new(span.clone(), rectangle.radiance.into())),
            ..Self::of_type("rectangle", span)
        }
    }
}

/// Horizon with the upward direction `up`; +y if `up` is `None` or zero.
fn horizon(up: Option<Vec3>) -> Horizon {
    Horizon::new(up.and_then(Vec3::try_normalize).unwrap_or(Vec3::Y))
}

/// Unit vector towards the key light.
fn key_direction(back: Option<Vec3>, up: Option<Vec3>) -> Vec3 {
    let horizon = horizon(up);
    let [front, side, top] = [
        horizon.direction(0.0, 0.0),
        horizon.direction(90.0, 0.0),
        horizon.direction(0.0, 90.0),
    ];
    // Frame of the camera: backward, right and upward directions
    let back = back.and_then(Vec3::try_normalize).unwrap_or(front);
    let right = top.cross(back).try_normalize().unwrap_or(side);
    let above = back.cross(right);
    let [azimuth, elevation] = [KEY_LIGHT[0], KEY_LIGHT[1]].map(f32::to_radians);
    let across = azimuth.sin() * right + azimuth.cos() * back;
    (elevation.cos() * across + elevation.sin() * above).normalize_or(front)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For all directions of the camera, the key light is at the left, above and in front of the
    /// target.
    #[test]
    fn the_key_light_comes_from_the_upper_left() {
        let close = |a: Vec3, b: Vec3| assert!(a.distance(b) < 1e-6, "{a} {b}");
        let angle = 40f32.to_radians();
        let expected = Vec3::new(-angle.cos() * angle.sin(), angle.sin(), angle.cos() * angle.cos());
        close(key_direction(None, None), expected);
        close(key_direction(Some(5.0 * Vec3::Z), None), expected);
        let behind = Vec3::new(-expected.x, expected.y, -expected.z);
        close(key_direction(Some(Vec3::NEG_Z), None), behind);
        let z_up = Vec3::new(expected.x, -expected.z, expected.y);
        close(key_direction(Some(Vec3::NEG_Y), Some(Vec3::Z)), z_up);
        // Test a camera that views straight down, and invalid cameras
        for (back, up) in [(Vec3::Y, Vec3::Y), (Vec3::ZERO, Vec3::ZERO), (Vec3::NAN, Vec3::NAN)] {
            assert!(key_direction(Some(back), Some(up)).is_normalized());
        }
    }

    #[test]
    fn suns_shine_from_where_they_are() {
        let sun = LightSection::sun(0..0, [90.0, 30.0], 2.0, 3.0, Some(Vec3::Z));
        let direction = Vec3::from(*sun.direction.unwrap().get_ref());
        assert!(
            direction.distance(Vec3::new(-0.75f32.sqrt(), 0.0, -0.5)) < 1e-6,
            "{direction}"
        );
        let irradiance = Spectrum::from(*sun.irradiance.unwrap().get_ref());
        assert!((irradiance.luminance() - 2.0).abs() < 1e-5);
    }
}
