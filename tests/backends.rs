//! The backends against brute force, and rays against the surfaces they leave.
#![cfg(any(feature = "embree", feature = "obvhs"))]

mod support;

use embrasure::accel::Accel;
use embrasure::accel::brute::BruteForce;
use embrasure::geometry::{GeomId, Mesh, PrimId, offset_origin, ray_between, ray_towards};
use embrasure::math::{Ray, Vec2, Vec3};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp::{uniform_sphere, uniform_triangle};
use embrasure::scene::{Scene, SceneBuilder};
use support::*;

/// Every backend that is built in, besides the oracle.
fn backends(scene: &Scene) -> Vec<Box<dyn Accel + '_>> {
    vec![
        #[cfg(feature = "embree")]
        Box::new(embrasure::accel::embree::EmbreeAccel::new(scene, 1).unwrap()),
        #[cfg(feature = "obvhs")]
        Box::new(embrasure::accel::bvh::BvhAccel::new(scene)),
    ]
}

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

/// Traces `rays` by every backend and by brute force: hit or miss must agree, and distances within `tolerance`, but for
/// `budget` rays in all.
fn assert_agree(what: &str, scene: &Scene, rays: &[Ray], tolerance: impl Fn(&Ray, f32) -> f32, budget: usize) {
    let brute = BruteForce::new(scene);
    let expected: Vec<_> = rays.iter().map(|ray| brute.intersect(ray)).collect();
    for backend in backends(scene) {
        let name = backend.info().name;
        let mut differ = Vec::new();
        for (ray, oracle) in rays.iter().zip(&expected) {
            let hit = backend.intersect(ray);
            // Where the triangles differ, the crossings are one point.
            let agree = match (hit, oracle) {
                (None, None) => true,
                (Some(hit), Some(oracle)) => (hit.t - oracle.t).abs() <= tolerance(ray, oracle.t),
                _ => false,
            };
            if !agree || backend.occluded(ray) != oracle.is_some() {
                differ.push((ray, hit, oracle));
            }
        }
        let count = differ.len();
        println!("{what}, {name}: {count} of {} rays differ", rays.len());
        assert!(
            count <= budget,
            "{what}, {name}: {count} of {} rays differ, the first: {:?}",
            rays.len(),
            differ.first()
        );
    }
}

#[test]
fn closest_hits_and_occlusion_agree() {
    let scene = scene_of(vec![soup(500, 0.2), room(), sphere(0.3, Vec3::splat(0.5), 3)]);
    let ray = |i| {
        let (a, b) = (at(i, 4), at(i, 5));
        let origin = 3.0 * Vec3::new(a.x, a.y, b.x) - Vec3::ONE;
        Ray {
            t_max: if i % 3 == 0 { 0.7 } else { f32::INFINITY },
            ..Ray::new(origin, uniform_sphere(at(i, 6)))
        }
    };
    let rays: Vec<Ray> = (0..20_000).map(ray).collect();
    // Coordinates up to 3, a few roundings
    assert_agree("random", &scene, &rays, |_, _| 1e-5, 1);
}

#[test]
fn rays_along_the_axes_agree() {
    let scene = scene_of(vec![soup(300, 0.3), room()]);
    let ray = |i: u32| {
        let (a, b) = (at(i, 14), at(i, 15));
        let axis = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3];
        let origin = 1.8 * Vec3::new(a.x, a.y, b.x) - 0.9;
        // Some start on the planes of the room's faces, beside it
        let origin = if i % 5 == 0 {
            origin.with_y(1.0) + 3.0 * Vec3::X
        } else {
            origin
        };
        Ray::new(origin, if i % 2 == 0 { axis } else { -axis })
    };
    let rays: Vec<Ray> = (0..6_000).map(ray).collect();
    // A ray in the plane of a face may or may not meet it.
    let rays: Vec<Ray> = rays
        .into_iter()
        .filter(|r| r.origin.abs().max_element() < 1.0 || r.direction.y != 0.0)
        .collect();
    assert_agree("along axes", &scene, &rays, |_, _| 1e-5, 1);
}

/// Rays at corners and edges of a closed sphere, from inside: each hits, whichever triangle it is given to.
#[test]
fn nothing_leaks_at_edges_and_corners() {
    for (scale, place) in [
        (2.0, Vec3::ZERO),
        (2e-6, Vec3::ZERO),
        (2e6, Vec3::ZERO),
        (2.0, Vec3::splat(300.0)),
    ] {
        let mesh = sphere(scale, place, 3);
        let scene = scene_of(vec![mesh.clone()]);
        for backend in backends(&scene) {
            let mut missed = Vec::new();
            for (i, corners) in mesh.triangles.iter().enumerate() {
                let [p, q, r] = corners.map(|k| mesh.positions[k as usize]);
                let u = at(i as u32, 16).x;
                for target in [p, q, r, p.lerp(q, u), q.lerp(r, u), r.lerp(p, u), (p + q + r) / 3.0] {
                    let origin = place + 0.3 * scale * uniform_sphere(at(i as u32, 17));
                    let ray = Ray::new(origin, target - origin);
                    if backend.intersect(&ray).is_none() {
                        missed.push(ray);
                    }
                }
            }
            let (name, n) = (backend.info().name, 7 * mesh.triangles.len());
            println!("{name}, scale {scale} at {place}: {} of {n} rays missed", missed.len());
            assert!(
                missed.len() <= n / 1000,
                "{name}, scale {scale} at {place}: {:?}",
                missed.first()
            );
        }
    }
}

