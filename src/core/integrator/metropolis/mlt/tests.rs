//! Tests that each kind of mutation keeps the frequency of paths proportional to the light of the
//! paths.

use super::*;
use crate::accel::brute::BruteForce;
use crate::camera::{Camera, CameraDescription, CameraParameters, Projection, Stereo, StereoLayout};
use crate::color::Spectrum;
use crate::film::Filter;
use crate::geometry::{Mesh, Placement};
use crate::integrator::{Heuristic, ImportanceImageMaker, MetropolisDirect, NullRaySink};
use crate::material::Material;
use crate::math::{Affine3A, UVec2, Vec3};
use crate::sampler::Independent;
use crate::scene::{Scene, SceneBuilder};

/// A rectangle with a corner at `p` and the edges `a` and `b`. Its front faces `a × b`.
fn quad(p: Vec3, a: Vec3, b: Vec3) -> Mesh {
    Mesh {
        positions: vec![p, p + a, p + a + b, p + b],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn matte(diffuse: Spectrum) -> Material {
    Material {
        name: "m".into(),
        diffuse,
        ..Material::default()
    }
}

fn add(b: &mut SceneBuilder, mesh: Mesh, material: Material) {
    let id = b.add_material(material).unwrap();
    b.add_mesh(mesh, id).unwrap();
}

/// A floor and two walls.
fn corner(b: &mut SceneBuilder) {
    add(
        b,
        quad(Vec3::ZERO, 2.0 * Vec3::Z, 2.0 * Vec3::X),
        matte(Spectrum::rgb(0.7, 0.6, 0.5)),
    );
    add(
        b,
        quad(Vec3::ZERO, 2.0 * Vec3::X, 2.0 * Vec3::Y),
        matte(Spectrum::rgb(0.3, 0.6, 0.3)),
    );
    add(
        b,
        quad(Vec3::ZERO, 2.0 * Vec3::Y, 2.0 * Vec3::Z),
        matte(Spectrum::rgb(0.7, 0.2, 0.2)),
    );
}

fn lamp(b: &mut SceneBuilder) {
    let material = Material {
        emission: Spectrum::splat(3.0),
        ..matte(Spectrum::splat(0.4))
    };
    add(
        b,
        quad(Vec3::new(0.6, 1.8, 0.6), 0.8 * Vec3::X, 0.8 * Vec3::Z),
        material,
    );
}

/// A mirror that leans against the wall, and a pane of glass in front of the floor.
fn mirror_and_glass(b: &mut SceneBuilder) {
    let mirror = Material {
        specular: Spectrum::splat(0.6),
        gloss: crate::material::Gloss::Mirror(crate::bsdf::Fresnel::Full),
        ..matte(Spectrum::splat(0.3))
    };
    add(
        b,
        quad(Vec3::new(0.4, 0.0, 0.5), 1.4 * Vec3::X, Vec3::new(0.0, 1.3, -0.4)),
        mirror,
    );
    let glass = Material {
        transmission: Spectrum::rgb(0.9, 1.0, 0.8),
        ..matte(Spectrum::ZERO)
    };
    add(
        b,
        quad(
            Vec3::new(0.3, 0.5, 0.7),
            Vec3::new(0.2, 0.1, 1.2),
            Vec3::new(1.2, 0.05, 0.0),
        ),
        glass,
    );
}

fn look<T>(
    build: impl FnOnce(&mut SceneBuilder),
    lens_radius: f32,
    with: impl FnOnce(&PathSpaceIntegrator<BruteForce>) -> T,
) -> T {
    let parameters = CameraParameters {
        position: Vec3::new(1.7, 1.5, 2.6),
        look_at: Vec3::new(0.8, 0.6, 0.6),
        up: Vec3::Y,
        vertical_fov: 60.0,
        lens_radius,
        focus_distance: 2.0,
    };
    look_through(build, Camera::new(parameters, UVec2::splat(16)).unwrap(), with)
}

fn look_through<T>(
    build: impl FnOnce(&mut SceneBuilder),
    camera: Camera,
    with: impl FnOnce(&PathSpaceIntegrator<BruteForce>) -> T,
) -> T {
    let mut b = SceneBuilder::new();
    build(&mut b);
    let (scene, _): (Scene, _) = b.build().unwrap();
    let accel = BruteForce::new(&scene);
    let metropolis = Metropolis {
        direct: MetropolisDirect::Metropolis,
        ..Metropolis::default()
    };
    let selection = scene.light_selection(crate::light_sampling::LightChoice::default());
    let world = World::new(&scene, &accel, &selection, &camera, &Filter::BOX);
    let maker = ImportanceImageMaker {
        world,
        heuristic: Heuristic::Power,
        max_depth: Some(4),
        roulette: Roulette::default(),
    };
    let work_item = |index| maker.work_item(index, &mut Independent::new(8), &mut NullRaySink);
    let work_items: Vec<_> = (0..ImportanceImageMaker::<BruteForce>::WORK_ITEMS)
        .map(work_item)
        .collect();
    let importance = maker.join(&work_items);
    with(&PathSpaceIntegrator {
        world,
        max_depth: Some(4),
        roulette: Roulette::default(),
        light_samples: 1,
        metropolis,
        importance: &importance,
    })
}

/// Features of a path: its length, film position, first and last scattering point, and number of
/// delta lobes.
fn features(path: &Path) -> Vec<f64> {
    let n = path.len();
    let mut of = vec![0.0; 10];
    of[n - 2] = 1.0;
    let [first, last] = [1, n - 2].map(|i| path.vertices[i.min(n - 1)].p);
    of.extend([path.film.x, path.film.y, first.x, first.y, first.z, last.x, last.y].map(f64::from));
    of.push(path.vertices.iter().filter(|v| v.is_delta).count() as f64);
    of.push(f64::from(path.vertices[n - 1].is_infinite()));
    of.push((path.vertices.iter().map(|v| v.p.length()).sum::<f32>() as f64).min(20.0));
    of
}

/// Asserts that a mutation is in balance. If paths are distributed in proportion to their light, a
/// step of a chain must preserve this distribution. Take independent paths x of weight w, and for
/// each x a step to a path y with acceptance probability a. For any feature h, the mean of `w a
/// (h(y) − h(x))` must be 0. Detailed balance is stronger: for any antisymmetric function φ, the
/// mean of `w a φ(x, y)` is 0.
fn is_balanced(what: &str, integrator: &PathSpaceIntegrator<BruteForce>, (name, kind): (&str, Mutation)) {
    const SAMPLES: u32 = 6000;
    let space = integrator.space();
    let (mut rays, mut sampler) = (NullRaySink, Independent::new(7));
    let light_of = |(path, light): &(Path, f64)| (*light, path.len());
    let found: Vec<SamplePaths> = (0..512)
        .map(|i| {
            let seed = integrator.seed(&space, 0, i, &mut sampler, &mut rays);
            seed.iter().map(light_of).collect()
        })
        .collect();
    let seeds = Seeds::new(&found, space.min_vertices, space.max_vertices);
    let lengths = seeds.lengths(seed::Seed { sample: 0, way: 0 });
    // Features that do not change may differ by rounding errors.
    let moved_by = |change: f64| if change.abs() < 1e-4 { 0.0 } else { change };
    let (mut sums, mut moved) = (vec![[0.0f64; 2]; 0], 0);
    for i in 0..SAMPLES {
        let mut numbers = Numbers::of(SampleKey::new(i, 3, 1), &mut sampler);
        let mut sample: Vec<f64> = Vec::new();
        for (x, light) in integrator.seed(&space, 1, i, &mut sampler, &mut rays) {
            let (index, proposal) = integrator.mutate_by(kind, &space, lengths, &x, &mut numbers, &mut rays);
            let Some(Proposal { path: y, acceptance }) = proposal.filter(|_| NAMES[index] == name) else {
                continue;
            };
            moved += u32::from(acceptance > 0.0);
            let flow = light * kind.probability(&x, &space) * acceptance;
            let (of_x, of_y) = (features(&x), features(&y));
            let n = of_x.len();
            sample.resize(2 * n, 0.0);
            for j in 0..n {
                let next = (j + 1) % n;
                sample[j] += flow * moved_by(of_y[j] - of_x[j]);
                sample[n + j] += flow * moved_by(of_y[j] * of_x[next] - of_x[j] * of_y[next]);
            }
        }
        sums.resize(sums.len().max(sample.len()), [0.0; 2]);
        for (sum, value) in sums.iter_mut().zip(sample) {
            *sum = [sum[0] + value, sum[1] + value * value];
        }
    }
    let z_score = |[sum, squares]: &[f64; 2]| sum / squares.sqrt().max(1e-12);
    let z: Vec<f64> = sums.iter().map(z_score).collect();
    let worst = z.iter().fold(0.0f64, |worst, z| worst.max(z.abs()));
    println!(
        "{what}, {name}: {moved} moves, worst of {} z-scores {worst:.2}",
        z.len()
    );
    assert!(moved > 200, "{what}, {name}: {moved} moves");
    assert!(z.iter().all(|z| z.abs() < 4.5), "{what}, {name}: {z:.1?}");
}

const KINDS: [(&str, Mutation); 6] = [
    ("new path", Mutation::Replace),
    ("bidirectional", Mutation::Bidirectional),
    ("lens", Mutation::FromCamera),
    ("caustic", Mutation::FromLight),
    ("lens subpath", Mutation::LensSubpath),
    ("multi-chain", Mutation::FromCamera),
];

#[test]
fn mutations_balance_between_matte_surfaces() {
    let build = |b: &mut SceneBuilder| {
        corner(b);
        lamp(b);
    };
    // The scene has no mirrors, so multi-chain perturbations are not tested.
    for kind in KINDS.into_iter().take(5) {
        look(build, 0.0, |integrator| is_balanced("matte", integrator, kind));
    }
}

#[test]
fn mutations_balance_through_conductors_and_glass() {
    let build = |b: &mut SceneBuilder| {
        corner(b);
        lamp(b);
        mirror_and_glass(b);
    };
    for kind in KINDS {
        look(build, 0.1, |integrator| {
            is_balanced("mirror and glass", integrator, kind)
        });
    }
}

#[test]
fn mutations_balance_with_point_and_infinite_lights() {
    let build = |b: &mut SceneBuilder| {
        corner(b);
        mirror_and_glass(b);
        let grey = Spectrum::splat;
        b.add_point_light(Vec3::new(1.2, 1.6, 1.2), grey(1.0)).unwrap();
        let direction = Vec3::new(-1.0, -1.0, -1.2);
        b.add_spot_light(Vec3::splat(1.5), direction, grey(2.0), 30.0, 20.0)
            .unwrap();
        b.add_constant_light(grey(0.4)).unwrap();
        b.add_directional_light(Vec3::new(-0.5, -1.0, -0.4), grey(0.7)).unwrap();
    };
    for kind in KINDS {
        look(build, 0.0, |integrator| is_balanced("far", integrator, kind));
    }
}

#[test]
fn mutations_balance_with_near_and_infinite_lights() {
    // A ray that misses the visible lamp hits one of four constant environment lights, chosen at
    // random.
    let build = |b: &mut SceneBuilder| {
        let material = Material {
            emission: Spectrum::splat(2.0),
            ..matte(Spectrum::splat(0.4))
        };
        add(
            b,
            quad(Vec3::new(0.4, 0.3, 0.5), 0.6 * Vec3::X, 0.6 * Vec3::Y),
            material,
        );
        for light in [0.2, 0.3, 0.4, 0.6] {
            b.add_constant_light(Spectrum::splat(light)).unwrap();
        }
    };
    for kind in KINDS.into_iter().take(4) {
        look(build, 0.0, |integrator| is_balanced("near and far", integrator, kind));
    }
}

/// The start of a ray of a stereo panorama depends on the point that the ray hits. The lamp is seen
/// directly, too.
#[test]
fn mutations_balance_in_a_stereo_panorama() {
    let build = |b: &mut SceneBuilder| {
        corner(b);
        lamp(b);
        mirror_and_glass(b);
        b.add_constant_light(Spectrum::splat(0.3)).unwrap();
    };
    let parameters = CameraParameters {
        position: Vec3::new(1.1, 1.2, 1.5),
        look_at: Vec3::new(0.4, 1.0, 0.6),
        up: Vec3::new(0.1, 1.0, 0.0),
        vertical_fov: 60.0,
        lens_radius: 0.0,
        focus_distance: 2.0,
    };
    let description = CameraDescription {
        projection: Projection::Panorama,
        stereo: Some(Stereo {
            layout: StereoLayout::SideBySide,
            eye_distance: 0.5,
            convergence: None,
        }),
        ..CameraDescription::still(parameters)
    };
    let views = description.views(UVec2::new(48, 12)).unwrap();
    for (view, kinds) in views.iter().zip([&KINDS[..3], &KINDS[3..]]) {
        for kind in kinds {
            look_through(build, view.camera, |integrator| {
                is_balanced("stereo panorama", integrator, *kind)
            });
        }
    }
}

/// A screen that moves in front of the lamp, and a mirror that turns away from the camera.
#[test]
fn mutations_balance_with_moving_objects() {
    let build = |b: &mut SceneBuilder| {
        corner(b);
        lamp(b);
        let screen = quad(Vec3::new(0.2, 1.2, 0.2), 0.7 * Vec3::Z, 0.7 * Vec3::X);
        let (red, mirror) = (
            matte(Spectrum::rgb(0.7, 0.3, 0.3)),
            Material {
                specular: Spectrum::splat(0.6),
                gloss: crate::material::Gloss::Mirror(crate::bsdf::Fresnel::Full),
                ..matte(Spectrum::splat(0.2))
            },
        );
        let leaning = quad(Vec3::new(0.4, 0.0, 0.5), 1.4 * Vec3::X, Vec3::new(0.0, 1.3, -0.4));
        let to = |offset: Vec3, degrees: f32| {
            let turn = crate::math::rotation_from_degrees(Vec3::new(0.0, degrees, 0.0));
            Affine3A::from_rotation_translation(turn, offset.into())
        };
        let moves = [
            (screen, red, to(Vec3::new(0.9, 0.0, 0.6), 0.0)),
            (leaning, mirror, to(Vec3::new(0.0, 0.1, 0.0), 12.0)),
        ];
        for (mesh, material, end) in moves {
            let id = b.add_material(material).unwrap();
            let prototype = b.add_prototype(vec![(mesh, id)]).unwrap();
            b.add_instance(prototype, Placement::Moving([Affine3A::IDENTITY, end].into()))
                .unwrap();
        }
    };
    let kinds = [
        ("time", Mutation::Time),
        ("lens subpath", Mutation::LensSubpath),
        ("lens", Mutation::FromCamera),
    ];
    for kind in kinds {
        look(build, 0.1, |integrator| is_balanced("moving", integrator, kind));
    }
}
