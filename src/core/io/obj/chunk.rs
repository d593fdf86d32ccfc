//! Statements of one chunk of an OBJ file.

use super::colors::{color_of, read_mrgb};
use super::counts::{Counts, KEYWORDS};
use super::libraries::LibraryName;
use super::outline::{NONE, Section, VertexData};
use super::parts::{CurrentNames, PartState};
use super::polygon::MAX_CLIPPED;
use super::remarks::{MAX_NAME, Remark, Remarks, SkippedElement, ignored};
use crate::io::PartFilter;
use crate::io::statements::{MRGB, Statement, place_of, split_keyword, whole_statements};
use crate::io::{FileError, MAX_WRONG, Position};
use crate::math::{DVec3, Vec2, Vec3, excerpt};
use std::iter::once;
use std::path::Path;
use std::str;

/// Names of the three indices of a corner, in the order of [`KEYWORDS`].
const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Error in a statement: the message, the wrong word, and the remedy.
struct StatementError {
    word: String,
    message: String,
    help: String,
}

impl StatementError {
    fn new(word: &str, message: impl Into<String>, help: impl Into<String>) -> Self {
        let (word, message, help) = (word.into(), message.into(), help.into());
        Self { word, message, help }
    }

    /// Adds the effect of the error to the message, such as that a face is left out.
    fn and(mut self, effect: &str) -> Self {
        self.message = format!("{}; {effect}", self.message);
        self
    }
}

/// Data to read from an OBJ file.
#[derive(Clone, Copy)]
pub(super) struct DataSelection<'a> {
    /// Point of the file's coordinates that becomes the origin.
    pub origin: DVec3,
    /// True if the line of each face is kept.
    pub keep_lines: bool,
    /// True if lines and points are read.
    pub keep_wires: bool,
    /// True if the names of parts are kept.
    pub keep_names: bool,
    /// Filter of the parts whose faces are read.
    pub parts: &'a PartFilter,
}

impl<'a> DataSelection<'a> {
    /// Selects faces and the names of their parts, for the parts that `parts` shows.
    pub fn of_faces(parts: &'a PartFilter) -> Self {
        Self {
            origin: DVec3::ZERO,
            keep_lines: false,
            keep_wires: false,
            keep_names: true,
            parts,
        }
    }
}

/// Contents of a chunk of the file.
pub(super) struct Chunk<'a> {
    before: &'a Counts,
    total: &'a Counts,
    pub vertices: VertexData,
    pub section: Section,
    pub libraries: Vec<LibraryName>,
    pub remarks: Remarks,
    /// Errors for the first wrong statements, as in [`Outline`](super::outline::Outline).
    pub wrong: Vec<FileError>,
    pub wrong_count: usize,
    /// Indices of wrong positions, sorted.
    pub wrong_positions: Vec<usize>,
    /// Errors for the first wrong `vt` index and for the first wrong `vn` index in the current
    /// face.
    lost: [Option<StatementError>; 2],
    /// Point of the file's coordinates that becomes the origin.
    origin: DVec3,
    keep_lines: bool,
    pub parts: PartState<'a>,
    /// Lines and points, if they are read.
    pub wires: Option<Wires<'a>>,
}

/// Lines and points of a chunk.
pub(super) struct Wires<'a> {
    /// The lines and points. Each is stored as a face of its vertices.
    pub section: Section,
    pub parts: PartState<'a>,
}

impl<'a> Chunk<'a> {
    /// Reads a chunk. `total` has the counts of the whole file, `before` has the counts of the text
    /// before the chunk. `names` are the part names at the start of the chunk.
    pub fn parse(
        path: &Path,
        text: &'a str,
        [before, total]: [&'a Counts; 2],
        names: &CurrentNames,
        selection: DataSelection<'a>,
    ) -> Self {
        let parts = || PartState::new(selection.parts, selection.keep_names, names);
        let wires = || Wires {
            section: Section::of_unchanged_state(),
            parts: parts(),
        };
        let mut chunk = Self {
            before,
            total,
            vertices: VertexData::default(),
            section: Section::of_unchanged_state(),
            libraries: Vec::new(),
            remarks: Remarks::default(),
            wrong: Vec::new(),
            wrong_count: 0,
            wrong_positions: Vec::new(),
            lost: [None, None],
            origin: selection.origin,
            keep_lines: selection.keep_lines,
            parts: parts(),
            wires: selection.keep_wires.then(wires),
        };
        for statement in whole_statements(text) {
            let line = statement.line;
            let result = chunk.read(&statement, before.lines + line);
            if result.is_ok() && chunk.lost.iter().all(Option::is_none) {
                continue;
            }
            let lost = std::mem::take(&mut chunk.lost);
            for fault in result.err().into_iter().chain(lost.into_iter().flatten()) {
                chunk.wrong_count += 1;
                if chunk.wrong.len() < MAX_WRONG {
                    let place = place_of(text, line, &fault.word);
                    let place = Position {
                        line: before.lines + place.line,
                        ..place
                    };
                    let error = FileError::new(path, fault.message);
                    chunk.wrong.push(error.at(place).help(fault.help));
                }
            }
        }
        chunk.section.shrink_to_fit();
        chunk.parts.shrink_to_fit();
        chunk
    }

    /// Position of a vertex. Its coordinates are the next words of `words`. If an origin is
    /// subtracted, the coordinates are read as f64, because the rounding error of f32 is too large
    /// far from the file's origin.
    fn position<'w>(
        &self,
        statement: &str,
        rest: &str,
        words: &mut impl Iterator<Item = &'w str>,
    ) -> Result<Vec3, StatementError> {
        let near: [f32; 3] = numbers_of(statement, words, 3)?;
        if self.origin == DVec3::ZERO {
            return Ok(near.into());
        }
        let exact = |word: &str| word.parse().unwrap_or(f64::NAN);
        let mut words = rest.split_ascii_whitespace().map(exact);
        let p = DVec3::from([0; 3].map(|_| words.next().unwrap_or(f64::NAN)));
        Ok((p - self.origin).as_vec3a())
    }

