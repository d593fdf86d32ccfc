use crate::description::exact_list::ExactList;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A colour of a scene file: three numbers, linear Rec.709, or one number for a grey.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct ColorValue(pub [f32; 3]);

impl<'de> Deserialize<'de> for ColorValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrThree;
        impl<'de> Visitor<'de> for NumberOrThree {
            type Value = ColorValue;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a number or three numbers")
            }

            fn visit_f64<E: de::Error>(self, grey: f64) -> Result<ColorValue, E> {
                Ok(ColorValue([grey as f32; 3]))
            }

            fn visit_i64<E: de::Error>(self, grey: i64) -> Result<ColorValue, E> {
                Ok(ColorValue([grey as f32; 3]))
            }

            fn visit_u64<E: de::Error>(self, grey: u64) -> Result<ColorValue, E> {
                Ok(ColorValue([grey as f32; 3]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, numbers: A) -> Result<ColorValue, A::Error> {
                ExactList::deserialize(SeqAccessDeserializer::new(numbers)).map(|list| ColorValue(list.0))
            }

            fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<ColorValue, A::Error> {
                de::IgnoredAny::deserialize(MapAccessDeserializer::new(table))?;
                Err(de::Error::invalid_type(Unexpected::Map, &self))
            }
        }
        deserializer.deserialize_any(NumberOrThree)
    }
}
