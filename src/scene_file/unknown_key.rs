//! Errors for unknown names: keys in a section of a scene file, and materials. The errors list the
//! nearest known names.

use crate::math::excerpt;
use crate::options::nearest;

const REFERENCE: &str = "`embrasure help scene` lists every key of a scene file";

/// Message and help for the unknown key `key` in the section `section`. `known` are the valid keys.
pub(super) fn unknown_key<'a>(key: &str, section: &str, known: impl IntoIterator<Item = &'a str>) -> (String, String) {
    (
        format!("unknown key `{}` in [{section}]", excerpt(key)),
        help(key, known),
    )
}

/// Message and help for an error of the TOML parser. An unknown key is reported as in
/// [`unknown_key`]. An error about a value of a wrong type uses the names of TOML types. Other
/// errors are not changed.
///
/// serde writes an unknown key as "unknown field `KEY`, expected one of `A`, `B`" and does not pass
/// the names as a list. We take the names from the backquotes.
pub(super) fn parser_error(message: &str) -> (String, String) {
    let message = message.trim_end();
    let Some(rest) = message.strip_prefix("unknown field ") else {
        let help = match message.split_once(", expected an array of length ") {
            Some((_, count)) => format!("write {count} values between brackets; {REFERENCE}"),
            None => REFERENCE.into(),
        };
        return (plain(message), help);
    };
    let mut names = rest.split('`').skip(1).step_by(2);
    let key = names.next().unwrap_or_default();
    (format!("unknown key `{}`", excerpt(key)), help(key, names))
}

/// Message without Rust terms for serde's errors "invalid type: FOUND, expected WANTED", "invalid
/// length N, expected WANTED" and "missing field `KEY`". Other messages are not changed.
fn plain(message: &str) -> String {
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("the key {key} is missing");
    }
    let Some((found, wanted)) = message.split_once(", expected ") else {
        return message.into();
    };
    let wanted = match wanted.strip_prefix("an array of length ") {
        Some(count) => format!("a list of {count} values"),
        None => match wanted {
            "a sequence" => "a list",
            "a map" => "a table",
            "path string" => "the name of a file",
            "a boolean" => "true or false",
            "f32" | "f64" => "a number",
            "u32" | "u64" | "i64" | "usize" => "a whole number",
            _ if wanted.starts_with("struct ") => "a table",
            _ => wanted,
        }
        .into(),
    };
    if let Some(found) = found.strip_prefix("invalid length ") {
        return format!("expected {wanted}, found {found}");
    }
    let Some(found) = found.strip_prefix("invalid type: ") else {
        return message.into();
    };
    let kinds = ["floating point ", "integer ", "boolean ", "string "];
    let found = match found {
        "map" => "a table",
        "sequence" => "a list",
        _ => kinds.iter().find_map(|kind| found.strip_prefix(kind)).unwrap_or(found),
    };
    let string = found.strip_prefix('"').and_then(|found| found.strip_suffix('"'));
    let found = string.map_or(found.into(), |string| format!("\"{}\"", excerpt(string)));
    format!("expected {wanted}, found {found}")
}

/// Maximum number of names that are suggested for an unknown name.
const MAX_NEAREST: usize = 3;
/// Maximum number of names that are compared with an unknown name. A file may have very many names.
const MAX_NAMES: usize = 4096;
/// Minimum similarity of a suggested name, from 0 to 1 (Jaro and Winkler).
const SIMILAR: f64 = 0.7;

/// Names in `known` that are most similar to `name`, the nearest first. Case does not matter. A
/// name that contains the whole text of `name` counts as near.
pub(super) fn nearest_names<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let name = name.to_lowercase();
    let score = |known: &str| {
        let known = known.to_lowercase();
        let is_part = !name.is_empty() && known.contains(&name);
        strsim::jaro_winkler(&name, &known).max(if is_part { 0.9 } else { 0.0 })
    };
    let mut scored: Vec<(f64, &str)> = known.into_iter().take(MAX_NAMES).map(|k| (score(k), k)).collect();
    scored.retain(|(score, _)| *score >= SIMILAR);
    scored.sort_by(|(a, first), (b, second)| b.total_cmp(a).then(first.cmp(second)));
    scored.dedup_by_key(|(_, name)| *name);
    scored.into_iter().take(MAX_NEAREST).map(|(_, name)| name).collect()
}

