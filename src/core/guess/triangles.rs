use crate::geometry::{GeomId, InstanceId, Mesh, PrimId, triangle_area, triangle_normal};
use crate::math::{Affine3A, Vec2, Vec3};
use crate::scene::Scene;

/// A triangle of the world at time 0.
pub(super) struct Triangle {
    /// Number that identifies the triangle.
    pub name: u64,
    pub corners: [Vec3; 3],
    /// Unit normal from its winding; zero without area.
    pub normal: Vec3,
    pub area: f64,
    /// Texture coordinates of the corners; `None` without them.
    pub uvs: Option<[Vec2; 3]>,
    pub material: u32,
    /// Part, as an index of the scene's part names.
    pub part: u32,
}

/// Number that identifies a triangle of a scene. Triangles of instances have different numbers.
pub(super) fn name(geom: GeomId, prim: PrimId, inst: InstanceId) -> u64 {
    (u64::from(geom.0) << 32 | u64::from(prim.0)) ^ u64::from(inst.0).rotate_right(20)
}

/// Calls `visit` with at most `max` triangles of the world, including instances, without the
/// ground. If the world has more triangles, they are evenly spread in the scene's order.
pub(super) fn for_each_triangle(scene: &Scene, max: u64, mut visit: impl FnMut(&Triangle)) {
    let stride = scene.placed_triangle_count().div_ceil(max).max(1);
    let mut next = 0;
    let mut visit_mesh = |geom: GeomId, inst: InstanceId, placement: Option<&Affine3A>| {
        let mesh: &Mesh = scene.mesh(geom);
        let count = mesh.triangles.len() as u64;
        while next < count {
            let corners = mesh.corners(PrimId(next as u32));
            let corners = match placement {
                Some(placement) => corners.map(|p| placement.transform_point3a(p)),
                None => corners,
            };
            let [p0, p1, p2] = corners;
            visit(&Triangle {
                name: name(geom, PrimId(next as u32), inst),
                corners,
                normal: triangle_normal(p0, p1, p2),
                area: triangle_area(p0, p1, p2),
                uvs: (!mesh.uvs.is_empty()).then(|| mesh.triangles[next as usize].map(|i| mesh.uvs[i as usize])),
                material: scene.shape(geom).material.0,
                part: mesh.part(PrimId(next as u32)),
            });
            next += stride;
        }
        next -= count;
    };
    let ground = scene.ground().map(|ground| ground.geom().0);
    for geom in scene.world_meshes().filter(|geom| Some(*geom) != ground) {
        visit_mesh(GeomId(geom), InstanceId::NONE, None);
    }
    for (inst, instance) in (0..).map(InstanceId).zip(scene.instances()) {
        let placement = instance.placement.at(0.0);
        for geom in scene.prototypes()[instance.prototype as usize].clone() {
            visit_mesh(GeomId(geom), inst, Some(&placement));
        }
    }
}
