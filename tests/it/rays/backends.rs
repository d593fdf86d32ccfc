//! Backends against brute force, and rays against the surfaces they leave.
#![cfg(any(feature = "embree", feature = "obvhs"))]

use crate::support::*;
use embrasure::accel::brute::BruteForce;
use embrasure::accel::{Accel, BackendInfo, Cause, Crossing, Disagreement, Query, QueryKind, compare};
use embrasure::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, PrimId, offset_origin, ray_between, ray_towards};
use embrasure::light_sampling::LightChoice;
use embrasure::math::{Affine3A, Ray, Vec2, Vec3, Vec3Swizzles, affine_from_trs};
use embrasure::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use embrasure::sampling::warp::{uniform_sphere, uniform_triangle};
use embrasure::scene::{Scene, SceneBuilder};
use std::collections::HashMap;
use std::sync::Mutex;

/// All backends of this build except brute force.
fn backends(scene: &Scene) -> Vec<Box<dyn Accel + '_>> {
    vec![
        #[cfg(feature = "embree")]
        Box::new(embrasure::accel::embree::EmbreeAccel::new(scene, 1).unwrap()),
        #[cfg(feature = "obvhs")]
        Box::new(embrasure::accel::bvh::BvhAccel::new(scene)),
    ]
}

/// Backends by name; Embree with each instruction set that this machine supports.
fn backends_by_isa(scene: &Scene) -> Vec<(String, Box<dyn Accel + '_>)> {
    let mut named: Vec<(String, Box<dyn Accel + '_>)> = Vec::new();
    #[cfg(all(feature = "embree", target_arch = "x86_64"))]
    {
        use embrasure::accel::embree::{Device, EmbreeAccel};
        let has = |isa: &str| match isa {
            "avx512" => has_avx512(),
            "avx2" => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            _ => true,
        };
        for isa in Device::ISAS.into_iter().filter(|isa| has(isa)) {
            let device = Device::with_isa(1, isa).unwrap();
            named.push((
                format!("embree {isa}"),
                Box::new(EmbreeAccel::on(device, scene).unwrap()),
            ));
        }
    }
    for backend in backends(scene) {
        named.push((backend.info().name.into(), backend));
    }
    named
}

#[cfg(target_arch = "x86_64")]
#[allow(dead_code, reason = "Embree alone is told what to use")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512cd")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512vl")
}

/// Reproducible random numbers: `at(i, k)` is pair `k` of item `i`.
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
        ..Mesh::default()
    }
}

/// Brute force with a cache of its results, because it is slow and each backend is compared with
/// it.
struct Oracle<'a> {
    brute: BruteForce<'a>,
    hits: Mutex<HashMap<[u32; 9], Option<Hit>>>,
    occluded: Mutex<HashMap<[u32; 9], bool>>,
}

impl Accel for Oracle<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let mut hits = self.hits.lock().unwrap();
        *hits.entry(ray.bits()).or_insert_with(|| self.brute.intersect(ray))
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut occluded = self.occluded.lock().unwrap();
        *occluded.entry(ray.bits()).or_insert_with(|| self.brute.occluded(ray))
    }

    fn info(&self) -> BackendInfo {
        self.brute.info()
    }

    fn bytes(&self) -> u64 {
        self.brute.bytes()
    }
}

/// Compares each pair of backends, including brute force. Fails if more than `budget` disagreements
/// of a pair exceed the rounding error. Each disagreement is printed as bits for `Ray::from_bits`.
fn assert_agree(what: &str, scene: &Scene, rays: &[Ray], budget: usize) {
    let mut accels = backends(scene);
    accels.push(Box::new(Oracle {
        brute: BruteForce::new(scene),
        hits: Mutex::default(),
        occluded: Mutex::default(),
    }));
    for (i, first) in accels.iter().enumerate() {
        for second in &accels[i + 1..] {
            let (mut found, mut used, mut count) = (Vec::new(), [0f64; 2], 0);
            for ray in rays {
                let before = found.len();
                for kind in [QueryKind::Closest, QueryKind::Occlusion] {
                    let accels = [first.as_ref(), second.as_ref()];
                    let differs = compare(scene, accels, &Query { ray: *ray, kind });
                    // If two surfaces coincide, a hit on any of them is right.
                    found.extend(differs.filter(|d| d.cause != Cause::Coincident));
                }
                count += usize::from(found.len() > before);
                // Compute how much of the error bounds on distances and barycentrics is used
                if let Some(hit) = first.intersect(ray) {
                    let crossing = Crossing::new(scene, ray, &hit);
                    let (t, b) = crossing.errors();
                    let bounds = [crossing.t_error(), crossing.barycentric_error()];
                    // Barycentrics of triangles seen edge-on are undefined, so they are left out.
                    if bounds[1] < 0.1 {
                        used = [used[0].max(t / bounds[0]), used[1].max(b / bounds[1])];
                    }
                }
            }
            let names = [first.info().name, second.info().name].join(" and ");
            let (n, unexplained) = (rays.len(), |d: &&Disagreement| d.cause == Cause::Unexplained);
            println!(
                "{what}, {names}: {count} of {n} rays differ; distances and barycentrics use {used:.3?} of their bounds"
            );
            for d in found.iter().take(5) {
                println!("  {:?} {:x?} {:?}", d.cause, d.query.ray.bits(), d.answers);
            }
            assert_eq!(found.iter().find(unexplained), None, "{what}, {names}");
            assert!(count <= budget, "{what}, {names}: {count} of {n} rays differ");
        }
    }
}

