//! Textures in sections of materials. A texture is a file name, or a table with the file name and
//! the mapping.

use super::FileError;
use super::key_schema::either;
use super::mtl::MapRequest;
use super::mtl::{MapSlot, MapStatement};
use super::section::{Section, key_types, section, table};
use super::source::Source;
use crate::math::{excerpt, excerpt_of_name, list};
use crate::texture::{Channel, Mapping, Wrap};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::json;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;

section! {
    /// Table of a texture: file name and mapping.
    pub struct TextureSection {
        required {
            /// Picture, relative to the scene file
            file: PathBuf;
        }
        /// Repetitions of the picture in a unit of u and v
        scale: [f32; 2], default "1 1";
        /// Position of the surface's (0, 0) in the picture
        offset: [f32; 2], default "0 0";
        /// Continuation beside the picture
        wrap: String, default "repeat", names names_of(WRAPS);
        /// Channel that a map of numbers takes
        ///
        /// `m` is alpha, `l` luminance and `z` depth.
        channel: String, default "luminance; for opacity alpha, if the picture has alpha", names names_of(Channel::NAMES);
        /// Values become base + gain × value
        base: f32, default "0";
        /// Values become base + gain × value
        gain: f32, default "1";
        /// Factor of heights, and of the slopes of a normal map
        ///
        /// Of a displacement map: scene units.
        height: f32, default "1";
        /// Value of a displacement map that leaves the surface where it is
        midlevel: f32, default "0";
        /// Green of a normal map points down, as in DirectX
        flip_green: bool, default "false";
    }
}

/// Value of a texture key: `"FILE"`, a table, or `false` for no texture.
#[derive(Clone, Debug)]
pub enum MapSection {
    /// No texture.
    None,
    /// A texture.
    Texture(Box<TextureSection>),
}

impl<'de> Deserialize<'de> for MapSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct FileOrTable;
        impl<'de> Visitor<'de> for FileOrTable {
            type Value = MapSection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "the name of a picture, a table with `file`, or false for no texture")
            }

            fn visit_str<E: de::Error>(self, name: &str) -> Result<MapSection, E> {
                let file = Spanned::new(0..0, name.into());
                Ok(MapSection::Texture(Box::new(TextureSection::new(file))))
            }

            fn visit_bool<E: de::Error>(self, is_there: bool) -> Result<MapSection, E> {
                if is_there {
                    Err(de::Error::invalid_value(Unexpected::Bool(true), &self))
                } else {
                    Ok(MapSection::None)
                }
            }

            // Not an untagged enum with a derived `Deserialize`, because its error would not name
            // the unknown key
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MapSection, A::Error> {
                TextureSection::deserialize(MapAccessDeserializer::new(map))
                    .map(|texture| MapSection::Texture(Box::new(texture)))
            }
        }
        deserializer.deserialize_any(FileOrTable)
    }
}

impl Serialize for MapSection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::None => serializer.serialize_bool(false),
            // Write only the file name if no other key is set
            Self::Texture(texture) if texture.given().len() == 1 => texture.file.serialize(serializer),
            Self::Texture(texture) => texture.serialize(serializer),
        }
    }
}

key_types! {
    MapSection: |_number| either(&[
        json!({ "type": "string" }),
        json!({ "enum": [false] }),
        table::<TextureSection>(None),
    ]);
}

/// Wrap modes by their names in scene files.
const WRAPS: &[(&str, Wrap)] = &[
    ("repeat", Wrap::Repeat),
    ("clamp", Wrap::Clamp),
    ("mirror", Wrap::Mirror),
];