/// Names of keys in other programs, with the equivalent keys of this program.
const ELSEWHERE: [(&str, &str); 12] = [
    ("eye", "position"),
    ("origin", "position"),
    ("target", "look_at"),
    ("color", "diffuse"),
    ("colour", "diffuse"),
    ("base_color", "diffuse"),
    ("albedo", "diffuse"),
    ("Kd", "diffuse"),
    ("Ks", "specular"),
    ("Ke", "emission"),
    ("alpha", "opacity"),
    ("file", "obj"),
];

/// Key in `known` that the user probably means by `key`: the equivalent of another program's key, a
/// key with the word `key`, such as `vertical_fov` for `fov`, or the most similar key.
fn nearest_key<'a>(key: &str, known: &[&'a str]) -> Option<&'a str> {
    let elsewhere = ELSEWHERE.iter().find(|(theirs, _)| *theirs == key);
    let meant = elsewhere.and_then(|(_, ours)| known.iter().find(|known| *known == ours));
    let contains = || {
        let is_part = |known: &&&str| key.len() > 2 && known.split('_').any(|word| word == key);
        known.iter().find(is_part).copied()
    };
    meant
        .copied()
        .or_else(contains)
        .or_else(|| nearest(key, known.iter().copied()))
}

fn help<'a>(key: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest_key(key, &known) {
        Some(known) => format!("did you mean `{known}`? {REFERENCE}"),
        None => REFERENCE.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_type_error_has_toml_names() {
        for (message, expected) in [
            (
                "invalid type: floating point `1.0`, expected an array of length 3",
                "expected a list of 3 values, found `1.0`",
            ),
            (
                "invalid length 2, expected an array of length 3",
                "expected a list of 3 values, found 2",
            ),
            (
                "invalid type: integer `3`, expected path string",
                "expected the name of a file, found `3`",
            ),
            (
                "invalid type: map, expected a sequence",
                "expected a list, found a table",
            ),
            (
                "invalid type: string \"red\", expected a number or three numbers",
                "expected a number or three numbers, found \"red\"",
            ),
            ("duplicate key", "duplicate key"),
        ] {
            assert_eq!(plain(message), expected);
        }
    }

    #[test]
    fn names_have_their_nearest() {
        let known = ["Metal", "Metal.001", "Wood", "brushed metal", "Glass"];
        assert_eq!(nearest_names("Metla", known), ["Metal", "Metal.001"]);
        assert_eq!(nearest_names("METAL", known), ["Metal", "Metal.001", "brushed metal"]);
        assert!(nearest_names("xyz", known).is_empty() && nearest_names("", known).is_empty());
    }

    #[test]
    fn keys_have_their_nearest() {
        let known = [
            "position",
            "look_at",
            "vertical_fov",
            "lens_radius",
            "diffuse",
            "specular",
        ];
        for (key, expected) in [
            ("fov", Some("vertical_fov")),
            ("lookat", Some("look_at")),
            ("target", Some("look_at")),
            ("albedo", Some("diffuse")),
            ("radius", Some("lens_radius")),
            ("diffuze", Some("diffuse")),
            ("zzz", None),
            ("", None),
            // The tested section has no key `emission`
            ("Ke", None),
        ] {
            assert_eq!(nearest_key(key, &known), expected, "{key}");
        }
    }

    #[test]
    fn unknown_key_error_has_the_nearest_key() {
        #[derive(Debug, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        #[allow(dead_code)]
        struct Section {
            position: f32,
            look_at: f32,
        }
        let words = |text: &str| parser_error(toml::from_str::<Section>(text).unwrap_err().message());
        let (message, help) = words("lookat = 1");
        assert_eq!(message, "unknown key `lookat`");
        assert_eq!(help, format!("did you mean `look_at`? {REFERENCE}"));
        assert_eq!(words("zzz = 1").1, REFERENCE);
        assert_eq!(words("position = true").0, "expected a number, found `true`");
        assert_eq!(words("position = []").0, "expected a number, found a list");
        assert_eq!(words("position = 1").0, "the key `look_at` is missing");
        let (message, help) = parser_error("invalid length 4, expected an array of length 3");
        assert_eq!(message, "expected a list of 3 values, found 4");
        assert!(help.starts_with("write 3 values between brackets; "), "{help}");
    }
}
