//! Pages of the guide. They are compiled into the program, because an installed program has no
//! folder docs/guide.

/// Width of the text in characters.
const WIDTH: usize = 96;

/// A page of the guide.
pub(super) struct Topic {
    /// Names of the page for `help`; the first name is listed.
    pub names: &'static [&'static str],
    /// Text of the page in Markdown.
    text: &'static str,
}

macro_rules! topics {
    ($($($name:literal)+ = $page:literal,)+) => {
        &[$(Topic {
            names: &[$($name),+],
            text: include_str!(concat!("../../docs/guide/", $page)),
        }),+]
    };
}

/// All pages, in the order of the guide.
pub(super) const TOPICS: &[Topic] = topics! {
    "camera" "cameras" = "tutorials/find-a-camera.md",
    "light" "lights" = "tutorials/light-a-room.md",
    "turntable" = "tutorials/turntable.md",
    "black" "dark" = "how-to/black-picture.md",
    "textures" = "how-to/missing-textures.md",
    "looks" = "how-to/fix-materials.md",
    "white" "product" "transparent" = "how-to/product-shot.md",
    "composite" "nuke" = "how-to/composite.md",
    "parts" "masks" = "how-to/parts.md",
    "projections" "plan" "elevation" "panorama" = "how-to/projections.md",
    "sections" = "how-to/sections.md",
    "lines" = "how-to/draw-lines.md",
    "room" "stand" = "how-to/stand-in-a-room.md",
    "noise" "samples" = "how-to/enough-samples.md",
    "exposure" = "how-to/re-expose-and-denoise.md",
    "scans" = "how-to/scans.md",
    "smooth" "displacement" = "how-to/smooth-and-displace.md",
    "caustics" = "how-to/caustics.md",
    "batch" = "how-to/batch.md",
    "farm" "computers" = "how-to/farm.md",
    "viewer" = "how-to/view-in-a-browser.md",
    "python" = "how-to/python.md",
    "scene" "toml" = "reference/scene-file.md",
    "guesses" = "reference/guesses.md",
    "materials" = "reference/materials.md",
    "mtl" "obj" = "reference/obj-mtl.md",
    "integrators" = "reference/integrators.md",
    "background" "ground" = "reference/background.md",
    "exr" "png" = "reference/output.md",
    "comparing" = "reference/compare.md",
    "checks" "codes" = "reference/checks.md",
    "json" = "reference/json.md",
    "units" = "reference/units.md",
    "glossary" = "reference/glossary.md",
};

/// Topic of the JSON Schema of scene files.
pub(super) const SCHEMA: &str = "schema";

/// Text of the page that explains the codes of findings.
const CODES: &str = include_str!("../../docs/guide/reference/checks.md");

/// Cells of a row of a Markdown table.
fn cells(row: &str) -> impl Iterator<Item = &str> {
    row.trim().trim_matches('|').split(" | ").map(str::trim)
}

/// A row of a table of codes.
struct CodeRow {
    /// Codes in the first cell.
    codes: Vec<&'static str>,
    /// Line with the headers of the table.
    header: &'static str,
    line: &'static str,
}

/// Rows of the tables of codes. These tables have the header `code` in their first column.
fn rows_of_codes() -> impl Iterator<Item = CodeRow> {
    let mut header = None;
    CODES.lines().filter_map(move |line| {
        if line.starts_with("| code |") {
            header = Some(line);
        } else if !line.starts_with('|') {
            header = None;
        }
        let header = header.filter(|_| line.starts_with("| `"))?;
        let codes = cells(line).next()?.split('`').skip(1).step_by(2).collect();
        Some(CodeRow { codes, header, line })
    })
}

/// All codes of errors, warnings and notes, except `scene`, which is a page.
pub(super) fn codes() -> impl Iterator<Item = &'static str> {
    let codes = rows_of_codes().flat_map(|row| row.codes);
    codes.filter(|code| !TOPICS.iter().any(|topic| topic.names.contains(code)))
}

/// Text with the meaning of an error, warning or note code: its row, then its item in the list of
/// details.
pub(super) fn meaning(code: &str) -> Option<String> {
    let CodeRow { header, line, .. } = rows_of_codes().find(|row| row.codes.contains(&code))?;
    let is_detail = |line: &&str| line.starts_with(&format!("- `{code}`:"));
    let details: Vec<&str> = CODES.lines().filter(is_detail).collect();
    Some(plain(&format!("{header}\n|---|\n{line}\n\n{}\n", details.join("\n"))))
}

impl Topic {
    /// The page called `name`.
    pub fn of(name: &str) -> Option<&'static Self> {
        TOPICS.iter().find(|topic| topic.names.contains(&name))
    }

    /// Title of the page.
    pub fn title(&self) -> &'static str {
        title(self.text)
    }

    /// The page as text for a terminal.
    pub fn plain(&self) -> String {
        plain(self.text)
    }
}

fn title(text: &str) -> &str {
    text.lines().next().unwrap_or_default().trim_start_matches("# ")
}

