//! Sphere and disk lights that are small or far from the origin, covered lamps, and black lights.

use crate::support::program::{done, folder, json, printed, refused, split};
use crate::support::*;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;
use tempfile::TempDir;

/// A floor of albedo 0.5 at the height `offset` around (`offset`, `offset`, 0), and `lights` above
/// it.
fn floor_at(offset: f32, lights: &str) -> TempDir {
    let mut obj = String::from("mtllib a.mtl\nusemtl grey\n");
    for [x, z] in [[-2.0, 2.0], [2.0, 2.0], [2.0, -2.0], [-2.0, -2.0]] {
        writeln!(obj, "v {} {offset} {z}", x + offset).unwrap();
    }
    obj += "f 1 2 3 4\n";
    let toml = format!(
        "version = 1\n[camera]\nposition = [{offset}, {}, 0]\nlook_at = [{offset}, {offset}, 0]\n\
         up = [0, 0, -1]\nvertical_fov = 40\n[image]\nwidth = 8\nheight = 8\n[[object]]\nobj = 'a.obj'\n{lights}",
        offset + 0.5
    );
    folder(&[
        ("a.obj", &obj),
        ("a.mtl", "newmtl grey\nKd 0.5 0.5 0.5\n"),
        ("s.toml", &toml),
    ])
}

fn mean(folder: &Path, flags: &str) -> f64 {
    done(
        folder,
        &[&split("render s.toml -q -o x.exr")[..], &split(flags)].concat(),
    );
    let values = &read_rgb(&folder.join("x.exr"))[0];
    values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
}

/// Mean radiance of the visible floor below a lamp that is 1.5 above it and 0.5 to the right.
/// `strength` is radiance × radius². Disks face down.
fn expected(kind: &str, strength: f64) -> f64 {
    const N: usize = 200;
    let half = 0.5 * 20f64.to_radians().tan();
    let place = |i: usize| half * ((2 * i + 1) as f64 / N as f64 - 1.0);
    let (height, power) = (1.5f64, if kind == "disk" { 2 } else { 1 });
    let irradiance = |x: f64, z: f64| {
        let squared = (x - 0.5).powi(2) + z * z + height * height;
        PI * strength / squared * (height / squared.sqrt()).powi(power)
    };
    let sum: f64 = (0..N * N).map(|i| irradiance(place(i % N), place(i / N))).sum();
    0.5 * sum / (N * N) as f64 / PI
}

fn lamp(kind: &str, offset: f32, radius: f64, strength: f64) -> String {
    let direction = if kind == "disk" { "direction = [0, -1, 0]\n" } else { "" };
    let radiance = strength / (radius * radius);
    format!(
        "[[light]]\ntype = '{kind}'\nposition = [{}, {}, 0]\nradius = {radius:e}\nradiance = {radiance:e}\n{direction}",
        offset + 0.5,
        offset + 1.5
    )
}

/// The radius 10⁻⁶ is an eighth of the spacing of floats at 70, the position of the lamp.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn tiny_lamp_lights_a_floor_in_every_integrator() {
    let estimators = [
        ("--spp 64", 2e-3),
        ("--spp 64 --integrator path --reuse none", 2e-3),
        ("--spp 64 --integrator direct --direct light", 2e-3),
        ("--spp 64 --light-selection all", 2e-3),
        ("--spp 256 --integrator bdpt", 0.02),
        ("--spp 64 --integrator vcm --photon-radius 0.02 --photons 20000", 0.06),
    ];
    for kind in ["sphere", "disk"] {
        let (right, lamp) = (expected(kind, 3.0), lamp(kind, 70.0, 1e-6, 3.0));
        let folder = floor_at(70.0, &lamp);
        for (flags, tolerance) in estimators {
            for backend in ["embree", "obvhs"] {
                if backend == "obvhs" && !cfg!(feature = "obvhs") {
                    continue;
                }
                let found = mean(folder.path(), &format!("{flags} --backend {backend}"));
                println!("{kind} {flags} {backend}: {found} {right}");
                let error = (found / right - 1.0).abs();
                assert!(error < tolerance, "{kind} {flags} {backend}: {found}, not {right}");
            }
        }
        let flags = format!("--integrator light --spp {}", budget(1 << 15));
        let found = mean(folder.path(), &flags);
        assert!(
            (found / right - 1.0).abs() < 0.05 * slack(),
            "{kind} {flags}: {found}, not {right}"
        );
        let check = printed(&done(folder.path(), &split("check s.toml")));
        assert!(check.contains("0 errors, 1 warning"), "{check}");
        let info = json(&done(folder.path(), &split("info s.toml --json")));
        assert_eq!(info["lights"][kind], 1);
    }
}

