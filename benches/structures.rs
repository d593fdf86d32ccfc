//! Comparison of obvhs's hierarchies and builders: `cargo bench -p embrasure-benches --features
//! obvhs --bench structures`.
//!
//! The traversals of obvhs are measured with one plain triangle test. The backend of this project
//! is measured beside them. The backend traverses the binary hierarchy conservatively, and has a
//! watertight triangle test.

use criterion::{Criterion, Throughput};
use embrasure::accel::{Accel, bvh::BvhAccel};
use embrasure::geometry::PrimId;
use embrasure::math::Vec3;
use embrasure_benches::{bounces, scene};
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::Duration;

/// Distance to the hit, by the triangle test of Möller and Trumbore 1997, in f32.
fn intersect(ray: &Ray, t: &Triangle) -> f32 {
    let (e1, e2, s) = (t.v1 - t.v0, t.v2 - t.v0, ray.origin - t.v0);
    let (h, q) = (ray.direction.cross(e2), s.cross(e1));
    let inverse = 1.0 / e1.dot(h);
    let (u, v, t) = (s.dot(h) * inverse, ray.direction.dot(q) * inverse, e2.dot(q) * inverse);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > ray.tmin {
        t
    } else {
        f32::INFINITY
    }
}

fn structures(c: &mut Criterion) {
    for triangles in [36, 100_000, 1_000_000] {
        let scene = scene(triangles);
        let rays = bounces(&scene, 100_000);
        let corners: Vec<Triangle> = scene
            .meshes()
            .iter()
            .flat_map(|mesh| {
                (0..mesh.triangles.len() as u32).map(|i| {
                    let [v0, v1, v2]: [Vec3; 3] = mesh.corners(PrimId(i));
                    Triangle { v0, v1, v2 }
                })
            })
            .collect();
        let plain: Vec<Ray> = rays
            .iter()
            .map(|r| Ray::new(r.origin, r.direction, r.t_min, r.t_max))
            .collect();
        let mut group = c.benchmark_group(format!("{triangles} triangles"));
        group
            .throughput(Throughput::Elements(rays.len() as u64))
            .sample_size(10);

        let builders = [
            ("medium", BvhBuildParams::medium_build()),
            ("slow", BvhBuildParams::slow_build()),
            ("very slow", BvhBuildParams::very_slow_build()),
        ];
        for (name, parameters) in builders {
            let bvh2 = build_bvh2_from_tris(&corners, parameters, &mut Duration::default());
            let sorted: Vec<Triangle> = bvh2.primitive_indices.iter().map(|&i| corners[i as usize]).collect();
            group.bench_function(format!("BVH2, {name} build"), |b| {
                b.iter(|| {
                    let hits = plain.iter().filter(|ray| {
                        bvh2.ray_traverse(**ray, &mut RayHit::none(), |ray, i| intersect(ray, &sorted[i]))
                    });
                    hits.count()
                });
            });
            let cwbvh = build_cwbvh_from_tris(&corners, parameters, &mut Duration::default());
            let sorted: Vec<Triangle> = cwbvh.primitive_indices.iter().map(|&i| corners[i as usize]).collect();
            group.bench_function(format!("CWBVH, {name} build"), |b| {
                b.iter(|| {
                    let hits = plain.iter().filter(|ray| {
                        cwbvh.ray_traverse(**ray, &mut RayHit::none(), |ray, i| intersect(ray, &sorted[i]))
                    });
                    hits.count()
                });
            });
        }
        let accel = BvhAccel::new(&scene);
        group.bench_function("the backend", |b| {
            b.iter(|| rays.iter().filter(|ray| accel.intersect(ray).is_some()).count());
        });
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args();
    structures(&mut criterion);
    criterion.final_summary();
}