fn names_of<T>(named: &[(&'static str, T)]) -> Vec<&'static str> {
    named.iter().map(|(name, _)| *name).collect()
}

impl TextureSection {
    /// Section of the picture `file` with the mapping `mapping`.
    pub(super) fn of(file: PathBuf, mapping: &Mapping) -> Self {
        fn spanned<T>(value: T) -> Option<Spanned<T>> {
            Some(Spanned::new(0..0, value))
        }
        let default = Mapping::default();
        let number = |value: f32, default: f32| spanned(value).filter(|_| value != default);
        let name_of = |name: Option<&str>| name.and_then(|name| spanned(name.to_string()));
        let wrap = WRAPS.iter().find(|(_, wrap)| *wrap == mapping.wrap);
        let channel = Channel::NAMES.iter().find(|(_, c)| Some(*c) == mapping.channel);
        Self {
            file: Spanned::new(0..0, file),
            scale: spanned(mapping.scale.to_array()).filter(|_| mapping.scale != default.scale),
            offset: spanned(mapping.offset.to_array()).filter(|_| mapping.offset != default.offset),
            wrap: name_of(wrap.filter(|_| mapping.wrap != default.wrap).map(|(name, _)| *name)),
            channel: name_of(channel.map(|(name, _)| *name)),
            base: number(mapping.base, default.base),
            gain: number(mapping.gain, default.gain),
            height: number(mapping.bump, default.bump),
            // The midlevel is included in `base`
            midlevel: None,
            flip_green: spanned(true).filter(|_| mapping.flips_green),
        }
    }

    /// Request for this texture, for the slot `slot` of the material `name`. Errors about the
    /// texture point to the bytes `span` of `file`.
    pub(super) fn request(
        &self,
        span: Range<usize>,
        slot: MapSlot,
        name: &str,
        file: &Source,
    ) -> Result<MapRequest, FileError> {
        let given = self.given();
        let infinite = given.iter().find(|given| !given.numbers.iter().all(|n| n.is_finite()));
        if let Some(given) = infinite {
            let message = format!(
                "material `{}`: a number of a texture is {}",
                excerpt_of_name(name),
                list(given.numbers)
            );
            return Err(file.error(given.span.clone(), message).help("write finite numbers"));
        }
        let default = Mapping::default();
        let number = |given: &Option<Spanned<f32>>, default| given.as_ref().map_or(default, |n| *n.get_ref());
        let mapping = Mapping {
            scale: self.scale.as_ref().map_or(default.scale, |s| (*s.get_ref()).into()),
            offset: self.offset.as_ref().map_or(default.offset, |o| (*o.get_ref()).into()),
            wrap: named(&self.wrap, WRAPS, "wrap", name, file)?.unwrap_or_default(),
            channel: named(&self.channel, Channel::NAMES, "channel", name, file)?,
            base: number(&self.base, default.base) - number(&self.midlevel, 0.0),
            gain: number(&self.gain, default.gain),
            bump: number(&self.height, default.bump),
            flips_green: self.flip_green.as_ref().is_some_and(|flip| *flip.get_ref()),
        };
        let statement = MapStatement {
            whole_file: None,
            slot,
            file: self.file.get_ref().to_string_lossy().into_owned(),
            mapping,
            ignored: Vec::new(),
        };
        let place = file.error(span, "");
        Ok(MapRequest {
            statement,
            place,
            is_literal: true,
            if_cut_out: false,
            path: None,
        })
    }
}

/// Value in `names` whose name is the string `given`. `key` is used in messages.
fn named<T: Copy>(
    given: &Option<Spanned<String>>,
    names: &[(&str, T)],
    key: &str,
    material: &str,
    file: &Source,
) -> Result<Option<T>, FileError> {
    let Some(word) = given else { return Ok(None) };
    match names.iter().find(|(name, _)| name == word.get_ref()) {
        Some(&(_, value)) => Ok(Some(value)),
        None => {
            let message = format!(
                "material `{}`: unknown {key} `{}`",
                excerpt_of_name(material),
                excerpt(word.get_ref())
            );
            let all: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
            Err(file
                .error(word.span(), message)
                .help(format!("choose among {}", all.join(", "))))
        }
    }
}
