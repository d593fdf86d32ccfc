//! Pure Rust: obvhs builds a hierarchy of boxes, and the rays are traced here.
//!
//! obvhs has traversals of its own; they bound a ray's start and direction by fixed epsilons, and their box tests round to both
//! sides, so that tiny scenes are missed and edges leak. Here its binary hierarchy is made one of four children a node, whose
//! boxes are tested at once and conservatively, and triangles are tested watertightly.

mod watertight;
mod wide;

use super::{Accel, BackendInfo};
use crate::geometry::{Hit, InstanceId, PrimId};
use crate::math::Ray;
use crate::scene::Scene;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::{BvhBuildParams, triangle::Triangle as Corners};
use std::time::Duration;
use watertight::{Sheared, Triangle};
use wide::{Child, Node, Slabs, widen};

/// The name users type.
pub const NAME: &str = "obvhs";
/// Version of the crate that builds the hierarchy, as Cargo.toml asks for it.
pub const VERSION: &str = "0.4";

/// A hierarchy of axis-parallel boxes over all triangles of a scene.
pub struct BvhAccel {
    /// The root first.
    nodes: Vec<Node>,
    /// In the order of the leaves.
    triangles: Vec<Triangle>,
}

impl BvhAccel {
    /// Builds the hierarchy for `scene`, in the current rayon pool.
    pub fn new(scene: &Scene) -> Self {
        let triangles: Vec<Triangle> = scene
            .geom_ids()
            .zip(scene.meshes())
            .flat_map(|(geom, mesh)| {
                let prims = (0..mesh.triangles.len() as u32).map(PrimId);
                prims.map(move |prim| Triangle::new(mesh.corners(prim), geom, prim))
            })
            .collect();
        if triangles.is_empty() {
            return Self {
                nodes: Vec::new(),
                triangles,
            };
        }
        let corners: Vec<Corners> = triangles
            .iter()
            .map(|t| {
                let [v0, v1, v2] = t.corners();
                Corners { v0, v1, v2 }
            })
            .collect();
        // Splitting large triangles beforehand costs rays more than it saves them (docs/benchmarks.md).
        let parameters = BvhBuildParams {
            pre_split: false,
            ..BvhBuildParams::slow_build()
        };
        let bvh = build_bvh2_from_tris(&corners, parameters, &mut Duration::default());
        Self {
            triangles: bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect(),
            nodes: widen(&bvh),
        }
    }

    /// Walks the boxes that `ray` meets, nearer ones first, and gives their triangles to `visit`, which shortens the ray to a
    /// hit. Ends early once `visit` returns true.
    #[inline(always)]
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(&Sheared, &Triangle, &mut f32) -> bool) {
        if self.nodes.is_empty() {
            return;
        }
        let slabs = Slabs::new(ray);
        let sheared = Sheared::new(ray);
        let mut t_max = ray.t_max;
        let mut stack = Stack::new();
        let mut next = Some((Child::default(), ray.t_min));
        while let Some((child, t)) = next {
            let first = child.first as usize;
            if t > t_max {
                // Something nearer has been found since the box was put aside.
            } else if child.count > 0 {
                for triangle in &self.triangles[first..first + child.count as usize] {
                    if visit(&sheared, triangle, &mut t_max) {
                        return;
                    }
                }
            } else {
                let node = &self.nodes[first];
                let (enter, mut met) = slabs.meet(node, t_max);
                let enter = enter.to_array();
                let bottom = stack.len();
                while met != 0 {
                    let place = met.trailing_zeros() as usize;
                    met &= met - 1;
                    stack.push_in_order(bottom, (node.children[place], enter[place]));
                }
            }
            next = stack.pop();
        }
    }
}

impl Accel for BvhAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut closest = None;
        self.walk(ray, |sheared, triangle, t_max| {
            if let Some((t, b1, b2)) = sheared.intersect(triangle, ray.t_min, *t_max) {
                *t_max = t;
                closest = Some(Hit {
                    t,
                    b1,
                    b2,
                    prim: triangle.prim,
                    geom: triangle.geom,
                    inst: InstanceId::NONE,
                });
            }
            false
        });
        closest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut any = false;
        self.walk(ray, |sheared, triangle, t_max| {
            any = sheared.intersect(triangle, ray.t_min, *t_max).is_some();
            any
        });
        any
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: NAME,
            version: VERSION.into(),
            isa: "sse2",
        }
    }

    fn bytes(&self) -> u64 {
        (size_of_val(self.nodes.as_slice()) + size_of_val(self.triangles.as_slice())) as u64
    }
}

/// Boxes put aside, each with where the ray enters it.
struct Stack {
    items: [(Child, f32); Self::NEAR],
    len: usize,
    /// What does not fit, in hierarchies that are deeper than most.
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

    /// Puts `item` among those from `bottom` on, which stay in order: the nearest is the last.
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