/// A million random directions from inside a closed sphere.
#[test]
fn a_closed_sphere_is_closed() {
    let scene = scene_of(vec![sphere(2.0, Vec3::ZERO, 4)]);
    for backend in backends(&scene) {
        let missed = (0..1_000_000).filter(|&i| {
            let ray = Ray::new(Vec3::new(0.1, -0.2, 0.3), uniform_sphere(at(i, 18)));
            backend.intersect(&ray).is_none()
        });
        assert_eq!(missed.count(), 0, "{}", backend.info().name);
    }
}

#[test]
fn hits_name_the_point_by_their_barycentrics() {
    let scene = scene_of(vec![soup(50, 0.5), soup(80, 0.4)]);
    for backend in backends(&scene) {
        let mut checked = 0;
        for i in 0..2000 {
            let (a, b) = (at(i, 7), at(i, 8));
            let ray = Ray::new(Vec3::splat(-0.5), Vec3::new(a.x, a.y, b.x) + 0.5);
            if let Some(hit) = backend.intersect(&ray) {
                let p = scene.surface_point(&hit).p;
                let along = ray.origin + hit.t * ray.direction;
                assert!(p.distance(along) < 2e-5, "{p} against {along}");
                checked += 1;
            }
        }
        assert!(checked > 100);
    }
}

#[test]
fn an_empty_scene_has_no_hits() {
    let scene = SceneBuilder::new().build().unwrap().0;
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    for backend in backends(&scene) {
        assert!(backend.intersect(&ray).is_none() && !backend.occluded(&ray));
    }
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
        for accel in backends(&scene) {
            for k in 0..32 {
                let (b1, b2) = uniform_triangle(at(i, 20 + k));
                let s = scene.meshes()[0].surface_point(PrimId(0), b1, b2);
                let w = uniform_sphere(at(i, 60 + k));
                let ray = ray_towards(&s, w);
                assert!(
                    accel.intersect(&ray).is_none() && !accel.occluded(&ray),
                    "{}, scale {scale}, triangle {i}: {ray:?}",
                    accel.info().name
                );
            }
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
        let accels = backends(&scene);
        for i in 0..500 {
            let point = |geom: GeomId, u| {
                let (b1, b2) = uniform_triangle(u);
                scene.meshes()[geom.0 as usize].surface_point(PrimId(0), b1, b2)
            };
            let (p, q) = (point(GeomId(0), at(i, 90)), point(GeomId(1), at(i, 91)));
            let ray = ray_between(&p, offset_origin(&q, p.p - q.p));
            for accel in &accels {
                assert!(!accel.occluded(&ray), "{}, scale {scale}: {ray:?}", accel.info().name);
            }
        }
    }
}

#[test]
fn scenes_give_their_memory_back() {
    let scene = scene_of(vec![soup(1000, 0.1)]);
    for (i, accel) in backends(&scene).iter().enumerate() {
        let bytes = accel.bytes();
        assert!(
            bytes > 1000 * 20 && bytes < 1000 * 1000,
            "{bytes} bytes for 1000 triangles"
        );
        for _ in 0..50 {
            assert_eq!(backends(&scene)[i].bytes(), bytes);
        }
    }
}

/// Rays through real rooms and meshes: Embree and obvhs against each other, where brute force would take too long.
#[cfg(all(feature = "embree", feature = "obvhs"))]
#[test]
fn backends_agree_on_real_scenes() {
    use embrasure::accel::{bvh::BvhAccel, embree::EmbreeAccel};
    use embrasure::io::{SceneFile, load_scene};
    let Some(folder) = shared("scenes") else { return };
    const RAYS: u32 = 200_000;
    for name in [
        "cornell-box-mcguire/CornellBox-Water.obj",
        "sponza-dabrovic/sponza.obj",
        "meshes/stanford-bunny.obj",
        "meshes/teapot.obj",
        "meshes/nefertiti.obj",
    ] {
        let file = SceneFile::of_obj(&folder.join(name));
        let scene = load_scene(&file, SceneBuilder::new()).unwrap().scene;
        let (embree, bvh) = (EmbreeAccel::new(&scene, 2).unwrap(), BvhAccel::new(&scene));
        let (center, radius) = (scene.bounds().center(), scene.bounds().radius());
        let (mut hits, mut differ) = (0, Vec::new());
        for i in 0..RAYS {
            // From within the bounding sphere, and from outside towards a point within
            let inner = center + 0.7 * radius * at(i, 30).x * uniform_sphere(at(i, 31));
            let ray = if i % 2 == 0 {
                Ray::new(inner, uniform_sphere(at(i, 32)))
            } else {
                let from = center + 2.0 * radius * uniform_sphere(at(i, 32));
                Ray::new(from, (inner - from).normalize())
            };
            let (e, b) = (embree.intersect(&ray), bvh.intersect(&ray));
            let agree = match (e, b) {
                (None, None) => true,
                (Some(e), Some(b)) => {
                    hits += 1;
                    // Some ten roundings of the coordinates, which grazing incidence and slivers make longer
                    let p = scene.surface_point(&e);
                    let cos = ray.direction.dot(p.ng).abs().max(1e-3);
                    (e.t - b.t).abs() <= 1e-5 * (ray.origin.abs().max_element() + radius) / cos
                }
                _ => false,
            };
            let same_occlusion = embree.occluded(&ray) == e.is_some() && bvh.occluded(&ray) == b.is_some();
            if !agree || !same_occlusion {
                differ.push((ray, e, b));
            }
        }
        println!("{name}: {} of {RAYS} rays differ, {hits} hits", differ.len());
        assert!(hits > RAYS / 10, "{name}: only {hits} hits");
        // One ray in 10⁵; Embree lets some through at corners (embree issues 174, 181, 387, 423).
        assert!(
            differ.len() <= 2,
            "{name}: {} of {RAYS} rays differ: {:?}",
            differ.len(),
            &differ[..3.min(differ.len())]
        );
    }
}
