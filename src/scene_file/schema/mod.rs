//! JSON Schema (draft 7) of scene files. Editors use it to complete keys, show help and mark
//! mistakes.
//!
//! Keys of `[camera]`, `[image]` and `[render]` come from their parameters (`options`), keys of
//! other sections from their tables (`section`). The schema does not cover conditions that only the
//! program can check, such as the existence of files; docs/guide/reference/scene-file.md lists
//! these conditions.

use super::file::{HIDE, ONLY, TEXTURE_DIR};
use super::key_schema::{closed, described};
use super::light_section::LightType;
#[cfg(feature = "view")]
use super::section::Section;
use super::section::table;
use super::{
    CutSection, GroundSection, LightGroupSection, LightSection, MaterialSection, ObjectSection, PartSection,
    SceneOptions,
};
use crate::color::Spectrum;
use crate::options::{CameraOptions, Parameter};
use serde_json::{Map, Value, json};

/// The schema of scene files as text.
pub fn schema_text() -> String {
    format!("{:#}\n", schema())
}

/// The schema of scene files.
fn schema() -> Value {
    let material = table::<MaterialSection>(Some("Material"));
    let mut patch = material.clone();
    if let Some(properties) = patch["properties"].as_object_mut() {
        properties.remove("patch");
    }
    patch["description"] = json!("Changes to all materials whose names match the pattern in the section's name");
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Embrasure scene file",
        "definitions": { "colour": color_text() },
        "type": "object",
        "additionalProperties": false,
        "required": ["version", "object"],
        "properties": {
            "version": { "enum": [1], "description": "Version of the format; 1" },
            "camera": options("camera", "Camera", &[]),
            "image": options("image", "The picture", &[]),
            "render": options("render", "Samples, integrator and reading of files", &lists()),
            "object": list(object(), 1, "Objects"),
            "material": named(material, "Materials that replace those of MTL files, by name"),
            "patch": named(patch, "Changes to materials, by globs of their names"),
            "part": named(part(), "Changes to parts of OBJ files, by globs of their `o` and `g` names"),
            "light": list(light(), 0, "Lights besides emitting triangles"),
            "ground": table::<GroundSection>(Some("A plane that shows only shadows")),
            "section": list(table::<CutSection>(Some("Plane that cuts the scene open")), 0, "Sections"),
            "light_group": list(table::<LightGroupSection>(Some("Group of emitting materials")), 0, "Light groups"),
        },
    })
}

/// Strings of colours: sRGB codes and CSS names.
fn color_text() -> Value {
    let code = json!({ "type": "string", "pattern": "^#([0-9A-Fa-f]{3}){1,2}$" });
    json!({ "anyOf": [code, { "enum": Spectrum::names().collect::<Vec<_>>() }] })
}

fn list(items: Value, min: usize, description: &str) -> Value {
    let mut list = json!({ "type": "array", "description": description, "items": items });
    if min > 0 {
        list["minItems"] = json!(min);
    }
    list
}

/// Schema of a table whose keys are arbitrary names, and whose values have the schema `of`.
fn named(of: Value, description: &str) -> Value {
    json!({ "type": "object", "description": description, "additionalProperties": of })
}

/// Schema of a table that must not have both keys.
fn not_both(first: &str, second: &str) -> Value {
    json!({ "not": { "required": [first, second] } })
}

/// Schema of the section `name`, with the parameters of its groups and with the keys `others`.
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
    if name == "camera" {
        twice.extend(
            CameraOptions::EXCLUSIVE
                .iter()
                .map(|[first, second]| not_both(first, second)),
        );
    }
    properties.extend(others.iter().map(|(key, schema)| ((*key).into(), schema.clone())));
    let mut table = closed(Some(description), properties, &[]);
    if !twice.is_empty() {
        table["allOf"] = json!(twice);
    }
    table
}

/// Keys of `[render]` whose value is a string or a list of strings, with their schemas.
fn lists() -> Vec<(&'static str, Value)> {
    [
        (
            TEXTURE_DIR,
            "Folder, or list of folders, to search for missing textures",
        ),
        (HIDE, "Pattern, or list of patterns, of parts (`o`, `g`) to leave out"),
        (ONLY, "Pattern, or list of patterns, of the parts (`o`, `g`) to show"),
    ]
    .map(|(key, description)| {
        let schema = json!({
            "description": description,
            "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
        });
        (key, schema)
    })
    .to_vec()
}

fn object() -> Value {
    let mut object = table::<ObjectSection>(Some("Object: an OBJ file and its placement"));
    object["allOf"] = json!([
        not_both("transform", "matrix"),
        not_both("transform_close", "matrix_close")
    ]);
    object
}

/// Schema of a section `[part."GLOB"]`.
fn part() -> Value {
    let properties = PartSection::all_keys().map(|key| (key.key.into(), described(key)));
    closed(
        Some("Changes to all parts (`o`, `g`) whose names match the pattern in the section's name"),
        properties.collect(),
        &[],
    )
}

/// Schema of a light section. Its type decides which keys are valid.
fn light() -> Value {
    let of_type = |kind: &LightType| {
        let allowed = ["type", "group"].into_iter().chain(kind.keys());
        let mut properties: Map<String, Value> = allowed.map(|key| (key.into(), json!(true))).collect();
        properties.extend(kind.angle_schema().map(|schema| ("angle".into(), schema)));
        let mut then = json!({ "properties": properties, "additionalProperties": false, "required": kind.required });
        if !kind.one_of.is_empty() {
            let choices: Vec<Value> = kind.one_of.iter().map(|key| json!({ "required": [key] })).collect();
            then["oneOf"] = json!(choices);
        }
        json!({ "if": { "properties": { "type": { "enum": [kind.name] } } }, "then": then })
    };
    let mut light = table::<LightSection>(Some("Light"));
    light["allOf"] = LightType::ALL.iter().map(of_type).collect();
    light
}

/// Keys of `[material.NAME]` except `patch`, with the schemas of their values.
#[cfg(feature = "view")]
pub(crate) fn material_keys() -> Vec<(&'static str, Value)> {
    let keys = MaterialSection::KEYS.iter().filter(|key| key.key != "patch");
    keys.map(|key| (key.key, described(key))).collect()
}

/// Keys of a `[[light]]` of type `kind` except the type, with the schemas of their values; empty
/// for an unknown type.
#[cfg(feature = "view")]
pub(crate) fn light_keys(kind: &str) -> Vec<(&'static str, Value)> {
    let Some(kind) = LightType::of_name(kind) else {
        return Vec::new();
    };
    let is_of = |key: &&Parameter| key.key == "group" || kind.keys().any(|of| of == key.key);
    let schema = |key: &Parameter| match key.key {
        "angle" => kind.angle_schema().unwrap_or_else(|| described(key)),
        _ => described(key),
    };
    let keys = LightSection::KEYS.iter().filter(is_of);
    keys.map(|key| (key.key, schema(key))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every key of a section, and of each light type, has a description.
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

    /// docs/scene.schema.json equals the output of the program. `EMBRASURE_WRITE_DOCS=1` writes it.
    #[test]
    fn documentation_has_the_schema() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.schema.json");
        if std::env::var_os("EMBRASURE_WRITE_DOCS").is_some() {
            std::fs::write(&path, schema_text()).unwrap();
        }
        let text = std::fs::read_to_string(path).unwrap();
        assert!(text == schema_text(), "`make reference` writes docs/scene.schema.json");
    }
}
