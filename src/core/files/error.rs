//! Errors of files, with place and remedy.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place in a text file; both count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column in characters, where it is known.
    pub column: Option<usize>,
}

impl Position {
    /// The place of byte `offset` in `text`.
    pub fn of_byte(text: &str, offset: usize) -> Self {
        let before = &text.as_bytes()[..offset.min(text.len())];
        let line_start = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
        Self {
            line: before.iter().filter(|&&b| b == b'\n').count() + 1,
            column: Some(String::from_utf8_lossy(&before[line_start..]).chars().count() + 1),
        }
    }

    /// A whole line.
    pub fn line(line: usize) -> Self {
        Self { line, column: None }
    }
}

/// What an error of a file is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileErrorKind {
    /// The contents of the file are wrong, or the file is not there.
    #[default]
    Contents,
    /// The file is there and the system did not give its bytes: nothing is known of its contents.
    Unreadable,
    /// A flag that stands for keys of the file is wrong; the message names the flag.
    Flag,
}

/// Error in a file, with its place and its remedy.
///
/// Shown as `file:line:column: message`, with the remedy on a line of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct FileError {
    /// The file, as the user named it.
    pub file: PathBuf,
    /// Where in the file.
    pub position: Option<Position>,
    /// The error, with the value.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// What the error is about.
    pub kind: FileErrorKind,
}

impl FileError {
    /// Something about the file as a whole.
    pub fn new(file: &Path, message: impl Into<String>) -> Self {
        Self {
            file: file.to_path_buf(),
            position: None,
            message: message.into(),
            help: None,
            kind: FileErrorKind::Contents,
        }
    }

    /// An operation on the file that the system refused.
    pub fn system(file: &Path, what: &str, error: &std::io::Error) -> Self {
        Self::new(file, format!("{what}: {error}")).unreadable()
    }

    /// Says that nothing is known of the file's contents.
    pub fn unreadable(mut self) -> Self {
        self.kind = FileErrorKind::Unreadable;
        self
    }

    /// Says that the error is that of a flag, which the message names.
    pub fn of_flag(mut self) -> Self {
        self.kind = FileErrorKind::Flag;
        self
    }

    /// Whether the system did not give the file's bytes.
    pub fn is_unreadable(&self) -> bool {
        self.kind == FileErrorKind::Unreadable
    }

    /// The error at a place.
    pub fn at(mut self, position: Position) -> Self {
        self.position = Some(position);
        self
    }

    /// The file, line and column as editors jump to them: `file:line:column`.
    pub fn place(&self) -> String {
        // A name with line breaks stays a line.
        let mut place = self.file.display().to_string().replace('\n', "\\u000a");
        if let Some(position) = self.position {
            place += &format!(":{}", position.line);
            if let Some(column) = position.column {
                place += &format!(":{column}");
            }
        }
        place
    }

    /// The error with a remedy.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The error with a remedy, unless it has one.
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
    fn shown_as_compilers_do() {
        let error = FileError::new(Path::new("a.obj"), "bad index 7")
            .at(Position {
                line: 3,
                column: Some(5),
            })
            .help("use 1 to 4");
        assert_eq!(error.to_string(), "a.obj:3:5: bad index 7\n  help: use 1 to 4");
    }
}
