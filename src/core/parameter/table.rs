//! The macro `parameters!`, which defines options once, for flags, scene files, documentation and
//! checks; and its types.

use super::value::expected;
use super::{Entry, Input, InvalidOption, Value, nearest};

/// A parameter that a user can set: its description for flags, keys of scene files, documentation
/// and messages.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key in a scene file: words joined by `_`.
    pub key: &'static str,
    /// Help: one line, then optional lines for the documentation.
    help: &'static str,
    /// Name of the flag if it differs from the key; empty without a flag.
    named_flag: Option<&'static str>,
    /// Value of a flag without a value.
    pub bare: Option<&'static str>,
    /// Placeholder of the value in the list of flags.
    pub placeholder: &'static str,
    /// Default value, or a description of its dependence.
    default: fn() -> String,
    names: fn() -> Vec<&'static str>,
    range: fn() -> String,
    schema: fn() -> serde_json::Value,
}

impl Parameter {
    /// The parameter of an entry of `parameters!`.
    pub(crate) const fn define(
        (key, help): (&'static str, &'static str),
        (named_flag, bare): (Option<&'static str>, Option<&'static str>),
        placeholder: &'static str,
        default: fn() -> String,
        names: fn() -> Vec<&'static str>,
        range: fn() -> String,
        schema: fn() -> serde_json::Value,
    ) -> Self {
        Self {
            key,
            help,
            named_flag,
            bare,
            placeholder,
            default,
            names,
            range,
            schema,
        }
    }

    /// A key of a scene file without a flag.
    pub const fn of_section(
        key_and_help: (&'static str, &'static str),
        default: fn() -> String,
        names: fn() -> Vec<&'static str>,
        range: fn() -> String,
        schema: fn() -> serde_json::Value,
    ) -> Self {
        Self::define(key_and_help, (None, None), "", default, names, range, schema)
    }

    /// Returns true if the parameter has a flag.
    pub fn has_flag(&self) -> bool {
        self.named_flag != Some("")
    }

    /// Name of the flag: the key with `-` for `_`, except for a few; empty without a flag.
    pub fn flag(&self) -> String {
        self.named_flag.map_or_else(|| self.key.replace('_', "-"), String::from)
    }

    /// Description in one line.
    pub fn help(&self) -> &'static str {
        self.help.lines().next().unwrap_or_default().trim()
    }

    /// Details for the documentation; may be empty.
    pub fn detail(&self) -> String {
        let lines = self.help.lines().skip(1).map(str::trim);
        lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// Default value, or a description of its dependence.
    pub fn default(&self) -> String {
        (self.default)()
    }

    /// Names of all values; empty if values have no names.
    pub fn names(&self) -> Vec<&'static str> {
        (self.names)()
    }

    /// Range of a number, such as `from 1 to 100`; empty for any number and for named values.
    pub fn range(&self) -> String {
        (self.range)()
    }

    /// JSON Schema of the value in a scene file.
    pub fn schema(&self) -> serde_json::Value {
        (self.schema)()
    }

    /// Keys of the parameter in scene files: its key, and its flag if it has another name.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        [self.key]
            .into_iter()
            .chain(self.named_flag.filter(|flag| !flag.is_empty()))
    }

    /// Returns true if `key` is the parameter's key or flag name.
    pub fn is_called(&self, key: &str) -> bool {
        self.keys().any(|known| known == key)
    }
}

/// Options of one group that a user has set; unset options are `None`.
pub trait OptionGroup: Default {
    /// All parameters, in the order of the documentation.
    const PARAMETERS: &'static [Parameter];
    /// Title of their flags; empty for general flags.
    const HEADING: &'static str;

    /// Sets the parameter with the name `key`; `None` if this group has no such parameter.
    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>>;

    /// Values that are set here, and values of `other` for unset ones.
    fn or(self, other: Self) -> Self;

    /// Keys of the parameters that are set.
    fn given(&self) -> Vec<&'static str>;

