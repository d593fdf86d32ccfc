//! Files rewritten in the statements that both readers know: what a documented difference is about is replaced by its plain equivalent, and noted with
//! its line. The rewritten file is read by tobj again, so that an explanation is one that makes both readers agree.
//!
//! Lines are cut here anew, without the code of the own reader.

use super::kind::{Kind, Notes};
use crate::color::xyz::equal_energy_to_linear;
use crate::io::input::read_bytes;
use crate::io::obj::LibraryName;
use crate::io::statements::{possible_names, with_line_feeds};
use crate::io::{FileError, read_text};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// A text file as both readers would have it: UTF-8 without a byte-order mark, lines ended by LF.
pub(super) fn plain_text(path: &Path, what: &str, notes: &mut Notes) -> Result<String, FileError> {
    let mut text = read_text(path, what)?;
    if read_bytes(path, what)? != text.as_bytes() {
        notes.add(Kind::Encoding, 1);
    }
    if text.starts_with('\u{feff}') {
        text = text.trim_start_matches('\u{feff}').to_string();
        notes.add(Kind::ByteOrderMark, 1);
    }
    if !text.contains('\n') && text.contains('\r') {
        text = with_line_feeds(text);
        notes.add(Kind::LineEnds, 1);
    }
    Ok(text)
}

/// A corner without the texture coordinates and the normal whose index is 0.
fn without_zeros(corner: &str) -> String {
    let mut parts = corner.split('/');
    let v = parts.next().unwrap_or("");
    let [vt, vn] = [parts.next(), parts.next()].map(|part| part.filter(|p| p.parse() != Ok(0i64)).unwrap_or(""));
    match (vt, vn) {
        ("", "") => v.to_string(),
        (vt, "") => format!("{v}/{vt}"),
        (vt, vn) => format!("{v}/{vt}/{vn}"),
    }
}

/// A statement: its line, what the line is, and the words of the statement where the line is not plain.
struct Statement<'a> {
    line: usize,
    raw: &'a str,
    content: Cow<'a, str>,
}

impl Statement<'_> {
    /// What follows the keyword, with its comment; `None` without one, or if lines continue it.
    fn whole_name(&self) -> Option<&str> {
        let is_whole = has_comment(self.raw) && !uncommented(self.raw).ends_with('\\');
        is_whole.then(|| split(self.raw.trim()).1)
    }
}

/// The statements of a text, with notes of comments and of continued lines.
fn statements<'a>(text: &'a str, notes: &mut Notes) -> Vec<Statement<'a>> {
    let mut lines = text.lines().enumerate();
    let mut all = Vec::new();
    while let Some((index, raw)) = lines.next() {
        let (mut content, mut is_commented) = (Cow::Borrowed(uncommented(raw)), has_comment(raw));
        let line = index + 1;
        let mut is_continued = false;
        while let Some(start) = content.strip_suffix('\\') {
            is_continued = true;
            let start = start.trim_end().to_string();
            let Some((_, next)) = lines.next() else {
                content = Cow::Owned(start);
                break;
            };
            is_commented |= has_comment(next);
            content = Cow::Owned(format!("{start} {}", uncommented(next)).trim().to_string());
        }
        if is_continued {
            notes.add(Kind::Continuation, line);
        } else if is_commented && !content.is_empty() {
            notes.add(Kind::TrailingComment, line);
        }
        all.push(Statement { line, raw, content });
    }
    all
}

fn comment_start(line: &str) -> Option<usize> {
    let bytes = line.as_bytes();
    if !bytes.contains(&b'#') {
        return None;
    }
    let is_start = |i: usize| line[..i].chars().next_back().is_none_or(char::is_whitespace);
    (0..bytes.len()).find(|&i| bytes[i] == b'#' && is_start(i))
}

fn has_comment(line: &str) -> bool {
    comment_start(line).is_some()
}

fn uncommented(line: &str) -> &str {
    line[..comment_start(line).unwrap_or(line.len())].trim()
}

