use std::borrow::Cow;

/// The statements of an OBJ or MTL file with the lines they start on, counted from 1.
///
/// A byte-order mark is skipped, a `\` at the end of a line joins the next line to it, and comments are left out: a `#`
/// starts one at the beginning of a word, so that names like `Mat#2` stay whole. Empty statements are left out too.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    std::iter::from_fn(move || {
        let (index, line) = lines.next()?;
        let mut statement = Cow::Borrowed(uncommented(line));
        while let Some(start) = statement.strip_suffix('\\') {
            let next = lines.next().map_or("", |(_, line)| uncommented(line));
            statement = Cow::Owned(format!("{start} {next}"));
        }
        Some((index + 1, statement))
    })
    .filter(|(_, statement)| !statement.is_empty())
}

/// The keyword of a statement, and what follows it.
pub(super) fn split_keyword(statement: &str) -> (&str, &str) {
    let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
    (keyword, rest.trim())
}

/// The line without its comment and surrounding blanks.
fn uncommented(line: &str) -> &str {
    let starts_word = |i: usize| line[..i].chars().next_back().is_none_or(char::is_whitespace);
    let end = line.match_indices('#').map(|(i, _)| i).find(|&i| starts_word(i));
    line[..end.unwrap_or(line.len())].trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_continuations_and_marks_are_seen_through() {
        let text = "\u{feff}v 1 2 3 # corner\r\n# all comment\n\nf 1 \\\n  2 3\\\n4\nusemtl Mat#2 # name\nend \\";
        let got: Vec<(usize, String)> = statements(text).map(|(n, s)| (n, s.into_owned())).collect();
        let words: Vec<Vec<&str>> = got.iter().map(|(_, s)| s.split_whitespace().collect()).collect();
        assert_eq!(
            words,
            [
                vec!["v", "1", "2", "3"],
                vec!["f", "1", "2", "3", "4"],
                vec!["usemtl", "Mat#2"],
                vec!["end"]
            ]
        );
        assert_eq!(got.iter().map(|(n, _)| *n).collect::<Vec<_>>(), [1, 4, 7, 8]);
    }
}
