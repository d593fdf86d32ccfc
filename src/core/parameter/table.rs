//! The macro `parameters!` defines options once, for flags, scene files, documentation and checks. Its types are here too.

use super::value::expected;
use super::{Entry, Input, InvalidOption, Value, nearest};

/// A value that a user can set: what flags, keys of scene files, documentation and messages say of it.
#[derive(Clone, Copy, Debug)]
pub struct Parameter {
    /// Key in a scene file: words joined by `_`.
    pub key: &'static str,
    /// What it does: a line, and for the documentation more of them.
    help: &'static str,
    /// Name of the flag where that is not the key's.
    named_flag: Option<&'static str>,
    /// Value of a flag that stands alone.
    pub bare: Option<&'static str>,
    /// What a value is called where flags are listed.
    pub placeholder: &'static str,
    /// Default value, or what the default depends on.
    default: fn() -> String,
    names: fn() -> Vec<&'static str>,
    range: fn() -> String,
    schema: fn() -> serde_json::Value,
}

impl Parameter {
    /// The entry of `parameters!` with this key and help.
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

    /// Returns true if a flag sets it.
    pub fn has_flag(&self) -> bool {
        self.named_flag != Some("")
    }

    /// Name of the flag: the key with `-` for `_`, except for a few; empty without a flag.
    pub fn flag(&self) -> String {
        self.named_flag.map_or_else(|| self.key.replace('_', "-"), String::from)
    }

    /// Description in a line.
    pub fn help(&self) -> &'static str {
        self.help.lines().next().unwrap_or_default().trim()
    }

    /// More about it for the documentation; empty where the line says all.
    pub fn detail(&self) -> String {
        let lines = self.help.lines().skip(1).map(str::trim);
        lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
    }

    /// Default value, or what the default depends on.
    pub fn default(&self) -> String {
        (self.default)()
    }

    /// All values, where they are named.
    pub fn names(&self) -> Vec<&'static str> {
        (self.names)()
    }

    /// Range of a number, such as `from 1 to 100`; empty for any number and for named values.
    pub fn range(&self) -> String {
        (self.range)()
    }

    /// What a scene file may write, as a JSON Schema.
    pub fn schema(&self) -> serde_json::Value {
        (self.schema)()
    }

    /// Keys by which a scene file may call it: its key, and its flag where that has another name.
    pub fn keys(&self) -> impl Iterator<Item = &'static str> {
        [self.key]
            .into_iter()
            .chain(self.named_flag.filter(|flag| !flag.is_empty()))
    }

    /// Whether a scene file may call it `key`: by its key, or by its flag.
    pub fn is_called(&self, key: &str) -> bool {
        self.keys().any(|known| known == key)
    }
}

/// What a user has set of the parameters that belong together; what was not set is `None`.
pub trait OptionGroup: Default {
    /// All of them, in the order of the documentation.
    const PARAMETERS: &'static [Parameter];
    /// Title over their flags; empty for the general ones.
    const HEADING: &'static str;

    /// Sets the parameter that is called `key`; `None`: there is no such parameter in this group.
    fn set(&mut self, key: &str, input: Input) -> Option<Result<(), InvalidOption>>;

    /// Values set here, and for the rest those set in `other`.
    fn or(self, other: Self) -> Self;

    /// Keys of what is set.
    fn given(&self) -> Vec<&'static str>;

    /// Keys and values of what is set, as scene files have them.
    fn entries(&self) -> Vec<Entry>;

    /// The first value out of its range.
    fn invalid(&self) -> Option<InvalidOption>;
}

/// Reads a value of `parameter`.
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

/// `value` as one that `parameter` cannot have, unless `is_valid`.
pub(crate) fn check<T: Value>(parameter: &Parameter, value: T, is_valid: bool) -> Option<InvalidOption> {
    (!is_valid).then(|| InvalidOption {
        key: parameter.key,
        flag: parameter.flag(),
        value: value.text(),
        help: expected::<T>(&parameter.range()),
    })
}

/// `schema` with keywords over its own.
pub(crate) fn bounded(
    mut schema: serde_json::Value,
    bounds: Vec<(&'static str, serde_json::Value)>,
) -> serde_json::Value {
    for (keyword, value) in bounds {
        schema[keyword] = value;
    }
    schema
}

/// Defines a struct of options and all there is to say about each of them.
///
/// ```text
/// parameters! {
///     /// What they are about.
///     pub struct NAME, heading "TITLE OVER THEIR FLAGS", values MODULE {
///         /// Help: what it does, in a line.
///         ///
///         /// More, for the documentation alone.
///         key: TYPE = DEFAULT, in RANGE;
///         /// One whose default is no value, but depends on something.
///         key: TYPE, default "what it depends on", in RANGE;
///         /// One whose flag has another name, and may stand without a value. `""` is no flag.
///         key: TYPE = DEFAULT, flag "name", bare "value";
///     }
/// }
/// ```
///
/// Fields are options, `None` where nothing was set; a method of the same name gives the value or its default. `MODULE` has the type of each
/// value by its key, and in `resolved` the type with which methods read it: an option only where there is no default.
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

            /// Types of the values where nothing was set is the default, an option where there is none.
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