/// A face as tobj reads it.
pub(super) struct PlainFace {
    /// The line of its statement in the original file.
    pub line: usize,
    /// Number of corners, at least 3.
    pub corners: usize,
    /// Whether a smoothing group is on.
    pub is_smooth: bool,
    /// Whether some of its corners have texture coordinates, or normals, that others lack.
    pub is_mixed: bool,
}

/// A rewritten OBJ file.
#[derive(Default)]
pub(super) struct PlainObj {
    pub text: String,
    /// Faces in the file's order.
    pub faces: Vec<PlainFace>,
    /// Lines that name libraries; in the text they have their number as a name.
    pub libraries: Vec<usize>,
    /// Lines of `usemtl` with their names.
    pub uses: Vec<(String, usize)>,
    /// Statements by line where values stand; moved to the front where faces name what comes later.
    values: String,
    pattern: Option<Pattern>,
    is_smooth: bool,
    whole_names: BTreeSet<String>,
    /// `v`, `vt` and `vn` so far.
    counts: [i64; 3],
}

/// Which of texture coordinates and normals the corners of a face have; `None` where they differ.
type Pattern = Option<[bool; 2]>;

/// What must be known of a whole OBJ file before it is rewritten.
#[derive(Default)]
struct FileSurvey {
    has_colors: bool,
    lacks_colors: bool,
    /// Normals that are zero or not finite, by index from 1.
    bad_normals: Vec<i64>,
    has_forward: bool,
}

impl FileSurvey {
    fn of(all: &[Statement]) -> Self {
        let mut survey = Self::default();
        let mut counts = [0i64; 3];
        for statement in all {
            let mut words = statement.content.split_whitespace();
            match words.next() {
                Some("v") => {
                    counts[0] += 1;
                    let has_color = words.count() == 6;
                    survey.has_colors |= has_color;
                    survey.lacks_colors |= !has_color;
                }
                Some("vt") => counts[1] += 1,
                Some("vn") => {
                    counts[2] += 1;
                    let values: Vec<f32> = words.take(3).map(|w| w.parse().unwrap_or(f32::NAN)).collect();
                    if values.iter().any(|n| !n.is_finite()) || values.iter().all(|&n| n == 0.0) {
                        survey.bad_normals.push(counts[2]);
                    }
                }
                Some("f" | "fo") => {
                    let is_forward = |word: &str| indices(word).iter().zip(counts).any(|(&i, count)| i > count);
                    survey.has_forward = survey.has_forward || words.any(is_forward);
                }
                _ => {}
            }
        }
        survey
    }
}

/// The indices of a corner, 0 where it has none.
fn indices(word: &str) -> [i64; 3] {
    let mut all = [0; 3];
    for (slot, part) in all.iter_mut().zip(word.split('/')) {
        *slot = part.parse().unwrap_or(0);
    }
    all
}

/// What the libraries of an OBJ file depend on.
#[derive(Default)]
pub(super) struct ObjNames {
    /// Names in `mtllib`.
    pub libraries: Vec<LibraryName>,
    /// Whether the file names a material.
    pub uses_materials: bool,
    /// Names of materials that go on behind what could begin a comment.
    pub whole_names: BTreeSet<String>,
}

impl ObjNames {
    /// The names in an OBJ file.
    pub fn of(text: &str) -> Self {
        let mut names = Self::default();
        for statement in statements(text, &mut Notes::default()) {
            let whole = statement.whole_name();
            match split(&statement.content) {
                ("mtllib", text) => names.libraries.push(LibraryName {
                    text: text.into(),
                    whole: whole.map(str::to_string),
                    line: statement.line,
                }),
                ("usemtl", name) => {
                    names.uses_materials |= !name.is_empty() || whole.is_some();
                    let possible = whole.into_iter().flat_map(possible_names);
                    names.whole_names.extend(possible.map(str::to_string));
                }
                _ => {}
            }
        }
        names
    }
}