    fn read(&mut self, whole: &Statement, line: usize) -> Result<(), StatementError> {
        let statement = &*whole.text;
        let (keyword, rest) = split_keyword(statement);
        match keyword {
            // A wrong value becomes 0, so that the indices of later values stay valid.
            "v" => {
                let mut words = rest.split_ascii_whitespace();
                let position = self.position(statement, rest, &mut words);
                let position = position.and_then(|p| if p.is_finite() { Ok(p) } else { Err(not_finite(rest)) });
                if position.is_err() {
                    self.wrong_positions.push(self.vertices.positions.len());
                }
                self.vertices.positions.push(*position.as_ref().unwrap_or(&Vec3::ZERO));
                match color_of(words) {
                    Ok(Some(color)) => self.vertices.set_color(color),
                    Ok(None) => {}
                    Err(()) => self.remarks.add(Remark::BadColor, line),
                }
                position.map_err(|fault| fault.and("faces with this vertex are left out"))?;
            }
            "vt" => {
                let uv = numbers(statement, rest, 1).map(Vec2::from);
                let mut uv = uv.map_err(|fault| {
                    self.vertices.uvs.push(Vec2::ZERO);
                    fault.and("the texture coordinate counts as 0 0")
                })?;
                if !uv.is_finite() {
                    self.remarks.add(Remark::BadUv, line);
                    uv = Vec2::ZERO;
                }
                self.vertices.uvs.push(uv);
            }
            "vn" => {
                let given = numbers(statement, rest, 3).map(Vec3::from);
                let given = given.map_err(|fault| {
                    self.vertices.normals.push(Vec3::ZERO);
                    fault.and("the normal counts as missing")
                })?;
                // Normalise in f64, in which squares of f32 numbers neither overflow nor underflow
                let normal = given.as_dvec3().normalize_or_zero().as_vec3a();
                if normal == Vec3::ZERO {
                    self.remarks.add(Remark::BadNormal, line);
                }
                self.vertices.normals.push(normal);
            }
            "f" | "fo" if self.parts.is_shown(self.section.face_count()) => self.read_face(rest, line)?,
            "f" | "fo" => {}
            "o" => {
                self.check_name(rest, line);
                self.all_parts().for_each(|parts| parts.begin_object(rest));
            }
            "g" => {
                self.check_name(rest, line);
                self.all_parts().for_each(|parts| parts.begin_groups(rest));
            }
            "usemtl" => {
                let whole_name = whole.whole_name();
                if !rest.is_empty() || whole_name.is_some() {
                    let wires = self.wires.as_mut().map(|wires| &mut wires.section);
                    for section in once(&mut self.section).chain(wires) {
                        let state_change = section.state_change();
                        state_change.line = line;
                        state_change.whole_name = whole_name.map(Into::into);
                        state_change.material = Some(rest.to_string()).filter(|name| !name.is_empty());
                    }
                }
            }
            "s" => self.section.state_change().smoothing = Some(self.smoothing_group(rest, line)),
            "mtllib" => self.libraries.push(LibraryName {
                text: rest.into(),
                whole: whole.whole_name().map(Into::into),
                line,
            }),
            MRGB => {
                let read = read_mrgb(rest, &mut self.vertices.mrgb);
                read.unwrap_or_else(|()| self.remarks.add(Remark::BadMrgb, line));
            }
            "" => {}
            "p" | "l" if self.wires.is_some() => self.read_wire(keyword == "l", rest, line)?,
            "p" => self
                .remarks
                .skip(SkippedElement::Point, rest.split_ascii_whitespace().count(), line),
            "l" => self.remarks.skip(SkippedElement::Line, 1, line),
            "curv" | "curv2" | "cdc" => self.remarks.skip(SkippedElement::Curve, 1, line),
            "surf" | "bzp" | "bsp" | "cdp" => self.remarks.skip(SkippedElement::Surface, 1, line),
            // Ignore blocks of NUL bytes.
            _ if keyword.bytes().all(|byte| byte == 0) => {}
            _ => match ignored(keyword) {
                Some(index) => self.remarks.ignore(index, line),
                None => self.remarks.add_unknown(&excerpt(keyword), line),
            },
        }
        Ok(())
    }

