use super::polygon::MAX_CLIPPED;
use crate::io::{FileError, Finding, MAX_PLACES, Position, Severity};
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
    /// A smoothing group that is not a number.
    BadSmoothing,
}

/// Number of remarks, and their places.
#[derive(Default)]
pub(super) struct Remarks {
    /// By [`Remark`].
    tallies: [Tally; 5],
    /// Statements that are not known.
    unknown: Tally,
    /// The first keywords of those, each once.
    keywords: Vec<String>,
}

#[derive(Default)]
struct Tally {
    count: u64,
    /// The first ones.
    lines: Vec<usize>,
}

impl Remarks {
    pub fn add(&mut self, remark: Remark, line: usize) {
        self.tallies[remark as usize].add(1, &[line]);
    }

    /// A statement that has no effect.
    pub fn add_unknown(&mut self, keyword: &str, line: usize) {
        self.unknown.add(1, &[line]);
        self.name(keyword);
    }

    /// Adds the remarks on what follows in the file.
    pub fn append(&mut self, later: &Self) {
        for (tally, more) in self.tallies.iter_mut().zip(&later.tallies) {
            tally.add(more.count, &more.lines);
        }
        self.unknown.add(later.unknown.count, &later.unknown.lines);
        later.keywords.iter().for_each(|keyword| self.name(keyword));
    }

    /// All remarks as findings.
    pub fn findings(&self, path: &Path) -> Vec<Finding> {
        let words = [
            ("short-face", "faces of fewer than 3 corners are skipped".to_string()),
            (
                "long-face",
                format!("faces of more than {MAX_CLIPPED} corners are triangulated as if they were convex"),
            ),
            (
                "bad-normal",
                "normals are zero or not finite, and count as missing".to_string(),
            ),
            (
                "bad-texture-coordinate",
                "texture coordinates are not finite, and count as 0".to_string(),
            ),
            (
                "bad-smoothing-group",
                "smoothing groups are neither a number nor `off`, and count as `off`".to_string(),
            ),
            (
                "unknown-statement",
                format!("statements have no effect ({})", self.keywords.join(", ")),
            ),
        ];
        let tallies = self.tallies.iter().chain([&self.unknown]);
        let finding = |((code, words), tally): ((&'static str, String), &Tally)| {
            let mut places = tally.lines.iter().map(|&line| Position::line(line));
            let message = format!("{} {words}, the first is here", tally.count);
            let first = FileError::new(path, message).at(places.next()?);
            Some(Finding::new(Severity::Warning, code, first).repeated(tally.count, places))
        };
        words.into_iter().zip(tallies).filter_map(finding).collect()
    }

    fn name(&mut self, keyword: &str) {
        if self.keywords.len() < MAX_NAMED && !self.keywords.iter().any(|k| k == keyword) {
            self.keywords.push(keyword.into());
        }
    }
}

impl Tally {
    fn add(&mut self, count: u64, lines: &[usize]) {
        self.count += count;
        let free = (1 + MAX_PLACES).saturating_sub(self.lines.len());
        self.lines.extend(lines.iter().take(free));
    }
}
