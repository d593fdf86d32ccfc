//! Cryptomatte: mattes by name (Friedman and Jones 2015, "Fully automatic ID mattes with support
//! for motion blur and transparency"). Names of channels, hashes and metadata follow the
//! Cryptomatte specification 1.2.

use super::FeatureNames;
use crate::film::{Aov, Channel, Coverage, FeatureSums, Film};
use serde_json::Value;
use std::collections::HashMap;

/// Suffixes of the channels of a matte layer: six pairs of id and coverage. Each of the EXR layers
/// `00`, `01` and `02` holds two pairs.
const CHANNELS: [&str; 12] = [
    "00.R", "00.G", "00.B", "00.A", "01.R", "01.G", "01.B", "01.A", "02.R", "02.G", "02.B", "02.A",
];

/// A layer of mattes, which are the mattes of objects, of parts or of materials.
struct Layer<'a> {
    name: &'static str,
    /// Names of the layer. The ids in the film are indices of this list.
    names: Vec<&'a str>,
    coverage: fn(&FeatureSums) -> &Coverage,
}

/// Layers of mattes for a scene with these names: objects, materials, and parts if the scene has
/// any.
fn layers(names: &FeatureNames) -> Vec<Layer<'_>> {
    fn texts(names: &[String]) -> Vec<&str> {
        names.iter().map(String::as_str).collect()
    }
    let objects = Layer {
        name: "CryptoObject",
        names: texts(&names.objects),
        coverage: |features| &features.objects,
    };
    let parts = Layer {
        name: "CryptoPart",
        names: names
            .objects
            .iter()
            .chain(&names.parts_of_objects)
            .map(String::as_str)
            .collect(),
        coverage: |features| &features.parts,
    };
    let materials = Layer {
        name: "CryptoMaterial",
        names: texts(&names.materials),
        coverage: |features| &features.materials,
    };
    let parts = Some(parts).filter(|_| !names.parts_of_objects.is_empty());
    [Some(objects), parts, Some(materials)].into_iter().flatten().collect()
}

/// Channels of all mattes. In each pixel, names are ranked by their coverage, the largest first.
/// Each rank has two channels: the hash of the name as a float, and the fraction of the pixel's
/// samples that belong to the name.
pub fn cryptomattes(film: &Film, names: &FeatureNames) -> Vec<Channel> {
    layers(names).iter().flat_map(|layer| layer.channels(film)).collect()
}

impl Layer<'_> {
    fn channels(&self, film: &Film) -> Vec<Channel> {
        let hashes: Vec<f32> = self.names.iter().map(|name| id_of(name)).collect();
        // Sum the coverage of equal names. Several materials may have the same name, and a part may
        // have the name of an object.
        let mut first: HashMap<&str, u32> = HashMap::new();
        let ids = (0..).zip(&self.names);
        let first_of: Vec<u32> = ids.map(|(id, name)| *first.entry(name).or_insert(id)).collect();
        let has_repetitions = first.len() < self.names.len();
        let names = CHANNELS.map(|suffix| format!("{}{suffix}", self.name).into());
        film.develop_channels(names.into_iter(), |sums, i, values| {
            let Some(features) = sums.features().get(i) else { return };
            let (coverage, samples) = ((self.coverage)(features), sums.pixel(i).samples().max(1) as f32);
            let ranked = if has_repetitions {
                let mut by_name = Coverage::default();
                for (id, n) in coverage.iter() {
                    by_name.add(first_of.get(id as usize).copied().unwrap_or(id), n);
                }
                by_name.by_rank()
            } else {
                coverage.by_rank()
            };
            for rank in 0..CHANNELS.len() / 2 {
                let found = ranked.get(rank);
                let id = found.and_then(|&(id, _)| hashes.get(id as usize)).copied();
                values.push(id.unwrap_or(0.0));
                values.push(found.map_or(0.0, |&(_, n)| n as f32 / samples));
            }
        })
    }
}

/// Header attributes of the mattes, if there are any.
pub(super) fn attributes(names: &FeatureNames) -> Vec<(String, String)> {
    if !names.aovs().contains(&Aov::Cryptomatte) {
        return Vec::new();
    }
    let of_layer = |layer: &Layer| {
        let key = &format!("{:08x}", hash_of(layer.name))[..7];
        let hexadecimal = |name: &&str| {
            (
                name.to_string(),
                Value::String(format!("{:08x}", id_of(name).to_bits())),
            )
        };
        let manifest = Value::Object(layer.names.iter().map(hexadecimal).collect());
        [
            ("name", layer.name.to_string()),
            ("hash", "MurmurHash3_32".into()),
            ("conversion", "uint32_to_float32".into()),
            ("manifest", manifest.to_string()),
        ]
        .map(|(what, text)| (format!("cryptomatte/{key}/{what}"), text))
    };
    layers(names).iter().flat_map(of_layer).collect()
}

/// Id of a name in mattes: the hash of the name, read as the bits of a float. If the float is zero,
/// infinite, NaN or subnormal, one bit is changed.
fn id_of(name: &str) -> f32 {
    let hash = hash_of(name);
    let exponent = hash >> 23 & 255;
    let is_usual = (1..255).contains(&exponent);
    f32::from_bits(if is_usual { hash } else { hash ^ 1 << 23 })
}

/// MurmurHash3 of 32 bits, x86 variant, seed 0 (Appleby 2011).
fn hash_of(text: &str) -> u32 {
    let scramble = |k: u32| k.wrapping_mul(0xcc9e2d51).rotate_left(15).wrapping_mul(0x1b873593);
    let words = text.as_bytes().chunks_exact(4);
    let rest = words.remainder().iter().rev().fold(0, |k, &byte| k << 8 | byte as u32);
    let mut hash = words.fold(0u32, |hash, word| {
        let k = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
        (hash ^ scramble(k))
            .rotate_left(13)
            .wrapping_mul(5)
            .wrapping_add(0xe6546b64)
    });
    hash ^= scramble(rest) ^ text.len() as u32;
    hash = (hash ^ hash >> 16).wrapping_mul(0x85ebca6b);
    hash = (hash ^ hash >> 13).wrapping_mul(0xc2b2ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published test vectors of the hash.
    #[test]
    fn hashes_equal_the_published_vectors() {
        for (text, hash) in [
            ("", 0),
            ("test", 0xba6bd213),
            ("Hello, world!", 0xc0363e43),
            ("The quick brown fox jumps over the lazy dog", 0x2e4ff723),
        ] {
            assert_eq!(hash_of(text), hash, "{text}");
        }
    }

    #[test]
    fn ids_are_normal_floats() {
        for i in 0..100_000 {
            assert!(id_of(&format!("object {i}")).is_normal());
        }
    }
}
