use super::polygon::MAX_CLIPPED;
use crate::io::{FileError, Finding, MAX_PLACES, Position, Severity};
use std::path::Path;

/// Maximum length of the name of an object, or of the names of its groups, in bytes. A limit is
/// needed because a file may have as many parts as faces, and messages, lists and metadata contain
/// every name in full.
pub(super) const MAX_NAME: usize = 1000;
/// Maximum number of unknown keywords that the warning lists. Further keywords are only counted.
const MAX_NAMED: usize = 8;

/// A repair or an assumption of the reader.
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
    /// A face whose vertex has wrong coordinates.
    LeftOutFace,
    /// A colour that is not three or four finite numbers.
    BadColor,
    /// A `#MRGB` line with a group that is not eight hexadecimal digits.
    BadMrgb,
    /// A part name of more than [`MAX_NAME`] bytes.
    LongName,
}

/// An element that is not rendered.
#[derive(Clone, Copy)]
pub(super) enum SkippedElement {
    /// A line of any number of points.
    Line,
    /// A point.
    Point,
    /// A free-form curve.
    Curve,
    /// A free-form surface.
    Surface,
}

/// Noun and keyword of each kind, indexed by [`SkippedElement`].
const SKIPPED: [[&str; 2]; 4] = [["line", "l"], ["point", "p"], ["curve", "curv"], ["surface", "surf"]];

const FREE_FORM: &str = "it belongs to free-form curves and surfaces, which are skipped";
const DISPLAY: &str = "it only changes the display in Wavefront's programs";

/// Statements of the format that have no effect: keyword and reason.
const IGNORED: [(&str, &str); 27] = [
    ("vp", FREE_FORM),
    ("cstype", FREE_FORM),
    ("deg", FREE_FORM),
    ("bmat", FREE_FORM),
    ("step", FREE_FORM),
    ("parm", FREE_FORM),
    ("trim", FREE_FORM),
    ("hole", FREE_FORM),
    ("scrv", FREE_FORM),
    ("sp", FREE_FORM),
    ("end", FREE_FORM),
    ("con", FREE_FORM),
    ("mg", FREE_FORM),
    ("ctech", FREE_FORM),
    ("stech", FREE_FORM),
    ("res", FREE_FORM),
    ("bevel", DISPLAY),
    ("c_interp", DISPLAY),
    ("d_interp", DISPLAY),
    ("lod", DISPLAY),
    ("maplib", "textures come from material libraries"),
    ("usemap", "textures come from material libraries"),
    ("shadow_obj", "the object itself casts its shadow"),
    ("trace_obj", "the object itself is reflected"),
    ("call", "other files are not read; join the files"),
    ("csh", "commands are not run"),
    ("-csh", "commands are not run"),
];

/// Index in [`IGNORED`] of a statement without effect. `None` if the format has no such statement.
pub(super) fn ignored(keyword: &str) -> Option<usize> {
    IGNORED.iter().position(|(known, _)| *known == keyword)
}

/// Counts of remarks of each kind, and the lines of the first remarks of each kind.
#[derive(Default)]
pub(super) struct Remarks {
    /// Tallies, indexed by [`Remark`].
    tallies: [Tally; 9],
    /// Elements that are not rendered: their numbers, indexed by [`SkippedElement`].
    skipped_counts: [u64; 4],
    skipped: Tally,
    /// Tallies, indexed by [`IGNORED`].
    ignored: [Tally; IGNORED.len()],
    /// Tally of unknown statements.
    unknown: Tally,
    /// First unknown keywords, each once.
    keywords: Vec<String>,
}

#[derive(Default)]
struct Tally {
    count: u64,
    /// Lines of the first statements that were counted.
    lines: Vec<usize>,
}

impl Remarks {
    pub fn add(&mut self, remark: Remark, line: usize) {
        self.tallies[remark as usize].add(1, &[line]);
    }

    /// Counts elements that are not rendered.
    pub fn skip(&mut self, what: SkippedElement, count: usize, line: usize) {
        self.skipped_counts[what as usize] += count as u64;
        self.skipped.add(count as u64, &[line]);
    }

    /// Line of the first element that is not rendered; 0 if there is none.
    pub fn first_skipped_line(&self) -> usize {
        self.skipped.lines.first().copied().unwrap_or(0)
    }

    /// Returns true if lines or points are not rendered.
    pub fn skips_wires(&self) -> bool {
        [SkippedElement::Line, SkippedElement::Point]
            .iter()
            .any(|kind| self.skipped_counts[*kind as usize] > 0)
    }

    /// Text with the number of elements of each kind that are not rendered, such as `2 lines (l)
    /// and 1 point (p)`. `None` if all are rendered.
    pub fn skipped(&self) -> Option<String> {
        let counts = SKIPPED.iter().zip(self.skipped_counts).filter(|(_, count)| *count > 0);
        let words = counts.map(|([noun, keyword], count)| {
            let plural = if count == 1 { "" } else { "s" };
            format!("{count} {noun}{plural} (`{keyword}`)")
        });
        let words: Vec<String> = words.collect();
        match words.as_slice() {
            [] => None,
            [one] => Some(one.clone()),
            [others @ .., last] => Some(format!("{} and {last}", others.join(", "))),
        }
    }

    /// Counts a statement without effect, by its index in [`IGNORED`].
    pub fn ignore(&mut self, index: usize, line: usize) {
        self.ignored[index].add(1, &[line]);
    }

    /// Counts an unknown statement.
    pub fn add_unknown(&mut self, keyword: &str, line: usize) {
        self.unknown.add(1, &[line]);
        self.name(keyword);
    }

