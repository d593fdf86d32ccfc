//! Sections that set parameters (`options`): the keys and values as written, and the options read
//! from them.

use super::scene_options::AnyGroup;
use super::source::Source;
use super::unknown_key::unknown_key;
use super::{FileError, InOrder};
use crate::math::excerpt;
use crate::options::{Entry, EntryKind, Input, InvalidOption};
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeSet;
use std::fmt;
use std::ops::Range;
use toml::Spanned;

/// A section of a scene file that sets parameters. It stores keys and values as written.
#[derive(Clone, Debug, Default, Deserialize, Serialize)]
#[serde(transparent)]
pub(super) struct OptionSection(InOrder<Spanned<Scalar>>);

/// Maximum number of values in a list.
const MAX_LIST: usize = 16;

/// A value as written in the scene file.
#[derive(Clone, Debug)]
enum Scalar {
    String(String),
    Number(String),
    /// Values of a list, and their text: numbers separated by commas. The text is `None` if a value
    /// is not a number, or if there are more than `MAX_LIST` values.
    List(Vec<Scalar>, Option<String>),
    Other(&'static str),
}

impl Scalar {
    fn string(&self) -> Option<&str> {
        match self {
            Self::String(text) => Some(text),
            _ => None,
        }
    }

    fn input(&self) -> Input<'_> {
        match self {
            Self::String(text) => Input::String(text),
            Self::Number(text) => Input::Number(text),
            Self::List(_, None) => Input::Other("a list"),
            Self::List(_, Some(numbers)) => Input::List(numbers),
            Self::Other(text) => Input::Other(text),
        }
    }
}

impl OptionSection {
    /// Section with all values that are set in `groups`.
    pub fn of(groups: &[&dyn AnyGroup]) -> Self {
        let entry = |entry: Entry| {
            let numbers = |text: &str| text.split(',').map(|number| Scalar::Number(number.into())).collect();
            let value = match entry.kind {
                EntryKind::Number => Scalar::Number(entry.text),
                EntryKind::String => Scalar::String(entry.text),
                EntryKind::List => Scalar::List(numbers(&entry.text), None),
            };
            (Spanned::new(0..0, entry.key.to_string()), Spanned::new(0..0, value))
        };
        let entries = groups.iter().flat_map(|group| group.entries());
        Self(InOrder(entries.map(entry).collect()))
    }

    /// Sets `key` to a list of strings. An old value of `key` is replaced.
    pub fn set_strings(&mut self, key: &str, strings: impl IntoIterator<Item = String>) {
        self.0.0.retain(|(name, _)| name.get_ref() != key);
        let list = strings.into_iter().map(Scalar::String).collect();
        let entry = (
            Spanned::new(0..0, key.to_string()),
            Spanned::new(0..0, Scalar::List(list, None)),
        );
        self.0.0.push(entry);
    }

    /// Span of the value of `key` in the file; `None` if the section does not have the key.
    pub fn span_of(&self, key: &str) -> Option<Range<usize>> {
        let mut entries = self.0.0.iter();
        entries
            .find(|(name, _)| name.get_ref() == key)
            .map(|(_, value)| value.span())
    }

    /// Returns true if the section has no keys.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Strings in the value of `key`, which is a string or a list of strings, and the span of the
    /// value. The list is `None` if an item is not a string. Returns `None` if the section does not
    /// have the key.
    pub fn strings(&self, key: &str) -> Option<(Option<Vec<&str>>, Range<usize>)> {
        let (_, value) = self.0.0.iter().find(|(name, _)| name.get_ref() == key)?;
        let strings = match value.get_ref() {
            Scalar::List(list, _) => list.iter().map(Scalar::string).collect(),
            scalar => scalar.string().map(|text| vec![text]),
        };
        Some((strings, value.span()))
    }

