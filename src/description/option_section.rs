use super::unknown_key::unknown_key;
use super::{FileError, SceneFile};
use crate::options::{Input, InvalidOption, OptionGroup, Parameter};
use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use toml::Spanned;

/// A section of a scene file that sets parameters: keys and values as they were written.
#[derive(Debug, Default, Deserialize)]
#[serde(transparent)]
pub(super) struct OptionSection(BTreeMap<Spanned<String>, Spanned<Scalar>>);

/// A value as it was written.
#[derive(Debug)]
enum Scalar {
    String(String),
    Number(String),
    List(Vec<Scalar>),
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
            Self::List(_) => Input::Other("a list"),
            Self::Other(text) => Input::Other(text),
        }
    }
}

/// A group of options, whichever it is.
pub(super) trait AnyGroup {
    fn parameters(&self) -> &'static [Parameter];
    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>>;
}

impl<G: OptionGroup> AnyGroup for G {
    fn parameters(&self) -> &'static [Parameter] {
        G::PARAMETERS
    }

    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>> {
        OptionGroup::set(self, key, input)
    }
}

impl OptionSection {
    /// The value of `key`, a string or a list of strings, and its place; `None` for a string in the list that is none.
    pub fn strings(&self, key: &str) -> Option<(Option<Vec<&str>>, Range<usize>)> {
        let (_, value) = self.0.iter().find(|(name, _)| name.get_ref() == key)?;
        let strings = match value.get_ref() {
            Scalar::List(list) => list.iter().map(Scalar::string).collect(),
            scalar => scalar.string().map(|text| vec![text]),
        };
        Some((strings, value.span()))
    }

    /// Sets in `groups` what the section `name` of `file` says, but for the keys `others`. An error comes with the byte of the file that it is about.
    pub fn read(
        &self,
        name: &str,
        file: &SceneFile,
        groups: &mut [&mut dyn AnyGroup],
        others: &[&'static str],
    ) -> Result<(), (FileError, usize)> {
        let mut seen = BTreeSet::new();
        for (key, value) in self
            .0
            .iter()
            .filter(|(key, _)| !others.contains(&key.get_ref().as_str()))
        {
            // A parameter with two names
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
                    let error = file.error(span.clone(), format!("{} = {written}", key.get_ref()));
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

impl<'de> Deserialize<'de> for Scalar {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Written;
        impl<'de> Visitor<'de> for Written {
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
                Ok(Scalar::List(scalars))
            }

            fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<Scalar, A::Error> {
                while table.next_entry::<IgnoredAny, IgnoredAny>()?.is_some() {}
                Ok(Scalar::Other("a table"))
            }
        }
        deserializer.deserialize_any(Written)
    }
}
