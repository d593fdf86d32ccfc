//! Shading normals that differ much from the geometric normals: normal maps, bump maps, coarse
//! smooth balls, and normals on the wrong side. In random scenes of all materials, every integrator
//! is compared with `naive`, with both backends.
//!
//! `naive` has no light samples, connections or weights, so it is right if ray origins are right.
//! Tests with a white surface in a white sky check the ray origins
//! ([`white_waves_in_a_white_sky_are_white`], [`touching_balls_in_a_white_sky_are_white`]).
#![cfg(feature = "embree")]

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::accel::Accel;
use embrasure::camera::{Camera, CameraParameters};
use embrasure::film::{Film, Filter};
use embrasure::integrator::*;
use embrasure::light_sampling::LightChoice;
use embrasure::math::{UVec2, Vec3};
use embrasure::scene::Scene;
use std::fmt::Write as _;
use std::fs;

const SIZE: u32 = 16;
/// Width of a block in pixels.
const BLOCK: u32 = 4;
/// Number of films of each integrator. Films have different seeds, so block means of different
/// films are independent.
const FILMS: u64 = 16;
const MAX_DEPTH: u32 = 6;
/// Maximum |t| of a difference of two means. With 30 degrees of freedom P(|t| > 6.5) is 3.4e-7. A
/// run has 2,000 differences, so one run in 1,500 fails by chance.
pub(super) const MAX_T: f64 = 6.5;
/// Relative difference allowed for photon methods: their radius blurs edges.
const BLUR: f64 = 0.04;

/// Random generator for scenes: SplitMix64.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.next()
    }

    fn of<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[(self.next() * all.len() as f32) as usize]
    }
}

const MATERIALS: [&str; 10] = [
    "diffuse = [0.9, 0.6, 0.4]",
    "diffuse = 0.4\nspecular = 0.4\nmodel = \"phong\"\nexponent = 20",
    "diffuse = 0.4\nspecular = 0.4\nmodel = \"blinn\"\nexponent = 20\nior = 1.5",
    "diffuse = 0.3\nspecular = 0.5\nmodel = \"ggx\"\nroughness = 0.6",
    "specular = 1\nmodel = \"ggx\"\nroughness = 0.6\neta = [0.2, 0.4, 1.4]\nk = [3.9, 2.4, 1.6]",
    "diffuse = 0.6\nclearcoat = 0.8\nclearcoat_roughness = 0.5",
    "diffuse = 0.5\nsheen = 0.4",
    "transmission = 0.9\nior = 1.5\nroughness = 0.6\nspecular = 0.9\nmodel = \"ggx\"",
    "diffuse = 0.7\nopacity = 0.6",
    "diffuse = 0.4\nspecular = 0.5\nmodel = \"mirror\"",
];

/// Texels of an 8 × 8 PNG: random normals with slopes up to `slope`, or random heights if `slope`
/// is `None`.
fn map(numbers: &mut Numbers, slope: Option<f32>) -> Vec<[u8; 3]> {
    let byte = |x: f32| (255.0 * (0.5 + 0.5 * x)).round() as u8;
    let texel = |numbers: &mut Numbers| match slope {
        Some(slope) => {
            let [x, y] = [0; 2].map(|_| numbers.between(-slope, slope));
            Vec3::new(x, y, 1.0).normalize().to_array().map(byte)
        }
        None => [byte(numbers.between(-1.0, 1.0)); 3],
    };
    (0..64).map(|_| texel(numbers)).collect()
}

