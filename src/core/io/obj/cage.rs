//! Edges of an OBJ file before subdivision. The number of subdivision steps is computed from them.

use super::chunk::DataSelection;
use super::colors::Colors;
use super::counts::Chunks;
use super::moved_parts::move_parts;
use super::outline::Outline;
use super::{CHUNK_BYTES, chosen_origin, parse, read_text};
use crate::files::MemoryLimit;
use crate::files::memory::Allowance;
use crate::io::{FileError, LoadOptions};
use crate::math::{Bounds3, Vec3};
use std::fs;
use std::ops::Range;
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
    positions: Vec<Vec3>,
    /// Indices of the end points of each edge, in the order of the leaves of the tree.
    edges: Vec<[u32; 2]>,
    /// Tree of the edges, depth first. A search for the longest edge in a picture skips nodes that
    /// surely have no longer edge.
    nodes: Vec<CageNode>,
    /// Bounding box of all edges.
    pub bounds: Bounds3,
}

/// A node of the tree of edges. The nodes below it follow it, up to the node `next`.
#[derive(Clone, Debug)]
pub struct CageNode {
    /// Bounding box of the edges.
    pub bounds: Bounds3,
    /// Length of the longest edge.
    pub longest: f32,
    /// Range of the edges of a leaf. Empty for nodes with nodes below.
    edges: Range<u32>,
    /// Index of the first node that is not below this node.
    pub next: usize,
}

/// Maximum number of edges of a leaf.
const LEAF: usize = 32;

impl Cage {
    /// Reads the faces of a file as a render reads them. Hidden parts are left out, and movements
    /// of parts are applied. Displacement is not applied. `kept` is the memory of the cages before,
    /// in bytes. Returns `None` if the file cannot be read.
    ///
    /// # Errors
    ///
    /// If there is too little memory.
    pub fn read(path: &Path, options: &LoadOptions, kept: u64) -> Result<Option<Self>, FileError> {
        let allowance = Allowance {
            limit: MemoryLimit::of(options.max_memory),
            kept,
        };
        let length = fs::metadata(path).map_or(0, |data| data.len());
        allowance.check(path, length)?;
        let Ok(text) = read_text(path) else { return Ok(None) };
        let chunks = Chunks::count(&text, CHUNK_BYTES);
        let reading = chunks.bytes(length);
        allowance.check(path, reading)?;
        let selection = DataSelection {
            origin: chosen_origin(path, options),
            ..DataSelection::of_faces(&options.parts)
        };
        let parsed = parse::parse(path, &chunks, selection, &|_| ());
        drop(chunks);
        drop(text);
        let moved = parsed.and_then(|mut outline| {
            move_parts(path, &mut outline, &mut Colors::default(), &options.parts)?;
            Ok(outline)
        });
        let Ok(outline) = moved else { return Ok(None) };
        let sizes = || outline.sections.iter().flat_map(|section| section.sizes());
        allowance.check(
            path,
            reading.saturating_add(sizes().map(|&size| bytes_of_face(size)).sum()),
        )?;
        Ok(Some(Self::of_outline(outline)))
    }

