use crate::io::{FileError, FileErrorKind};
use crate::session::{Error as SessionError, InvalidSetting};
use thiserror::Error;

/// Exit code of an interrupted command.
pub(super) const INTERRUPTED: u8 = 130;

/// Error of a command.
#[derive(Debug, Error)]
pub(super) enum CliError {
    /// The command line is invalid.
    #[error("{0}")]
    Usage(String),
    /// A file cannot be read or written, or is invalid.
    #[error("{0}")]
    File(FileError),
    /// An interrupt ended the command before any result.
    #[error("{0}")]
    Interrupted(String),
    /// Another failure.
    #[error("{0}")]
    Failed(String),
}

impl CliError {
    /// A single error with the messages of all `failures`.
    pub fn of_failures<T: ToString>(failures: &[T]) -> Self {
        let words: Vec<String> = failures.iter().map(T::to_string).collect();
        Self::Failed(words.join("\nerror: "))
    }

    /// Exit code of the process.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::File(_) | Self::Failed(_) => 1,
            Self::Interrupted(_) => INTERRUPTED,
        }
    }
}

impl From<FileError> for CliError {
    fn from(error: FileError) -> Self {
        match error.kind {
            // The command line is wrong, not the file.
            FileErrorKind::Flag => Self::Usage(match error.help {
                Some(help) => format!("{}\n  help: {help}", error.message),
                None => error.message,
            }),
            _ => Self::File(error),
        }
    }
}

impl From<SessionError> for CliError {
    fn from(error: SessionError) -> Self {
        match error {
            // On the command line, a setting comes from a flag. An error about the setting is
            // therefore wrong usage.
            SessionError::Setting(InvalidSetting { setting, value, help }) => {
                Self::Usage(format!("--{setting} {value}\n  help: {help}"))
            }
            SessionError::Refused(words) => Self::Usage(words),
            SessionError::File(error) => error.into(),
            error => Self::Failed(error.to_string()),
        }
    }
}
