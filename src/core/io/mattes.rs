//! Names of the mattes of an EXR file from any program (Cryptomatte specification 1.2).

use super::cryptomatte;
use super::metadata::FeatureNames;
use crate::files::input::read_text;
use crate::files::memory::Allowance;
use ::exr::image::FlatImage;
use ::exr::prelude as exr;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path};

/// Prefix of the attributes of mattes: `cryptomatte/KEY/name`, `cryptomatte/KEY/manifest`, or
/// `cryptomatte/KEY/manif_file` for a manifest in a file of its own (sidecar).
const PREFIX: &str = "cryptomatte/";
/// Memory of a manifest, as a multiple of the size of its file.
const MEMORY_OF_TEXT: u64 = 8;

/// Mattes of a layer: names with their ids.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    /// Name of the layer, such as `CryptoObject`.
    pub layer: String,
    /// Names, each with its id. The id is a value of the layer's id channels.
    pub names: Vec<(String, f32)>,
}

/// Mattes of a file whose header has the attributes `texts`, pairs of name and text. `sidecar`
/// reads the manifest of a file of its own. Invalid manifests are left out.
fn of_texts(texts: impl Iterator<Item = (String, String)>, sidecar: impl Fn(&str) -> Option<String>) -> Vec<Mattes> {
    let mut layers: BTreeMap<String, [String; 3]> = BTreeMap::new();
    for (name, text) in texts {
        let rest = name.strip_prefix(PREFIX).and_then(|rest| rest.rsplit_once('/'));
        match rest {
            Some((key, "name")) => layers.entry(key.into()).or_default()[0] = text,
            Some((key, "manifest")) => layers.entry(key.into()).or_default()[1] = text,
            Some((key, "manif_file")) => layers.entry(key.into()).or_default()[2] = text,
            _ => {}
        }
    }
    let mattes = layers.into_values().filter_map(|[layer, manifest, file]| {
        let names = |text: &str| serde_json::from_str::<BTreeMap<String, String>>(text).ok();
        let manifest = names(&manifest).or_else(|| names(&sidecar(&file)?))?;
        let id = |(name, hexadecimal): (String, String)| {
            Some((name, f32::from_bits(u32::from_str_radix(&hexadecimal, 16).ok()?)))
        };
        Some(Mattes {
            layer,
            names: manifest.into_iter().filter_map(id).collect(),
        })
    });
    mattes.filter(|mattes| !mattes.layer.is_empty()).collect()
}

/// Text of the manifest `name` of the picture `picture`. The manifest is in the folder of the
/// picture or below it; `None` for other places, and if the file cannot be read.
fn manifest_beside(picture: &Path, name: &str) -> Option<String> {
    let is_below = Path::new(name)
        .components()
        .all(|component| matches!(component, Component::Normal(_) | Component::CurDir));
    if name.is_empty() || !is_below {
        return None;
    }
    let path = picture.parent().unwrap_or(Path::new("")).join(name);
    let length = fs::metadata(&path).ok()?.len();
    let memory = length.saturating_mul(MEMORY_OF_TEXT);
    Allowance::of_system().check(&path, memory).ok()?;
    read_text(&path, "the manifest of mattes").ok()
}

/// Mattes of the file `path`.
pub(super) fn of_file(path: &Path, file: &FlatImage) -> Vec<Mattes> {
    let attributes = file.layer_data.iter().flat_map(|layer| &layer.attributes.other);
    let text = |(name, value): (&exr::Text, &exr::AttributeValue)| match value {
        exr::AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    };
    of_texts(attributes.filter_map(text), |name| manifest_beside(path, name))
}

/// Mattes of a picture with the objects, parts and materials `names`.
pub(super) fn of_names(names: Option<&FeatureNames>) -> Vec<Mattes> {
    of_texts(names.map_or(Vec::new(), cryptomatte::attributes).into_iter(), |_| None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A manifest in a file of its own is used if the header has none. Paths that lead out of the
    /// picture's folder are not followed.
    #[test]
    fn manifests_may_be_in_files_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("a/b");
        fs::create_dir_all(&below).unwrap();
        for file in [folder.path().join("m.json"), below.join("m.json")] {
            fs::write(file, r#"{"chair": "3f800000", "bad": "x"}"#).unwrap();
        }
        let picture = folder.path().join("a/picture.exr");
        let names = |manifest: &str, file: &str| {
            let texts = [("name", "CryptoPart"), ("manifest", manifest), ("manif_file", file)];
            let texts = texts.map(|(key, text)| (format!("{PREFIX}1234567/{key}"), text.to_string()));
            let mattes = of_texts(texts.into_iter(), |name| manifest_beside(&picture, name));
            mattes.first().map(|mattes| mattes.names.clone())
        };
        let chair = Some(vec![("chair".to_string(), 1.0)]);
        assert_eq!(names("", "b/m.json"), chair);
        assert_eq!(names("", "./b/m.json"), chair);
        let of_header = names(r#"{"table": "40000000"}"#, "b/m.json");
        assert_eq!(of_header, Some(vec![("table".to_string(), 2.0)]));
        let absolute = below.join("m.json").display().to_string();
        for wrong in ["", "../m.json", "b/../../m.json", "b", "c.json", &absolute] {
            assert_eq!(names("", wrong), None, "{wrong}");
        }
    }
}
