//! Edges of an OBJ file before subdivision. The number of subdivision steps is computed from them.

use super::chunk::DataSelection;
use super::colors::Colors;
use super::counts::Chunks;
use super::moved_parts::move_parts;
use super::{CHUNK_BYTES, chosen_origin, parse, read_text};
use crate::files::MemoryLimit;
use crate::files::memory::Allowance;
use crate::io::{FileError, LoadOptions};
use crate::math::{Bounds3, Vec3};
use std::fs;
use std::path::Path;

/// Edges of the faces of an OBJ file before subdivision.
///
/// The first step of Catmull and Clark also makes edges from the middle of a face to the middles of
/// its sides. In faces of more than four corners, these edges can be longer than half a side. For
/// each such edge, the cage has an additional edge of twice the length. So the rule that each step
/// halves all edges of the cage is also valid for these faces.
#[derive(Clone, Debug)]
pub struct Cage {
    /// End points, in units of the file.
    pub positions: Vec<Vec3>,
    /// Indices of the end points of each edge.
    pub edges: Vec<[u32; 2]>,
    /// Bounding box of all edges.
    pub bounds: Bounds3,
    /// Length of the longest edge.
    pub longest: f32,
}

impl Cage {
    /// Reads the faces of a file as a render reads them. Hidden parts are left out, and movements
    /// of parts are applied. Displacement is not applied.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or if there is too little memory.
    pub fn read(path: &Path, options: &LoadOptions) -> Result<Self, FileError> {
        let allowance = Allowance {
            limit: MemoryLimit::of(options.max_memory),
            kept: 0,
        };
        let length = fs::metadata(path).map_or(0, |data| data.len());
        allowance.check(path, length)?;
        let text = read_text(path)?;
        let chunks = Chunks::count(&text, CHUNK_BYTES);
        allowance.check(path, chunks.bytes(length))?;
        let selection = DataSelection {
            origin: chosen_origin(path, options),
            ..DataSelection::of_faces(&options.parts)
        };
        let mut outline = parse::parse(path, &chunks, selection, &|_| ())?;
        drop(chunks);
        drop(text);
        move_parts(&mut outline, &mut Colors::default(), &options.parts);
        let mut cage = Self {
            positions: std::mem::take(&mut outline.vertices.positions),
            edges: Vec::new(),
            bounds: Bounds3::EMPTY,
            longest: 0.0,
        };
        for section in &outline.sections {
            let mut start = 0;
            for &size in section.sizes() {
                let size = size as usize;
                let corner = |i: usize| section.corner(start + i % size)[0];
                let sides = (0..size).map(|i| [corner(i), corner(i + 1)]);
                cage.edges.extend(sides.clone().map(|[a, b]| [a.min(b), a.max(b)]));
                if size > 4 {
                    cage.add_spokes(sides);
                }
                start += size;
            }
        }
        cage.edges.sort_unstable();
        cage.edges.dedup();
        for &edge in &cage.edges {
            let [a, b] = edge.map(|i| cage.positions[i as usize]);
            cage.bounds.extend(a);
            cage.bounds.extend(b);
            cage.longest = cage.longest.max(a.distance(b));
        }
        Ok(cage)
    }

    /// Adds an edge for each side of a face. The edge starts in the middle of the face. The middle
    /// of the side is the middle of the edge.
    fn add_spokes(&mut self, sides: impl Iterator<Item = [u32; 2]> + Clone) {
        let at = |cage: &Self, i: u32| cage.positions[i as usize];
        let (count, sum) = sides
            .clone()
            .fold((0, Vec3::ZERO), |(count, sum), [a, _]| (count + 1, sum + at(self, a)));
        let middle = sum / count as f32;
        let center = self.positions.len() as u32;
        self.positions.push(middle);
        for [a, b] in sides {
            let end = self.positions.len() as u32;
            let through = at(self, a) + at(self, b) - middle;
            self.positions.push(through);
            self.edges.push([center, end]);
        }
    }

    /// End points of each edge.
    pub fn ends(&self) -> impl Iterator<Item = [Vec3; 2]> {
        self.edges.iter().map(|edge| edge.map(|i| self.positions[i as usize]))
    }
}
