//! Statements of OBJ and MTL files. The functions remove comments and byte-order marks, join
//! continued lines, and cut a text between statements.

use super::Position;
use std::borrow::Cow;

/// Keyword of vertex colours from ZBrush.
pub(crate) const MRGB: &str = "#MRGB";

/// A statement of an OBJ or MTL file.
pub(crate) struct Statement<'a> {
    /// First line of the statement, counted from 1.
    pub line: usize,
    /// Statement without its comment.
    pub text: Cow<'a, str>,
    /// Line with its comment. `None` if the line has no comment, or if the statement continues on
    /// the next line.
    commented: Option<&'a str>,
}

impl<'a> Statement<'a> {
    /// Text after the keyword, including a comment that may be part of a name such as `Paint #1`.
    pub fn whole_name(&self) -> Option<&'a str> {
        self.commented.map(|line| split_keyword(line).1)
    }
}

/// Statements of an OBJ or MTL file, each with its first line, counted from 1.
pub(crate) fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    whole_statements(text).map(|statement| (statement.line, statement.text))
}

/// Statements of an OBJ or MTL file.
///
/// A byte-order mark is skipped. A `\` at the end of a line joins the next line to the statement.
/// Comments are left out. A comment starts with a `#` at the beginning of a word, so names like
/// `Mat#2` stay whole. Empty statements are left out, too.
pub(crate) fn whole_statements(text: &str) -> impl Iterator<Item = Statement<'_>> {
    let mut lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    // One search in the whole text is faster than a search in each line.
    let has_comments = text.as_bytes().contains(&b'#');
    std::iter::from_fn(move || {
        let (index, line) = lines.next()?;
        let (line, commented) = if has_comments {
            parts(line)
        } else {
            (trimmed(line), None)
        };
        let (statement, commented) = match line.strip_suffix('\\') {
            None => (Cow::Borrowed(line), commented),
            Some(start) => (Cow::Owned(joined(start, lines.by_ref().map(|(_, line)| line))), None),
        };
        let line = index + 1;
        Some(Statement {
            line,
            text: statement,
            commented,
        })
    })
    .filter(|statement| !statement.text.is_empty())
}

/// Converts the line ends of the classic Mac (`\r` only) to `\n`.
pub(crate) fn with_line_feeds(text: String) -> String {
    if text.contains('\n') {
        text
    } else {
        text.replace('\r', "\n")
    }
}

/// Cuts a text into chunks of `size` bytes or a little more. No chunk ends within a statement.
pub(crate) fn chunks(text: &str, size: usize) -> Vec<&str> {
    let mut chunks = Vec::new();
    let mut rest = text;
    while !rest.is_empty() {
        let (chunk, after) = rest.split_at(statement_end(rest, size));
        chunks.push(chunk);
        rest = after;
    }
    chunks
}

/// Position of the first word equal to `word` in the statement that begins on `line` of `text`. If
/// there is no such word, the position is the line without a column.
///
/// The function counts the lines again, so it is called only for messages.
pub(crate) fn place_of(text: &str, line: usize, word: &str) -> Position {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    for (index, content) in lines.skip(line.saturating_sub(1)) {
        let starts_word = |i: usize| content[..i].chars().next_back().is_none_or(char::is_whitespace);
        let ends_word = |i: usize| {
            content[i..]
                .chars()
                .next()
                .is_none_or(|c| c.is_whitespace() || c == '\\')
        };
        let mut places = content.match_indices(word).map(|(i, _)| i);
        if let Some(start) = places.find(|&i| starts_word(i) && ends_word(i + word.len())) {
            return Position {
                line: index + 1,
                column: Some(content[..start].chars().count() + 1),
            };
        }
        if !uncommented(content).ends_with('\\') {
            break;
        }
    }
    Position::line(line)
}

/// Splits a statement into its keyword and the rest.
pub(crate) fn split_keyword(statement: &str) -> (&str, &str) {
    // Most keywords end at an ASCII blank, which a search for bytes finds faster.
    let end = statement.bytes().position(|byte| !byte.is_ascii_graphic());
    match end.map(|end| (end, statement.as_bytes()[end])) {
        None => (statement, ""),
        Some((end, byte)) if byte.is_ascii_whitespace() => (&statement[..end], trimmed(&statement[end + 1..])),
        Some(_) => {
            let (keyword, rest) = statement.split_once(char::is_whitespace).unwrap_or((statement, ""));
            (keyword, rest.trim())
        }
    }
}

/// `text` without blanks at both ends. Faster than [`str::trim`] if there are none.
fn trimmed(text: &str) -> &str {
    match text.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => text,
        _ => text.trim(),
    }
}

/// Joins the statement that begins with `start` with its continuation `lines`.
fn joined<'a>(start: &str, lines: impl Iterator<Item = &'a str>) -> String {
    let mut statement = start.to_string();
    for line in lines {
        let line = uncommented(line);
        let more = line.strip_suffix('\\');
        if !statement.is_empty() {
            statement.push(' ');
        }
        statement.push_str(more.unwrap_or(line));
        if more.is_none() {
            break;
        }
    }
    statement.truncate(statement.trim_end().len());
    statement
}

/// End of the statement that contains byte `from`, or end of the text.
fn statement_end(text: &str, from: usize) -> usize {
    let Some(before) = text.as_bytes().get(..from) else {
        return text.len();
    };
    let mut end = before.iter().rposition(|&b| b == b'\n').map_or(0, |i| i + 1);
    for line in text[end..].split_inclusive('\n') {
        end += line.len();
        if !uncommented(line).ends_with('\\') {
            break;
        }
    }
    end
}

/// Returns the line without its comment and surrounding blanks.
pub fn uncommented(line: &str) -> &str {
    parts(line).0
}

