//! Findings: what readers of files and `embrasure check` say of a scene.
//!
//! A finding has a severity, a name that stays, a place, and a count. One reader serves renders and
//! checks. It leaves a wrong statement out or uses the nearest right value, leaves out faces with a
//! wrong `v`, and reads on. `load_scene` ends with the first error as soon
//! as a part of the work is done, and `inspect_scene` is the same loader, told to go on. A wrong
//! entry of a scene file is blanked and the file read again, since the parser stops at the first
//! error.
//!
//! Columns are computed when there is something to say: `place_of` searches the statement for the word once more, at most twenty times each.

use super::{FileError, Position};
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Wrong: it cannot be what is meant.
    Error,
    /// Likely not meant; it was repaired, replaced or left out.
    Warning,
    /// An assumption.
    Note,
}

impl Severity {
    /// The word that users read.
    pub fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }
}

/// Something worth a word about a scene's files.
///
/// Shown as `file:line:column: severity: message [code]`, with the remedy on a line of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// A name that stays the same, whatever the words.
    pub code: &'static str,
    /// Message, place of the first occurrence, and remedy.
    pub error: FileError,
    /// Number of findings of this kind.
    pub count: u64,
    /// Places of the next ones in the same file, not all of them if there are many.
    pub more: Vec<Position>,
}

/// Name of the note that nothing in a scene emits light, which is why it has a light that its files do not name.
pub const DEFAULT_LIGHT: &str = "default-light";

/// Notes that a render tells, since what they assume changes the picture: the light, the dialect of
/// a library, or that there is none, files that lie elsewhere than named, pictures that decide
/// between heights and normals or on opacity, textures and materials by name, pictures that are not
/// used, displacements, elements that are not rendered, and colours of vertices.
const TOLD_NOTES: [&str; 13] = [
    DEFAULT_LIGHT,
    "mtl-dialect",
    "no-library",
    "negative-lobes",
    "found-elsewhere",
    "heights-or-normals",
    "cut-out",
    "only-material",
    "unused-pictures",
    "maps-by-name",
    "displacement",
    "skipped-elements",
    "vertex-colors",
];

/// Places that a finding names besides the first.
pub const MAX_PLACES: usize = 5;

/// Wrong statements of a file that are told one by one.
pub(crate) const MAX_WRONG: usize = 20;

impl Finding {
    /// Something that is there once.
    pub fn new(severity: Severity, code: &'static str, error: FileError) -> Self {
        Self {
            severity,
            code,
            error,
            count: 1,
            more: Vec::new(),
        }
    }

    /// The finding as a warning.
    pub fn warning(&self) -> Warning {
        Warning::new(self.code, self.error.to_string())
    }

    /// Something that is there `count` times, at the places `more` besides the first.
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
            let told = 1 + self.more.len() as u64;
            let rest = if self.count > told { ", …" } else { "" };
            write!(f, "\n  also: lines {}{rest}", lines.join(", "))?;
        }
        match &error.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

/// What a render should not keep to itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Name of its kind, which stays the same, whatever the words.
    pub kind: &'static str,
    /// Sentences: what, where, and the remedy.
    pub text: String,
}

impl Warning {
    /// A warning in sentences.
    pub fn new(kind: &'static str, text: impl Into<String>) -> Self {
        let text = text.into();
        Self { kind, text }
    }

    /// Whether the warning is a note: it names an assumption. Other warnings name likely mistakes.
    pub fn is_note(&self) -> bool {
        TOLD_NOTES.contains(&self.kind)
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// What readers find, in the order in which they do.
#[derive(Clone, Debug, Default)]
pub struct Findings(Vec<Finding>);

impl Findings {
    /// These findings without those of a range.
    pub fn without(&self, range: Range<usize>) -> Self {
        let all = self.0.iter().enumerate();
        let kept = all
            .filter(|(i, _)| !range.contains(i))
            .map(|(_, finding)| finding.clone());
        Self(kept.collect())
    }

    /// Adds something that is there once.
    pub fn add(&mut self, severity: Severity, code: &'static str, error: FileError) {
        self.push(Finding::new(severity, code, error));
    }

    /// Adds a finding.
    pub fn push(&mut self, finding: Finding) {
        self.0.push(finding);
    }

    /// Adds that a file has `count` wrong statements more than were told.
    pub(crate) fn add_untold(&mut self, severity: Severity, file: &Path, count: usize) {
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

    /// The first thing that is wrong.
    pub fn first_error(&self) -> Option<&FileError> {
        let mut wrong = self.0.iter().filter(|f| f.severity == Severity::Error);
        wrong.next().map(|f| &f.error)
    }

    /// What a render should not keep to itself.
    pub fn warnings(&self) -> Vec<Warning> {
        let told = |f: &&Finding| f.severity == Severity::Warning || TOLD_NOTES.contains(&f.code);
        self.0.iter().filter(told).map(Finding::warning).collect()
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
    fn findings_are_shown_as_editors_read_them() {
        let place = |line| Position { line, column: Some(4) };
        let error = FileError::new(Path::new("a.obj"), "two").at(place(3)).help("less");
        let finding = Finding::new(Severity::Warning, "some-name", error).repeated(9, [5, 8].map(place));
        assert_eq!(
            finding.to_string(),
            "a.obj:3:4: warning: two [some-name]\n  also: lines 5, 8, …\n  help: less"
        );
    }
}
