//! Light groups: the light of each group, and their sum. The bits are the same for any number of
//! threads, for merged parts of a render, and after interruptions.

use crate::support::statistics::{Mean, assert_same_mean};
use crate::support::*;
use embrasure::color::Spectrum;
use embrasure::film::{Film, Rect};
use embrasure::geometry::Mesh;
use embrasure::integrator::*;
use embrasure::light::LightId;
use embrasure::light_sampling::SelectionMode;
use embrasure::material::{Gloss, Material};
use embrasure::math::{UVec2, Vec3};
use embrasure::pipeline::CompiledIntegrator;
use embrasure::render::render;
use embrasure::sampler::{SampleKey, Sampler, Sobol};
use embrasure::scene::{Scene, SceneBuilder};
use embrasure::scene_file::{SceneFile, inspect_scene, load_scene};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// The image has one whole tile, and parts of three other tiles.
const RESOLUTION: UVec2 = UVec2::new(21, 18);
/// Light groups of [`stage`], in this order; the second lamp is in no group.
const NAMES: [&str; 4] = ["lamp", "key", "sky", "default"];

/// A matte corner with a mirror and a glass ball, lit by two lamps that also reflect light, a point
/// light and a sky. `shining` has true for each light that emits.
fn stage(shining: [bool; 4]) -> Scene {
    let [lamp, key, sky, other] = shining;
    let mut b = SceneBuilder::new();
    let quad = |at: [[f32; 3]; 4]| polygon(&at.map(Vec3::from));
    let ceiling = |x: f32| quad([[x, 1.0, 0.0], [x, 1.0, 0.6], [x - 0.6, 1.0, 0.6], [x - 0.6, 1.0, 0.0]]);
    let emission = |shines: bool, color: Spectrum| if shines { color } else { Spectrum::ZERO };
    let matte = Material {
        diffuse: Spectrum::rgb(0.7, 0.5, 0.4),
        ..material(0.0, 0.0)
    };
    let floor = quad([
        [-1.5, -1.0, 1.5],
        [1.5, -1.0, 1.5],
        [1.5, -1.0, -1.0],
        [-1.5, -1.0, -1.0],
    ]);
    let wall = quad([
        [-1.5, -1.0, -1.0],
        [1.5, -1.0, -1.0],
        [1.5, 1.2, -1.0],
        [-1.5, 1.2, -1.0],
    ]);
    add(&mut b, floor, matte.clone());
    add(&mut b, wall, matte);
    let mirror = Material {
        specular: Spectrum::splat(0.8),
        gloss: Gloss::Mirror(embrasure::bsdf::Fresnel::Full),
        ..material(0.0, 0.0)
    };
    let side = quad([
        [-1.2, -1.0, 1.0],
        [-1.2, -1.0, -0.9],
        [-1.2, 0.8, -0.9],
        [-1.2, 0.8, 1.0],
    ]);
    add(&mut b, side, mirror);
    let glass = Material {
        transmission: Spectrum::rgb(0.9, 1.0, 0.8),
        ..material(0.0, 0.0)
    };
    add(&mut b, sphere(0.4, Vec3::new(0.4, -0.5, 0.0), 1), glass);

    let mut lit = |mesh: Mesh, color: Spectrum, group: Option<&str>| {
        let emitting = Material {
            emission: color,
            ..material(0.4, 0.0)
        };
        let id = b.add_material(emitting).unwrap();
        if let Some(name) = group {
            let group = b.light_group(name).unwrap();
            b.group_material(id, group);
        }
        b.add_mesh(mesh, id).unwrap();
    };
    let lamp_color = emission(lamp, Spectrum::rgb(4.0, 3.0, 1.0));
    lit(ceiling(-0.1), lamp_color, Some(NAMES[0]));
    lit(ceiling(0.9), emission(other, Spectrum::rgb(1.0, 2.0, 5.0)), None);
    if key {
        let group = b.light_group(NAMES[1]).unwrap();
        b.begin_light_group(Some(group));
        b.add_point_light(Vec3::new(0.8, 0.6, 1.2), Spectrum::rgb(1.0, 0.8, 0.6))
            .unwrap();
    }
    if sky {
        let group = b.light_group(NAMES[2]).unwrap();
        b.begin_light_group(Some(group));
        b.add_constant_light(Spectrum::rgb(0.1, 0.2, 0.3)).unwrap();
    }
    b.build().unwrap().0
}

