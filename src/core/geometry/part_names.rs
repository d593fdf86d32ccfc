use crate::math::Glob;
use crate::math::hash::mix;
use hashbrown::HashTable;
use hashbrown::hash_table::Entry;
use std::borrow::Cow;

/// Part of triangles without a name.
pub const UNNAMED: u32 = 0;

/// List of part names. The name of a part consists of the name of an object and the names of its
/// groups. A file may have as many parts as triangles, so all names are stored in one text. If a
/// part has the same name of the object or of the groups as the previous part, this name is stored
/// only once. The text is therefore not longer than the statements of the file that name the parts.
///
/// Parts are numbered from 1.
#[derive(Clone, Debug, Default)]
pub struct PartList {
    text: String,
    places: Vec<Places>,
}

/// Places of the two names of a part in the text.
#[derive(Clone, Copy, Debug, Default)]
struct Places {
    object: Place,
    groups: Place,
}

/// Start and end of a name in the text.
type Place = [u32; 2];

impl PartList {
    /// Adds a part, and returns its number. A name is left out if the text would be longer than
    /// 4 GiB.
    pub fn push(&mut self, object: &str, groups: &str) -> u32 {
        let last = self.places.last().copied().unwrap_or_default();
        let object = self.place(object, last.object);
        let groups = self.place(groups, last.groups);
        self.places.push(Places { object, groups });
        self.places.len() as u32
    }

    /// Returns the place of `name` in the text. If the text at `last` is `name`, this is `last`.
    /// Otherwise `name` is appended.
    fn place(&mut self, name: &str, last: Place) -> Place {
        if self.text(last) == name {
            return last;
        }
        let ends = [self.text.len(), self.text.len() + name.len()].map(u32::try_from);
        let [Ok(start), Ok(end)] = ends else {
            return Place::default();
        };
        self.text.push_str(name);
        [start, end]
    }

    /// Name of the object of a part; empty if the part has no object name.
    pub fn object(&self, part: u32) -> &str {
        self.text(self.places(part).object)
    }

    /// Names of the groups of a part, as in the file: one name, or several separated by blanks.
    pub fn groups(&self, part: u32) -> &str {
        self.text(self.places(part).groups)
    }

    /// Names of the object and of the groups of each part.
    fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        self.places
            .iter()
            .map(|places| (self.text(places.object), self.text(places.groups)))
    }

    /// Frees unused memory.
    pub fn shrink_to_fit(&mut self) {
        self.text.shrink_to_fit();
        self.places.shrink_to_fit();
    }

    fn bytes(&self) -> usize {
        self.text.len() + size_of_val(self.places.as_slice())
    }

    fn places(&self, part: u32) -> Places {
        let index = (part as usize).checked_sub(1);
        index
            .and_then(|index| self.places.get(index))
            .copied()
            .unwrap_or_default()
    }

    fn text(&self, [start, end]: Place) -> &str {
        self.text.get(start as usize..end as usize).unwrap_or_default()
    }
}

/// Unique names of parts. The name of a part consists of the name of an object and the names of its
/// groups. The hash table contains numbers of parts, not names, and exists only while parts are
/// added.
///
/// Parts are numbered from 1. [`UNNAMED`] is the part without names.
#[derive(Clone, Debug, Default)]
pub struct PartNames {
    list: PartList,
    /// Parts by the hash of their names.
    table: HashTable<Slot>,
}

/// A part in the hash table.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// Hash of the names of the part. It is compared first, so that the names of different parts
    /// are rarely compared.
    hash: u32,
    part: u32,
}

impl PartNames {
    /// Returns the part with these names, and adds the part if it is new. A name is left out if the
    /// text would be longer than 4 GiB.
    pub fn find_or_add(&mut self, object: &str, groups: &str) -> u32 {
        if object.is_empty() && groups.is_empty() {
            return UNNAMED;
        }
        if self.table.len() < self.len() {
            // Fill the table again: [`Self::shrink_to_fit`] freed it
            self.fill_table();
        }
        find_or_push(&mut self.list, &mut self.table, hash(object, groups), object, groups)
    }

    /// Adds the parts of `other`. Returns the new number of each part of `other`, by its old
    /// number. The first entry is for [`UNNAMED`].
    pub fn append(&mut self, other: &Self) -> Vec<u32> {
        let parts = other
            .parts()
            .map(|part| self.find_or_add(other.object(part), other.groups(part)));
        std::iter::once(UNNAMED).chain(parts).collect()
    }

