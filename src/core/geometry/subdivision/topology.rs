//! Faces, edges and corners of a mesh, and their division in a subdivision step.
//!
//! A corner is an index into the list of the faces' vertices. A corner also stands for the edge
//! from its vertex to the vertex of the next corner of the face. When a step divides an element,
//! the indices of the new elements follow from the index of the divided element. Edges are
//! therefore searched only once, in the control mesh.

use rayon::prelude::*;

/// Index of a missing element.
pub(super) const NONE: u32 = u32::MAX;

/// Subdivision scheme of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// Faces of any number of corners become quads (Catmull and Clark 1978).
    CatmullClark,
    /// Triangles become triangles (Loop 1987).
    Loop,
}

impl Scheme {
    /// Scheme of a mesh whose faces have these numbers of corners: Loop if all faces are triangles.
    pub fn of(sizes: &[u32]) -> Self {
        if sizes.iter().all(|&size| size == 3) {
            Self::Loop
        } else {
            Self::CatmullClark
        }
    }
}

/// Range of corners of each face.
#[derive(Clone, Debug)]
pub(super) enum Faces {
    /// `starts` has the first corner of each face, then the number of all corners. `of_corners` has
    /// the face of each corner.
    Any { starts: Vec<u32>, of_corners: Vec<u32> },
    /// Number of corners of every face.
    Uniform(u32),
}

/// Faces of a mesh by the indices of their vertices and edges.
#[derive(Clone, Debug)]
pub(super) struct Topology {
    pub faces: Faces,
    /// Vertex of each corner.
    pub vertices: Vec<u32>,
    /// Edge from each corner to the next corner of its face.
    pub edges: Vec<u32>,
    /// For each edge, the corners at which the edge starts in the first and in the opposite
    /// direction. The second corner is [`NONE`] at a boundary, and for an edge of
    /// [`IrregularEdges`].
    pub edge_corners: Vec<[u32; 2]>,
    /// Sharpness of each edge: 0 is smooth. An edge with an infinite sharpness stays sharp in all
    /// steps.
    pub sharpness: Vec<f32>,
    pub vertex_count: u32,
    /// True for vertices of the control mesh that keep their position; empty if no vertex does.
    pub pinned: Vec<bool>,
}

/// Numbers of edges at which the surface is not smooth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IrregularEdges {
    /// Edges of three or more faces.
    pub non_manifold: u64,
    /// Edges between two faces of opposite orientation.
    pub flipped: u64,
}

impl Topology {
    /// Topology of a control mesh, and the numbers of irregular edges. `sizes` has the number of
    /// corners of each face, and `vertices` the vertex of each corner.
    pub fn new(sizes: &[u32], vertices: Vec<u32>, vertex_count: u32) -> (Self, IrregularEdges) {
        let faces = match sizes {
            [first, others @ ..] if others.iter().all(|size| size == first) => Faces::Uniform(*first),
            _ => {
                let mut starts = Vec::with_capacity(sizes.len() + 1);
                let mut of_corners = Vec::with_capacity(vertices.len());
                let mut start = 0;
                for (face, &size) in (0..).zip(sizes) {
                    starts.push(start);
                    of_corners.extend(std::iter::repeat_n(face, size as usize));
                    start += size;
                }
                starts.push(start);
                Faces::Any { starts, of_corners }
            }
        };
        let corners = vertices.len() as u32;
        let mut topology = Self {
            faces,
            vertices,
            edges: vec![NONE; corners as usize],
            edge_corners: Vec::new(),
            sharpness: Vec::new(),
            vertex_count,
            pinned: Vec::new(),
        };
        let irregular = topology.find_edges();
        (topology, irregular)
    }