    /// Sets the values of `groups` from this section, which has the name `name` in `file`. Keys in
    /// `others` are ignored. Returns an error together with its byte in the file.
    pub fn read(
        &self,
        name: &str,
        file: &Source,
        groups: &mut [&mut dyn AnyGroup],
        others: &[&'static str],
    ) -> Result<(), (FileError, usize)> {
        let mut seen = BTreeSet::new();
        for (key, value) in self
            .0
            .0
            .iter()
            .filter(|(key, _)| !others.contains(&key.get_ref().as_str()))
        {
            // Find the parameter of the key, because some parameters have two names
            let parameter = groups
                .iter()
                .flat_map(|group| group.parameters())
                .find(|p| p.is_called(key.get_ref()));
            if let Some(parameter) = parameter.filter(|p| !seen.insert(p.key)) {
                let span = key.span();
                let error = file.error(span.clone(), format!("`{}` is set twice", parameter.key));
                return Err((error.help("remove one of the keys"), span.start));
            }
            let input = value.get_ref().input();
            let result = groups.iter_mut().find_map(|group| group.set(key.get_ref(), input));
            match result {
                Some(Ok(())) => {}
                Some(Err(InvalidOption {
                    value: written, help, ..
                })) => {
                    let span = value.span();
                    let error = file.error(span.clone(), format!("{} = {}", key.get_ref(), excerpt(&written)));
                    return Err((error.help(help), span.start));
                }
                None => {
                    let span = key.span();
                    let known = groups.iter().flat_map(|group| group.parameters()).map(|p| p.key);
                    let known = known.chain(others.iter().copied());
                    let (message, help) = unknown_key(key.get_ref(), name, known);
                    return Err((file.error(span.clone(), message).help(help), span.start));
                }
            }
        }
        Ok(())
    }
}

impl Serialize for Scalar {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::String(text) => serializer.serialize_str(text),
            Self::Other(text) => serializer.serialize_str(text),
            Self::List(list, _) => serializer.collect_seq(list),
            // Parse integers first: as a 32-bit float, a large integer would lose digits
            Self::Number(text) => match (text.parse::<i64>(), text.parse::<u64>(), text.parse::<f32>()) {
                (Ok(number), ..) => serializer.serialize_i64(number),
                (_, Ok(number), _) => serializer.serialize_u64(number),
                (.., Ok(number)) => serializer.serialize_f32(number),
                _ => serializer.serialize_str(text),
            },
        }
    }
}

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ScalarVisitor;
        impl<'de> Visitor<'de> for ScalarVisitor {
            type Value = Scalar;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a string or a number")
            }

            fn visit_i64<E>(self, value: i64) -> Result<Scalar, E> {
                Ok(Scalar::Number(value.to_string()))
            }

            fn visit_u64<E>(self, value: u64) -> Result<Scalar, E> {
                Ok(Scalar::Number(value.to_string()))
            }

            fn visit_i128<E>(self, value: i128) -> Result<Scalar, E> {
                Ok(Scalar::Number(value.to_string()))
            }

            fn visit_u128<E>(self, value: u128) -> Result<Scalar, E> {
                Ok(Scalar::Number(value.to_string()))
            }

            fn visit_f64<E>(self, value: f64) -> Result<Scalar, E> {
                Ok(Scalar::Number(value.to_string()))
            }

            fn visit_str<E>(self, value: &str) -> Result<Scalar, E> {
                Ok(Scalar::String(value.into()))
            }

            fn visit_bool<E>(self, value: bool) -> Result<Scalar, E> {
                Ok(Scalar::Other(if value { "true" } else { "false" }))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Scalar, A::Error> {
                let mut scalars = Vec::new();
                while let Some(scalar) = list.next_element()? {
                    scalars.push(scalar);
                }
                let number = |scalar: &Scalar| match scalar {
                    Scalar::Number(text) => Some(text.clone()),
                    _ => None,
                };
                let numbers: Option<Vec<String>> = scalars.iter().take(MAX_LIST + 1).map(number).collect();
                let numbers = numbers.filter(|numbers| numbers.len() <= MAX_LIST);
                Ok(Scalar::List(scalars, numbers.map(|numbers| numbers.join(", "))))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<Scalar, A::Error> {
                while table.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(Scalar::Other("a table"))
            }
        }
        deserializer.deserialize_any(ScalarVisitor)
    }
}
