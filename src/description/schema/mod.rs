//! A JSON Schema (draft 7) of scene files, by which editors complete keys, show their help and mark mistakes.
//!
//! Keys of `[image]` and `[render]` come from their parameters (`options`), keys of other sections from the tables of `keys`. A test compares these
//! with the keys that the sections read. What a schema cannot say, such as files that must be there, is found by the program alone;
//! docs/guide/reference/scene-file.md lists it.

mod keys;

use super::SceneOptions;
use super::scene_file::TEXTURE_DIR;
use crate::color::Spectrum;
use crate::options::Parameter;
use keys::Key;
pub(super) use keys::is_of_material;
use serde_json::{Map, Value, json};

/// The schema of scene files, as text.
pub fn schema_text() -> String {
    format!("{:#}\n", schema())
}

/// The schema of scene files.
fn schema() -> Value {
    let material = section("Material", keys::MATERIAL, &[]);
    let mut patch = material.clone();
    if let Some(properties) = patch["properties"].as_object_mut() {
        properties.remove("patch");
    }
    patch["description"] = json!("Changes of all materials whose names match");
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Embrasure scene file",
        "definitions": { "colour": color_text() },
        "type": "object",
        "additionalProperties": false,
        "required": ["version", "object"],
        "properties": {
            "version": { "enum": [1], "description": "Version of the format; 1" },
            "camera": camera(),
            "image": options("image", "The picture", &[]),
            "render": options("render", "Samples, integrator and reading of files", &[(TEXTURE_DIR, texture_dir())]),
            "object": list(object(), 1, "Objects"),
            "material": named(material, "Materials that replace those of MTL files, by name"),
            "patch": named(patch, "Changes of materials, by globs of their names"),
            "light": list(light(), 0, "Lights besides emitting triangles"),
            "ground": section("A plane that shows only shadows", keys::GROUND, &[]),
            "light_group": list(section("Group of emitting materials", keys::LIGHT_GROUP, &["name", "materials"]), 0, "Light groups"),
        },
    })
}

/// Texts of colours: codes of sRGB, and names of CSS.
fn color_text() -> Value {
    let code = json!({ "type": "string", "pattern": "^#([0-9A-Fa-f]{3}){1,2}$" });
    json!({ "anyOf": [code, { "enum": Spectrum::names().collect::<Vec<_>>() }] })
}

/// A table of `keys`, of which some are `required`, and which has no others.
fn section(description: &str, keys: &[Key], required: &[&str]) -> Value {
    let properties: Map<String, Value> = keys.iter().map(|key| (key.name.into(), key.schema())).collect();
    table(description, properties, required)
}

fn table(description: &str, properties: Map<String, Value>, required: &[&str]) -> Value {
    let mut table = json!({
        "type": "object",
        "description": description,
        "additionalProperties": false,
        "properties": properties,
    });
    if !required.is_empty() {
        table["required"] = json!(required);
    }
    table
}

fn list(items: Value, min: usize, description: &str) -> Value {
    let mut list = json!({ "type": "array", "description": description, "items": items });
    if min > 0 {
        list["minItems"] = json!(min);
    }
    list
}

/// A table whose keys are names.
fn named(of: Value, description: &str) -> Value {
    json!({ "type": "object", "description": description, "additionalProperties": of })
}

/// Says that a table has one of two keys at most.
fn not_both(first: &str, second: &str) -> Value {
    json!({ "not": { "required": [first, second] } })
}

/// The section `name`, which sets parameters, and `others`.
fn options(name: &str, description: &str, others: &[(&str, Value)]) -> Value {
    let groups = SceneOptions::GROUPS.iter().filter(|(section, _)| *section == name);
    let parameters: Vec<&Parameter> = groups.flat_map(|(_, parameters)| *parameters).collect();
    let mut properties = Map::new();
    let mut twice = Vec::new();
    for parameter in parameters {
        let keys: Vec<&str> = parameter.keys().collect();
        keys.iter()
            .for_each(|key| drop(properties.insert((*key).into(), described(parameter))));
        if let [key, flag] = keys[..] {
            twice.push(not_both(key, flag));
        }
    }
    properties.extend(others.iter().map(|(key, schema)| ((*key).into(), schema.clone())));
    let mut table = table(description, properties, &[]);
    if !twice.is_empty() {
        table["allOf"] = json!(twice);
    }
    table
}

/// The schema of a parameter, with its help, and its default where that is a value.
fn described(parameter: &Parameter) -> Value {
    let mut schema = parameter.schema();
    let mut words = parameter.help().to_string();
    let detail = parameter.detail();
    if !detail.is_empty() {
        words += &format!(". {detail}");
    }
    let default = parameter.default();
    let number = default
        .parse::<f64>()
        .ok()
        .and_then(|_| serde_json::from_str::<Value>(&default).ok());
    let is_name = parameter.names().contains(&default.as_str()) || ["off", "none"].contains(&default.as_str());
    match number.or(is_name.then(|| json!(default))) {
        Some(value) => schema["default"] = value,
        None if default.is_empty() => {}
        None => words = format!("{}. Default: {default}", words.trim_end_matches('.')),
    }
    schema["description"] = json!(words);
    schema
}

fn texture_dir() -> Value {
    json!({
        "description": "Folder, or list of folders, to search for missing textures",
        "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
    })
}

fn camera() -> Value {
    let mut camera = section("Camera", keys::CAMERA, &[]);
    camera["allOf"] = json!([
        not_both("position", "view"),
        not_both("position", "orbit"),
        not_both("position", "stand"),
        not_both("view", "orbit"),
        not_both("view", "stand"),
        not_both("orbit", "stand"),
        not_both("yaw", "look_at"),
        { "anyOf": [{ "required": ["stand"] }, { "not": { "required": ["yaw"] } }] }
    ]);
    camera
}

