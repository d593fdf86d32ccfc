//! Spheres, disks and rectangles that emit.

use crate::chi_square::{chi_square, sidak};
use crate::support::program::{INTEGRATORS, done, folder, json, printed, refused, split};
use crate::support::*;
use crate::transport::bidirectional::{assert_same_means, bidirectional, light_tracer, renders};
use embrasure::color::Spectrum;
use embrasure::integrator::{DirectLight, NaiveIntegrator, PathIntegrator, Roulette, Strategy};
use embrasure::light::*;
use embrasure::light_sampling::*;
use embrasure::material::{Gloss, Material};
use embrasure::math::{UVec2, Vec2, Vec3};
use embrasure::sampler::{Dimension, Independent, SampleKey, Sampler};
use embrasure::scene::{DiskParameters, RectangleParameters, Scene, SceneBuilder, SphereParameters};
use std::f64::consts::PI;

fn at(index: u32) -> Vec2 {
    let mut sampler = Independent::new(12);
    sampler.start(SampleKey::new(0, 0, index));
    sampler.get_2d(Dimension::PIXEL)
}

/// Intersection of the line from the origin along `w` with the plane through `q` of normal `n`.
fn on_plane(q: Vec3, n: Vec3, w: Vec3) -> Option<Vec3> {
    let t = q.dot(n) / w.dot(n);
    (t > 0.0).then_some(t * w)
}

/// Samples follow densities that integrate to 1, from near, from afar, and next to the surface.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn directions_follow_their_densities() {
    const SAMPLES: u32 = 1_000_000;
    let mut cases = 0;
    let level = sidak(0.01, 10);
    let mut check = |what: &str, light: &Light, place: &dyn Fn(Vec3) -> Option<Vec3>| {
        let sample = |i| {
            let s = light.sample(Vec3::ZERO, 0.0, at(i), &[])?;
            assert!(s.wi.is_normalized() && s.pdf > 0.0);
            if let Some(q) = place(s.wi) {
                let pdf = light.pdf(Vec3::ZERO, q, s.wi, 0.0);
                assert!((pdf / s.pdf - 1.0).abs() < 2e-3, "{what}: {pdf} {}", s.pdf);
            }
            Some(s.wi)
        };
        let pdf = |w| place(w).map_or(0.0, |q| f64::from(light.pdf(Vec3::ZERO, q, w, 0.0)));
        let outcome = chi_square(SAMPLES, sample, pdf, true);
        println!("{what}: {outcome:?}");
        assert!(outcome.p_value > level, "{what}: {outcome:?}");
        // Samples are taken in the square around a near disk, so they may miss the disk.
        assert!((outcome.integral - outcome.share).abs() < 2e-3, "{what}: {outcome:?}");
        let is_near_disk = what.contains("disk") && outcome.share > 0.78;
        assert!(outcome.share > 0.998 || is_near_disk, "{what}: {outcome:?}");
        cases += 1;
    };
    let center = Vec3::new(0.4, -0.7, 0.8);
    for share in [0.3, 0.9, 0.9999] {
        let radius = share * center.length();
        let light = Light::from(SphereLight::new(center, radius, Spectrum::ONE));
        let depth = 1.0 - (1.0 - f64::from(share).powi(2)).sqrt();
        // For unit vectors, half the squared distance is 1 − cosine.
        let is_met = |w: Vec3| 0.5 * f64::from(w.distance_squared(center.normalize())) < depth;
        check(&format!("sphere {share}"), &light, &|w| is_met(w).then_some(w));
    }
    for (normal, radius) in [
        (-center.normalize(), 0.5),
        (-center.normalize(), 1.3),
        (Vec3::Y, 0.6),
        (Vec3::Y, 4.0),
        (Vec3::Y, 30.0),
    ] {
        let light = Light::from(DiskLight::new(center, normal, radius, Spectrum::ONE));
        let is_on = |q: &Vec3| q.distance(center) < radius;
        check(&format!("disk {radius}"), &light, &|w| {
            on_plane(center, normal, w).filter(is_on)
        });
    }
    let edges = [Vec3::new(1.0, 0.0, -0.5), Vec3::new(0.4, 0.0, 0.8)];
    for (size, corner) in [(1.0, center), (4.0, Vec3::new(-3.0, -0.4, -1.0))] {
        let edges = edges.map(|edge| size * edge);
        let [a, b] = edges;
        let light = RectangleLight::new(corner, [b, a], Spectrum::ONE);
        let is_on = |q: &Vec3| {
            let to = *q - corner;
            [a, b].iter().all(|e| (0.0..e.length_squared()).contains(&to.dot(*e)))
        };
        let normal = a.cross(b).normalize();
        check(&format!("rectangle {size}"), &Light::from(light), &|w| {
            on_plane(corner, normal, w).filter(is_on)
        });
    }
    assert_eq!(cases, 10);
}