    /// Finds the edges. Corners have the same edge if their edges join the same two vertices.
    fn find_edges(&mut self) -> IrregularEdges {
        let corners = self.vertices.len() as u32;
        let key = |corner: u32| {
            let [a, b] = self.ends_of(corner);
            let ends = u64::from(a.min(b)) << 32 | u64::from(a.max(b));
            (ends, corner)
        };
        let mut keys: Vec<(u64, u32)> = (0..corners).into_par_iter().map(key).collect();
        keys.par_sort_unstable();
        let mut irregular = IrregularEdges::default();
        for group in keys.chunk_by(|(a, _), (b, _)| a == b) {
            let edge = self.edge_corners.len() as u32;
            let (ends, first) = group[0];
            let is_loop = ends >> 32 == ends & u64::from(u32::MAX);
            let second = match *group {
                [_, (_, second)] if !is_loop => {
                    let is_opposite = self.vertices[first as usize] != self.vertices[second as usize];
                    irregular.flipped += u64::from(!is_opposite);
                    Some(second).filter(|_| is_opposite)
                }
                _ => None,
            };
            irregular.non_manifold += u64::from(group.len() > 2);
            for &(_, corner) in group {
                self.edges[corner as usize] = edge;
            }
            self.edge_corners.push([first, second.unwrap_or(NONE)]);
            self.sharpness.push(if second.is_some() { 0.0 } else { f32::INFINITY });
        }
        irregular
    }

    /// Number of faces.
    pub fn face_count(&self) -> u32 {
        match &self.faces {
            Faces::Any { starts, .. } => starts.len() as u32 - 1,
            Faces::Uniform(size) => self.vertices.len() as u32 / size,
        }
    }

    /// Face of a corner.
    pub fn face(&self, corner: u32) -> u32 {
        match &self.faces {
            Faces::Any { of_corners, .. } => of_corners[corner as usize],
            Faces::Uniform(size) => corner / size,
        }
    }

    /// Corners of a face.
    pub fn corners(&self, face: u32) -> std::ops::Range<u32> {
        match &self.faces {
            Faces::Any { starts, .. } => starts[face as usize]..starts[face as usize + 1],
            Faces::Uniform(size) => face * size..(face + 1) * size,
        }
    }

    /// Next corner of the same face.
    pub fn next(&self, corner: u32) -> u32 {
        let corners = self.corners(self.face(corner));
        if corner + 1 == corners.end {
            corners.start
        } else {
            corner + 1
        }
    }

    /// Previous corner of the same face.
    pub fn previous(&self, corner: u32) -> u32 {
        let corners = self.corners(self.face(corner));
        if corner == corners.start {
            corners.end - 1
        } else {
            corner - 1
        }
    }

    /// Vertex of a corner.
    pub fn vertex(&self, corner: u32) -> u32 {
        self.vertices[corner as usize]
    }

    /// Start and end vertex of the edge of a corner.
    fn ends_of(&self, corner: u32) -> [u32; 2] {
        [corner, self.next(corner)].map(|corner| self.vertex(corner))
    }

    /// Vertices at both ends of an edge.
    pub fn ends(&self, edge: u32) -> [u32; 2] {
        self.ends_of(self.edge_corners[edge as usize][0])
    }

    /// Next corner at the same vertex in clockwise order, across the edge of `corner`; `None` if
    /// the edge is sharp.
    pub fn clockwise(&self, corner: u32) -> Option<u32> {
        self.twin(corner).map(|twin| self.next(twin))
    }

    /// Next corner at the same vertex in counter-clockwise order, across the edge that ends in
    /// `corner`; `None` if the edge is sharp.
    pub fn counter_clockwise(&self, corner: u32) -> Option<u32> {
        self.twin(self.previous(corner))
    }

    /// Corner at which the edge of `corner` starts in the opposite direction; `None` if the edge is
    /// sharp or has no second corner.
    fn twin(&self, corner: u32) -> Option<u32> {
        let edge = self.edges[corner as usize] as usize;
        let [first, second] = self.edge_corners[edge];
        let twin = if first == corner { second } else { first };
        Some(twin).filter(|&twin| twin != NONE && self.sharpness[edge] == 0.0)
    }

    /// Index of the half of `edge` that touches the vertex of `corner`; each edge has two halves.
    fn half_at(&self, edge: u32, corner: u32) -> u32 {
        let [first, _] = self.ends(edge);
        2 * edge + u32::from(first != self.vertex(corner))
    }