    /// Adds the remarks about the next chunk of the file.
    pub fn append(&mut self, later: &Self) {
        for (tally, more) in self.tallies.iter_mut().zip(&later.tallies) {
            tally.add(more.count, &more.lines);
        }
        for (count, more) in self.skipped_counts.iter_mut().zip(later.skipped_counts) {
            *count += more;
        }
        self.skipped.add(later.skipped.count, &later.skipped.lines);
        for (tally, more) in self.ignored.iter_mut().zip(&later.ignored) {
            tally.add(more.count, &more.lines);
        }
        self.unknown.add(later.unknown.count, &later.unknown.lines);
        later.keywords.iter().for_each(|keyword| self.name(keyword));
    }

    /// Converts all remarks to findings.
    pub fn findings(&self, path: &Path) -> Vec<Finding> {
        // Each message has a form for one occurrence, and a form for several occurrences.
        let long = format!("of more than {MAX_CLIPPED} corners");
        let keywords = self.keywords.join(", ");
        let words = [
            (
                "short-face",
                [
                    "face of fewer than 3 corners is skipped",
                    "faces of fewer than 3 corners are skipped",
                ]
                .map(String::from),
            ),
            (
                "long-face",
                [
                    format!("face {long} is triangulated as if it were convex"),
                    format!("faces {long} are triangulated as if they were convex"),
                ],
            ),
            (
                "bad-normal",
                [
                    "normal is zero or not finite, and counts as missing",
                    "normals are zero or not finite, and count as missing",
                ]
                .map(String::from),
            ),
            (
                "bad-texture-coordinate",
                [
                    "texture coordinate is not finite, and counts as 0",
                    "texture coordinates are not finite, and count as 0",
                ]
                .map(String::from),
            ),
            (
                "bad-smoothing-group",
                [
                    "smoothing group is neither a number nor `off`, and counts as `off`",
                    "smoothing groups are neither a number nor `off`, and count as `off`",
                ]
                .map(String::from),
            ),
            (
                "left-out-face",
                ["face is", "faces are"].map(|faces| format!("{faces} left out, since a vertex has wrong coordinates")),
            ),
            (
                "bad-vertex-color",
                [
                    "colour is not three or four finite numbers, and counts as missing",
                    "colours are not three or four finite numbers, and count as missing",
                ]
                .map(String::from),
            ),
            (
                "bad-vertex-color",
                ["#MRGB line has", "#MRGB lines have"].map(|lines| {
                    format!("{lines} a group that is not 8 hexadecimal digits; the rest of the line is not used")
                }),
            ),
            (
                "long-part-name",
                ["name of `o` or `g` is", "names of `o` or `g` are"]
                    .map(|names| format!("{names} cut to {MAX_NAME} bytes")),
            ),
            (
                "unknown-statement",
                ["statement has", "statements have"].map(|statements| format!("{statements} no effect ({keywords})")),
            ),
        ];
        let tallies = self.tallies.iter().chain([&self.unknown]);
        let warnings = words
            .into_iter()
            .zip(tallies)
            .filter_map(|((code, [one, several]), tally)| {
                let message = match tally.count {
                    1 => format!("1 {one}"),
                    count => format!("{count} {several}, the first in this line"),
                };
                tally.finding(path, Severity::Warning, code, message)
            });
        let skipped = self.skipped().and_then(|elements| {
            let verb = if self.skipped.count == 1 {
                "is skipped"
            } else {
                "are skipped, the first in this line"
            };
            let message = format!("{elements} {verb}");
            let finding = self.skipped.finding(path, Severity::Note, "skipped-elements", message);
            let has_wires = self.skipped_counts[SkippedElement::Line as usize]
                + self.skipped_counts[SkippedElement::Point as usize]
                > 0;
            finding.map(|mut finding| {
                if has_wires {
                    let help = "--line-width W renders lines as tubes and points as spheres of that diameter";
                    finding.error = finding.error.help(help);
                }
                finding
            })
        });
        let ignored = IGNORED.iter().zip(&self.ignored);
        let ignored = ignored.filter_map(|((keyword, why), tally)| {
            let message = match tally.count {
                1 => format!("`{keyword}` has no effect: {why}"),
                count => format!("{count} statements `{keyword}` have no effect, the first in this line: {why}"),
            };
            // Statements of free-form elements and of the display cannot change the picture. Other
            // statements may change it.
            let severity = if [FREE_FORM, DISPLAY].contains(why) {
                Severity::Note
            } else {
                Severity::Warning
            };
            tally.finding(path, severity, "ignored-statement", message)
        });
        warnings.chain(skipped).chain(ignored).collect()
    }

    fn name(&mut self, keyword: &str) {
        if self.keywords.len() < MAX_NAMED && !self.keywords.iter().any(|k| k == keyword) {
            self.keywords.push(keyword.into());
        }
    }
}

impl Tally {
    /// Finding with the message `message` and the places of the remark. `None` if the remark does
    /// not occur.
    fn finding(&self, path: &Path, severity: Severity, code: &'static str, message: String) -> Option<Finding> {
        let mut places = self.lines.iter().map(|&line| Position::line(line));
        let first = FileError::new(path, message).at(places.next()?);
        Some(Finding::new(severity, code, first).repeated(self.count, places))
    }

    fn add(&mut self, count: u64, lines: &[usize]) {
        self.count += count;
        let free = (1 + MAX_PLACES).saturating_sub(self.lines.len());
        self.lines.extend(lines.iter().take(free));
    }
}