/// Camera that faces the corner.
fn view() -> embrasure::camera::CameraParameters {
    pinhole(Vec3::new(0.5, 0.2, 3.2), Vec3::new(-0.1, -0.1, 0.0), 45.0)
}

fn film(integrator: &dyn CompiledIntegrator, seed: u64, spp: u32, groups: usize) -> Film {
    let mut film = Film::new(RESOLUTION, Rect::full(RESOLUTION)).with_parts(groups);
    render_into(&mut film, integrator, &sobol(seed), spp);
    film
}

/// Calls `look` for each integrator that gathers light. The arguments are the name of the
/// integrator, and a function that renders with a seed, a number of samples per pixel and a number
/// of groups.
fn with_each(world: World<Backend>, look: &mut impl FnMut(&str, &dyn Fn(u64, u32, usize) -> Film)) {
    let path = |reuse| PathTracer {
        path: PathIntegrator {
            world,
            strategy: Strategy::default(),
            max_depth: Some(5),
            roulette: Roulette::after(u32::from(reuse)),
            light_samples: if reuse { 2 } else { 1 },
            clamp_indirect: None,
        },
        reuse,
    };
    fn by<'a>(integrator: &'a dyn CompiledIntegrator) -> impl Fn(u64, u32, usize) -> Film + 'a {
        |seed, spp, groups| film(integrator, seed, spp, groups)
    }
    look("path", &by(&path(false)));
    look("path with shared paths", &by(&path(true)));
    let distributed = DistributedIntegrator {
        world,
        strategy: Strategy::default(),
        max_depth: 3,
        branching: 2,
    };
    look("distributed", &by(&distributed));
    let whitted = WhittedIntegrator {
        world,
        max_depth: Some(6),
    };
    look("whitted", &by(&whitted));
    let naive = NaiveIntegrator::new(world, Some(5), Roulette::default());
    look("naive", &by(&naive));
}

/// Mean of each pixel, for each channel: of the light group `group`, or of the image.
fn means(film: &Film, group: Option<usize>) -> [Vec<f64>; 3] {
    [0, 1, 2].map(|c| {
        let mean = |pixel| {
            let (tile, sums) = (film.tile_at(pixel).unwrap(), film.sums(pixel).unwrap());
            match group {
                Some(group) => tile.part_sums(pixel)[group].mean(c, sums.samples()),
                None => sums.mean(c),
            }
        };
        film.crop().pixels().map(mean).collect()
    })
}

#[test]
fn groups_sum_to_the_image_and_keep_its_bits() {
    for selection in [SelectionMode::Auto, SelectionMode::All] {
        let scene = stage([true; 4]);
        assert_eq!(scene.light_groups().names(), NAMES);
        with_world((&scene, selection), view(), RESOLUTION, |world| {
            with_each(world, &mut |what, film| {
                let together = film(3, 24, NAMES.len());
                let picture = means(&together, None);
                assert!(picture == means(&film(3, 24, 0), None), "{what}");
                let groups = [0, 1, 2, 3].map(|group| means(&together, Some(group)));
                for c in 0..3 {
                    for (pixel, &whole) in picture[c].iter().enumerate() {
                        let sum: f64 = groups.iter().map(|group| group[c][pixel]).sum();
                        assert!((sum - whole).abs() <= 1e-5 * whole, "{what}: {sum} of {whole}");
                    }
                }
                for (name, group) in NAMES.iter().zip(&groups) {
                    // No path hits a point light.
                    let is_found = !(what == "naive" && *name == "key");
                    assert_eq!(group[0].iter().sum::<f64>() > 0.0, is_found, "{what}, {name}");
                }
            });
        });
    }
}

/// A group equals a render without the other lights, up to rounding, if light selection and sample
/// counts do not depend on other lights.
#[test]
fn group_equals_a_render_with_its_lights_only() {
    let all = stage([true; 4]);
    for (group, shining) in [(0, [true, false, false, false]), (1, [false, true, false, false])] {
        let alone = stage(shining);
        let mut pictures = BTreeMap::new();
        with_world((&alone, SelectionMode::All), view(), RESOLUTION, |world| {
            with_each(world, &mut |what, film| {
                pictures.insert(what.to_string(), means(&film(5, 16, 0), None));
            });
        });
        with_world((&all, SelectionMode::All), view(), RESOLUTION, |world| {
            with_each(world, &mut |what, film| {
                // `naive` chooses by chance between emission and reflection, with a probability
                // that depends on the emitters.
                if what != "naive" {
                    let together = film(5, 16, NAMES.len());
                    let (found, alone) = (means(&together, Some(group)), &pictures[what]);
                    let is_same = (0..3).all(|c| agree_within_rounding(&found[c], &alone[c]));
                    assert!(is_same, "{what}, {}", NAMES[group]);
                }
            });
        });
    }
}