/// Names of materials of a library that go on behind what could begin a comment.
pub(super) fn whole_names_of_mtl(text: &str) -> BTreeSet<String> {
    let all = statements(text, &mut Notes::default());
    let named = all
        .iter()
        .filter(|s| split(&s.content).0.eq_ignore_ascii_case("newmtl"));
    let possible = named.filter_map(Statement::whole_name).flat_map(possible_names);
    possible.map(str::to_string).collect()
}

/// Rewrites an OBJ file, whose libraries define materials of these `whole_names`.
pub(super) fn plain_obj(text: &str, whole_names: &BTreeSet<String>, notes: &mut Notes) -> PlainObj {
    let all = statements(text, notes);
    let survey = FileSurvey::of(&all);
    let mut plain = PlainObj {
        whole_names: whole_names.clone(),
        ..PlainObj::default()
    };
    for statement in &all {
        plain.add(statement, &survey, notes);
    }
    if survey.has_colors && survey.lacks_colors {
        notes.add(Kind::VertexColor, 1);
    }
    if survey.has_forward {
        notes.add(Kind::ForwardReference, 1);
        plain.text = format!("{}{}", plain.values, plain.text);
    }
    plain
}

impl PlainObj {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    fn add(&mut self, statement: &Statement, survey: &FileSurvey, notes: &mut Notes) {
        let (keyword, rest) = split(&statement.content);
        let words = || rest.split_whitespace();
        let line = statement.line;
        match keyword {
            "v" => {
                self.counts[0] += 1;
                let mut first: Vec<&str> = words().take(3).collect();
                match words().count() {
                    4 => {
                        let weight: Option<f32> = words().nth(3).and_then(|w| w.parse().ok());
                        if weight != Some(1.0) {
                            notes.add(Kind::VertexWeight, line);
                        }
                    }
                    count @ (0..=3 | 6) => {
                        if count == 6 && words().skip(3).any(|w| w.parse::<f32>().is_err()) {
                            notes.add(Kind::VertexColor, line);
                        }
                    }
                    _ => notes.add(Kind::VertexValues, line),
                }
                first.truncate(3);
                self.value(survey, &format!("v {}", first.join(" ")));
            }
            "vt" | "vn" => {
                let (kind, needed) = if keyword == "vt" { (1, 2) } else { (2, 3) };
                self.counts[kind] += 1;
                let mut values: Vec<&str> = words().collect();
                if keyword == "vt" && values.len() == 1 {
                    notes.add(Kind::ShortTexture, line);
                    values.push("0");
                }
                for value in values.iter_mut().take(needed) {
                    if value.contains(".#") || value.contains("nan(") {
                        notes.add(Kind::NumberWord, line);
                        *value = "NaN";
                    }
                }
                self.value(survey, &format!("{keyword} {}", values.join(" ")));
            }
            "f" | "fo" => {
                if keyword == "fo" {
                    notes.add(Kind::OldFace, line);
                }
                self.face(line, &words().collect::<Vec<_>>(), survey, notes);
            }
            "l" => {
                let count = words().count();
                let is_read = |word: &str| {
                    word.split('/')
                        .all(|part| part.is_empty() || part.parse::<i64>().is_ok())
                };
                if !(1..=2).contains(&count) || !words().all(is_read) {
                    notes.add(Kind::Polyline, line);
                }
            }
            "usemtl" | "mtllib" => self.name(keyword, rest, statement, notes),
            "s" => self.is_smooth = rest.parse::<u32>().is_ok_and(|group| group != 0),
            "o" | "g" => {
                self.pattern = None;
                self.line(&statement.content);
            }
            _ => {}
        }
    }

