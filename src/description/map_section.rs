//! Textures in sections of materials: a file name, or a table with the mapping.

use super::FileError;
use super::exact_list::numbers;
use super::mtl::MapRequest;
use super::mtl::{MapSlot, MapStatement};
use super::source::Source;
use crate::math::{excerpt, list};
use crate::texture::{Channel, Mapping, Wrap};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::fmt;
use std::path::PathBuf;
use toml::Spanned;

/// A texture of a material: `"FILE"`, or `{ file = "FILE", … }`, or `false` for none.
///
/// serde derives functions of this name for the table (`remote`), which the implementations below call.
#[derive(Clone, Debug, Default, Deserialize, PartialEq, Serialize)]
#[serde(remote = "Self", deny_unknown_fields)]
pub struct MapSection {
    /// Whether this says that there is no texture.
    #[serde(skip)]
    pub is_none: bool,
    /// The file, relative to the scene file.
    pub file: PathBuf,
    /// Repetitions in a unit of u and v.
    #[serde(default, deserialize_with = "numbers")]
    pub scale: Option<Spanned<[f32; 2]>>,
    /// Where in it the surface's (0, 0) lies.
    #[serde(default, deserialize_with = "numbers")]
    pub offset: Option<Spanned<[f32; 2]>>,
    /// What lies beside it: `repeat`, `clamp` or `mirror`.
    pub wrap: Option<Spanned<String>>,
    /// Channel that a map of numbers takes, by the names of `-imfchan`.
    pub channel: Option<Spanned<String>>,
    /// Added to its values.
    pub base: Option<Spanned<f32>>,
    /// Factor of its values.
    pub gain: Option<Spanned<f32>>,
    /// Factor of heights, and of the slopes of a normal map.
    pub height: Option<Spanned<f32>>,
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
                Ok(MapSection {
                    file: name.into(),
                    ..MapSection::default()
                })
            }

            fn visit_bool<E: de::Error>(self, is_there: bool) -> Result<MapSection, E> {
                match is_there {
                    true => Err(de::Error::invalid_value(Unexpected::Bool(true), &self)),
                    false => Ok(MapSection {
                        is_none: true,
                        ..MapSection::default()
                    }),
                }
            }

            // A derived choice between both would not say which key is unknown.
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<MapSection, A::Error> {
                MapSection::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(FileOrTable)
    }
}

impl Serialize for MapSection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.is_none {
            return serializer.serialize_bool(false);
        }
        let plain = Self {
            file: self.file.clone(),
            ..Self::default()
        };
        match *self == plain {
            true => self.file.serialize(serializer),
            false => Self::serialize(self, serializer),
        }
    }
}

/// Each way of wrapping by its name.
const WRAPS: &[(&str, Wrap)] = &[
    ("repeat", Wrap::Repeat),
    ("clamp", Wrap::Clamp),
    ("mirror", Wrap::Mirror),
];

/// All ways of wrapping by their names.
pub(super) fn wrap_names() -> Vec<&'static str> {
    WRAPS.iter().map(|(name, _)| *name).collect()
}

impl MapSection {
    /// The picture `file`, which lies on the surface as `mapping` says.
    pub(super) fn of(file: PathBuf, mapping: &Mapping) -> Self {
        fn said<T>(value: T) -> Option<Spanned<T>> {
            Some(Spanned::new(0..0, value))
        }
        let default = Mapping::default();
        let number = |value: f32, default: f32| said(value).filter(|_| value != default);
        let name_of = |name: Option<&str>| name.and_then(|name| said(name.to_string()));
        let wrap = WRAPS.iter().find(|(_, wrap)| *wrap == mapping.wrap);
        let channel = Channel::NAMES.iter().find(|(_, c)| Some(*c) == mapping.channel);
        Self {
            is_none: false,
            file,
            scale: said(mapping.scale.to_array()).filter(|_| mapping.scale != default.scale),
            offset: said(mapping.offset.to_array()).filter(|_| mapping.offset != default.offset),
            wrap: name_of(wrap.filter(|_| mapping.wrap != default.wrap).map(|(name, _)| *name)),
            channel: name_of(channel.map(|(name, _)| *name)),
            base: number(mapping.base, default.base),
            gain: number(mapping.gain, default.gain),
            height: number(mapping.bump, default.bump),
        }
    }

    /// Asks for the texture, for `slot` of the material `name`; `section`, which is this, knows its place in `file`.
    pub(super) fn request(
        section: &Spanned<Self>,
        slot: MapSlot,
        name: &str,
        file: &Source,
    ) -> Result<MapRequest, FileError> {
        let map = section.get_ref();
        let numbers = [&map.base, &map.gain, &map.height].into_iter().flatten();
        let numbers = numbers.map(|n| (n.span(), vec![*n.get_ref()]));
        let pairs = [&map.scale, &map.offset].into_iter().flatten();
        let pairs = pairs.map(|pair| (pair.span(), pair.get_ref().to_vec()));
        if let Some((span, values)) = numbers.chain(pairs).find(|(_, v)| !v.iter().all(|n| n.is_finite())) {
            let message = format!(
                "material `{}`: a number of a texture is {}",
                excerpt(name),
                list(&values)
            );
            return Err(file.error(span, message).help("write finite numbers"));
        }
        let default = Mapping::default();
        let number = |given: &Option<Spanned<f32>>, default| given.as_ref().map_or(default, |n| *n.get_ref());
        let mapping = Mapping {
            scale: map.scale.as_ref().map_or(default.scale, |s| (*s.get_ref()).into()),
            offset: map.offset.as_ref().map_or(default.offset, |o| (*o.get_ref()).into()),
            wrap: named(&map.wrap, WRAPS, "wrap", name, file)?.unwrap_or_default(),
            channel: named(&map.channel, Channel::NAMES, "channel", name, file)?,
            base: number(&map.base, default.base),
            gain: number(&map.gain, default.gain),
            bump: number(&map.height, default.bump),
        };
        let statement = MapStatement {
            whole_file: None,
            slot,
            file: map.file.to_string_lossy().into_owned(),
            mapping,
            ignored: Vec::new(),
        };
        let place = file.error(section.span(), "");
        Ok(MapRequest {
            statement,
            place,
            is_literal: true,
            path: None,
        })
    }
}

/// What the key `key` names, of `names`.
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
                excerpt(material),
                excerpt(word.get_ref())
            );
            let all: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
            Err(file
                .error(word.span(), message)
                .help(format!("choose among {}", all.join(", "))))
        }
    }
}
