//! Values of parameters in the form in which users write them.

use super::Value;
use std::fmt;

/// A value in the form in which a user has written it.
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
    /// The text of the value as it was written.
    pub(super) fn written(self) -> String {
        match self {
            Self::String(text) => format!("\"{text}\""),
            Self::List(text) => format!("[{text}]"),
            Self::Flag(text) | Self::Number(text) | Self::Other(text) => text.into(),
        }
    }
}

/// Error about the invalid value of a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidOption {
    /// Key of the parameter.
    pub key: &'static str,
    /// Flag of the parameter, without its dashes.
    pub flag: String,
    /// The invalid value as it was written.
    pub value: String,
    /// Help for the user: a description of valid values.
    pub help: String,
}

impl fmt::Display for InvalidOption {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {}\n  help: {}", self.key, self.value, self.help)
    }
}

/// A key and its value, as they are written in a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Key of the parameter.
    pub key: &'static str,
    /// Text of the value.
    pub text: String,
    /// Type of the value in the file.
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
    /// Entry of the parameter `key` with the value `value`.
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

/// Returns true if scene files write the value `text` as a number.
pub(super) fn is_number<T: Value>(text: &str) -> bool {
    T::IS_NUMBER && text.trim().parse::<f64>().is_ok()
}