/// If light selection or sample counts depend on other lights, only the means are equal.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn group_means_equal_renders_of_single_groups() {
    const SEEDS: u64 = 24;
    const SPP: u32 = 12;
    // Compare four regions of the image. Errors are computed from renders with different seeds,
    // which are independent. Pixels with path reuse have correlated errors.
    let regions = |picture: [Vec<f64>; 3]| -> Vec<f64> {
        let region = |i: usize| {
            let (x, y) = (i as u32 % RESOLUTION.x, i as u32 / RESOLUTION.x);
            (2 * x / RESOLUTION.x + 2 * (2 * y / RESOLUTION.y)) as usize
        };
        let mut sums = vec![0.0; 12];
        for (c, values) in picture.iter().enumerate() {
            for (i, value) in values.iter().enumerate() {
                sums[4 * c + region(i)] += value;
            }
        }
        sums
    };
    let mut together: BTreeMap<String, Vec<Vec<Vec<f64>>>> = BTreeMap::new();
    let all = stage([true; 4]);
    with_world(&all, view(), RESOLUTION, |world| {
        with_each(world, &mut |what, film| {
            let by_seed = (0..SEEDS).map(|seed| {
                let film = film(seed, SPP, NAMES.len());
                (0..4).map(|group| regions(means(&film, Some(group)))).collect()
            });
            together.insert(what.to_string(), by_seed.collect());
        });
    });
    let mut compared = 0;
    for group in 0..NAMES.len() {
        let mut shining = [false; 4];
        shining[group] = true;
        let alone = stage(shining);
        with_world(&alone, view(), RESOLUTION, |world| {
            with_each(world, &mut |what, film| {
                let by_seed = (0..SEEDS).map(|seed| regions(means(&film(1000 + seed, SPP, 0), None)));
                let by_seed: Vec<Vec<f64>> = by_seed.collect();
                let of_group: Vec<Vec<f64>> = together[what].iter().map(|seed| seed[group].clone()).collect();
                let pairs = Mean::of_each(&of_group).into_iter().zip(Mean::of_each(&by_seed));
                for (region, (mean, expected)) in pairs.enumerate() {
                    let name = NAMES[group];
                    assert_same_mean(format!("{what}, {name}, region {region}"), mean, expected);
                    compared += usize::from(expected.value > 0.0);
                }
            });
        });
    }
    // All groups are compared, except the point light with `naive`
    assert_eq!(compared, (4 * 5 - 1) * 12);
}

/// Integrator that finds the radiance 1 from the first lamp and 2 from the second lamp in each
/// sample. In every third sample, the radiance from the first lamp is NaN. Samples have the weight
/// 0.5.
struct NanIntegrator<'a>(&'a Scene);

impl Integrator for NanIntegrator<'_> {
    fn sample<S: Sampler>(&self, key: SampleKey, _: &mut S, out: &mut impl Sink) {
        out.weight(0.5);
        for (id, value) in [(0, if key.sample % 3 == 0 { f32::NAN } else { 1.0 }), (1, 2.0)] {
            out.light(FoundLight::of(Spectrum::splat(value), LightId(id), self.0, 0));
        }
    }
}

#[test]
fn nan_sample_is_black_in_all_groups() {
    let mut b = SceneBuilder::new();
    for name in ["a", "b"] {
        let group = b.light_group(name).unwrap();
        b.begin_light_group(Some(group));
        b.add_point_light(Vec3::ZERO, Spectrum::ONE).unwrap();
    }
    let scene = b.build().unwrap().0;
    let mut film = Film::new(RESOLUTION, Rect::full(RESOLUTION)).with_parts(2);
    render(&NanIntegrator(&scene), &Sobol::new(0), &mut film, 6, &());
    let four_of_six = |value: f64| [0, 1, 2].map(|_| vec![0.5 * value * 4.0 / 6.0; 21 * 18]);
    for (mean, value) in [
        (means(&film, Some(0)), 1.0),
        (means(&film, Some(1)), 2.0),
        (means(&film, None), 3.0),
    ] {
        assert_eq!(mean, four_of_six(value));
    }
}

