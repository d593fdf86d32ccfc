use super::signed_area;
use std::array;

/// Maximum number of corners of a leaf.
const LEAF: usize = 8;

/// Corners of a polygon by position: a k-d tree (Bentley 1975) from which corners are removed.
///
/// Node i has the children 2 i + 1 and 2 i + 2. Each child has one half of the corners of node i.
pub(super) struct CornerTree {
    points: Vec<[f64; 2]>,
    /// Corners, grouped by node. In a leaf, the remaining corners come before the removed corners.
    corners: Vec<usize>,
    nodes: Vec<Node>,
    /// Leaf of each corner.
    leaf_of: Vec<usize>,
}

#[derive(Clone, Copy, Default)]
struct Node {
    min: [f64; 2],
    max: [f64; 2],
    /// Index in [`CornerTree::corners`] of the node's first corner.
    start: usize,
    /// Number of corners of the node that have not been removed.
    left: usize,
}

impl CornerTree {
    pub fn new(points: &[[f64; 2]]) -> Self {
        let leaves = points.len().div_ceil(LEAF).next_power_of_two();
        let mut tree = Self {
            points: points.to_vec(),
            corners: (0..points.len()).collect(),
            nodes: vec![Node::default(); 2 * leaves - 1],
            leaf_of: vec![0; points.len()],
        };
        tree.build(0, 0, points.len());
        tree
    }

    fn build(&mut self, index: usize, start: usize, end: usize) {
        let points = &self.points;
        let corners = &mut self.corners[start..end];
        let bound = |pick: fn(f64, f64) -> f64, first: f64| -> [f64; 2] {
            array::from_fn(|axis| corners.iter().fold(first, |bound, &i| pick(bound, points[i][axis])))
        };
        let (min, max) = (bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY));
        self.nodes[index] = Node {
            min,
            max,
            start,
            left: end - start,
        };
        // All leaves are on the lowest level.
        if index >= self.nodes.len() / 2 {
            for &corner in &*corners {
                self.leaf_of[corner] = index;
            }
            return;
        }
        let axis = usize::from(max[1] - min[1] > max[0] - min[0]);
        let half = (end - start) / 2;
        if half > 0 {
            corners.select_nth_unstable_by(half, |&a, &b| points[a][axis].total_cmp(&points[b][axis]));
        }
        self.build(2 * index + 1, start, start + half);
        self.build(2 * index + 2, start + half, end);
    }

    fn is_leaf(&self, index: usize) -> bool {
        index >= self.nodes.len() / 2
    }

    /// Removes a corner that is in the tree.
    pub fn remove(&mut self, corner: usize) {
        let mut index = self.leaf_of[corner];
        let Node { start, left, .. } = self.nodes[index];
        // The remaining corners come first.
        let there = &mut self.corners[start..start + left];
        if let Some(place) = there.iter().position(|&c| c == corner) {
            there.swap(place, left - 1);
        }
        loop {
            self.nodes[index].left -= 1;
            if index == 0 {
                return;
            }
            index = (index - 1) / 2;
        }
    }

    /// Returns true if `holds` returns true for all remaining corners inside the triangle or on its
    /// edges. `holds` may also be called for some corners outside the triangle.
    pub fn all_near(&self, triangle: [[f64; 2]; 3], holds: &mut impl FnMut(usize) -> bool) -> bool {
        self.all_in(0, triangle, holds)
    }

    fn all_in(&self, index: usize, triangle: [[f64; 2]; 3], holds: &mut impl FnMut(usize) -> bool) -> bool {
        let node = &self.nodes[index];
        if node.left == 0 || node.is_outside(triangle) {
            return true;
        }
        if self.is_leaf(index) {
            return self.corners[node.start..node.start + node.left]
                .iter()
                .all(|&c| holds(c));
        }
        self.all_in(2 * index + 1, triangle, holds) && self.all_in(2 * index + 2, triangle, holds)
    }
}

impl Node {
    /// Returns true if the whole box is on the outer side of an edge of the triangle. Rounding
    /// errors cannot make this wrong, because rounding is monotonic: if [`signed_area`] finds a
    /// point of the box on the inner side of all edges, the result is false.
    fn is_outside(&self, [a, b, c]: [[f64; 2]; 3]) -> bool {
        [(a, b), (b, c), (c, a)].into_iter().any(|(from, to)| {
            // Take the corner of the box with the largest signed area. The area grows with y if the
            // edge points to +x, and falls with x if the edge points to +y.
            let x = if to[1] > from[1] { self.min[0] } else { self.max[0] };
            let y = if to[0] > from[0] { self.max[1] } else { self.min[1] };
            signed_area(from, to, [x, y]) < 0.0
        })
    }
}
