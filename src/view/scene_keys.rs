//! Keys of materials and lights that a page may set. Pages make controls from the JSON Schema of
//! the keys, and may set numbers, colours, lists and choices. Other keys with strings are refused,
//! because such strings name files, and a page must not choose files to read on this machine.

use crate::scene_file::{LightType, PRESETS, Preset, light_keys, material_keys};
use serde_json::{Map, Value, json};

/// Keys that need or exclude another key. A page sets one key at a time, so it offers such a key
/// only if the key already has a value.
const NEVER_ALONE: [&str; 4] = ["eta", "k", "look_at", "direction"];

/// Key of materials that selects a preset.
pub(super) const PRESET: &str = "preset";

type Keys = Vec<(&'static str, Value)>;

/// Data for pages about all settable keys.
pub(super) fn tables() -> Value {
    let table = |keys: Keys| -> Value {
        let free = keys.into_iter().filter(|(_, holds)| !is_text(holds));
        free.map(|(key, holds)| json!({ "key": key, "holds": holds, "alone": !NEVER_ALONE.contains(&key) }))
            .collect()
    };
    let lights: Map<String, Value> = LightType::names()
        .into_iter()
        .map(|kind| (kind.to_string(), table(light_keys(kind))))
        .collect();
    json!({ "material": table(material_keys()), "light": lights })
}

/// Presets of materials with their keys.
pub(super) fn presets() -> Value {
    let preset = |preset: &Preset| {
        let keys = toml::from_str::<toml::Value>(preset.keys).ok();
        json!({ "name": preset.name, "about": preset.about, "keys": keys })
    };
    PRESETS.iter().map(preset).collect()
}

/// Checks that a page may set `key` of a material.
///
/// # Errors
///
/// An unknown key, or a key with a string value.
pub(super) fn check_material(key: &str) -> Result<(), String> {
    check("a material", key, &material_keys())
}

/// Checks that a page may set `key` of a light of type `kind`.
///
/// # Errors
///
/// An unknown key, or a key with a string value.
pub(super) fn check_light(kind: &str, key: &str) -> Result<(), String> {
    check(&format!("a {kind} light"), key, &light_keys(kind))
}

fn check(owner: &str, key: &str, keys: &[(&str, Value)]) -> Result<(), String> {
    match keys.iter().find(|(known, _)| *known == key) {
        None => Err(format!("{owner} has no key `{key}` that a page could set")),
        Some((_, holds)) if is_text(holds) => Err(format!(
            "a page cannot set `{key}` of {owner}: keys with names and paths could make the program read any file of this machine\n  help: edit the scene file, which the viewer then reloads"
        )),
        Some(_) => Ok(()),
    }
}

/// Returns true if a value of this schema may be a string other than a choice.
fn is_text(holds: &Value) -> bool {
    let one_of = holds["anyOf"].as_array().into_iter().flatten();
    holds["type"] == "string" || one_of.into_iter().any(is_text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_files_are_refused() {
        for key in ["diffuse", "roughness", "model", "thin", "ior", "opacity"] {
            assert_eq!(check_material(key), Ok(()), "{key}");
        }
        let keys = material_keys();
        let maps = keys.iter().filter(|(key, _)| key.ends_with("_map"));
        assert_eq!(maps.clone().count(), 10);
        for (key, _) in maps {
            assert!(
                check_material(key).unwrap_err().contains("any file of this machine"),
                "{key}"
            );
        }
        for key in ["", "patch", "colour", "diffuse_map.file", "diffuse = 1\nroughness"] {
            assert!(check_material(key).unwrap_err().contains("has no key"), "{key}");
        }
        assert_eq!(check_light("environment", "scale"), Ok(()));
        assert!(check_light("environment", "image").unwrap_err().contains("any file"));
        for (kind, key) in [
            ("point", "radiance"),
            ("point", "type"),
            ("nonsense", "scale"),
            ("sky", "image"),
        ] {
            assert!(
                check_light(kind, key).unwrap_err().contains("has no key"),
                "{kind} {key}"
            );
        }
    }

    #[test]
    fn pages_get_the_schema_of_each_key() {
        let tables = tables();
        let key = |list: &Value, name: &str| {
            let found = list.as_array().unwrap().iter().find(|entry| entry["key"] == name);
            found.map(|entry| entry["holds"].clone())
        };
        let roughness = key(&tables["material"], "roughness").unwrap();
        assert_eq!((&roughness["minimum"], &roughness["maximum"]), (&json!(0), &json!(1)));
        assert!(roughness["description"].is_string());
        assert!(key(&tables["material"], "diffuse_map").is_none());
        assert!(key(&tables["light"]["spot"], "angle").unwrap()["maximum"] == 90.0);
        assert!(key(&tables["light"]["environment"], "image").is_none());
        assert_eq!(tables["light"].as_object().unwrap().len(), LightType::ALL.len());
    }
}
