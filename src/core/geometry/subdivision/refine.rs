//! Values at vertices after a step of subdivision.
//!
//! Smooth surfaces: Catmull and Clark 1978, and Loop 1987 with the weights of Warren 1995. Creases:
//! Hoppe et al. 1994. Creases of finite sharpness: DeRose et al. 1998, eq. 8.

use super::topology::{Scheme, Topology};
use crate::math::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::{Add, AddAssign, Mul};

/// Value at a vertex, in f64. The rounding errors of many steps then stay below the rounding error
/// of positions in f32.
pub(super) trait VertexValue:
    Copy + Default + Send + Sync + Add<Output = Self> + AddAssign + Mul<f64, Output = Self>
{
}

impl VertexValue for DVec2 {}
impl VertexValue for DVec3 {}

/// Rule for the values of the next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rule {
    /// Smooth surfaces, with smooth curves at boundaries.
    Surface,
    /// Smooth inside and linear along boundaries, for texture coordinates.
    Inside,
    /// Means of neighbouring values, for colours.
    Linear,
}

/// Numbers of edges and faces around a vertex.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Valence {
    /// Number of edges.
    pub edges: u32,
    /// Number of corners of faces.
    pub corners: u32,
    /// Number of sharp edges.
    pub sharp: u32,
    /// Sum of the sharpness of the sharp edges.
    pub sharpness: f32,
    /// True if the vertex keeps its position because of the crease angle.
    pub is_pinned: bool,
}

impl Valence {
    /// Returns true if the vertex keeps its position: it is pinned, more than two sharp edges meet
    /// at the vertex, or it is the corner of a single face.
    pub fn is_corner(&self) -> bool {
        self.is_pinned || self.sharp > 2 || self.sharp == 2 && self.corners == 1
    }

    /// Returns true if a sharp curve passes through the vertex.
    pub fn is_crease(&self) -> bool {
        self.sharp == 2 && !self.is_corner()
    }
}

/// Edges and faces around each vertex.
pub(super) fn around_vertices(topology: &Topology) -> Vec<Valence> {
    let mut around = vec![Valence::default(); topology.vertex_count as usize];
    for (around, &is_pinned) in around.iter_mut().zip(&topology.pinned) {
        around.is_pinned = is_pinned;
    }
    for &vertex in &topology.vertices {
        around[vertex as usize].corners += 1;
    }
    for (edge, &sharpness) in (0..).zip(&topology.sharpness) {
        for vertex in topology.ends(edge) {
            let around = &mut around[vertex as usize];
            around.edges += 1;
            around.sharp += u32::from(sharpness > 0.0);
            around.sharpness += sharpness;
        }
    }
    around
}

/// For each vertex, two sums of the values of its neighbours: over all edges, and over sharp edges
/// only. The second list is empty if no edge is sharp.
pub(super) fn sums_of_neighbours<V: VertexValue>(topology: &Topology, values: &[V]) -> [Vec<V>; 2] {
    let mut of_all = vec![V::default(); values.len()];
    let has_sharp = topology.sharpness.par_iter().any(|&sharpness| sharpness > 0.0);
    let mut of_sharp = vec![V::default(); if has_sharp { values.len() } else { 0 }];
    for (edge, &sharpness) in (0..).zip(&topology.sharpness) {
        let [a, b] = topology.ends(edge).map(|vertex| vertex as usize);
        of_all[a] += values[b];
        of_all[b] += values[a];
        if sharpness > 0.0 {
            of_sharp[a] += values[b];
            of_sharp[b] += values[a];
        }
    }
    [of_all, of_sharp]
}

/// Weight of each neighbour in the new position of a vertex with `edges` edges, for Loop's scheme
/// (Warren 1995).
pub(super) fn loop_factor(edges: u32) -> f64 {
    if edges == 3 {
        3.0 / 16.0
    } else {
        3.0 / (8.0 * f64::from(edges))
    }
}

/// Returns the values at the vertices of the mesh after a step ([`Topology::refined`]).
pub(super) fn refined<V: VertexValue>(
    topology: &Topology,
    scheme: Scheme,
    rule: Rule,
    values: &[V],
    around: &[Valence],
) -> Vec<V> {
    let value = |vertex: u32| values[vertex as usize];
    let mean = |a: V, b: V, t: f64| a * (1.0 - t) + b * t;
    let of_faces: Vec<V> = match scheme {
        Scheme::CatmullClark => (0..topology.face_count())
            .into_par_iter()
            .map(|face| {
                let corners = topology.corners(face);
                let weight = 1.0 / f64::from(corners.end - corners.start);
                corners.fold(V::default(), |sum, corner| sum + value(topology.vertex(corner))) * weight
            })
            .collect(),
        Scheme::Loop => Vec::new(),
    };
    let of_edge = |edge: u32| {
        let [a, b] = topology.ends(edge);
        let middle = (value(a) + value(b)) * 0.5;
        let sharpness = topology.sharpness[edge as usize];
        let [first, second] = topology.edge_corners[edge as usize];
        if rule == Rule::Linear || sharpness >= 1.0 {
            return middle;
        }
        let smooth = match scheme {
            Scheme::CatmullClark => {
                let [f, g] = [first, second].map(|corner| of_faces[topology.face(corner) as usize]);
                (middle * 2.0 + f + g) * 0.25
            }
            Scheme::Loop => {
                let [f, g] = [first, second].map(|corner| value(topology.vertex(topology.previous(corner))));
                middle * 0.75 + (f + g) * 0.125
            }
        };
        mean(smooth, middle, sharpness.into())
    };
    let of_edges: Vec<V> = (0..topology.edge_corners.len() as u32)
        .into_par_iter()
        .map(of_edge)
        .collect();
    let mut new: Vec<V> = if rule == Rule::Linear {
        values.to_vec()
    } else {
        let [mut sums, sharp_sums] = sums_of_neighbours(topology, values);
        if scheme == Scheme::CatmullClark {
            for (corner, &vertex) in (0..).zip(&topology.vertices) {
                sums[vertex as usize] += of_faces[topology.face(corner) as usize];
            }
        }
        let of_vertex = |vertex: usize| {
            let (old, around) = (values[vertex], around[vertex]);
            let keeps = around.is_corner() || rule == Rule::Inside && around.sharp > 0;
            if around.edges == 0 || keeps && around.sharpness >= around.sharp as f32 {
                return old;
            }
            let n = f64::from(around.edges);
            let smooth = match scheme {
                Scheme::CatmullClark => old * ((n - 2.0) / n) + sums[vertex] * (1.0 / (n * n)),
                Scheme::Loop => {
                    let factor = loop_factor(around.edges);
                    old * (1.0 - n * factor) + sums[vertex] * factor
                }
            };
            let sharp = if keeps {
                old
            } else if around.sharp == 2 {
                old * 0.75 + sharp_sums[vertex] * 0.125
            } else {
                return smooth;
            };
            let sharpness = f64::from(around.sharpness) / f64::from(around.sharp);
            mean(smooth, sharp, sharpness.min(1.0))
        };
        (0..values.len()).into_par_iter().map(of_vertex).collect()
    };
    new.extend(of_edges);
    new.extend(of_faces);
    new
}
