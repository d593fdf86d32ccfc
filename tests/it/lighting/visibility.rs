//! Sampling of skies and lights by visibility: densities, and means against selection by power. The
//! number of threads and the parts of a render change no bit of the image.

use crate::chi_square::{chi_square, sidak};
use crate::support::program::{assert_same_bits, done, folder, json, split};
use crate::support::statistics::{Mean, assert_same_mean};
use embrasure::color::Spectrum;
use embrasure::light::*;
use embrasure::light_sampling::*;
use embrasure::math::{Bounds3, Quat, Vec2, Vec3};
use embrasure::sampler::{Dimension, Independent, SampleKey, Sampler};
use tempfile::TempDir;

fn at(index: u32) -> Vec2 {
    let mut sampler = Independent::new(12);
    sampler.start(SampleKey::new(0, 0, index));
    sampler.get_2d(Dimension::PIXEL)
}

fn constant() -> Light {
    Light::Constant(ConstantLight {
        radiance: Spectrum::ONE,
    })
}

/// A map with a black part and a small sun.
fn map(width: usize, height: usize) -> Light {
    let texel = |i: usize| match (i % width, i / width) {
        (x, y) if (x, y) == (width / 3, height / 4) => Spectrum::splat(80.0),
        (x, y) if y < height / 2 => Spectrum::splat(0.2 + 0.1 * x as f32),
        (x, _) if x < width / 3 => Spectrum::splat(0.3),
        _ => Spectrum::ZERO,
    };
    let image = LatLongImage {
        width,
        height,
        texels: (0..width * height).map(texel).collect(),
    };
    Light::Environment(Box::new(EnvironmentLight::new(image, 1.5, Quat::from_rotation_x(0.4))))
}

/// Light selection that has learned visibility in a cube of side 2. In one half, directions near +x
/// are visible. In the other half, directions near −z are visible.
fn learned(lights: &[Light]) -> LightSelection {
    let points: Vec<Vec3> = (0..4000)
        .map(|i| (2.0 * Vec3::from(at(i).extend(at(i + 5000).x)) - 1.0).normalize())
        .collect();
    let bounds = [Vec3::NEG_ONE, Vec3::ONE].into_iter().collect::<Bounds3>();
    let selection = LightSelection::new(SelectionMode::Visibility, lights, bounds, 2.0);
    let grid = selection.visibility_grid(lights, &points, 100_000).unwrap();
    let mut side = vec![false; grid.cells()];
    points.iter().for_each(|p| {
        if let Some(cell) = grid.cell(*p) {
            side[cell] = p.x > 0.0;
        }
    });
    let mut found = Vec::new();
    for &side in &side {
        for target in grid.targets() {
            let sample = grid.sample_target(lights, target, Vec3::ZERO, 0.0, Vec2::splat(0.5), &[]);
            let towards = if side { Vec3::X } else { Vec3::NEG_Z };
            found.push(sample.map_or(0.0, |s| f32::from(u8::from(s.wi.dot(towards) > 0.9))));
        }
    }
    let counts = vec![1; grid.cells()];
    selection.learn(Some(grid.with_visibility(&found, &counts)));
    selection
}

/// Calls `check` for each light whose visibility is learned, with contexts in known and in unknown
/// cells.
fn for_each_context(check: impl Fn(&str, &dyn Fn(u32) -> Option<LightSample>, &dyn Fn(Vec3) -> f32)) {
    for light in [constant(), map(64, 32), map(7, 3)] {
        let lights = [light];
        let selection = learned(&lights);
        let id = LightId(0);
        for (p, n) in [
            (Vec3::X, Vec3::X),
            (Vec3::new(-0.6, 0.64, 0.48), Vec3::ZERO),
            // No visibility was learned for points in the middle of the cube.
            (Vec3::splat(0.01), Vec3::Y),
        ] {
            let context = LightSampleContext { p, n };
            let sample = |i| selection.sample_light(&lights, id, &context, 0.0, at(i), &[]);
            let pdf = |wi: Vec3| {
                lights[0].pdf(Vec3::ZERO, Vec3::ZERO, wi, 0.0) * selection.pdf_factor(&lights, id, &context, wi)
            };
            check(&format!("{} at {p}, {n}", lights[0].kind()), &sample, &pdf);
        }
    }
}

/// In each cell and for each normal, samples follow the density, which integrates to 1.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn visibility_directions_follow_their_density() {
    let samples = crate::support::budget(200_000);
    let level = sidak(0.01, 9);
    for_each_context(|what, sample, pdf| {
        let outcome = chi_square(samples, |i| Some(sample(i)?.wi), |w| pdf(w) as f64, true);
        assert!(outcome.p_value > level, "{what}: {outcome:?}");
        assert!((outcome.integral - 1.0).abs() < 5e-3, "{what}: {outcome:?}");
    });
}

#[test]
fn samples_by_visibility_have_mis_densities() {
    const SAMPLES: u32 = 20_000;
    for_each_context(|what, sample, pdf| {
        let samples = (0..SAMPLES).filter_map(sample);
        let differ = samples.filter(|s| (pdf(s.wi) / s.pdf - 1.0).abs() > 1e-2).count();
        // Rounding puts some directions into the next bin or texel.
        assert!(differ < SAMPLES as usize / 4000, "{what}: {differ}");
    });
}

