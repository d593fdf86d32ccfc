//! Keys that replace keys of a scene file (`--set KEY=VALUE`), and patches of materials and parts
//! (`--material GLOB.KEY=VALUE`, `--part GLOB.KEY=VALUE`).
//!
//! Tables are merged key by key, and arrays of tables by index (`light.0.intensity`; the next free
//! index adds an entry). Any other value replaces the value of the file. A value that is not valid
//! TOML is read as a string: `render.sampler=halton`. Before the text of a flag is parsed, blanks
//! are put in front of it. Their number is different for each flag, and larger than the number of
//! bytes of the file. The byte position of a value therefore identifies the flag that set the
//! value.

use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeArray, DeTable, DeValue, Deserializer, Error};

/// Keys whose values are arrays of tables.
const ARRAYS: [&str; 3] = ["object", "light", "light_group"];

/// Sections that have one entry for each name of a material or part.
const SECTIONS_BY_NAME: [&str; 3] = ["material", "patch", "part"];

/// Items to which the patch of a flag applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PatchTarget {
    Materials,
    Parts,
}

impl PatchTarget {
    /// Name of the flag that patches these items.
    pub fn flag(self) -> &'static str {
        match self {
            Self::Materials => "--material",
            Self::Parts => "--part",
        }
    }
}

/// Keys and values in the order in which they apply.
#[derive(Clone, Debug, Default)]
pub(super) struct Overrides(Vec<Override>);

#[derive(Clone, Debug)]
struct Override {
    /// Flag and value, as the user typed them.
    written: String,
    /// Key and value as a line of TOML, preceded by blanks. Empty if the flag sets no key.
    toml: String,
    /// Number of blanks before the line.
    start: usize,
    /// Target and glob of a patch; `None` if the flag is not a patch, but sets a key of the file.
    patches: Option<(PatchTarget, String)>,
    /// True if a patch that matches no material is an error.
    must_match: bool,
}

impl Overrides {
    /// Overrides for a file of `bytes` bytes. `written` are the texts `KEY=VALUE`.
    ///
    /// # Errors
    ///
    /// The first text that is not `KEY=VALUE`.
    pub fn new(written: &[String], bytes: usize) -> Result<Self, String> {
        let mut start = bytes + 1;
        let overrides = written.iter().map(|written| {
            let toml = key_and_value(written).ok_or_else(|| written.clone())?;
            let toml = " ".repeat(start) + &toml;
            let before = std::mem::replace(&mut start, toml.len() + 1);
            Ok(Override {
                written: format!("--set {written}"),
                toml,
                start: before,
                patches: None,
                must_match: false,
            })
        });
        overrides.collect::<Result<_, _>>().map(Self)
    }

    /// Adds a patch `KEY=VALUE` for all items that `glob` matches. Errors name the patch as
    /// `written`. The file has `bytes` bytes.
    ///
    /// # Errors
    ///
    /// `patch` is not `KEY=VALUE`, or the glob is empty.
    pub fn add_patch_of(
        &mut self,
        (target, glob): (PatchTarget, &str),
        patch: &str,
        written: &str,
        bytes: usize,
    ) -> Result<(), ()> {
        let toml = key_and_value(patch).filter(|_| !glob.is_empty()).ok_or(())?;
        let start = self.0.last().map_or(bytes, |last| last.start.max(last.toml.len())) + 1;
        self.0.push(Override {
            written: format!("{} {written}", target.flag()),
            toml: " ".repeat(start) + &toml,
            start,
            patches: Some((target, glob.into())),
            must_match: false,
        });
        Ok(())
    }

    /// Patches of the kind `target`: the glob, and the patch as a line of TOML. The position of the
    /// line in bytes identifies the flag ([`Overrides::at`]).
    pub fn patches(&self, target: PatchTarget) -> impl Iterator<Item = (&str, &str)> {
        self.0.iter().filter_map(move |o| match &o.patches {
            Some((patched, glob)) if *patched == target => Some((glob.as_str(), o.toml.as_str())),
            _ => None,
        })
    }

    /// Adds the flag `written`. Returns a new span for its values, after the `bytes` bytes of the
    /// file and all earlier spans.
    pub fn add_flag(&mut self, bytes: usize, written: String) -> Range<usize> {
        let start = self.0.last().map_or(bytes, |last| last.start.max(last.toml.len())) + 1;
        self.0.push(Override {
            written,
            toml: String::new(),
            start,
            patches: None,
            must_match: false,
        });
        start..start
    }

