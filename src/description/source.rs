//! Errors of a scene file, with their places in it or the flag that has set what is wrong.

use super::SceneFile;
use crate::io::{FileError, Position};
use std::ops::Range;
use std::path::Path;

/// Bytes of a line in which columns are counted: there may be an error of each word of a line, and lines may be megabytes.
const MAX_COLUMNS: usize = 1 << 12;

impl SceneFile {
    /// An error at bytes `span` of the file.
    pub fn error(&self, span: Range<usize>, message: impl Into<String>) -> FileError {
        if let Some(written) = self.overrides.at(span.start) {
            return self.whole(format!("{written}: {}", message.into())).of_flag();
        }
        FileError::new(&self.path, message).at(self.position(span.start))
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

    /// The place of values that the flag `written` sets, such as `--env sky`: errors of them name it.
    pub fn flag_span(&mut self, written: impl Into<String>) -> Range<usize> {
        self.overrides.add_flag(self.text.len(), written.into())
    }

    /// Something about the scene as a whole.
    pub fn whole(&self, message: impl Into<String>) -> FileError {
        let obj = self.object.first().map(|o| o.obj.get_ref().as_path());
        let path = if self.is_file() { Some(self.path.as_path()) } else { obj };
        FileError::new(path.unwrap_or(Path::new("")), message)
    }
}
