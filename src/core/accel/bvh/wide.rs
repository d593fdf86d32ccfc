//! Nodes of four boxes, converted from a binary hierarchy, and the ray-box test.

use crate::math::{Ray, Vec3, Vec4, float::gamma};
use obvhs::bvh2::{Bvh2, node::Bvh2Node};

/// Number of children of a node.
pub(super) const WIDTH: usize = 4;

/// A node: four boxes and their contents. The coordinates of the boxes are stored axis by axis for
/// SIMD. A node fills two cache lines.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// Lower and upper ends of the boxes along x, y and z. In an unused box, the lower ends are
    /// above the upper ends.
    bounds: [[Vec4; 3]; 2],
    /// Content of each box.
    pub children: [Child; WIDTH],
}

/// Content of a box: a node or a range of leaves.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Child {
    pub first: u32,
    /// Number of leaves, or 0 for a node.
    pub count: u32,
}

impl Node {
    const EMPTY: Self = Self {
        bounds: [[Vec4::INFINITY; 3], [Vec4::NEG_INFINITY; 3]],
        children: [Child { first: 0, count: 0 }; WIDTH],
    };

    fn set(&mut self, place: usize, node: &Bvh2Node, child: Child) {
        let ends = [node.aabb().min, node.aabb().max];
        for (bounds, end) in self.bounds.iter_mut().zip(ends) {
            for axis in 0..3 {
                bounds[axis][place] = end[axis];
            }
        }
        self.children[place] = child;
    }
}

/// Converts a binary hierarchy to a hierarchy with four children per node. A wide node is made from
/// a list that holds one binary node at first. The inner node with the largest surface in the list
/// is replaced by its two children, until the list has four nodes or only leaves. The first node of
/// the result is the root. Primitive `i` of the binary hierarchy stands for the leaves from
/// `starts[i]` to `starts[i + 1]`.
pub(super) fn widen(binary: &Bvh2, starts: &[u32]) -> Vec<Node> {
    let Some(root) = binary.nodes.first() else {
        return Vec::new();
    };
    let mut nodes = vec![Node::EMPTY];
    // Stack of binary nodes whose children are not yet in a wide node
    let mut open = vec![(root, 0)];
    while let Some((node, index)) = open.pop() {
        let mut members = vec![node];
        while let Some(largest) = largest_inner(&members) {
            let [left, right] = children(binary, members[largest]);
            members[largest] = left;
            members.push(right);
            if members.len() == WIDTH {
                break;
            }
        }
        for (place, member) in members.into_iter().enumerate() {
            let child = if member.is_leaf() {
                let first = starts[member.first_index as usize];
                let end = starts[(member.first_index + member.prim_count) as usize];
                Child {
                    first,
                    count: end - first,
                }
            } else {
                nodes.push(Node::EMPTY);
                let first = nodes.len() as u32 - 1;
                open.push((member, first));
                Child { first, count: 0 }
            };
            nodes[index as usize].set(place, member, child);
        }
    }
    nodes
}

fn children<'a>(binary: &'a Bvh2, node: &Bvh2Node) -> [&'a Bvh2Node; 2] {
    let first = node.first_index as usize;
    [&binary.nodes[first], &binary.nodes[first + 1]]
}

/// Index of the inner node with the largest surface; `None` if all nodes of `members` are leaves.
fn largest_inner(members: &[&Bvh2Node]) -> Option<usize> {
    let area = |i: &usize| members[*i].aabb().half_area();
    let inner = (0..members.len()).filter(|&i| !members[i].is_leaf());
    inner.max_by(|i, j| area(i).total_cmp(&area(j)))
}

/// A ray prepared for tests against boxes.
pub(super) struct Slabs {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// For each axis, the end of a box that the ray enters first: 0 for the lower end, 1 for the
    /// upper end.
    near: [usize; 3],
    t_min: f32,
}

impl Slabs {
    pub fn new(ray: &Ray) -> Self {
        // A component near 0 becomes the smallest normal float of the same sign, so that no product
        // is NaN.
        let smallest = Vec3::splat(f32::MIN_POSITIVE).copysign(ray.direction);
        let is_small = ray.direction.abs().cmplt(Vec3::splat(f32::MIN_POSITIVE));
        let inverse = Vec3::select(is_small, smallest, ray.direction).recip().to_array();
        Self {
            origin: ray.origin.to_array().map(Vec4::splat),
            inverse: inverse.map(Vec4::splat),
            near: inverse.map(|i| usize::from(i < 0.0)),
            t_min: ray.t_min,
        }
    }

    /// Returns the ray parameters at which the ray enters the boxes, and a bit mask with a 1 for
    /// each box that the ray hits before `t_max`.
    ///
    /// The ray parameter at which the ray leaves a box is increased by the error bounds of entry
    /// and exit (Ize 2013, "Robust BVH Ray Traversal"; PBR4 §6.8.2).
    #[inline(always)]
    pub fn intersect(&self, node: &Node, t_max: f32) -> (Vec4, u32) {
        let t = |end: usize, axis: usize| (node.bounds[end][axis] - self.origin[axis]) * self.inverse[axis];
        let [x, y, z] = self.near;
        let enter = t(x, 0).max(t(y, 1)).max(t(z, 2)).max(Vec4::splat(self.t_min));
        let leave = t(1 - x, 0).min(t(1 - y, 1)).min(t(1 - z, 2)) * (1.0 + 2.0 * gamma(3));
        (enter, enter.cmple(leave.min(Vec4::splat(t_max))).bitmask())
    }
}
