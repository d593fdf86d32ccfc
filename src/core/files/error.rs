//! Errors in files, with their position and a help text.

use std::fmt;
use std::path::{Path, PathBuf};

/// A position in a text file. Lines and columns count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line number.
    pub line: usize,
    /// Column in characters, if known.
    pub column: Option<usize>,
}

impl Position {
    /// Position of byte `offset` in `text`.
    pub fn of_byte(text: &str, offset: usize) -> Self {
        let before = &text.as_bytes()[..offset.min(text.len())];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        Self {
            line: before.iter().filter(|&&b| b == b'\n').count() + 1,
            column: Some(String::from_utf8_lossy(&before[line_start..]).chars().count() + 1),
        }
    }

    /// Position of the line `line`, without a column.
    pub fn line(line: usize) -> Self {
        Self { line, column: None }
    }
}

/// Cause of an error of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileErrorKind {
    /// The contents of the file are wrong, or the file does not exist.
    #[default]
    Contents,
    /// The file cannot be read or written, so its contents are unknown.
    Unreadable,
    /// A flag of the command line that replaces keys of the file is wrong. The message then names
    /// the flag.
    Flag,
}

/// Error in a file, with its position and a help text.
///
/// Shown as `file:line:column: message`, with the help text on a separate line.
#[derive(Clone, Debug, PartialEq)]
pub struct FileError {
    /// Path of the file, as the user wrote it.
    pub file: PathBuf,
    /// Position in the file. `None` for the file as a whole.
    pub position: Option<Position>,
    /// Description of the error, with the wrong value.
    pub message: String,
    /// Help text: how to correct the error.
    pub help: Option<String>,
    /// Cause of the error.
    pub kind: FileErrorKind,
}

impl FileError {
    /// Error of the file as a whole.
    pub fn new(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: file.to_path_buf(),
            position: None,
            message: message.into(),
            help: None,
            kind: FileErrorKind::Contents,
        }
    }

    /// Error of an operation on the file that the system refused. `what` says what failed, such as
    /// `cannot read it`.
    pub fn system(file: &Path, what: &str, error: &std::io::Error) -> Self {
        Self::new(file, format!("{what}: {error}")).unreadable()
    }

    /// Marks the error as [`FileErrorKind::Unreadable`].
    pub fn unreadable(mut self) -> Self {
        self.kind = FileErrorKind::Unreadable;
        self
    }

    /// Marks the error as [`FileErrorKind::Flag`].
    pub fn of_flag(mut self) -> Self {
        self.kind = FileErrorKind::Flag;
        self
    }

    /// Returns true if the file could not be read or written.
    pub fn is_unreadable(&self) -> bool {
        self.kind == FileErrorKind::Unreadable
    }

    /// Sets the position.
    pub fn at(mut self, position: Position) -> Self {
        self.position = Some(position);
        self
    }

    /// File, line and column in the format of editors: `file:line:column`.
    pub fn place(&self) -> String {
        // Escape line breaks in the name, so that the place is one line.
        let mut place = self.file.display().to_string().replace('\n', "\\u000a");
        if let Some(position) = self.position {
            place += &format!(":{}", position.line);
            if let Some(column) = position.column {
                place += &format!(":{column}");
            }
        }
        place
    }

    /// Sets the help text.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Sets the help text, unless the error already has one.
    pub fn help_if_none(mut self, help: &str) -> Self {
        self.help.get_or_insert_with(|| help.into());
        self
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place(), self.message)?;
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for FileError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_have_lines_and_columns() {
        let text = "ab\ncäd\n";
        let at = |offset| {
            let p = Position::of_byte(text, offset);
            (p.line, p.column.unwrap())
        };
        assert_eq!(at(0), (1, 1));
        assert_eq!(at(1), (1, 2));
        assert_eq!(at(3), (2, 1));
        assert_eq!(at(6), (2, 3));
        assert_eq!(at(99), (3, 1));
    }

    #[test]
    fn error_is_shown_as_file_line_column_message() {
        let error = FileError::new(Path::new("a.obj"), "bad index 7")
            .at(Position {
                line: 3,
                column: Some(5),
            })
            .help("use 1 to 4");
        assert_eq!(error.to_string(), "a.obj:3:5: bad index 7\n  help: use 1 to 4");
    }
}
