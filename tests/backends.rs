//! Embree against brute force, and rays against the surfaces they leave.
#![cfg(feature = "embree")]

mod support;

use embrasure::accel::Accel;
use embrasure::accel::brute::BruteForce;
use embrasure::accel::embree::EmbreeAccel;
use embrasure::geometry::{GeomId, Mesh, PrimId, offset_origin, ray_between, ray_towards};
use embrasure::math::{Ray, Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp::{uniform_sphere, uniform_triangle};
use embrasure::scene::{Scene, SceneBuilder};
use support::*;

/// Reproducible random numbers: `at(i, k)` is the k-th pair of item `i`.
fn at(i: u32, k: u32) -> Vec2 {
    let mut s = Independent::new(42);
    s.start(SampleKey::new(i, k, 0));
    s.get_2d(Dimension::bounce(0, Bounce::Direction))
}

fn scene_of(meshes: Vec<Mesh>) -> Scene {
    let mut b = SceneBuilder::new();
    for mesh in meshes {
        add(&mut b, mesh, material(0.5, 0.0));
    }
    b.build().unwrap().0
}

/// Random triangles in the unit cube, of size `size`.
fn soup(n: u32, size: f32) -> Mesh {
    let corner = |i| {
        let (a, b) = (at(i, 0), at(i, 1));
        Vec3::new(a.x, a.y, b.x)
    };
    let triangle = |i| {
        let p = corner(i);
        [
            p,
            p + size * uniform_sphere(at(i, 2)),
            p + size * uniform_sphere(at(i, 3)),
        ]
    };
    Mesh {
        positions: (0..n).flat_map(triangle).collect(),
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
    }
}

#[test]
fn closest_hits_and_occlusion_agree() {
    let scene = scene_of(vec![soup(500, 0.2), room(), sphere(0.3, Vec3::splat(0.5), 3)]);
    let (embree, brute) = (EmbreeAccel::new(&scene, 1).unwrap(), BruteForce::new(&scene));
    let (mut hits, mut differ) = (0, Vec::new());
    let n = 20_000;
    for i in 0..n {
        let (a, b) = (at(i, 4), at(i, 5));
        let origin = 3.0 * Vec3::new(a.x, a.y, b.x) - Vec3::ONE;
        let ray = Ray {
            t_max: if i % 3 == 0 { 0.7 } else { f32::INFINITY },
            ..Ray::new(origin, uniform_sphere(at(i, 6)))
        };
        let (e, b) = (embree.intersect(&ray), brute.intersect(&ray));
        let agree = match (e, b) {
            (None, None) => true,
            // Coordinates up to 3, a few roundings: where the triangles differ, the crossings are one point.
            (Some(e), Some(b)) => {
                hits += 1;
                (e.t - b.t).abs() < 1e-5
            }
            _ => false,
        };
        if !agree || embree.occluded(&ray) != b.is_some() {
            differ.push((ray, e, b));
        }
    }
    assert!(hits > n / 4, "only {hits} hits");
    assert!(
        differ.len() <= 1,
        "{} of {n} rays differ, the first: {:?}",
        differ.len(),
        differ.first()
    );
}

#[test]
fn hits_name_the_point_by_their_barycentrics() {
    let scene = scene_of(vec![soup(50, 0.5), soup(80, 0.4)]);
    let embree = EmbreeAccel::new(&scene, 1).unwrap();
    let mut checked = 0;
    for i in 0..2000 {
        let (a, b) = (at(i, 7), at(i, 8));
        let ray = Ray::new(Vec3::splat(-0.5), Vec3::new(a.x, a.y, b.x) + 0.5);
        if let Some(hit) = embree.intersect(&ray) {
            let p = scene.surface_point(&hit).p;
            let along = ray.origin + hit.t * ray.direction;
            assert!(p.distance(along) < 2e-5, "{p} against {along}");
            checked += 1;
        }
    }
    assert!(checked > 100);
}

#[test]
fn an_empty_scene_has_no_hits() {
    let scene = SceneBuilder::new().build().unwrap().0;
    let embree = EmbreeAccel::new(&scene, 1).unwrap();
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    assert!(embree.intersect(&ray).is_none() && !embree.occluded(&ray));
}

/// Triangles of every size and place: rays that leave them must not find them again, on either side.
#[test]
fn rays_do_not_meet_the_surface_they_left() {
    for i in 0..1000 {
        let scale = 10f32.powi(i as i32 % 17 - 8);
        let place = [Vec3::ZERO, Vec3::ONE, Vec3::new(100.0, -3.0, 20.0)][i as usize % 3];
        let mut corners = [0, 1, 2].map(|k| scale * (uniform_sphere(at(i, 10 + k)) + place));
        // Axis-aligned ones too, through the origin or beside it.
        if i % 4 == 0 {
            corners = corners.map(|p| p.with_y(if i % 8 == 0 { 0.0 } else { scale }));
        }
        let scene = scene_of(vec![polygon(&corners)]);
        if scene.triangle_count() == 0 {
            continue;
        }
        let accel = EmbreeAccel::new(&scene, 1).unwrap();
        for k in 0..32 {
            let (b1, b2) = uniform_triangle(at(i, 20 + k));
            let s = scene.meshes()[0].surface_point(PrimId(0), b1, b2);
            let w = uniform_sphere(at(i, 60 + k));
            let ray = ray_towards(&s, w);
            assert!(
                accel.intersect(&ray).is_none() && !accel.occluded(&ray),
                "scale {scale}, triangle {i}: {ray:?}"
            );
        }
    }
}

/// Segments between points of two facing surfaces are free, at every scale.
#[test]
fn shadow_rays_meet_neither_end() {
    for exponent in -6..=6 {
        let scale = 10f32.powi(exponent);
        let below = [Vec3::ZERO, Vec3::Z, Vec3::new(1.0, 0.0, 0.3)].map(|p| p * scale);
        let above = [
            Vec3::new(0.0, 0.7, 0.0),
            Vec3::new(1.0, 0.9, 0.2),
            Vec3::new(0.1, 0.7, 1.0),
        ]
        .map(|p| p * scale);
        let scene = scene_of(vec![polygon(&below), polygon(&above)]);
        let accel = EmbreeAccel::new(&scene, 1).unwrap();
        for i in 0..500 {
            let point = |geom: GeomId, u| {
                let (b1, b2) = uniform_triangle(u);
                scene.meshes()[geom.0 as usize].surface_point(PrimId(0), b1, b2)
            };
            let (p, q) = (point(GeomId(0), at(i, 90)), point(GeomId(1), at(i, 91)));
            let ray = ray_between(&p, offset_origin(&q, p.p - q.p));
            assert!(!accel.occluded(&ray), "scale {scale}: {ray:?}");
        }
    }
}

#[test]
fn scenes_give_their_memory_back() {
    let scene = scene_of(vec![soup(1000, 0.1)]);
    let bytes = EmbreeAccel::new(&scene, 1).unwrap().bytes();
    assert!(
        bytes > 1000 * 20 && bytes < 1000 * 1000,
        "{bytes} bytes for 1000 triangles"
    );
    for _ in 0..50 {
        assert_eq!(EmbreeAccel::new(&scene, 1).unwrap().bytes(), bytes);
    }
}
