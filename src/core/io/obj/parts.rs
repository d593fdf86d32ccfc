//! Parts of an OBJ file: faces that follow the same `o` and `g` statements.
//!
//! A file may have as many parts as faces. Chunks are read in parallel. To save memory, each chunk
//! copies the names of its parts into one text. When chunks are joined, parts get ids that are
//! valid for the whole file.

use super::outline::Section;
use super::remarks::MAX_NAME;
use crate::geometry::{PartList, PartNames, UNNAMED};
use crate::io::PartFilter;
use crate::io::statements::split_keyword;

/// Names of the part to which the next faces belong.
#[derive(Clone, Debug, Default)]
pub(super) struct CurrentNames {
    /// Text of the last `o`.
    object: String,
    /// Text of the last `g`: one name, or several names separated by blanks.
    groups: String,
}

impl CurrentNames {
    /// Updates the names by the last `o` and the last `g` statement of a text.
    pub fn follow(&mut self, [object, groups]: &[Option<String>; 2]) {
        let name = |statement: &Option<String>| statement.as_deref().map(|text| cut(split_keyword(text).1).to_string());
        self.object = name(object).unwrap_or(std::mem::take(&mut self.object));
        self.groups = name(groups).unwrap_or(std::mem::take(&mut self.groups));
    }
}

/// Part of the next face of a chunk of an OBJ file.
#[derive(Debug)]
pub(super) struct PartState<'a> {
    filter: &'a PartFilter,
    /// False if the names are needed only for the filter.
    keep_names: bool,
    current: CurrentNames,
    /// True if a name has changed since the last face.
    is_new: bool,
    is_shown: bool,
    /// Parts in the order of their first faces, with repetitions.
    parts: PartList,
    /// Number of shown faces before the first face of each part.
    starts: Vec<u32>,
}

impl<'a> PartState<'a> {
    /// State at the beginning of a chunk, with the names `before`. If `keep_names` is false, no
    /// parts are stored.
    pub fn new(filter: &'a PartFilter, keep_names: bool, before: &CurrentNames) -> Self {
        Self {
            filter,
            keep_names,
            current: before.clone(),
            is_new: true,
            is_shown: true,
            parts: PartList::default(),
            starts: Vec::new(),
        }
    }

    /// Reads an `o` statement with the name `name`.
    pub fn begin_object(&mut self, name: &str) {
        replace(&mut self.current.object, name);
        self.is_new = true;
    }

    /// Reads a `g` statement with the names `names`.
    pub fn begin_groups(&mut self, names: &str) {
        replace(&mut self.current.groups, names);
        self.is_new = true;
    }

    /// Returns true if the next face is shown. `faces` is the number of faces that the chunk has
    /// before this face.
    #[inline]
    pub fn is_shown(&mut self, faces: usize) -> bool {
        if self.is_new {
            self.begin_part(faces);
        }
        self.is_shown
    }

    /// Begins the part with the current names.
    fn begin_part(&mut self, faces: usize) {
        self.is_new = false;
        let CurrentNames { object, groups } = &self.current;
        if self.keep_names {
            self.starts.push(faces as u32);
            self.parts.push(object, groups);
        }
        if !self.filter.is_empty() {
            let mut names = PartNames::default();
            let part = names.find_or_add(object, groups);
            self.is_shown = self.filter.shows(&names, part);
        }
    }

    /// Frees unused memory of the list of parts.
    pub fn shrink_to_fit(&mut self) {
        self.parts.shrink_to_fit();
        self.starts.shrink_to_fit();
    }

    /// Parts of the chunk, with repetitions.
    pub fn parts(&self) -> &PartList {
        &self.parts
    }

    /// Assigns the parts of the chunk to the faces of `section`. Takes the ids of these parts from
    /// the start of `numbers`, and removes them there.
    pub fn number(&self, numbers: &mut &[u32], section: &mut Section) {
        let (of_chunk, rest) = numbers.split_at(self.starts.len().min(numbers.len()));
        *numbers = rest;
        section.reserve_parts(of_chunk.len());
        for (&face, &part) in self.starts.iter().zip(of_chunk) {
            section.begin_part(face, part);
        }
    }
}

/// Sets `text` to `new` without a new allocation. A long name is cut.
fn replace(text: &mut String, new: &str) {
    text.clear();
    text.push_str(cut(new));
}

/// The first [`MAX_NAME`] bytes of a name.
fn cut(name: &str) -> &str {
    if name.len() <= MAX_NAME {
        return name;
    }
    let end = (0..=MAX_NAME).rev().find(|&end| name.is_char_boundary(end));
    end.and_then(|end| name.get(..end)).unwrap_or(name)
}

/// Rules of a scene file that replace the materials of parts.
#[derive(Debug, Default)]
pub(super) struct MaterialRules {
    /// For each part, [`UNNAMED`] first, the index of its list of rules. Empty if all parts have
    /// the first list.
    of_parts: Vec<u32>,
    /// Distinct lists of indices of rules. The first list is empty.
    lists: Vec<Vec<u32>>,
}

impl MaterialRules {
    /// Finds the rules for each part.
    pub fn new(filter: &PartFilter, names: &PartNames) -> Self {
        let mut rules = Self {
            of_parts: Vec::new(),
            lists: vec![Vec::new()],
        };
        if filter.rules.iter().any(|rule| rule.has_material) {
            for part in std::iter::once(UNNAMED).chain(names.parts()) {
                let list = filter.material_rules(names, part);
                let known = rules.lists.iter().position(|known| *known == list);
                rules.of_parts.push(known.unwrap_or(rules.lists.len()) as u32);
                if known.is_none() {
                    rules.lists.push(list);
                }
            }
        }
        rules
    }

    /// Returns true if no rule replaces the material of a part.
    pub fn is_empty(&self) -> bool {
        self.lists.len() <= 1
    }

    /// Index of the list with the rules for `part`.
    pub fn list_of(&self, part: u32) -> u32 {
        self.of_parts.get(part as usize).copied().unwrap_or(0)
    }

    /// Indices of the rules in the list with the index `number`.
    pub fn list(&self, number: u32) -> &[u32] {
        self.lists.get(number as usize).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::obj::{chunk::DataSelection, counts::Chunks, parse::parse};
    use crate::math::Glob;
    use std::path::Path;

    #[test]
    fn long_names_are_cut_between_characters() {
        assert_eq!(cut(&"x".repeat(MAX_NAME)).len(), MAX_NAME);
        assert_eq!(cut(&"x".repeat(MAX_NAME + 1)).len(), MAX_NAME);
        // Three bytes per character
        assert_eq!(cut(&"€".repeat(MAX_NAME)), "€".repeat(MAX_NAME / 3));
        assert_eq!(cut("short"), "short");
    }

    /// The borders of chunks do not change the part of a face.
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
            // A new `o` statement does not change the current group.
            (vec![], glob("4"), 3),
            (glob("x"), vec![], 2),
            (glob("part0"), glob("x"), 18),
        ] {
            let filter = PartFilter {
                hide,
                only,
                rules: Vec::new(),
            };
            for bytes in (1..text.len()).step_by(7) {
                let selection = DataSelection::of_faces(&filter);
                let outline = parse(Path::new("t.obj"), &Chunks::count(&text, bytes), selection, &|_| ()).unwrap();
                let corners: usize = outline.sections.iter().map(|section| section.corner_count()).sum();
                assert_eq!(corners, 3 * expected, "{filter:?}, chunks of {bytes} bytes");
                for glob in filter.globs() {
                    assert!(outline.parts.parts().any(|part| outline.parts.fits(part, glob)));
                }
            }
        }
    }
}
