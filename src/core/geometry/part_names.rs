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
/// only once. The text is therefore hardly longer than the statements of the file that name the
/// parts.
///
/// Parts are numbered from 1.
#[derive(Clone, Debug, Default)]
pub struct PartList {
    text: NameText,
    objects: Column,
    groups: Column,
    len: usize,
}

impl PartList {
    /// An empty list with memory for `count` parts whose names take `bytes` in [`NameText`].
    fn with_capacity(count: usize, bytes: usize, [has_objects, has_groups]: [bool; 2]) -> Self {
        let column = |varies: bool| Column {
            last: 0,
            each: Vec::with_capacity(if varies { count } else { 0 }),
        };
        Self {
            text: NameText(String::with_capacity(bytes)),
            objects: column(has_objects),
            groups: column(has_groups),
            len: 0,
        }
    }

    /// Adds a part, and returns its number. A name is left out if the text would be longer than
    /// 4 GiB.
    pub fn push(&mut self, object: &str, groups: &str) -> u32 {
        self.objects.push(object, &mut self.text, self.len);
        self.groups.push(groups, &mut self.text, self.len);
        self.len += 1;
        self.len as u32
    }

    /// Name of the object of a part; empty if the part has no object name.
    pub fn object(&self, part: u32) -> &str {
        self.name(&self.objects, part)
    }

    /// Names of the groups of a part, as in the file: one name, or several separated by blanks.
    pub fn groups(&self, part: u32) -> &str {
        self.name(&self.groups, part)
    }

    /// Names of the object and of the groups of each part.
    fn iter(&self) -> impl Iterator<Item = (&str, &str)> {
        (1..=self.len as u32).map(|part| (self.object(part), self.groups(part)))
    }

    /// Frees unused memory.
    pub fn shrink_to_fit(&mut self) {
        self.text.0.shrink_to_fit();
        self.objects.each.shrink_to_fit();
        self.groups.each.shrink_to_fit();
    }

    fn bytes(&self) -> usize {
        self.text.0.len() + size_of_val(self.objects.each.as_slice()) + size_of_val(self.groups.each.as_slice())
    }

    fn name(&self, column: &Column, part: u32) -> &str {
        let index = (part as usize).checked_sub(1).filter(|&index| index < self.len);
        index.map_or("", |index| self.text.name(column.place(index)))
    }
}

/// Names of consecutive parts: the names of their objects, or of their groups.
#[derive(Clone, Debug, Default)]
struct Column {
    /// Place of the last name in the text.
    last: u32,
    /// Place of the name of each part. Empty if all parts have the same name.
    each: Vec<u32>,
}

impl Column {
    /// Adds the name of a part. `count` parts were added before. A name that differs from the
    /// previous name is appended to `text`.
    fn push(&mut self, name: &str, text: &mut NameText, count: usize) {
        let before = self.last;
        if text.name(before) != name {
            self.last = text.push(name);
        }
        if self.each.is_empty() && count > 0 && self.last != before {
            self.each.resize(count, before);
        }
        if !self.each.is_empty() {
            self.each.push(self.last);
        }
    }

    fn place(&self, index: usize) -> u32 {
        self.each.get(index).copied().unwrap_or(self.last)
    }
}

/// Text of names. In front of each name is its length in digits of 6 bits, the lowest first. The
/// byte of a digit has bit 6 if another digit follows. So the place of a name, 0 for the empty
/// name, takes only 4 bytes.
#[derive(Clone, Debug, Default)]
struct NameText(String);

impl NameText {
    const DIGIT: usize = 0x3F;
    const MORE: u8 = 0x40;