/// A floor, a coarse smooth ball on it, a thin board, and a lamp above. The sky also shines from
/// below, so that a leak through the floor is visible.
fn random_scene(seed: u64) -> (String, Scene, CameraParameters) {
    let mut numbers = Numbers(seed);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let bend = *numbers.of(&["normal_map", "normal_map", "bump_map"]);
    let slope = *numbers.of(&[0.25, 0.5, 1.0, 2.0, 4.0]);
    let texels = map(&mut numbers, (bend == "normal_map").then_some(slope));
    write_png(&folder.path().join("map.png"), 8, &texels);
    let flips = [0; 3].map(|_| numbers.next() < 0.25);

    let mut obj = String::new();
    let quad = |obj: &mut String, name: &str, corners: [[f32; 3]; 4], is_flipped: bool| {
        for [x, y, z] in corners {
            writeln!(obj, "v {x} {y} {z}").unwrap();
        }
        let order = if is_flipped {
            "-4/1 -1/4 -2/3 -3/2"
        } else {
            "-4/1 -3/2 -2/3 -1/4"
        };
        writeln!(obj, "usemtl {name}\nf {order}").unwrap();
    };
    obj += "vt 0 0\nvt 2 0\nvt 2 2\nvt 0 2\n";
    let flat = |half: f32, y: f32, x: f32| {
        [(-half, half), (half, half), (half, -half), (-half, -half)].map(|(u, v)| [u + x, y, v])
    };
    quad(&mut obj, "floor", flat(2.0, 0.0, 0.0), flips[0]);
    quad(&mut obj, "board", flat(0.6, 1.1, -0.9), flips[1]);
    quad(&mut obj, "lamp", flat(0.7, 2.2, 0.5), true);
    ball(
        &mut obj,
        Vec3::new(0.4, 0.5, 0.2),
        0.5,
        if flips[2] { -1.0 } else { 1.0 },
    );
    write("scene.obj", &obj);

    let of = [0; 3].map(|_| (numbers.next() * MATERIALS.len() as f32) as usize);
    let mut toml = String::from("version = 1\n[[object]]\nobj = \"scene.obj\"\n");
    for (i, name) in ["floor", "board", "ball"].iter().enumerate() {
        writeln!(toml, "[material.{name}]\n{}", MATERIALS[of[i]]).unwrap();
        if i < 2 {
            writeln!(toml, "{bend} = \"map.png\"").unwrap();
        }
    }
    toml += "[material.lamp]\nemission = [4, 4, 4]\n[[light]]\ntype = \"constant\"\nradiance = [0.4, 0.5, 0.6]\n";
    write("scene.toml", &toml);

    let (turn, height) = (numbers.between(0.0, std::f32::consts::TAU), numbers.between(0.3, 2.0));
    let position = Vec3::new(3.4 * turn.cos(), height, 3.4 * turn.sin());
    let what = format!("seed {seed}: {bend} of slope {slope}, materials {of:?}, flipped {flips:?}");
    let camera = pinhole(position, Vec3::new(0.0, 0.4, 0.0), 42.0);
    (what, load(&folder.path().join("scene.toml")), camera)
}

/// Adds a ball of 8 × 5 quads. Vertex normals are the normals of the sphere, times `sign`.
fn ball(obj: &mut String, center: Vec3, radius: f32, sign: f32) {
    let (around, rings) = (8, 5);
    for i in 0..=rings {
        for k in 0..around {
            let theta = std::f32::consts::PI * i as f32 / rings as f32;
            let phi = std::f32::consts::TAU * k as f32 / around as f32;
            let n = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let (p, n) = (center + radius * n, sign * n);
            writeln!(obj, "v {} {} {}\nvn {} {} {}", p.x, p.y, p.z, n.x, n.y, n.z).unwrap();
        }
    }
    let count = (rings + 1) * around;
    let at = |i: i32, k: i32| i * around + k % around - count;
    obj.push_str("usemtl ball\n");
    for i in 0..rings {
        for k in 0..around {
            let corners = [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)];
            let [a, b, c, d] = corners.map(|v| format!("{v}//{v}"));
            writeln!(obj, "f {a} {b} {c} {d}").unwrap();
        }
    }
}

/// For each film: means of blocks of pixels, then the mean of the whole film.
type Blocks = Vec<Vec<f64>>;

