use crate::camera::CameraError;
use crate::denoise::DenoiseError;
use crate::io::FileError;
use crate::options::InvalidOption;
use std::fmt;
use thiserror::Error;

/// Why a session could not go on.
#[derive(Clone, Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// A setting has a value that cannot be.
    #[error("{0}")]
    Setting(InvalidSetting),
    /// Settings and scene do not go together; the words say what to change.
    #[error("{0}")]
    Refused(String),
    /// A file cannot be read, is wrong, or cannot be written.
    #[error("{0}")]
    File(#[from] FileError),
    /// Anything else that failed.
    #[error("{0}")]
    Failed(String),
}

/// A setting that cannot be, by the name that the command line has for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InvalidSetting {
    /// `spp`, `crop` and the like.
    pub setting: String,
    /// The value, and what is wrong with it if that is not plain.
    pub value: String,
    /// What to do about it.
    pub help: String,
}

impl InvalidSetting {
    /// Error of `setting`, which is not to be `value`; `help` says what to do about it.
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
