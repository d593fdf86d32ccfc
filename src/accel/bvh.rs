//! Pure Rust: obvhs builds a hierarchy of boxes, and the rays are traced here.
//!
//! obvhs has traversals of its own; they bound a ray's start and direction by fixed epsilons, and their box tests round to both
//! sides, so that tiny scenes are missed and edges leak. Here boxes are tested conservatively and triangles watertightly.

use super::{Accel, BackendInfo};
use crate::geometry::{GeomId, Hit, InstanceId, PrimId};
use crate::math::{Ray, Vec3, float::gamma};
use crate::scene::Scene;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::{BvhBuildParams, triangle::Triangle as Corners};
use std::time::Duration;

/// The name users type.
pub const NAME: &str = "obvhs";
/// Version of the crate that builds the hierarchy, as Cargo.toml asks for it.
pub const VERSION: &str = "0.4";

/// A binary hierarchy of axis-parallel boxes over all triangles of a scene.
pub struct BvhAccel {
    /// Inner nodes hold the index of the first of two neighbouring children, leaves that of their first triangle.
    nodes: Vec<Bvh2Node>,
    /// In the order of the leaves.
    triangles: Vec<Triangle>,
}

#[derive(Clone, Copy)]
struct Triangle {
    corners: [Vec3; 3],
    geom: GeomId,
    prim: PrimId,
}

impl BvhAccel {
    /// Builds the hierarchy for `scene`, in the current rayon pool.
    pub fn new(scene: &Scene) -> Self {
        let triangles: Vec<Triangle> = scene
            .geom_ids()
            .zip(scene.meshes())
            .flat_map(|(geom, mesh)| {
                let prims = (0..mesh.triangles.len() as u32).map(PrimId);
                prims.map(move |prim| Triangle {
                    corners: mesh.corners(prim),
                    geom,
                    prim,
                })
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
                let [v0, v1, v2] = t.corners;
                Corners { v0, v1, v2 }
            })
            .collect();
        let bvh = build_bvh2_from_tris(&corners, BvhBuildParams::slow_build(), &mut Duration::default());
        Self {
            triangles: bvh.primitive_indices.iter().map(|&i| triangles[i as usize]).collect(),
            nodes: bvh.nodes,
        }
    }

    /// Walks the nodes that `ray` meets, nearer ones first, and gives their triangles to `visit`, which shortens the ray to a
    /// hit. Ends early once `visit` returns true.
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(&Sheared, &Triangle, &mut f32) -> bool) {
        let Some(root) = self.nodes.first() else { return };
        let slabs = Slabs::new(ray);
        let sheared = Sheared::new(ray);
        let mut t_max = ray.t_max;
        let mut stack = Stack::new();
        let mut next = slabs.meet(root, ray.t_min, t_max).map(|t| (root, t));
        while let Some((node, t)) = next {
            // Something nearer may have been found since the node was put aside.
            if t > t_max {
                next = stack.pop().map(|(i, t)| (&self.nodes[i as usize], t));
                continue;
            }
            let first = node.first_index as usize;
            if node.is_leaf() {
                for triangle in &self.triangles[first..first + node.prim_count as usize] {
                    if visit(&sheared, triangle, &mut t_max) {
                        return;
                    }
                }
                next = stack.pop().map(|(i, t)| (&self.nodes[i as usize], t));
                continue;
            }
            // Both children: the nearer one now, the other one later
            let [left, right] =
                [first, first + 1].map(|i| slabs.meet(&self.nodes[i], ray.t_min, t_max).map(|t| (i, t)));
            let (near, far) = match (left, right) {
                (Some(l), Some(r)) if r.1 < l.1 => (Some(r), Some(l)),
                (None, r) => (r, None),
                both => both,
            };
            if let Some((i, t)) = far {
                stack.push((i as u32, t));
            }
            next = match near {
                Some((i, t)) => Some((&self.nodes[i], t)),
                None => stack.pop().map(|(i, t)| (&self.nodes[i as usize], t)),
            };
        }
    }
}