fn blocks(render: impl Fn(u64) -> Film) -> Blocks {
    let per_row = SIZE / BLOCK;
    let of_film = |film: Film| {
        let mut sums = vec![0.0; (per_row * per_row) as usize];
        for (p, sums_of_pixel) in film.pixels() {
            let index = p.y / BLOCK * per_row + p.x / BLOCK;
            sums[index as usize] += sums_of_pixel.mean(1) / f64::from(BLOCK * BLOCK);
        }
        sums.push(sums.iter().sum::<f64>() / sums.len() as f64);
        sums
    };
    (0..FILMS).map(|seed| of_film(render(seed))).collect()
}

/// Allowed difference between two integrators.
#[derive(Clone, Copy, PartialEq)]
enum AllowedDifference {
    /// The integrators may differ by noise only.
    Noise,
    /// The integrators may differ by noise, and by the blur of photons.
    Blur,
    /// The second integrator may also be darker by any amount, because it does not find light from
    /// directions below the plane of the triangle.
    Darkness,
}

/// Largest |t| over all block means. Allowed differences are subtracted first.
fn largest_t(reference: &Blocks, other: &Blocks, allowed: AllowedDifference) -> f64 {
    let t = |(expected, got): (Mean, Mean)| {
        let difference = match allowed {
            AllowedDifference::Noise => (got.value - expected.value).abs(),
            AllowedDifference::Blur => ((got.value - expected.value).abs() - BLUR * expected.value).max(0.0),
            AllowedDifference::Darkness => (got.value - expected.value).max(0.0),
        };
        difference / got.error().hypot(expected.error()).max(1e-7)
    };
    let pairs = Mean::of_each(reference).into_iter().zip(Mean::of_each(other));
    pairs.map(t).fold(0.0, f64::max)
}

