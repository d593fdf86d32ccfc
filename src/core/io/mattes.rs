//! Names of the mattes of an EXR file from any program (Cryptomatte specification 1.2).

use super::cryptomatte;
use super::metadata::FeatureNames;
use ::exr::image::FlatImage;
use ::exr::prelude as exr;
use std::collections::BTreeMap;

/// Prefix of the attributes of mattes: `cryptomatte/KEY/name` and `cryptomatte/KEY/manifest`.
const PREFIX: &str = "cryptomatte/";

/// Mattes of a layer: names with their ids.
#[derive(Clone, Debug, PartialEq)]
pub struct Mattes {
    /// Name of the layer, such as `CryptoObject`.
    pub layer: String,
    /// Names, each with its id. The id is a value of the layer's id channels.
    pub names: Vec<(String, f32)>,
}

/// Mattes of a file whose header has the attributes `texts`, pairs of name and text. Invalid
/// manifests are left out.
fn of_texts(texts: impl Iterator<Item = (String, String)>) -> Vec<Mattes> {
    let mut layers: BTreeMap<String, [String; 2]> = BTreeMap::new();
    for (name, text) in texts {
        let rest = name.strip_prefix(PREFIX).and_then(|rest| rest.rsplit_once('/'));
        match rest {
            Some((key, "name")) => layers.entry(key.into()).or_default()[0] = text,
            Some((key, "manifest")) => layers.entry(key.into()).or_default()[1] = text,
            _ => {}
        }
    }
    let mattes = layers.into_values().filter_map(|[layer, manifest]| {
        let manifest: BTreeMap<String, String> = serde_json::from_str(&manifest).ok()?;
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

/// Mattes of a file.
pub(super) fn of_file(file: &FlatImage) -> Vec<Mattes> {
    let attributes = file.layer_data.iter().flat_map(|layer| &layer.attributes.other);
    let text = |(name, value): (&exr::Text, &exr::AttributeValue)| match value {
        exr::AttributeValue::Text(text) => Some((name.to_string(), text.to_string())),
        _ => None,
    };
    of_texts(attributes.filter_map(text))
}

/// Mattes of a picture with the objects, parts and materials `names`.
pub(super) fn of_names(names: Option<&FeatureNames>) -> Vec<Mattes> {
    of_texts(names.map_or(Vec::new(), cryptomatte::attributes).into_iter())
}