/// Closed forms equal sums over samples, even if the horizon cuts the lamp. Densities of samples
/// equal the densities for MIS.
#[test]
fn irradiance_matches_the_sum_of_samples() {
    let up = Vec3::Y;
    let lights = [
        Light::from(SphereLight::new(Vec3::new(0.5, 0.8, -0.4), 0.5, Spectrum::splat(3.0))),
        Light::from(SphereLight::new(Vec3::new(0.5, 0.2, -0.4), 0.5, Spectrum::splat(3.0))),
        Light::from(SphereLight::new(Vec3::new(0.5, -0.3, -0.4), 0.5, Spectrum::splat(3.0))),
        Light::from(DiskLight::new(
            Vec3::new(0.5, 0.8, -0.4),
            Vec3::NEG_Y,
            0.7,
            Spectrum::splat(3.0),
        )),
        Light::from(DiskLight::new(
            Vec3::new(0.5, 0.2, -0.4),
            Vec3::new(-0.8, -0.6, 0.0),
            0.7,
            Spectrum::splat(3.0),
        )),
        Light::from(RectangleLight::new(
            Vec3::new(-0.5, 0.9, -0.6),
            [Vec3::new(1.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.9)],
            Spectrum::splat(3.0),
        )),
        // From afar rectangles are sampled by area.
        Light::from(RectangleLight::new(
            Vec3::new(3.0, 90.0, -40.0),
            [Vec3::new(1.2, 0.0, 0.0), Vec3::new(0.0, 0.3, 0.9)],
            Spectrum::splat(3.0),
        )),
        Light::from(SphereLight::new(
            Vec3::new(300.0, 9000.0, -4000.0),
            0.5,
            Spectrum::splat(3e6),
        )),
    ];
    for (i, light) in lights.iter().enumerate() {
        const N: usize = 1500;
        let place = |i: usize| (i as f32 + 0.5) / N as f32;
        let mut sum = 0.0;
        for i in 0..N * N {
            let u = Vec2::new(place(i % N), place(i / N));
            if let Some(sample) = light.sample(Vec3::ZERO, 0.0, u, &[]) {
                if let Some(q) = sample.target.filter(|_| i % 101 == 0) {
                    let pdf = light.pdf(Vec3::ZERO, q, sample.wi, 0.0);
                    assert!((pdf / sample.pdf - 1.0).abs() < 5e-3, "{light:?}: {pdf} {}", sample.pdf);
                }
                sum += f64::from(sample.radiance.mean() * sample.wi.dot(up).max(0.0)) / f64::from(sample.pdf);
            }
        }
        let sampled = sum / (N * N) as f64;
        let closed = f64::from(light.irradiance_at(Vec3::ZERO, up, 0.0).unwrap().mean());
        println!("{i}: {sampled} {closed}");
        assert!(
            (sampled / closed - 1.0).abs() < 1e-3 && closed > 0.0,
            "{i}: {sampled}, {closed}"
        );
    }
}

/// A floor of albedo 0.5, and lamps above it. The camera is between floor and lamps, and does not
/// see the lamps.
fn floor(lights: &str) -> tempfile::TempDir {
    let toml = "version = 1\n[camera]\nposition = [0, 0.5, 0]\nlook_at = [0, 0, 0]\nup = [0, 0, -1]\nvertical_fov = 40\n[image]\nwidth = 8\nheight = 8\n[[object]]\nobj = 'a.obj'\n";
    folder(&[
        (
            "a.obj",
            "mtllib a.mtl\nusemtl grey\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nf 1 2 3 4\n",
        ),
        ("a.mtl", "newmtl grey\nKd 0.5 0.5 0.5\n"),
        ("s.toml", &format!("{toml}{lights}")),
    ])
}

