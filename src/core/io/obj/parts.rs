//! Parts of an OBJ file: faces that follow the same `o` and `g` statements.
//!
//! A file may have a part for each face. Chunks that are read in parallel therefore store the
//! places of the statements. Names are read once, when chunks are joined.

use super::outline::Section;
use crate::geometry::{PartNames, UNNAMED};
use crate::io::PartFilter;
use crate::io::statements::{split_keyword, statements};

/// Byte offset that means that a statement is before the chunk.
const BEFORE: u32 = u32::MAX;

/// Part names of the following faces.
#[derive(Clone, Debug, Default)]
pub(super) struct CurrentNames {
    /// Text of the last `o`.
    object: String,
    /// Text of the last `g`: one name, or several separated by blanks.
    groups: String,
}

impl CurrentNames {
    /// Updates the names with the last `o` and the last `g` statement of a text.
    pub fn follow(&mut self, statements: &[Option<String>; 2]) {
        for (kind, statement) in statements.iter().enumerate() {
            if let Some(statement) = statement {
                self.set(kind, statement);
            }
        }
    }

    /// Updates the names with the statements at the byte offsets `places` of `text`.
    fn follow_places(&mut self, text: &str, places: [u32; 2]) {
        for (kind, place) in places.into_iter().enumerate().filter(|(_, place)| *place != BEFORE) {
            let rest = text.get(place as usize..).unwrap_or_default();
            if let Some((_, statement)) = statements(rest).next() {
                self.set(kind, &statement);
            }
        }
    }

    /// Updates the name of an `o` statement (`kind` 0) or a `g` statement (`kind` 1).
    fn set(&mut self, kind: usize, statement: &str) {
        let name = if kind == 0 { &mut self.object } else { &mut self.groups };
        name.clear();
        name.push_str(split_keyword(statement).1);
    }
}

/// A face whose part names differ from the names of the face before.
#[derive(Clone, Copy, Debug)]
struct NewNames {
    /// Number of shown faces before this face.
    face: u32,
    /// Byte offsets of the last `o` and the last `g` statement in the chunk.
    places: [u32; 2],
}

/// Part of the next face of a chunk of an OBJ file.
#[derive(Debug)]
pub(super) struct PartState<'a> {
    filter: &'a PartFilter,
    text: &'a str,
    /// Names at the beginning of the chunk.
    before: &'a CurrentNames,
    /// Byte offsets of the last `o` and the last `g` statement.
    places: [u32; 2],
    /// True if a name has changed since the last face.
    is_new: bool,
    is_shown: bool,
    changes: Vec<NewNames>,
}

impl<'a> PartState<'a> {
    /// State at the beginning of a chunk `text`, with the names `before`.
    pub fn new(filter: &'a PartFilter, text: &'a str, before: &'a CurrentNames) -> Self {
        Self {
            filter,
            text,
            before,
            places: [BEFORE; 2],
            is_new: true,
            is_shown: true,
            changes: Vec::new(),
        }
    }

    /// Reads an `o` statement that begins at the byte `place` of the chunk.
    pub fn begin_object(&mut self, place: usize) {
        self.places[0] = place as u32;
        self.is_new = true;
    }

    /// Reads a `g` statement that begins at the byte `place` of the chunk.
    pub fn begin_groups(&mut self, place: usize) {
        self.places[1] = place as u32;
        self.is_new = true;
    }

    /// Returns true if the next face is shown. `faces` is the number of faces of the chunk before
    /// it.
    pub fn is_shown(&mut self, faces: usize) -> bool {
        if self.is_new {
            self.is_new = false;
            let (face, places) = (faces as u32, self.places);
            self.changes.push(NewNames { face, places });
            if !self.filter.is_empty() {
                let mut current = self.before.clone();
                current.follow_places(self.text, places);
                let mut names = PartNames::default();
                let part = names.find_or_add(&current.object, &current.groups);
                self.is_shown = self.filter.shows(&names, part);
            }
        }
        self.is_shown
    }

    /// Frees unused memory of the list of changes.
    pub fn shrink_to_fit(&mut self) {
        self.changes.shrink_to_fit();
    }

    /// Maximum number of parts of the chunk.
    pub fn count(&self) -> usize {
        self.changes.len()
    }

    /// Adds the parts of the chunk to `names`, and assigns them to its faces.
    pub fn number(&self, names: &mut PartNames, section: &mut Section) {
        let mut current = self.before.clone();
        let mut last = [BEFORE; 2];
        section.reserve_parts(self.changes.len());
        for NewNames { face, places } in &self.changes {
            let is_new = |kind: usize| {
                if places[kind] == last[kind] {
                    BEFORE
                } else {
                    places[kind]
                }
            };
            current.follow_places(self.text, [0, 1].map(is_new));
            last = *places;
            section.begin_part(*face, names.find_or_add(&current.object, &current.groups));
        }
    }
}

/// Rules of a scene file that replace the materials of parts.
#[derive(Debug, Default)]
pub(super) struct MaterialRules {
    /// For each part, [`UNNAMED`] first, the index of its list of rules. Empty if all parts have
    /// the first list.
    of_parts: Vec<u32>,
    /// Distinct lists of indices of rules. The first one is empty.
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

    /// Index of the list of rules for `part`.
    pub fn list_of(&self, part: u32) -> u32 {
        self.of_parts.get(part as usize).copied().unwrap_or(0)
    }

    /// Indices of the rules in list `number`.
    pub fn list(&self, number: u32) -> &[u32] {
        self.lists.get(number as usize).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::obj::{chunk::DataSelection, counts::Chunks, parse::parse};
    use crate::math::{DVec3, Glob};
    use std::path::Path;

    /// Parts continue across chunks.
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
            // If the object changes, the group stays.
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
                let selection = DataSelection {
                    origin: DVec3::ZERO,
                    keep_lines: false,
                    keep_wires: false,
                    parts: &filter,
                };
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
