use super::polygon::MAX_CLIPPED;
use crate::io::{FileError, Position};
use std::path::Path;

/// Keywords without effect that are named in the warning; more of them are only counted.
const MAX_NAMED: usize = 8;

/// Something of the file that is left out or taken for something else.
#[derive(Clone, Copy)]
pub(super) enum Remark {
    /// A face of fewer than three corners.
    ShortFace,
    /// A face of more than [`MAX_CLIPPED`] corners.
    LongFace,
    /// A normal that is zero or not finite.
    BadNormal,
    /// Texture coordinates that are not finite.
    BadUv,
    /// A smoothing group that is no number.
    BadSmoothing,
}

/// How often there was something to remark, and the line of the first.
#[derive(Default)]
pub(super) struct Remarks {
    /// By [`Remark`].
    tallies: [Tally; 5],
    /// Statements that are not known.
    unknown: Tally,
    /// The first keywords of those, each once.
    keywords: Vec<String>,
}

#[derive(Clone, Copy, Default)]
struct Tally {
    count: usize,
    first_line: usize,
}

impl Remarks {
    pub fn add(&mut self, remark: Remark, line: usize) {
        self.tallies[remark as usize].add(1, line);
    }

    /// A statement that has no effect.
    pub fn add_unknown(&mut self, keyword: &str, line: usize) {
        self.unknown.add(1, line);
        self.name(keyword);
    }

    /// Adds the remarks on what follows in the file.
    pub fn append(&mut self, later: &Self) {
        for (tally, more) in self.tallies.iter_mut().zip(&later.tallies) {
            tally.add(more.count, more.first_line);
        }
        self.unknown.add(later.unknown.count, later.unknown.first_line);
        later.keywords.iter().for_each(|keyword| self.name(keyword));
    }

    /// All of it in words.
    pub fn warnings(&self, path: &Path) -> Vec<String> {
        let words = [
            "faces of fewer than 3 corners are left out".to_string(),
            format!("faces of more than {MAX_CLIPPED} corners are cut as if they were convex"),
            "normals are zero or not finite, and count as missing".to_string(),
            "texture coordinates are not finite, and count as 0".to_string(),
            "smoothing groups are neither a number nor `off`, and count as `off`".to_string(),
            format!("statements have no effect ({})", self.keywords.join(", ")),
        ];
        let tallies = self.tallies.iter().chain([&self.unknown]);
        let warning = |(words, tally): (String, &Tally)| {
            let message = format!("{} {words}, the first is here", tally.count);
            let place = Position::line(tally.first_line);
            (tally.count > 0).then(|| FileError::new(path, message).at(place).to_string())
        };
        words.into_iter().zip(tallies).filter_map(warning).collect()
    }

    fn name(&mut self, keyword: &str) {
        if self.keywords.len() < MAX_NAMED && !self.keywords.iter().any(|k| k == keyword) {
            self.keywords.push(keyword.into());
        }
    }
}

impl Tally {
    fn add(&mut self, count: usize, first_line: usize) {
        if self.count == 0 {
            self.first_line = first_line;
        }
        self.count += count;
    }
}
