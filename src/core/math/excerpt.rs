//! Quotes from input files in error messages.

use std::borrow::Cow;

/// Maximum number of characters in a quote of text.
const MAX_CHARS: usize = 40;

/// Quote of text from an input file: at most 40 characters, without control characters.
///
/// A scene file may refer to any file that the user can read, so error messages must not print the
/// contents of whole files.
pub fn excerpt(text: &str) -> Cow<'_, str> {
    let end = text.char_indices().nth(MAX_CHARS);
    if end.is_none() && !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let mut start: String = text.chars().take(MAX_CHARS).map(visible).collect();
    if end.is_some() {
        start.push('…');
    }
    Cow::Owned(start)
}

/// Maximum number of characters in a quote of a name.
const MAX_NAME_CHARS: usize = 120;
/// Number of characters after the gap, in a quote that leaves out the middle of a name.
const NAME_END: usize = 50;

/// Quote of a name from an input file, such as the name of a material or a part. If the name is
/// longer than 120 characters, its middle is left out, because long names often differ only at
/// their ends.
pub fn excerpt_of_name(text: &str) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= MAX_NAME_CHARS && !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    if count <= MAX_NAME_CHARS {
        return Cow::Owned(text.chars().map(visible).collect());
    }
    let start = text.chars().take(MAX_NAME_CHARS - NAME_END).map(visible);
    let end = text.chars().skip(count - NAME_END).map(visible);
    Cow::Owned(start.chain(['…']).chain(end).collect())
}

/// Maximum number of characters in a quote of a file name.
const MAX_PATH_CHARS: usize = 120;

/// Quote of a file name from an input file: at most its last 120 characters.
pub fn excerpt_of_path(text: &str) -> Cow<'_, str> {
    let count = text.chars().count();
    if count <= MAX_PATH_CHARS && !text.contains(char::is_control) {
        return Cow::Borrowed(text);
    }
    let cut = count.saturating_sub(MAX_PATH_CHARS);
    let end = text.chars().skip(cut).map(visible);
    Cow::Owned((cut > 0).then_some('…').into_iter().chain(end).collect())
}

/// Replaces a control character by a visible character.
fn visible(c: char) -> char {
    if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_are_short_and_visible() {
        let forty = "ä".repeat(40);
        assert_eq!(excerpt(&forty), forty);
        assert_eq!(excerpt(&"ä".repeat(41)), format!("{forty}…"));
        assert_eq!(
            excerpt_of_path(&format!("x{}", "ä".repeat(120))),
            format!("…{}", "ä".repeat(120))
        );
        assert_eq!(excerpt_of_path("a/\n.png"), "a/\u{fffd}.png");
        assert_eq!(excerpt("a\u{1b}[2Jb\0"), "a\u{fffd}[2Jb\u{fffd}");
        let long = format!("{}{}", "ä".repeat(70), "b".repeat(50));
        assert_eq!(excerpt_of_name(&long), long);
        let longer = format!("{}c{}", "ä".repeat(70), "b".repeat(50));
        assert_eq!(excerpt_of_name(&longer), longer.replace('c', "…"));
        assert_eq!(excerpt_of_name("a\n"), "a\u{fffd}");
    }
}
