//! Chunks of an OBJ file, and counts of the statements before each chunk.

use super::parts::CurrentNames;
use crate::io::statements::{chunks, split_keyword, statements};
use rayon::prelude::*;
use std::borrow::Cow;

/// Keywords of the values that corners refer to, in the order of a corner's indices.
pub(super) const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];

/// Numbers of lines, of `v`, `vt` and `vn` statements, of faces, and of corners of faces.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub lines: usize,
    pub elements: [usize; 3],
    faces: usize,
    /// Corners of faces; too many if several blanks follow one another.
    corners: usize,
}

impl Counts {
    /// Counts the statements of a text, and finds its last `o` and its last `g`.
    fn of(text: &str) -> (Self, [Option<String>; 2]) {
        let mut names = [None, None];
        let mut counts = Self {
            lines: text.bytes().filter(|&b| b == b'\n').count(),
            ..Self::default()
        };
        for (_, statement) in statements(text) {
            let (keyword, rest) = split_keyword(&statement);
            // Constants are compared faster than the keywords of a list.
            match keyword.as_bytes() {
                b"v" => counts.elements[0] += 1,
                b"vt" => counts.elements[1] += 1,
                b"vn" => counts.elements[2] += 1,
                b"f" | b"fo" => {
                    counts.faces += 1;
                    counts.corners += 1 + rest.bytes().filter(|&b| b == b' ' || b == b'\t').count();
                }
                b"o" => names[0] = Some(statement),
                b"g" => names[1] = Some(statement),
                _ => {}
            }
        }
        (counts, names.map(|name| name.map(Cow::into_owned)))
    }

    fn plus(self, other: Self) -> Self {
        Self {
            lines: self.lines + other.lines,
            elements: [0, 1, 2].map(|kind| self.elements[kind] + other.elements[kind]),
            faces: self.faces + other.faces,
            corners: self.corners + other.corners,
        }
    }
}

/// A text divided into chunks whose statements have been counted. The counts determine the first
/// line number of each chunk, and the values to which relative (negative) indices in the chunk
/// refer.
pub(super) struct Chunks<'a> {
    pub texts: Vec<&'a str>,
    /// Counts of the text before each chunk.
    pub before: Vec<Counts>,
    pub total: Counts,
    /// Names of parts for the first face of each chunk.
    pub names: Vec<CurrentNames>,
}

impl<'a> Chunks<'a> {
    /// Cuts a text into chunks of about `chunk_bytes` bytes, and counts their statements in
    /// parallel.
    pub fn count(text: &'a str, chunk_bytes: usize) -> Self {
        let texts = chunks(text, chunk_bytes);
        let counts: Vec<(Counts, [Option<String>; 2])> = texts.par_iter().map(|chunk| Counts::of(chunk)).collect();
        let (mut total, mut last) = (Counts::default(), CurrentNames::default());
        let running = |(counts, names): &(Counts, [Option<String>; 2])| {
            let before = (total, last.clone());
            total = total.plus(*counts);
            last.follow(names);
            before
        };
        let (before, names) = counts.iter().map(running).unzip();
        Self {
            texts,
            before,
            total,
            names,
        }
    }

    /// Approximate maximum memory, in bytes, of reading the chunks, including `length` bytes of
    /// text.
    pub fn bytes(&self, length: u64) -> u64 {
        let [v, vt, vn] = self.total.elements.map(|n| n as u64);
        let (faces, corners) = (self.total.faces as u64, self.total.corners as u64);
        let (has_uvs, has_normals) = (u64::from(vt > 0), u64::from(vn > 0));
        let values = 16 * v + 8 * vt + 16 * vn;
        let outline = values + 4 * faces + 4 * corners * (1 + has_uvs + has_normals);
        // While chunks are joined, values exist twice.
        let reading = length + outline + values;
        // Then the text is freed. Faces become triangles, and corners become vertices. Equal
        // corners are found by an index of the vertices.
        let (triangles, vertices) = (corners.saturating_sub(2 * faces), v.max(vt).max(vn));
        let index = if has_uvs + has_normals == 0 { 4 } else { 48 };
        let mesh = 12 * triangles + vertices * (16 + 8 * has_uvs + 16 * has_normals);
        reading.max(outline + mesh + index * vertices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faces_of_both_keywords_are_counted() {
        let (counts, _) = Counts::of("f 1 2 3\nfo 1 2 3 4\nfoo 1 2\n");
        assert_eq!((counts.faces, counts.corners), (2, 7));
    }
}