    /// Makes it an error if the last patch matches no material.
    pub fn require_match(&mut self) {
        if let Some(last) = self.0.last_mut() {
            last.must_match = true;
        }
    }

    /// Returns true if the value at `byte` belongs to a patch that must match a material.
    pub fn must_match(&self, byte: usize) -> bool {
        let before = self.0.partition_point(|o| o.start <= byte);
        before.checked_sub(1).is_some_and(|i| self.0[i].must_match)
    }

    /// The flag that set the value at `byte`, as the user typed it; `None` if the file set the
    /// value.
    pub fn at(&self, byte: usize) -> Option<&str> {
        let before = self.0.partition_point(|o| o.start <= byte);
        before.checked_sub(1).map(|i| self.0[i].written.as_str())
    }

    /// Parses `text`, the contents of the file, with the overrides applied.
    pub fn read<T: for<'de> Deserialize<'de>>(&self, text: &str) -> Result<T, Error> {
        if self.0.is_empty() {
            return toml::from_str(text);
        }
        T::deserialize(Deserializer::from(self.root(text)?))
    }

    /// Parses `text`, the contents of the file, to a table with the overrides applied.
    fn root<'i>(&'i self, text: &'i str) -> Result<Spanned<DeTable<'i>>, Error> {
        let mut root = DeTable::parse(text)?;
        for Override { toml, .. } in self.0.iter().filter(|o| o.patches.is_none()) {
            merge(root.as_mut(), DeTable::parse(toml)?.into_inner());
        }
        Ok(root)
    }

    /// Finds a material whose name has dots and no quotes, if this causes the parser's error at
    /// `byte`. Returns the section and the full name. TOML reads `[material.White.001]` as the
    /// table `001` in the material `White`.
    pub fn dotted_material(&self, text: &str, byte: usize) -> Option<(&'static str, String)> {
        let root = self.root(text).ok()?.into_inner();
        let materials = SECTIONS_BY_NAME
            .iter()
            .filter_map(|section| match root.get(*section)?.get_ref() {
                DeValue::Table(materials) => Some((*section, materials)),
                _ => None,
            });
        for (section, materials) in materials {
            for (name, keys) in materials {
                let DeValue::Table(keys) = keys.get_ref() else { continue };
                let at =
                    |key: &Spanned<_>, value: &Spanned<_>| key.span().contains(&byte) || value.span().start == byte;
                let table = keys.iter().find_map(|(key, value)| match value.get_ref() {
                    DeValue::Table(table) if at(key, value) && !key.get_ref().ends_with("_map") => Some((key, table)),
                    _ => None,
                });
                let Some((key, mut table)) = table else { continue };
                let mut name = format!("{}.{}", name.get_ref(), key.get_ref());
                // Append further parts of the name, as long as a table contains only one other
                // table
                while let Some((key, DeValue::Table(inner))) = table.iter().next().map(|(k, v)| (k, v.get_ref())) {
                    if table.len() > 1 || key.get_ref().ends_with("_map") {
                        break;
                    }
                    name += &format!(".{}", key.get_ref());
                    table = inner;
                }
                return Some((section, name));
            }
        }
        None
    }
}

/// Line of TOML for the text `KEY=VALUE`.
fn key_and_value(written: &str) -> Option<String> {
    let is_one_entry = |toml: &String| {
        let table = DeTable::parse(toml);
        !toml.contains('\n') && table.is_ok_and(|table| table.get_ref().len() == 1)
    };
    let (key, value) = written.split_once('=')?;
    let string = format!("{key}={}", toml::Value::from(value));
    [written.to_string(), string].into_iter().find(is_one_entry)
}

fn merge<'i>(into: &mut DeTable<'i>, from: DeTable<'i>) {
    for (key, value) in from {
        match into.get_mut(key.get_ref().as_ref()) {
            Some(old) => replace(old, value),
            None if ARRAYS.contains(&key.get_ref().as_ref()) => {
                let mut items = Spanned::new(value.span(), DeValue::Array(DeArray::new()));
                replace(&mut items, value);
                into.insert(key, items);
            }
            None => {
                into.insert(key, value);
            }
        }
    }
}