    /// Appends a name and returns its place. Returns the place of the empty name if the text would
    /// be longer than 4 GiB.
    fn push(&mut self, name: &str) -> u32 {
        const MAX_DIGITS: usize = usize::BITS as usize / 6 + 1;
        if name.is_empty() {
            return 0;
        }
        // The empty name is at place 0.
        let place = self.0.len().max(1);
        if u32::try_from(place + MAX_DIGITS + name.len()).is_err() {
            return 0;
        }
        if self.0.is_empty() {
            self.0.push('\0');
        }
        let mut rest = name.len();
        while rest > Self::DIGIT {
            self.0.push(char::from((rest & Self::DIGIT) as u8 | Self::MORE));
            rest >>= 6;
        }
        self.0.push(char::from(rest as u8));
        self.0.push_str(name);
        place as u32
    }

    /// Name at `place`.
    #[inline]
    fn name(&self, place: u32) -> &str {
        let (mut start, mut len, mut shift) = (place as usize, 0, 0);
        while let Some(&digit) = self.0.as_bytes().get(start) {
            start += 1;
            len |= (digit as usize & Self::DIGIT) << shift;
            shift += 6;
            if digit & Self::MORE == 0 {
                break;
            }
        }
        self.0.get(start..start + len).unwrap_or_default()
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
        let sum = |(count, bytes): (usize, usize), list: &PartList| (count + list.len, bytes + list.text.0.len());
        let (count, bytes) = lists.clone().fold((0, 0), sum);
        let varies = [
            lists.clone().any(|list| !list.objects.each.is_empty()),
            lists.clone().any(|list| !list.groups.each.is_empty()),
        ];
        let mut names = Self {
            list: PartList::with_capacity(count, bytes, varies),
            table: HashTable::new(),
        };
        let mut hashes = Vec::with_capacity(count);
        for list in lists.clone() {
            hashes.extend(list.iter().map(|(object, groups)| hash(object, groups)));
        }
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
        let mut first = 0;
        for list in lists {
            let of_list = &mut numbers[first..first + list.len];
            first += list.len;
            for ((object, groups), number) in list.iter().zip(of_list) {
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
        self.list.len
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
            assert_eq!(joined.list.text.0, names.list.text.0);
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
        // Lengths have two digits for the long names, and one digit for the other names.
        let bytes = 1 + (2 + 1000) + (2 + 500) + 2 * (100 + 190);
        assert_eq!(list.text.0.len(), bytes);
        assert_eq!((list.object(100), list.groups(100)), (&*object, "99"));
        assert_eq!((list.object(101), list.groups(101)), ("0", &*groups));
        let (names, numbers) = PartNames::join([list.clone(), list].iter());
        assert_eq!((names.len(), names.list.text.0.len()), (200, bytes));
        assert_eq!((numbers[0], numbers[399]), (1, 200));
    }

    /// Names of all lengths, with characters of several bytes.
    #[test]
    fn names_keep_their_text() {
        let mut list = PartList::default();
        let names: Vec<String> = [0, 1, 62, 63, 64, 65, 4095, 4096, 300_000]
            .into_iter()
            .flat_map(|len| {
                [
                    ("€\0@".repeat(len), "".into()),
                    ("?".repeat(len), "\u{7f}".repeat(len + 1)),
                ]
            })
            .flat_map(|(object, groups)| [object, groups])
            .collect();
        for pair in names.chunks(2) {
            list.push(&pair[0], &pair[1]);
        }
        for (part, pair) in (1..).zip(names.chunks(2)) {
            assert!(
                (list.object(part), list.groups(part)) == (&*pair[0], &*pair[1]),
                "{part}"
            );
        }
        assert_eq!((list.object(0), list.groups(99)), ("", ""));
    }

    /// If all parts have the same object or the same groups, this name takes no memory for each
    /// part.
    #[test]
    fn equal_names_take_no_memory() {
        let mut list = PartList::default();
        (0..100).for_each(|i| _ = list.push("object", &i.to_string()));
        assert_eq!((list.objects.each.len(), list.groups.each.len()), (0, 100));
        list.push("", "100");
        assert_eq!((list.objects.each.len(), list.groups.each.len()), (101, 101));
        assert_eq!((list.object(100), list.groups(100)), ("object", "99"));
        assert_eq!((list.object(101), list.groups(101)), ("", "100"));
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
