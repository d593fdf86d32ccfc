//! Brute-force backend: tests every triangle against every ray, in f64. It is slow, but so simple
//! that it is the reference for the other backends.

use super::{Accel, BackendInfo};
use crate::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, PrimId, crossing};
use crate::math::{DAffine3, DVec3, Ray, Vec3};
use crate::scene::Scene;

/// Name of the backend on the command line.
pub const NAME: &str = "brute";

/// Brute-force backend over the triangles of a borrowed scene.
#[derive(Clone, Copy, Debug)]
pub struct BruteForce<'a> {
    scene: &'a Scene,
}

/// Transform of `placement` at `time`, interpolated in f64.
fn placed(placement: &Placement, time: f64) -> DAffine3 {
    let steps = placement.steps();
    let Some(last) = steps.len().checked_sub(2) else {
        return steps[0].as_daffine3();
    };
    let place = time * (steps.len() - 1) as f64;
    let step = (place as usize).min(last);
    let [a, b] = [step, step + 1].map(|i| steps[i].as_daffine3());
    let t = place - step as f64;
    DAffine3 {
        matrix3: a.matrix3 * (1.0 - t) + b.matrix3 * t,
        translation: a.translation.lerp(b.translation, t),
    }
}

impl<'a> BruteForce<'a> {
    /// Brute force over all triangles of `scene`.
    pub fn new(scene: &'a Scene) -> Self {
        Self { scene }
    }

    fn hits(&self, ray: &Ray) -> impl Iterator<Item = Hit> + use<'a> {
        let (scene, ray, time) = (self.scene, *ray, ray.time as f64);
        let world_meshes = scene.world_meshes().map(|geom| (GeomId(geom), InstanceId::NONE, None));
        let instances = (0..).zip(scene.instances()).flat_map(move |(inst, instance)| {
            let placement = placed(&instance.placement, time);
            let meshes = scene.prototypes()[instance.prototype as usize].clone();
            meshes.map(move |geom| (GeomId(geom), InstanceId(inst), Some(placement)))
        });
        world_meshes.chain(instances).flat_map(move |(geom, inst, placement)| {
            let mesh = scene.mesh(geom);
            (0..mesh.triangles.len() as u32).map(PrimId).filter_map(move |prim| {
                let corners = corners_at(mesh, prim, time, placement.as_ref());
                let (t, b1, b2) = intersect_triangle(&ray, corners)?;
                Some(Hit {
                    t,
                    b1,
                    b2,
                    prim,
                    geom,
                    inst,
                })
            })
        })
    }
}

/// World-space corners of triangle `prim` at `time`. `placement` is the transform of the triangle's
/// instance at `time`.
fn corners_at(mesh: &Mesh, prim: PrimId, time: f64, placement: Option<&DAffine3>) -> [DVec3; 3] {
    let mut corners = mesh.corners(prim).map(Vec3::as_dvec3);
    if mesh.deforms() {
        for (open, close) in corners.iter_mut().zip(mesh.corners_at_close(prim)) {
            *open = open.lerp(close.as_dvec3(), time);
        }
    }
    match placement {
        Some(placement) => corners.map(|p| placement.transform_point3(p)),
        None => corners,
    }
}

/// Returns the ray parameter of a hit and the barycentrics of the second and third corner, computed
/// in f64. A ray through an edge hits the triangle.
fn intersect_triangle(ray: &Ray, corners: [DVec3; 3]) -> Option<(f32, f32, f32)> {
    let (t, b1, b2) = crossing(ray, corners)?;
    let inside = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0;
    // Test the rounded `t`, because it is the returned value. Otherwise a ray that continues from a
    // hit could find the same hit again.
    let t = t as f32;
    let in_range = t > ray.t_min && t < ray.t_max;
    (inside && in_range).then_some((t, b1 as f32, b2 as f32))
}

impl Accel for BruteForce<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.hits(ray).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.hits(ray).any(|_| true)
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: NAME,
            version: env!("CARGO_PKG_VERSION").into(),
            isa: "scalar",
        }
    }

    fn bytes(&self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    fn ray(x: f32, y: f32) -> Ray {
        Ray::new(Vec3::new(x, y, 2.0), Vec3::new(0.0, 0.0, -2.0))
    }

    #[test]
    fn ray_parameters_are_multiples_of_direction_length() {
        assert_eq!(intersect_triangle(&ray(0.25, 0.5), CORNERS), Some((1.0, 0.25, 0.5)));
    }

    #[test]
    fn the_interval_is_open_and_edges_belong_to_the_triangle() {
        let r = ray(0.25, 0.5);
        assert!(intersect_triangle(&Ray { t_max: 1.0, ..r }, CORNERS).is_none());
        assert!(intersect_triangle(&Ray { t_min: 1.0, ..r }, CORNERS).is_none());
        assert!(intersect_triangle(&ray(0.5, 0.5), CORNERS).is_some());
        assert!(intersect_triangle(&ray(0.6, 0.5), CORNERS).is_none());
        assert!(intersect_triangle(&ray(-0.1, 0.5), CORNERS).is_none());
    }
}
