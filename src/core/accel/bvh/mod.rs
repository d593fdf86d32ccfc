//! Backend in pure Rust: obvhs builds a hierarchy of boxes, and this module traces rays.
//!
//! obvhs's own traversals are not used. These traversals clamp the reciprocal of a direction at a
//! fixed epsilon. The traversal of wide hierarchies also starts rays at a fixed distance, so it
//! misses hits in scenes with a size of 10⁻⁸ units. The box tests of obvhs are not conservative, so
//! rays leak at edges.
//!
//! This module converts the binary hierarchy (built by PLOC with reinsertion) to nodes with four
//! boxes (`wide`). Box tests are conservative (Ize 2013) and triangle tests watertight
//! (`watertight`; Woop et al. 2013). Both tests use f32, with two exceptions in f64: edge functions
//! if one of them is 0 in f32, and the distance of a hit. With the errors of f32, a ray that leaves
//! a very thin triangle could hit the same triangle again.
//!
//! Instances and moving triangles have separate trees. Boxes bound all positions over time. obvhs's
//! CWBVH, whose nodes have eight quantised boxes, is not used. Nodes with four float boxes have the
//! same gain over a binary hierarchy (docs/notebook/2026-11.md, "Choice of BVH").

mod tree;
mod watertight;
mod wide;

use super::{Accel, BackendInfo};
use crate::geometry::{GeomId, Hit, InstanceId, Placement, PrimId};
use crate::math::{Affine3A, Bounds3, Ray};
use crate::scene::Scene;
use std::ops::Range;
use tree::{Leaf, Tree};
use watertight::{MovingTriangleLeaf, ShearedRay, TriangleLeaf};

/// Name of the backend on the command line.
pub const NAME: &str = "obvhs";
/// Version of the crate that builds the hierarchy, as in Cargo.toml.
pub const VERSION: &str = "0.4";

/// Hierarchies of axis-aligned boxes: one over the triangles in world space, one over the
/// instances, and for each prototype one over its triangles, in the space of the prototype.
pub struct BvhAccel {
    world_shapes: Shapes,
    prototypes: Vec<Shapes>,
    instances: Tree<InstanceLeaf>,
    placements: Vec<Placement>,
}

/// Triangles in one space: a tree of still triangles, and a tree of moving triangles.
struct Shapes {
    still: Tree<TriangleLeaf>,
    moving: Tree<MovingTriangleLeaf>,
}

/// An instance of a prototype.
#[derive(Clone, Copy)]
struct InstanceLeaf {
    id: u32,
    prototype: u32,
    bounds: Bounds3,
    /// Transform from world space to the prototype's space; `None` if the instance moves.
    inverse: Option<Affine3A>,
}

impl Leaf for InstanceLeaf {
    fn bounds(&self) -> Bounds3 {
        self.bounds
    }
}

impl BvhAccel {
    /// Builds the hierarchies for `scene`, in the current rayon pool.
    pub fn new(scene: &Scene) -> Self {
        let bounds = |meshes: &Range<u32>| -> Bounds3 {
            let meshes = meshes.clone().map(|geom| scene.mesh(GeomId(geom)));
            meshes
                .flat_map(|m| m.positions.iter().chain(&m.positions_close).copied())
                .collect()
        };
        let of_prototypes: Vec<Bounds3> = scene.prototypes().iter().map(bounds).collect();
        let instances: Vec<InstanceLeaf> = (0..)
            .zip(scene.instances())
            .map(|(id, instance)| InstanceLeaf {
                id,
                prototype: instance.prototype,
                bounds: instance.placement.bounds(of_prototypes[instance.prototype as usize]),
                inverse: (!instance.placement.is_moving()).then(|| instance.placement.at(0.0).inverse()),
            })
            .filter(|instance| !instance.bounds.is_empty())
            .collect();
        Self {
            world_shapes: Shapes::new(scene, scene.world_meshes()),
            prototypes: scene
                .prototypes()
                .iter()
                .map(|p| Shapes::new(scene, p.clone()))
                .collect(),
            instances: Tree::new(&instances),
            placements: scene.instances().iter().map(|i| i.placement.clone()).collect(),
        }
    }

