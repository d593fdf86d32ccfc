//! Triangulation of the inside of outlines, by a sweep over horizontal slabs. Slabs are divided
//! such that edges do not cross within a slab.
//!
//! A point is inside if the winding number of the oriented outlines around it is positive, or if it
//! is inside an unoriented outline. So the union of overlapping solids is filled, and hollows stay
//! empty. If the same two edges bound a part of the inside in successive slabs, one trapezoid is
//! made for all these slabs.

use super::outline::OutlineEdge;
use crate::math::DVec2;
use std::collections::{BTreeMap, BTreeSet};

/// An edge that is not horizontal, from its lower to its upper end.
struct Side {
    low: DVec2,
    high: DVec2,
    /// Change of the winding number when the edge is crossed from left to right.
    winding: i64,
    unoriented: Option<u32>,
}

impl Side {
    fn of(edge: &OutlineEdge) -> Option<Self> {
        let OutlineEdge { from, to, unoriented } = *edge;
        let [low, high] = if from.y < to.y { [from, to] } else { [to, from] };
        (low.y < high.y).then_some(Self {
            low,
            high,
            winding: if from.y > to.y { 1 } else { -1 },
            unoriented,
        })
    }

    fn x(&self, y: f64) -> f64 {
        // Return the exact x at both ends of the edge
        if y >= self.high.y {
            return self.high.x;
        }
        self.low.x + (y - self.low.y) / (self.high.y - self.low.y) * (self.high.x - self.low.x)
    }
}

/// Triangulates the inside of `outline`. Triangles are counter-clockwise.
pub(super) fn fill(outline: &[OutlineEdge]) -> Vec<[DVec2; 3]> {
    let mut sides: Vec<Side> = outline.iter().filter_map(Side::of).collect();
    sides.sort_by(|a, b| a.low.y.total_cmp(&b.low.y));
    let mut ys: Vec<f64> = sides.iter().flat_map(|side| [side.low.y, side.high.y]).collect();
    ys.sort_by(f64::total_cmp);
    ys.dedup();
    let (mut active, mut next): (Vec<usize>, usize) = (Vec::new(), 0);
    // Spans (parts of the inside between two sides) of the last slab. The key has the indices of
    // the two sides, and the value is the height at which the span began.
    let mut open: BTreeMap<[usize; 2], f64> = BTreeMap::new();
    let mut triangles = Vec::new();
    for slab in ys.windows(2) {
        let (low, high) = (slab[0], slab[1]);
        active.retain(|&i| sides[i].high.y > low);
        while sides.get(next).is_some_and(|side| side.low.y <= low) {
            active.push(next);
            next += 1;
        }
        let cuts = crossings(&sides, &mut active, [low, high]);
        for part in cuts.windows(2) {
            let middle = 0.5 * (part[0] + part[1]);
            sort_at(&sides, &mut active, middle);
            let mut spans = BTreeMap::new();
            for span in inside(&sides, &active) {
                let start = open.remove(&span).unwrap_or(part[0]);
                spans.insert(span, start);
            }
            for (span, start) in std::mem::replace(&mut open, spans) {
                add_trapezoid(&sides, span, [start, part[0]], &mut triangles);
            }
        }
    }
    let end = ys.last().copied().unwrap_or(0.0);
    for (span, start) in open {
        add_trapezoid(&sides, span, [start, end], &mut triangles);
    }
    triangles
}

fn sort_at(sides: &[Side], active: &mut [usize], y: f64) {
    active.sort_by(|&a, &b| sides[a].x(y).total_cmp(&sides[b].x(y)));
}

/// Ascending heights that divide the slab from `low` to `high` into thinner slabs, within which the
/// active sides do not cross. The first height is `low`, and the last is `high`.
fn crossings(sides: &[Side], active: &mut [usize], [low, high]: [f64; 2]) -> Vec<f64> {
    sort_at(sides, active, 0.5 * (low + high));
    let gap = |a: usize, b: usize, y: f64| sides[b].x(y) - sides[a].x(y);
    let is_sorted = |pair: &[usize]| gap(pair[0], pair[1], low) >= 0.0 && gap(pair[0], pair[1], high) >= 0.0;
    let mut ys = vec![low, high];
    if active.windows(2).all(is_sorted) {
        return ys;
    }
    for (i, &a) in active.iter().enumerate() {
        for &b in &active[i + 1..] {
            let (first, last) = (gap(a, b, low), gap(a, b, high));
            if first * last < 0.0 {
                let y = low + (high - low) * (first / (first - last));
                ys.extend((low < y && y < high).then_some(y));
            }
        }
    }
    ys.sort_by(f64::total_cmp);
    ys.dedup();
    ys
}

/// Pairs of sides that bound the inside of the outlines within a slab. Each pair has the left side,
/// then the right side.
fn inside(sides: &[Side], active: &[usize]) -> Vec<[usize; 2]> {
    let (mut winding, mut unoriented) = (0, BTreeSet::new());
    let (mut spans, mut left) = (Vec::new(), None);
    for &i in active {
        match sides[i].unoriented {
            None => winding += sides[i].winding,
            Some(outline) => {
                if !unoriented.remove(&outline) {
                    unoriented.insert(outline);
                }
            }
        }
        let is_inside = winding > 0 || !unoriented.is_empty();
        left = match left {
            None => is_inside.then_some(i),
            Some(left) if is_inside => Some(left),
            Some(left) => {
                spans.push([left, i]);
                None
            }
        };
    }
    spans
}

fn add_trapezoid(sides: &[Side], [left, right]: [usize; 2], [low, high]: [f64; 2], triangles: &mut Vec<[DVec2; 3]>) {
    let corner = |side: usize, y: f64| DVec2::new(sides[side].x(y), y);
    let [a, b, c, d] = [(left, low), (right, low), (right, high), (left, high)].map(|(side, y)| corner(side, y));
    if b.x > a.x {
        triangles.push([a, b, c]);
    }
    if c.x > d.x {
        triangles.push([a, c, d]);
    }
}
