use crate::io::{FileError, FileErrorKind};
use crate::session::{Error as SessionError, InvalidSetting};
use thiserror::Error;

/// Exit code of a command that was interrupted.
pub(super) const INTERRUPTED: u8 = 130;

/// Why a command ended early.
#[derive(Debug, Error)]
pub(super) enum CliError {
    /// The command line asks for something that cannot be.
    #[error("{0}")]
    Usage(String),
    /// A file cannot be read, is wrong, or cannot be written.
    #[error("{0}")]
    File(FileError),
    /// An interrupt ended the command before there was anything to write.
    #[error("{0}")]
    Interrupted(String),
    /// Anything else that failed.
    #[error("{0}")]
    Failed(String),
}

impl CliError {
    /// One error of all `failures`.
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
            // Settings are flags here.
            SessionError::Setting(InvalidSetting { setting, value, help }) => {
                Self::Usage(format!("--{setting} {value}\n  help: {help}"))
            }
            SessionError::Refused(words) => Self::Usage(words),
            SessionError::File(error) => error.into(),
            error => Self::Failed(error.to_string()),
        }
    }
}
