//! OBJ files as outlines, read in parallel by chunks.
//!
//! Before the chunks are read, their lines and their `v`, `vt` and `vn` statements are counted. So
//! the first line number of each chunk and the meaning of relative indices are known, and an error
//! has its line number at once.

use super::chunk::{Chunk, DataSelection};
use super::counts::Chunks;
use super::outline::{NONE, Outline, Section, VertexData};
use super::remarks::{Remark, Remarks};
use crate::geometry::PartNames;
use crate::io::{FileError, MAX_WRONG};
use rayon::prelude::*;
use std::path::Path;

/// Reads the statements of an OBJ file in parallel. The result does not depend on the size of the
/// chunks.
///
/// `advance` is called for each chunk that has been read, with the number of its bytes. Returns an
/// error only if the file as a whole is too large. Wrong statements are collected in the outline.
pub(super) fn parse(
    path: &Path,
    chunks: &Chunks,
    selection: DataSelection,
    advance: &(dyn Fn(u64) + Sync),
) -> Result<Outline, FileError> {
    let mut outline = parse_all(path, chunks, selection, advance)?;
    let Some(&first) = outline.wrong_positions.first() else {
        return Ok(outline);
    };
    // Line numbers of faces are needed only for files with wrong positions, so read these files
    // again with line numbers.
    if !selection.keep_lines {
        let selection = DataSelection {
            keep_lines: true,
            ..selection
        };
        outline = parse_all(path, chunks, selection, &|_| ())?;
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

/// [`parse`] without the last step, which removes faces with wrong positions.
fn parse_all(
    path: &Path,
    chunks: &Chunks,
    selection: DataSelection,
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
            let chunk = Chunk::parse(path, text, [before, total], names, selection);
            advance(text.len() as u64);
            chunk
        })
        .collect();

    let part_lists = parsed.iter().flat_map(|chunk| {
        let of_wires = chunk.wires.iter().map(|wires| wires.parts.parts());
        std::iter::once(chunk.parts.parts()).chain(of_wires)
    });
    let (parts, numbers) = PartNames::join(part_lists);
    let mut numbers = numbers.as_slice();
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
        parts,
    };
    for mut chunk in parsed {
        chunk.parts.number(&mut numbers, &mut chunk.section);
        let first = outline.vertices.positions.len();
        let wrong_positions = chunk.wrong_positions.iter().map(|i| first + i);
        outline.wrong_positions.extend(wrong_positions);
        outline.vertices.append(&mut chunk.vertices);
        outline.sections.push(chunk.section);
        if let Some(mut wires) = chunk.wires {
            wires.parts.number(&mut numbers, &mut wires.section);
            outline.wires.push(wires.section);
        }
        outline.libraries.append(&mut chunk.libraries);
        outline.remarks.append(&chunk.remarks);
        let free = MAX_WRONG - outline.wrong.len();
        outline.wrong.extend(chunk.wrong.into_iter().take(free));
        outline.wrong_count += chunk.wrong_count;
    }
    // Indices have 32 bits. Smoothing groups and flat triangles add normals, at most one per
    // corner.
    let corners: usize = outline.all_sections().map(Section::corner_count).sum();
    if 2 * corners + total.elements.iter().sum::<usize>() >= NONE as usize {
        let message = "the file has too many vertices or faces for 32-bit indices";
        return Err(FileError::new(path, message).help("cut the file into several files"));
    }
    Ok(outline)
}
