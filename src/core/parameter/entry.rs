//! Values of parameters as users write them.

use super::Value;
use std::fmt;

/// A value as a user has written it.
#[derive(Clone, Copy, Debug)]
pub enum Input<'a> {
    /// Text after a flag.
    Flag(&'a str),
    /// A string of a scene file.
    String(&'a str),
    /// A number of a scene file.
    Number(&'a str),
    /// A list of numbers of a scene file, with commas between them.
    List(&'a str),
    /// Another value of a scene file, such as `true`.
    Other(&'a str),
}

impl Input<'_> {
    /// The text as it was written.
    pub(super) fn written(self) -> String {
        match self {
            Self::String(text) => format!("\"{text}\""),
            Self::List(text) => format!("[{text}]"),
            Self::Flag(text) | Self::Number(text) | Self::Other(text) => text.into(),
        }
    }
}

/// Error: an invalid value of a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidOption {
    /// Key of the parameter.
    pub key: &'static str,
    /// Flag of the parameter, without its dashes.
    pub flag: String,
    /// Value as written.
    pub value: String,
    /// Help for the user: valid values.
    pub help: String,
}

impl fmt::Display for InvalidOption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}\n  help: {}", self.key, self.value, self.help)
    }
}

/// A key with its value, as in scene files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Key of the parameter.
    pub key: &'static str,
    /// The value.
    pub text: String,
    /// Type of the value in a file.
    pub kind: EntryKind,
}

/// Type of a value in a scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A number.
    Number,
    /// A string.
    String,
    /// A list of numbers, separated by commas.
    List,
}

impl Entry {
    /// The entry of a parameter with a value.
    pub(crate) fn of<T: Value>(key: &'static str, value: T) -> Self {
        let text = value.text();
        let kind = if is_number::<T>(&text) {
            EntryKind::Number
        } else if T::IS_LIST && !T::IS_STRING {
            EntryKind::List
        } else {
            EntryKind::String
        };
        Self { key, text, kind }
    }
}

/// Returns true if scene files write `text` as a number.
pub(super) fn is_number<T: Value>(text: &str) -> bool {
    T::IS_NUMBER && text.trim().parse::<f64>().is_ok()
}
