use crate::io::{FileError, Finding, MAX_PLACES, Position, Severity};
use std::path::Path;

/// Number of faults of one kind in a file, and the lines of the first faults.
#[derive(Default)]
pub(super) struct Tally {
    pub count: u64,
    lines: Vec<usize>,
}

impl Tally {
    pub fn add(&mut self, line: usize) {
        self.count += 1;
        if self.lines.len() <= MAX_PLACES {
            self.lines.push(line);
        }
    }

    /// Returns one finding for all counted faults. `None` if there are none. `words` takes the
    /// number of faults and returns the message and the help.
    pub fn finding(
        &self,
        (severity, code): (Severity, &'static str),
        path: &Path,
        words: impl FnOnce(u64) -> (String, &'static str),
    ) -> Option<Finding> {
        let mut places = self.lines.iter().map(|&line| Position::line(line));
        let first = places.next()?;
        let (message, help) = words(self.count);
        let error = FileError::new(path, message).at(first).help(help);
        Some(Finding::new(severity, code, error).repeated(self.count, places))
    }
}

/// Count with its noun: `1 face`, `2 faces`.
pub(super) fn counted(count: u64, what: &str) -> String {
    match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    }
}
