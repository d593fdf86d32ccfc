//! Parts of the image by light path expressions. The sum of the parts is bit-identical to the
//! image, and each part matches its expression. The number of threads and the ranges of samples
//! change no bit.

use crate::support::agree_within_rounding;
use crate::support::statistics::{Mean, assert_same_mean};
use embrasure::film::{Film, PartSum};
use embrasure::{IntegratorKind, MaxDepth, PathPart, PathReuse, SceneFile, Session, Settings};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

/// A corner of matte, coated, metallic and mirror surfaces with a ball of glass, a pane and a
/// filter, lit by a lamp, a screen and a sky.
const MTL: &str = "newmtl stone\nKd 0.6 0.5 0.4\nnewmtl lacquer\nKd 0.5 0.2 0.1\nKs 0.3 0.3 0.3\nNs 40\nnewmtl metal\nKd 0.4 0.4 0.4\n\
                   newmtl mirror\nKs 0.8 0.8 0.8\nillum 3\nnewmtl glass\nTf 0.9 1 0.8\nNi 1.5\nillum 4\nnewmtl pane\nKd 0.5 0.5 0.5\n\
                   newmtl veil\nKd 0.6 0.6 0.2\nnewmtl lamp\nKd 0.3 0.3 0.3\nKe 6 5 3\nnewmtl frost\nKd 0.5 0.5 0.5\n";

const OBJ: &str = "mtllib a.mtl\nv -2 0 2\nv 2 0 2\nv 2 0 -2\nv -2 0 -2\nv 2 3 -2\nv -2 3 -2\nv -2 0 1.9\nv -2 0 -1.9\nv -2 3 -1.9\nv -2 3 1.9\n\
                   v -0.6 2.6 -0.6\nv 0.6 2.6 -0.6\nv 0.6 2.6 0.6\nv -0.6 2.6 0.6\n\
                   v 0.4 0.2 0\nv 1.4 0.2 0\nv 0.9 0.2 0.9\nv 0.9 1.1 0.4\n\
                   v -1.4 0.1 0.6\nv -0.5 0.1 0.9\nv -0.5 1 0.9\nv -1.4 1 0.6\nv 0.2 0.2 1.2\nv 0.9 0.2 1.2\nv 0.9 0.9 1.2\nv 0.2 0.9 1.2\n\
                   v 1.9 0 1\nv 1.9 0 -1\nv 1.9 2 -1\nv 1.9 2 1\nv -1.6 1.2 0.8\nv -0.8 1.2 0.8\nv -0.8 2 0.8\nv -1.6 2 0.8\n\
                   usemtl stone\nf 1 2 3 4\nusemtl lacquer\nf 4 3 5 6\nusemtl mirror\nf 7 8 9 10\nusemtl lamp\nf 11 12 13 14\n\
                   usemtl glass\nf 15 16 17\nf 15 18 16\nf 16 18 17\nf 17 18 15\nusemtl pane\nf 19 20 21 22\nusemtl veil\nf 23 24 25 26\n\
                   usemtl metal\nf 30 29 28 27\nusemtl frost\nf 31 32 33 34\n";

const SCENE: &str = "version = 1\n[camera]\nposition = [0.2, 1.3, 5]\nlook_at = [0, 1, 0]\n[image]\nwidth = 29\nheight = 22\nfilter = \"mitchell\"\n\
                     [[object]]\nobj = \"a.obj\"\n\
                     [material.metal]\ndiffuse = [0.8, 0.6, 0.3]\nmetallic = 0.5\nroughness = 0.5\n\
                     [material.pane]\ntransmission = [0.8, 0.9, 0.8]\ndiffuse = [0, 0, 0]\nior = 1.5\nthin = true\n[material.frost]\ntransmission = [0.8, 0.9, 0.8]\ndiffuse = [0.1, 0.1, 0.1]\nior = 1.5\nroughness = 0.6\n[material.veil]\nopacity = 0.6\n\
                     [[light]]\ntype = \"constant\"\nradiance = [0.2, 0.3, 0.5]\ngroup = \"sky\"\n";