    /// Returns `ray` in the space of the instance's prototype. The interval of the returned ray
    /// ends at `t_max`. A point on the ray has the same ray parameter in both spaces.
    fn in_prototype(&self, instance: &InstanceLeaf, ray: &Ray, t_max: f32) -> Ray {
        let placement = || self.placements[instance.id as usize].at(ray.time).inverse();
        let inverse = instance.inverse.unwrap_or_else(placement);
        Ray {
            origin: inverse.transform_point3a(ray.origin),
            direction: inverse.transform_vector3a(ray.direction),
            t_max,
            ..*ray
        }
    }
}

impl Shapes {
    fn new(scene: &Scene, meshes: Range<u32>) -> Self {
        let (mut still, mut moving) = (Vec::new(), Vec::new());
        for geom in meshes.map(GeomId) {
            let mesh = scene.mesh(geom);
            for prim in (0..mesh.triangles.len() as u32).map(PrimId) {
                let open = TriangleLeaf::new(mesh.corners(prim), geom, prim);
                if mesh.deforms() {
                    moving.push(MovingTriangleLeaf::new(open, mesh.corners_at_close(prim)))
                } else {
                    still.push(open)
                }
            }
        }
        Self {
            still: Tree::new(&still),
            moving: Tree::new(&moving),
        }
    }

    /// Closest hit before `t_max`. Sets `t_max` to the ray parameter of the hit.
    #[inline(always)]
    fn intersect(&self, ray: &Ray, t_max: &mut f32) -> Option<Hit> {
        let sheared = ShearedRay::new(ray);
        let mut closest = None;
        let mut visit = |triangle: &TriangleLeaf, t_max: &mut f32| {
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
        };
        self.still.walk(ray, t_max, &mut visit);
        self.moving
            .walk(ray, t_max, |moving, t_max| visit(&moving.at(ray.time), t_max));
        closest
    }

    /// Returns `true` if there is a hit before `t_max`.
    #[inline(always)]
    fn occluded(&self, ray: &Ray, t_max: f32) -> bool {
        let sheared = ShearedRay::new(ray);
        let meets = |triangle: &TriangleLeaf, t_max: &mut f32| sheared.intersect(triangle, ray.t_min, *t_max).is_some();
        self.still.walk(ray, &mut t_max.clone(), meets)
            || self.moving.walk(ray, &mut t_max.clone(), |moving, t_max| {
                meets(&moving.at(ray.time), t_max)
            })
    }

    fn bytes(&self) -> u64 {
        self.still.bytes() + self.moving.bytes()
    }
}

impl Accel for BvhAccel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut t_max = ray.t_max;
        let mut closest = self.world_shapes.intersect(ray, &mut t_max);
        self.instances.walk(ray, &mut t_max, |instance, t_max| {
            let inside = self.in_prototype(instance, ray, *t_max);
            if let Some(hit) = self.prototypes[instance.prototype as usize].intersect(&inside, t_max) {
                closest = Some(Hit {
                    inst: InstanceId(instance.id),
                    ..hit
                });
            }
            false
        });
        closest
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.world_shapes.occluded(ray, ray.t_max)
            || self.instances.walk(ray, &mut ray.t_max.clone(), |instance, t_max| {
                let inside = self.in_prototype(instance, ray, *t_max);
                self.prototypes[instance.prototype as usize].occluded(&inside, *t_max)
            })
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: NAME,
            version: VERSION.into(),
            isa: "sse2",
        }
    }

    fn bytes(&self) -> u64 {
        let prototypes: u64 = self.prototypes.iter().map(Shapes::bytes).sum();
        let placements = size_of_val(self.placements.as_slice()) as u64;
        self.world_shapes.bytes() + prototypes + self.instances.bytes() + placements
    }
}