    /// Unique names of the parts of `lists`, and the number of each part, in the order of the
    /// lists.
    ///
    /// If each face is a part, nearly all names differ. With a hash table of all names, cache
    /// misses would take most of the time. Each hash is therefore first mapped to a bit of a bit
    /// set, which has 16 to 32 bits per part. Only names whose bit is set by several names are
    /// compared.
    pub fn join<'l>(lists: impl Iterator<Item = &'l PartList> + Clone) -> (Self, Vec<u32>) {
        let sum =
            |(count, bytes): (usize, usize), list: &PartList| (count + list.places.len(), bytes + list.text.len());
        let (count, bytes) = lists.clone().fold((0, 0), sum);
        let mut names = Self {
            list: PartList {
                text: String::with_capacity(bytes),
                places: Vec::with_capacity(count),
            },
            table: HashTable::new(),
        };
        let of_all = |list: &'l PartList| list.iter();
        let mut hashes = Vec::with_capacity(count);
        hashes.extend(
            lists
                .clone()
                .flat_map(of_all)
                .map(|(object, groups)| hash(object, groups)),
        );
        let bits = (16 * count).next_power_of_two().clamp(64, 1 << 32);
        let place = |hash: u32| {
            let bit = hash as usize & (bits - 1);
            (bit / 64, 1u64 << (bit % 64))
        };
        let (mut once, mut twice) = (vec![0u64; bits / 64], vec![0u64; bits / 64]);
        for &hash in &hashes {
            let (word, mask) = place(hash);
            twice[word] |= once[word] & mask;
            once[word] |= mask;
        }
        drop(once);
        let mut repeated = HashTable::new();
        let mut numbers = hashes;
        for ((object, groups), number) in lists.flat_map(of_all).zip(&mut numbers) {
            let hash = *number;
            let (word, mask) = place(hash);
            *number = if object.is_empty() && groups.is_empty() {
                UNNAMED
            } else if twice[word] & mask == 0 {
                names.list.push(object, groups)
            } else {
                find_or_push(&mut names.list, &mut repeated, hash, object, groups)
            };
        }
        names.list.shrink_to_fit();
        (names, numbers)
    }

    /// Frees the memory that is needed only to add names. Names can still be added and found later.
    pub fn shrink_to_fit(&mut self) {
        self.table = HashTable::new();
        self.list.shrink_to_fit();
    }

    /// Number of parts with names.
    pub fn len(&self) -> usize {
        self.list.places.len()
    }

    /// Returns true if no part has a name.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Parts with names, in the order of addition.
    pub fn parts(&self) -> impl Iterator<Item = u32> + use<> {
        1..=self.len() as u32
    }

    /// Name of the object of a part; empty if the part has no object name.
    pub fn object(&self, part: u32) -> &str {
        self.list.object(part)
    }

    /// Names of the groups of a part, as in the file: one name, or several separated by blanks.
    pub fn groups(&self, part: u32) -> &str {
        self.list.groups(part)
    }

    /// Name of a part: the name of its object or of its groups, or `OBJECT/GROUPS` if these differ.
    /// Empty for [`UNNAMED`].
    pub fn name(&self, part: u32) -> Cow<'_, str> {
        match (self.object(part), self.groups(part)) {
            (object, "") => object.into(),
            ("", groups) => groups.into(),
            (object, groups) if object == groups => object.into(),
            (object, groups) => format!("{object}/{groups}").into(),
        }
    }

    /// Returns true if `glob` matches the name of the part, its object, its groups, or one of its
    /// groups.
    pub fn fits(&self, part: u32, glob: &Glob) -> bool {
        self.matched_name(part, glob).is_some()
    }

    /// Name of the part that `glob` matches: its object, its groups, one of its groups, or its
    /// whole name.
    pub fn matched_name(&self, part: u32, glob: &Glob) -> Option<Cow<'_, str>> {
        let groups = self.groups(part);
        let names = [self.object(part), groups].into_iter();
        let mut names = names.chain(groups.split_whitespace()).filter(|name| !name.is_empty());
        let matched = names.find(|name| glob.matches(name)).map(Cow::from);
        matched.or_else(|| Some(self.name(part)).filter(|name| !name.is_empty() && glob.matches(name)))
    }

    /// Bytes of the names and their table.
    pub fn bytes(&self) -> usize {
        self.list.bytes() + self.table.allocation_size()
    }

    fn fill_table(&mut self) {
        self.table.clear();
        for part in self.parts() {
            let hash = hash(self.object(part), self.groups(part));
            self.table
                .insert_unique(spread(hash), Slot { hash, part }, |slot| spread(slot.hash));
        }
    }
}

/// Part of `list` with these names, whose hash is `hash`. If there is no such part, it is added to
/// `list` and to `table`.
fn find_or_push(list: &mut PartList, table: &mut HashTable<Slot>, hash: u32, object: &str, groups: &str) -> u32 {
    let is_same =
        |slot: &Slot| slot.hash == hash && list.object(slot.part) == object && list.groups(slot.part) == groups;
    match table.entry(spread(hash), is_same, |slot| spread(slot.hash)) {
        Entry::Occupied(known) => known.get().part,
        Entry::Vacant(free) => {
            let part = list.push(object, groups);
            free.insert(Slot { hash, part });
            part
        }
    }
}

