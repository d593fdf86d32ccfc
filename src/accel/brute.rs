//! Every triangle against every ray: slow, and simple enough to be right. The oracle for the other backends.

use super::{Accel, BackendInfo};
use crate::geometry::{GeomId, Hit, InstanceId, PrimId};
use crate::math::{Ray, Vec3};
use crate::scene::Scene;

/// The name users type.
pub const NAME: &str = "brute";

/// All triangles of a scene in a row.
#[derive(Clone, Debug)]
pub struct BruteForce {
    triangles: Vec<Triangle>,
}

#[derive(Clone, Debug)]
struct Triangle {
    corners: [Vec3; 3],
    geom: GeomId,
    prim: PrimId,
}

impl BruteForce {
    /// Copies the triangles of `scene`.
    pub fn new(scene: &Scene) -> Self {
        let triangles = scene
            .geom_ids()
            .zip(scene.meshes())
            .flat_map(|(geom, mesh)| {
                (0..mesh.triangles.len() as u32).map(PrimId).map(move |prim| Triangle {
                    corners: mesh.corners(prim),
                    geom,
                    prim,
                })
            })
            .collect();
        Self { triangles }
    }

    fn hits(&self, ray: &Ray) -> impl Iterator<Item = Hit> {
        let ray = *ray;
        self.triangles.iter().filter_map(move |triangle| {
            let (t, b1, b2) = intersect_triangle(&ray, triangle.corners)?;
            Some(Hit {
                t,
                b1,
                b2,
                prim: triangle.prim,
                geom: triangle.geom,
                inst: InstanceId::NONE,
            })
        })
    }
}

/// Ray parameter and barycentrics of the crossing, in f64 (Möller and Trumbore 1997). Edges belong to the triangle.
fn intersect_triangle(ray: &Ray, corners: [Vec3; 3]) -> Option<(f32, f32, f32)> {
    let [p0, p1, p2] = corners.map(Vec3::as_dvec3);
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, s) = (p1 - p0, p2 - p0, origin - p0);
    let (h, q) = (direction.cross(e2), s.cross(e1));
    let determinant = e1.dot(h);
    if determinant == 0.0 {
        return None;
    }
    let (t, b1, b2) = (
        e2.dot(q) / determinant,
        s.dot(h) / determinant,
        direction.dot(q) / determinant,
    );
    let inside = b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0;
    let in_range = t > ray.t_min as f64 && t < ray.t_max as f64;
    (inside && in_range).then_some((t as f32, b1 as f32, b2 as f32))
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

    const CORNERS: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

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
