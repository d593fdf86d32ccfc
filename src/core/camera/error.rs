//! Errors of camera parameters.

use thiserror::Error;

/// Error of a camera parameter out of range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("camera {parameter} {message}")]
pub struct CameraError {
    /// Name of the wrong parameter, such as a field of
    /// [`CameraParameters`](super::CameraParameters).
    pub parameter: &'static str,
    pub(super) message: String,
    /// Hint for the user; `None` if the only hint is to correct the parameter.
    pub help: Option<String>,
}

impl CameraError {
    /// Error of a missing `parameter`.
    pub fn unknown(parameter: &'static str) -> Self {
        Self {
            parameter,
            message: "is not given and cannot be guessed".into(),
            help: None,
        }
    }

    /// Error of a `parameter` that must be above 0.
    pub fn not_positive(parameter: &'static str, value: f32) -> Self {
        Self {
            parameter,
            message: format!("must be positive, not {value}"),
            help: None,
        }
    }

    /// Error of a `parameter`, with this message.
    pub fn wrong(parameter: &'static str, message: impl Into<String>) -> Self {
        Self {
            parameter,
            message: message.into(),
            help: None,
        }
    }

    /// Error of a `parameter`, with this message and this hint for the user.
    pub fn no_place(parameter: &'static str, message: String, help: String) -> Self {
        Self {
            parameter,
            message,
            help: Some(help),
        }
    }
}