    /// Reports the name of a part if the name is too long and is therefore cut.
    fn check_name(&mut self, name: &str, line: usize) {
        if name.len() > MAX_NAME {
            self.remarks.add(Remark::LongName, line);
        }
    }

    /// States of the current part: the state for faces, and the state for lines and points if they
    /// are read.
    fn all_parts(&mut self) -> impl Iterator<Item = &mut PartState<'a>> {
        let wires = self.wires.as_mut().map(|wires| &mut wires.parts);
        once(&mut self.parts).chain(wires)
    }

    /// Reads a line or points if their part is shown.
    fn read_wire(&mut self, is_line: bool, words: &str, line: usize) -> Result<(), StatementError> {
        let is_shown = |wires: &mut Wires| wires.parts.is_shown(wires.section.face_count());
        if !self.wires.as_mut().is_some_and(is_shown) {
            return Ok(());
        }
        let vertex = |word: &str| {
            let corner = self.corner(word);
            // Use only positions, and ignore wrong texture coordinates and normals
            self.lost = [None, None];
            corner.map(|[v, ..]| v)
        };
        let vertices: Result<Vec<u32>, StatementError> = words.split_ascii_whitespace().map(vertex).collect();
        let vertices = vertices.map_err(|fault| fault.and("this line or point is left out"))?;
        if is_line && vertices.len() < 2 {
            let message = format!("a line needs two vertices or more, not {}", vertices.len());
            return Err(StatementError::new(
                "l",
                message,
                "name more vertices, or write a point (`p`)",
            ));
        }
        let line = self.keep_lines.then(|| u32::try_from(line).unwrap_or(u32::MAX));
        let size = if is_line { vertices.len() } else { 1 };
        if let Some(Wires { section, .. }) = &mut self.wires {
            for face in vertices.chunks_exact(size) {
                face.iter().for_each(|&v| section.push_corner([v, NONE, NONE]));
                section.push_face(u32::try_from(size).unwrap_or(u32::MAX), line);
            }
        }
        Ok(())
    }

    fn read_face(&mut self, corners: &str, line: usize) -> Result<(), StatementError> {
        let start = self.section.corner_count();
        let mut words = corners.split_ascii_whitespace();
        let read = words.try_for_each(|word| {
            let corner = self.corner(word)?;
            self.section.push_corner(corner);
            Ok(())
        });
        let size = self.section.corner_count() - start;
        let count = size + usize::from(read.is_err()) + words.count();
        if count < 3 || read.is_err() {
            self.section.truncate(start);
            self.lost = [None, None];
        }
        if count < 3 {
            self.remarks.add(Remark::ShortFace, line);
            return Ok(());
        }
        read.map_err(|fault: StatementError| fault.and("the face is left out"))?;
        if size > MAX_CLIPPED {
            self.remarks.add(Remark::LongFace, line);
        }
        let Ok(size) = u32::try_from(size) else {
            self.section.truncate(start);
            let message = format!("a face of {size} corners is too large");
            return Err(StatementError::new("f", message, "cut the face into smaller ones"));
        };
        let line = self.keep_lines.then(|| u32::try_from(line).unwrap_or(u32::MAX));
        self.section.push_face(size, line);
        Ok(())
    }

    /// Indices, counted from 0, of a corner such as `v`, `v/vt`, `v//vn` or `v/vt/vn`. A wrong `vt`
    /// or `vn` is treated as missing, and the error is stored in `lost`.
    fn corner(&mut self, word: &str) -> Result<[u32; 3], StatementError> {
        let mut corner = [NONE; 3];
        // Words are short, so splitting bytes is faster than splitting strings.
        for (kind, part) in word.as_bytes().split(|&b| b == b'/').enumerate() {
            let Some(slot) = corner.get_mut(kind) else {
                let message = format!("`{}` has too many parts", excerpt(word));
                return Err(StatementError::new(word, message, "write v, v/vt, v//vn or v/vt/vn"));
            };
            if !part.is_empty() || kind == 0 {
                match (self.index(kind, part, word), kind) {
                    (Ok(index), _) => *slot = index,
                    (Err(fault), 0) => return Err(fault),
                    (Err(fault), 1) => {
                        self.lost[0].get_or_insert(fault.and("its texture coordinates count as 0 0"));
                    }
                    (Err(fault), _) => {
                        self.lost[1].get_or_insert(fault.and("its normal is computed"));
                    }
                }
            }
        }
        Ok(corner)
    }

    /// Index, counted from 0, of the value to which `part` refers. `part` is the text of one of the
    /// indices of the corner `word`. `kind` is the index in [`KEYWORDS`] of the keyword of the
    /// value.
    fn index(&self, kind: usize, part: &[u8], word: &str) -> Result<u32, StatementError> {
        let parsed = || str::from_utf8(part).ok()?.parse().ok();
        let Some(index) = natural_number(part).or_else(parsed) else {
            let message = match kind {
                0 => format!("`{}` is not a face corner", excerpt(word)),
                _ => format!("{} index in `{}` is not a number", NAMES[kind], excerpt(word)),
            };
            return Err(StatementError::new(word, message, "write v, v/vt, v//vn or v/vt/vn"));
        };
        let so_far = (self.before.elements[kind] + self.vertices.counts()[kind]) as i64;
        let total = self.total.elements[kind] as i64;
        if (1..=total).contains(&index) {
            return Ok((index - 1) as u32);
        }
        if (-so_far..0).contains(&index) {
            return Ok((so_far + index) as u32);
        }

        let (name, keyword, shown) = (NAMES[kind], KEYWORDS[kind], excerpt(word));
        if index == 0 {
            let message = format!("{name} index 0 in `{shown}`");
            return Err(StatementError::new(word, message, "OBJ indices start at 1"));
        }
        let help = match (index < 0, total) {
            (_, 0) => format!("the file has no `{keyword}` line"),
            (true, _) if so_far == 0 => format!("no `{keyword}` came before this line: use a positive index"),
            (true, _) => {
                format!("{so_far} `{keyword}` lines came before this line: use -{so_far} to -1, or a positive index")
            }
            (false, _) => format!("the file has {total} `{keyword}` lines: use 1 to {total}"),
        };
        let message = format!("{name} index {index} in `{shown}` is out of range");
        Err(StatementError::new(word, message, help))
    }

    /// Number of a smoothing group, 0 for none.
    fn smoothing_group(&mut self, name: &str, line: usize) -> u32 {
        match name {
            "" | "off" => 0,
            _ => name.parse().unwrap_or_else(|_| {
                self.remarks.add(Remark::BadSmoothing, line);
                0
            }),
        }
    }
}