/// A light that no ray hits.
const POINT: &str = "[[light]]\ntype = \"point\"\nposition = [1, 2, 3]\nintensity = [2, 2, 2]\n";

fn files() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("a.mtl", MTL);
    write("a.obj", OBJ);
    write("s.toml", &format!("{SCENE}{POINT}"));
    write("met.toml", SCENE);
    folder
}

fn parts(names: &str) -> Vec<PathPart> {
    let mut parts = Vec::new();
    for name in names.split(' ') {
        PathPart::add(&mut parts, PathPart::parse(name).unwrap()).unwrap();
    }
    parts
}

/// Sets of parts. The parts of a set together contain all light.
const WHOLES: [&str; 3] = [
    "emission direct indirect",
    "emission diffuse_direct diffuse_indirect specular_direct specular_indirect transmission_direct transmission_indirect",
    "bounces:3",
];

/// Renders a scene with the library.
fn film(scene: &Path, change: impl FnOnce(&mut Settings)) -> Film {
    let file = SceneFile::load(scene).unwrap();
    let mut settings = Settings::of(&file);
    settings.threads = 2;
    change(&mut settings);
    let session = Session::load(&file, settings, &()).unwrap();
    let renderer = session.renderer().unwrap();
    let mut state = renderer.start();
    renderer.render(&mut state, &());
    assert_eq!(state.statistics.dropped, 0);
    state.film
}

/// Sets the integrator and the path reuse.
fn by(settings: &mut Settings, (kind, reuse): (IntegratorKind, bool)) {
    settings.integrator.integrator = Some(kind);
    if kind == IntegratorKind::Path {
        settings.integrator.reuse = Some(if reuse { PathReuse::Pixels } else { PathReuse::None });
    }
}

const METHODS: [(IntegratorKind, bool); 5] = [
    (IntegratorKind::Path, true),
    (IntegratorKind::Path, false),
    (IntegratorKind::Direct, false),
    (IntegratorKind::Naive, false),
    (IntegratorKind::Bidirectional, false),
];

/// Means of each pixel and channel: of the part `part`, or of the image.
fn means(film: &Film, part: Option<usize>) -> Vec<f64> {
    let mean = |pixel, c| {
        let sums = film.sums(pixel).unwrap();
        match part {
            Some(part) => film.tile_at(pixel).unwrap().part_sums(pixel)[part].mean(c, sums.samples()),
            None => sums.mean(c),
        }
    };
    let pixels = film.crop().pixels();
    pixels.flat_map(|pixel| [0, 1, 2].map(|c| mean(pixel, c))).collect()
}