    /// Edges of the faces of `outline`.
    fn of_outline(mut outline: Outline) -> Self {
        let mut cage = Self {
            positions: std::mem::take(&mut outline.vertices.positions),
            edges: Vec::new(),
            nodes: Vec::new(),
            bounds: Bounds3::EMPTY,
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
        cage.edges.shrink_to_fit();
        if !cage.edges.is_empty() {
            cage.add_nodes(0..cage.edges.len());
        }
        cage.bounds = cage.nodes.first().map_or(Bounds3::EMPTY, |root| root.bounds);
        cage
    }

    /// Adds the tree of the edges `range`. Edges are divided at the median of their middles, along
    /// the longest axis of their bounding box.
    fn add_nodes(&mut self, range: Range<usize>) {
        let positions = &self.positions;
        let ends = |edge: &[u32; 2]| edge.map(|i| positions[i as usize]);
        let edges = &mut self.edges[range.clone()];
        let mut node = CageNode {
            bounds: edges.iter().flat_map(ends).collect(),
            longest: edges
                .iter()
                .map(|edge| ends(edge)[0].distance(ends(edge)[1]))
                .fold(0.0, f32::max),
            edges: 0..0,
            next: 0,
        };
        let index = self.nodes.len();
        if edges.len() <= LEAF {
            node.edges = range.start as u32..range.end as u32;
            node.next = index + 1;
            self.nodes.push(node);
            return;
        }
        let axis = (node.bounds.max - node.bounds.min).max_position();
        let middle = edges.len() / 2;
        let place = |edge: &[u32; 2]| ends(edge)[0][axis] + ends(edge)[1][axis];
        edges.select_nth_unstable_by(middle, |a, b| place(a).total_cmp(&place(b)));
        self.nodes.push(node);
        self.add_nodes(range.start..range.start + middle);
        self.add_nodes(range.start + middle..range.end);
        self.nodes[index].next = self.nodes.len();
    }

    /// Nodes of the tree of edges, depth first.
    pub fn nodes(&self) -> &[CageNode] {
        &self.nodes
    }

    /// End points of each edge of the leaf `node`.
    pub fn ends_in(&self, node: &CageNode) -> impl ExactSizeIterator<Item = [Vec3; 2]> {
        let edges = &self.edges[node.edges.start as usize..node.edges.end as usize];
        edges.iter().map(|edge| edge.map(|i| self.positions[i as usize]))
    }

    /// Memory of the cage in bytes.
    pub fn bytes(&self) -> u64 {
        let bytes = size_of_val(&*self.positions) + size_of_val(&*self.edges) + size_of_val(&*self.nodes);
        bytes as u64
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
}

/// Maximum memory, in bytes, of the edges of a face of `size` corners: twice each edge, while the
/// list grows, the points of the additional edges, and the nodes of the tree.
fn bytes_of_face(size: u32) -> u64 {
    let size = u64::from(size);
    let (edges, points) = if size > 4 { (2 * size, size + 1) } else { (size, 0) };
    let of_edge = 2 * size_of::<[u32; 2]>() + 4 * size_of::<CageNode>() / LEAF;
    edges * of_edge as u64 + points * 2 * size_of::<Vec3>() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file with `n` × `n` quads, and a polygon of six corners.
    fn write_grid(path: &Path, n: usize) {
        let mut text = String::new();
        for i in 0..(n + 1) * (n + 1) {
            let (x, y) = (i % (n + 1), i / (n + 1));
            text += &format!("v {x} {} {y}\n", (7 * x + 3 * y) % 5);
        }
        for y in 0..n {
            for x in 0..n {
                let i = y * (n + 1) + x + 1;
                text += &format!("f {i} {} {} {}\n", i + 1, i + n + 2, i + n + 1);
            }
        }
        text += "v 0 9 0\nv 1 9 0\nv 2 9 1\nv 2 9 2\nv 1 9 2\nv 0 9 1\nf -1 -2 -3 -4 -5 -6\n";
        fs::write(path, text).unwrap();
    }

    fn read(path: &Path, max_memory: Option<u64>, kept: u64) -> Result<Option<Cage>, FileError> {
        let options = LoadOptions {
            max_memory,
            ..LoadOptions::default()
        };
        Cage::read(path, &options, kept)
    }

    /// The leaves have each edge once. The box and the longest edge of a node cover all nodes
    /// below.
    #[test]
    fn nodes_cover_their_edges() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        write_grid(&path, 20);
        let cage = read(&path, None, 0).unwrap().unwrap();
        assert_eq!(cage.edges.len(), 2 * 20 * 21 + 2 * 6);
        let mut edges = 0;
        for (index, node) in cage.nodes().iter().enumerate() {
            let below = &cage.nodes()[index..node.next];
            let ends: Vec<[Vec3; 2]> = below.iter().flat_map(|node| cage.ends_in(node)).collect();
            let longest = ends.iter().map(|[a, b]| a.distance(*b)).fold(0.0, f32::max);
            assert_eq!(node.longest, longest);
            let bounds: Bounds3 = ends.into_iter().flatten().collect();
            assert_eq!((bounds.min, bounds.max), (node.bounds.min, node.bounds.max));
            edges += cage.ends_in(node).len();
        }
        assert_eq!(edges, cage.edges.len());
        assert_eq!(cage.nodes()[0].next, cage.nodes().len());
    }

    #[test]
    fn cages_are_within_the_memory_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        write_grid(&path, 100);
        let cage = read(&path, Some(1 << 30), 0).unwrap().unwrap();
        assert!(cage.bytes() > 20_000 * 8, "{}", cage.bytes());
        let error = read(&path, Some(1 << 30), 1 << 30).unwrap_err();
        assert!(
            error.message.contains("together with the files before"),
            "{}",
            error.message
        );
        assert!(read(&path, Some(1 << 16), 0).is_err());
        assert!(read(&folder.path().join("b.obj"), None, 0).unwrap().is_none());
    }
}
