//! Positions of vertices on the limit surface, after infinitely many steps, and their normals.
//!
//! Catmull and Clark: Halstead, Kass and DeRose 1993, appendix A. Loop: Hoppe et al. 1994,
//! appendix. Creases: Biermann, Levin and Zorin 2000, appendix A.

use super::refine::{Valence, loop_factor, sums_of_neighbours};
use super::topology::{NONE, Scheme, Topology};
use crate::math::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Positions of the vertices on the limit surface. Faces are quads or triangles.
pub(super) fn positions(topology: &Topology, scheme: Scheme, positions: &[DVec3], around: &[Valence]) -> Vec<DVec3> {
    let [sums, sharp_sums] = sums_of_neighbours(topology, positions);
    let mut of_diagonals = Vec::new();
    if scheme == Scheme::CatmullClark {
        of_diagonals = vec![DVec3::ZERO; positions.len()];
        for (corner, &vertex) in (0..).zip(&topology.vertices) {
            let diagonal = topology.vertex(topology.next(topology.next(corner)));
            of_diagonals[vertex as usize] += positions[diagonal as usize];
        }
    }
    let limit = |vertex: usize| {
        let (p, around) = (positions[vertex], around[vertex]);
        if around.edges == 0 || around.is_corner() {
            return p;
        }
        if around.is_crease() {
            return (p * 4.0 + sharp_sums[vertex]) / 6.0;
        }
        let n = f64::from(around.edges);
        match scheme {
            Scheme::CatmullClark => (p * n * n + sums[vertex] * 4.0 + of_diagonals[vertex]) / (n * (n + 5.0)),
            Scheme::Loop => {
                let factor = 1.0 / (n + 3.0 / (8.0 * loop_factor(around.edges)));
                p * (1.0 - n * factor) + sums[vertex] * factor
            }
        }
    };
    (0..positions.len()).into_par_iter().map(limit).collect()
}

/// Fan of faces around a vertex, between two sharp edges: the corners of the faces at the vertex,
/// counter-clockwise, and the positions of the neighbouring vertices. Without sharp edges, the fan
/// is closed.
#[derive(Default)]
struct Fan {
    corners: Vec<u32>,
    /// Positions of the neighbours along the edges; one more than the corners if the fan is open.
    edges: Vec<DVec3>,
    /// Positions of the opposite vertices of quads.
    diagonals: Vec<DVec3>,
    is_closed: bool,
}

/// Returns the normals of the limit surface, and for each corner the index of its normal. A vertex
/// has one normal for each fan of faces between sharp edges. The first normal of a vertex has the
/// index of the vertex.
pub(super) fn normals(
    topology: &Topology,
    scheme: Scheme,
    positions: &[DVec3],
    around: &[Valence],
) -> (Vec<DVec3>, Vec<u32>) {
    let mut of_corners = vec![NONE; topology.vertices.len()];
    let mut normals = vec![DVec3::ZERO; positions.len()];
    let mut has_normal = vec![false; positions.len()];
    let mut fan = Fan::default();
    for corner in 0..topology.vertices.len() as u32 {
        if of_corners[corner as usize] != NONE {
            continue;
        }
        let vertex = topology.vertex(corner) as usize;
        fan.follow(topology, positions, corner, around[vertex].corners);
        let normal = fan.normal(scheme, positions[vertex], around[vertex]);
        let index = if has_normal[vertex] { normals.len() } else { vertex };
        if index == vertex {
            normals[vertex] = normal;
            has_normal[vertex] = true;
        } else {
            normals.push(normal);
        }
        for &corner in &fan.corners {
            of_corners[corner as usize] = index as u32;
        }
    }
    (normals, of_corners)
}

impl Fan {
    /// Collects the fan that contains `corner`. `count` is the number of corners at the vertex. It
    /// limits the search, which might not end if faces have repeated vertices.
    fn follow(&mut self, topology: &Topology, positions: &[DVec3], corner: u32, count: u32) {
        self.corners.clear();
        self.edges.clear();
        self.diagonals.clear();
        let mut first = corner;
        self.is_closed = false;
        for _ in 0..count {
            let Some(before) = topology.clockwise(first) else { break };
            first = before;
            if first == corner {
                self.is_closed = true;
                break;
            }
        }
        let at = |corner: u32| positions[topology.vertex(corner) as usize];
        let mut at_corner = first;
        loop {
            self.corners.push(at_corner);
            let next = topology.next(at_corner);
            self.edges.push(at(next));
            self.diagonals.push(at(topology.next(next)));
            match topology.counter_clockwise(at_corner) {
                Some(next) if next != first && self.corners.len() < count as usize => at_corner = next,
                _ => break,
            }
        }
        if !self.is_closed {
            self.edges.push(at(topology.previous(at_corner)));
        }
    }