/// The stage as files: a lamp and a screen that are in groups by their materials, a point light, a
/// sky, and a lamp in no group.
fn files() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write(
        "a.mtl",
        "newmtl stone\nKd 0.6 0.5 0.4\nnewmtl lamp\nKd 0.2 0.2 0.2\nKe 4 3 1\nnewmtl screen\nKd 0 0 0\nKe 0.2 0.6 0.4\n\
         newmtl other\nKd 0.5 0.5 0.5\nKe 0.5 0.5 2\nnewmtl mirror\nKs 0.9 0.9 0.9\nillum 3\n",
    );
    write(
        "a.obj",
        "mtllib a.mtl\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nv 2 3 -2\nv -2 3 -2\n\
         v -1 2 0\nv -1 2 1\nv -2 2 1\nv -2 2 0\nv 2 2 0\nv 2 2 1\nv 1 2 1\nv 1 2 0\n\
         v -0.5 0.5 -1.9\nv 0.5 0.5 -1.9\nv 0.5 1.5 -1.9\nv -0.5 1.5 -1.9\nv -1.9 0 1.5\nv -1.9 0 -1.5\nv -1.9 2 -1.5\nv -1.9 2 1.5\n\
         usemtl stone\nf 1 2 3 4\nf 4 3 5 6\nusemtl lamp\nf 7 8 9 10\nusemtl other\nf 11 12 13 14\nusemtl screen\nf 15 16 17 18\n\
         usemtl mirror\nf 19 20 21 22\n",
    );
    write("s.toml", &scene_text(""));
    folder
}

const HEAD: &str = "version = 1\n[camera]\nposition = [0, 1.2, 5]\nlook_at = [0, 0.9, 0]\n\
                    [image]\nwidth = 37\nheight = 26\nfilter = \"mitchell\"\n[[object]]\nobj = \"a.obj\"\n";

fn scene_text(more: &str) -> String {
    format!(
        "{HEAD}[[light_group]]\nname = \"Practicals\"\nmaterials = [\"lamp\", \"screen\"]\n\
         [[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = [2, 2, 2]\ngroup = \"key_1\"\n\
         [[light]]\ntype = \"constant\"\nradiance = [0.1, 0.1, 0.2]\ngroup = \"sky\"\n{more}"
    )
}