/// If parts contain all light, their exact sums are bit-identical to the image. The image equals a
/// render without parts.
#[test]
fn parts_sum_to_the_image_bit_by_bit() {
    let folder = files();
    let wanted = parts(&WHOLES.join(" "));
    let layers: Vec<&str> = wanted.iter().map(PathPart::layer).collect();
    for method in METHODS {
        // Light groups come before the parts in the film.
        for lights in [false, true] {
            let render = |light_paths: Vec<PathPart>| {
                film(&folder.path().join("s.toml"), |s| {
                    by(s, method);
                    s.spp = if method.0 == IntegratorKind::Bidirectional {
                        6
                    } else {
                        70
                    };
                    s.light_paths = light_paths;
                    s.aovs = if lights {
                        vec![embrasure::Aov::Lights]
                    } else {
                        Vec::new()
                    };
                })
            };
            let (film, plain) = (render(wanted.clone()), render(Vec::new()));
            assert!(means(&film, None) == means(&plain, None), "{method:?}");
            let groups = if lights { 2 } else { 0 };
            for group in 0..groups {
                let [with, without] = [&film, &plain].map(|film| means(film, Some(group)));
                assert!(agree_within_rounding(&with, &without), "{method:?}");
            }
            for names in WHOLES {
                let members = parts(names);
                let index = |part: &PathPart| groups + layers.iter().position(|l| *l == part.layer()).unwrap();
                let members: Vec<usize> = members.iter().map(index).collect();
                for (pixel, sums) in film.pixels() {
                    let all = film.tile_at(pixel).unwrap().part_sums(pixel);
                    let sum = members
                        .iter()
                        .fold(PartSum::default(), |sum, part| sum.plus(all[*part]));
                    for c in 0..3 {
                        let (sum, mean) = (sum.mean(c, sums.samples()), sums.mean(c));
                        assert_eq!(sum.to_bits(), mean.to_bits(), "{method:?}, {names}: {sum} of {mean}");
                    }
                }
            }
            // Each part has light, unless the part needs several scatterings and the integrator
            // computes only one.
            for (i, layer) in layers.iter().enumerate() {
                let sum: f64 = means(&film, Some(groups + i)).iter().sum();
                let is_far = layer.contains("indirect") || ["bounce.2", "bounce.3", "bounce.rest"].contains(layer);
                let is_black = method.0 == IntegratorKind::Direct && is_far;
                assert_eq!(sum == 0.0, is_black, "{method:?}, {layer}: {sum}");
            }
        }
    }
}

/// If the paths are the same, the light of k bounces is the difference between renders with the
/// maximum depths k and k − 1.
#[test]
fn bounces_are_differences_of_depths() {
    let folder = files();
    let render = |depth: u32| {
        film(&folder.path().join("s.toml"), |s| {
            by(s, (IntegratorKind::Path, false));
            s.integrator.max_depth = Some(MaxDepth(Some(depth)));
            s.integrator.roulette_depth = Some(100);
            s.spp = 32;
            s.light_paths = parts("bounces:4");
        })
    };
    let deep = render(5);
    let mut before = vec![0.0; means(&deep, None).len()];
    for k in 0..=4 {
        let film = render(k);
        let (picture, bounce) = (means(&film, None), means(&deep, Some(k as usize)));
        assert!(bounce.iter().sum::<f64>() > 0.0);
        for ((whole, before), bounce) in picture.iter().zip(&before).zip(&bounce) {
            let difference = whole - before;
            let bound = 1e-5 * whole.abs().max(0.1);
            assert!((difference - bounce).abs() <= bound, "{k}: {difference}, {bounce}");
        }
        // No path has more than 4 bounces, so the part for longer paths (bounce.rest) is black.
        assert!(means(&film, Some(5)).iter().all(|rest| *rest == 0.0));
        before = picture;
    }
}

/// In a closed room that emits 1 everywhere and has reflectance ρ, k bounces give ρᵏ.
#[test]
fn furnace_bounces_are_powers_of_its_albedo() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("a.mtl", "newmtl a\nKd 0.5 0.25 0.8\nKe 1 1 1\n");
    write(
        "a.obj",
        "mtllib a.mtl\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nusemtl a\n\
         f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 4 3 7 8\nf 1 4 8 5\nf 6 7 3 2\n",
    );
    write(
        "s.toml",
        "version = 1\n[camera]\nposition = [0.1, 0.2, 0.3]\nlook_at = [0, 0, -1]\n[image]\nwidth = 9\nheight = 8\n[[object]]\nobj = \"a.obj\"\n",
    );
    for reuse in [false, true] {
        let film = film(&folder.path().join("s.toml"), |s| {
            by(s, (IntegratorKind::Path, reuse));
            s.integrator.direct = Some(embrasure::integrator::DirectLight::None);
            s.integrator.max_depth = Some(MaxDepth(Some(6)));
            s.integrator.roulette_depth = Some(100);
            s.spp = 16;
            s.light_paths = parts("bounces:4 lpe:two=OD{2}E lpe:none=CG.*L lpe:sky=C.*B");
        });
        for k in 0..=4 {
            let pixels = means(&film, Some(k));
            // With path reuse the mean is the same, with some noise.
            for c in 0..3 {
                let expected = [0.5f64, 0.25, 0.8][c].powi(k as i32);
                let values: Vec<f64> = pixels.iter().skip(c).step_by(3).copied().collect();
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                assert!(
                    (mean - expected).abs() < if reuse { 0.02 } else { 1e-4 } * expected,
                    "{k}: {mean}, {expected}"
                );
                let is_even = values.iter().all(|value| (value - expected).abs() < 1e-4 * expected);
                assert!(reuse || is_even, "{k}");
            }
        }
        let sum = |part| means(&film, Some(part)).iter().sum::<f64>();
        assert!((sum(6) - sum(2)).abs() < 1e-9 && sum(7) == 0.0 && sum(8) == 0.0);
    }
}

