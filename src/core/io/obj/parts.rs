//! Parts of an OBJ file: faces below the names of `o` and `g` statements.

use super::read_text;
use crate::io::statements::{split_keyword, statements};
use crate::io::{FileError, PartFilter};
use crate::math::Glob;
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::Path;

/// Names that faces stand below.
#[derive(Clone, Debug, Default)]
struct PartNames {
    /// What follows the last `o`.
    object: String,
    /// What follows the last `g`: one name, or several between blanks.
    groups: String,
}

impl PartNames {
    fn fit(&self, glob: &Glob) -> bool {
        self.all().any(|name| glob.matches(name))
    }

    /// The name of the object, that of the group as a whole, and each word of it.
    fn all(&self) -> impl Iterator<Item = &str> {
        let words = self.groups.split_whitespace().filter(|word| *word != self.groups);
        [&*self.object, &*self.groups]
            .into_iter()
            .chain(words)
            .filter(|name| !name.is_empty())
    }

    /// Follows a statement, if it is `o` or `g`.
    fn follow(&mut self, keyword: &str, rest: &str) {
        match keyword {
            "o" => self.object = rest.into(),
            "g" => self.groups = rest.into(),
            _ => {}
        }
    }
}

/// Returns true if the faces of `part` are shown. Patterns that fit a name are marked in `fits`, in the
/// order of [`PartFilter::globs`].
fn shows(filter: &PartFilter, part: &PartNames, fits: &mut [bool]) -> bool {
    for (glob, fits) in filter.globs().zip(&mut *fits) {
        *fits |= part.fit(glob);
    }
    let fits = |globs: &[Glob]| globs.iter().any(|glob| part.fit(glob));
    !fits(&filter.hide) && (filter.only.is_empty() || fits(&filter.only))
}

/// Which faces of a chunk of an OBJ file are shown.
#[derive(Clone, Debug)]
pub(super) struct PartState<'a> {
    filter: &'a PartFilter,
    names: PartNames,
    is_shown: bool,
    /// Patterns that fit a name, in the order of [`PartFilter::globs`].
    pub fits: Vec<bool>,
}

impl<'a> PartState<'a> {
    /// States at the begin of each of these consecutive `chunks`.
    pub fn of_chunks(filter: &'a PartFilter, chunks: &[&str]) -> Vec<Self> {
        let first = Self {
            filter,
            names: PartNames::default(),
            is_shown: filter.only.is_empty(),
            fits: vec![false; filter.globs().count()],
        };
        if filter.is_empty() {
            return vec![first; chunks.len()];
        }
        // The last names of each chunk
        let last_names = |chunk: &&str| {
            let mut last = [None, None];
            for (_, statement) in statements(chunk) {
                let (keyword, rest) = split_keyword(&statement);
                match keyword {
                    "o" => last[0] = Some(rest.to_string()),
                    "g" => last[1] = Some(rest.to_string()),
                    _ => {}
                }
            }
            last
        };
        let last: Vec<[Option<String>; 2]> = chunks.par_iter().map(last_names).collect();
        let mut state = first;
        let mut states = Vec::with_capacity(chunks.len());
        for [object, groups] in last {
            states.push(state.clone());
            if let Some(object) = object {
                state.names.object = object;
            }
            if let Some(groups) = groups {
                state.names.groups = groups;
            }
            state.is_shown = shows(filter, &state.names, &mut state.fits);
        }
        states
    }

    /// Returns true if the next face is shown.
    pub fn is_shown(&self) -> bool {
        self.is_shown
    }

    /// Follows an `o` or a `g` statement.
    pub fn follow(&mut self, keyword: &str, rest: &str) {
        if !self.filter.is_empty() {
            self.names.follow(keyword, rest);
            self.is_shown = shows(self.filter, &self.names, &mut self.fits);
        }
    }
}

/// Names of the parts of the OBJ file `path`, each once, in the order of the file.
pub fn part_names(path: &Path) -> Result<Vec<String>, FileError> {
    let text = read_text(path)?;
    let (mut names, mut known) = (Vec::new(), HashSet::new());
    for (_, statement) in statements(&text) {
        let (keyword, rest) = split_keyword(&statement);
        if matches!(keyword, "o" | "g") && !rest.is_empty() && known.insert(rest.to_string()) {
            names.push(rest.to_string());
        }
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::obj::parse::{Chunks, Wanted, parse};
    use crate::math::DVec3;

    /// Parts go on over the ends of chunks.
    #[test]
    fn chunks_change_no_part() {
        let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_string();
        for i in 0..9 {
            text += &format!("o part{}\nf 1 2 3\ng {i} x\nf 1 2 3\nf 1 2 3\n", i % 3);
        }
        let glob = |pattern| vec![Glob::new(pattern)];
        for (hide, only, expected) in [
            (vec![], vec![], 28),
            (glob("part1"), vec![], 19),
            (glob("4"), vec![], 25),
            // The group stays while the object changes.
            (vec![], glob("4"), 3),
            (glob("x"), vec![], 2),
            (glob("part0"), glob("x"), 18),
        ] {
            let filter = PartFilter { hide, only };
            for bytes in (1..text.len()).step_by(7) {
                let wanted = Wanted {
                    origin: DVec3::ZERO,
                    keep_lines: false,
                    parts: &filter,
                };
                let outline = parse(Path::new("t.obj"), &Chunks::count(&text, bytes), wanted, &|_| ()).unwrap();
                let corners: usize = outline.sections.iter().map(|section| section.corner_count()).sum();
                assert_eq!(corners, 3 * expected, "{filter:?}, chunks of {bytes} bytes");
                assert!(outline.part_fits.iter().all(|fits| *fits));
            }
        }
    }
}
