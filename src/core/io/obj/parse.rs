//! OBJ files as outlines, read in parallel by chunks.
//!
//! Lines, `v`, `vt` and `vn` are counted first. Each chunk then knows its line and what indices
//! mean in it, and names a wrong line at once.

use super::chunk::Chunk;
use super::outline::{NONE, Outline, Section, VertexData};
use super::parts::CurrentNames;
use super::remarks::{Remark, Remarks};
use crate::geometry::PartNames;
use crate::io::PartFilter;
use crate::io::statements::{chunks, split_keyword, statements};
use crate::io::{FileError, MAX_WRONG};
use crate::math::DVec3;
use rayon::prelude::*;
use std::borrow::Cow;
use std::path::Path;

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
            let chunk = Chunk::parse(path, text, [before, total], names, wanted);
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
        if let Some(mut wires) = chunk.wires {
            wires.parts.number(&mut outline.parts, &mut wires.section);
            outline.wires.push(wires.section);
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
pub(super) const KEYWORDS: [&str; 3] = ["v", "vt", "vn"];

/// Numbers of lines, and of `v`, `vt` and `vn` statements.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    pub lines: usize,
    pub elements: [usize; 3],
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