/// The diffuse part of direct light on a mixture is the direct light of its diffuse lobe.
#[test]
fn mixtures_are_split_by_their_lobes() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let light = POINT.replace("[1, 2, 3]", "[0, 2, -3]");
    let mtl = |kd: &str, ks: &str| format!("newmtl a\nKd {kd}\nKs {ks}\nNs 30\n");
    write(
        "a.obj",
        "mtllib a.mtl\nv -9 0 9\nv 9 0 9\nv 9 0 -9\nv -9 0 -9\nusemtl a\nf 1 2 3 4\n",
    );
    write(
        "s.toml",
        &format!(
            "version = 1\n[camera]\nposition = [0, 2, 4]\nlook_at = [0, 0, 0]\n[image]\nwidth = 16\nheight = 16\n[[object]]\nobj = \"a.obj\"\n{light}"
        ),
    );
    let render = |kd: &str, ks: &str| {
        write("a.mtl", &mtl(kd, ks));
        film(&folder.path().join("s.toml"), |s| {
            by(s, (IntegratorKind::Direct, false));
            s.spp = 8;
            s.light_paths = parts("direct diffuse_direct specular_direct");
        })
    };
    let mixed = render("0.5 0.3 0", "0.3 0.3 0.3");
    let alone = [render("0.5 0.3 0", "0 0 0"), render("0 0 0", "0.3 0.3 0.3")];
    for (part, alone) in alone.iter().enumerate() {
        let pairs = means(&mixed, Some(part + 1)).into_iter().zip(means(alone, Some(0)));
        let sum: f64 = pairs.clone().map(|(_, b)| b).sum();
        assert!(sum > 1.0 && pairs.clone().all(|(a, b)| (a - b).abs() <= 1e-5 * b.max(0.01)));
    }
}

/// All integrators find the same light in each part.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn parts_have_equal_means_by_all_integrators() {
    let folder = files();
    // All parts together would need too many classes of light paths, so test them in groups.
    for names in [
        "emission direct diffuse_direct diffuse_indirect specular_direct specular_indirect transmission_direct transmission_indirect \
         bounce.1 bounce.2 bounce.3",
        "lpe:caustics=LS+DE lpe:sky=C.*B lpe:glossy=C.*<RG>.*O lpe:glass=C.*<TS>.*L lpe:seen=CS+L",
    ] {
        compare_methods(&folder.path().join("met.toml"), &parts(names));
    }
}