    /// Mesh after a step. The vertices of this mesh come first, followed by a vertex for each edge.
    /// With [`Scheme::CatmullClark`], a vertex for each face comes last.
    pub fn refined(&self, scheme: Scheme) -> Self {
        let corners = self.vertices.len() as u32;
        let edge_count = self.edge_corners.len() as u32;
        let edge_vertex = |edge: u32| self.vertex_count + edge;
        let inner = |corner: u32| 2 * edge_count + corner;
        let edge_of = |corner: u32| self.edges[corner as usize];
        let size = match scheme {
            Scheme::CatmullClark => 4,
            Scheme::Loop => 3,
        };
        // First corner of the new face at the corner `corner`
        let child = |corner: u32| match scheme {
            Scheme::CatmullClark => 4 * corner,
            Scheme::Loop => 3 * (corner / 3 * 4 + corner % 3),
        };
        let total = 4 * corners as usize;
        let (mut vertices, mut edges) = (vec![0; total], vec![0; total]);
        match scheme {
            Scheme::CatmullClark => {
                let of_faces = self.vertex_count + edge_count;
                vertices
                    .par_chunks_exact_mut(4)
                    .zip(edges.par_chunks_exact_mut(4))
                    .zip(0..corners)
                    .for_each(|((vertices, edges), corner)| {
                        let before = self.previous(corner);
                        let (to, from) = (edge_of(corner), edge_of(before));
                        vertices.copy_from_slice(&[
                            self.vertex(corner),
                            edge_vertex(to),
                            of_faces + self.face(corner),
                            edge_vertex(from),
                        ]);
                        edges.copy_from_slice(&[
                            self.half_at(to, corner),
                            inner(corner),
                            inner(before),
                            self.half_at(from, corner),
                        ]);
                    });
            }
            Scheme::Loop => {
                vertices
                    .par_chunks_exact_mut(12)
                    .zip(edges.par_chunks_exact_mut(12))
                    .zip(0..corners / 3)
                    .for_each(|((vertices, edges), face)| {
                        let first = 3 * face;
                        for i in 0..3 {
                            let (corner, before) = (first + i, first + (i + 2) % 3);
                            let (to, from) = (edge_of(corner), edge_of(before));
                            let at = 3 * i as usize;
                            vertices[at..at + 3].copy_from_slice(&[
                                self.vertex(corner),
                                edge_vertex(to),
                                edge_vertex(from),
                            ]);
                            edges[at..at + 3].copy_from_slice(&[
                                self.half_at(to, corner),
                                inner(corner),
                                self.half_at(from, corner),
                            ]);
                            vertices[9 + i as usize] = edge_vertex(to);
                            edges[9 + i as usize] = inner(first + (i + 1) % 3);
                        }
                    });
            }
        }
        let mut edge_corners = vec![[NONE; 2]; 2 * edge_count as usize + corners as usize];
        let mut sharpness = vec![0.0; edge_corners.len()];
        let (halves, inner_edges) = edge_corners.split_at_mut(2 * edge_count as usize);
        halves
            .par_chunks_exact_mut(2)
            .zip(sharpness.par_chunks_exact_mut(2))
            .zip(0..edge_count)
            .for_each(|((halves, sharpness), edge)| {
                let [first, second] = self.edge_corners[edge as usize];
                let last = |corner: u32| child(self.next(corner)) + size - 1;
                halves[0][0] = child(first);
                halves[1][0] = last(first);
                if second != NONE {
                    halves[0][1] = last(second);
                    halves[1][1] = child(second);
                }
                sharpness.fill((self.sharpness[edge as usize] - 1.0).max(0.0));
            });
        inner_edges.par_iter_mut().zip(0..corners).for_each(|(inner, corner)| {
            let other = match scheme {
                Scheme::CatmullClark => child(self.next(corner)) + 2,
                Scheme::Loop => 3 * (corner / 3 * 4 + 3) + (corner % 3 + 2) % 3,
            };
            *inner = [child(corner) + 1, other];
        });
        let face_vertices = match scheme {
            Scheme::CatmullClark => self.face_count(),
            Scheme::Loop => 0,
        };
        Self {
            faces: Faces::Uniform(size),
            vertices,
            edges,
            edge_corners,
            sharpness,
            vertex_count: self.vertex_count + edge_count + face_vertices,
            pinned: self.pinned.clone(),
        }
    }
}
