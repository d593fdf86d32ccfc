//! Outlines of caps: the edges along which a plane cuts closed surfaces. The cut edges of open
//! surfaces are separated.
//!
//! The front of a triangle is outside of the solid. An outline whose triangles face inwards bounds
//! a hollow if it is within a solid. Otherwise it is the outline of a room whose walls have no
//! thickness. Such a room gets no cap.
//!
//! End points of edges that differ only by rounding are merged into one vertex. A closed outline
//! has an even number of edges at each vertex. Two kinds of edges belong to open surfaces: edges
//! that lead to a vertex without another edge (a free end), and edges of an outline that has an odd
//! number of edges at any vertex.

use super::clip::CutEdge;
use super::plane::SectionPlane;
use crate::math::{DVec2, Vec3};
use std::collections::HashMap;

/// Distance within which end points of edges are merged, as a fraction of the largest coordinate.
/// It covers the rounding errors of the transforms and cuts that computed the end points.
const WELDING: f64 = 4e-6;

/// An edge of an outline. The inside is on the left of the edge.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutlineEdge {
    pub from: DVec2,
    pub to: DVec2,
    /// Id of the outline, if the windings of the cut triangles do not agree. The inside of this
    /// outline is determined by the even-odd rule. `None` if the windings agree.
    pub unoriented: Option<u32>,
}

/// Edges of closed outlines, and edges of open outlines.
#[derive(Debug, Default)]
pub(super) struct Outlines {
    pub closed: Vec<OutlineEdge>,
    pub open: Vec<CutEdge>,
    /// Number of outlines that face inwards and have no solid around them: rooms whose walls have
    /// no thickness.
    pub inward: u64,
}

/// Merges points in a plane that are nearer than a tolerance.
struct Welder {
    tolerance: f64,
    cells: HashMap<[i64; 2], Vec<u32>>,
    vertices: Vec<DVec2>,
}

impl Welder {
    fn vertex(&mut self, p: DVec2) -> u32 {
        let cell = |x: f64| (x / (2.0 * self.tolerance)).floor() as i64;
        let [x, y] = [cell(p.x), cell(p.y)];
        for dx in -1..=1 {
            for dy in -1..=1 {
                let near = self.cells.get(&[x.saturating_add(dx), y.saturating_add(dy)]);
                let found = near.into_iter().flatten();
                let mut found = found.filter(|&&i| self.vertices[i as usize].distance(p) <= self.tolerance);
                if let Some(&vertex) = found.next() {
                    return vertex;
                }
            }
        }
        let vertex = self.vertices.len() as u32;
        self.vertices.push(p);
        self.cells.entry([x, y]).or_default().push(vertex);
        vertex
    }
}

/// Outlines made of the edges along which a plane cuts one object.
pub(super) fn outlines(edges: &[CutEdge], plane: &SectionPlane) -> Outlines {
    let largest = |p: Vec3| f64::from(p.abs().max_element());
    let scale = edges.iter().flat_map(|edge| [largest(edge.from), largest(edge.to)]);
    let mut welder = Welder {
        tolerance: WELDING * scale.fold(f64::MIN_POSITIVE, f64::max),
        cells: HashMap::new(),
        vertices: Vec::new(),
    };
    let ends = edges
        .iter()
        .map(|edge| [edge.from, edge.to].map(|p| welder.vertex(plane.coordinates(p))));
    let ends: Vec<[u32; 2]> = ends.collect();
    let count = welder.vertices.len();
    let mut at: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (i, &[a, b]) in ends.iter().enumerate().filter(|(_, [a, b])| a != b) {
        at[a as usize].push(i as u32);
        at[b as usize].push(i as u32);
    }

    // Mark edges that lead to free ends as open
    let mut is_open = vec![false; edges.len()];
    let mut degrees: Vec<usize> = at.iter().map(Vec::len).collect();
    let mut free: Vec<usize> = (0..count).filter(|&v| degrees[v] == 1).collect();
    while let Some(vertex) = free.pop() {
        let Some(&edge) = at[vertex].iter().find(|&&edge| !is_open[edge as usize]) else {
            continue;
        };
        is_open[edge as usize] = true;
        for end in ends[edge as usize] {
            degrees[end as usize] -= 1;
            if degrees[end as usize] == 1 {
                free.push(end as usize);
            }
        }
    }

    // Find connected components of the other edges
    let mut outlines = Outlines::default();
    let mut inward: Vec<Vec<OutlineEdge>> = Vec::new();
    let mut is_seen = is_open.clone();
    for first in 0..edges.len() {
        let [a, b] = ends[first];
        if is_seen[first] || a == b {
            continue;
        }
        is_seen[first] = true;
        let (mut members, mut next) = (vec![first], 0);
        while next < members.len() {
            for end in ends[members[next]] {
                for &edge in &at[end as usize] {
                    if !std::mem::replace(&mut is_seen[edge as usize], true) {
                        members.push(edge as usize);
                    }
                }
            }
            next += 1;
        }
        let is_closed = |edge: &usize| ends[*edge].iter().all(|&v| degrees[v as usize] % 2 == 0);
        if !members.iter().all(is_closed) {
            members.iter().for_each(|&edge| is_open[edge] = true);
            continue;
        }
        let mut balance: HashMap<u32, i64> = HashMap::new();
        for &edge in &members {
            let [from, to] = ends[edge];
            *balance.entry(from).or_default() += 1;
            *balance.entry(to).or_default() -= 1;
        }
        let unoriented = balance.values().any(|&b| b != 0).then_some(first as u32);
        let edge = |edge: usize| {
            let [from, to] = ends[edge].map(|v| welder.vertices[v as usize]);
            OutlineEdge { from, to, unoriented }
        };
        let outline: Vec<OutlineEdge> = members.into_iter().map(edge).collect();
        if unoriented.is_none() && area(&outline) < 0.0 {
            inward.push(outline);
        } else {
            outlines.closed.extend(outline);
        }
    }
    // Outlines that face inwards within a solid are hollows of the solid.
    let solids = outlines.closed.len();
    for outline in inward {
        let middle = 0.5 * (outline[0].from + outline[0].to);
        if winding(&outlines.closed[..solids], middle) > 0 {
            outlines.closed.extend(outline);
        } else {
            outlines.inward += 1;
        }
    }
    outlines.open = (edges.iter().zip(&is_open))
        .filter(|(_, is_open)| **is_open)
        .map(|(edge, _)| *edge)
        .collect();
    outlines
}

/// Area within an outline; negative if its triangles face inwards.
fn area(outline: &[OutlineEdge]) -> f64 {
    outline.iter().map(|edge| 0.5 * edge.from.perp_dot(edge.to)).sum()
}

/// Winding number of oriented outlines around a point.
fn winding(outline: &[OutlineEdge], p: DVec2) -> i64 {
    let mut winding = 0;
    for edge in outline.iter().filter(|edge| edge.unoriented.is_none()) {
        let (is_from_below, is_to_below) = (edge.from.y <= p.y, edge.to.y <= p.y);
        if is_from_below == is_to_below {
            continue;
        }
        let share = (p.y - edge.from.y) / (edge.to.y - edge.from.y);
        let x = edge.from.x + share * (edge.to.x - edge.from.x);
        if x > p.x {
            winding += if is_from_below { 1 } else { -1 };
        }
    }
    winding
}
