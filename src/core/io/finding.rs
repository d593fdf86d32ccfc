//! Findings: messages of file readers and of `embrasure check` about a scene.
//!
//! A finding has a severity, a permanent name, a place and a count. Renders and checks use the same
//! readers. A reader does not stop at a wrong statement: it skips the statement or uses the nearest
//! valid value, and skips faces with an invalid vertex. `load_scene`, for renders, loads in stages.
//! At the end of a stage that found errors, it stops and returns the first error. `inspect_scene`,
//! for checks, uses the same loader, but continues after errors. The parser of scene files stops at
//! the first error. To find further errors, a check replaces the wrong entry by blanks, and reads
//! the file again.
//!
//! The column of a wrong word is computed only for messages: `place_of` searches the statement for
//! the word again, at most twenty times for each kind of error.

use super::{FileError, Position};
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// A mistake: the statement has no valid meaning.
    Error,
    /// A probable mistake. The statement was repaired, replaced or left out.
    Warning,
    /// An assumption that the program made about the scene.
    Note,
}

impl Severity {
    /// Name of the severity in messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// A message about the files of a scene.
///
/// Shown as `file:line:column: severity: message [code]`, with the remedy on a separate line.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Severity of the finding.
    pub severity: Severity,
    /// Permanent name of this kind of finding, independent of its wording.
    pub code: &'static str,
    /// Message, place of the first occurrence, and remedy.
    pub error: FileError,
    /// Number of occurrences of this kind of finding.
    pub count: u64,
    /// Places of at most [`MAX_PLACES`] further occurrences in the same file.
    pub more: Vec<Position>,
}

/// Name of the note that the files of a scene define no light source, so a light was added.
pub const DEFAULT_LIGHT: &str = "default-light";

/// Names of the notes that a render prints, because the assumptions in these notes change the
/// picture.
const REPORTED_NOTES: [&str; 16] = [
    DEFAULT_LIGHT,
    "mtl-dialect",
    "no-library",
    "negative-lobes",
    "found-elsewhere",
    "heights-or-normals",
    "normals-as-color",
    "opacity-of-map",
    "cut-out",
    "only-material",
    "unused-pictures",
    "maps-by-name",
    "displacement",
    "skipped-elements",
    "subdivision-by-pixels",
    "vertex-colors",
];

/// Maximum number of places that a finding lists after the first place.
pub const MAX_PLACES: usize = 5;

/// Maximum number of wrong statements of a file that are reported separately.
pub(crate) const MAX_WRONG: usize = 20;

impl Finding {
    /// A finding that occurs once.
    pub fn new(severity: Severity, code: &'static str, error: FileError) -> Self {
        Self {
            severity,
            code,
            error,
            count: 1,
            more: Vec::new(),
        }
    }

    /// Converts the finding to a warning.
    pub fn warning(&self) -> Warning {
        Warning::new(self.code, self.error.to_string())
    }

    /// A finding that occurs `count` times, with the places `more` after the first.
    pub fn repeated(mut self, count: u64, more: impl IntoIterator<Item = Position>) -> Self {
        self.count = count;
        self.more = more.into_iter().take(MAX_PLACES).collect();
        self
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { severity, error, .. } = self;
        let (place, severity) = (error.place(), severity.name());
        write!(f, "{place}: {severity}: {} [{}]", error.message, self.code)?;
        if !self.more.is_empty() {
            let lines: Vec<String> = self.more.iter().map(|p| p.line.to_string()).collect();
            let listed = 1 + self.more.len() as u64;
            let rest = if self.count > listed { ", …" } else { "" };
            write!(f, "\n  also: lines {}{rest}", lines.join(", "))?;
        }
        match &error.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

/// A message that a render prints.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Permanent name of this kind of warning, independent of its wording.
    pub kind: &'static str,
    /// Text of one or more sentences: problem, place and remedy.
    pub text: String,
}

impl Warning {
    /// A warning with the text of one or more sentences.
    pub fn new(kind: &'static str, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { kind, text }
    }

    /// Returns true if the warning is a note. Notes describe assumptions. Other warnings describe
    /// likely mistakes.
    pub fn is_note(&self) -> bool {
        REPORTED_NOTES.contains(&self.kind)
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Findings of the readers, in order of discovery.
#[derive(Clone, Debug, Default)]
pub struct Findings(Vec<Finding>);

impl Findings {
    /// Copy of the findings, without the findings whose indices are in `range`.
    pub fn without(&self, range: Range<usize>) -> Self {
        let all = self.0.iter().enumerate();
        let kept = all
            .filter(|(i, _)| !range.contains(i))
            .map(|(_, finding)| finding.clone());
        Self(kept.collect())
    }

    /// Adds a finding that occurs once.
    pub fn add(&mut self, severity: Severity, code: &'static str, error: FileError) {
        self.push(Finding::new(severity, code, error));
    }

    /// Adds a finding.
    pub fn push(&mut self, finding: Finding) {
        self.0.push(finding);
    }

    /// Adds the finding that `file` has `count` more wrong statements, which were not reported
    /// separately.
    pub(crate) fn add_unlisted(&mut self, severity: Severity, file: &Path, count: usize) {
        if count > 0 {
            let error = FileError::new(file, format!("{count} more statements are wrong"));
            let error = error.help("correct those above, and check again");
            self.push(Finding::new(severity, "wrong-statement", error).repeated(count as u64, []));
        }
    }

    /// All findings.
    pub fn iter(&self) -> impl Iterator<Item = &Finding> {
        self.0.iter()
    }

    /// First finding with severity `Error`.
    pub fn first_error(&self) -> Option<&FileError> {
        let mut wrong = self.0.iter().filter(|f| f.severity == Severity::Error);
        wrong.next().map(|f| &f.error)
    }

    /// Messages that a render prints.
    pub fn warnings(&self) -> Vec<Warning> {
        let is_reported = |f: &&Finding| f.severity == Severity::Warning || REPORTED_NOTES.contains(&f.code);
        self.0.iter().filter(is_reported).map(Finding::warning).collect()
    }
}

impl IntoIterator for Findings {
    type Item = Finding;
    type IntoIter = std::vec::IntoIter<Finding>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.into_iter()
    }
}

impl Extend<Finding> for Findings {
    fn extend<T: IntoIterator<Item = Finding>>(&mut self, more: T) {
        self.0.extend(more);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finding_is_shown_with_place_severity_and_code() {
        let place = |line| Position { line, column: Some(4) };
        let error = FileError::new(Path::new("a.obj"), "two").at(place(3)).help("less");
        let finding = Finding::new(Severity::Warning, "some-name", error).repeated(9, [5, 8].map(place));
        assert_eq!(
            finding.to_string(),
            "a.obj:3:4: warning: two [some-name]\n  also: lines 5, 8, …\n  help: less"
        );
    }
}
