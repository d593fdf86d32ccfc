//! The real program: written files, messages and exit codes.

use crate::support::program::{
    CHANNELS, assert_same_bits, code, command, done, folder, joined, json, lit_floor, printed, read_json, refused, run,
    signal, split, wait_for_work, words, write_grey_png,
};
use crate::support::{read_channel, read_rgb};
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Stdio;

#[test]
fn renders_exr_png_and_statistics() {
    let folder = lit_floor();
    done(folder.path(), &split("render s.toml -o x.exr -o x.png --stats x.json"));

    let exr = folder.path().join("x.exr");
    for name in CHANNELS {
        let values = read_channel(&exr, name);
        assert_eq!(values.len(), 40 * 24);
        assert!(values.iter().all(|v| v.is_finite()), "{name}");
    }
    assert!(read_channel(&exr, "samples").iter().all(|&n| n == 4.0));
    // The floor is below the lamp. The lower part of the image shows the floor, so the image is not
    // upside down. The normal of the floor points up.
    assert_eq!(read_channel(&exr, "N.Y")[14 * 40 + 20], 1.0);
    assert!((read_channel(&exr, "albedo.B")[14 * 40 + 20] - 0.3).abs() < 1e-6);

    let png = png::Decoder::new(std::io::BufReader::new(
        fs::File::open(folder.path().join("x.png")).unwrap(),
    ));
    let reader = png.read_info().unwrap();
    assert_eq!((reader.info().width, reader.info().height), (40, 24));

    let stats = read_json(&folder.path().join("x.json"));
    let keys = [
        "version",
        "backend",
        "backend_version",
        "isa",
        "integrator",
        "sampler",
        "spp",
        "threads",
        "width",
        "height",
        "triangles",
        "lights",
        "load_s",
        "build_s",
        "render_s",
        "total_s",
        "rays",
        "samples",
        "bvh_bytes",
        "peak_rss_bytes",
        "dropped_samples",
        "warnings",
    ];
    for key in keys {
        assert!(!stats[key].is_null(), "{key} is missing");
    }
    assert_eq!(stats["triangles"], 4);
    assert_eq!(stats["samples"], 4 * 40 * 24);
    assert_eq!(stats["rays"]["camera"], 4 * 40 * 24);
    assert_eq!(stats["dropped_samples"], 0);
}