fn replace<'i>(old: &mut Spanned<DeValue<'i>>, new: Spanned<DeValue<'i>>) {
    let span = new.span();
    match (old.as_mut(), new.into_inner()) {
        (DeValue::Table(into), DeValue::Table(from)) => merge(into, from),
        (DeValue::Array(items), DeValue::Table(from)) if indices(items, &from) => {
            for (index, item) in from {
                match index.get_ref().parse().ok().and_then(|i: usize| items.get_mut(i)) {
                    Some(old) => replace(old, item),
                    None => items.push(item),
                }
            }
        }
        (_, value) => *old = Spanned::new(span, value),
    }
}

/// Returns true if all keys of `from` are indices of `items`, or the next free index.
fn indices(items: &DeArray, from: &DeTable) -> bool {
    let is_index = |key: &str| key.parse().is_ok_and(|i: usize| i <= items.len());
    from.keys().all(|key| is_index(key.get_ref()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, written: &[&str]) -> Result<toml::Table, Error> {
        let written: Vec<String> = written.iter().map(ToString::to_string).collect();
        Overrides::new(&written, text.len()).unwrap().read(text)
    }

    #[test]
    fn keys_replace_those_of_the_file() {
        let text = "a = 1\n[render]\nspp = 4\nseed = 1\n[[light]]\ntype = 'point'\n[[light]]\ntype = 'spot'\n";
        for (written, expected) in [
            ("a=[1, 2]", "a = [1, 2]"),
            ("render.spp=8", "render.spp = 8"),
            ("render = {seed = 7}", "render = {spp = 4, seed = 7}"),
            ("render.sampler=halton", "render.sampler = 'halton'"),
            ("render.file=C:\\a \"b\".png", "render.file = 'C:\\a \"b\".png'"),
            (
                "material.\"White.001\".roughness=0.5",
                "material.'White.001'.roughness = 0.5",
            ),
        ] {
            let read = read(text, &[written]).unwrap();
            let expected: toml::Table = toml::from_str(expected).unwrap();
            for (key, value) in &expected {
                let new = &read[key];
                match value {
                    toml::Value::Table(table) => table.iter().for_each(|(k, v)| assert_eq!(&new[k], v, "{written}")),
                    value => assert_eq!(new, value, "{written}"),
                }
            }
            assert_eq!(read["light"].as_array().unwrap().len(), 2);
        }
        // Change entries by their indices, and add a new entry
        let lights = read(text, &["light.1.type=constant", "light.2.type=directional"]).unwrap();
        let types: Vec<&str> = lights["light"]
            .as_array()
            .unwrap()
            .iter()
            .map(|l| l["type"].as_str().unwrap())
            .collect();
        assert_eq!(types, ["point", "constant", "directional"]);
        let first = read("", &["light.0.type=point"]).unwrap();
        assert_eq!(first["light"].as_array().unwrap().len(), 1);
        // An index after the next free index is not an entry. The parser then rejects the table.
        assert!(read("", &["light.1.type=point"]).unwrap()["light"].is_table());
        // If a key is set twice, the last value is used.
        assert_eq!(read(text, &["a=2", "a=3"]).unwrap()["a"].as_integer(), Some(3));
    }

    #[test]
    fn override_without_key_or_value_is_an_error() {
        for written in ["a", "", "=1", "a b=1", "a.=1", "a=1\nb=2"] {
            assert_eq!(Overrides::new(&[written.into()], 3).unwrap_err(), written);
        }
    }

    #[test]
    fn places_name_the_flag_that_set_a_value() {
        let overrides = Overrides::new(&["a=1".into(), "b=x".into()], 10).unwrap();
        assert_eq!(overrides.at(10), None);
        #[derive(Deserialize)]
        struct Spans {
            a: Spanned<f32>,
            b: Spanned<String>,
            c: Spanned<f32>,
        }
        let read: Spans = overrides.read("a=3\n\nc=4  ").unwrap();
        assert_eq!(overrides.at(read.a.span().start), Some("--set a=1"));
        assert_eq!(overrides.at(read.b.span().start), Some("--set b=x"));
        let mut overrides = overrides;
        let places = ["--env sky", "--sun 1,2"].map(|flag| overrides.add_flag(10, flag.into()).start);
        assert_eq!(overrides.at(places[0]), Some("--env sky"));
        assert_eq!(overrides.at(places[1]), Some("--sun 1,2"));
        assert_eq!(overrides.at(read.b.span().start), Some("--set b=x"));
        assert_eq!((overrides.at(read.c.span().start), read.c.span()), (None, 7..8));
    }
}
