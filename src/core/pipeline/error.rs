use crate::camera::CameraError;
use crate::denoise::DenoiseError;
use crate::io::FileError;
use crate::options::InvalidOption;
use std::fmt;
use thiserror::Error;

/// Error of a session.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting has an invalid value.
    #[error("{0}")]
    Setting(InvalidSetting),
    /// Settings and scene are incompatible; the text says how to correct them.
    #[error("{0}")]
    Refused(String),
    /// A file cannot be read, is invalid, or cannot be written.
    #[error("{0}")]
    File(#[from] FileError),
    /// Any other failure.
    #[error("{0}")]
    Failed(String),
}

/// An invalid setting, with its name on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidSetting {
    /// Name of the setting, such as `spp` or `crop`.
    pub setting: String,
    /// Value, with a description of the error if the error is not obvious.
    pub value: String,
    /// Hint on how to correct the setting.
    pub help: String,
}

impl InvalidSetting {
    /// Error: `setting` has the invalid value `value`. `help` is a hint on how to correct it.
    pub fn new(setting: &str, value: impl fmt::Display, help: impl Into<String>) -> Self {
        Self {
            setting: setting.into(),
            value: value.to_string(),
            help: help.into(),
        }
    }
}

impl From<InvalidOption> for InvalidSetting {
    fn from(InvalidOption { flag, value, help, .. }: InvalidOption) -> Self {
        Self {
            setting: flag,
            value,
            help,
        }
    }
}

impl fmt::Display for InvalidSetting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}\n  help: {}", self.setting, self.value, self.help)
    }
}

impl From<InvalidSetting> for Error {
    fn from(invalid: InvalidSetting) -> Self {
        Self::Setting(invalid)
    }
}

impl From<DenoiseError> for Error {
    fn from(error: DenoiseError) -> Self {
        match error {
            DenoiseError::NotBuilt => Self::Refused(error.to_string()),
            _ => Self::Failed(error.to_string()),
        }
    }
}

impl From<CameraError> for Error {
    fn from(error: CameraError) -> Self {
        let help = error.help.clone().unwrap_or_else(|| match error.parameter {
            "position" | "look_at" | "up" | "vertical_fov" | "close" | "shutter" => {
                "correct --position, --look-at, --up, --fov or --shutter".into()
            }
            parameter => format!("correct --{}", parameter.replace('_', "-")),
        });
        Self::Refused(format!("{error}\n  help: {help}"))
    }
}