#[test]
fn exr_metadata_has_the_settings() {
    use exr::prelude::*;
    let folder = lit_floor();
    done(
        folder.path(),
        &split("render s.toml --seed 18446744073709551615 --crop 10,4,30,20"),
    );
    let path = folder.path().join("s.exr");
    let image = read_first_flat_layer_from_file(&path).unwrap();
    assert_eq!(image.attributes.display_window.size, Vec2(40, 24));
    assert_eq!(image.layer_data.attributes.layer_position, Vec2(10, 4));
    assert_eq!(image.layer_data.size, Vec2(20, 16));
    let text = |name: &str| match &image.layer_data.attributes.other[&Text::from(name)] {
        AttributeValue::Text(text) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(text("embrasure.seed"), "18446744073709551615");
    assert_eq!(text("embrasure.samples"), "0..4");
    assert_eq!(text("embrasure.version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(text("embrasure.sceneHash").len(), 64);
    assert!(text("embrasure.settings").contains("integrator=path"));

    // A crop has the pixels of the full image.
    run(
        folder.path(),
        &["render", "s.toml", "--seed", "18446744073709551615", "-o", "full.exr"],
    );
    let (full, crop) = (
        read_channel(&folder.path().join("full.exr"), "R"),
        read_channel(&path, "R"),
    );
    for (i, value) in crop.iter().enumerate() {
        assert_eq!(full[(4 + i / 20) * 40 + 10 + i % 20].to_bits(), value.to_bits());
    }
}

#[test]
fn bits_depend_only_on_the_seed() {
    let folder = lit_floor();
    let render = |name: &str, flags: &[&str]| {
        done(
            folder.path(),
            &[&["render", "s.toml", "--spp", "70", "-o", name], flags].concat(),
        );
        folder.path().join(name)
    };
    let one = render("1.exr", &["--threads", "1"]);
    assert_same_bits(&one, &render("2.exr", &["--threads", "2"]));
    assert_same_bits(&one, &render("3.exr", &["--threads", "3"]));
    assert_same_bits(&one, &render("again.exr", &["--threads", "3"]));
    assert_ne!(read_rgb(&one), read_rgb(&render("seed.exr", &["--seed", "1"])));
}

/// A render stops at the noise level and reports the error. Its image is bit-identical for any
/// number of threads.
#[test]
fn noise_level_ends_the_render() {
    let folder = lit_floor();
    let render = |name: &str, flags: &[&str]| {
        let args = [&["render", "s.toml", "-o", name, "--stats", "n.json", "--noise"], flags].concat();
        let out = done(folder.path(), &args);
        let stats = read_json(&folder.path().join("n.json"));
        (words(&out), stats["noise"].clone())
    };
    let (_, noise) = render("1.exr", &["0.002", "--threads", "1"]);
    let (_, again) = render("2.exr", &["0.002", "--threads", "3"]);
    assert_eq!(noise, again);
    let error = noise["error"].as_f64().unwrap();
    assert!((0.001..=0.002).contains(&error), "{noise}");
    assert!(noise["min_spp"].as_u64().unwrap() >= 128, "{noise}");
    let [one, two] = ["1.exr", "2.exr"].map(|name| folder.path().join(name));
    assert_eq!(read_rgb(&one), read_rgb(&two));
    // The channel `error` has the errors of tiles. Their mean square is the squared error of the
    // image.
    let map = read_channel(&one, "error");
    let square = map.iter().map(|e| (*e as f64).powi(2)).sum::<f64>() / map.len() as f64;
    assert!((square.sqrt() / error - 1.0).abs() < 1e-4, "{} {error}", square.sqrt());
    let samples = read_channel(&one, "samples");
    let [min, max] = [f32::min, f32::max].map(|f| samples.iter().copied().reduce(f).unwrap());
    assert!(min < max, "every pixel has {min}");

    // If the noise level needs more samples than the maximum, this is reported.
    let (words, noise) = render("few.exr", &["0.0001", "--spp", "192"]);
    assert!(
        words.contains("was not reached with at most 192 samples per pixel"),
        "{words}"
    );
    assert!(words.contains("help: raise --spp to about "), "{words}");
    assert_eq!(noise["max_spp"], 192);
}

/// A render that is stopped before its noise level is reached says how long the level needs.
#[test]
fn stopped_render_says_how_long_its_noise_level_needs() {
    let folder = lit_floor();
    let line = "render s.toml --noise 0.00001 --time-limit 1s -o stopped.exr";
    let said = words(&done(folder.path(), &split(line)));
    let is_said = |text: &str| said.contains(&format!("stopped by --time-limit ({text}"));
    assert!(
        is_said("noise level 0.001 % needs about ") || is_said("the time for noise level 0.001 % cannot be estimated"),
        "{said}"
    );
}

#[test]
fn a_bare_obj_is_framed_and_lit() {
    let folder = lit_floor();
    fs::write(folder.path().join("b.obj"), "v 10 0 0\nv 11 0 0\nv 10 1 0\nf 1 2 3\n").unwrap();
    let out = done(folder.path(), &["render", "b.obj", "--size", "32x64", "--spp", "16"]);
    assert!(words(&out).contains("light: a studio"), "{}", words(&out));
    let albedo = read_channel(&folder.path().join("b.exr"), "albedo.R");
    let covered = albedo.iter().filter(|&&a| a > 0.0).count();
    assert!(covered > 100, "{covered} of {} pixels show the triangle", albedo.len());
    // The whole object is in the image: nothing touches the border.
    let border = (0..32)
        .map(|x| (x, 0))
        .chain((0..64).map(|y| (0, y)))
        .chain((0..64).map(|y| (31, y)));
    assert!(border.into_iter().all(|(x, y)| albedo[y * 32 + x] == 0.0));
}

/// Each case has the arguments of a mistake, a change of the scene folder, the expected exit code,
/// and words of the message.
#[test]
fn mistakes_are_named_and_leave_no_files() {
    type Change = fn(&Path);
    let keep: Change = |_| {};
    let cases: &[(&[&str], Change, i32, &[&str])] = &[
        (&["render", "gone.toml"], keep, 1, &["gone.toml", "cannot read"]),
        (&["render", "gone.obj"], keep, 1, &["gone.obj", "help:"]),
        (&["help", "scen"], keep, 2, &["`scen`", "help: did you mean scene?"]),
        (&["render", "."], keep, 1, &["directory", "help:"]),
        (&["render", "a.mtl"], keep, 1, &["a.mtl", "help:"]),
        (&["render"], keep, 2, &["render needs SCENE", "help:"]),
        (&["render", "s.toml", "--spp", "0"], keep, 2, &["--spp 0", "help:"]),
        (&["render", "s.toml", "--spp", "many"], keep, 2, &["--spp"]),
        (
            &["render", "s.toml", "--light-samples", "4294967295"],
            keep,
            2,
            &["--light-samples 4294967295", "help:"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "samples = 4", "light_samples = 5000"),
            1,
            &["s.toml:", "light_samples = 5000", "help:"],
        ),
        (
            &["render", "s.toml", "--noise", "0"],
            keep,
            2,
            &["--noise 0", "above 0", "help:"],
        ),
        (
            &["render", "s.toml", "--noise", "2"],
            keep,
            2,
            &["--noise", "2 means 200%; for 2% write 2%"],
        ),
        (
            &["render", "s.toml", "--noise", "0.1", "--spp", "100"],
            keep,
            2,
            &["--spp 100", "multiple of 64", "help:"],
        ),
        (
            &["render", "s.toml", "--size", "0x10"],
            keep,
            2,
            &["--size 0x10", "from 1 to 65536"],
        ),
        (&["render", "s.toml", "--size", "10"], keep, 2, &["--size"]),
        (
            &["render", "s.toml", "--crop", "0,0,41,10"],
            keep,
            2,
            &["--crop", "help:"],
        ),
        (&["render", "s.toml", "--threads", "0"], keep, 2, &["--threads 0"]),
        (
            &["render", "s.toml", "--integrator", "magic"],
            keep,
            2,
            &["magic", "path"],
        ),
        (
            &["render", "s.toml", "--sampler", "dice"],
            keep,
            2,
            &["dice", "independent"],
        ),
        (
            &["render", "s.toml", "--backend", "abacus"],
            keep,
            2,
            &["abacus", "brute"],
        ),
        (&["render", "s.toml", "--fov", "180"], keep, 2, &["180", "--fov"]),
        (
            &["render", "s.toml", "--position", "0,0.3,0", "--look-at", "0,0.3,0"],
            keep,
            2,
            &["look_at must not be"],
        ),
        (
            &["render", "s.toml", "-o", "x.exr", "-o", "x.exr"],
            keep,
            2,
            &["x.exr", "the same file"],
        ),
        (&["render", "s.toml", "-o", "x.jpg"], keep, 2, &["x.jpg", ".exr"]),
        (
            &["render", "s.toml", "-o", "no/such/x.exr"],
            keep,
            1,
            &["no/such", "mkdir -p"],
        ),
        (
            &["render", "s.toml", "--stats", "no/x.json"],
            keep,
            1,
            &["no/x.json", "mkdir -p"],
        ),
        (&["bogus"], keep, 2, &["bogus"]),
        (
            &["render", "s.toml"],
            |f| fs::remove_file(f.join("a.obj")).unwrap(),
            1,
            &["s.toml:11:7", "a.obj", "help:"],
        ),
        (
            &["render", "s.toml"],
            |f| fs::write(f.join("a.obj"), "").unwrap(),
            1,
            &["a.obj", "no faces", "help:"],
        ),
        (
            &["render", "s.toml", "--strict"],
            |f| append(f, "a.obj", "f 1 2 99\n"),
            1,
            &["a.obj:12", "99", "help:"],
        ),
        (
            &["render", "s.toml", "--strict"],
            |f| append(f, "a.obj", "v nan 0 0\nf 1 2 7\n"),
            1,
            &["a.obj:12", "nan", "help:"],
        ),
        (
            &["render", "s.toml", "--strict"],
            |f| append(f, "a.mtl", "Kd 0.5 red 0\n"),
            1,
            &["a.mtl:6", "red", "help:"],
        ),
        (
            &["render", "s.toml", "--strict"],
            |f| append(f, "a.mtl", "Ke -1 0 0\n"),
            1,
            &["a.mtl", "lamp", "Ke"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "shiny = 1\n"),
            1,
            &["s.toml:12", "shiny", "help:"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[material.floor]\ndiffuse = [0.1, -0.5, 0]\n"),
            1,
            &["s.toml:13", "floor", "diffuse is", "-0.5"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[material.floor]\nexponent = -1.0\n"),
            1,
            &["s.toml:13", "exponent is -1"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[material.floor]\nior = 0.0\n"),
            1,
            &["s.toml:13", "ior is 0"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[material.floor]\nmodel = \"velvet\"\n"),
            1,
            &["s.toml:13", "velvet", "blinn"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[material.floor]\neta = [1, 1, 1]\n"),
            1,
            &["s.toml:13", "`eta` without `k`"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[[light]]\ntype = \"environment\"\nimage = \"gone.hdr\"\n"),
            1,
            &["s.toml:14:9", "gone.hdr", "no such", "help:"],
        ),
        (
            &["render", "s.toml"],
            |f| {
                append(
                    f,
                    "s.toml",
                    "[[light]]\ntype = \"directional\"\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]\n",
                )
            },
            1,
            &["s.toml:14:13", "direction is [0, 0, 0]"],
        ),
        (
            &["render", "s.toml"],
            |f| {
                let light = "[[light]]\ntype = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, -1]\nangle = 95\n";
                append(f, "s.toml", light);
            },
            1,
            &["s.toml:16:13", "intensity"],
        ),
        (
            &["render", "s.toml", "--direct", "sometimes"],
            keep,
            2,
            &["sometimes", "mis, light, none"],
        ),
        (
            &["render", "s.toml", "--integrator", "distributed", "--tree-depth", "30"],
            keep,
            2,
            &["distributed", "--branching"],
        ),
        (
            &["render", "s.toml", "--integrator", "ao", "--ao-distance", "0"],
            keep,
            2,
            &["--ao-distance 0", "help:"],
        ),
        (
            &["render", "s.toml", "--integrator", "sppm", "--photon-alpha", "0"],
            keep,
            2,
            &["--photon-alpha 0", "help:"],
        ),
        (
            &["render", "s.toml", "--integrator", "photon-map", "--photon-count", "1"],
            keep,
            2,
            &["--photon-count 1", "help:"],
        ),
        (
            &["render", "s.toml", "--integrator", "photon-map", "--photons", "0"],
            keep,
            2,
            &["--photons 0", "help:"],
        ),
        (
            &["render", "s.toml", "--mutation-size", "0.6"],
            keep,
            2,
            &["--mutation-size 0.6", "at most 0.5"],
        ),
        (
            &["render", "s.toml", "--large-step-probability", "NaN"],
            keep,
            2,
            &["--large-step-probability NaN", "0 to 1"],
        ),
        (
            &["render", "s.toml", "--chains", "0"],
            keep,
            2,
            &["--chains 0", "help:"],
        ),
        (
            &["render", "s.toml", "--metropolis-direct", "none"],
            keep,
            2,
            &["metropolis-direct", "ordinary, metropolis"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "samples = 4", "bootstrap = 0"),
            1,
            &["s.toml", "bootstrap = 0", "help:"],
        ),
        (
            &["render", "s.toml", "--pixel", "40,0"],
            keep,
            2,
            &["--pixel 40,0", "columns 0 to 39"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[[light]]\ntype = \"sun\"\n"),
            1,
            &["s.toml:13", "sun", "point"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "[[light]]\ntype = \"point\"\n"),
            1,
            &["s.toml:13", "position"],
        ),
        (
            &["render", "s.toml"],
            |f| append(f, "s.toml", "matrix = [[0,0,0,0],[0,0,0,0],[0,0,0,0],[0,0,0,1]]\n"),
            1,
            &["s.toml:12", "flattens"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "width = 40", "width = 0"),
            1,
            &["s.toml:6", "width = 0", "from 1 to 65536"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "width = 40", "width = 70000"),
            1,
            &["s.toml:6", "70000", "65536"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "samples = 4", "samples = 0"),
            1,
            &["s.toml:9", "samples = 0"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "look_at = [0, 0.3, 0]", "look_at = [0, 1, 4]"),
            1,
            &["s.toml:4", "look_at"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "version = 1", "version = 7"),
            1,
            &["s.toml:1", "version 7"],
        ),
        (
            &["render", "s.toml"],
            |f| replace(f, "width = 40", "filter = \"sharp\""),
            1,
            &["s.toml:6", "sharp", "box"],
        ),
    ];
    for (args, change, expected, needles) in cases {
        let folder = lit_floor();
        change(folder.path());
        let out = run(folder.path(), args);
        let said = words(&out);
        assert_eq!(code(&out), *expected, "{args:?}: {said}");
        for needle in *needles {
            assert!(said.contains(needle), "{args:?}: no `{needle}` in: {said}");
        }
        assert!(!said.contains("panicked"), "{said}");
        let files: Vec<PathBuf> = fs::read_dir(folder.path())
            .unwrap()
            .map(|e| e.unwrap().path())
            .collect();
        assert!(files.len() <= 3, "{args:?} left files: {files:?}");
    }
}

fn append(folder: &Path, file: &str, text: &str) {
    let old = fs::read_to_string(folder.join(file)).unwrap();
    fs::write(folder.join(file), old + text).unwrap();
}

fn replace(folder: &Path, from: &str, to: &str) {
    let old = fs::read_to_string(folder.join("s.toml")).unwrap();
    assert!(old.contains(from));
    fs::write(folder.join("s.toml"), old.replace(from, to)).unwrap();
}

#[test]
fn a_missing_library_is_a_warning() {
    let folder = lit_floor();
    fs::remove_file(folder.path().join("a.mtl")).unwrap();
    let out = done(folder.path(), &["render", "s.toml"]);
    for needle in ["a.obj:1: material library", "a.mtl", "the default material replaces"] {
        assert!(words(&out).contains(needle), "no `{needle}` in: {}", words(&out));
    }
    let out = run(folder.path(), &["check", "s.toml"]);
    let said = printed(&out);
    assert!(
        said.contains("`floor`") && said.contains("rendered in a plain grey (diffuse 0.8) [missing-material]"),
        "{said}"
    );
    assert!(read_channel(&folder.path().join("s.exr"), "albedo.R").contains(&0.8));
}

/// A missing file that a scene file names is reported with line and column. Images, mappings and
/// layers change the scene hash.
#[test]
fn scene_file_textures_are_part_of_the_hash() {
    let folder = lit_floor();
    let path = folder.path();
    write_grey_png(&path.join("two.png"), &[0, 255]);
    let start = fs::read_to_string(path.join("s.toml")).unwrap();
    let lines = start.lines().count();
    let mut hashes = Vec::new();
    for keys in [
        "diffuse_map = \"two.png\"",
        "diffuse_map = { file = \"two.png\" }",
        "diffuse_map = { file = \"two.png\", scale = [2, 1] }",
        "diffuse = [1, 1, 1]",
        "diffuse = [1, 1, 1]\nopacity_map = \"two.png\"",
        "diffuse = [1, 1, 1]\nclearcoat = 0.5",
    ] {
        fs::write(
            path.join("t.toml"),
            format!("{start}[material.floor]\n{keys}\nbump_map = \"no.png\"\n"),
        )
        .unwrap();
        let out = run(path, &["render", "t.toml", "--stats", "x.json", "--size", "8x8"]);
        let said = words(&out);
        assert_eq!(code(&out), 0, "{said}");
        let line = lines + 2 + keys.lines().count();
        assert!(
            said.contains(&format!("t.toml:{line}:12: texture `no.png` is missing")),
            "{said}"
        );
        let stats = read_json(&path.join("x.json"));
        hashes.push(stats["scene_hash"].as_str().unwrap().to_string());
    }
    assert_eq!(hashes[0], hashes[1]);
    let mut distinct = hashes[1..].to_vec();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), hashes.len() - 1, "{hashes:?}");
}

/// A missing texture of a library is reported with its line. A texture that exists changes the
/// scene hash.
#[test]
fn library_textures_are_part_of_the_hash() {
    let folder = lit_floor();
    let path = folder.path();
    let mtl =
        "newmtl floor\nmap_Kd -s 2 2 tile.png\nmap_bump gone.png\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\nmap_Ke glow.png\n";
    fs::write(path.join("a.mtl"), mtl).unwrap();
    let mut hashes = Vec::new();
    for (grey, dialect) in [(100, "auto"), (101, "auto"), (100, "spec")] {
        write_grey_png(&path.join("tile.png"), &[grey]);
        let args = [
            "render",
            "s.toml",
            "--stats",
            "x.json",
            "--mtl-dialect",
            dialect,
            "--size",
            "8x8",
            "--warnings",
            "all",
        ];
        let out = done(path, &args);
        let said = words(&out);
        assert!(said.contains("a.mtl:3: texture `gone.png` is missing"), "{said}");
        assert!(said.contains("a.mtl:7: texture `glow.png` is missing"), "{said}");
        let stats = read_json(&path.join("x.json"));
        hashes.push(stats["scene_hash"].as_str().unwrap().to_string());
    }
    assert_ne!(hashes[0], hashes[1]);
    assert_eq!(hashes[0], hashes[2]);

    // An invalid image also causes a warning, with the reason.
    fs::write(path.join("tile.png"), "no picture").unwrap();
    let out = run(path, &["render", "s.toml", "--size", "8x8"]);
    let said = words(&out);
    assert_eq!(code(&out), 0, "{said}");
    assert!(
        said.contains("a.mtl:2: texture `tile.png` cannot be used") && said.contains("tile.png: "),
        "{said}"
    );

    for (args, word) in [
        (
            ["--mtl-dialect", "zbrush"],
            "--mtl-dialect zbrush\n  help: choose among auto, spec, blender, max, maya, sketchup, cinema4d, meshlab, rhino, wings3d, 3dfier, assimp, highlight",
        ),
        (
            ["--texture-dir", "gone"],
            "--texture-dir gone\n  help: an existing folder is expected",
        ),
        (["--smooth", "0"], "smooth"),
    ] {
        let said = refused(path, &["render", "s.toml", args[0], args[1]], 2);
        assert!(said.contains(word), "{said}");
    }
}

/// In MTL, a single number is a grey colour. Two numbers are an error.
#[test]
fn a_color_may_be_a_single_number() {
    let folder = lit_floor();
    append(folder.path(), "a.mtl", "newmtl floor\nKd 0.25\n");
    done(folder.path(), &["render", "s.toml"]);
    assert_eq!(
        read_channel(&folder.path().join("s.exr"), "albedo.B")[14 * 40 + 20],
        0.25
    );
    append(folder.path(), "a.mtl", "Kd 0.25 0.5\n");
    let words_of = "a.mtl:8:4: material `floor`: Kd: `0.25 0.5` is not a colour";
    let said = words(&done(folder.path(), &["render", "s.toml"]));
    assert!(said.contains(words_of), "{said}");
    let said = refused(folder.path(), &["render", "s.toml", "--strict"], 1);
    assert!(said.contains(words_of), "{said}");
}

#[test]
fn a_scene_file_overrides_materials() {
    let folder = lit_floor();
    append(
        folder.path(),
        "s.toml",
        "[material.floor]\ndiffuse = [0.25, 0.5, 0.75]\nspecular = [0.5, 0.5, 0.5]\n[material.unused]\n",
    );
    let out = done(folder.path(), &["render", "s.toml"]);
    assert!(words(&out).contains("no face uses the material `unused`"));
    // Kd + Ks is 0.75 + 0.5, more than 1, so both lobes are scaled.
    assert!(
        words(&out).contains("material `floor` reflects up to 1.25 times the light that it receives"),
        "{}",
        words(&out)
    );
    // The specular lobe is colourless, so channels differ only by the scaled diffuse lobe.
    let albedo = |channel: &str| read_channel(&folder.path().join("s.exr"), channel)[14 * 40 + 20];
    let difference = albedo("albedo.B") - albedo("albedo.R");
    assert!((difference - (0.75 - 0.25) / 1.25).abs() < 1e-3, "{difference}");
    assert!(albedo("albedo.B") < 1.0);
}

#[test]
fn every_integrator_renders() {
    let folder = lit_floor();
    for flags in [
        "--integrator path --directions cosine --direct light --roulette-depth 3",
        "--integrator path --mis balance --light-selection all --triangle-sampling solid-angle",
        "--integrator path --reuse none --sampler independent",
        "--integrator path --sampler orthogonal --directions fibonacci",
        "--integrator path --directions perturbed-qmc --direction-points hammersley --direction-perturbation 0.5",
        "--integrator path --directions perturbed-qmc-uniform --direction-points sobol --direction-scrambling off",
        "--integrator path --roulette constant:0.8 --roulette-depth 2",
        "--integrator bdpt --roulette threshold:0.2",
        "--integrator naive --emission-coin every-hit --emission-probability 0.2 --absorption chance --directions bsdf",
        "--integrator naive --roulette luminance",
        "--integrator one-sample --direct-probability 0.3",
        "--integrator area --max-depth 3",
        "--integrator path --filter mitchell",
        "--integrator whitted --filter gaussian --filter-radius 2",
        "--integrator naive --max-depth none",
        "--integrator whitted",
        "--integrator distributed --branching 2 --max-depth 3",
        "--integrator direct --light-selection uniform",
        "--integrator ao --ao-distance 2.5",
        "--integrator irradiance-cache --cache-error 0.5 --cache-rays 32",
        "--integrator debug --debug-view barycentrics",
        "--integrator debug --debug-view material",
        "--integrator debug --debug-view albedo",
        "--integrator debug --debug-view depth",
        "--integrator debug --debug-view wireframe",
        "--integrator debug --debug-view facing",
        "--integrator debug --debug-view light-count",
        "--integrator debug --debug-view ray-cost",
        "--integrator debug --debug-view ids",
        "--integrator pssmlt --chains 3 --bootstrap 100 --max-depth 5",
        "--integrator pssmlt --metropolis-direct metropolis --sampler zsobol --filter tent",
        "--integrator pssmlt --large-step-probability 0.5 --mutation-size 0.1 --sampler halton",
        "--integrator sppm --photons 2000 --photon-alpha 0.8",
        "--integrator photon-map --photons 2000 --photon-count 20 --gather-rays 2",
        "--integrator vcm --photons 500 --photon-radius 0.1",
    ] {
        let args: Vec<&str> = ["render", "s.toml", "--stats", "s.json"]
            .into_iter()
            .chain(flags.split(' '))
            .collect();
        done(folder.path(), &args);
        let red = read_channel(&folder.path().join("s.exr"), "R");
        let lit = red.iter().filter(|&&v| v > 0.0).count();
        assert!(lit > red.len() / 50, "{flags}: {lit} lit pixels");
        let stats = read_json(&folder.path().join("s.json"));
        assert_eq!(stats["integrator"], flags.split(' ').nth(1).unwrap());
        assert_eq!(stats["dropped_samples"], 0, "{flags}");
    }
    // The image file has the settings of the render.
    let out = run(folder.path(), &["render", "s.toml", "--direct", "light"]);
    assert_eq!(code(&out), 0);
    let data = fs::read(folder.path().join("s.exr")).unwrap();
    let settings = b"direction_scrambling=on direct=light mis=power";
    assert!(data.windows(settings.len()).any(|w| w == settings));
}

#[test]
fn lights_that_no_ray_hits_are_reported() {
    let folder = lit_floor();
    append(
        folder.path(),
        "s.toml",
        "[[light]]\ntype = \"spot\"\nposition = [0, 3, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, 1]\nangle = 40\n",
    );
    // If the scene also has a lamp, a spot light that no ray can hit is a warning.
    let out = done(folder.path(), &["render", "s.toml", "--direct", "none"]);
    assert!(words(&out).contains("no ray can hit a spot light"), "{}", words(&out));
    // Without other lights, the spot light is an error.
    append(folder.path(), "s.toml", "[material.lamp]\ndiffuse = [0, 0, 0]\n");
    for flags in [["--direct", "none"], ["--integrator", "naive"]] {
        let said = refused(folder.path(), &[&["render", "s.toml"], &flags[..]].concat(), 2);
        assert!(said.contains("black"), "{said}");
    }
    done(folder.path(), &["render", "s.toml"]);
}

#[test]
fn one_sample_can_be_explained() {
    let folder = lit_floor();
    let out = done(
        folder.path(),
        &["render", "s.toml", "--pixel", "20,14", "--sample", "3"],
    );
    let text = printed(&out);
    for needle in [
        "sample 3 of pixel 20,14",
        "camera from",
        "material `floor`",
        "shadow from",
        "radiance [",
    ] {
        assert!(text.contains(needle), "no `{needle}` in: {text}");
    }
    assert!(!folder.path().join("s.exr").exists());

    // The radiance that `--pixel` prints equals the pixel of a render, also with path reuse.
    for reuse in ["pixels", "none"] {
        let args = ["render", "s.toml", "--reuse", reuse];
        let told = run(folder.path(), &joined(&args, &["--pixel", "20,14"]));
        let told = printed(&told);
        done(folder.path(), &joined(&args, &["--spp", "1"]));
        let [r, g, b] = ["R", "G", "B"].map(|c| read_channel(&folder.path().join("s.exr"), c)[14 * 40 + 20]);
        assert!(r > 0.0);
        assert!(
            told.ends_with(&format!("radiance [{r:?}, {g:?}, {b:?}]\n")),
            "[{r:?}, {g:?}, {b:?}] was rendered, but told: {told}"
        );
    }
}

/// It is not an error if the reader of the output closes the pipe after the first line.
#[cfg(unix)]
#[test]
fn closed_output_pipe_is_not_an_error() {
    let folder = lit_floor();
    done(folder.path(), &split("render s.toml -q --spp 2 -o a.exr"));
    for command in [
        "info s.toml",
        "compare a.exr a.exr",
        "--help",
        "check s.toml",
        "completions bash",
    ] {
        let line = format!(
            "{} {command} | true; exit ${{PIPESTATUS[0]}}",
            crate::support::program::PROGRAM
        );
        let out = std::process::Command::new("bash")
            .args(["-c", &line])
            .current_dir(folder.path())
            .output()
            .unwrap();
        assert_eq!((code(&out), words(&out).as_str()), (0, ""), "{command}");
    }
}

/// All commands refuse a number of threads that is far above the number of processors.
#[test]
fn threads_are_counted_by_processors() {
    let folder = lit_floor();
    done(folder.path(), &split("render s.toml -q --threads 64 --spp 1 -o a.png"));
    for command in [
        "render s.toml",
        "lab s.toml",
        "bench s.toml",
        "explain s.toml floor -o a.png",
    ] {
        let said = refused(folder.path(), &split(&format!("{command} --threads 1000000")), 2);
        assert!(
            said.contains("--threads 1000000") && said.contains("processor") && said.contains("at most"),
            "{command}: {said}"
        );
    }
}

/// `--set` changes any key of a scene file, and errors refer to the flag.
#[test]
fn keys_of_a_scene_file_can_be_set() {
    let folder = lit_floor();
    let at = folder.path();
    let size = |line: &str| {
        done(at, &split(&format!("render {line} -q -o a.exr")));
        let header = exr::meta::MetaData::read_from_file(at.join("a.exr"), false).unwrap();
        let size = header.headers[0].layer_size;
        [size.width(), size.height()]
    };
    assert_eq!(size("s.toml --set image.width=9 --set image.height=7"), [9, 7]);
    assert_eq!(size("s.toml --set image.width=9 --size 5x6"), [5, 6]);
    let bare =
        "a.obj --set camera.position=[0,1,4] --set camera.look_at=[0,0.3,0] --set image.width=8 --set render.samples=1";
    assert_eq!(size(bare), [8, 512]);
    // A key has the same effect if `--set`, a flag or the file sets it.
    let bits = |line: &str| {
        done(at, &split(&format!("render {line} -q -o a.png")));
        fs::read(at.join("a.png")).unwrap()
    };
    let by_flag = bits("s.toml --max-depth 0");
    assert_eq!(bits("s.toml --set render.max_depth=0"), by_flag);
    assert_ne!(bits("s.toml"), by_flag);
    let red = bits("s.toml --set material.floor.diffuse=[0.9,0,0]");
    assert_ne!(red, bits("s.toml"));
    assert_ne!(
        bits("s.toml --set light.0.type=constant --set light.0.radiance=[1,1,1]"),
        bits("s.toml")
    );

    for (line, expected) in [
        (
            "render s.toml --set render.max_depth=-1",
            &["--set render.max_depth=-1: ", "help:"][..],
        ),
        (
            "render s.toml --set render.max_dept=3",
            &["unknown key `max_dept`", "did you mean `max_depth`"],
        ),
        (
            "render s.toml --set camera.vertical_fov=wide",
            &["--set camera.vertical_fov=wide: ", "help:"],
        ),
        (
            "render s.toml --set camera.vertical_fov=180",
            &["--set camera.vertical_fov=180: ", "180"],
        ),
        (
            "render s.toml --set image",
            &["--set image: expected KEY=VALUE", "render.max_depth=8"],
        ),
        ("render a.obj --set image.width=0", &["--set image.width=0: "]),
    ] {
        let said = refused(at, &split(line), 2);
        for words in expected {
            assert!(said.contains(words), "{line}: {said}");
        }
    }
    // Errors of the file keep their line and column.
    append(at, "s.toml", "[render2]\n");
    let said = refused(at, &split("render s.toml --set image.width=9"), 1);
    assert!(said.contains("s.toml:12:2: unknown key `render2`"), "{said}");
    let said = printed(&run(at, &split("check s.toml --set image.width=no")));
    assert!(said.contains("--set image.width=no"), "{said}");
}

/// A value may follow its flag after a space or `=`.
#[test]
fn flag_values_follow_a_space_or_an_equals_sign() {
    let folder = lit_floor();
    for args in ["--denoise gaussian", "--denoise=gaussian", "--spp 128 --noise 50%"] {
        let line = format!("render s.toml -q -o a.exr --stats s.json {args}");
        done(folder.path(), &split(&line));
        let stats = read_json(&folder.path().join("s.json"));
        match args.contains("denoise") {
            true => assert_eq!(stats["denoise"]["by"], "gaussian", "{stats}"),
            false => assert_eq!(stats["noise"]["level"], 0.5, "{stats}"),
        }
    }
    let said = refused(folder.path(), &split("render s.toml --denoise gausian"), 2);
    assert!(
        said.contains("--denoise gausian\n  help: did you mean gaussian?"),
        "{said}"
    );
}

/// After an interrupt of the slow reference render, the results of the finished renders are
/// written.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn lab_interrupt_at_reference_writes_renders() {
    let folder = lit_floor();
    let line = "lab s.toml --methods path,bdpt --spp 128 --size 160x96 -o cut";
    let mut child = command(folder.path(), &split(line)).spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap()).lines();
    let is_reference =
        |line: &std::io::Result<String>| line.as_ref().is_ok_and(|line| line.starts_with("reference: bdpt"));
    assert!(said.any(|line| is_reference(&line)));
    signal(&child, "INT");
    let rest: Vec<String> = said.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|line| line.contains("interrupted")), "{rest:?}");
    let csv = fs::read_to_string(folder.path().join("cut.csv")).unwrap();
    let rows: Vec<&str> = csv.lines().collect();
    assert!(
        rows.len() == 3 && rows[1].starts_with("\"path\",128,") && rows[1].ends_with(",,"),
        "{csv}"
    );
    assert!(folder.path().join("cut.png").exists());
}

/// A render with an audit traces the same packets as a render without an audit. If triangles
/// coincide, both renders hit the same triangle.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
fn audits_change_no_bit() {
    let mut obj = String::from("mtllib a.mtl\n");
    for i in 0..90 {
        let (x, name) = (0.05 * (i / 3) as f32, ["r", "g", "b"][i % 3]);
        obj += &format!(
            "usemtl {name}\nv {} -1 0\nv {x} -1 0.2\nv {} 1 0.1\nf -3 -2 -1\n",
            x - 1.0,
            x - 0.5
        );
    }
    let mtl = "newmtl r\nKd 0.9 0.1 0.1\nnewmtl g\nKd 0.1 0.9 0.1\nnewmtl b\nKd 0.1 0.1 0.9\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl)]);
    let render = split("render a.obj --size 24x24 --spp 4 -q -o");
    done(folder.path(), &joined(&render, &["plain.exr"]));
    done(
        folder.path(),
        &joined(&render, &["audited.exr", "--audit-rays", "1", "--stats", "s.json"]),
    );
    let [plain, audited] = ["plain.exr", "audited.exr"].map(|name| folder.path().join(name));
    assert_same_bits(&plain, &audited);
    let audit = &read_json(&folder.path().join("s.json"))["audit"];
    assert_eq!(audit["causes"]["unexplained"], 0, "{audit}");
    assert!(
        audit["causes"]["leak"].is_u64() && audit["wrong"].is_object(),
        "{audit}"
    );
}

/// A scene whose size is outside of the supported range is refused. The error has the size of the
/// scene and help.
#[test]
fn sizes_beyond_the_range_are_refused() {
    let obj = |s: &str| format!("v 0 0 0\nv {s} 0 0\nv 0 {s} 0\nf 1 2 3\n");
    let folder = folder(&[("small.obj", &obj("2e-10")), ("large.obj", &obj("3e13"))]);
    for (scene, number) in [("small.obj", "2e-10"), ("large.obj", "30000000000000")] {
        let said = refused(folder.path(), &["render", scene, "-q"], 1);
        assert!(said.contains(number) && said.contains("help: scale"), "{said}");
    }
}

#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
fn audits_report_and_replay() {
    let folder = lit_floor();
    done(
        folder.path(),
        &split("audit s.toml --rays 20000 --against brute -o r.json"),
    );
    let report = read_json(&folder.path().join("r.json"));
    let rays = report["closest_rays"].as_u64().unwrap() + report["occlusion_rays"].as_u64().unwrap();
    assert!((19_000..21_000).contains(&rays), "{report}");
    assert_eq!(report["causes"]["unexplained"], 0);

    // Trace a recorded ray again. The ray goes straight down onto the floor.
    let bits = |values: [f32; 9]| values.map(|v| format!("{:08x}", v.to_bits()));
    let ray = bits([0.1, 0.5, 0.2, 0.0, -1.0, 0.0, 0.0, f32::INFINITY, 0.0]);
    let replay = serde_json::json!({
        "scene_hash": report["scene_hash"], "rays": [{ "kind": "closest", "bits": ray }],
    });
    fs::write(folder.path().join("one.json"), replay.to_string()).unwrap();
    let out = run(
        folder.path(),
        &split("audit s.toml --replay one.json --against brute --json"),
    );
    assert_eq!((code(&out), words(&out).as_str()), (0, ""));
    let again = json(&out);
    assert_eq!(
        (again["closest_rays"].as_u64(), again["disagreements"].as_u64()),
        (Some(1), Some(0))
    );

    // Audit a fraction of the rays of a render
    let args = ["render", "s.toml", "-q", "--audit-rays", "0.5", "--stats", "s.json"];
    done(folder.path(), &args);
    let stats = read_json(&folder.path().join("s.json"));
    let rays: u64 = ["camera", "bounce", "shadow"]
        .iter()
        .map(|k| stats["rays"][k].as_u64().unwrap())
        .sum();
    let checked: u64 = ["closest_rays", "occlusion_rays"]
        .iter()
        .map(|k| stats["audit"][k].as_u64().unwrap())
        .sum();
    assert!((checked as f64 / rays as f64 - 0.5).abs() < 0.05, "{checked} of {rays}");

    // Invalid arguments and invalid reports
    for (args, what) in [
        (
            &["audit", "s.toml", "--backend", "brute", "--against", "brute"][..],
            "against",
        ),
        (
            &["audit", "s.toml", "--against", "nothing"],
            "choose among embree, obvhs, brute",
        ),
        (&["audit", "s.toml", "--rays", "0"], "--rays"),
        (
            &["audit", "s.toml", "--rays", "18446744073709551615", "--size", "1x1"],
            "2^32",
        ),
        (&["render", "s.toml", "--audit-rays", "2"], "from 0 to 1"),
    ] {
        let said = refused(folder.path(), args, 2);
        assert!(said.contains(what), "{said}");
    }
    let said = refused(folder.path(), &["audit", "s.toml", "--replay", "a.obj"], 1);
    assert!(said.contains("a.obj: not a report"), "{said}");
}

#[test]
#[cfg_attr(not(long), ignore = "long")]
fn benches_print_tables_and_json() {
    let folder = lit_floor();
    let out = done(folder.path(), &split("bench s.toml a.obj --repeat 1 --size 16x16"));
    let text = printed(&out);
    for word in ["| s ", "| a ", "render / replay", "bytes a triangle", "shadow"] {
        assert!(text.contains(word), "{word} in {text}");
    }
    let out = run(folder.path(), &split("bench s.toml --repeat 1 --json -q --threads 2"));
    assert_eq!((code(&out), words(&out).as_str()), (0, ""));
    let report = json(&out);
    let scene = &report["scenes"][0];
    assert_eq!(
        (scene["triangles"].as_u64(), scene["width"].as_u64()),
        (Some(4), Some(40))
    );
    for backend in scene["backends"].as_array().unwrap() {
        let threads: Vec<_> = backend["runs"]
            .as_array()
            .unwrap()
            .iter()
            .map(|r| r["threads"].as_u64().unwrap())
            .collect();
        assert_eq!(threads, [1, 2]);
        for run in backend["runs"].as_array().unwrap() {
            for kind in ["camera", "first_bounce", "shadow"] {
                assert!(run["mrays_per_s"][kind].as_f64().unwrap() > 0.0, "{report}");
            }
            // The render traces more than one ray per pixel, and tracing the rays again takes time.
            assert!(run["rays"].as_u64().unwrap() > 40 * 24 && run["replay_s"].as_f64().unwrap() > 0.0);
        }
    }
    let out = run(folder.path(), &["bench", "gone.toml"]);
    assert_eq!(code(&out), 1);
}

#[test]
fn quiet_is_silent_and_version_has_backends() {
    let folder = lit_floor();
    let out = run(folder.path(), &["render", "s.toml", "-q"]);
    assert_eq!((code(&out), words(&out).as_str()), (0, ""));
    let out = run(folder.path(), &["--version"]);
    let text = printed(&out);
    assert!(
        text.starts_with(&format!("embrasure {}", env!("CARGO_PKG_VERSION"))),
        "{text}"
    );
    assert!(text.contains("brute"));
    assert_eq!(text.contains("embree 4."), cfg!(feature = "embree"), "{text}");
}

#[test]
fn info_leaves_out_what_the_program_adds() {
    let folder = lit_floor();
    fs::write(folder.path().join("b.obj"), "v 10 0 0\nv 11 0 0\nv 10 1 0\nf 1 2 3\n").unwrap();
    let info = json(&run(folder.path(), &["info", "b.obj", "--json"]));
    let numbers = ["meshes", "triangles", "vertices", "added_triangles"].map(|key| info[key].as_u64().unwrap());
    assert_eq!(numbers, [1, 1, 3, 2]);
    let materials = info["materials"].as_array().unwrap().iter();
    assert!(materials.clone().all(|material| material["name"] != "ground"), "{info}");
    let text = printed(&done(folder.path(), &["info", "b.obj"]));
    assert!(
        text.contains("triangles  1 (a render adds 2 for the ground or the guessed lamp)\n"),
        "{text}"
    );
    let text = printed(&done(folder.path(), &["info", "b.obj", "--env", "white"]));
    assert!(text.contains("triangles  1 (a render adds 2"), "{text}");
}

#[test]
fn info_counts_triangles_and_lights() {
    let folder = lit_floor();
    let out = run(folder.path(), &["info", "s.toml", "--json"]);
    let info = json(&out);
    assert_eq!(
        (&info["triangles"], &info["lights"]["rectangle"]),
        (&4.into(), &1.into())
    );
    assert_eq!(info["bounds"][1], serde_json::json!([1.0, 1.0, 1.0]));
    done(folder.path(), &["info", "s.toml"]);
}

/// A process that is killed when this value is dropped, also if its test fails.
struct KilledOnDrop(std::process::Child);

impl Drop for KilledOnDrop {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

/// The memory limit is checked before allocation: for the text, for the scene, and for the render.
#[test]
fn more_memory_than_allowed_is_refused() {
    let folder = lit_floor();
    // Fans from 100 points of a circle: 20,000 triangles, whose text needs much less memory
    let corner = |i: u32| (f64::from(i) * std::f64::consts::TAU / 250.0).sin_cos();
    let mut text: String = (0..250)
        .map(corner)
        .map(|(y, x)| format!("v {x:.3} {y:.3} 0\n"))
        .collect();
    for apex in 1..=100 {
        text.extend((apex + 1..250).map(|i| format!("f {apex} {i} {}\n", i + 1)));
    }
    fs::write(folder.path().join("many.obj"), text).unwrap();
    for (limit, word) in [
        ("100k", "many.obj: reading"),
        ("300kB", "many.obj: reading"),
        ("5M", "the render"),
    ] {
        let out = run(
            folder.path(),
            &[
                "render",
                "many.obj",
                "--size",
                "8x8",
                "-o",
                "m.png",
                "--denoise=off",
                "--max-memory",
                limit,
            ],
        );
        let said = words(&out);
        assert_eq!(code(&out), 1, "{limit}: {said}");
        for word in [word, "--max-memory", "help:", "MB"]
            .into_iter()
            .filter(|w| *w != "MB" || limit == "5M")
        {
            assert!(said.contains(word), "{limit}: {said}");
        }
        assert!(!folder.path().join("m.png").exists());
    }
    for (args, status) in [
        (["--max-memory", "2G"], 0),
        (["--max-memory", "0"], 2),
        (["--max-memory", "2x"], 2),
    ] {
        let base = ["render", "many.obj", "--size", "16x16", "--spp", "1", "-o", "m.png"];
        let out = run(folder.path(), &joined(&base, &args));
        assert_eq!(code(&out), status, "{args:?}: {}", words(&out));
    }
    // If a denoiser needs most of the memory for the pixels, the error suggests to leave it out.
    for (denoise, is_named) in [("--denoise=atrous", true), ("--denoise=off", false)] {
        let flags = "render many.obj --size 8000x4000 --spp 1 -o m.png --max-memory 1G";
        let out = run(folder.path(), &joined(&split(flags), &[denoise]));
        let said = words(&out);
        assert_eq!(code(&out), 1, "{said}");
        assert!(said.contains("8000x4000 pixels take about"), "{said}");
        assert_eq!(
            said.contains("leave the denoiser out (--denoise=off)"),
            is_named,
            "{said}"
        );
    }
}

/// With compact vertices, a scene needs less memory and gives the same image.
#[test]
fn compact_scenes_look_the_same() {
    let folder = lit_floor();
    let render = |name: &str, more: &[&str]| {
        let (exr, json) = (format!("{name}.exr"), format!("{name}.json"));
        let args = [&["render", "s.toml", "--spp", "16", "-o", &exr, "--stats", &json], more].concat();
        done(folder.path(), &args);
        let stats = read_json(&folder.path().join(json));
        (
            read_rgb(&folder.path().join(exr)),
            stats["scene_bytes"].as_u64().unwrap(),
        )
    };
    let (usual, compact) = (render("usual", &[]), render("compact", &["--compact"]));
    assert!(compact.1 < usual.1, "{} and {} bytes", compact.1, usual.1);
    for (a, b) in usual.0.iter().flatten().zip(compact.0.iter().flatten()) {
        assert!((a - b).abs() <= 1e-3 * a.abs().max(1e-3), "{a} and {b}");
    }
}

/// A checkpoint of a range of samples stores the range. A render that resumes the checkpoint has
/// this range, and `merge` accepts the checkpoint as a part.
#[test]
fn checkpoint_of_a_range_is_resumed_and_merged() {
    let folder = lit_floor();
    let path = |name: &str| folder.path().join(name);
    let render = |more: &str| done(folder.path(), &split(&format!("render s.toml -q {more}")));
    render("--spp 128 -o whole.exr");
    render("--samples 0..64 -o first.exr");
    render("--samples 64..128 --checkpoint c.exr -o second.exr");
    render("--samples 64..128 --checkpoint c.exr --resume -o resumed.exr");
    assert_same_bits(&path("resumed.exr"), &path("second.exr"));
    done(folder.path(), &split("merge -q c.exr first.exr -o merged.exr"));
    assert_same_bits(&path("merged.exr"), &path("whole.exr"));
}

/// An interrupt ends the render, writes the image so far, and has its own exit code.
#[cfg(unix)]
#[test]
fn interrupt_writes_the_image_so_far() {
    let folder = lit_floor();
    // A shell may make its child processes ignore interrupts. The time limit ends the render then.
    let args = split("render s.toml --spp 100000000 --time-limit 60s --stats x.json");
    let child = command(folder.path(), &args).stderr(Stdio::null()).spawn().unwrap();
    let mut child = KilledOnDrop(child);
    // Wait until the first pass of 960 pixels is complete on any machine. The whole render would
    // take hours.
    wait_for_work(&child.0, std::time::Duration::from_secs(2));
    signal(&child.0, "INT");
    assert_eq!(child.0.wait().unwrap().code(), Some(130));
    let samples = read_channel(&folder.path().join("s.exr"), "samples");
    assert!(samples.iter().all(|&n| (1.0..100_000_000.0).contains(&n)));
    let stats = read_json(&folder.path().join("x.json"));
    assert_eq!(stats["complete"], false);
}

/// A flag without effect in the integrator is reported. Keys of a scene file without effect are not
/// reported, because they may be meant for another integrator.
#[test]
fn idle_flags_are_warnings() {
    let folder = lit_floor();
    for (args, idle) in [
        (
            "bdpt --direct none --directions cosine --light-samples 4",
            vec!["direct", "directions", "light-samples"],
        ),
        ("mlt --mis balance", vec!["mis"]),
        (
            "path --chains 3 --photons 9 --branching 7",
            vec!["branching", "chains", "photons"],
        ),
        (
            "pssmlt --roulette-depth 4 --metropolis-target luminance",
            vec!["roulette-depth"],
        ),
        ("sppm --photon-count 5 --photons 9", vec!["photon-count"]),
        ("path --reuse none --roulette-depth 2 --max-depth 3", vec![]),
    ] {
        let base = split("render s.toml --size 8x8 --spp 1 -q -o a.png --stats s.json --integrator");
        let out = done(folder.path(), &joined(&base, &split(args)));
        let method = split(args)[0];
        let said = words(&out);
        let lines: Vec<&str> = said.lines().filter(|line| line.contains("does not use it")).collect();
        assert_eq!(lines.len(), idle.len(), "{args}: {said}");
        let listed = read_json(&folder.path().join("s.json"))["warnings"].to_string();
        for name in idle {
            let words = format!("--{name}: {method} does not use it");
            assert!(
                lines.iter().any(|line| line.contains(&words)) && listed.contains(&words),
                "{args}: {said}"
            );
        }
    }
    replace(folder.path(), "samples = 4", "samples = 4\nphotons = 9");
    let out = done(folder.path(), &split("render s.toml --size 8x8 --spp 1 -q -o a.png"));
    assert_eq!(words(&out), "");

    // A PNG file cannot have additional channels.
    let channels = "render s.toml --size 8x8 --spp 1 -q --aov P,uv -o a.png";
    let said = words(&done(folder.path(), &split(channels)));
    assert!(
        said.contains("--aov P,uv: a PNG file has no further channels"),
        "{said}"
    );
    let out = done(folder.path(), &split(&format!("{channels} -o a.exr")));
    assert_eq!(words(&out), "");
}

/// The cases of `selftest` pass with each backend. Scripts can read their measured and expected
/// values.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn selftests_pass() {
    let folder = folder(&[]);
    let report = json(&done(folder.path(), &split("selftest --quick --json")));
    let cases = report["cases"].as_array().unwrap();
    assert!(
        cases.len() >= 10 && report["passed"] == cases.len() && report["failed"] == 0,
        "{report}"
    );
    for case in cases {
        let [measured, expected, tolerance] =
            ["measured", "expected", "tolerance"].map(|key| case[key].as_f64().unwrap());
        assert!((measured - expected).abs() <= tolerance, "{case}");
    }
    let backend = report["cases"][0]["backend"].as_str().unwrap();
    let said = printed(&done(
        folder.path(),
        &split(&format!("selftest --quick --backend {backend}")),
    ));
    assert!(
        said.starts_with(&format!("{backend}\n  ok     closed-room")) && said.ends_with(" 0 failed\n"),
        "{said}"
    );
}
