//! The macro `section!` defines the keys of a section of a scene file once. It derives reading and
//! writing, the JSON Schema, the rows of the reference, and the places of values.

use super::exact_list::ExactList;
use super::key_schema::{COLOR_TEXT, closed, described, either, list};
use super::{ChannelValues, ColorValue};
use crate::options::{Parameter, Range};
use serde::de::MapAccess;
use serde::{Deserialize, Deserializer};
use serde_json::{Value, json};
use std::path::PathBuf;
use toml::Spanned;

/// A section of a scene file.
pub(crate) trait Section: Sized {
    /// All keys in the order of the reference.
    const KEYS: &'static [Parameter];
    /// Keys that a file must give.
    const REQUIRED: &'static [&'static str];

    /// Keys that the file has.
    fn given(&self) -> Vec<PresentKey<'_>>;

    /// Sets all keys that `other` has, and replaces old values.
    fn set_over(&mut self, other: Self);

    /// Reads the value of an optional `key` from `table`. Returns false if the section does not
    /// have the key.
    fn read_key<'de, A: MapAccess<'de>>(&mut self, key: &str, table: &mut A) -> Result<bool, A::Error>;

    /// Span of a key's value, if the file has the key.
    fn span_of(&self, key: &str) -> Option<std::ops::Range<usize>> {
        let mut given = self.given().into_iter();
        given.find(|given| given.key == key).map(|given| given.span)
    }
}

/// A key that the file has.
pub(crate) struct PresentKey<'a> {
    pub key: &'static str,
    /// Span of the value in the file.
    pub span: std::ops::Range<usize>,
    /// All numbers in the value of the key.
    pub numbers: &'a [f32],
    /// Range in which each number must be.
    pub range: Range<f32>,
}

/// Type of the value of a key.
pub(crate) trait KeyType: Sized {
    /// Reads a value of this type.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;

    /// JSON Schema of the type. `number` is the schema of each number in a value.
    fn schema(number: Value) -> Value;

    /// Numbers in the value that must be in the range of the key.
    fn numbers(&self) -> &[f32] {
        &[]
    }
}

/// Schema of a section as a table.
pub(crate) fn table<S: Section>(description: Option<&str>) -> Value {
    let properties = S::KEYS.iter().map(|key| (key.key.into(), described(key)));
    closed(description, properties.collect(), S::REQUIRED)
}

/// Value of a key, if the file has it.
pub(crate) fn value<T: Copy>(key: &Option<Spanned<T>>) -> Option<T> {
    key.as_ref().map(|value| *value.get_ref())
}

/// Reads the value of an optional key with its span.
pub(crate) fn optional<'de, T: KeyType, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Spanned<T>>, D::Error> {
    let read = Option::<Spanned<TypedValue<T>>>::deserialize(deserializer)?;
    Ok(read.map(|value| Spanned::new(value.span(), value.into_inner().0)))
}

/// Reads the value of a required key with its span.
pub(crate) fn required<'de, T: KeyType, D: Deserializer<'de>>(deserializer: D) -> Result<Spanned<T>, D::Error> {
    let value = Spanned::<TypedValue<T>>::deserialize(deserializer)?;
    Ok(Spanned::new(value.span(), value.into_inner().0))
}

/// Value of an optional key with its span.
pub(crate) struct Optional<T>(pub Option<Spanned<T>>);

impl<'de, T: KeyType> Deserialize<'de> for Optional<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        optional(deserializer).map(Self)
    }
}

/// A value read by its [`KeyType`].
struct TypedValue<T>(T);

impl<'de, T: KeyType> Deserialize<'de> for TypedValue<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        T::read(deserializer).map(Self)
    }
}

/// Implements [`KeyType`] for types that serde reads.
macro_rules! key_types {
    ($($ty:ty: |$number:ident| $schema:expr $(, numbers |$value:ident| $numbers:expr)?;)+) => {
        $(impl $crate::scene_file::section::KeyType for $ty {
            fn read<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                serde::Deserialize::deserialize(deserializer)
            }

            fn schema($number: serde_json::Value) -> serde_json::Value {
                $schema
            }

            $(fn numbers(&self) -> &[f32] {
                let $value = self;
                $numbers
            })?
        })+
    };
}
pub(crate) use key_types;

key_types! {
    f32: |number| number, numbers |value| std::slice::from_ref(value);
    u32: |_number| json!({ "type": "integer", "minimum": 0 });
    bool: |_number| json!({ "type": "boolean" });
    String: |_number| json!({ "type": "string" });
    PathBuf: |_number| json!({ "type": "string" });
    ColorValue: |number| either(&[number.clone(), list(3, number), json!({ "$ref": COLOR_TEXT })]), numbers |value| &value.0;
    ChannelValues: |number| either(&[number.clone(), list(3, number)]), numbers |value| &value.0;
}

impl<const N: usize> KeyType for [f32; N]
where
    ExactList<Self>: for<'de> Deserialize<'de>,
{
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ExactList::deserialize(deserializer).map(|list| list.0)
    }

    fn schema(number: Value) -> Value {
        list(N, number)
    }

    fn numbers(&self) -> &[f32] {
        self
    }
}

/// Rows of a matrix.
impl KeyType for [[f32; 4]; 4] {
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rows = ExactList::<[ExactList<[f32; 4]>; 4]>::deserialize(deserializer)?;
        Ok(rows.0.map(|row| row.0))
    }

    fn schema(number: Value) -> Value {
        list(4, list(4, number))
    }
}

/// Range of a key: a range, or a function that returns the range for the name of a key.
pub(crate) trait RangeOf {
    /// Range of the values of `key`.
    fn range_of(self, key: &str) -> Range<f32>;
}

