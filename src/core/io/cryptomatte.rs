//! Cryptomatte: mattes by name (Friedman and Jones 2015, "Fully automatic ID mattes with support for motion blur and transparency"). Names of
//! channels, hashes and metadata follow the Cryptomatte specification 1.2.

use super::FeatureNames;
use crate::film::{Aov, Channel, Coverage, FeatureSums, Film};
use serde_json::Value;

/// Layers, and the names of their channels: two ranks of identity and coverage each, six in all.
type Layer = (&'static str, [&'static str; 12]);
const OBJECTS: Layer = (
    "CryptoObject",
    [
        "CryptoObject00.R",
        "CryptoObject00.G",
        "CryptoObject00.B",
        "CryptoObject00.A",
        "CryptoObject01.R",
        "CryptoObject01.G",
        "CryptoObject01.B",
        "CryptoObject01.A",
        "CryptoObject02.R",
        "CryptoObject02.G",
        "CryptoObject02.B",
        "CryptoObject02.A",
    ],
);
const MATERIALS: Layer = (
    "CryptoMaterial",
    [
        "CryptoMaterial00.R",
        "CryptoMaterial00.G",
        "CryptoMaterial00.B",
        "CryptoMaterial00.A",
        "CryptoMaterial01.R",
        "CryptoMaterial01.G",
        "CryptoMaterial01.B",
        "CryptoMaterial01.A",
        "CryptoMaterial02.R",
        "CryptoMaterial02.G",
        "CryptoMaterial02.B",
        "CryptoMaterial02.A",
    ],
);

/// The channels of both mattes: for what covers most of a pixel, next to most, and so on, the hash of its name as a float and the share of the
/// pixel's samples that met it.
pub fn cryptomattes(film: &Film, names: &FeatureNames) -> Vec<Channel> {
    let objects = layer(film, &OBJECTS, &names.objects, |f| &f.objects);
    let materials = layer(film, &MATERIALS, &names.materials, |f| &f.materials);
    objects.into_iter().chain(materials).collect()
}

fn layer(film: &Film, layer: &Layer, names: &[String], of: fn(&FeatureSums) -> &Coverage) -> Vec<Channel> {
    let hashes: Vec<f32> = names.iter().map(|name| id_of(name)).collect();
    let mut channels = layer.1.map(|name| Channel {
        name: name.into(),
        values: Vec::with_capacity(film.crop().area() as usize),
    });
    for pixel in film.crop().pixels() {
        let samples = film.sums(pixel).map_or(0, |sums| sums.samples()).max(1) as f32;
        let ranked = film.features(pixel).map(|f| of(f).by_rank()).unwrap_or_default();
        for (rank, pair) in channels.chunks_exact_mut(2).enumerate() {
            let found = ranked.get(rank);
            let id = found.and_then(|&(id, _)| hashes.get(id as usize)).copied();
            pair[0].values.push(id.unwrap_or(0.0));
            pair[1].values.push(found.map_or(0.0, |&(_, n)| n as f32 / samples));
        }
    }
    channels.into()
}

/// What the header says of the mattes, if there are any.
pub(super) fn attributes(names: &FeatureNames) -> Vec<(String, String)> {
    if !names.aovs().contains(&Aov::Cryptomatte) {
        return Vec::new();
    }
    let layers = [(OBJECTS.0, &names.objects), (MATERIALS.0, &names.materials)];
    let of_layer = |(layer, names): (&str, &Vec<String>)| {
        let key = &format!("{:08x}", hash_of(layer))[..7];
        let hexadecimal = |name: &String| (name.clone(), Value::String(format!("{:08x}", id_of(name).to_bits())));
        let manifest = Value::Object(names.iter().map(hexadecimal).collect());
        [
            ("name", layer.to_string()),
            ("hash", "MurmurHash3_32".into()),
            ("conversion", "uint32_to_float32".into()),
            ("manifest", manifest.to_string()),
        ]
        .map(|(what, text)| (format!("cryptomatte/{key}/{what}"), text))
    };
    layers.into_iter().flat_map(of_layer).collect()
}

/// The number by which mattes know a name: its hash as the bits of a float, without those that mean infinity, NaN or a subnormal number.
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
    fn hashes_are_the_published_ones() {
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
    fn identities_are_usual_floats() {
        for i in 0..100_000 {
            assert!(id_of(&format!("object {i}")).is_normal());
        }
    }
}
