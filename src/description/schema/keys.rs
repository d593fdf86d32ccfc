//! Keys of `[camera]`: what each may hold, and what it means.

use crate::camera::BLADES;
use crate::description::key_schema::list;
use crate::guess::View;
use serde_json::{Value, json};

/// A key of a section.
#[derive(Clone, Copy)]
pub(super) struct Key {
    pub name: &'static str,
    help: &'static str,
    holds: fn() -> Value,
}

impl Key {
    /// Schema of the key's values, with its help.
    pub fn schema(&self) -> Value {
        let mut schema = (self.holds)();
        schema["description"] = json!(self.help);
        schema
    }
}

/// Keys with what they hold and their help.
macro_rules! keys {
    ($($(#[doc = $doc:literal])* $list:ident { $($name:literal: $holds:expr, $help:literal;)+ })+) => {
        $($(#[doc = $doc])* pub(super) const $list: &[Key] = &[$(Key { name: $name, help: $help, holds: || $holds }),+];)+
    };
}

fn from_to(min: f64, max: f64) -> Value {
    json!({ "type": "number", "minimum": min, "maximum": max })
}

fn at_least(min: f64) -> Value {
    json!({ "type": "number", "minimum": min })
}

fn above(min: f64) -> Value {
    json!({ "type": "number", "exclusiveMinimum": min })
}

fn number() -> Value {
    json!({ "type": "number" })
}

fn vector() -> Value {
    list(3, number())
}

fn views() -> Value {
    let views: Vec<&str> = View::NAMES.iter().map(|(name, _)| *name).collect();
    json!({ "enum": views })
}

/// Azimuth and elevation, and a distance.
fn orbit() -> Value {
    json!({
        "type": "array",
        "items": [number(), from_to(-90.0, 90.0), above(0.0)],
        "additionalItems": false,
        "minItems": 2,
    })
}

keys! {
    /// `[camera]`
    CAMERA {
        "view": views(), "Side from which the scene is seen";
        "orbit": orbit(), "Azimuth and elevation of the camera in degrees, and its distance; by default the scene fills the image";
        "position": vector(), "Centre of the lens, scene units";
        "look_at": vector(), "Point in the middle of the image";
        "up": vector(), "Direction that is up in the image; default 0 1 0, or guessed with the camera";
        "vertical_fov": json!({ "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 180 }), "Vertical field of view, degrees";
        "lens_radius": at_least(0.0), "Radius of the lens, scene units; 0 is a pinhole";
        "f_stop": above(0.0), "F-number of the lens, in place of lens_radius";
        "sensor_height": above(0.0), "Height of the sensor in scene units, for f_stop; default 0.024";
        "aperture_blades": json!({ "type": "integer", "minimum": BLADES[0], "maximum": BLADES[1] }), "Straight blades of the aperture; default a disk";
        "aperture_rotation": number(), "Angle of the first corner between the blades, degrees";
        "focus_distance": above(0.0), "Distance along the view axis to the plane in focus; default that of look_at";
        "focus_at": list(2, number()), "Point of the image, in pixels, that is in focus";
        "position_close": vector(), "Position at time 1, if the camera moves";
        "look_at_close": vector(), "Point in the middle of the image at time 1";
        "up_close": vector(), "Direction that is up in the image at time 1";
        "shutter": list(2, from_to(0.0, 1.0)), "Times at which the shutter opens and closes, 0 to 1";
    }
}
