//! Unit of length of an OBJ file, from its first comments.

use super::open_regular;
use std::io::Read;
use std::path::Path;

/// Number of bytes that are searched for comments.
const HEAD: u64 = 4096;
/// Names of units, and their length in metres. Additional letters may follow a name of more than
/// two letters: `inches`. A shorter name is a whole word.
const UNITS: [(&str, f32); 13] = [
    ("millimeter", 0.001),
    ("millimetre", 0.001),
    ("centimeter", 0.01),
    ("centimetre", 0.01),
    ("meter", 1.0),
    ("metre", 1.0),
    ("inch", 0.0254),
    ("feet", 0.3048),
    ("foot", 0.3048),
    ("mm", 0.001),
    ("cm", 0.01),
    ("ft", 0.3048),
    ("m", 1.0),
];

/// Length in metres of the unit that a comment such as `# File units = inches` names. `None` if no
/// comment names a unit.
pub fn named_unit(path: &Path) -> Option<f32> {
    let mut head = Vec::new();
    open_regular(path)?.take(HEAD).read_to_end(&mut head).ok()?;
    let head = String::from_utf8_lossy(&head).to_lowercase();
    let comments = head.lines().filter_map(|line| line.trim_start().strip_prefix('#'));
    comments
        .filter(|comment| words(comment).any(|word| word == "unit" || word == "units"))
        .find_map(|comment| words(comment).find_map(unit))
}

fn words(comment: &str) -> impl Iterator<Item = &str> {
    comment
        .split(|c: char| !c.is_alphabetic())
        .filter(|word| !word.is_empty())
}

fn unit(word: &str) -> Option<f32> {
    let is_named = |(name, _): &&(&str, f32)| match name.len() {
        0..=2 => word == *name,
        _ => word.starts_with(name),
    };
    UNITS.iter().find(is_named).map(|(_, metres)| *metres)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_from_comments() {
        let folder = tempfile::tempdir().unwrap();
        for (text, expected) in [
            ("# File units = inches\nv 0 0 0\n", Some(0.0254)),
            ("#\n# The units used in this file are centimeters.\n", Some(0.01)),
            (
                "# This file uses meters as units for non-parametric coordinates.\n",
                Some(1.0),
            ),
            ("# Units\tmm\n", Some(0.001)),
            ("# 3 meters of rope\nv 0 0 0\n", None),
            ("# United States\n", None),
            ("v 0 0 0\n", None),
        ] {
            let path = folder.path().join("a.obj");
            std::fs::write(&path, text).unwrap();
            assert_eq!(named_unit(&path), expected, "{text}");
        }
        assert_eq!(named_unit(&folder.path().join("b.obj")), None);
    }
}
