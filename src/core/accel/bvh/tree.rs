//! A hierarchy of boxes over leaves of any type. obvhs builds the hierarchy, and this module
//! traverses it.

use super::wide::{Child, Node, Slabs, widen};
use crate::math::{Bounds3, Ray};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};
use rayon::slice::ParallelSliceMut;
use std::time::Duration;

/// An item in a leaf of a hierarchy, such as a triangle.
pub(super) trait Leaf: Copy + Send + Sync {
    /// Bounding box over all times.
    fn bounds(&self) -> Bounds3;
}

/// A hierarchy of axis-aligned boxes.
pub(super) struct Tree<L> {
    /// Nodes of the hierarchy. The first node is the root.
    nodes: Vec<Node>,
    /// Items in the order of the leaves.
    leaves: Vec<L>,
}

impl<L: Leaf> Tree<L> {
    /// Builds the hierarchy over `items`, in the current rayon pool.
    pub fn new(items: &[L]) -> Self {
        if items.is_empty() {
            return Self {
                nodes: Vec::new(),
                leaves: Vec::new(),
            };
        }
        // Pass each distinct box to obvhs only once. From n equal boxes, obvhs would build a
        // hierarchy of depth n, because it would join only one pair of boxes at a time.
        let mut items = items.to_vec();
        items.par_sort_by_cached_key(|item| bits(item.bounds()));
        let alike: Vec<&[L]> = items.chunk_by(|a, b| bits(a.bounds()) == bits(b.bounds())).collect();
        let boxes: Vec<Item> = alike.iter().map(|items| Item(items[0].bounds())).collect();
        // Do not split large triangles before the build. Rays would be slower with split triangles
        // (docs/notebook/2026-11.md).
        let parameters = BvhBuildParams {
            pre_split: false,
            ..BvhBuildParams::slow_build()
        };
        let bvh = build_bvh2(&boxes, parameters, &mut Duration::default());
        let mut leaves = Vec::with_capacity(items.len());
        // Index in `leaves` of the first item of each box
        let mut starts = vec![0];
        for &i in &bvh.primitive_indices {
            leaves.extend_from_slice(alike[i as usize]);
            starts.push(leaves.len() as u32);
        }
        Self {
            leaves,
            nodes: widen(&bvh, &starts),
        }
    }

    /// Memory of the arrays in bytes.
    pub fn bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice()) + size_of_val(self.leaves.as_slice())) as u64
    }

    /// Visits the leaves in boxes that `ray` hits before `t_max`, nearer boxes first. `visit`
    /// lowers `t_max` to the ray parameter of a hit. Stops and returns `true` as soon as `visit`
    /// returns `true`.
    #[inline(always)]
    pub fn walk(&self, ray: &Ray, t_max: &mut f32, mut visit: impl FnMut(&L, &mut f32) -> bool) -> bool {
        if self.nodes.is_empty() {
            return false;
        }
        let slabs = Slabs::new(ray);
        let mut stack = Stack::new();
        let mut next = Some((Child::default(), ray.t_min));
        while let Some((child, t)) = next {
            let first = child.first as usize;
            if t > *t_max {
                // Skip the box, because a nearer hit was found after the box was pushed.
            } else if child.count > 0 {
                for leaf in &self.leaves[first..first + child.count as usize] {
                    if visit(leaf, t_max) {
                        return true;
                    }
                }
            } else {
                let node = &self.nodes[first];
                let (enter, mut hits) = slabs.intersect(node, *t_max);
                let enter = enter.to_array();
                let bottom = stack.len();
                while hits != 0 {
                    let place = hits.trailing_zeros() as usize;
                    hits &= hits - 1;
                    stack.push_in_order(bottom, (node.children[place], enter[place]));
                }
            }
            next = stack.pop();
        }
        false
    }
}

/// Bits of the box's corners, as a sort key that groups equal boxes.
fn bits(bounds: Bounds3) -> [[u32; 3]; 2] {
    [bounds.min, bounds.max].map(|corner| corner.to_array().map(f32::to_bits))
}

/// A box as input for obvhs.
struct Item(Bounds3);

impl Boundable for Item {
    fn aabb(&self) -> Aabb {
        Aabb::new(self.0.min, self.0.max)
    }
}

/// Stack of boxes that are still to be visited, each with the ray parameter at which the ray enters
/// the box.
struct Stack {
    items: [(Child, f32); Self::NEAR],
    len: usize,
    /// Overflow of `items`, for unusually deep hierarchies.
    deep: Vec<(Child, f32)>,
}

impl Stack {
    const NEAR: usize = 64;

    fn new() -> Self {
        Self {
            items: [(Child::default(), 0.0); Self::NEAR],
            len: 0,
            deep: Vec::new(),
        }
    }

    fn len(&self) -> usize {
        self.len
    }

    /// Inserts `item` into the part of the stack that begins at the index `bottom`. This part is
    /// sorted, with the nearest box last. The overflow `deep` is not sorted.
    #[inline(always)]
    fn push_in_order(&mut self, bottom: usize, item: (Child, f32)) {
        if self.len == Self::NEAR {
            self.deep.push(item);
            return;
        }
        let mut place = self.len;
        while place > bottom && self.items[place - 1].1 < item.1 {
            self.items[place] = self.items[place - 1];
            place -= 1;
        }
        self.items[place] = item;
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(Child, f32)> {
        if let Some(item) = self.deep.pop() {
            return Some(item);
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.items[self.len])
    }
}