/// Converts Markdown to text for a terminal. For each row of a table, the first cell is printed
/// with the other cells below it. The third and later cells begin with the header of their column.
fn plain(markdown: &str) -> String {
    let mut text = String::new();
    let mut heads: Vec<String> = Vec::new();
    let mut is_code = false;
    let mut paragraph = String::new();
    for line in markdown.lines().chain([""]) {
        let is_part = line.starts_with(|c: char| c.is_alphanumeric() || "`*([\"".contains(c));
        if is_part && !is_code && !line.starts_with("```") && numbered_item(line).is_none() {
            paragraph += &format!("{}{line}", if paragraph.is_empty() { "" } else { " " });
            continue;
        }
        if !paragraph.is_empty() {
            wrap(&mut text, "", "", &std::mem::take(&mut paragraph));
        }
        if line.starts_with("```") {
            is_code = !is_code;
        } else if is_code {
            text += &format!("    {line}\n");
        } else if line.starts_with("<!--") {
        } else if let Some(title) = line.strip_prefix("# ").or_else(|| line.strip_prefix("## ")) {
            let rule = if line.starts_with("##") { "-" } else { "=" };
            text += &format!("{}\n{}\n", title, rule.repeat(title.chars().count()));
        } else if line.starts_with('#') {
            text += &format!("{}\n", line.trim_start_matches(['#', ' ']));
        } else if line.starts_with('|') {
            let row: Vec<&str> = cells(line).collect();
            if heads.is_empty() {
                heads = row.into_iter().map(String::from).collect();
            } else if !line.starts_with("|--") {
                for (column, cell) in row.iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
                    match (column, heads.get(column).filter(|head| !head.is_empty())) {
                        (0, _) => wrap(&mut text, "  ", "  ", cell),
                        (2.., Some(head)) => wrap(&mut text, "      ", "      ", &format!("{head}: {cell}")),
                        _ => wrap(&mut text, "      ", "      ", cell),
                    }
                }
            }
            continue;
        } else if let Some(item) = line.trim_start().strip_prefix("- ") {
            let indent = " ".repeat(line.len() - line.trim_start().len());
            wrap(&mut text, &format!("{indent}- "), &format!("{indent}  "), item);
        } else if let Some((number, item)) = numbered_item(line) {
            wrap(&mut text, &format!("{number}. "), "   ", item);
        } else if !line.is_empty() {
            wrap(&mut text, "", "  ", line);
        } else if !text.ends_with("\n\n") && !text.is_empty() {
            text.push('\n');
        }
        heads.clear();
    }
    text.truncate(text.trim_end().len());
    text + "\n"
}

/// Number and text of an item of a numbered list, such as `1. text`.
fn numbered_item(line: &str) -> Option<(&str, &str)> {
    let (number, item) = line.split_once(". ")?;
    let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    is_number.then_some((number, item))
}

/// Appends `words` in lines of [`WIDTH`] characters. The first line begins with `first`, the others
/// with `later`.
fn wrap(text: &mut String, first: &str, later: &str, words: &str) {
    let words = without_links(words);
    let mut line = String::from(first);
    let mut is_empty = true;
    for word in words.split_whitespace() {
        if !is_empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            text.push_str(line.trim_end());
            text.push('\n');
            line = later.into();
            is_empty = true;
        }
        if !is_empty {
            line.push(' ');
        }
        line += word;
        is_empty = false;
    }
    text.push_str(line.trim_end());
    text.push('\n');
}

/// Text of Markdown without link targets and without emphasis marks.
fn without_links(words: &str) -> String {
    let mut text = String::new();
    let mut rest = words;
    while let Some((before, after)) = rest.split_once("](") {
        let Some((label_start, (_, behind))) = before.rfind('[').zip(after.split_once(')')) else {
            break;
        };
        text += before[..label_start].trim_end_matches('!');
        text += &before[label_start + 1..];
        rest = behind;
    }
    text += rest;
    text.replace("**", "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markdown_becomes_plain_text() {
        let page = "# Title\n\nSome [words](a.md#b) of\n**text**.\n\n| code | meaning | remedy |\n|---|---|---|\n| `a`, `b` | first | do |\n\n- item\n\n1. first\n2. second\n\n```toml\nkey = 1\n```\n";
        let expected = "Title\n=====\n\nSome words of text.\n\n  `a`, `b`\n      first\n      remedy: do\n\n- item\n\n1. first\n2. second\n\n    key = 1\n";
        assert_eq!(plain(page), expected);
    }

    #[test]
    fn meaning_of_code_has_headers_of_its_table() {
        let text = meaning("missing-tile").unwrap();
        assert!(text.contains("\n      example: "), "{text}");
        assert!(text.contains("\n      remedy: "), "{text}");
        assert_eq!(meaning("no-such-code"), None);
    }

    #[test]
    fn meaning_of_code_has_its_details() {
        let details = |code: &str| meaning(code).unwrap().contains(&format!("\n\n- `{code}`: "));
        assert!(details("two-sided"));
        assert!(!details("missing-tile"));
    }
}