    /// Unit normal at the vertex `p`.
    fn normal(&self, scheme: Scheme, p: DVec3, around: Valence) -> DVec3 {
        let k = self.corners.len();
        let [t1, t2] = if self.is_closed || around.sharp == 1 {
            self.tangents(scheme, k)
        } else if around.is_crease() {
            let last = self.edges[k];
            [self.edges[0] - last, self.across(scheme, p, k)]
        } else {
            [DVec3::ZERO; 2]
        };
        let normal = t1.normalize_or_zero().cross(t2.normalize_or_zero());
        // Collinear tangents define no normal
        if normal.length_squared() > 1e-16 {
            normal.normalize_or_zero()
        } else {
            self.mean_normal(p)
        }
    }

    /// Tangents at a smooth vertex with `n` edges. The second tangent points to the left of the
    /// first.
    fn tangents(&self, scheme: Scheme, n: usize) -> [DVec3; 2] {
        let angle = TAU / n as f64;
        let factor = match scheme {
            Scheme::CatmullClark => 1.0 + angle.cos() + (0.5 * angle).cos() * (2.0 * (9.0 + angle.cos())).sqrt(),
            Scheme::Loop => 1.0,
        };
        let mut tangents = [DVec3::ZERO; 2];
        for i in 0..n {
            let (sin, cos) = (angle * i as f64).sin_cos();
            let (next_sin, next_cos) = (angle * (i + 1) as f64).sin_cos();
            tangents[0] += self.edges[i] * (factor * cos);
            tangents[1] += self.edges[i] * (factor * sin);
            if scheme == Scheme::CatmullClark {
                tangents[0] += self.diagonals[i] * (cos + next_cos);
                tangents[1] += self.diagonals[i] * (sin + next_sin);
            }
        }
        tangents
    }

    /// Tangent across a crease or boundary of a fan of `k` faces. The tangent points to the left,
    /// seen in the direction of the first edge.
    fn across(&self, scheme: Scheme, p: DVec3, k: usize) -> DVec3 {
        let (first, last) = (self.edges[0], self.edges[k]);
        let angle = PI / k as f64;
        let (sin, cos) = angle.sin_cos();
        let inside = || (1..k).map(|i| self.edges[i] * (angle * i as f64).sin());
        match (scheme, k) {
            (Scheme::CatmullClark, 1) => self.diagonals[0] - p,
            (Scheme::CatmullClark, _) => {
                let n = k as f64;
                let of_ends = (cos + 1.0) / (n * sin * (3.0 + cos));
                let of_edges = inside().sum::<DVec3>() * 4.0;
                let sines = |i: usize| (angle * i as f64).sin() + (angle * (i + 1) as f64).sin();
                let of_diagonals: DVec3 = (0..k).map(|i| self.diagonals[i] * sines(i)).sum();
                p * (4.0 * of_ends * (cos - 1.0)) - (first + last) * (of_ends * (1.0 + 2.0 * cos))
                    + (of_edges + of_diagonals) / ((3.0 + cos) * n)
            }
            (Scheme::Loop, 1) => first + last - p * 2.0,
            (Scheme::Loop, 2) => self.edges[1] - p,
            (Scheme::Loop, _) => {
                let of_edges: DVec3 = inside().sum();
                of_edges * (2.0 - 2.0 * cos) - (first + last) * sin
            }
        }
    }

    /// Mean of the normals of the faces. The weight of a face is the area of the triangle between
    /// the vertex and the two neighbours.
    fn mean_normal(&self, p: DVec3) -> DVec3 {
        let next = |i: usize| self.edges.get(i + 1).unwrap_or(&self.edges[0]);
        let facets = (0..self.corners.len()).map(|i| (self.edges[i] - p).cross(*next(i) - p));
        facets.sum::<DVec3>().normalize_or_zero()
    }
}
