//! Keys of the sections that set no parameters of `options`: what each may hold, and what it means.

use crate::camera::BLADES;
use crate::description::PRESETS;
use crate::guess::View;
use crate::texture::Channel;
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

/// Whether materials have a key of this name.
pub(in crate::description) fn is_of_material(name: &str) -> bool {
    MATERIAL.iter().any(|key| key.name == name)
}

/// A type of lights.
pub(super) struct LightType {
    pub name: &'static str,
    pub required: &'static [&'static str],
    pub optional: &'static [&'static str],
    /// Keys of which it has exactly one.
    pub one_of: &'static [&'static str],
    /// Keys that mean something else than for other types.
    pub keys: &'static [Key],
}

/// Where the schema defines the texts of colours.
pub(super) const COLOR_TEXT: &str = "#/definitions/colour";

pub(super) fn number() -> Value {
    json!({ "type": "number" })
}

fn string() -> Value {
    json!({ "type": "string" })
}

fn boolean() -> Value {
    json!({ "type": "boolean" })
}

fn from_to(min: f64, max: f64) -> Value {
    json!({ "type": "number", "minimum": min, "maximum": max })
}

fn above_to(min: f64, max: f64) -> Value {
    json!({ "type": "number", "exclusiveMinimum": min, "maximum": max })
}

fn at_least(min: f64) -> Value {
    json!({ "type": "number", "minimum": min })
}

fn above(min: f64) -> Value {
    json!({ "type": "number", "exclusiveMinimum": min })
}

/// So many of `items`.
fn list(count: usize, items: Value) -> Value {
    json!({ "type": "array", "items": items, "minItems": count, "maxItems": count })
}

fn vector() -> Value {
    list(3, number())
}

fn either(choices: &[Value]) -> Value {
    json!({ "anyOf": choices })
}

/// A colour: a number or three, each as `channel` says, or a text of [`COLOR_TEXT`].
fn color(channel: Value) -> Value {
    either(&[channel.clone(), list(3, channel), json!({ "$ref": COLOR_TEXT })])
}

/// A number or three, each as `channel` says.
fn channels(channel: Value) -> Value {
    either(&[channel.clone(), list(3, channel)])
}

fn matrix() -> Value {
    list(4, list(4, number()))
}

fn names(names: &[&str]) -> Value {
    json!({ "enum": names })
}

/// The placement of an object by its parts.
fn transform() -> Value {
    json!({
        "type": "object",
        "additionalProperties": false,
        "properties": {
            "translate": { "type": "array", "items": number(), "minItems": 3, "maxItems": 3, "description": "Translation in scene units; applied last" },
            "rotate": { "type": "array", "items": number(), "minItems": 3, "maxItems": 3, "description": "Rotation in degrees about the fixed x, y and z axes, in that order" },
            "scale": { "anyOf": [number(), vector()], "description": "Scale: one factor, or one for each axis; applied first" },
        },
    })
}

/// A texture of a material.
fn texture() -> Value {
    let wraps = crate::description::map_section::wrap_names();
    let channels: Vec<&str> = Channel::NAMES.iter().map(|(name, _)| *name).collect();
    let pair = list(2, number());
    let mut properties = json!({
        "file": { "type": "string", "description": "Picture, relative to the scene file" },
        "scale": pair,
        "offset": pair,
        "wrap": { "enum": wraps, "default": "repeat", "description": "Continuation beside the picture" },
        "channel": { "enum": channels, "description": "Channel that a map of numbers takes" },
        "base": { "type": "number", "default": 0, "description": "Values become base + gain × value" },
        "gain": { "type": "number", "default": 1, "description": "Values become base + gain × value" },
        "height": { "type": "number", "default": 1, "description": "Factor of heights, and of the slopes of a normal map" },
    });
    properties["scale"]["description"] = json!("Repetitions of the picture in a unit of u and v");
    properties["offset"]["description"] = json!("Position of the surface's (0, 0) in the picture");
    either(&[
        string(),
        json!({ "enum": [false] }),
        json!({ "type": "object", "additionalProperties": false, "required": ["file"], "properties": properties }),
    ])
}

fn views() -> Value {
    let views: Vec<&str> = View::NAMES.iter().map(|(name, _)| *name).collect();
    names(&views)
}

