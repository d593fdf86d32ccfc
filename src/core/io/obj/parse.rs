//! Statements of OBJ files, read in parallel.
//!
//! Lines, `v`, `vt` and `vn` are counted first. Each chunk then knows its line and what indices
//! mean in it, and names a wrong line at once.

use super::colors::{color_of, read_mrgb};
use super::libraries::LibraryName;
use super::outline::{NONE, Outline, Section, VertexData};
use super::parts::{CurrentNames, PartState};
use super::polygon::MAX_CLIPPED;
use super::remarks::{Remark, Remarks, Skipped, ignored};
use crate::geometry::PartNames;
use crate::io::PartFilter;
use crate::io::statements::{MRGB, Statement, chunks, place_of, split_keyword, statements, whole_statements};
use crate::io::{FileError, MAX_WRONG, Position};
use crate::math::{DVec3, Vec2, Vec3, excerpt};
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;
use std::str;

/// A text cut into chunks whose statements have been counted: each knows its line and what indices mean in it.
pub(super) struct Chunks<'a> {
    texts: Vec<&'a str>,
    /// Counts of all that is before each chunk.
    before: Vec<Counts>,
    total: Counts,
    /// Names of parts that the first face of each chunk stands below.
    names: Vec<CurrentNames>,
}

impl<'a> Chunks<'a> {
    /// Cuts and counts a text in chunks of some `chunk_bytes`, in parallel.
    pub fn count(text: &'a str, chunk_bytes: usize) -> Self {
        let texts = chunks(text, chunk_bytes);
        let counts: Vec<(Counts, [Option<String>; 2])> = texts.par_iter().map(|chunk| Counts::of(chunk)).collect();
        let (mut total, mut last) = (Counts::default(), CurrentNames::default());
        let running = |(counts, names): &(Counts, [Option<String>; 2])| {
            let before = (total, last.clone());
            total = total.plus(*counts);
            last.follow(names);
            before
        };
        let (before, names) = counts.iter().map(running).unzip();
        Self {
            texts,
            before,
            total,
            names,
        }
    }

    /// About how many bytes reading takes at most, of which the text takes `length`.
    pub fn bytes(&self, length: u64) -> u64 {
        let [v, vt, vn] = self.total.elements.map(|n| n as u64);
        let (faces, corners) = (self.total.faces as u64, self.total.corners as u64);
        let (has_uvs, has_normals) = (u64::from(vt > 0), u64::from(vn > 0));
        let values = 16 * v + 8 * vt + 16 * vn;
        let outline = values + 4 * faces + 4 * corners * (1 + has_uvs + has_normals);
        // Chunks have their values until they are joined.
        let reading = length + outline + values;
        // Then the text is given back, faces become triangles, and corners vertices, by an index of those that there are.
        let (triangles, vertices) = (corners.saturating_sub(2 * faces), v.max(vt).max(vn));
        let index = if has_uvs + has_normals == 0 { 4 } else { 48 };
        let mesh = 12 * triangles + vertices * (16 + 8 * has_uvs + 16 * has_normals);
        reading.max(outline + mesh + index * vertices)
    }
}

/// Selection of an OBJ file that is read.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// The point of the file that becomes the origin.
    pub origin: DVec3,
    /// True if the line of each face is kept.
    pub keep_lines: bool,
    /// True if lines and points are read.
    pub keep_wires: bool,
    /// The parts whose faces are read.
    pub parts: &'a PartFilter,
}

