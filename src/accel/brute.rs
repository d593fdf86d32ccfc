//! Every triangle against every ray: slow, and simple enough to be right. The oracle for the other backends.

use super::{Accel, BackendInfo};
use crate::geometry::{GeomId, Hit, InstanceId, Placement, PrimId};
use crate::math::{DAffine3, DVec3, Ray, Vec3};
use crate::scene::Scene;

/// The name users type.
pub const NAME: &str = "brute";

/// All triangles of a scene in a row.
#[derive(Clone, Debug)]
pub struct BruteForce {
    triangles: Vec<Triangle>,
    /// By [`InstanceId`].
    placements: Vec<Placement>,
}

#[derive(Clone, Debug)]
struct Triangle {
    corners: [Vec3; 3],
    /// Where they are at time 1.
    close: Option<[Vec3; 3]>,
    geom: GeomId,
    prim: PrimId,
    inst: InstanceId,
}

impl Triangle {
    /// Corners at `time` in the world, `placement` being where its instance is then.
    fn at(&self, time: f64, placement: Option<&DAffine3>) -> [DVec3; 3] {
        let mut corners = self.corners.map(Vec3::as_dvec3);
        if let Some(close) = self.close {
            for (open, close) in corners.iter_mut().zip(close) {
                *open = open.lerp(close.as_dvec3(), time);
            }
        }
        match placement {
            Some(placement) => corners.map(|p| placement.transform_point3(p)),
            None => corners,
        }
    }
}

/// Where the instance is at `time`, in f64.
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

impl BruteForce {
    /// Copies the triangles of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let standing = scene.standing().map(|geom| (geom, InstanceId::NONE));
        let instances = scene.instances().iter().enumerate().flat_map(|(inst, instance)| {
            let geoms = scene.prototypes()[instance.prototype as usize].clone();
            geoms.map(move |geom| (geom, InstanceId(inst as u32)))
        });
        let triangles = standing.chain(instances).flat_map(|(geom, inst)| {
            let (geom, mesh) = (GeomId(geom), scene.mesh(GeomId(geom)));
            (0..mesh.triangles.len() as u32).map(PrimId).map(move |prim| Triangle {
                corners: mesh.corners(prim),
                close: mesh.deforms().then(|| mesh.corners_at_close(prim)),
                geom,
                prim,
                inst,
            })
        });
        Self {
            triangles: triangles.collect(),
            placements: scene.instances().iter().map(|i| i.placement.clone()).collect(),
        }
    }

    fn hits(&self, ray: &Ray) -> impl Iterator<Item = Hit> {
        let (ray, time) = (*ray, ray.time as f64);
        let placements: Vec<DAffine3> = self.placements.iter().map(|p| placed(p, time)).collect();
        self.triangles.iter().filter_map(move |triangle| {
            let corners = triangle.at(time, placements.get(triangle.inst.0 as usize));
            let (t, b1, b2) = intersect_triangle(&ray, corners)?;
            Some(Hit {
                t,
                b1,
                b2,
                prim: triangle.prim,
                geom: triangle.geom,
                inst: triangle.inst,
            })
        })
    }
}

/// Ray parameter and barycentrics of the crossing, in f64 (Möller and Trumbore 1997). Edges belong to the triangle.
fn intersect_triangle(ray: &Ray, [p0, p1, p2]: [DVec3; 3]) -> Option<(f32, f32, f32)> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, s) = (p1 - p0, p2 - p0, origin - p0);
    let (h, q) = (direction.cross(e2), s.cross(e1));
    let determinant = e1.dot(h);
    if determinant == 0.0 {
        return None;
    }
    let (b1, b2) = (s.dot(h) / determinant, direction.dot(q) / determinant);
    let inside = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0;
    // The parameter that is told is the one that is compared: a ray that goes on behind it must not find it again.
    let t = (e2.dot(q) / determinant) as f32;
    let in_range = t > ray.t_min && t < ray.t_max;
    (inside && in_range).then_some((t, b1 as f32, b2 as f32))
}

impl Accel for BruteForce {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.hits(ray).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.hits(ray).next().is_some()
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: NAME,
            version: env!("CARGO_PKG_VERSION").into(),
            isa: "scalar",
        }
    }

    fn bytes(&self) -> u64 {
        size_of_val(self.triangles.as_slice()) as u64
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
    fn parameters_count_in_lengths_of_the_direction() {
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
