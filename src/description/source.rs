//! Sources of a scene description: its file and text, the flags that set keys, and errors with
//! places in them.

use super::overrides::Overrides;
use crate::io::{FileError, Position};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Maximum length in bytes of a line in which columns are counted. Lines may have megabytes and
/// many errors.
const MAX_COLUMNS: usize = 1 << 12;

/// A scene file with its path and text, or the OBJ file of a scene without a scene file.
#[derive(Clone, Debug, Default)]
pub(super) struct Source {
    /// The scene file; paths are relative to its folder. Empty for a bare OBJ.
    path: PathBuf,
    /// The OBJ file of a scene without a scene file.
    obj: PathBuf,
    /// Text of the scene file, to find places for messages.
    text: String,
    /// Keys set by flags.
    pub overrides: Overrides,
    /// Bytes at which the lines start, computed at the first use.
    line_starts: OnceLock<Vec<usize>>,
}

impl Source {
    /// The scene file `path` with `text`, and keys set by flags.
    pub fn of_file(path: &Path, text: String, overrides: Overrides) -> Self {
        Self {
            path: path.to_path_buf(),
            text,
            overrides,
            ..Self::default()
        }
    }

    /// The OBJ file `path` without a scene file, and keys set by flags.
    pub fn of_obj(path: &Path, overrides: Overrides) -> Self {
        Self {
            obj: path.to_path_buf(),
            overrides,
            ..Self::default()
        }
    }

    /// Replaces the text with a text of equal length.
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

    /// The full path of `relative`, a path relative to the folder of the scene file.
    pub fn resolve(&self, relative: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(relative)
    }

    /// An error at bytes `span` of the file, or of the flag that set the value there.
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

    /// Position of a byte, as in [`Position::of_byte`], without counting all lines again. It has no
    /// column after [`MAX_COLUMNS`] bytes of a line.
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