/// Largest |t| of each integrator against `naive`, in one scene.
pub(super) fn compare(scene: &Scene, accel: &dyn Accel, camera: CameraParameters) -> Vec<(&'static str, f64)> {
    let size = UVec2::splat(SIZE);
    let camera = Camera::new(camera, size).unwrap();
    let selection = scene.light_selection(LightChoice::default());
    let world = World::new(scene, &accel, &selection, &camera, &Filter::BOX);
    let (depth, roulette) = (Some(MAX_DEPTH), Roulette::after(3));
    let spp = budget(64);
    let path = |reuse: bool, directions: Directions| {
        blocks(|seed| {
            let path = PathIntegrator {
                strategy: Strategy {
                    directions,
                    ..Strategy::default()
                },
                roulette,
                light_samples: 2,
                ..path_tracer(world, depth)
            };
            match reuse {
                true => film_of(&ReusingPathIntegrator { path }, size, spp, 100 + seed),
                false => film_of(&path, size, spp, 200 + seed),
            }
        })
    };
    let radius = ProgressiveRadius {
        first: SearchRadius::Fixed(0.03),
        alpha: 1.0,
    };
    let naive = blocks(|seed| {
        let naive = NaiveIntegrator::new(world, depth, roulette);
        film_of(&naive, size, 8 * spp, 300 + seed)
    });
    let all = [
        ("path", path(false, Directions::Bsdf), AllowedDifference::Noise),
        (
            "path by cosine",
            path(false, Directions::Cosine),
            AllowedDifference::Noise,
        ),
        ("path, reuse", path(true, Directions::Bsdf), AllowedDifference::Noise),
        (
            "bdpt",
            blocks(|seed| {
                let bdpt = BidirectionalIntegrator {
                    world,
                    heuristic: Heuristic::Power,
                    max_depth: depth,
                    roulette,
                };
                film_of_iterations(&bdpt, size, spp, 400 + seed)
            }),
            AllowedDifference::Noise,
        ),
        (
            "vcm",
            blocks(|seed| {
                let vcm = VertexMergingIntegrator {
                    world,
                    heuristic: Heuristic::Power,
                    max_depth: depth,
                    roulette,
                    photons: Some(1000),
                    radius,
                };
                film_of_iterations(&vcm, size, spp, 500 + seed)
            }),
            AllowedDifference::Blur,
        ),
        (
            "sppm",
            blocks(|seed| {
                let sppm = ProgressivePhotonIntegrator {
                    world,
                    strategy: Strategy::default(),
                    max_depth: depth,
                    roulette,
                    photons: Some(2000),
                    radius,
                };
                film_of_iterations(&sppm, size, spp, 600 + seed)
            }),
            AllowedDifference::Blur,
        ),
        (
            "light",
            blocks(|seed| {
                let light = LightIntegrator {
                    world,
                    max_depth: depth,
                    roulette,
                };
                film_of_iterations(&light, size, 4 * spp, 700 + seed)
            }),
            AllowedDifference::Darkness,
        ),
    ];
    all.map(|(name, other, allowed)| (name, largest_t(&naive, &other, allowed)))
        .to_vec()
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn integrators_agree_on_random_bent_normals() {
    let cases = if slack() > 1.0 { 12 } else { 200 };
    let (mut wrong, mut largest) = (String::new(), 0.0f64);
    for seed in 0..cases {
        let (what, scene, camera) = random_scene(seed);
        let embree = compare(&scene, &backend(&scene), camera);
        #[cfg(feature = "obvhs")]
        let others = match seed % 4 {
            0 => compare(&scene, &embrasure::accel::bvh::BvhAccel::new(&scene), camera),
            _ => Vec::new(),
        };
        #[cfg(not(feature = "obvhs"))]
        let others = Vec::new();
        for (name, t) in embree.into_iter().chain(others) {
            largest = largest.max(t);
            if t > MAX_T {
                writeln!(wrong, "{what}: {name}: |t| = {t:.1}").unwrap();
            }
        }
    }
    println!("{cases} scenes, largest |t| {largest:.2}");
    assert!(wrong.is_empty(), "{wrong}");
}

/// Texels of waves in both directions, with slopes up to `slope`.
fn waves(slope: f32) -> Vec<[u8; 3]> {
    let n = 16;
    let rise = |i: u32| slope * (std::f32::consts::TAU * i as f32 / n as f32).cos();
    let texel = |i: u32| Vec3::new(-rise(i % n), -rise(i / n), 1.0).normalize();
    let byte = |x: f32| (255.0 * (0.5 + 0.5 * x)).round() as u8;
    (0..n * n).map(|i| texel(i).to_array().map(byte)).collect()
}

/// Asserts that the white `scene` in a white sky has the radiance 1, because nothing absorbs light.
/// Fails if the mean of the image, or of a block, differs from 1. Integrators in `skipped` may
/// differ.
fn assert_white(what: &str, scene: &Scene, camera: CameraParameters, skipped: &[&str]) {
    let size = UVec2::splat(SIZE);
    with_world(scene, camera, size, |world| {
        let path = path_tracer(world, Some(64));
        let spp = budget(64);
        let bdpt = BidirectionalIntegrator {
            world,
            heuristic: Heuristic::Power,
            max_depth: Some(64),
            roulette: Roulette::default(),
        };
        let sppm = ProgressivePhotonIntegrator {
            world,
            strategy: Strategy::default(),
            max_depth: Some(64),
            roulette: Roulette::default(),
            photons: Some(100),
            radius: ProgressiveRadius {
                first: SearchRadius::Fixed(0.01),
                alpha: 1.0,
            },
        };
        let naive = NaiveIntegrator::new(world, Some(64), Roulette::default());
        let all = [
            ("naive", blocks(|seed| film_of(&naive, size, 4 * spp, seed))),
            ("path", blocks(|seed| film_of(&path, size, spp, 50 + seed))),
            (
                "path, reuse",
                blocks(|seed| film_of(&ReusingPathIntegrator { path }, size, spp, 100 + seed)),
            ),
            ("bdpt", blocks(|seed| film_of_iterations(&bdpt, size, spp, 150 + seed))),
            ("sppm", blocks(|seed| film_of_iterations(&sppm, size, spp, 200 + seed))),
        ];
        let white: Blocks = vec![vec![1.0; all[0].1[0].len()]; 2];
        for (name, films) in all.into_iter().filter(|(name, _)| !skipped.contains(name)) {
            let t = largest_t(&white, &films, AllowedDifference::Noise);
            let mean = films.iter().map(|film| film[film.len() - 1]).sum::<f64>() / films.len() as f64;
            println!("{what}, {name}: mean {mean:.5}, largest |t| {t:.2}");
            assert!(
                t < MAX_T && (mean - 1.0).abs() < 0.004,
                "{what}, {name}: {mean}, |t| {t}"
            );
        }
    });
}

#[test]
fn white_waves_in_a_white_sky_are_white() {
    for slope in [0.5, 2.0, 4.0] {
        let folder = tempfile::tempdir().unwrap();
        write_png(&folder.path().join("waves.png"), 16, &waves(slope));
        let obj =
            "v -3 0 3\nv 3 0 3\nv 3 0 -3\nv -3 0 -3\nvt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\nusemtl m\nf 1/1 2/2 3/3 4/4\n";
        fs::write(folder.path().join("scene.obj"), obj).unwrap();
        let toml = "version = 1\n[[object]]\nobj = \"scene.obj\"\n[material.m]\ndiffuse = 1\nnormal_map = \"waves.png\"\n[[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n";
        fs::write(folder.path().join("scene.toml"), toml).unwrap();
        let scene = load(&folder.path().join("scene.toml"));
        let camera = pinhole(Vec3::new(0.0, 0.3, 3.6), Vec3::new(0.0, 0.0, 1.0), 15.0);
        assert_white(&format!("slope {slope}"), &scene, camera, &[]);
    }
}

/// If a ray leaves a triangle to a direction below the plane of the triangle, the ray starts at the
/// height of the curved surface. The origin must not be inside the other ball.
#[test]
fn touching_balls_in_a_white_sky_are_white() {
    let mut obj = String::new();
    ball(&mut obj, Vec3::ZERO, 1.0, 1.0);
    ball(&mut obj, Vec3::new(0.5, 1.2, 0.8), 0.6, 1.0);
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.obj"), obj).unwrap();
    let toml = "version = 1\n[[object]]\nobj = \"scene.obj\"\n[material.ball]\ndiffuse = 1\n[[light]]\ntype = \"constant\"\nradiance = [1, 1, 1]\n";
    fs::write(folder.path().join("scene.toml"), toml).unwrap();
    let scene = load(&folder.path().join("scene.toml"));
    let camera = pinhole(Vec3::new(1.5, 1.5, 2.5), Vec3::new(0.35, 0.8, 0.5), 30.0);
    // Photon mapping treats triangles at an angle of 45° as different surfaces.
    assert_white("balls", &scene, camera, &["sppm"]);
}

/// A lamp and a board are below a floor with steep waves, so no light may reach the camera above.
/// `sppm` stores photons only after their second scattering, so only photons that the board
/// scattered reach the floor.
#[test]
fn light_below_a_bent_floor_does_not_leak() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("waves.png"), 16, &waves(4.0));
    let obj = "v -3 0 3\nv 3 0 3\nv 3 0 -3\nv -3 0 -3\nvt 0 0\nvt 3 0\nvt 3 3\nvt 0 3\nusemtl m\nf 1/1 2/2 3/3 4/4\n\
               v -0.5 -1 0.5\nv 0.5 -1 0.5\nv 0.5 -1 -0.5\nv -0.5 -1 -0.5\nusemtl lamp\nf 5 6 7 8\n\
               v -3 -2 3\nv 3 -2 3\nv 3 -2 -3\nv -3 -2 -3\nusemtl board\nf 9 10 11 12\n";
    fs::write(folder.path().join("scene.obj"), obj).unwrap();
    let toml = "version = 1\n[[object]]\nobj = \"scene.obj\"\n[material.m]\ndiffuse = 1\nnormal_map = \"waves.png\"\n[material.board]\ndiffuse = 1\n[material.lamp]\nemission = [4, 4, 4]\n";
    fs::write(folder.path().join("scene.toml"), toml).unwrap();
    let scene = load(&folder.path().join("scene.toml"));
    let camera = pinhole(Vec3::new(0.0, 0.3, 3.6), Vec3::new(0.0, 0.0, 1.0), 15.0);
    let size = UVec2::splat(SIZE);
    let (max_depth, roulette) = (Some(6), Roulette::after(3));
    let radius = ProgressiveRadius {
        first: SearchRadius::Fixed(0.05),
        alpha: 1.0,
    };
    with_world(&scene, camera, size, |world| {
        let light = LightIntegrator {
            world,
            max_depth,
            roulette,
        };
        let bdpt = BidirectionalIntegrator {
            world,
            heuristic: Heuristic::Power,
            max_depth,
            roulette,
        };
        let vcm = VertexMergingIntegrator {
            world,
            heuristic: Heuristic::Power,
            max_depth,
            roulette,
            photons: Some(2000),
            radius,
        };
        let sppm = ProgressivePhotonIntegrator {
            world,
            strategy: Strategy::default(),
            max_depth,
            roulette,
            photons: Some(2000),
            radius,
        };
        let path = ReusingPathIntegrator {
            path: path_tracer(world, max_depth),
        };
        let mut wrong = String::new();
        for (name, film) in [
            ("light", film_of_iterations(&light, size, 64, 1)),
            ("bdpt", film_of_iterations(&bdpt, size, 64, 2)),
            ("vcm", film_of_iterations(&vcm, size, 64, 3)),
            ("sppm", film_of_iterations(&sppm, size, 64, 4)),
            ("path, reuse", film_of(&path, size, 64, 5)),
        ] {
            let brightest = film.pixels().map(|(_, sums)| sums.mean(1)).fold(0.0, f64::max);
            if brightest > 0.0 {
                writeln!(wrong, "{name}: the brightest pixel is {brightest}").unwrap();
            }
        }
        assert!(wrong.is_empty(), "{wrong}");
    });
}