/// Returns the line without its comment. Also returns the line with its comment, if there is a
/// comment. Surrounding blanks are left out.
fn parts(line: &str) -> (&str, Option<&str>) {
    // Most lines have no comment, and this search for `#` is faster than the search below.
    if !line.as_bytes().contains(&b'#') {
        return (trimmed(line), None);
    }
    // Keep lines of vertex colours, which are comments for other programs
    if line.starts_with(MRGB) {
        return (line.trim(), None);
    }
    match comment_starts(line).next() {
        Some(start) => (line[..start].trim(), Some(line.trim())),
        None => (line.trim(), None),
    }
}

/// Byte offsets where comments may begin: each `#` at the start of a word.
fn comment_starts(line: &str) -> impl DoubleEndedIterator<Item = usize> + Clone {
    let starts_word = |i: usize| line[..i].chars().next_back().is_none_or(char::is_whitespace);
    line.match_indices('#').map(|(i, _)| i).filter(move |&i| starts_word(i))
}

/// Possible names in a text with `#`, the longest first. In the text `Paint #1 # red`, the name is
/// either the whole text or `Paint #1`, with `# red` as a comment.
pub(crate) fn possible_names(whole: &str) -> impl Iterator<Item = &str> + Clone {
    let starts: Vec<usize> = comment_starts(whole).skip(1).collect();
    let shorter = starts.into_iter().rev().map(|start| whole[..start].trim_end());
    std::iter::once(whole).chain(shorter)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str =
        "\u{feff}v 1 2 3 # corner\r\n# all comment \\\n\nf 1 \\\n  2 3\\\n4\nusemtl Mat#2 # name\nend \\";

    #[test]
    fn comments_continuations_and_marks_are_resolved() {
        let got: Vec<(usize, String)> = statements(TEXT).map(|(n, s)| (n, s.into_owned())).collect();
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

    #[test]
    fn whole_name_includes_a_possible_comment() {
        let whole = |text| whole_statements(text).next().unwrap().whole_name();
        assert_eq!(whole("\tusemtl  Paint  #1 \r\n"), Some("Paint  #1"));
        assert_eq!(whole("newmtl #1\n"), Some("#1"));
        for text in ["usemtl Mat#2\n", "# all\nusemtl a\n", "usemtl a \\\n #1\n"] {
            assert_eq!(whole(text), None, "{text}");
        }
    }

    #[test]
    fn possible_names_end_before_each_comment() {
        let all = |whole| possible_names(whole).collect::<Vec<_>>();
        assert_eq!(
            all("Paint #1 # red #2"),
            ["Paint #1 # red #2", "Paint #1 # red", "Paint #1"]
        );
        assert_eq!(all("#1 # red"), ["#1 # red", "#1"]);
        assert_eq!(all("Mat#2"), ["Mat#2"]);
    }

    #[test]
    fn word_has_line_and_column() {
        let place = |line, word| {
            let Position { line, column } = place_of(TEXT, line, word);
            (line, column)
        };
        assert_eq!(place(1, "v"), (1, Some(1)));
        assert_eq!(place(1, "3"), (1, Some(7)));
        assert_eq!(place(4, "3"), (5, Some(5)));
        assert_eq!(place(4, "4"), (6, Some(1)));
        assert_eq!(place(4, "7"), (4, None));
        assert_eq!(place(7, "Mat#2"), (7, Some(8)));
        assert_eq!(place(99, "x"), (99, None));
        // Columns count characters, and `word` matches whole words only
        assert_eq!(place_of("ä 10 1\n", 1, "1").column, Some(6));
    }

    #[test]
    fn chunks_end_between_statements() {
        let whole: Vec<_> = statements(TEXT).map(|(_, s)| s).collect();
        for size in 0..=TEXT.len() + 1 {
            let chunks = chunks(TEXT, size);
            assert_eq!(chunks.concat(), TEXT);
            let split: Vec<_> = chunks.iter().flat_map(|p| statements(p)).map(|(_, s)| s).collect();
            assert_eq!(split, whole, "chunks of {size} bytes");
        }
        assert!(chunks(TEXT, 1).len() == 5, "{:?}", chunks(TEXT, 1));
    }

    /// A statement may begin with empty lines that are continued. The keyword follows them.
    #[test]
    fn a_statement_may_begin_with_an_empty_line() {
        let got: Vec<_> = statements("\\\n \\\nf 1 2 3\n").collect();
        assert_eq!(got, [(1, Cow::Borrowed("f 1 2 3"))]);
    }

    #[test]
    fn keywords_end_at_any_blank() {
        for (statement, expected) in [
            ("f 1 2", ("f", "1 2")),
            ("f\t 1 2", ("f", "1 2")),
            ("f\u{b}1", ("f", "1")),
            ("f\u{a0}1 ", ("f", "1")),
            ("f\u{1}1 2", ("f\u{1}1", "2")),
            ("größe 1\u{3000}", ("größe", "1")),
            ("f", ("f", "")),
            ("", ("", "")),
        ] {
            assert_eq!(split_keyword(statement), expected, "{statement:?}");
        }
        for text in ["", " ", "a", " a", "a\u{2003}", "\u{a0}a b\t", "é"] {
            assert_eq!(trimmed(text), text.trim(), "{text:?}");
        }
    }

    /// Lines are joined in linear time. If each joined line copied the statement again, this test
    /// would take minutes.
    #[test]
    fn a_statement_may_have_many_lines() {
        let text = "1\\\n".repeat(300_000);
        let got: Vec<_> = statements(&text).collect();
        assert_eq!(got.len(), 1);
        assert_eq!(got[0].1.len(), 600_000 - 1);
    }
}