fn object() -> Value {
    let mut object = section("Object: an OBJ file and its placement", keys::OBJECT, &["obj"]);
    object["allOf"] = json!([
        not_both("transform", "matrix"),
        not_both("transform_close", "matrix_close")
    ]);
    object
}

/// A light: its type decides which keys it has.
fn light() -> Value {
    let names: Vec<&str> = keys::LIGHTS.iter().map(|light| light.name).collect();
    let of_type = |light: &keys::LightType| {
        let common = ["type", "group"].into_iter();
        let allowed = common.chain(light.required.iter().chain(light.optional).copied());
        let mut properties: Map<String, Value> = allowed.map(|key| (key.into(), json!(true))).collect();
        for key in light.keys {
            properties.insert(key.name.into(), key.schema());
        }
        let mut then = json!({ "properties": properties, "additionalProperties": false, "required": light.required });
        if !light.one_of.is_empty() {
            let choices: Vec<Value> = light.one_of.iter().map(|key| json!({ "required": [key] })).collect();
            then["oneOf"] = json!(choices);
        }
        json!({ "if": { "properties": { "type": { "enum": [light.name] } } }, "then": then })
    };
    let conditions: Vec<Value> = keys::LIGHTS.iter().map(of_type).collect();
    let mut light = section("Light", keys::LIGHT, &["type"]);
    light["properties"]["type"] = json!({ "enum": names, "description": "Type of the light" });
    light["allOf"] = json!(conditions);
    light
}

/// Keys of `[material.NAME]` and what each may hold, without `patch`.
#[cfg(feature = "view")]
pub(crate) fn material_keys() -> Vec<(&'static str, Value)> {
    let keys = keys::MATERIAL.iter().filter(|key| key.name != "patch");
    keys.map(|key| (key.name, key.schema())).collect()
}

/// Keys of a `[[light]]` of type `kind` other than the type, and what each may hold; none of an unknown type.
#[cfg(feature = "view")]
pub(crate) fn light_keys(kind: &str) -> Vec<(&'static str, Value)> {
    let Some(light) = keys::LIGHTS.iter().find(|light| light.name == kind) else {
        return Vec::new();
    };
    let is_of = |key: &&Key| key.name == "group" || [light.required, light.optional].concat().contains(&key.name);
    let own = |key: &Key| {
        light
            .keys
            .iter()
            .find(|own| own.name == key.name)
            .unwrap_or(key)
            .schema()
    };
    let keys = keys::LIGHT.iter().filter(is_of);
    keys.map(|key| (key.name, own(key))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::{
        CameraSection, GroundSection, LightGroupSection, LightSection, MaterialSection, ObjectSection, SceneFile,
    };
    use super::*;
    use serde::de::DeserializeOwned;
    use std::collections::BTreeSet;

    /// Keys of a section, as its reader names them where it refuses another.
    fn keys_read<T: DeserializeOwned>() -> BTreeSet<String> {
        let error = toml::from_str::<T>("no_such_key = 1").err().unwrap();
        let names = error.message().split('`').skip(3).step_by(2);
        names.map(String::from).collect()
    }

    fn keys_of(section: &Value) -> BTreeSet<String> {
        section["properties"].as_object().unwrap().keys().cloned().collect()
    }

    #[test]
    fn the_schema_has_the_keys_that_sections_read() {
        let schema = schema();
        let properties = &schema["properties"];
        assert_eq!(keys_of(&schema), keys_read::<SceneFile>());
        assert_eq!(keys_of(&properties["camera"]), keys_read::<CameraSection>());
        assert_eq!(keys_of(&properties["ground"]), keys_read::<GroundSection>());
        assert_eq!(keys_of(&properties["object"]["items"]), keys_read::<ObjectSection>());
        assert_eq!(keys_of(&properties["light"]["items"]), keys_read::<LightSection>());
        assert_eq!(
            keys_of(&properties["light_group"]["items"]),
            keys_read::<LightGroupSection>()
        );
        assert_eq!(
            keys_of(&properties["material"]["additionalProperties"]),
            keys_read::<MaterialSection>()
        );
        let types: BTreeSet<&str> = keys::LIGHTS.iter().map(|light| light.name).collect();
        assert_eq!(types, LightSection::TYPES.into_iter().collect());
    }

    /// Every key of a section, and of a light of each type, is described.
    #[test]
    fn every_key_has_a_description() {
        fn walk(value: &Value, path: &str) {
            let Some(properties) = value["properties"]
                .as_object()
                .filter(|_| value["description"].is_string())
            else {
                return;
            };
            for (key, schema) in properties {
                assert!(schema["description"].is_string(), "{path}.{key}");
                walk(schema, &format!("{path}.{key}"));
                walk(&schema["items"], &format!("{path}.{key}"));
                walk(&schema["additionalProperties"], &format!("{path}.{key}"));
            }
        }
        let mut schema = schema();
        schema["description"] = json!("");
        walk(&schema, "");
    }

    /// docs/scene.schema.json is what the program prints. `EMBRASURE_WRITE_DOCS=1` writes it.
    #[test]
    fn documentation_has_the_schema() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.schema.json");
        if std::env::var_os("EMBRASURE_WRITE_DOCS").is_some() {
            std::fs::write(&path, schema_text()).unwrap();
        }
        let text = std::fs::read_to_string(path).unwrap();
        assert!(
            text == schema_text(),
            "EMBRASURE_WRITE_DOCS=1 cargo test --lib documentation writes docs/scene.schema.json"
        );
    }
}
