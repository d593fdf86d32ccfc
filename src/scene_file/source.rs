//! Source of a scene description: path and text of the file, and the flags that set keys. The
//! source adds the places in the file to errors.

use super::overrides::Overrides;
use crate::io::{FileError, Position};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Maximum number of bytes of a line within which columns are counted. Without this maximum, a line
/// of megabytes with many errors would take long.
const MAX_COLUMNS: usize = 1 << 12;

/// Source of a scene: a scene file with its path and text, or an OBJ file without a scene file.
#[derive(Clone, Debug, Default)]
pub(super) struct Source {
    /// Path of the scene file. Other paths are relative to the folder of this file. Empty for a
    /// bare OBJ.
    path: PathBuf,
    /// Path of the OBJ file of a scene without a scene file.
    obj: PathBuf,
    /// Text of the scene file, to find the lines and columns of errors.
    text: String,
    /// Keys that flags set.
    pub overrides: Overrides,
    /// Byte at which each line starts, computed at the first use.
    line_starts: OnceLock<Vec<usize>>,
}

impl Source {
    /// Source of the scene file `path` with the text `text`, and with keys that flags set.
    pub fn of_file(path: &Path, text: String, overrides: Overrides) -> Self {
        Self {
            path: path.to_path_buf(),
            text,
            overrides,
            ..Self::default()
        }
    }

    /// Source of the OBJ file `path` without a scene file, with keys that flags set.
    pub fn of_obj(path: &Path, overrides: Overrides) -> Self {
        Self {
            obj: path.to_path_buf(),
            overrides,
            ..Self::default()
        }
    }

    /// Replaces the text by a text of equal length.
    pub fn set_text(&mut self, text: String) {
        self.text = text;
    }

    /// Text of the scene file; empty for a bare OBJ.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Length of the text in bytes.
    pub fn bytes(&self) -> usize {
        self.text.len()
    }

    /// Path of the scene file; `None` for a bare OBJ.
    pub fn path(&self) -> Option<&Path> {
        (!self.path.as_os_str().is_empty()).then_some(&self.path)
    }

    /// Full path of `relative`, which is relative to the folder of the scene file.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// An error that points to the bytes `span` of the file, or that names the flag that set the
    /// value there.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        if let Some(written) = self.overrides.at(span.start) {
            return self.whole(format!("{written}: {}", message.into())).of_flag();
        }
        FileError::new(&self.path, message).at(self.position(span.start))
    }

    /// An error that belongs to the whole scene, without a place in the file.
    pub fn whole(&self, message: impl Into<String>) -> FileError {
        FileError::new(self.path().unwrap_or(&self.obj), message)
    }

    /// Line and column of a byte, as in [`Position::of_byte`], but without counting all lines
    /// again. After [`MAX_COLUMNS`] bytes of a line, the position has no column.
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