impl RangeOf for Range<f32> {
    fn range_of(self, _: &str) -> Range<f32> {
        self
    }
}

impl<F: FnOnce(&str) -> Range<f32>> RangeOf for F {
    fn range_of(self, key: &str) -> Range<f32> {
        self(key)
    }
}

/// Defines a section of scene files by its keys.
///
/// ```text
/// section! {
///     /// Subject of the section.
///     pub struct NAME {
///         required {
///             /// Help in one line.
///             key: TYPE;
///         }
///         /// Help in one line.
///         ///
///         /// Further text for the reference.
///         key: TYPE, default "description of the default", in RANGE;
///         /// A key whose values are names.
///         key: String, names &["a", "b"];
///         /// A key whose schema does not follow from its type.
///         key: TYPE, schema JSON;
///     }
/// }
/// ```
///
/// Each field has the value of its key with the span in the file, or `None` if the key is left out.
/// Types implement [`KeyType`]. `RANGE` applies to each number in a value ([`RangeOf`]).
macro_rules! section {
    ($(#[$attribute:meta])* pub struct $section:ident {
        required {
            $($(#[doc = $required_doc:literal])+ $required:ident $(as $name:literal)?: $required_ty:ty
                $(, schema $required_schema:expr)?;)*
        }
        $($(#[doc = $doc:literal])+ $key:ident: $ty:ty $(, default $default:literal)? $(, in $range:expr)?
            $(, names $names:expr)? $(, schema $schema:expr)?;)*
    }) => {
        #[derive(Clone, Debug, serde::Deserialize, serde::Serialize)]
        $(#[$attribute])*
        #[serde(deny_unknown_fields)]
        pub struct $section {
            $($(#[doc = $required_doc])+
            #[serde($(rename = $name,)? deserialize_with = "crate::scene_file::section::required")]
            pub $required: toml::Spanned<$required_ty>,)*
            $($(#[doc = $doc])+
            #[serde(default, deserialize_with = "crate::scene_file::section::optional")]
            pub $key: Option<toml::Spanned<$ty>>,)*
        }

        impl $section {
            /// A section with the required keys only.
            pub fn new($($required: toml::Spanned<$required_ty>),*) -> Self {
                Self { $($required,)* $($key: None),* }
            }
        }

        impl $crate::scene_file::section::Section for $section {
            const KEYS: &'static [crate::options::Parameter] = &[
                $(crate::options::Parameter::of_section(
                    (section!(@name $required $(, $name)?), concat!($($required_doc, "\n"),+)),
                    || "required".into(),
                    Vec::new,
                    String::new,
                    || section!(@schema $required_ty, crate::options::Range::Any $(, schema $required_schema)?),
                ),)*
                $(crate::options::Parameter::of_section(
                    (stringify!($key), concat!($($doc, "\n"),+)),
                    || section!(@default $($default)?).into(),
                    || section!(@names $($names)?).to_vec(),
                    || section!(@range stringify!($key) $(, $range)?).to_string(),
                    || section!(@schema $ty, section!(@range stringify!($key) $(, $range)?)
                        $(, names $names)? $(, schema $schema)?),
                ),)*
            ];
            const REQUIRED: &'static [&'static str] = &[$(section!(@name $required $(, $name)?)),*];

            fn given(&self) -> Vec<$crate::scene_file::section::PresentKey<'_>> {
                let required: Vec<$crate::scene_file::section::PresentKey<'_>> = vec![
                    $($crate::scene_file::section::PresentKey {
                        key: section!(@name $required $(, $name)?),
                        span: self.$required.span(),
                        numbers: &[],
                        range: crate::options::Range::Any,
                    }),*
                ];
                let optional: Vec<Option<$crate::scene_file::section::PresentKey<'_>>> = vec![
                    $(self.$key.as_ref().map(|value| $crate::scene_file::section::PresentKey {
                        key: stringify!($key),
                        span: value.span(),
                        numbers: $crate::scene_file::section::KeyType::numbers(value.get_ref()),
                        range: section!(@range stringify!($key) $(, $range)?),
                    })),*
                ];
                required.into_iter().chain(optional.into_iter().flatten()).collect()
            }

            #[allow(unused_variables, reason = "some sections have no optional key")]
            fn set_over(&mut self, other: Self) {
                $(self.$key = other.$key.or(self.$key.take());)*
            }

            #[allow(unused_variables, reason = "some sections have no optional key")]
            fn read_key<'de, A: serde::de::MapAccess<'de>>(
                &mut self,
                key: &str,
                table: &mut A,
            ) -> Result<bool, A::Error> {
                match key {
                    $(stringify!($key) => {
                        self.$key = table.next_value::<$crate::scene_file::section::Optional<$ty>>()?.0;
                        Ok(true)
                    })*
                    _ => Ok(false),
                }
            }
        }
    };
    (@name $key:ident, $name:literal) => { $name };
    (@name $key:ident) => { stringify!($key) };
    (@default $default:literal) => { $default };
    (@default) => { "" };
    (@names $names:expr) => { $names };
    (@names) => { [] };
    (@range $key:expr, $range:expr) => { $crate::scene_file::section::RangeOf::range_of($range, $key) };
    (@range $key:expr) => { crate::options::Range::<f32>::Any };
    (@schema $ty:ty, $range:expr, names $names:expr) => { serde_json::json!({ "enum": $names }) };
    (@schema $ty:ty, $range:expr, schema $schema:expr) => { $schema };
    (@schema $ty:ty, $range:expr) => {
        <$ty as $crate::scene_file::section::KeyType>::schema($crate::scene_file::key_schema::number($range))
    };
}
pub(crate) use section;