/// Rays that hit the lamp by chance find the same light as light samples. The radius 0.02 is 300
/// times the spacing of floats at 1000.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn lamp_far_from_the_origin_is_unbiased() {
    for kind in ["sphere", "disk"] {
        let folder = floor_at(1000.0, &lamp(kind, 1000.0, 0.02, 1.0));
        let sampled = mean(folder.path(), "--integrator direct --direct light --spp 256");
        for backend in ["embree", "obvhs"] {
            if backend == "obvhs" && !cfg!(feature = "obvhs") {
                continue;
            }
            // The lamp covers 2·10⁻⁴ of the hemisphere: some 3000 of these rays hit it.
            let found = mean(
                folder.path(),
                &format!("--integrator direct --direct none --spp 262144 --backend {backend}"),
            );
            println!("{kind} {backend}: {found} {sampled} {}", expected(kind, 1.0));
            assert!(
                (found / sampled - 1.0).abs() < 0.08,
                "{kind} {backend}: {found}, not {sampled}"
            );
            assert!((sampled / expected(kind, 1.0) - 1.0).abs() < 0.01, "{kind}: {sampled}");
        }
    }
}

/// Backends trace a hull instead of a sphere light: a polyhedron around the sphere. Its corners are
/// 1.8 % of the radius above the sphere. The cover is between such a corner and the sphere.
#[test]
fn cover_inside_the_lamp_hull_hides_the_lamp() {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let length = (1.0 + golden * golden).sqrt();
    let [y, z] = [1.0 / length, golden / length];
    // A square at the distance 1.006 along a corner of the hull, (0, y, z)
    let mut obj = String::from("usemtl black\n");
    for [a, b] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
        let (a, b) = (0.08 * a, 0.08 * b);
        writeln!(obj, "v {a} {} {}", 1.006 * y + b * z, 1.006 * z - b * y).unwrap();
    }
    obj += "f 1 2 3 4\n";
    let toml = format!(
        "version = 1\n[camera]\nposition = [0, {}, {}]\nlook_at = [0, 0, 0]\nvertical_fov = 1\n\
         [image]\nwidth = 8\nheight = 8\n[[object]]\nobj = 'a.obj'\n[material.black]\ndiffuse = 0.0\n\
         [[light]]\ntype = 'sphere'\nposition = [0, 0, 0]\nradius = 1\nradiance = 1\n",
        3.0 * y,
        3.0 * z
    );
    let folder = folder(&[("a.obj", &obj), ("s.toml", &toml)]);
    for flags in ["", "--integrator naive", "--integrator bdpt", "--backend brute"] {
        let found = mean(folder.path(), &format!("--spp 16 {flags}"));
        assert_eq!(found, 0.0, "{flags}");
    }
    // Without the cover the lamp fills the view.
    std::fs::write(
        folder.path().join("a.obj"),
        "usemtl black\nv 9 9 9\nv 9 9 8\nv 9 8 9\nf 1 2 3\n",
    )
    .unwrap();
    for flags in ["", "--integrator naive", "--integrator bdpt"] {
        let found = mean(folder.path(), &format!("--spp 16 {flags}"));
        assert!((found - 1.0).abs() < 1e-5, "{flags}: {found}");
    }
}

#[test]
fn scene_with_black_lights_stays_dark() {
    let lights = [
        "type = 'point'\nposition = [0, 1, 0]\nintensity = 0",
        "type = 'constant'\nradiance = 0",
        "type = 'sphere'\nposition = [0, 1, 0]\nradius = 0.1\nradiance = 0",
        "type = 'rectangle'\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nsize = [1, 1]\nradiance = 0",
        "type = 'sky'\nscale = 0",
    ];
    for light in lights {
        let folder = floor_at(0.0, &format!("[[light]]\n{light}\n"));
        let check = printed(&done(folder.path(), &split("check s.toml")));
        assert!(
            check.contains("[no-light]") && !check.contains("[default-light]"),
            "{light}: {check}"
        );
        for integrator in ["path", "bdpt", "light", "naive", "sppm"] {
            let found = mean(folder.path(), &format!("--spp 4 --integrator {integrator}"));
            assert_eq!(found, 0.0, "{light} {integrator}");
        }
    }
    // A scene without lights gets the default light.
    let check = printed(&done(floor_at(0.0, "").path(), &split("check s.toml")));
    assert!(
        check.contains("[default-light]") && !check.contains("[no-light]"),
        "{check}"
    );
}

#[test]
fn emitter_without_area_adds_no_default_light() {
    let folder = floor_at(0.0, "");
    let obj = std::fs::read_to_string(folder.path().join("a.obj")).unwrap();
    std::fs::write(
        folder.path().join("a.obj"),
        obj + "usemtl lamp\nv 0 1 0\nv 0 1 0\nv 1 1 0\nf 5 6 7\n",
    )
    .unwrap();
    std::fs::write(
        folder.path().join("a.mtl"),
        "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 5 5 5\n",
    )
    .unwrap();
    let check = printed(&done(folder.path(), &split("check s.toml")));
    for code in ["[lost-emitter]", "[no-light]"] {
        assert!(check.contains(code), "{code}: {check}");
    }
    assert!(!check.contains("[default-light]"), "{check}");
    assert_eq!(mean(folder.path(), "--spp 4"), 0.0);
}

#[test]
fn tiny_rectangle_light_is_an_error() {
    let light = "[[light]]\ntype = 'rectangle'\nposition = [70, 70, 0]\ndirection = [0, -1, 0]\nsize = [1e-7, 1e-7]\nradiance = 1\n";
    let folder = floor_at(70.0, light);
    let text = refused(folder.path(), &split("render s.toml -q -o x.exr"), 1);
    assert!(
        text.contains("size is [0.0000001, 0.0000001], but is too small"),
        "{text}"
    );
}
