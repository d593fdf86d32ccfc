//! The macro `parameters!`, and its types. The macro defines an option once, for flags, scene
//! files, documentation and checks.

use super::value::expected;
use super::{Entry, Input, InvalidOption, Value, nearest};

/// A parameter that a user can set, with its description for flags, keys of scene files,
/// documentation and messages.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key in a scene file: words joined by `_`.
    pub key: &'static str,
    /// Help text: a line for flags, then optional lines for the documentation only.
    help: &'static str,
    /// Name of the flag, if it differs from the key. Empty if there is no flag.
    named_flag: Option<&'static str>,
    /// Value of the parameter if the flag is given without a value.
    pub bare: Option<&'static str>,
    /// Placeholder of the value in the help of the flag.
    pub placeholder: &'static str,
    /// Returns the default value as text, or a description of the values on which the default
    /// depends.
    default: fn() -> String,
    names: fn() -> Vec<&'static str>,
    range: fn() -> String,
    schema: fn() -> serde_json::Value,
}

impl Parameter {
    /// Makes the parameter of an entry in `parameters!`.
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

    /// Makes the parameter of a key in a scene file that has no flag.
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

    /// Name of the flag: the key with `-` instead of `_`, except for a few flags with other names.
    /// Empty if there is no flag.
    pub fn flag(&self) -> String {
        self.named_flag.map_or_else(|| self.key.replace('_', "-"), String::from)
    }

    /// Help text in one line.
    pub fn help(&self) -> &'static str {
        self.help.lines().next().unwrap_or_default().trim()
    }

    /// Further help text for the documentation. It may be empty.
    pub fn detail(&self) -> String {
        let lines = self.help.lines().skip(1).map(str::trim);
        lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// Default value as text, or a description of the values on which the default depends.
    pub fn default(&self) -> String {
        (self.default)()
    }

    /// Names of all values. Empty if the values of the parameter have no names.
    pub fn names(&self) -> Vec<&'static str> {
        (self.names)()
    }

    /// Range of valid numbers as text, such as `from 1 to 100`. Empty if all numbers are valid, or
    /// if the values have names.
    pub fn range(&self) -> String {
        (self.range)()
    }

    /// JSON Schema of the value in a scene file.
    pub fn schema(&self) -> serde_json::Value {
        (self.schema)()
    }

    /// Keys of the parameter in scene files: its key, and the name of its flag if it differs.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        [self.key]
            .into_iter()
            .chain(self.named_flag.filter(|flag| !flag.is_empty()))
    }

    /// Returns true if `key` is the parameter's key or the name of its flag.
    pub fn is_called(&self, key: &str) -> bool {
        self.keys().any(|known| known == key)
    }
}

/// Options of one group that a user has set; unset options are `None`.
pub trait OptionGroup: Default {
    /// All parameters, in the order of the documentation.
    const PARAMETERS: &'static [Parameter];
    /// Title above the flags of the group in the help. Empty for general flags.
    const HEADING: &'static str;

    /// Sets the parameter called `key` to the value `input`. `None` if the group has no such
    /// parameter.
    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>>;

    /// Combines two groups: options that are not set in `self` are taken from `other`.
    fn or(self, other: Self) -> Self;

    /// Keys of the parameters that are set.
    fn given(&self) -> Vec<&'static str>;

    /// Keys and values of the parameters that are set, as scene files write them.
    fn entries(&self) -> Vec<Entry>;

    /// Error of the first value that is out of its range.
    fn invalid(&self) -> Option<InvalidOption>;
}

/// Parses `input` as a value of `parameter`.
pub(crate) fn read<T: Value>(
    parameter: &Parameter,
    input: Input,
    check: impl FnOnce(T) -> bool,
) -> Result<T, InvalidOption> {
    let value = match input {
        Input::Flag(text) => T::of_text(text),
        // Reject strings that are numbers: numbers must be written without quotes
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

/// Returns the error about `value` of `parameter`, if `is_valid` is false.
pub(crate) fn check<T: Value>(parameter: &Parameter, value: T, is_valid: bool) -> Option<InvalidOption> {
    (!is_valid).then(|| InvalidOption {
        key: parameter.key,
        flag: parameter.flag(),
        value: value.text(),
        help: expected::<T>(&parameter.range()),
    })
}

/// Adds the keywords `bounds` to `schema`, or replaces them.
pub(crate) fn bounded(
    mut schema: serde_json::Value,
    bounds: Vec<(&'static str, serde_json::Value)>,
) -> serde_json::Value {
    for (keyword, value) in bounds {
        schema[keyword] = value;
    }
    schema
}

/// Defines a struct of options. The entry of an option has all its properties.
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
/// A field is `None` if its option is not set. The method with the same name returns the value, or
/// the default if the option is not set. `MODULE` has a type alias for the value of each option,
/// with the name of its key. The module `resolved` in `MODULE` has aliases for the types that the
/// methods return: an `Option` only if the option has no default value.
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

        /// Types of the values. Each alias has the name of the option's key.
        #[allow(non_camel_case_types, dead_code)]
        pub mod $values {
            #[allow(unused_imports)]
            use super::*;
            $(#[doc = concat!("Of `", stringify!($key), "`.")]
            pub type $key = $ty;)+

            /// Types of the values after defaults were applied: an `Option` if the option has no
            /// default value.
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
