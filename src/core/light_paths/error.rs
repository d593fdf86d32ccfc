use std::fmt;

/// Error in a list of light parts or in a light path expression, with a hint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightPathError {
    /// Error message, with the position of the error.
    pub message: String,
    /// Hint on how to correct the error.
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