/// Parses the first `N` numbers of `rest`. The first `needed` numbers are required, and missing
/// numbers become 0.
fn numbers<const N: usize>(statement: &str, rest: &str, needed: usize) -> Result<[f32; N], StatementError> {
    numbers_of(statement, &mut rest.split_ascii_whitespace(), needed)
}

/// Number of at most 18 decimal digits without a sign. Nearly all indices are such numbers, and
/// this is faster than `parse`.
fn natural_number(digits: &[u8]) -> Option<i64> {
    if !(1..=18).contains(&digits.len()) {
        return None;
    }
    let append = |number: i64, digit: &u8| digit.is_ascii_digit().then(|| 10 * number + i64::from(digit - b'0'));
    digits.iter().try_fold(0, append)
}

/// Parses the first `N` numbers of `words` as [`numbers`] does. The other words stay in the
/// iterator.
fn numbers_of<'w, const N: usize>(
    statement: &str,
    words: &mut impl Iterator<Item = &'w str>,
    needed: usize,
) -> Result<[f32; N], StatementError> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for (slot, word) in numbers.iter_mut().zip(words) {
        *slot = number(word)?;
        count += 1;
    }
    if count < needed {
        let message = format!("{needed} numbers are expected in `{}`", excerpt(statement));
        return Err(StatementError::new(
            split_keyword(statement).0,
            message,
            "complete the line",
        ));
    }
    Ok(numbers)
}

fn number(word: &str) -> Result<f32, StatementError> {
    if let Ok(number) = word.parse() {
        return Ok(number);
    }
    // Values that Microsoft's C library prints for infinity and NaN: 1.#QNAN0, -1.#IND00, -nan(ind)
    if word.contains(".#") || word.contains("nan(") {
        return Ok(f32::NAN);
    }
    let message = format!("`{}` is not a number", excerpt(word));
    Err(StatementError::new(word, message, "write a decimal number"))
}

/// Error that names the first number in `rest` that is infinite or NaN.
fn not_finite(rest: &str) -> StatementError {
    let is_finite = |word: &str| number(word).is_ok_and(f32::is_finite);
    let word = rest.split_ascii_whitespace().find(|word| !is_finite(word));
    let word = word.unwrap_or(rest);
    let message = format!("`{}` is not a finite number", excerpt(word));
    StatementError::new(word, message, "write a finite coordinate")
}
