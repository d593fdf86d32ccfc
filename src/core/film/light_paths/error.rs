use std::fmt;

/// What is wrong with a part or an expression, and what to do about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightPathError {
    /// What is wrong, with its place.
    pub message: String,
    /// What to do about it.
    pub help: String,
}

impl LightPathError {
    pub(super) fn new(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            help: help.into(),
        }
    }
}

impl fmt::Display for LightPathError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}\n  help: {}", self.message, self.help)
    }
}
