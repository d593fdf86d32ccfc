//! Finds all errors of a scene file, not only the first error.

use super::{SceneFile, read, read_overrides};
use crate::io::FileError;
use std::path::Path;

/// Maximum number of reported errors of a scene file.
const MAX_ERRORS: usize = 20;

impl SceneFile {
    /// Reads a scene file like [`SceneFile::load_with`], but continues after errors. An entry or a
    /// section with an error is removed, and the remaining text is read again. Returns all errors,
    /// and the scene file without the removed parts. The scene file is `None` if the remaining text
    /// is not a valid scene file.
    pub fn inspect(path: &Path, set: &[String]) -> (Option<Self>, Vec<FileError>) {
        let read = read(path).and_then(|text| Ok((read_overrides(path, set, &text)?, text)));
        let (overrides, mut text) = match read {
            Ok(read) => read,
            Err(error) => return (None, vec![error]),
        };
        let original = text.clone();
        let mut errors: Vec<FileError> = Vec::new();
        loop {
            let (error, start) = match Self::parse_spanned(path, text.clone(), &overrides) {
                Ok(mut file) => {
                    // The blanks have the length of the removed text, so all places stay valid in
                    // the original text
                    file.source.set_text(original);
                    return (Some(file), errors);
                }
                Err(refused) => refused,
            };
            let is_new = errors.iter().all(|known| known.position != error.position);
            if !is_new || errors.len() == MAX_ERRORS {
                return (None, errors);
            }
            errors.push(error);
            match start.and_then(|start| without_entry(&text, start)) {
                Some(shorter) => text = shorter,
                None => return (None, errors),
            }
        }
    }
}

/// The text with blanks in place of the entry or section at byte `start`. The blanks keep the byte
/// positions of the other text. `None` if there are already blanks.
fn without_entry(text: &str, start: usize) -> Option<String> {
    let before = text.get(..start)?;
    let begin = before.rfind('\n').map_or(0, |i| i + 1);
    let is_header = text[begin..].trim_start().starts_with('[');
    // Find the end: an entry ends when its brackets are closed, and a section ends at the next
    // section
    let mut end = begin;
    let mut depth = 0i64;
    for line in text[begin..].split_inclusive('\n') {
        if is_header && end > begin && line.trim_start().starts_with('[') {
            break;
        }
        end += line.len();
        let count = |brackets: [char; 2]| line.matches(brackets).count() as i64;
        depth += count(['[', '{']) - count([']', '}']);
        if !is_header && depth <= 0 {
            break;
        }
    }
    let entry = &text[begin..end];
    if entry.trim().is_empty() {
        return None;
    }
    let blank = |byte: u8| if byte == b'\n' { '\n' } else { ' ' };
    let blanks: String = entry.bytes().map(blank).collect();
    Some(format!("{}{blanks}{}", &text[..begin], &text[end..]))
}
