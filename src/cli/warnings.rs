//! `--warnings`: selection of the printed warnings about a scene. `--stats` has all warnings.

use super::printing;
use crate::guess::CameraGuess;
use crate::io::Warning;
use crate::options::named;
use crate::session::Session;
use std::path::Path;

/// Selection of printed warnings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum ShownWarnings {
    /// One line per kind, with the number of warnings.
    #[default]
    Summary,
    /// Every warning is printed.
    All,
    /// No warning is printed.
    None,
}

named! {
    ShownWarnings: "summary" => Self::Summary, "all" => Self::All, "none" => Self::None;
}

impl ShownWarnings {
    /// Prints `warnings` about the scene at `path`.
    pub fn show(self, warnings: &[Warning], path: &Path) {
        for (first, text) in self.texts(warnings, path) {
            if first.is_note() {
                printing::note(text)
            } else {
                printing::warning(text)
            }
        }
    }

    /// Prints `warnings` that are not about the files of the scene. Every warning is printed,
    /// because there are few, and `embrasure check` does not report these warnings.
    pub fn show_each(self, warnings: &[Warning]) {
        if self != Self::None {
            for warning in warnings {
                if warning.is_note() {
                    printing::note(warning)
                } else {
                    printing::warning(warning)
                }
            }
        }
    }

    /// Prints a note if the up direction of `guess`, the guess of a camera, is uncertain.
    pub fn note_doubt_about_up(self, guess: Option<&CameraGuess>) {
        if self != Self::None {
            let doubt = guess.and_then(CameraGuess::doubt_about_up);
            doubt.into_iter().for_each(printing::note);
        }
    }

    /// Warnings to print, each with its text: all warnings, or the first warning of each kind in
    /// the order of `warnings`.
    fn texts<'a>(self, warnings: &'a [Warning], path: &Path) -> Vec<(&'a Warning, String)> {
        match self {
            Self::All => warnings.iter().map(|warning| (warning, with_code(warning))).collect(),
            Self::None => Vec::new(),
            Self::Summary => {
                // First warning of each kind, and the number of further warnings of the kind
                let mut kinds: Vec<(&'a Warning, usize)> = Vec::new();
                for warning in warnings {
                    match kinds.iter_mut().find(|(first, _)| first.kind == warning.kind) {
                        Some((_, others)) => *others += 1,
                        None => kinds.push((warning, 0)),
                    }
                }
                let text = |(first, others): (&'a Warning, usize)| match others {
                    0 => (first, with_code(first)),
                    _ => (first, summary(first, others, path)),
                };
                kinds.into_iter().map(text).collect()
            }
        }
    }
}

/// A warning with its code at the end of the first line. `embrasure help CODE` explains the code.
fn with_code(warning: &Warning) -> String {
    let (line, rest) = match warning.text.split_once('\n') {
        Some((line, rest)) => (line, format!("\n{rest}")),
        None => (warning.text.as_str(), String::new()),
    };
    format!("{line} [{}]{rest}", warning.kind)
}

/// Text for the warning `first` and for `others` further warnings of its kind: the text of `first`,
/// the number `others`, a hint to `embrasure check`, and the remedy of `first`.
fn summary(first: &Warning, others: usize, path: &Path) -> String {
    let (line, remedy) = first.text.split_at(first.text.find('\n').unwrap_or(first.text.len()));
    let path = path.display();
    format!(
        "{line} (and {others} more [{}]; see `embrasure check {path}`){remedy}",
        first.kind
    )
}

/// Prints a note if the picture of `session` is a stereo picture, for a command that traces the
/// rays of one camera.
pub(super) fn note_middle_eye(session: &Session) {
    if session.camera_description().stereo.is_some() {
        printing::note("stereo: the rays start at one camera, in the middle of both eyes");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_of_a_kind_are_one_line() {
        let warnings = [
            Warning::new(
                "missing-texture",
                "a.mtl:3: texture `a.png` is missing\n  help: put the file there",
            ),
            Warning::new("default-light", "nothing emits\n  help: add a light"),
            Warning::new("missing-texture", "a.mtl:9: texture `b.png` is missing"),
            Warning::new("missing-texture", "a.mtl:12: texture `c.png` is missing"),
        ];
        let texts = |shown: ShownWarnings| -> Vec<String> {
            let texts = shown.texts(&warnings, Path::new("a.obj"));
            texts.into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(
            texts(ShownWarnings::Summary),
            [
                "a.mtl:3: texture `a.png` is missing (and 2 more [missing-texture]; see `embrasure check a.obj`)\n  help: put the file there",
                "nothing emits [default-light]\n  help: add a light"
            ]
        );
        let all = texts(ShownWarnings::All);
        assert_eq!(all.len(), 4);
        assert!(all[3].ends_with("is missing [missing-texture]"), "{}", all[3]);
        assert!(texts(ShownWarnings::None).is_empty());
    }
}