/// Renders the parts `wanted` by all integrators, and compares their means with the means by path
/// tracing.
fn compare_methods(scene: &Path, wanted: &[PathPart]) {
    const SEEDS: u64 = 24;
    let of = |method: (IntegratorKind, bool), seed: u64| -> Vec<f64> {
        let film = film(scene, |s| {
            by(s, method);
            s.integrator.max_depth = Some(MaxDepth(Some(4)));
            s.spp = if method.0 == IntegratorKind::Naive { 64 } else { 16 };
            s.seed = seed;
            s.light_paths = wanted.to_vec();
        });
        (0..wanted.len())
            .map(|part| means(&film, Some(part)).iter().sum())
            .collect()
    };
    let estimate = |method, first: u64| -> Vec<Mean> {
        let seeds: Vec<Vec<f64>> = (first..first + SEEDS).map(|seed| of(method, seed)).collect();
        Mean::of_each(&seeds)
    };
    let expected = estimate((IntegratorKind::Path, false), 0);
    for (i, method) in METHODS
        .into_iter()
        .filter(|m| m.0 != IntegratorKind::Direct && *m != METHODS[1])
        .enumerate()
    {
        let found = estimate(method, 1000 * (i as u64 + 1));
        for (part, (mean, expected)) in wanted.iter().zip(found.into_iter().zip(&expected)) {
            let what = format!("{method:?} {}", part.layer());
            assert!(mean.value > 0.0, "{what}");
            assert_same_mean(what, mean, *expected);
        }
    }
}

/// The bright curve in the polished ring is light of the paths S+D. The part for S+D has no other
/// light.
#[test]
fn ring_caustic_is_in_its_own_part() {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/ring-caustic.toml");
    let film = film(&scene, |s| {
        by(s, (IntegratorKind::Bidirectional, false));
        s.resolution = [64, 48].into();
        s.spp = 8;
        s.light_paths = parts("lpe:caustics=LS+DE lpe:rest=C[^D].*L lpe:ds=CDS+L");
    });
    let sum = |part| means(&film, part).iter().sum::<f64>();
    let [all, caustics, written] = [sum(None), sum(Some(0)), sum(Some(2))];
    println!("{caustics} of {all}");
    assert!(caustics > 0.005 * all && caustics < 0.5 * all, "{caustics} of {all}");
    assert_eq!(caustics, written);
}