/// Most samples of the sky have directions in which the sky is visible. Lights are chosen as often
/// as their probabilities say.
#[test]
fn choices_follow_visibility() {
    let lights = [constant()];
    let selection = learned(&lights);
    let seen = |p: Vec3, towards: Vec3| {
        let context = LightSampleContext { p, n: Vec3::ZERO };
        let towards = |i: &u32| {
            let sample = selection.sample_light(&lights, LightId(0), &context, 0.0, at(*i), &[]);
            sample.unwrap().wi.dot(towards) > 0.8
        };
        (0..1000).filter(towards).count()
    };
    let [there, not] = [seen(Vec3::X, Vec3::X), seen(Vec3::NEG_X, Vec3::X)];
    assert!(there > 800 && not < 50, "{there} {not}");

    let lamp = |x: f32| {
        Light::Point(PointLight {
            position: Vec3::new(x, 0.0, 0.0),
            intensity: Spectrum::ONE,
        })
    };
    let lights = [lamp(-0.5), constant(), lamp(0.7)];
    let selection = learned(&lights);
    for (p, n) in [(Vec3::X, Vec3::X), (Vec3::NEG_X, Vec3::Y), (Vec3::splat(0.01), Vec3::Y)] {
        let context = LightSampleContext { p, n };
        const DRAWS: u32 = 100_000;
        let mut counts = [0_usize; 3];
        for i in 0..DRAWS {
            let (id, pmf) = selection.sample(&lights, &context, at(i).x).unwrap();
            assert_eq!(pmf, selection.pmf(&lights, &context, id));
            counts[id.0 as usize] += 1;
        }
        for (id, count) in (0..).map(LightId).zip(counts) {
            let expected = f64::from(selection.pmf(&lights, &context, id)) * f64::from(DRAWS);
            assert_same_mean(
                format!("{p}, {id:?}"),
                Mean::of_events(count, expected),
                Mean::exact(expected),
            );
        }
    }
}

/// A room that sees the sky through a window behind the camera, with a lamp under its ceiling if
/// `has_lamp`.
fn room(lights: &str, has_lamp: bool) -> TempDir {
    const OBJ: &str = "\
v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
v -0.3 0 1\nv 0.3 0 1\nv 0.3 0.5 1\nv -0.3 0.5 1\n\
v -0.2 0.9 -0.2\nv 0.2 0.9 -0.2\nv 0.2 0.9 0.2\nv -0.2 0.9 0.2\n\
usemtl w\nf 1 2 3 4\nf 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\n\
f 5 6 10 9\nf 6 7 11 10\nf 7 8 12 11\nf 8 5 9 12\n";
    let lamp = if has_lamp { "usemtl l\nf 13 14 15 16\n" } else { "" };
    let scene = format!(
        "version = 1\n[[object]]\nobj = \"r.obj\"\n[camera]\nposition = [0, 0, 0.9]\nlook_at = [0, -0.3, -1]\nvertical_fov = 70\n\
[image]\nwidth = 24\nheight = 16\n[material.w]\ndiffuse = 0.6\n[material.l]\ndiffuse = 0.0\nemission = 2.0\n{lights}"
    );
    folder(&[("r.obj", &format!("{OBJ}{lamp}")), ("s.toml", &scene)])
}

const SKY: &str = "[[light]]\ntype = \"sky\"\n";
const SUN: &str =
    "[[light]]\ntype = \"directional\"\ndirection = [0.1, -0.4, -1]\nirradiance = [2, 2, 2]\nangle = 2.0\n";

/// Selection by visibility has the same mean as selection by power, in each integrator.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn pictures_by_visibility_are_unbiased() {
    for (lights, has_lamp) in [(SKY.to_string(), false), (format!("{SKY}{SUN}"), true)] {
        let folder = room(&lights, has_lamp);
        let render = |flags: &str| done(folder.path(), &split(&format!("render s.toml -q {flags}")));
        render("--spp 4096 --light-selection power --seed 1 -o power.exr");
        for flags in [
            "--spp 512",
            "--spp 512 --reuse none",
            "--spp 256 --integrator bdpt",
            "--spp 64 --integrator distributed --tree-depth 16 --branching 1",
        ] {
            render(&format!("{flags} --light-selection visibility --seed 2 -o visible.exr"));
            // `compare` fails if the difference exceeds the noise.
            let compared = json(&done(folder.path(), &split("compare power.exr visible.exr --json")));
            println!("{flags}: {compared}");
        }
    }
}

/// The number of threads, interruptions, and the parts and crops of a render change no bit of the
/// image, because learned visibility depends only on the scene.
#[test]
fn threads_and_parts_change_no_bit() {
    let folder = room(&format!("{SKY}{SUN}"), true);
    let run = |line: &str| done(folder.path(), &split(&format!("{line} -q")));
    let file = |name: &str| folder.path().join(name);
    run("render s.toml --spp 128 --threads 2 -o whole.exr");
    for threads in [1, 3] {
        run(&format!("render s.toml --spp 128 --threads {threads} -o again.exr"));
        assert_same_bits(&file("whole.exr"), &file("again.exr"));
    }
    run("render s.toml --spp 64 --checkpoint c.exr -o half.exr");
    run("render s.toml --spp 128 --checkpoint c.exr --resume -o resumed.exr");
    assert_same_bits(&file("whole.exr"), &file("resumed.exr"));
    run("render s.toml --spp 128 --samples 0..64 -o a.exr");
    run("render s.toml --spp 128 --samples 64..128 --threads 1 -o b.exr");
    run("merge a.exr b.exr -o merged.exr");
    assert_same_bits(&file("whole.exr"), &file("merged.exr"));
    run("render s.toml --spp 128 --crop 0,0,24,7 -o top.exr");
    run("render s.toml --spp 128 --crop 0,7,24,16 -o bottom.exr");
    run("merge top.exr bottom.exr -o joined.exr");
    assert_same_bits(&file("whole.exr"), &file("joined.exr"));
}