    /// A statement with a name: tobj takes what stands after the first blank of the line.
    fn name(&mut self, keyword: &str, rest: &str, statement: &Statement, notes: &mut Notes) {
        let line = statement.line;
        let whole = statement.whole_name();
        let is_defined = |name: &&str| keyword == "usemtl" && self.whole_names.contains(*name);
        let rest = whole
            .and_then(|whole| possible_names(whole).find(is_defined))
            .unwrap_or(rest);
        let by_tobj = statement.raw.split_once(' ').map_or("", |(_, name)| name.trim());
        if rest.is_empty() {
            notes.add(Kind::Nameless, line);
            return;
        }
        if by_tobj != rest && !has_comment(statement.raw) && !statement.raw.trim_end().ends_with('\\') {
            notes.add(Kind::KeywordBlanks, line);
        }
        match keyword {
            "usemtl" => {
                self.pattern = None;
                self.uses.push((rest.to_string(), line));
            }
            _ => {
                self.libraries.push(line);
                return self.line(&format!("{keyword} {line}"));
            }
        }
        self.line(&format!("{keyword} {rest}"));
    }

    fn value(&mut self, survey: &FileSurvey, text: &str) {
        let to = if survey.has_forward {
            &mut self.values
        } else {
            &mut self.text
        };
        *to += text;
        to.push('\n');
    }

    fn face(&mut self, line: usize, corners: &[&str], survey: &FileSurvey, notes: &mut Notes) {
        if corners.len() < 3 {
            let is_read = |word: &&str| {
                word.split('/')
                    .all(|part| part.is_empty() || part.parse::<i64>().is_ok())
            };
            if corners.is_empty() || !corners.iter().all(is_read) {
                notes.add(Kind::ShortFace, line);
            }
            return;
        }
        let mut patterns = Vec::with_capacity(corners.len());
        let mut words: Vec<Cow<str>> = Vec::with_capacity(corners.len());
        for &corner in corners {
            let mut word = Cow::Borrowed(corner);
            if !survey.bad_normals.is_empty() {
                let index = indices(corner)[2];
                let index = if index < 0 { self.counts[2] + 1 + index } else { index };
                if survey.bad_normals.binary_search(&index).is_ok() {
                    notes.add(Kind::BadNormal, line);
                    let mut parts = corner.splitn(3, '/');
                    let (v, vt) = (parts.next().unwrap_or(""), parts.next().unwrap_or(""));
                    word = Cow::Owned(if vt.is_empty() { v.into() } else { format!("{v}/{vt}") });
                }
            }
            if survey.has_forward && word.contains('-') {
                word = Cow::Owned(self.absolute(&word));
            }
            // An index 0, which tobj takes for none
            if word.split('/').skip(1).any(|part| part.parse() == Ok(0i64)) {
                notes.add(Kind::WrongStatement, line);
                word = Cow::Owned(without_zeros(&word));
            }
            let mut parts = word.split('/').skip(1).map(|part| !part.is_empty());
            patterns.push([parts.next().unwrap_or(false), parts.next().unwrap_or(false)]);
            words.push(word);
        }
        let pattern: Pattern = patterns
            .first()
            .copied()
            .filter(|first| patterns.iter().all(|p| p == first));
        let is_mixed = pattern.is_none();
        let differs = self.pattern.is_some_and(|last| last != pattern);
        if differs || is_mixed {
            notes.add(Kind::MixedCorners, line);
            self.line("g");
        }
        self.pattern = Some(pattern);
        let _ = writeln!(self.text, "f {}", words.join(" "));
        if is_mixed {
            self.line("g");
        }
        self.faces.push(PlainFace {
            line,
            corners: corners.len(),
            is_smooth: self.is_smooth,
            is_mixed,
        });
    }

    /// A corner whose relative indices are made absolute.
    fn absolute(&self, corner: &str) -> String {
        let parts = corner
            .split('/')
            .enumerate()
            .map(|(kind, part)| match part.parse::<i64>() {
                Ok(index) if index < 0 => (self.counts.get(kind).copied().unwrap_or(0) + 1 + index).to_string(),
                _ => part.to_string(),
            });
        parts.collect::<Vec<_>>().join("/")
    }
}