fn run(folder: &Path, args: &[&str]) -> (bool, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_embrasure"))
        .current_dir(folder)
        .stdin(Stdio::null())
        .args(args)
        .output()
        .unwrap();
    (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
}

fn done(folder: &Path, args: &str, more: &[&str]) {
    let args: Vec<&str> = args.split(' ').chain(more.iter().copied()).collect();
    let (is_done, said) = run(folder, &args);
    assert!(is_done, "{args:?}: {said}");
}

/// Bits of all channels, except the channels of the render state.
fn bits(path: PathBuf) -> BTreeMap<String, Vec<u32>> {
    use exr::prelude::*;
    let file = read_first_flat_layer_from_file(path).unwrap();
    let channels = file.layer_data.channel_data.list.into_iter().map(|c| {
        let values = c.sample_data.values_as_f32().map(f32::to_bits).collect();
        (c.name.to_string(), values)
    });
    channels.filter(|(name, _)| !name.starts_with("state.")).collect()
}

const AOVS: &str = "--aov direct,indirect,emission,bounces:2,lights,lpe:caustics=LS+DE,lpe:two=C.{1,2}L";

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn threads_and_parts_change_no_bit() {
    let folder = files();
    let at = folder.path();
    let file = |name: &str| bits(at.join(name));
    for method in ["path", "bdpt"] {
        let common = format!("render s.toml -q --integrator {method} --spp 160 --size 24x18 {AOVS}");
        let render = |more: &str| done(at, &format!("{common} {more}"), &[]);
        render("-o one.exr --threads 1");
        let one = file("one.exr");
        let layers = [
            "direct",
            "indirect",
            "emission",
            "bounce.0",
            "bounce.1",
            "bounce.2",
            "bounce.rest",
            "lpe_caustics",
            "lpe_two",
        ];
        for layer in layers {
            assert!(one.contains_key(&format!("{layer}.G")), "{layer}");
        }
        assert_eq!(one.len(), 15 + 3 * layers.len() + 3 * 2);
        // Channels are rounded to float32 one by one.
        let value = |name: &str, i: usize| f32::from_bits(one[name][i]);
        for i in 0..24 * 18 {
            let parts = ["direct", "indirect", "emission"].map(|layer| value(&format!("{layer}.R"), i));
            let size = parts.iter().map(|v| v.abs()).sum::<f32>();
            assert!((parts.iter().sum::<f32>() - value("R", i)).abs() <= 4e-7 * size);
            assert_eq!(value("emission.R", i), value("bounce.0.R", i));
        }

        // Use several threads, render ranges and crops, and resume in the middle of a block of 64
        // samples
        render("-o three.exr --threads 3");
        render("-o a.exr --samples 0..64 --threads 3");
        render("-o b.exr --samples 64..160 --crop 0,0,10,18");
        render("--checkpoint c.exr --samples 64..160 --crop 10,0,24,18");
        done(at, "merge -q c.exr a.exr b.exr -o merged.exr", &[]);
        done(
            at,
            &common.replace("160", "100"),
            &["--checkpoint", "d.exr", "--resume", "-o", "resumed.exr"],
        );
        assert!(file("resumed.exr") != one);
        render("--checkpoint d.exr --resume -o resumed.exr");
        for name in ["three.exr", "merged.exr", "resumed.exr"] {
            assert!(file(name) == one, "{method}, {name}");
        }
        // A render with other parts is another render, and cannot resume the checkpoint.
        let other = common.replace("LS+DE", "LS+DDE");
        let args: Vec<&str> = other.split(' ').chain(["--checkpoint", "d.exr", "--resume"]).collect();
        let (is_done, said) = run(at, &args);
        assert!(!is_done && said.contains("aov=") && said.contains("LS+DDE"), "{said}");
        fs::remove_file(at.join("d.exr")).unwrap();
        fs::remove_file(at.join("c.exr")).unwrap();
    }
    // The order of the parts does not matter.
    done(
        at,
        "render s.toml -q --spp 2 --aov direct,bounces --checkpoint e.exr -o e1.exr",
        &[],
    );
    done(
        at,
        "render s.toml -q --spp 4 --aov bounces,direct --checkpoint e.exr --resume -o e1.exr",
        &[],
    );
    done(at, "develop e1.exr -o e.png --channel bounce.1", &[]);
}

#[test]
fn unsupported_light_paths_are_errors() {
    let folder = files();
    for (args, words) in [
        ("--integrator ao --aov direct", "ao cannot separate light paths"),
        (
            "--integrator sppm --aov P,bounces",
            "use one of path, naive, direct, bdpt",
        ),
        ("--aov direct,glossy", "unknown channels"),
        ("--aov lpe:a=LSX", "`X` at character 3"),
        ("--aov lpe:a=CDL,lpe:a=CGL", "defined twice, as CDL and as CGL"),
        ("--aov bounces:2,bounces:3", "write bounces once"),
        ("--aov lpe:a=C.{7}D.*L", "more than 64 classes"),
        ("--aov lpe:caustics", "needs a name"),
    ] {
        let line = format!("render s.toml -q --spp 1 {args}");
        let (is_done, said) = run(folder.path(), &line.split(' ').collect::<Vec<_>>());
        assert!(
            !is_done && said.contains(words) && said.contains("help:"),
            "{args}: {said}"
        );
    }
    // Channels that `--aov all` leaves out
    done(folder.path(), "render s.toml -q --spp 1 --aov all -o all.exr", &[]);
    assert!(!bits(folder.path().join("all.exr")).contains_key("direct.R"));
}

#[test]
fn the_lab_writes_a_sheet_of_bounces() {
    let folder = files();
    done(
        folder.path(),
        "lab s.toml --bounces -q --spp 4 --size 40x30 -o sheet",
        &[],
    );
    let decoder = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(folder.path().join("sheet.png")).unwrap(),
    ));
    let info = decoder.read_info().unwrap();
    // The sheet has eight images in two rows
    assert!(info.info().width > 4 * 220 && info.info().height > 2 * 60);
    let (is_done, said) = run(folder.path(), &["lab", "s.toml", "--bounces", "--methods", "path"]);
    assert!(!is_done && said.contains("--methods"), "{said}");
}