    /// Keys and values of the parameters that are set, as in scene files.
    fn entries(&self) -> Vec<Entry>;

    /// The first value out of its range.
    fn invalid(&self) -> Option<InvalidOption>;
}

/// Parses a value of `parameter`.
pub(crate) fn read<T: Value>(
    parameter: &Parameter,
    input: Input,
    check: impl FnOnce(T) -> bool,
) -> Result<T, InvalidOption> {
    let value = match input {
        Input::Flag(text) => T::of_text(text),
        // Numbers are written without quotes.
        Input::String(text) => T::of_text(text).filter(|_| T::IS_STRING && !super::entry::is_number::<T>(text)),
        Input::Number(text) => T::of_text(text).filter(|_| T::IS_NUMBER),
        Input::List(text) => T::of_text(text).filter(|_| T::IS_LIST),
        Input::Other(_) => None,
    };
    value.filter(|&value| check(value)).ok_or_else(|| {
        let (Input::Flag(text) | Input::String(text) | Input::Number(text) | Input::List(text) | Input::Other(text)) =
            input;
        let advice = expected::<T>(&parameter.range());
        InvalidOption {
            key: parameter.key,
            flag: parameter.flag(),
            value: input.written(),
            help: match nearest(text, T::names()) {
                Some(name) => format!("did you mean {name}? {advice}"),
                None => advice,
            },
        }
    })
}

/// The error for `value` of `parameter`, unless `is_valid`.
pub(crate) fn check<T: Value>(parameter: &Parameter, value: T, is_valid: bool) -> Option<InvalidOption> {
    (!is_valid).then(|| InvalidOption {
        key: parameter.key,
        flag: parameter.flag(),
        value: value.text(),
        help: expected::<T>(&parameter.range()),
    })
}

