//! Types of values in scene files that have one number for each colour channel.

use super::exact_list::ExactList;
use crate::color::{Spectrum, WRITTEN_COLORS};
use crate::math::excerpt;
use crate::options::nearest;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Colour in a scene file, linear Rec.709. It is written as three numbers, as one number for a
/// grey, as `"#rrggbb"` in sRGB, or as a CSS name.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ColorValue(pub [f32; 3]);

/// One value for each colour channel. The values are not a colour, but for example indices of
/// refraction. They are written as three numbers, or as one number for all channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ChannelValues(pub [f32; 3]);

impl<'de> Deserialize<'de> for ColorValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Channels { is_color: true }).map(Self)
    }
}

impl<'de> Deserialize<'de> for ChannelValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Channels { is_color: false }).map(Self)
    }
}

/// Deserialiser of values for three channels.
struct Channels {
    /// True if colour strings are allowed.
    is_color: bool,
}

impl<'de> Visitor<'de> for Channels {
    type Value = [f32; 3];

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_color {
            write!(f, "a colour: {WRITTEN_COLORS}")
        } else {
            write!(f, "a number or three numbers")
        }
    }

    fn visit_f64<E: de::Error>(self, grey: f64) -> Result<[f32; 3], E> {
        Ok([grey as f32; 3])
    }

    fn visit_i64<E: de::Error>(self, grey: i64) -> Result<[f32; 3], E> {
        Ok([grey as f32; 3])
    }

    fn visit_u64<E: de::Error>(self, grey: u64) -> Result<[f32; 3], E> {
        Ok([grey as f32; 3])
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<[f32; 3], E> {
        if !self.is_color {
            return Err(E::invalid_type(Unexpected::Str(text), &self));
        }
        let unknown = || match nearest(&text.to_ascii_lowercase(), Spectrum::names()) {
            Some(near) => E::custom(format!(
                "unknown colour \"{}\", did you mean \"{near}\"?",
                excerpt(text)
            )),
            None => E::invalid_type(Unexpected::Str(text), &self),
        };
        Spectrum::of_text(text)
            .map(|color| color.to_array())
            .ok_or_else(unknown)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, numbers: A) -> Result<[f32; 3], A::Error> {
        ExactList::deserialize(SeqAccessDeserializer::new(numbers)).map(|list| list.0)
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<[f32; 3], A::Error> {
        de::IgnoredAny::deserialize(MapAccessDeserializer::new(table))?;
        Err(de::Error::invalid_type(Unexpected::Map, &self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct Keys {
        color: Option<ColorValue>,
        eta: Option<ChannelValues>,
    }

    fn keys(text: &str) -> Result<Keys, String> {
        toml::from_str(text).map_err(|error: toml::de::Error| error.message().to_string())
    }

    #[test]
    fn colors_are_numbers_codes_and_names() {
        for (text, expected) in [
            ("0.5", [0.5; 3]),
            ("1", [1.0; 3]),
            ("[0.1, 2, 0.3]", [0.1, 2.0, 0.3]),
            ("'#ffc356'", Spectrum::of_text("#ffc356").unwrap().to_array()),
            ("'Orange'", Spectrum::of_text("#ffa500").unwrap().to_array()),
            ("'0.5'", [0.5; 3]),
        ] {
            let color = keys(&format!("color = {text}")).ok().unwrap().color.unwrap();
            assert_eq!(color.0, expected, "{text}");
        }
        assert!(
            keys("color = 'ornage'")
                .err()
                .unwrap()
                .contains("did you mean \"orange\"?")
        );
        for wrong in ["'#12'", "[1, 2]", "true", "{ r = 1 }", "''"] {
            assert!(keys(&format!("color = {wrong}")).is_err(), "{wrong}");
        }
    }

    #[test]
    fn channels_have_no_names() {
        assert_eq!(keys("eta = 0.5").ok().unwrap().eta.unwrap().0, [0.5; 3]);
        assert!(
            keys("eta = 'gold'")
                .err()
                .unwrap()
                .contains("a number or three numbers")
        );
    }
}