/// Reads the statements of an OBJ file, in parallel; the result does not depend on the size of the chunks.
///
/// `advance` is called with the bytes that have been read. An error is a file that is too large as a
/// whole; statements that are wrong are collected.
pub(super) fn parse(
    path: &Path,
    chunks: &Chunks,
    wanted: Wanted,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Outline, FileError> {
    let mut outline = parse_all(path, chunks, wanted, advance)?;
    let Some(&first) = outline.wrong_positions.first() else {
        return Ok(outline);
    };
    // Only such files need the lines of their faces.
    if !wanted.keep_lines {
        let wanted = Wanted {
            keep_lines: true,
            ..wanted
        };
        outline = parse_all(path, chunks, wanted, &|_| ())?;
    }
    let wrong = std::mem::take(&mut outline.wrong_positions);
    let is_wrong = |i: u32| i as usize >= first && wrong.binary_search(&(i as usize)).is_ok();
    for section in outline.sections.iter_mut().chain(&mut outline.wires) {
        let removed = section.remove_faces(is_wrong);
        removed
            .into_iter()
            .for_each(|line| outline.remarks.add(Remark::LeftOutFace, line));
    }
    Ok(outline)
}

/// [`parse`], with the faces that use wrong positions.
fn parse_all(
    path: &Path,
    chunks: &Chunks,
    wanted: Wanted,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Outline, FileError> {
    let Chunks {
        texts,
        before,
        total,
        names,
    } = chunks;
    let parsed: Vec<Chunk> = texts
        .par_iter()
        .zip(before)
        .zip(names)
        .map(|((text, before), names)| {
            let states = [(); 2].map(|()| PartState::new(wanted.parts, text, names));
            let chunk = Chunk::parse(path, text, [before, total], wanted, states);
            advance(text.len() as u64);
            chunk
        })
        .collect();

    let mut outline = Outline {
        vertices: VertexData {
            positions: Vec::with_capacity(total.elements[0]),
            uvs: Vec::with_capacity(total.elements[1]),
            normals: Vec::with_capacity(total.elements[2]),
            ..VertexData::default()
        },
        sections: Vec::with_capacity(parsed.len()),
        wires: Vec::new(),
        libraries: Vec::new(),
        remarks: Remarks::default(),
        wrong: Vec::new(),
        wrong_count: 0,
        wrong_positions: Vec::new(),
        parts: PartNames::default(),
    };
    outline
        .parts
        .reserve(parsed.iter().map(|chunk| chunk.parts.count()).sum());
    for mut chunk in parsed {
        chunk.parts.number(&mut outline.parts, &mut chunk.section);
        let first = outline.vertices.positions.len();
        let wrong_positions = chunk.wrong_positions.iter().map(|i| first + i);
        outline.wrong_positions.extend(wrong_positions);
        outline.vertices.append(&mut chunk.vertices);
        outline.sections.push(chunk.section);
        if wanted.keep_wires {
            chunk.wire_parts.number(&mut outline.parts, &mut chunk.wires);
            outline.wires.push(chunk.wires);
        }
        outline.libraries.append(&mut chunk.libraries);
        outline.remarks.append(&chunk.remarks);
        let free = MAX_WRONG - outline.wrong.len();
        outline.wrong.extend(chunk.wrong.into_iter().take(free));
        outline.wrong_count += chunk.wrong_count;
    }
    outline.parts.shrink_to_fit();
    // Indices have 32 bits. Normals are counted on for smoothing groups and for flat triangles, by one a corner at
    // most.
    let corners: usize = outline.all_sections().map(Section::corner_count).sum();
    if 2 * corners + total.elements.iter().sum::<usize>() >= NONE as usize {
        let message = "the file has too many vertices or faces for 32-bit indices";
        return Err(FileError::new(path, message).help("cut it into several files"));
    }
    Ok(outline)
}

/// Keywords of what corners name, in the order of a corner's parts.
const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];
const NAMES: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// Numbers of lines, and of `v`, `vt` and `vn` statements.
#[derive(Clone, Copy, Default)]
struct Counts {
    lines: usize,
    elements: [usize; 3],
    faces: usize,
    corners: usize,
}

impl Counts {
    /// Counts the statements of a text, and finds its last `o` and its last `g`.
    fn of(text: &str) -> (Self, [Option<String>; 2]) {
        let mut names = [None, None];
        let mut counts = Self {
            lines: text.bytes().filter(|&b| b == b'\n').count(),
            ..Self::default()
        };
        for (_, statement) in statements(text) {
            let (keyword, rest) = split_keyword(&statement);
            if let Some(kind) = KEYWORDS.iter().position(|&k| k == keyword) {
                counts.elements[kind] += 1;
            } else if keyword == "f" {
                counts.faces += 1;
                counts.corners += rest.split_ascii_whitespace().count();
            } else if let Some(kind) = ["o", "g"].into_iter().position(|k| k == keyword) {
                names[kind] = Some(statement);
            }
        }
        (counts, names.map(|name| name.map(Cow::into_owned)))
    }

    fn plus(self, other: Self) -> Self {
        Self {
            lines: self.lines + other.lines,
            elements: [0, 1, 2].map(|kind| self.elements[kind] + other.elements[kind]),
            faces: self.faces + other.faces,
            corners: self.corners + other.corners,
        }
    }
}

/// Error in a statement: the message, the wrong word, and the remedy.
struct Fault {
    word: String,
    message: String,
    help: String,
}

impl Fault {
    fn new(word: &str, message: impl Into<String>, help: impl Into<String>) -> Self {
        let (word, message, help) = (word.into(), message.into(), help.into());
        Self { word, message, help }
    }

    /// The fault, with its effect.
    fn and(mut self, effect: &str) -> Self {
        self.message = format!("{}; {effect}", self.message);
        self
    }
}

/// What a chunk of the file says.
struct Chunk<'a> {
    before: &'a Counts,
    total: &'a Counts,
    vertices: VertexData,
    section: Section,
    libraries: Vec<LibraryName>,
    remarks: Remarks,
    /// As in [`Outline`].
    wrong: Vec<FileError>,
    wrong_count: usize,
    /// Indices of wrong positions, in order.
    wrong_positions: Vec<usize>,
    /// The first wrong `vt` index and the first wrong `vn` index of the current face.
    lost: [Option<Fault>; 2],
    /// The point of the file that becomes the origin.
    origin: DVec3,
    keep_lines: bool,
    parts: PartState<'a>,
    /// Lines and points, as faces of their vertices.
    wires: Section,
    /// True if these are read.
    keep_wires: bool,
    /// Parts of these.
    wire_parts: PartState<'a>,
}