fn mean(folder: &std::path::Path, flags: &str) -> f64 {
    done(
        folder,
        &[&split("render s.toml -q -o x.exr")[..], &split(flags)].concat(),
    );
    let values = &read_rgb(&folder.join("x.exr"))[0];
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

/// Mean over the visible part of the floor, a square of half width `half`.
fn mean_over_view(irradiance: impl Fn(f64, f64) -> f64) -> f64 {
    const N: usize = 200;
    let half = 0.5 * 20f64.to_radians().tan();
    let place = |i: usize| half * ((2 * i + 1) as f64 / N as f64 - 1.0);
    (0..N * N).map(|i| irradiance(place(i % N), place(i / N))).sum::<f64>() / (N * N) as f64
}

const SPHERE: &str = "[[light]]\ntype = 'sphere'\nposition = [0.5, 1.5, 0]\nradius = 0.4\nradiance = [3, 3, 3]\n";
const DISK: &str =
    "[[light]]\ntype = 'disk'\nposition = [0.5, 1.5, 0]\ndirection = [0, -1, 0]\nradius = 0.4\nradiance = [3, 3, 3]\n";

/// Radiance of the floor below these lamps: `E ρ / π`.
fn expected() -> [f64; 2] {
    let (height, radius, radiance) = (1.5, 0.4, 3.0);
    let sphere = mean_over_view(|x, z| {
        let squared = (x - 0.5).powi(2) + z * z + height * height;
        PI * radiance * radius * radius * height / squared.powf(1.5)
    });
    // Irradiance from a disk parallel to the plane (Foote 1915; Howell, "Radiation Heat Transfer
    // Configuration Factors", B-13)
    let disk = mean_over_view(|x, z| {
        let a2 = (x - 0.5).powi(2) + z * z;
        let (h2, r2) = (height * height, radius * radius);
        0.5 * PI * radiance * (1.0 - (h2 + a2 - r2) / ((h2 + a2 + r2).powi(2) - 4.0 * a2 * r2).sqrt())
    });
    [sphere, disk].map(|e| 0.5 * e / PI)
}

#[test]
fn floor_irradiance_matches_closed_forms() {
    for (lamp, expected) in [SPHERE, DISK].into_iter().zip(expected()) {
        let folder = floor(lamp);
        for flags in [
            "",
            "--direct light",
            "--direct none --spp 65536",
            "--light-selection all",
            "--backend obvhs",
        ] {
            if flags.contains("obvhs") && !cfg!(feature = "obvhs") {
                continue;
            }
            let found = mean(folder.path(), &format!("--integrator direct {flags}"));
            println!("{flags}: {found} {expected}");
            assert!(
                (found / expected - 1.0).abs() < 3e-3,
                "{lamp} {flags}: {found}, not {expected}"
            );
        }
    }
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn every_integrator_finds_shaped_lamps() {
    for (lamp, expected) in [SPHERE, DISK].into_iter().zip(expected()) {
        let folder = floor(lamp);
        for integrator in INTEGRATORS
            .iter()
            .filter(|name| !matches!(**name, "ao" | "debug" | "area"))
        {
            let (samples, tolerance) = match *integrator {
                "naive" => (budget(16384), 0.03 * slack()),
                // Only a few hundred of a million paths of these integrators bring light to such a
                // small view.
                "light" => (budget(1 << 15), 0.05 * slack()),
                "pssmlt" | "mlt" => (budget(512), 0.04 * slack()),
                "sppm" | "photon-map" | "vcm" => (16, 0.06),
                _ => (256, 0.02),
            };
            let radius = match *integrator {
                "sppm" | "vcm" => "--photon-radius 0.02 --photons 100000",
                _ => "",
            };
            let found = mean(
                folder.path(),
                &format!("--integrator {integrator} --spp {samples} {radius}"),
            );
            println!("{integrator}: {found} {expected}");
            assert!(
                (found / expected - 1.0).abs() < tolerance,
                "{integrator}: {found}, not {expected}"
            );
        }
        let text = refused(folder.path(), &split("render s.toml -q -o x.exr --integrator area"), 2);
        assert!(text.contains("area") && text.contains("help"), "{text}");
    }
    // Lamps are objects with names, and each is one light.
    let folder = floor(&format!("{SPHERE}group = 'ball'\n{DISK}"));
    let info = json(&done(folder.path(), &split("info s.toml --json")));
    assert_eq!([&info["lights"]["sphere"], &info["lights"]["disk"]], [1, 1]);
    assert_eq!(info["materials"][1]["name"], "sphere light");
    // A sphere has four times the area and the power of a disk of its radius. The power is π L A.
    let area = PI * 0.4 * 0.4;
    for (lamp, (name, factor)) in [("sphere light", 4.0), ("disk light", 1.0)].into_iter().enumerate() {
        let lamp = &info["lamps"][lamp];
        let near = |key: &str, expected: f64| (lamp[key].as_f64().unwrap() / expected - 1.0).abs() < 1e-5;
        assert_eq!(
            (&lamp["material"], &lamp["lights"]),
            (&name.into(), &1.into()),
            "{lamp}"
        );
        assert!(
            near("area", factor * area) && near("power", factor * area * 3.0 * PI),
            "{lamp}"
        );
    }
    let text = printed(&done(folder.path(), &split("info s.toml")));
    assert!(
        text.contains("sphere light: 1 light, area 2.010619, power 18.94964 (80.0 % of the lamps)"),
        "{text}"
    );
    let check = printed(&done(folder.path(), &split("check s.toml")));
    assert!(check.contains("0 errors, 1 warning"), "{check}");
}

/// A room with all three kinds of shaped lamps, a glossy block and a ball of glass. The hulls of
/// the lamps (meshes around them, for the backends) overlap other objects.
fn lamp_room() -> Scene {
    let mut b = SceneBuilder::new();
    add(&mut b, room(), material(0.5, 0.0));
    let glossy = Material {
        specular: Spectrum::splat(0.5),
        gloss: Gloss::Phong(30.0),
        ..material(0.3, 0.0)
    };
    add(
        &mut b,
        slab(Vec3::new(-0.4, -0.7, -0.3), Vec3::new(0.2, 0.3, 0.2)),
        glossy,
    );
    let glass = Material {
        transmission: Spectrum::splat(0.9),
        ..material(0.0, 0.0)
    };
    add(&mut b, sphere(0.25, Vec3::new(0.4, -0.7, 0.1), 2), glass);
    // The lamp stands on the block, and its hull intersects the block.
    let lamp = SphereParameters {
        position: Vec3::new(-0.4, -0.25, -0.3),
        radius: 0.15,
        radiance: Spectrum::rgb(3.0, 2.0, 1.0),
    };
    b.add_sphere(&lamp).unwrap();
    let disk = DiskParameters {
        position: Vec3::new(0.5, 0.6, -0.6),
        direction: Vec3::new(-0.3, -0.8, 0.6),
        radius: 0.3,
        radiance: Spectrum::splat(2.0),
    };
    b.add_disk(&disk).unwrap();
    let rectangle = RectangleParameters {
        position: Vec3::new(-0.99, 0.3, 0.2),
        direction: Vec3::X,
        size: [0.8, 0.5],
        up: None,
        radiance: Spectrum::rgb(0.5, 1.0, 1.5),
    };
    b.add_rectangle(&rectangle).unwrap();
    b.build().unwrap().0
}

/// All light sampling strategies for these lamps give one image, which also shows the lamps.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn estimators_agree_on_shaped_lamps() {
    let resolution = UVec2::splat(8);
    let camera = pinhole(Vec3::new(0.1, 0.2, 0.95), Vec3::new(0.0, -0.2, 0.0), 80.0);
    let scene = lamp_room();
    assert_eq!(scene.lights().len(), 3);
    with_world(&scene, camera, resolution, |world| {
        let path = |direct| PathIntegrator {
            strategy: Strategy {
                direct,
                ..Strategy::default()
            },
            ..path_tracer(world, Some(4))
        };
        let expected = renders(|seed| film_of(&path(DirectLight::Mis), resolution, budget(512), seed));
        let reusing = PathTracer {
            path: path(DirectLight::Mis),
            reuse: true,
        };
        let reused = renders(|seed| film_of(&reusing, resolution, budget(256), 50 + seed));
        assert_same_means("reuse", &reused, &expected);
        let naive = NaiveIntegrator::new(world, Some(4), Roulette::default());
        let blind = renders(|seed| film_of(&naive, resolution, budget(8192), 100 + seed));
        assert_same_means("naive", &blind, &expected);
        let films = renders(|seed| film_of_iterations(&bidirectional(world, 4), resolution, budget(192), 150 + seed));
        assert_same_means("bdpt", &films, &expected);
    });
    let of_all = with_world((&scene, SelectionMode::All), camera, resolution, |world| {
        renders(|seed| film_of(&path_tracer(world, Some(4)), resolution, budget(256), 200 + seed))
    });
    let expected = with_world(&scene, camera, resolution, |world| {
        renders(|seed| film_of(&path_tracer(world, Some(4)), resolution, budget(512), 250 + seed))
    });
    assert_same_means("all lamps", &of_all, &expected);
    // From above, the camera sees no glass or mirror.
    let from_above = pinhole(Vec3::new(0.2, 0.9, 0.6), Vec3::new(-0.4, -1.0, 0.8), 30.0);
    with_world(&scene, from_above, resolution, |world| {
        let expected = renders(|seed| film_of(&path_tracer(world, Some(2)), resolution, budget(512), seed));
        let films = renders(|seed| film_of_iterations(&light_tracer(world, 2), resolution, budget(512), seed));
        assert_same_means("light tracing", &films, &expected);
    });
}