fn run(folder: &Path, args: &[&str]) -> (bool, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_embrasure"));
    let out = command
        .current_dir(folder)
        .stdin(Stdio::null())
        .args(args)
        .output()
        .unwrap();
    (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
}

fn done(folder: &Path, args: &[&str]) {
    let (is_done, said) = run(folder, args);
    assert!(is_done, "{args:?}: {said}");
}

/// Bits of all channels, except the channels of the render state.
fn bits(path: &Path) -> BTreeMap<String, Vec<u32>> {
    use exr::prelude::*;
    let file = read_first_flat_layer_from_file(path).unwrap();
    let channels = file.layer_data.channel_data.list.into_iter();
    let channels = channels.map(|c| {
        let values = c.sample_data.values_as_f32().map(f32::to_bits).collect();
        (c.name.to_string(), values)
    });
    channels.filter(|(name, _)| !name.starts_with("state.")).collect()
}

#[test]
fn threads_and_parts_change_no_bit_of_groups() {
    let folder = files();
    let path = |name: &str| folder.path().join(name);
    let render = |more: &[&str]| {
        done(
            folder.path(),
            &[&["render", "s.toml", "-q", "--spp", "160", "--aov", "lights"], more].concat(),
        )
    };
    render(&["-o", "one.exr", "--threads", "1"]);
    let one = bits(&path("one.exr"));
    let light: Vec<&String> = one.keys().filter(|name| name.starts_with("light_")).collect();
    let names = ["Practicals", "default", "key_1", "sky"];
    let expected: Vec<String> = names
        .iter()
        .flat_map(|name| ["B", "G", "R"].map(|c| format!("light_{name}.{c}")))
        .collect();
    assert_eq!(light, expected.iter().collect::<Vec<_>>());
    assert_eq!(one.len(), 15 + 12);

    // Groups sum to the image, also with the negative weights of the filter.
    for c in ["R", "G", "B"] {
        let groups = names.map(|name| read_channel(&path("one.exr"), &format!("light_{name}.{c}")));
        for (pixel, whole) in read_channel(&path("one.exr"), c).iter().enumerate() {
            let values = groups.each_ref().map(|group| group[pixel]);
            let (sum, size) = (values.iter().sum::<f32>(), values.iter().map(|v| v.abs()).sum::<f32>());
            assert!((sum - whole).abs() <= 1e-5 * size, "{sum} of {whole}");
        }
        assert!(groups.iter().all(|group| group.iter().sum::<f32>() > 0.0));
    }

    // The image has the same bits without groups.
    done(
        folder.path(),
        &["render", "s.toml", "-q", "--spp", "160", "-o", "plain.exr"],
    );
    for (name, channel) in bits(&path("plain.exr")) {
        assert!(channel == one[&name], "{name}");
    }

    // Render parts and crops, use several threads, and resume in the middle of a block of 64
    // samples
    render(&["-o", "three.exr", "--threads", "3"]);
    render(&["-o", "a.exr", "--samples", "0..64", "--threads", "3"]);
    render(&["-o", "b.exr", "--samples", "64..160", "--crop", "0,0,20,26"]);
    render(&["--checkpoint", "c.exr", "--samples", "64..160", "--crop", "20,0,37,26"]);
    done(
        folder.path(),
        &["merge", "-q", "c.exr", "a.exr", "b.exr", "-o", "merged.exr"],
    );
    let state = [
        "--aov",
        "lights",
        "--checkpoint",
        "d.exr",
        "--resume",
        "-o",
        "resumed.exr",
    ];
    done(
        folder.path(),
        &[&["render", "s.toml", "-q", "--spp", "100"], &state[..]].concat(),
    );
    assert_ne!(bits(&path("resumed.exr")), one);
    render(&["--checkpoint", "d.exr", "--resume", "-o", "resumed.exr"]);
    for file in ["three.exr", "merged.exr", "resumed.exr"] {
        assert!(bits(&path(file)) == one, "{file}");
    }

    // A render with other groups is a different render, so the checkpoint cannot be resumed.
    let other = fs::read_to_string(path("s.toml"))
        .unwrap()
        .replace("\"sky\"", "\"dome\"");
    fs::write(path("s.toml"), other).unwrap();
    let args = ["render", "s.toml", "-q", "--spp", "200"];
    let (is_done, said) = run(folder.path(), &[&args[..], &state[..]].concat());
    assert!(!is_done && said.contains("scene hash"), "{said}");
}

#[test]
fn light_layers_are_written_or_refused() {
    let folder = files();
    let path = |name: &str| folder.path().join(name);
    let render = |more: &[&str]| {
        run(
            folder.path(),
            &[&["render", "s.toml", "-q", "--spp", "2"], more].concat(),
        )
    };
    let count = |file: &str| bits(&path(file)).len();
    assert!(render(&["--aov", "all", "-o", "all.exr"]).0);
    let with_groups = count("all.exr");
    // Denoising applies to the image only.
    assert!(render(&["--aov", "lights", "--denoise=gaussian", "-o", "smooth.exr"]).0);
    assert!(render(&["--aov", "lights", "-o", "raw.exr"]).0);
    let (smooth, raw) = (bits(&path("smooth.exr")), bits(&path("raw.exr")));
    assert_eq!(smooth["light_sky.G"], raw["light_sky.G"]);
    assert_eq!(smooth["raw.G"], raw["G"]);
    assert_ne!(smooth["G"], raw["G"]);

    // Integrators that gather no light have no groups.
    assert!(render(&["--integrator", "ao", "--aov", "all", "-o", "ao.exr"]).0);
    assert_eq!(count("ao.exr"), with_groups - 12);
    let (is_done, said) = render(&["--integrator", "debug", "--aov", "P,lights"]);
    assert!(
        !is_done && said.contains("--integrator debug gathers no light"),
        "{said}"
    );

    // In a scene without groups, `--aov all` adds no channels of groups, and `--aov lights`
    // is an error.
    fs::write(path("s.toml"), HEAD).unwrap();
    assert!(render(&["--aov", "all", "-o", "none.exr"]).0);
    assert_eq!(count("none.exr"), with_groups - 12);
    let (is_done, said) = render(&["--aov", "lights"]);
    assert!(
        !is_done && said.contains("this scene has no light groups") && said.contains("help:"),
        "{said}"
    );

    // A group with all lights equals the image.
    let all = "[[light_group]]\nname = \"all\"\nmaterials = [\"lamp\", \"screen\", \"other\"]\n";
    fs::write(path("s.toml"), format!("{HEAD}{all}")).unwrap();
    assert!(render(&["--aov", "lights", "-o", "whole.exr"]).0);
    let whole = bits(&path("whole.exr"));
    assert!(!whole.contains_key("light_default.R"));
    for (all, sum) in whole["light_all.B"].iter().zip(&whole["B"]) {
        let [all, sum] = [all, sum].map(|bits| f32::from_bits(*bits));
        assert!((all - sum).abs() <= 1e-5 * sum.abs() + 1e-9, "{all}, {sum}");
    }
}

#[test]
fn invalid_groups_are_errors_with_a_line() {
    let folder = files();
    let lines = HEAD.lines().count();
    let sun = "[[light]]\ntype = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";
    let group = |name: &str, materials: &str| format!("[[light_group]]\nname = {name}\nmaterials = {materials}\n");
    let crowd: String = (0..16).map(|i| format!("{sun}group = \"g{i}\"\n")).collect();
    let cases = [
        (format!("{sun}group = \"\"\n"), 5, "the name is empty"),
        (
            format!("{sun}group = \"a.b\"\n"),
            5,
            "light group `a.b`: a name may have letters",
        ),
        (
            format!("{sun}group = \"a\\nb\"\n"),
            5,
            "light group `a\u{fffd}b`: a name may have letters",
        ),
        (format!("{sun}group = \"kéy\"\n"), 5, "a name may have letters"),
        (format!("{sun}group = \"key light\"\n"), 5, "a name may have letters"),
        (
            format!("{sun}group = \"default\"\n"),
            5,
            "reserved for lights without a group",
        ),
        (
            format!("{sun}group = \"{}\"\n", "x".repeat(24)),
            5,
            "longer than 23 letters",
        ),
        (format!("{sun}group = 3\n"), 5, "expected a string"),
        (crowd, 80, "more than 15 light groups"),
        (group("\"default\"", "[\"lamp\"]"), 2, "reserved for lights"),
        (group("\"a\"", "[]"), 3, "without materials"),
        (
            group("\"a\"", "[\"lamp\", \"lamp\"]"),
            3,
            "material `lamp` is in a light group already",
        ),
        (
            group("\"a\"", "[\"lamp\"]") + &group("\"b\"", "[\n\"screen\",\n\"lamp\"]"),
            8,
            "material `lamp` is in a light group already",
        ),
        (format!("{}color = 1\n", group("\"a\"", "[\"lamp\"]")), 4, "color"),
        ("[[light_group]]\nmaterials = [\"lamp\"]\n".into(), 1, "name"),
        ("[[light_group]]\nname = \"a\"\n".into(), 1, "materials"),
    ];
    for (text, line, words) in cases {
        let path = folder.path().join("wrong.toml");
        fs::write(&path, format!("{HEAD}{text}")).unwrap();
        let loaded = SceneFile::load(&path).and_then(|file| load_scene(&file, SceneBuilder::new()));
        let error = loaded.map(|_| ()).expect_err(&text);
        let said = error.to_string();
        assert_eq!(error.position.map(|p| p.line), Some(lines + line), "{text}: {said}");
        assert!(said.contains(words) && said.contains("help:"), "{text}: {said}");
    }
    // 16 groups are allowed, and a section may share its group with lights and other sections.
    let max: String = (0..15).map(|i| format!("{sun}group = \"g{i}\"\n")).collect();
    let shared = group("\"g3\"", "[\"lamp\"]") + &group("\"g3\"", "[\"screen\"]");
    let path = folder.path().join("most.toml");
    fs::write(&path, format!("{HEAD}{max}{shared}")).unwrap();
    assert_eq!(load(&path).light_groups().names().len(), 16);
    assert_eq!(load(&path).light_groups().names()[15], "default");
}

#[test]
fn idle_group_materials_are_warnings() {
    let folder = files();
    let path = folder.path().join("odd.toml");
    let more = "[[light_group]]\nname = \"odd\"\nmaterials = [\n\"nothing\",\n\"stone\"]\n";
    fs::write(&path, scene_text(more)).unwrap();
    let start = scene_text("").lines().count();
    let found = inspect_scene(&SceneFile::load(&path).unwrap(), SceneBuilder::new());
    let warnings = found.findings.warnings();
    let line = |n: usize| format!("odd.toml:{}:1: ", start + n);
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(
        warnings[0]
            .text
            .contains(&(line(4) + "material `nothing` is in a light group, but is used by no face")),
        "{warnings:?}"
    );
    let dark = line(5) + "material `stone` is in a light group, but emits nothing";
    assert!(warnings[1].text.contains(&dark), "{warnings:?}");
    // Light groups without light also have channels.
    let scene = found.scene.unwrap();
    assert_eq!(
        scene.light_groups().names(),
        ["Practicals", "odd", "key_1", "sky", "default"]
    );
}
