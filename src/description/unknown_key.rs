//! The error for a key that a section of a scene file does not have: its words, and the nearest key that the section has.

use crate::options::nearest;

const REFERENCE: &str = "docs/conventions.md lists every key of a scene file";

/// Message and help for an unknown `key` of `[section]`, whose keys are `known`.
pub(super) fn unknown_key<'a>(key: &str, section: &str, known: impl IntoIterator<Item = &'a str>) -> (String, String) {
    (format!("unknown key `{key}` in [{section}]"), help(key, known))
}

/// Message and help for an error of the TOML parser: an unknown key is told as by [`unknown_key`], all else in the parser's words.
///
/// serde words an unknown key as "unknown field `KEY`, expected one of `A`, `B`" and passes on no list: the names are those between backquotes.
pub(super) fn parser_error(message: &str) -> (String, String) {
    let message = message.trim_end();
    let Some(rest) = message.strip_prefix("unknown field ") else {
        return (message.into(), REFERENCE.into());
    };
    let mut names = rest.split('`').skip(1).step_by(2);
    let key = names.next().unwrap_or_default();
    (format!("unknown key `{key}`"), help(key, names))
}

fn help<'a>(key: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    match nearest(key, known) {
        Some(known) => format!("did you mean `{known}`? {REFERENCE}"),
        None => REFERENCE.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_the_parser_have_their_nearest() {
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
        assert_eq!(words("position = true").0, "invalid type: boolean `true`, expected f32");
    }
}