impl Accel for BvhAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut closest = None;
        self.walk(ray, |sheared, triangle, t_max| {
            if let Some((t, b1, b2)) = sheared.intersect(triangle.corners, ray.t_min, *t_max) {
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
            any = sheared.intersect(triangle.corners, ray.t_min, *t_max).is_some();
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

/// A ray prepared for boxes.
struct Slabs {
    origin: Vec3,
    inverse: Vec3,
}

impl Slabs {
    fn new(ray: &Ray) -> Self {
        // A component of 0 becomes the smallest there is, so that no product is NaN.
        let smallest = Vec3::splat(f32::MIN_POSITIVE).copysign(ray.direction);
        let nonzero = Vec3::select(
            ray.direction.abs().cmplt(Vec3::splat(f32::MIN_POSITIVE)),
            smallest,
            ray.direction,
        );
        Self {
            origin: ray.origin,
            inverse: nonzero.recip(),
        }
    }

    /// Where the ray enters the box of `node`, if it does between `t_min` and `t_max`.
    ///
    /// The far end is moved out by the error bound of both (Ize 2013, "Robust BVH Ray Traversal"; PBR4 §6.8.2).
    #[inline(always)]
    fn meet(&self, node: &Bvh2Node, t_min: f32, t_max: f32) -> Option<f32> {
        let t0 = (node.aabb().min - self.origin) * self.inverse;
        let t1 = (node.aabb().max - self.origin) * self.inverse;
        let enter = t0.min(t1).max_element().max(t_min);
        let leave = (t0.max(t1).min_element() * (1.0 + 2.0 * gamma(3))).min(t_max);
        (enter <= leave).then_some(enter)
    }
}

/// A ray prepared for triangles: axes permuted and sheared so that it runs along +z (Woop, Benthin and Wald 2013, "Watertight
/// Ray/Triangle Intersection").
struct Sheared {
    origin: Vec3,
    direction: Vec3,
    axes: [usize; 3],
    shear: [f32; 2],
}

impl Sheared {
    fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = (0..3).fold(0, |best, axis| if d[axis].abs() > d[best].abs() { axis } else { best });
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        // The winding is kept.
        if d[z] < 0.0 {
            (x, y) = (y, x);
        }
        Self {
            origin: ray.origin,
            direction: d,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z]],
        }
    }

    /// Ray parameter and barycentrics of the second and third corner, for a hit inside `(t_min, t_max)`. Edges belong to the
    /// triangle, and neighbours agree on them.
    #[inline(always)]
    fn intersect(&self, corners: [Vec3; 3], t_min: f32, t_max: f32) -> Option<(f32, f32, f32)> {
        let [x, y, z] = self.axes;
        let [sx, sy] = self.shear;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.origin;
            [p[x] - sx * p[z], p[y] - sy * p[z]]
        });
        // Edge functions; where one is 0 in f32, its sign is found in f64.
        let (mut u, mut v, mut w) = (
            c[0] * b[1] - c[1] * b[0],
            a[0] * c[1] - a[1] * c[0],
            b[0] * a[1] - b[1] * a[0],
        );
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let edge = |p: [f32; 2], q: [f32; 2]| (p[0] as f64 * q[1] as f64 - p[1] as f64 * q[0] as f64) as f32;
            (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let t = self.distance(corners);
        let inverse = 1.0 / determinant;
        (t > t_min && t < t_max).then_some((t, v * inverse, w * inverse))
    }

    /// Where the ray crosses the plane of the triangle, in f64: a ray that leaves a sliver would find it again by the errors of
    /// f32, which the length of the sliver over its width makes larger than any clearance.
    fn distance(&self, corners: [Vec3; 3]) -> f32 {
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        let t = normal.dot(a - self.origin.as_dvec3()) / normal.dot(self.direction.as_dvec3());
        t as f32
    }
}

/// Nodes put aside, with where the ray enters them.
struct Stack {
    near: [(u32, f32); Self::NEAR],
    len: usize,
    /// What does not fit, in hierarchies that are deeper than most.
    deep: Vec<(u32, f32)>,
}

impl Stack {
    const NEAR: usize = 64;

    fn new() -> Self {
        Self {
            near: [(0, 0.0); Self::NEAR],
            len: 0,
            deep: Vec::new(),
        }
    }

    #[inline(always)]
    fn push(&mut self, item: (u32, f32)) {
        if self.len < Self::NEAR {
            self.near[self.len] = item;
            self.len += 1;
        } else {
            self.deep.push(item);
        }
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<(u32, f32)> {
        if let Some(item) = self.deep.pop() {
            return Some(item);
        }
        self.len = self.len.checked_sub(1)?;
        Some(self.near[self.len])
    }
}
