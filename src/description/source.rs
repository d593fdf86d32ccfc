//! Where a scene description comes from: its file and text, the flags that set keys over it, and errors with their places in these.

use super::overrides::Overrides;
use crate::io::{FileError, Position};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Bytes of a line in which columns are counted: there may be an error of each word of a line, and lines may be megabytes.
const MAX_COLUMNS: usize = 1 << 12;

/// A scene file by its path and text, or the OBJ file that a scene consists of.
#[derive(Clone, Debug, Default)]
pub(super) struct Source {
    /// The scene file; paths are relative to its folder. Empty for a bare OBJ.
    path: PathBuf,
    /// The OBJ file of a scene that has no scene file.
    obj: PathBuf,
    /// Text of the scene file, for places in messages.
    text: String,
    /// Keys that are set over those of the file.
    pub overrides: Overrides,
    /// Bytes at which its lines start, once a place was asked for.
    line_starts: OnceLock<Vec<usize>>,
}

impl Source {
    /// The scene file `path` with this text, and keys that are set over its own.
    pub fn of_file(path: &Path, text: String, overrides: Overrides) -> Self {
        Self {
            path: path.to_path_buf(),
            text,
            overrides,
            ..Self::default()
        }
    }

    /// The OBJ file `path`, without a scene file but with these keys.
    pub fn of_obj(path: &Path, overrides: Overrides) -> Self {
        Self {
            obj: path.to_path_buf(),
            overrides,
            ..Self::default()
        }
    }

    /// Replaces the text by one of as many bytes.
    pub fn set_text(&mut self, text: String) {
        self.text = text;
    }

    /// Text of the scene file; empty for a bare OBJ.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Number of bytes of the text.
    pub fn bytes(&self) -> usize {
        self.text.len()
    }

    /// The scene file; `None` for a bare OBJ.
    pub fn path(&self) -> Option<&Path> {
        (!self.path.as_os_str().is_empty()).then_some(&self.path)
    }

    /// A path in the scene file, which is relative to its folder.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// An error at bytes `span` of the file, or of the flag that has set what is there.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        if let Some(written) = self.overrides.at(span.start) {
            return self.whole(format!("{written}: {}", message.into())).of_flag();
        }
        FileError::new(&self.path, message).at(self.position(span.start))
    }

    /// An error of the scene as a whole.
    pub fn whole(&self, message: impl Into<String>) -> FileError {
        FileError::new(self.path().unwrap_or(&self.obj), message)
    }

    /// The place of a byte: as [`Position::of_byte`] has it, without counting all lines anew. Far to the right in a long line it has no column.
    fn position(&self, byte: usize) -> Position {
        let starts = self.line_starts.get_or_init(|| {
            let ends = self.text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
            std::iter::once(0).chain(ends.map(|(end, _)| end + 1)).collect()
        });
        let lines_before = starts.partition_point(|&start| start <= byte.min(self.text.len())) - 1;
        let start = starts[lines_before];
        let place = match byte - start {
            0..=MAX_COLUMNS => Position::of_byte(&self.text[start..], byte - start),
            _ => Position::line(1),
        };
        Position {
            line: lines_before + 1,
            ..place
        }
    }
}