/// Rays of five kinds at the triangles of `scene`: random, along axes, in or near the plane of a
/// triangle, at corners, at edges. There are ten times as many random rays as of each other kind.
fn rays_at(scene: &Scene, n: u32) -> [(&'static str, Vec<Ray>); 5] {
    let (center, radius) = (scene.bounds().center(), scene.bounds().radius());
    let triangles = all_triangles(scene);
    let time = |i: u32| if scene.is_moving() { at(i, 15).x } else { 0.0 };
    let start = |i| center + 1.5 * radius * at(i, 4).x.sqrt() * uniform_sphere(at(i, 5));
    let triangle = |i: u32| scene.corners(&triangles[i as usize % triangles.len()], time(i));
    let along = |from: Vec3, to: Vec3| Ray::new(from, (to - from).normalize_or(Vec3::Z));
    let random = |i: u32| {
        let reach = if i % 3 == 0 { 0.7 * radius } else { f32::INFINITY };
        Ray {
            t_max: reach,
            ..Ray::new(start(i), uniform_sphere(at(i, 6)))
        }
    };
    let axis = |i: u32| {
        let axis = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3];
        Ray::new(start(i), if i % 2 == 0 { axis } else { -axis })
    };
    let grazing = |i: u32| {
        let ([p, q, r], u) = (triangle(i), at(i, 7));
        let inside = p + 0.5 * u.x * (q - p) + 0.5 * u.y * (r - p);
        let direction = (q - p).lerp(r - p, 2.0 * at(i, 8).x - 0.5).normalize_or(Vec3::Z);
        let normal = (q - p).cross(r - p).normalize_or(Vec3::Z);
        let tilt = [0.0, 1e-7, 1e-5, 1e-3][i as usize % 4];
        Ray::new(inside - radius * direction, direction + tilt * normal)
    };
    let corner = |i: u32| along(start(i), triangle(i)[i as usize / 7 % 3]);
    let edge = |i: u32| {
        let corners = triangle(i);
        let k = i as usize / 7 % 3;
        along(start(i), corners[k].lerp(corners[(k + 1) % 3], at(i, 9).x))
    };
    let rays = |n: u32, ray: &dyn Fn(u32) -> Ray| (0..n).map(|i| ray(i).when(time(i))).collect();
    [
        ("random", rays(10 * n, &random)),
        ("along axes", rays(n, &axis)),
        ("grazing", rays(n, &grazing)),
        ("at corners", rays(n, &corner)),
        ("at edges", rays(n, &edge)),
    ]
}

/// First corner of each triangle in the world, in the form of a hit.
fn all_triangles(scene: &Scene) -> Vec<Hit> {
    let world_meshes = scene.world_meshes().map(|geom| (geom, InstanceId::NONE));
    let instances = scene.instances().iter().enumerate().flat_map(|(id, instance)| {
        let meshes = scene.prototypes()[instance.prototype as usize].clone();
        meshes.map(move |geom| (geom, InstanceId(id as u32)))
    });
    let hit = |geom: u32, inst: InstanceId, prim: u32| Hit {
        t: 0.0,
        b1: 0.0,
        b2: 0.0,
        prim: PrimId(prim),
        geom: GeomId(geom),
        inst,
    };
    let triangles = |geom: u32| 0..scene.mesh(GeomId(geom)).triangles.len() as u32;
    world_meshes
        .chain(instances)
        .flat_map(|(geom, inst)| triangles(geom).map(move |prim| hit(geom, inst, prim)))
        .collect()
}

/// A placement around `center` that rotates, stretches, shears and, for odd `i`, mirrors.
fn askew(i: u32, center: Vec3) -> Affine3A {
    let (a, b, c) = (at(i, 50), at(i, 51), at(i, 52));
    let stretch = Vec3::new(0.5 + a.x, 0.5 + a.y, if i % 2 == 1 { -0.7 } else { 1.3 });
    let turn = affine_from_trs(center, 360.0 * Vec3::new(b.x, b.y, c.x), stretch);
    turn * affine_from_trs(Vec3::ZERO, Vec3::new(0.0, 0.0, 40.0), Vec3::new(1.0, 1.5, 1.0))
}

/// Rotated and distorted copies of two prototypes beside a mesh in the world, within about 3 units
/// of `center`. Copies may move, and all meshes may deform.
fn copies(center: Vec3, is_moving: bool, deforms: bool) -> Scene {
    let mut b = SceneBuilder::new();
    let m = b.add_material(material(0.5, 0.0)).unwrap();
    let shape = |mesh: Mesh| match deforms {
        false => mesh,
        true => Mesh {
            positions_close: mesh
                .positions
                .iter()
                .map(|p| 1.3 * *p + 0.4 * p.length_squared())
                .collect(),
            ..mesh
        },
    };
    b.add_mesh(shape(moved(soup(80, 0.5), 2.0, center - 1.0)), m).unwrap();
    let parts = [
        vec![(shape(sphere(0.7, Vec3::ZERO, 1)), m)],
        vec![
            (shape(soup(40, 0.6)), m),
            (shape(moved(soup(40, 0.6), 0.5, Vec3::X)), m),
        ],
    ];
    let prototypes = parts.map(|part| b.add_prototype(part).unwrap());
    for i in 0..7 {
        let place = |k: u32| center + 2.0 * at(i, 53 + k).x.sqrt() * uniform_sphere(at(i, 55 + k));
        let placement = match is_moving && i != 3 {
            false => Placement::Still(askew(i, place(0))),
            // Some copies move along a straight line, and some along a path with a corner.
            true => Placement::Moving((0..2 + i % 3).map(|k| askew(i, place(k))).collect()),
        };
        b.add_instance(prototypes[i as usize % 2], placement).unwrap();
    }
    b.build().unwrap().0
}