/// Keyword and rest of a statement.
fn split(statement: &str) -> (&str, &str) {
    let end = statement.find(char::is_whitespace).unwrap_or(statement.len());
    (&statement[..end], statement[end..].trim())
}

/// Keywords that tobj knows, as it writes them.
const TOBJ_KEYWORDS: [&str; 20] = [
    "newmtl", "Ka", "Kd", "Ks", "Ke", "Ns", "Ni", "d", "illum", "map_Ka", "map_Kd", "map_Ks", "map_Bump", "map_bump",
    "map_Ns", "map_ns", "map_NS", "bump", "map_d", "Tf",
];

/// Rewrites a material library, of whose materials the OBJ file uses these `whole_names`.
pub(super) fn plain_mtl(text: &str, whole_names: &BTreeSet<String>, notes: &mut Notes) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut materials = 0;
    for statement in statements(text, notes) {
        let (keyword, rest) = split(&statement.content);
        let is_name = keyword.eq_ignore_ascii_case("newmtl");
        let is_used = |name: &&str| is_name && whole_names.contains(*name);
        let whole = statement.whole_name();
        let rest = whole
            .and_then(|whole| possible_names(whole).find(is_used))
            .unwrap_or(rest);
        let line = statement.line;
        let known = TOBJ_KEYWORDS.iter().find(|known| known.eq_ignore_ascii_case(keyword));
        let is_exact = TOBJ_KEYWORDS.contains(&keyword);
        let key = match known {
            Some(known) if !is_exact => {
                notes.add(Kind::KeywordCase, line);
                *known
            }
            _ => keyword,
        };
        if materials == 0 && key != "newmtl" {
            notes.add(Kind::BeforeMaterial, line);
            continue;
        }
        let words: Vec<&str> = rest.split_whitespace().collect();
        let value: Cow<str> = match (key, &words[..]) {
            ("newmtl", []) => {
                notes.add(Kind::Nameless, line);
                Cow::Owned(format!("{NAMELESS}{materials}"))
            }
            ("Ka" | "Kd" | "Ks" | "Ke", [grey]) => {
                notes.add(Kind::GreyColor, line);
                Cow::Owned(format!("{grey} {grey} {grey}"))
            }
            ("Kd" | "Ks" | "Ke", ["xyz", xyz @ ..]) => match rgb_of_xyz(key, xyz) {
                Some([r, g, b]) => {
                    notes.add(Kind::XyzColor, line);
                    Cow::Owned(format!("{r} {g} {b}"))
                }
                None => Cow::Borrowed(rest),
            },
            ("Ka", [_, _]) => {
                notes.add(Kind::GreyColor, line);
                continue;
            }
            ("Ka", [a, b, c, ..]) if [a, b, c].iter().any(|w| w.parse::<f32>().is_err()) => {
                notes.add(Kind::AmbientWords, line);
                continue;
            }
            ("Ns" | "Ni" | "d", [_, .., last]) => {
                notes.add(Kind::NumberOptions, line);
                Cow::Borrowed(*last)
            }
            ("map_Ka", []) => {
                notes.add(Kind::AmbientWords, line);
                continue;
            }
            _ => Cow::Borrowed(rest),
        };
        materials += usize::from(key == "newmtl");
        let _ = writeln!(plain, "{key} {value}");
    }
    plain
}

/// The linear colour of CIE XYZ, of which one number is a grey.
fn rgb_of_xyz(key: &str, words: &[&str]) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = words.iter().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let xyz = match numbers[..] {
        [grey] => [grey; 3],
        [x, y, z] => [x, y, z],
        _ => return None,
    };
    let max = if key == "Ke" { f32::MAX } else { 1.0 };
    let is_finite = xyz.iter().all(|n| n.is_finite());
    is_finite.then(|| equal_energy_to_linear(xyz).map(|c| c.clamp(0.0, max)))
}

/// Begin of the names that stand for those of nameless materials.
pub(super) const NAMELESS: &str = "nameless material ";