impl<'a> Chunk<'a> {
    /// Reads a chunk of a file that has `total` counts, `before` of them before the chunk.
    fn parse(
        path: &Path,
        text: &str,
        [before, total]: [&'a Counts; 2],
        wanted: Wanted,
        [parts, wire_parts]: [PartState<'a>; 2],
    ) -> Self {
        let mut chunk = Self {
            before,
            total,
            vertices: VertexData::default(),
            section: Section::default(),
            libraries: Vec::new(),
            remarks: Remarks::default(),
            wrong: Vec::new(),
            wrong_count: 0,
            wrong_positions: Vec::new(),
            lost: [None, None],
            origin: wanted.origin,
            keep_lines: wanted.keep_lines,
            parts,
            wires: Section::default(),
            keep_wires: wanted.keep_wires,
            wire_parts,
        };
        chunk.wires.state_change();
        // The first state_change changes nothing: faces may belong to what came before the chunk.
        chunk.section.state_change();
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

    /// Position of a vertex, of whose `words` those behind it are left. Far from the file's origin 32
    /// bits round a part of it away.
    fn position<'w>(
        &self,
        statement: &str,
        rest: &str,
        words: &mut impl Iterator<Item = &'w str>,
    ) -> Result<Vec3, Fault> {
        let near: [f32; 3] = numbers_of(statement, words, 3)?;
        if self.origin == DVec3::ZERO {
            return Ok(near.into());
        }
        let exact = |word: &str| word.parse().unwrap_or(f64::NAN);
        let mut words = rest.split_ascii_whitespace().map(exact);
        let p = DVec3::from([0; 3].map(|_| words.next().unwrap_or(f64::NAN)));
        Ok((p - self.origin).as_vec3a())
    }

    fn read(&mut self, whole: &Statement, line: usize) -> Result<(), Fault> {
        let statement = &*whole.text;
        let (keyword, rest) = split_keyword(statement);
        match keyword {
            // A wrong value is 0, so that the indices of others keep their meaning.
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
                    fault.and("it counts as 0 0")
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
                    fault.and("it counts as none")
                })?;
                // In f64, where the square of no f32 is lost
                let normal = given.as_dvec3().normalize_or_zero().as_vec3a();
                if normal == Vec3::ZERO {
                    self.remarks.add(Remark::BadNormal, line);
                }
                self.vertices.normals.push(normal);
            }
            "f" | "fo" if self.parts.is_shown(self.section.face_count()) => self.read_face(rest, line)?,
            "f" | "fo" => {}
            "o" => {
                self.parts.begin_object(whole.start);
                self.wire_parts.begin_object(whole.start);
            }
            "g" => {
                self.parts.begin_groups(whole.start);
                self.wire_parts.begin_groups(whole.start);
            }
            "usemtl" => {
                let whole_name = whole.whole_name();
                if !rest.is_empty() || whole_name.is_some() {
                    let wires = self.keep_wires.then_some(&mut self.wires);
                    for section in std::iter::once(&mut self.section).chain(wires) {
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
                read.unwrap_or_else(|()| self.remarks.add(Remark::BadColor, line));
            }
            "" => {}
            "p" | "l" if self.keep_wires => {
                if self.wire_parts.is_shown(self.wires.face_count()) {
                    self.read_wire(keyword == "l", rest, line)?;
                }
            }
            "p" => self
                .remarks
                .skip(Skipped::Point, rest.split_ascii_whitespace().count(), line),
            "l" => self.remarks.skip(Skipped::Line, 1, line),
            "curv" | "curv2" | "cdc" => self.remarks.skip(Skipped::Curve, 1, line),
            "surf" | "bzp" | "bsp" | "cdp" => self.remarks.skip(Skipped::Surface, 1, line),
            // Blocks that are filled up with zeros
            _ if keyword.bytes().all(|byte| byte == 0) => {}
            _ => match ignored(keyword) {
                Some(index) => self.remarks.ignore(index, line),
                None => self.remarks.add_unknown(&excerpt(keyword), line),
            },
        }
        Ok(())
    }

    /// Reads the vertices of a line, or of points.
    fn read_wire(&mut self, is_line: bool, words: &str, line: usize) -> Result<(), Fault> {
        let start = self.wires.corner_count();
        for word in words.split_ascii_whitespace() {
            let corner = self.corner(word);
            // Only positions count
            self.lost = [None, None];
            match corner {
                Ok([v, ..]) => self.wires.push_corner([v, NONE, NONE]),
                Err(fault) => {
                    self.wires.truncate(start);
                    return Err(fault.and("the element is left out"));
                }
            }
        }
        let count = self.wires.corner_count() - start;
        if is_line && count < 2 {
            self.wires.truncate(start);
            let message = format!("a line of {count} vertices");
            return Err(Fault::new(
                "l",
                message,
                "name two vertices or more, or write a point (`p`)",
            ));
        }
        let line = self.keep_lines.then(|| u32::try_from(line).unwrap_or(u32::MAX));
        if is_line {
            self.wires.push_face(u32::try_from(count).unwrap_or(u32::MAX), line);
        } else {
            (0..count).for_each(|_| self.wires.push_face(1, line));
        }
        Ok(())
    }

    fn read_face(&mut self, corners: &str, line: usize) -> Result<(), Fault> {
        let start = self.section.corner_count();
        if corners.split_ascii_whitespace().nth(2).is_none() {
            self.remarks.add(Remark::ShortFace, line);
            return Ok(());
        }
        for word in corners.split_ascii_whitespace() {
            match self.corner(word) {
                Ok(corner) => self.section.push_corner(corner),
                Err(fault) => {
                    self.section.truncate(start);
                    self.lost = [None, None];
                    return Err(fault.and("the face is left out"));
                }
            }
        }
        let size = self.section.corner_count() - start;
        if size > MAX_CLIPPED {
            self.remarks.add(Remark::LongFace, line);
        }
        let Ok(size) = u32::try_from(size) else {
            self.section.truncate(start);
            let message = format!("a face of {size} corners");
            return Err(Fault::new("f", message, "cut the face into smaller ones"));
        };
        let line = self.keep_lines.then(|| u32::try_from(line).unwrap_or(u32::MAX));
        self.section.push_face(size, line);
        Ok(())
    }

    /// Indices, counted from 0, of a corner like `v`, `v/vt`, `v//vn` or `v/vt/vn`. A wrong `vt` or
    /// `vn` counts as none, with its fault in `lost`.
    fn corner(&mut self, word: &str) -> Result<[u32; 3], Fault> {
        let mut corner = [NONE; 3];
        // As bytes: words are too short for what searches a string.
        for (kind, part) in word.as_bytes().split(|&b| b == b'/').enumerate() {
            let Some(slot) = corner.get_mut(kind) else {
                let message = format!("`{}` has too many parts", excerpt(word));
                return Err(Fault::new(word, message, "write v, v/vt, v//vn or v/vt/vn"));
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

    /// The index, counted from 0, of a part of the corner `word`.
    fn index(&self, kind: usize, part: &[u8], word: &str) -> Result<u32, Fault> {
        let Some(index) = str::from_utf8(part).ok().and_then(|part| part.parse::<i64>().ok()) else {
            let message = match kind {
                0 => format!("`{}` is not a face corner", excerpt(word)),
                _ => format!("{} index in `{}` is not a number", NAMES[kind], excerpt(word)),
            };
            return Err(Fault::new(word, message, "write v, v/vt, v//vn or v/vt/vn"));
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
            return Err(Fault::new(word, message, "OBJ indices start at 1"));
        }
        let help = match (index < 0, total) {
            (_, 0) => format!("the file has no `{keyword}` line"),
            (true, _) if so_far == 0 => format!("no `{keyword}` came before this line: use a positive index"),
            (true, _) => format!("{so_far} came before this line: use -{so_far} to -1, or a positive index"),
            (false, _) => format!("the file has {total} `{keyword}` lines: use 1 to {total}"),
        };
        let message = format!("{name} index {index} in `{shown}` is out of range");
        Err(Fault::new(word, message, help))
    }

    /// The number of a smoothing group, 0 for none.
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

/// The first `N` numbers of `rest`, of which those after the first `needed` are 0 where they are not given.
fn numbers<const N: usize>(statement: &str, rest: &str, needed: usize) -> Result<[f32; N], Fault> {
    numbers_of(statement, &mut rest.split_ascii_whitespace(), needed)
}

/// The first `N` numbers of `words`, which keep the rest, as [`numbers`] reads them.
fn numbers_of<'w, const N: usize>(
    statement: &str,
    words: &mut impl Iterator<Item = &'w str>,
    needed: usize,
) -> Result<[f32; N], Fault> {
    let mut numbers = [0.0; N];
    let mut count = 0;
    for (slot, word) in numbers.iter_mut().zip(words) {
        *slot = number(word)?;
        count += 1;
    }
    if count < needed {
        let message = format!("{needed} numbers expected: `{}`", excerpt(statement));
        return Err(Fault::new(split_keyword(statement).0, message, "complete the line"));
    }
    Ok(numbers)
}

fn number(word: &str) -> Result<f32, Fault> {
    if let Ok(number) = word.parse() {
        return Ok(number);
    }
    // How Microsoft's C library writes values that are not numbers: 1.#QNAN0, -1.#IND00, -nan(ind)
    if word.contains(".#") || word.contains("nan(") {
        return Ok(f32::NAN);
    }
    let message = format!("`{}` is not a number", excerpt(word));
    Err(Fault::new(word, message, "write a decimal number"))
}

/// That one of the numbers in `rest` is infinite or none.
fn not_finite(rest: &str) -> Fault {
    let is_finite = |word: &str| number(word).is_ok_and(f32::is_finite);
    let word = rest.split_ascii_whitespace().find(|word| !is_finite(word));
    let word = word.unwrap_or(rest);
    let message = format!("`{}` is not a finite number", excerpt(word));
    Fault::new(word, message, "write a finite coordinate")
}