/// A fan of `n` triangles around the origin, on a cone. Neighbours share an edge, and all triangles
/// share a corner.
fn fan(n: u32) -> Mesh {
    let rim = |i: u32| {
        let angle = std::f32::consts::TAU * i as f32 / n as f32;
        Vec3::new(angle.cos(), angle.sin(), 0.3)
    };
    Mesh {
        positions: std::iter::once(Vec3::ZERO).chain((0..n).map(rim)).collect(),
        triangles: (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect(),
        ..Mesh::default()
    }
}

/// Duplicate triangles, and coplanar triangles that overlap them.
fn coplanar() -> Mesh {
    let square = polygon(&[Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    let again = square.positions.iter().copied();
    let shifted = square.positions.iter().map(|p| 0.7 * *p + Vec3::new(0.2, 0.2, 0.0));
    Mesh {
        positions: square.positions.iter().copied().chain(again).chain(shifted).collect(),
        triangles: (0..3)
            .flat_map(|k| square.triangles.iter().map(move |t| t.map(|i| i + 4 * k)))
            .collect(),
        ..Mesh::default()
    }
}

/// Triangles whose width is 10⁻¹ to 10⁻⁶ times their length, in all directions.
fn slivers(n: u32) -> Mesh {
    let triangle = |i: u32| {
        let (p, d, e) = (
            uniform_sphere(at(i, 0)),
            uniform_sphere(at(i, 1)),
            uniform_sphere(at(i, 2)),
        );
        [p, p + d, p + 0.5 * d + 10f32.powi(-(1 + i as i32 % 6)) * e]
    };
    Mesh {
        positions: (0..n).flat_map(triangle).collect(),
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Mesh::default()
    }
}

/// Triangles without area (points or lines) among normal triangles.
fn degenerate() -> Mesh {
    let mut mesh = soup(60, 0.4);
    for (i, t) in (0..).zip(&mut mesh.triangles) {
        match i % 3 {
            0 => t[1] = t[0],
            1 => mesh.positions[t[2] as usize] = mesh.positions[t[0] as usize].midpoint(mesh.positions[t[1] as usize]),
            _ => {}
        }
    }
    mesh
}

fn moved(mesh: Mesh, scale: f32, place: Vec3) -> Mesh {
    Mesh {
        positions: mesh.positions.iter().map(|p| scale * *p + place).collect(),
        ..mesh
    }
}

#[test]
fn backends_agree_with_brute_force() {
    let rays = budget(10_000);
    let far = |x: f32| Vec3::new(x, -0.7 * x, 0.9 * x);
    let scenes = [
        (
            "soup, room and sphere",
            vec![soup(300, 0.2), room(), sphere(0.3, Vec3::splat(0.5), 2)],
        ),
        ("one triangle", vec![polygon(&[Vec3::ZERO, Vec3::X, Vec3::Y])]),
        ("fan", vec![fan(64)]),
        ("coplanar", vec![coplanar()]),
        ("slivers", vec![slivers(120)]),
        ("degenerate", vec![degenerate()]),
        ("10⁵ from the origin", vec![moved(soup(200, 0.3), 2.0, far(1e5))]),
        (
            "10⁶ from the origin",
            vec![moved(sphere(1.0, Vec3::ZERO, 2), 50.0, far(1e6))],
        ),
        ("scale 10⁻⁸", vec![moved(soup(200, 0.3), 1e-8, Vec3::ZERO)]),
        ("scale 10⁸", vec![moved(soup(200, 0.3), 1e8, Vec3::ZERO)]),
    ];
    for (name, meshes) in scenes {
        let scene = scene_of(meshes);
        for (kind, rays) in rays_at(&scene, rays) {
            // At the outer edges of a surface, the last bit decides if a ray hits. One of the 10⁵
            // random rays, or one of the 10⁴ rays along axes, may disagree.
            let budget = if matches!(kind, "random" | "along axes") {
                1
            } else {
                usize::MAX
            };
            assert_agree(&format!("{name}, {kind}"), &scene, &rays, budget);
        }
    }
}

#[test]
fn backends_agree_on_instances_and_motion() {
    let far = Vec3::new(1e4, -2e4, 1e4);
    for (name, scene) in [
        ("copies", copies(Vec3::ZERO, false, false)),
        ("copies far away", copies(far, false, false)),
        ("moving copies", copies(Vec3::ZERO, true, false)),
        ("deforming meshes", copies(Vec3::ZERO, false, true)),
        ("moving copies of deforming meshes", copies(Vec3::ZERO, true, true)),
        ("the same far away", copies(far, true, true)),
    ] {
        assert_eq!(
            scene.is_moving(),
            name.contains("ing") || name.starts_with("the"),
            "{name}"
        );
        for (kind, rays) in rays_at(&scene, budget(4_000).min(1_000)) {
            // Far from the origin, rays that are transformed into the space of a copy keep few
            // digits.
            let budget = match kind {
                "random" | "along axes" if name.ends_with("away") => 10,
                "random" | "along axes" => 1,
                _ => usize::MAX,
            };
            assert_agree(&format!("{name}, {kind}"), &scene, &rays, budget);
        }
    }
}

/// Rays hit an instance at the same points as its triangles placed in the world. The surface data
/// of the hits are equal.
#[test]
fn instances_match_meshes_in_the_world() {
    let scene = copies(Vec3::ZERO, false, false);
    // Use smooth meshes, so that normals are transformed too
    let smooth = |mesh: Mesh| Mesh {
        normals: mesh.positions.iter().map(|p| (*p + 0.1).normalize()).collect(),
        ..mesh
    };
    let mut b = SceneBuilder::new();
    let m = b.add_material(material(0.5, 0.0)).unwrap();
    let ball = smooth(sphere(0.7, Vec3::ZERO, 1));
    let prototype = b.add_prototype(vec![(ball.clone(), m)]).unwrap();
    let mut one_by_one = SceneBuilder::new();
    let n = one_by_one.add_material(material(0.5, 0.0)).unwrap();
    for (i, instance) in scene.instances().iter().enumerate() {
        let placement = instance.placement.at(0.0);
        b.add_instance(prototype, instance.placement.clone()).unwrap();
        let normals = placement.matrix3.inverse().transpose();
        let mut mesh = Mesh {
            positions: ball.positions.iter().map(|p| placement.transform_point3a(*p)).collect(),
            normals: ball.normals.iter().map(|n| (normals * *n).normalize()).collect(),
            ..ball.clone()
        };
        if i % 2 == 1 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        one_by_one.add_mesh(mesh, n).unwrap();
    }
    let [scene, one_by_one] = [b, one_by_one].map(|b| b.build().unwrap().0);
    assert_eq!(scene.placed_triangle_count(), one_by_one.triangle_count());
    let [outer, inner] = [scene.bounds(), one_by_one.bounds()];
    assert!(outer.min.cmple(inner.min).all() && outer.max.cmpge(inner.max).all());
    let oracle = BruteForce::new(&one_by_one);
    for accel in backends(&scene) {
        let mut hits = 0;
        for ray in &rays_at(&one_by_one, 500)[0].1 {
            let (Some(a), Some(b)) = (accel.intersect(ray), oracle.intersect(ray)) else {
                continue;
            };
            assert_eq!((a.inst.0, b.inst), (b.geom.0, InstanceId::NONE), "{ray:?}");
            let (p, q) = (scene.surface_point(&a, 0.0), one_by_one.surface_point(&b, 0.0));
            assert!(
                p.p.distance(q.p) < 1e-5 && p.ng.distance(q.ng) < 1e-4 && p.ns.distance(q.ns) < 1e-4,
                "{p:?} {q:?}"
            );
            let offsets = [
                p.curvature_offset[0] - q.curvature_offset[0],
                p.curvature_offset[1] - q.curvature_offset[1],
            ];
            assert!(offsets.iter().all(|d| d.abs() < 1e-5), "{p:?} {q:?}");
            hits += 1;
        }
        assert!(hits > 500, "{hits}");
    }
}

/// Rays that leave a triangle of an instance do not hit it again, for any placement and motion.
#[test]
fn rays_do_not_hit_the_instance_they_left() {
    for (exponent, offset) in [(-6, 0.0), (0, 0.0), (0, 300.0), (6, 0.0), (-3, 1000.0)] {
        let scale = 10f32.powi(exponent);
        for i in 0..100 {
            let corners = [0, 1, 2].map(|k| uniform_sphere(at(i, 10 + k)));
            let mut mesh = polygon(&corners);
            if i % 3 == 0 {
                mesh.positions_close = mesh.positions.iter().map(|p| 0.6 * p.yzx() + 0.2).collect();
            }
            let mut b = SceneBuilder::new();
            let m = b.add_material(material(0.5, 0.0)).unwrap();
            let prototype = b.add_prototype(vec![(mesh, m)]).unwrap();
            let size = affine_from_trs(Vec3::ZERO, Vec3::ZERO, Vec3::splat(scale));
            let place = |k: u32| size * askew(i, offset * uniform_sphere(at(i, 70 + k)));
            let placement = match i % 2 {
                0 => Placement::Still(place(0)),
                _ => Placement::Moving([place(0), place(1)].into()),
            };
            b.add_instance(prototype, placement).unwrap();
            let scene = b.build().unwrap().0;
            let hit = all_triangles(&scene)[0];
            for accel in backends(&scene) {
                for k in 0..32 {
                    let (b1, b2) = uniform_triangle(at(i, 20 + k));
                    let s = scene.surface_point(&Hit { b1, b2, ..hit }, at(i, 80 + k).x);
                    let ray = ray_towards(&s, uniform_sphere(at(i, 60 + k)));
                    assert!(
                        accel.intersect(&ray).is_none() && !accel.occluded(&ray),
                        "{}, scale {scale}, {offset} away, triangle {i}: {ray:?}",
                        accel.info().name
                    );
                }
            }
        }
    }
}

/// Rays from inside a closed sphere towards corners, edges and centres of its triangles. Each ray
/// hits a triangle.
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

/// A closed sphere is hit from inside in a million random directions.
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

/// Far from the origin, floats are 1/64 apart. Corners and ray origins are multiples of 1/64.
#[test]
fn a_closed_sphere_far_away_is_closed() {
    let place = Vec3::new(2.0e5, -1.5e5, 1.7e5);
    let scene = scene_of(vec![sphere(2.0, place, 3)]);
    assert_eq!(f32::from_bits(place.x.to_bits() + 1) - place.x, 1.0 / 64.0);
    for backend in backends(&scene) {
        let missed = (0..1_000_000).filter(|&i| {
            let origin = place + 0.3 * uniform_sphere(at(i, 19));
            backend
                .intersect(&Ray::new(origin, uniform_sphere(at(i, 18))))
                .is_none()
        });
        let missed = missed.count();
        println!("{}: {missed} of 10⁶ rays missed", backend.info().name);
        assert!(missed <= 20, "{}: {missed}", backend.info().name);
    }
}

/// Rays traced together have the same hits as single rays, for any number of rays and any
/// directions.
#[test]
fn packets_match_single_rays() {
    let scene = scene_of(vec![soup(300, 0.3), room()]);
    for backend in backends(&scene) {
        let (mut hits, mut misses) = (0, 0);
        for i in 0..2_000 {
            let from = 1.5 * uniform_sphere(at(i, 40));
            let spread = [0.001, 0.1, 10.0][i as usize % 3];
            let rays: Vec<Ray> = (0..i % 40)
                .map(|k| Ray {
                    t_max: if k % 5 == 0 { 0.9 } else { f32::INFINITY },
                    ..Ray::new(from, spread * uniform_sphere(at(i, 41 + k)) - from)
                })
                .collect();
            let mut together = vec![None; rays.len()];
            backend.intersect_coherent(&rays, &mut together);
            for (ray, hit) in rays.iter().zip(together) {
                match (hit, backend.intersect(ray)) {
                    (Some(a), Some(b)) => {
                        hits += 1;
                        let error = Crossing::new(&scene, ray, &a).t_error() + Crossing::new(&scene, ray, &b).t_error();
                        assert!((a.t as f64 - b.t as f64).abs() <= error, "{ray:?}: {a:?} and {b:?}");
                    }
                    (a, b) => {
                        misses += 1;
                        assert_eq!(a, b, "{ray:?}");
                    }
                }
            }
        }
        assert!(hits > 10_000 && misses > 100, "{hits} hits, {misses} misses");
    }
}

#[test]
fn barycentrics_give_the_hit_point() {
    let scene = scene_of(vec![soup(50, 0.5), soup(80, 0.4)]);
    for backend in backends(&scene) {
        let mut checked = 0;
        for i in 0..2000 {
            let (a, b) = (at(i, 7), at(i, 8));
            let ray = Ray::new(Vec3::splat(-0.5), Vec3::new(a.x, a.y, b.x) + 0.5);
            if let Some(hit) = backend.intersect(&ray) {
                let p = scene.surface_point(&hit, 0.0).p;
                let along = ray.origin + hit.t * ray.direction;
                assert!(p.distance(along) < 2e-5, "{p} against {along}");
                checked += 1;
            }
        }
        assert!(checked > 100);
    }
}

/// A closed box of two triangles per side, facing outwards.
fn cube() -> Mesh {
    let corner = |i: usize| Vec3::from_array([i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 * 2.0 - 1.0));
    let sides = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    Mesh {
        positions: (0..8).map(corner).collect(),
        triangles: sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        ..Mesh::default()
    }
}

/// Scene with one copy of `mesh`, placed by `m`: transformed corner by corner, or as an instance.
fn placed(mesh: &Mesh, m: Affine3A, is_instance: bool) -> Scene {
    if !is_instance {
        return scene_of(vec![Mesh {
            positions: mesh.positions.iter().map(|p| m.transform_point3a(*p)).collect(),
            ..mesh.clone()
        }]);
    }
    let mut b = SceneBuilder::new();
    let m0 = b.add_material(material(0.5, 0.0)).unwrap();
    let prototype = b.add_prototype(vec![(mesh.clone(), m0)]).unwrap();
    b.add_instance(prototype, Placement::Still(m)).unwrap();
    b.build().unwrap().0
}

/// Number of rays that leak from a closed surface, of `rays` rays. Rays start first at `center`,
/// then at each hit, as in paths. Each hit must lie on its triangle.
fn leaks(what: &str, scene: &Scene, accel: &dyn Accel, center: Vec3, rays: u32) -> u32 {
    let mut leaks = 0;
    let mut next: Vec<Ray> = Vec::new();
    let mut path = 0;
    for i in 0..rays.div_ceil(16) {
        while next.len() < 16 {
            next.push(Ray::new(center, uniform_sphere(at(path, 90))));
            path += 1;
        }
        let batch = std::mem::take(&mut next);
        let mut hits = vec![None; batch.len()];
        accel.intersect_coherent(&batch, &mut hits);
        for (k, (ray, hit)) in (0..).zip(batch.iter().zip(hits)) {
            // Alternate packets and single rays
            let hit = if i % 2 == 0 { hit } else { accel.intersect(ray) };
            let is_occluded = accel.occluded(ray);
            let Some(hit) = hit.filter(|_| is_occluded) else {
                leaks += 1;
                continue;
            };
            let crossing = Crossing::new(scene, ray, &hit);
            let (t, b) = crossing.errors();
            let (t_error, b_error) = (crossing.t_error(), crossing.barycentric_error());
            assert!(
                t <= t_error && b <= b_error || b_error > 0.1,
                "{what}: {ray:?}: {hit:?}"
            );
            let s = scene.surface_point(&hit, 0.0);
            let w = uniform_sphere(at(16 * i + k, 91));
            next.push(ray_towards(&s, if w.dot(s.ng) < 0.0 { w } else { -w }));
        }
    }
    leaks
}

/// Closed surfaces are closed from inside at every scale, and every hit is right, on every
/// instruction set. This also holds if an instance scales, rotates or moves the surfaces far away.
#[test]
fn closed_shells_are_closed() {
    const RAYS: u32 = 4096;
    let turned = |scale: f32, place: Vec3| affine_from_trs(place, Vec3::new(20.0, 50.0, 70.0), Vec3::splat(scale));
    let far = |x: f32| Vec3::new(x, -0.7 * x, 0.9 * x);
    let sphere = sphere(1.0, Vec3::ZERO, 3);
    for (shape, shell) in [("sphere", &sphere), ("cube", &cube())] {
        for exponent in [-9, -8, -6, -3, 0, 3, 6, 9] {
            let scale = 10f32.powi(exponent);
            for is_instance in [false, true] {
                let what = format!("{shape} of {scale:e}, instance {is_instance}");
                let scene = placed(shell, turned(scale, Vec3::ZERO), is_instance);
                for (name, accel) in backends_by_isa(&scene) {
                    let what = format!("{what}, {name}");
                    assert_eq!(leaks(&what, &scene, accel.as_ref(), Vec3::ZERO, RAYS), 0, "{what}");
                }
            }
            // Only the mesh is small or large. Its instance has the size 1.
            let own = moved(shell.clone(), scale, Vec3::ZERO);
            let scene = placed(&own, turned(1.0 / scale, Vec3::ZERO), true);
            for (name, accel) in backends_by_isa(&scene) {
                let what = format!("{shape} of {scale:e} made as large as 1, {name}");
                assert_eq!(leaks(&what, &scene, accel.as_ref(), Vec3::ZERO, RAYS), 0, "{what}");
            }
        }
        for distance in [1e3, 1e4, 1e5] {
            let scene = placed(shell, turned(1.0, far(distance)), true);
            for (name, accel) in backends_by_isa(&scene) {
                let what = format!("{shape}, an instance {distance:e} away, {name}");
                let count = leaks(&what, &scene, accel.as_ref(), far(distance), 4 * RAYS);
                println!("{what}: {count} of {} rays leak", 4 * RAYS);
                // At most one ray in 10⁴ leaks
                assert!(count <= 1, "{what}: {count}");
            }
        }
    }
}

/// The interval of a ray is open at both ends, for single rays and packets, and for any surface. A
/// ray that continues from a hit uses the `t` of the hit as its `t_min`.
#[test]
fn intervals_are_open() {
    let triangle = polygon(&[
        Vec3::new(-1.0, -1.0, 0.0),
        Vec3::new(1.0, -1.0, 0.1),
        Vec3::new(0.0, 1.0, -0.2),
    ]);
    let bent = Mesh {
        positions_close: triangle.positions.iter().map(|p| 1.5 * *p - 0.1).collect(),
        ..triangle.clone()
    };
    let instance = |mesh: &Mesh, placement: Placement| {
        let mut b = SceneBuilder::new();
        let m = b.add_material(material(0.5, 0.0)).unwrap();
        let prototype = b.add_prototype(vec![(mesh.clone(), m)]).unwrap();
        b.add_instance(prototype, placement).unwrap();
        b.build().unwrap().0
    };
    let place = |x: f32| affine_from_trs(Vec3::new(x, 0.1, 0.2), Vec3::new(5.0, 10.0, 20.0), Vec3::splat(1.7));
    let moving = || Placement::Moving([place(0.0), place(0.1), place(0.05)].into());
    for (what, scene) in [
        ("a mesh", scene_of(vec![triangle.clone()])),
        ("an instance", instance(&triangle, Placement::Still(place(0.1)))),
        ("a mesh that bends", scene_of(vec![bent.clone()])),
        ("an instance that moves", instance(&triangle, moving())),
        ("an instance that moves and bends", instance(&bent, moving())),
    ] {
        let mut backends = backends_by_isa(&scene);
        backends.push(("brute".into(), Box::new(BruteForce::new(&scene))));
        for (name, accel) in backends {
            for i in 0..64 {
                let (u, v) = (at(i, 95), at(i, 96));
                let from = Vec3::new(0.4 * u.x - 0.2, 0.4 * u.y - 0.3, 3.0);
                let to = Vec3::new(0.3 * v.x, 0.3 * v.y - 0.2, 0.0);
                let ray =
                    Ray::new(from, (0.5 + 2.0 * u.x) * (to - from)).when(if scene.is_moving() { v.x } else { 0.0 });
                // Test single rays and packets. Distances of packets may differ from distances of
                // single rays in the last digits.
                for is_packet in [false, true] {
                    let ask = |ray: Ray| -> (Option<Hit>, bool) {
                        if !is_packet {
                            return (accel.intersect(&ray), accel.occluded(&ray));
                        }
                        let (mut hits, mut occluded) = ([None; 16], [false; 16]);
                        accel.intersect_coherent(&[ray; 16], &mut hits);
                        accel.occluded_coherent(&[ray; 16], &mut occluded);
                        assert!(hits.iter().all(|h| *h == hits[0]) && occluded.iter().all(|o| *o == occluded[0]));
                        (hits[0], occluded[0])
                    };
                    let what = format!("{what}, {name}, packet {is_packet}: {ray:?}");
                    let Some(hit) = ask(ray).0 else {
                        panic!("{what}: nothing is hit")
                    };
                    let next = |t: f32, steps: i32| f32::from_bits((t.to_bits() as i32 + steps) as u32);
                    // Backends may use other code for occlusion than for the closest hit, so the
                    // last digits may differ.
                    const DIGITS: i32 = 16;
                    for (near, far, is_met) in [
                        (Some((hit.t, 0)), None, false),
                        (Some((hit.t, -DIGITS)), None, true),
                        (None, Some((hit.t, 0)), false),
                        (None, Some((hit.t, DIGITS)), true),
                        (Some((0.9 * hit.t, 0)), Some((1.1 * hit.t, 0)), true),
                        (Some((hit.t, 1)), None, false),
                        (Some((0.5 * hit.t, 0)), Some((0.9 * hit.t, 0)), false),
                    ] {
                        let within = |outwards: i32| Ray {
                            t_min: near.map_or(0.0, |(t, steps)| next(t, steps - outwards)),
                            t_max: far.map_or(f32::INFINITY, |(t, steps)| next(t, steps + outwards)),
                            ..ray
                        };
                        assert_eq!(ask(within(0)).0.is_some(), is_met, "{what} in {near:?} to {far:?}");
                        let outwards = if is_met { DIGITS } else { -DIGITS };
                        assert_eq!(
                            ask(within(outwards)).1,
                            is_met,
                            "{what} in {near:?} to {far:?}, occlusion"
                        );
                    }
                }
            }
        }
    }
}

/// A scene whose size is outside of the supported range is an error that contains the size.
#[test]
fn scenes_beyond_the_range_are_refused() {
    let added = |scale: f32| {
        let mut b = SceneBuilder::new();
        let m = b.add_material(material(0.5, 0.0)).unwrap();
        b.add_mesh(moved(cube(), scale, Vec3::ZERO), m)
            .and_then(|()| b.build().map(drop))
    };
    for scale in [1e-9, 1e-6, 1.0, 1e6, 1e10] {
        assert_eq!(added(scale), Ok(()), "{scale}");
    }
    for (scale, number) in [
        (4e-10, "8e-10"),
        (1e-13, "2e-13"),
        (1.1e10, "11000000000"),
        (1e13, "10000000000000"),
    ] {
        let error = added(scale).unwrap_err().to_string();
        assert!(error.contains(number), "{scale}: {error}");
    }
    // The allowed range of sizes applies to an instance in the world and in its local space.
    let instance = |own: f32, scale: f32| {
        let mut b = SceneBuilder::new();
        let m = b.add_material(material(0.5, 0.0)).unwrap();
        b.add_mesh(cube(), m)?;
        let prototype = b.add_prototype(vec![(moved(cube(), own, Vec3::ZERO), m)])?;
        let m = affine_from_trs(Vec3::ZERO, Vec3::ZERO, Vec3::splat(scale));
        b.add_instance(prototype, Placement::Still(m))?;
        b.build().map(drop)
    };
    assert_eq!(instance(1e-8, 1e8), Ok(()));
    assert_eq!(instance(1e8, 1e-8), Ok(()));
    for (own, scale) in [(1e-10, 1e10), (1e11, 1e-11), (1.0, 1e11), (1.0, 1e-12 * 1e-4)] {
        assert!(instance(own, scale).is_err(), "{own} times {scale}");
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

/// Rays that leave a triangle do not hit it again on either side, for triangles of every size and
/// position.
#[test]
fn rays_do_not_hit_the_surface_they_left() {
    for i in 0..1000 {
        let scale = 10f32.powi((i as i32 % 17 - 8).min(7));
        let place = [Vec3::ZERO, Vec3::ONE, Vec3::new(100.0, -3.0, 20.0)][i as usize % 3];
        let mut corners = [0, 1, 2].map(|k| scale * (uniform_sphere(at(i, 10 + k)) + place));
        // Also test slivers, whose length is 10 to 1000 times their width. Narrower triangles have
        // larger f32 errors of hit points.
        if i % 5 == 0 {
            corners[2] =
                corners[0].lerp(corners[1], 0.4) + 10f32.powi(-(1 + i as i32 / 5 % 3)) * (corners[2] - corners[0]);
        }
        // Also test axis-aligned triangles, through the origin or beside it.
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

/// Segments between points of two facing surfaces are not occluded, at every scale.
#[test]
fn shadow_rays_hit_neither_end() {
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
fn backends_free_their_memory() {
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

/// Compares Embree with obvhs, for rays through real rooms and meshes, and for the rays of their
/// renders. Brute force would take too long.
#[cfg(all(feature = "embree", feature = "obvhs"))]
mod together {
    use super::*;
    use embrasure::accel::{Auditor, bvh::BvhAccel, embree::EmbreeAccel};
    use embrasure::camera::{Camera, CameraParameters};
    use embrasure::film::{Film, Filter};
    use embrasure::integrator::World;
    use embrasure::math::UVec2;
    use embrasure::scene_file::{SceneFile, load_scene};
    use std::path::{Path, PathBuf};

    #[test]
    #[cfg_attr(not(shared), ignore = "needs ../shared")]
    #[cfg_attr(all(shared, not(long)), ignore = "long")]
    fn backends_agree_on_real_scenes() {
        let folder = shared("scenes");
        let count = budget(100_000);
        for name in [
            "cornell-box-mcguire/CornellBox-Water.obj",
            "sponza-dabrovic/sponza.obj",
            "living-room/living-room.obj",
            "staircase2/staircase2.obj",
            "kitchen-blender/kitchen.obj",
            "meshes/stanford-bunny.obj",
            "meshes/teapot.obj",
            "meshes/nefertiti.obj",
        ] {
            let scene = load_scene(&SceneFile::of_obj(folder.join(name)), SceneBuilder::new())
                .unwrap()
                .scene;
            let (embree, bvh) = (EmbreeAccel::new(&scene, 2).unwrap(), BvhAccel::new(&scene));
            let auditor = Auditor::new(&scene, [&embree, &bvh], 1.0);
            let (center, radius) = (scene.bounds().center(), scene.bounds().radius());
            let mut hits = 0;
            for i in 0..count {
                // Rays start inside the bounding sphere, or outside of it towards a point inside
                let inner = center + 0.7 * radius * at(i, 30).x * uniform_sphere(at(i, 31));
                let ray = if i % 2 == 0 {
                    Ray::new(inner, uniform_sphere(at(i, 32)))
                } else {
                    let from = center + 2.0 * radius * uniform_sphere(at(i, 32));
                    Ray::new(from, (inner - from).normalize())
                };
                hits += u32::from(auditor.intersect(&ray).is_some());
                auditor.occluded(&ray);
            }
            assert!(hits > count / 10, "{name}: only {hits} hits");
            check(name, &scene, &auditor);
        }
    }

    /// Two rays in 10⁵ may be nearer to an edge than the rounding error, and disagree. Their number
    /// depends on the instruction set of Embree. All other disagreements must be choices between
    /// coincident surfaces.
    fn check(name: &str, scene: &Scene, auditor: &Auditor) {
        let findings = auditor.findings();
        // Sponza has coincident surfaces. A ray that passes a surface because of its alpha
        // continues from the exact parameter of the hit. Backends differ in the rounding of the
        // parameter, so the ray may hit the same surface again in one of them.
        let walks = match scene.has_alpha() {
            true => findings.caused_by(Cause::Interval),
            false => 0,
        };
        let apart = findings.caused_by(Cause::Coincident) + walks;
        let (count, rays) = (findings.count() - apart, findings.rays());
        println!("{name}: {count} of {rays} rays differ, {apart} more meet two surfaces in one place or start on one");
        for d in &findings.disagreements {
            println!(
                "  {:?} {:?} {:x?} {:?}",
                d.cause,
                d.query.kind,
                d.query.ray.bits(),
                d.answers
            );
        }
        assert_eq!(findings.caused_by(Cause::Unexplained), 0, "{name}");
        assert!(
            count * 50_000 <= rays.max(50_000),
            "{name}: {count} of {rays} rays differ"
        );
    }

    #[test]
    #[cfg_attr(not(long), ignore = "long")]
    fn pictures_agree() {
        let project = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        let names = ["cornell-box", "closed-box", "depth-of-field", "veach-plates", "furnace"];
        assert_pictures_agree(&names.map(|name| project.join(name).with_extension("toml")));
    }

    /// Scenes of the suite, and real scenes with textures, an environment, and leaves that an
    /// opacity map cuts out.
    #[test]
    #[cfg_attr(not(shared), ignore = "needs ../shared")]
    #[cfg_attr(all(shared, not(long)), ignore = "long")]
    fn pictures_of_real_scenes_agree() {
        let suite = ["cornell", "hall", "sponza"].map(|name| shared(&format!("suite/{name}/{name}.toml")));
        let gallery = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/gallery");
        assert_pictures_agree(&suite);
        assert_pictures_agree(&["sponza.toml", "living-room.toml"].map(|name| gallery.join(name)));
    }

    /// Renders with both backends and checks the images, and every ray of the first render.
    ///
    /// Barycentrics differ in their last bits, so no pixel needs to be bit-identical. If these bits
    /// change a random choice, or the side on which a ray passes an edge, a path goes in another
    /// direction, and the difference is larger.
    fn assert_pictures_agree(files: &[PathBuf]) {
        for path in files {
            let file = SceneFile::load(path).unwrap();
            let scene = load_scene(&file, SceneBuilder::new()).unwrap().scene;
            let (embree, bvh) = (EmbreeAccel::new(&scene, 2).unwrap(), BvhAccel::new(&scene));
            let auditor = Auditor::new(&scene, [&embree, &bvh], 1.0);
            let resolution = UVec2::new(128, 128);
            let keys = &file.options.camera;
            let camera = CameraParameters {
                vertical_fov: keys.vertical_fov.unwrap_or(40.0),
                ..pinhole(
                    keys.position.unwrap().as_vec3a(),
                    keys.look_at.unwrap().as_vec3a(),
                    40.0,
                )
            };
            let camera = Camera::new(camera, resolution).unwrap();
            let (a, b) = (picture(&scene, &auditor, &camera), picture(&scene, &bvh, &camera));
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            let (mut same, mut other) = (0, 0);
            for (a, b) in a.iter().zip(&b) {
                let apart = (0..3)
                    .map(|c| (a[c] - b[c]).abs() / (a[c].abs().max(b[c].abs()) + 1e-3))
                    .fold(0.0, f64::max);
                same += usize::from(apart == 0.0);
                other += usize::from(apart > 1e-3);
            }
            println!(
                "{name}: of {} pixels {same} are the same to the bit, {other} differ by more than 0.1 %",
                a.len()
            );
            check(&name, &scene, &auditor);
            assert!(other * 100 <= a.len(), "{name}: {other} of {} pixels differ", a.len());
        }
    }

    fn picture(scene: &Scene, accel: &dyn Accel, camera: &Camera) -> Vec<[f64; 3]> {
        let selection = scene.light_selection(LightChoice::default());
        let world = World::new(scene, &accel, &selection, camera, &Filter::BOX);
        let integrator = path_tracer(world, Some(16));
        let film: Film = film_of(&integrator, UVec2::new(128, 128), 4, 0);
        let tiles = film.pixels();
        tiles.map(|(_, sums)| [0, 1, 2].map(|c| sums.mean(c))).collect()
    }
}