/// A mirror with tilted normals reflects the light of a lamp onto the floor. Paths from the light
/// multiply this light by the adjoint factor of the mirror. The factor is 0.64 straight above the
/// middle of the lamp.
#[test]
fn light_paths_agree_at_a_bent_mirror() {
    let (scene, camera) = floor_lit_by_a_mirror(25.0);
    let size = UVec2::splat(SIZE);
    with_world(&scene, camera, size, |world| {
        let (max_depth, roulette) = (Some(2), Roulette::default());
        let light = LightIntegrator {
            world,
            max_depth,
            roulette,
        };
        let bdpt = BidirectionalIntegrator {
            world,
            heuristic: Heuristic::Power,
            max_depth,
            roulette,
        };
        let paths = NaiveIntegrator::new(world, max_depth, roulette);
        let mean = |film: Film| Mean::of_film(&film, 1);
        let expected = mean(film_of(&paths, size, 8192, 1));
        assert!(
            expected.error() < 0.01 * expected.value,
            "{expected}: too noisy to tell anything"
        );
        let means = |render: &dyn Fn(u64) -> Film| {
            Mean::of(&(0..16).map(|seed| film_mean(&render(seed), 1)).collect::<Vec<_>>())
        };
        let light = means(&|seed| film_of_iterations(&light, size, 16, 10 + seed));
        let bdpt = means(&|seed| film_of_iterations(&bdpt, size, 16, 50 + seed));
        assert_same_mean("light", light, expected);
        assert_same_mean("bdpt", bdpt, expected);
    });
}