/// `schema` with the keywords `bounds` added or replaced.
pub(crate) fn bounded(
    mut schema: serde_json::Value,
    bounds: Vec<(&'static str, serde_json::Value)>,
) -> serde_json::Value {
    for (keyword, value) in bounds {
        schema[keyword] = value;
    }
    schema
}

/// Defines a struct of options with all properties of each.
///
/// ```text
/// parameters! {
///     /// Subject of the group.
///     pub struct NAME, heading "TITLE OVER THEIR FLAGS", values MODULE {
///         /// Help in one line.
///         ///
///         /// Details for the documentation only.
///         key: TYPE = DEFAULT, in RANGE;
///         /// An option with a default in words.
///         key: TYPE, default "what it depends on", in RANGE;
///         /// An option whose flag has another name (`""`: no flag) and an optional value.
///         key: TYPE = DEFAULT, flag "name", bare "value";
///     }
/// }
/// ```
///
/// Fields are `Option`s, `None` if unset. A method with the same name returns the value or its
/// default. `MODULE` has the type of each value by its key. Its module `resolved` has the type that
/// methods return: an `Option` only if there is no default.
macro_rules! parameters {
    ($(#[$attribute:meta])* pub struct $group:ident, heading $heading:literal, values $values:ident {
        $($(#[doc = $doc:literal])+ $key:ident: $ty:ty $(= $value:expr)? $(, default $words:literal)? $(, in $range:expr)?
            $(, flag $flag:literal)? $(, bare $bare:literal)?;)+
    }) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $group {
            $($(#[doc = $doc])+ pub $key: Option<$ty>,)+
        }

        impl $group {
            $($(#[doc = $doc])+
            #[doc = ""]
            #[doc = "What was set, or the default."]
            pub fn $key(&self) -> $values::resolved::$key {
                parameters!(@resolve self.$key $(, $value)?)
            })+
        }

        impl $crate::parameter::OptionGroup for $group {
            const HEADING: &'static str = $heading;
            const PARAMETERS: &'static [$crate::parameter::Parameter] = &[$($crate::parameter::Parameter::define(
                (stringify!($key), concat!($($doc, "\n"),+)),
                (parameters!(@option $($flag)?), parameters!(@option $($bare)?)),
                <$ty as $crate::parameter::Value>::PLACEHOLDER,
                || parameters!(@default $ty $(, $value)? $(; $words)?),
                <$ty as $crate::parameter::Value>::names,
                || parameters!(@range $ty $(, $range)?).to_string(),
                || parameters!(@schema $ty $(, $range)?),
            )),+];

            fn set(
                &mut self,
                key: &str,
                input: $crate::parameter::Input,
            ) -> Option<Result<(), $crate::parameter::InvalidOption>> {
                let parameter = Self::PARAMETERS.iter().find(|parameter| parameter.is_called(key))?;
                $(if parameter.key == stringify!($key) {
                    let value = $crate::parameter::read::<$ty>(parameter, input, |_value| parameters!(@valid $ty, _value $(, $range)?));
                    return Some(value.map(|value| self.$key = Some(value)));
                })+
                None
            }

            fn or(self, other: Self) -> Self {
                Self {
                    $($key: self.$key.or(other.$key),)+
                }
            }

            fn given(&self) -> Vec<&'static str> {
                let given = [$((stringify!($key), self.$key.is_some())),+];
                given.iter().filter(|(_, is_given)| *is_given).map(|(key, _)| *key).collect()
            }

            fn entries(&self) -> Vec<$crate::parameter::Entry> {
                let all = [$(self.$key.map(|value| $crate::parameter::Entry::of::<$ty>(stringify!($key), value))),+];
                all.into_iter().flatten().collect()
            }

            fn invalid(&self) -> Option<$crate::parameter::InvalidOption> {
                let mut parameters = Self::PARAMETERS.iter();
                $({
                    let parameter = parameters.next()?;
                    let invalid = self.$key.and_then(|_value| {
                        $crate::parameter::check::<$ty>(parameter, _value, parameters!(@valid $ty, _value $(, $range)?))
                    });
                    if invalid.is_some() {
                        return invalid;
                    }
                })+
                None
            }
        }

        /// Types of the values, by their keys.
        #[allow(non_camel_case_types, dead_code)]
        pub mod $values {
            #[allow(unused_imports)]
            use super::*;
            $(#[doc = concat!("Of `", stringify!($key), "`.")]
            pub type $key = $ty;)+

            /// Types of the values with defaults applied: an `Option` if there is no default.
            pub mod resolved {
                #[allow(unused_imports)]
                use super::super::*;
                $(#[doc = concat!("Of `", stringify!($key), "`.")]
                pub type $key = parameters!(@resolved $ty $(, $value)?);)+
            }
        }
    };
    (@resolved $ty:ty, $value:expr) => { $ty };
    (@resolved $ty:ty) => { Option<$ty> };
    (@resolve $given:expr, $value:expr) => { $given.unwrap_or($value) };
    (@resolve $given:expr) => { $given };
    (@option $text:literal) => { Some($text) };
    (@option) => { None };
    (@default $ty:ty, $value:expr) => { <$ty as $crate::parameter::Value>::text(&$value) };
    (@default $ty:ty $(, $value:expr)?; $words:literal) => { $words.to_string() };
    (@default $ty:ty) => { String::new() };
    (@range $ty:ty, $range:expr) => {{ let range: $crate::parameter::Range<$ty> = $range; range }};
    (@range $ty:ty) => { "" };
    (@schema $ty:ty $(, $range:expr)?) => {{
        let schema = <$ty as $crate::parameter::Value>::schema();
        $(let schema = $crate::parameter::bounded(schema, <$crate::parameter::Range<$ty>>::schema($range));)?
        schema
    }};
    (@valid $ty:ty, $value:expr, $range:expr) => {{ let range: $crate::parameter::Range<$ty> = $range; range.contains($value) }};
    (@valid $ty:ty, $value:expr) => { $crate::parameter::Value::is_finite(&$value) };
}
pub(crate) use parameters;