fn azimuth_and_elevation() -> Value {
    json!({ "type": "array", "items": [number(), from_to(-90.0, 90.0)], "additionalItems": false, "minItems": 2 })
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

/// Two coordinates, and the height of the eyes.
fn stand() -> Value {
    json!({
        "type": "array",
        "items": [number(), number(), above(0.0)],
        "additionalItems": false,
        "minItems": 2,
    })
}

keys! {
    /// `[camera]`
    CAMERA {
        "view": views(), "Side from which the scene is seen";
        "orbit": orbit(), "Azimuth and elevation of the camera in degrees, and its distance; by default the scene fills the image";
        "stand": stand(), "Place on the floor on which the camera stands, by the two horizontal coordinates of the OBJ file, and the height of the eyes; default 1.6 m";
        "yaw": number(), "Azimuth towards which a standing camera looks, degrees; default the way that shows most";
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
    /// `[[object]]`
    OBJECT {
        "obj": string(), "OBJ file, relative to the scene file";
        "name": string(), "Name in mattes; default the OBJ's stem";
        "transform": transform(), "Placement: scale, then rotate, then translate";
        "matrix": matrix(), "Placement as four rows of four for column vectors, the last 0 0 0 1";
        "transform_close": transform(), "Placement at time 1, if the object moves";
        "matrix_close": matrix(), "Placement at time 1 as four rows of four";
        "obj_close": string(), "OBJ file with the same faces and the vertices at time 1";
        "instances": either(&[string(), json!({ "type": "array", "items": matrix() })]), "Placements of copies: a list of matrices, or a file with one per line";
    }
    /// `[material.NAME]` and `[patch.GLOB]`
    MATERIAL {
        "patch": boolean(), "true: changes the material of that name instead of replacing it";
        "preset": names(&PRESETS.iter().map(|preset| preset.name).collect::<Vec<_>>()), "Material that the other keys change";
        "diffuse": color(at_least(0.0)), "Diffuse reflectance; the base colour with metallic";
        "specular": color(at_least(0.0)), "Factor of the glossy or mirror reflection";
        "model": names(&["phong", "blinn", "ggx", "mirror"]), "Model of that reflection; default phong, or ggx with roughness or metallic";
        "exponent": at_least(0.0), "Exponent of phong and blinn; default 10";
        "roughness": from_to(0.0, 1.0), "Roughness of ggx and of a transmission that is not thin: the root of the facets' alpha";
        "metallic": from_to(0.0, 1.0), "Share of metal";
        "anisotropy": from_to(0.0, 1.0), "Elongation of highlights";
        "anisotropy_rotation": number(), "Degrees about the normal from the direction of increasing u to that of the longest highlight";
        "clearcoat": from_to(0.0, 1.0), "Factor of the reflection of a coat with index 1.5 over all other lobes";
        "clearcoat_roughness": from_to(0.0, 1.0), "Roughness of the coat";
        "sheen": color(from_to(0.0, 1.0)), "Factor of the light scattered by fibres";
        "eta": channels(above(0.0)), "Index of refraction of a metal by channel; with k";
        "k": channels(at_least(0.0)), "Extinction coefficient of a metal by channel; with eta";
        "transmission": color(at_least(0.0)), "Factor of the transmitted light";
        "ior": above(0.0), "Index of refraction behind the surface; default 1.5";
        "abbe": at_least(5.0), "Abbe number of smooth glass, whose ior is that at 587.56 nm; default no dispersion";
        "absorption": channels(at_least(0.0)), "Absorption coefficient inside a body, per scene unit; default 0";
        "absorption_depth": above(0.0), "Distance through a body, in scene units, after which transmission is the remaining light";
        "thin": boolean(), "true: thin dielectric, which light passes without a change of direction";
        "emission": color(at_least(0.0)), "Radiance of the front, W·sr⁻¹·m⁻²";
        "opacity": from_to(0.0, 1.0), "Opacity; default 1";
        "diffuse_map": texture(), "Texture that multiplies diffuse";
        "specular_map": texture(), "Texture that multiplies specular";
        "emission_map": texture(), "Texture that multiplies emission";
        "exponent_map": texture(), "Texture that multiplies exponent";
        "roughness_map": texture(), "Texture that multiplies roughness";
        "metallic_map": texture(), "Texture that multiplies metallic";
        "opacity_map": texture(), "Texture that multiplies opacity";
        "bump_map": texture(), "Texture of heights";
        "normal_map": texture(), "Texture of normals in the frame of the texture coordinates";
    }
    /// `[ground]`
    GROUND {
        "point": list(3, from_to(-1e10, 1e10)), "Point of the ground; default just below the scene's lowest point along up";
        "normal": vector(), "Side of the ground that shows shadows; default up";
        "up": vector(), "Upward direction; default 0 1 0";
        "radius": from_to(1e-9, 1e10), "Radius, scene units; default 50 times that of the scene";
        "albedo": color(from_to(0.01, 1.0)), "Albedo for all rays except camera rays; default 0.5";
    }
    /// `[[light_group]]`
    LIGHT_GROUP {
        "name": group(), "Name of the group";
        "materials": json!({ "type": "array", "items": string(), "minItems": 1 }), "Names of materials that emit";
    }
    /// `[[light]]`, of any type
    LIGHT {
        "type": string(), "Type of the light";
        "group": group(), "Name of the light group";
        "position": list(3, from_to(-1e15, 1e15)), "Position of a point or spot light; middle of a sphere, a disk or a rectangle";
        "intensity": color(at_least(0.0)), "Intensity of a point or spot light, W/sr";
        "direction": vector(), "Direction in which a directional or spot light travels; normal of the side of a disk or a rectangle that emits";
        "look_at": vector(), "Point that a spot light shines at";
        "angle": number(), "Half-angle of a spot light's cone, or diameter of a directional light's disc, degrees";
        "falloff": at_least(0.0), "Half-angle from which a spot light falls off, degrees; default 0.8 of angle";
        "irradiance": color(at_least(0.0)), "Irradiance of a directional light on a surface that faces it, W·m⁻²";
        "radiance": color(at_least(0.0)), "Radiance of a constant environment, a sphere, a disk or a rectangle, W·sr⁻¹·m⁻²";
        "image": string(), "Picture of an environment, .hdr or .exr, latitude and longitude";
        "scale": at_least(0.0), "Factor of the radiance of an environment, a sky or a studio; default 1";
        "rotate": either(&[number(), vector()]), "Rotation of an environment: degrees about +y, or about the fixed x, y and z axes";
        "sun": azimuth_and_elevation(), "Azimuth and elevation of a sky's sun, degrees; default -45 45";
        "turbidity": from_to(2.0, 10.0), "Haze of a sky; default 3";
        "up": vector(), "Up in a sky or a studio, and along the height of a rectangle; default 0 1 0";
        "front": number(), "Azimuth of the front of a studio, where the camera stands, degrees; default 0";
        "size": list(2, above(0.0)), "Width and height of a rectangle";
        "radius": above(0.0), "Radius of a sphere or a disk";
    }
    /// Of spot lights
    SPOT {
        "angle": above_to(0.0, 90.0), "Half-angle of the cone, degrees";
    }
    /// Of directional lights
    DIRECTIONAL {
        "angle": either(&[json!({ "enum": [0] }), from_to(0.01, 180.0)]), "Diameter of the disc, degrees; 0 is parallel light, the sun has 0.53";
    }
}

/// The name of a light group, which becomes a part of channel names.
fn group() -> Value {
    json!({ "type": "string", "pattern": "^[A-Za-z0-9_]{1,23}$", "not": { "enum": ["default"] } })
}

/// A type of lights with these keys.
const fn light(
    name: &'static str,
    required: &'static [&'static str],
    optional: &'static [&'static str],
    one_of: &'static [&'static str],
    keys: &'static [Key],
) -> LightType {
    LightType {
        name,
        required,
        optional,
        one_of,
        keys,
    }
}

/// All types of lights.
pub(super) const LIGHTS: &[LightType] = &[
    light("point", &["position", "intensity"], &[], &[], &[]),
    light(
        "spot",
        &["position", "intensity", "angle"],
        &["direction", "look_at", "falloff"],
        &["direction", "look_at"],
        SPOT,
    ),
    light(
        "directional",
        &["direction", "irradiance"],
        &["angle"],
        &[],
        DIRECTIONAL,
    ),
    light("constant", &["radiance"], &[], &[], &[]),
    light("environment", &["image"], &["scale", "rotate"], &[], &[]),
    light("sky", &[], &["sun", "turbidity", "up", "scale"], &[], &[]),
    light("studio", &[], &["up", "front", "scale"], &[], &[]),
    light(
        "rectangle",
        &["position", "direction", "size", "radiance"],
        &["up"],
        &[],
        &[],
    ),
    light("sphere", &["position", "radius", "radiance"], &[], &[], &[]),
    light("disk", &["position", "direction", "radius", "radiance"], &[], &[], &[]),
];