/// Copies the bits of `hash` to both halves of a 64-bit hash, because the table uses the low and
/// the high bits.
fn spread(hash: u32) -> u64 {
    u64::from(hash) << 32 | u64::from(hash)
}

/// Hash of the names of a part.
fn hash(object: &str, groups: &str) -> u32 {
    let words = [object, groups].into_iter().flat_map(|name| {
        name.as_bytes().chunks(8).map(|chunk| {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            u64::from_le_bytes(word)
        })
    });
    (words.fold(object.len() as u64, |hash, word| mix(hash ^ word)) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_found_by_their_names() {
        let mut names = PartNames::default();
        assert_eq!(names.find_or_add("", ""), UNNAMED);
        let all = |i: u32| {
            (
                format!("o{}", i % 70),
                if i % 3 == 0 { String::new() } else { format!("g{i} x") },
            )
        };
        for i in 0..1000 {
            let (object, groups) = all(i);
            names.find_or_add(&object, &groups);
        }
        let count = names.len();
        names.shrink_to_fit();
        for i in 0..1000 {
            let (object, groups) = all(i);
            let part = names.find_or_add(&object, &groups);
            assert_eq!((names.object(part), names.groups(part)), (&*object, &*groups));
        }
        // Objects with the same name and without groups are one part.
        assert_eq!((names.len(), count), (count, 666 + 70));

        let mut other = PartNames::default();
        let new = other.find_or_add("new", "");
        let known = other.find_or_add("o1", "g1 x");
        let numbers = names.append(&other);
        assert_eq!(numbers[0], UNNAMED);
        assert_eq!(numbers[new as usize] as usize, count + 1);
        assert_eq!(names.name(numbers[known as usize]), "o1/g1 x");
    }

    /// [`PartNames::join`] gives parts the same numbers as if the names were added one by one.
    #[test]
    fn lists_are_joined_in_order() {
        for distinct in [1, 3, 1000, 5000] {
            let mut lists = vec![PartList::default(); 3];
            let mut names = PartNames::default();
            let mut expected = Vec::new();
            for i in 0..3000 {
                let name = mix(i) % distinct;
                let (object, groups) = match name % 5 {
                    0 => (String::new(), String::new()),
                    1 => (String::new(), format!("g{name}")),
                    _ => (format!("o{name}"), "x y".to_string()),
                };
                lists[i as usize / 1000].push(&object, &groups);
                expected.push(names.find_or_add(&object, &groups));
            }
            let (joined, numbers) = PartNames::join(lists.iter());
            assert_eq!(numbers, expected);
            assert_eq!(joined.list.text, names.list.text);
        }
        assert!(PartNames::join(std::iter::empty()).1.is_empty());
    }

    /// A long name of an object is stored once for all its groups.
    #[test]
    fn shared_names_are_stored_once() {
        let (object, groups) = ("o".repeat(1000), "g".repeat(500));
        let mut list = PartList::default();
        for i in 0..100 {
            list.push(&object, &format!("{i}"));
        }
        for i in 0..100 {
            list.push(&format!("{i}"), &groups);
        }
        assert_eq!(list.text.len(), 1000 + 500 + 2 * 190);
        assert_eq!((list.object(100), list.groups(100)), (&*object, "99"));
        assert_eq!((list.object(101), list.groups(101)), ("0", &*groups));
        let (names, numbers) = PartNames::join([list.clone(), list].iter());
        assert_eq!((names.len(), names.list.text.len()), (200, 1880));
        assert_eq!((numbers[0], numbers[399]), (1, 200));
    }

    /// Pairs of names are different parts, even if their concatenations are equal.
    #[test]
    fn pairs_of_names_with_equal_concatenation_are_different_parts() {
        let mut names = PartNames::default();
        let parts = [("ab", "c"), ("a", "bc"), ("abc", ""), ("", "abc")].map(|(o, g)| names.find_or_add(o, g));
        assert_eq!(parts, [1, 2, 3, 4]);
        let written = parts.map(|part| names.name(part).into_owned());
        assert_eq!(written, ["ab/c", "a/bc", "abc", "abc"]);
    }

    #[test]
    fn patterns_fit_each_name() {
        let mut names = PartNames::default();
        let part = names.find_or_add("Chair", "seat wood");
        for (pattern, fits) in [
            ("Chair", true),
            ("seat", true),
            ("wood", true),
            ("seat wood", true),
            ("Chair/seat*", true),
            ("sea", false),
            ("*oak*", false),
        ] {
            assert_eq!(names.fits(part, &Glob::new(pattern)), fits, "{pattern}");
        }
        assert!(!names.fits(UNNAMED, &Glob::new("*")));
    }
}
