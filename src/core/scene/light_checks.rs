//! Checks of lights. The error contains the key of the invalid value.

use super::validate::{BuildError, MAX_REACH};
use crate::color::Spectrum;
use crate::light::LatLongImage;
use crate::math::{Quat, Vec3, list};

/// Minimum angular diameter of a directional light's disc, in degrees.
const MIN_ANGLE: f32 = 0.01;

/// Error for an invalid value of the key `key` of a light. `light` is the type of the light.
pub(super) fn bad_light(light: &'static str, key: &'static str, value: String, rule: &'static str) -> BuildError {
    BuildError::BadLight {
        light,
        key,
        value,
        rule,
    }
}

/// Checks the position of a light.
pub(super) fn check_position(light: &'static str, position: Vec3) -> Result<(), BuildError> {
    if position.is_finite() && position.abs().max_element() <= MAX_REACH {
        return Ok(());
    }
    let value = list(&position.to_array());
    Err(bad_light(
        light,
        "position",
        value,
        "coordinates must be finite and at most 1e15",
    ))
}

/// Unit vector along the direction of a light of the type `light`.
pub(super) fn unit(light: &'static str, direction: Vec3) -> Result<Vec3, BuildError> {
    unit_of(light, "direction", direction)
}

/// Unit vector along `vector`, the value of `key` of a light.
pub(super) fn unit_of(light: &'static str, key: &'static str, vector: Vec3) -> Result<Vec3, BuildError> {
    let value = || list(&vector.to_array());
    let bad = || bad_light(light, key, value(), "must be finite and not zero");
    vector.try_normalize().ok_or_else(bad)
}

/// Checks that the number `value`, the value of `key` of a light, is finite.
pub(super) fn check_number(light: &'static str, key: &'static str, value: f32) -> Result<(), BuildError> {
    if value.is_finite() {
        Ok(())
    } else {
        Err(bad_light(light, key, value.to_string(), "must be finite"))
    }
}

/// Checks the angular diameter of a directional light's disc, in degrees. The minimum is 0.01
/// degrees: f32 directions are rounded to about 10⁻⁵ degrees, and the rounding would be visible in
/// the samples of a narrower disc.
pub(super) fn check_angle(angle: f32) -> Result<(), BuildError> {
    if angle == 0.0 || (MIN_ANGLE..=180.0).contains(&angle) {
        return Ok(());
    }
    let rule = "the diameter of its disc must be 0, or 0.01 to 180 degrees";
    Err(bad_light("directional", "angle", angle.to_string(), rule))
}

/// Checks the emission of a light.
pub(super) fn check_light(light: &'static str, key: &'static str, value: Spectrum) -> Result<(), BuildError> {
    if value.is_valid() {
        return Ok(());
    }
    let value = list(&value.to_array());
    let rule = "every channel must be a finite number, 0 or more";
    Err(bad_light(light, key, value, rule))
}

/// Checks the half-angles of a spot light's cone and of the start of its falloff, in degrees.
pub(super) fn check_spot(angle: f32, falloff: f32) -> Result<(), BuildError> {
    let bad = |key, value: f32, rule| Err(bad_light("spot", key, value.to_string(), rule));
    if !(angle > 0.0 && angle <= 90.0) {
        return bad("angle", angle, "must be above 0 and at most 90 degrees");
    }
    if !(falloff >= 0.0 && falloff <= angle) {
        return bad("falloff", falloff, "must lie between 0 and the angle");
    }
    Ok(())
}

/// Checks the image of an environment, its scale and its rotation.
pub(super) fn check_environment(
    light: &'static str,
    image: &LatLongImage,
    scale: f32,
    rotation: Quat,
) -> Result<(), BuildError> {
    let bad = |key, value, rule| Err(bad_light(light, key, value, rule));
    if !(scale.is_finite() && scale >= 0.0) {
        return bad("scale", scale.to_string(), "must be a finite number, 0 or more");
    }
    if !rotation.is_finite() {
        return bad("rotate", f32::NAN.to_string(), "must be finite");
    }
    let count = image.texels.len();
    if count == 0 || count != image.width * image.height {
        let rule = "must have a texel in each row and column";
        return bad("image", count.to_string(), rule);
    }
    if let Some(texel) = image.texels.iter().find(|t| !t.is_valid()) {
        let value = list(&texel.to_array());
        return bad("image", value, "every texel must be finite and 0 or more");
    }
    Ok(())
}
