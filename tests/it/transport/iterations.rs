//! Integrators whose light can fall on any pixel render in iterations. Other integrators prepare
//! data for all pixels. For both kinds, threads, interruptions and parts change no bit of the
//! image, and files have the expected channels.

use crate::support::program::{
    assert_same_bits, code, done, folder, joined, limited, read_json, refused, run, split, words,
};
use crate::support::read_channel;
use exr::prelude::read_all_flat_layers_from_file;
use std::fs;
use tempfile::TempDir;

/// Integrators with iterations or with prepared data, each with its options.
const METHODS: &[&str] = &[
    "light --aov P,lights",
    "bdpt --max-depth 3 --aov strategies,lights,id",
    "pssmlt --max-depth 5 --chains 8 --aov lights",
    "mlt --max-depth 5 --chains 8",
    "sppm --max-depth 5 --aov lights",
    "vcm --max-depth 4",
    "photon-map --max-depth 4 --photons 4000 --gather-rays 1",
    "irradiance-cache --max-depth 4 --cache-rays 64",
];

/// A folder with a lit floor, a mirror, a glass tetrahedron and a sky, seen through a lens.
fn scene() -> TempDir {
    folder(&[
        (
            "a.mtl",
            "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl mirror\nKd 0.2 0.3 0.2\nKs 0.6 0.6 0.6\nillum 3\nnewmtl lamp\nKd 0.1 0.1 0.1\nKe 5 5 5\n\
             newmtl glass\nKd 0 0 0\nTf 1 1 1\nNi 1.5\nillum 6\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\nv -1 1 1\nv 0.1 0.1 0.5\nv 0.7 0.1 0.5\nv 0.4 0.1 0\n\
             v 0.4 0.6 0.3\nusemtl floor\nf 1 2 3 4\nusemtl mirror\nf 1 4 5 7\nusemtl lamp\nf 4 3 6 5\nusemtl glass\nf 8 10 9\nf 8 9 11\nf 9 10 11\nf 10 8 11\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\nlens_radius = 0.05\nfocus_distance = 4\n\
             [image]\nwidth = 44\nheight = 29\n[[object]]\nobj = \"a.obj\"\n[[light_group]]\nname = \"lamps\"\nmaterials = [\"lamp\"]\n\
             [[light]]\ntype = \"constant\"\nradiance = [0.2, 0.3, 0.4]\n",
        ),
    ])
}

fn assert_same(folder: &TempDir, one: &str, other: &str) {
    assert_same_bits(&folder.path().join(one), &folder.path().join(other));
}

/// The number of threads, interruptions, crops and parts of a render change no bit of the image.
/// The order in which parts are merged changes no bit either.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn threads_parts_and_stops_change_no_bit() {
    for method in METHODS {
        let folder = scene();
        let usual = joined(&["render", "s.toml", "-q", "--integrator"], &split(method));
        let iterations = |n: &str, more: &str| done(folder.path(), &[&usual[..], &["--spp", n], &split(more)].concat());
        let render = |more: &str| iterations("130", more);
        render("-o one.exr --threads 1");
        let light = read_channel(&folder.path().join("one.exr"), "G");
        assert!(
            light.iter().all(|v| v.is_finite()) && light.iter().any(|&v| v > 0.1),
            "{method}"
        );
        render("-o other.exr --threads 3");
        assert_same(&folder, "other.exr", "one.exr");

        // Stop and resume the render many times
        let (mut limit, mut stops) = (0.01, 0);
        loop {
            let more = split("--spp 130 -o later.exr --checkpoint c.exr --resume --stats s.json");
            limited(folder.path(), &joined(&usual, &more), limit);
            if read_json(&folder.path().join("s.json"))["complete"] == true {
                break;
            }
            (limit, stops) = (limit * 2.0, stops + 1);
        }
        assert!(stops > 0, "{method}");
        assert_same(&folder, "later.exr", "one.exr");
        // Add iterations to a checkpoint
        iterations("37", "-o few.exr --checkpoint d.exr");
        render("-o many.exr --checkpoint d.exr --resume");
        assert_same(&folder, "many.exr", "one.exr");

        // Render the image in parts
        render("-o left.exr --crop 0,0,17,29");
        render("-o right-2.exr --crop 17,0,44,29 --samples 64..130 --threads 3");
        render("--checkpoint right-1.exr -o unused.exr --crop 17,0,44,29 --samples 0..64");
        for parts in ["left.exr right-1.exr right-2.exr", "right-2.exr right-1.exr left.exr"] {
            done(
                folder.path(),
                &joined(&["merge", "-q", "-o", "merged.exr"], &split(parts)),
            );
            assert_same(&folder, "merged.exr", "one.exr");
        }
    }
}

/// A noise level ends the render at the end of a block of iterations, with the requested error.
#[test]
fn noise_levels_end_iterations() {
    let folder = scene();
    let args = split(
        "render s.toml -q --integrator bdpt --spp 4096 --noise 0.06 --stats s.json -o one.exr --sampler independent",
    );
    done(folder.path(), &args);
    let stats = read_json(&folder.path().join("s.json"));
    assert_eq!(stats["stop"], "noise");
    let samples = read_channel(&folder.path().join("one.exr"), "samples");
    assert!(
        samples
            .iter()
            .all(|&n| n == samples[0] && n % 64.0 == 0.0 && (128.0..4096.0).contains(&n))
    );
    done(folder.path(), &joined(&args, &split("--threads 1 -o other.exr")));
    assert!(fs::exists(folder.path().join("other.exr")).unwrap());
    assert_same(&folder, "other.exr", "one.exr");
}

/// Unsupported options are errors before rendering starts. The message says how to correct them.
#[test]
fn unsupported_outputs_are_errors() {
    let folder = scene();
    for (args, words) in [
        ("--integrator bdpt --pixel 1,1", "no sample belongs to one pixel"),
        ("--integrator path --aov strategies", "--integrator bdpt"),
        ("--integrator light --aov strategies", "--integrator bdpt"),
        (
            "--integrator bdpt --aov strategies --max-depth 7",
            "--max-depth of at most 6",
        ),
        (
            "--integrator bdpt --aov strategies --max-depth none",
            "--max-depth of at most 6",
        ),
        (
            "--integrator irradiance-cache --aov lights",
            "use one of the integrators path, naive, one-sample, area, whitted, distributed, direct, light, bdpt, pssmlt, sppm, photon-map, vcm, mlt",
        ),
    ] {
        let said = refused(folder.path(), &joined(&split("render s.toml -q"), &split(args)), 2);
        assert!(said.contains(words), "{args}: {said}");
    }
    // `all` leaves out unsupported outputs.
    done(
        folder.path(),
        &split("render s.toml -q --spp 1 --integrator path --aov all -o a.exr"),
    );
    done(
        folder.path(),
        &split("render s.toml -q --spp 1 --integrator bdpt --max-depth 2 --aov all -o a.exr"),
    );
    // Strategies must be named explicitly, because they are hundreds of channels.
    let picture = read_all_flat_layers_from_file(folder.path().join("a.exr")).unwrap();
    let channels = picture.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
    let names: Vec<String> = channels.map(|channel| channel.name.to_string()).collect();
    assert!(names.contains(&"P.X".into()), "{names:?}");
    assert!(!names.iter().any(|name| name.contains("strategy")), "{names:?}");
    done(
        folder.path(),
        &split("render s.toml -q --spp 1 --integrator bdpt --max-depth 2 --aov all,strategies -o b.exr"),
    );
    assert!(!read_channel(&folder.path().join("b.exr"), "unweighted_s0_t2.G").is_empty());
    assert!(!read_channel(&folder.path().join("b.exr"), "P.X").is_empty());
}

/// Layers of strategies sum to the image.
#[test]
fn strategies_sum_to_the_image() {
    let folder = scene();
    done(
        folder.path(),
        &split("render s.toml -q --integrator bdpt --spp 4 --max-depth 3 --aov strategies -o a.exr"),
    );
    let read = |name: &str| read_channel(&folder.path().join("a.exr"), name);
    let mut sum = vec![0.0; 44 * 29];
    for n in 2..=5 {
        for t in 1..=n {
            let layer = read(&format!("strategy_s{}_t{t}.R", n - t));
            sum.iter_mut().zip(layer).for_each(|(sum, value)| *sum += value);
        }
    }
    for (sum, value) in sum.iter().zip(read("R")) {
        assert!((sum - value).abs() <= 1e-4 * value.abs() + 1e-6, "{sum} {value}");
    }
}

/// A render that ends before its first sample is complete writes no image and no checkpoint, and
/// keeps existing files.
#[test]
fn render_without_samples_writes_no_image() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("keep.png"), "good").unwrap();
    fs::write(path("keep.exr"), "better").unwrap();
    let outputs = split("--checkpoint c.exr -o keep.png -o keep.exr --stats s.json --write-every 0.001s -q");
    for method in [
        "bdpt --size 999x999",
        "sppm --photons 9999999",
        "photon-map --photons 9999999",
        "irradiance-cache --cache-rays 99999",
        "path --size 16x16 --light-samples 1024 --light-selection all",
    ] {
        // The render ends before any tile of `path` is complete
        let limit = if method.starts_with("path") {
            "0.000001s"
        } else {
            "0.02s"
        };
        let args = [
            &["render", "s.toml", "--time-limit", limit, "--integrator"],
            &split(method)[..],
            &outputs,
        ]
        .concat();
        let said = refused(folder.path(), &args, 1);
        assert!(
            said.contains("before the first sample") && said.contains("help:"),
            "{method}: {said}"
        );
        assert_eq!(fs::read(path("keep.png")).unwrap(), b"good");
        assert_eq!(fs::read(path("keep.exr")).unwrap(), b"better");
        assert!(!path("c.exr").exists());
        let stats = read_json(&path("s.json"));
        assert_eq!((&stats["samples"], &stats["stop"]), (&0.into(), &"time-limit".into()));
    }
}

/// If loading takes longer than the time limit, no sample is taken, although a sample takes only
/// microseconds.
#[test]
fn time_limit_during_loading_is_an_error() {
    let folder = scene();
    let args = split("render s.toml -q --size 1x1 --spp 100000000 --time-limit 0.001s -o a.png --stats s.json");
    let said = refused(folder.path(), &args, 1);
    assert!(
        said.contains("--time-limit was reached") && said.contains("reading and building took"),
        "{said}"
    );
    assert_eq!(read_json(&folder.path().join("s.json"))["samples"], 0);
    assert!(!folder.path().join("a.png").exists());
}

/// An interrupt before the first sample has its own exit code.
#[cfg(unix)]
#[test]
fn interrupt_before_first_sample_writes_nothing() {
    let folder = scene();
    let path = folder.path().join("keep.png");
    fs::write(&path, "good").unwrap();
    let args = split("render s.toml --integrator sppm --photons 20000000 -q -o keep.png");
    let child = crate::support::program::command(folder.path(), &args).spawn().unwrap();
    crate::support::program::wait_for_work(&child, std::time::Duration::from_millis(500));
    crate::support::program::signal(&child, "INT");
    let out = child.wait_with_output().unwrap();
    assert_eq!(code(&out), 130, "{}", words(&out));
    assert!(words(&out).contains("before the first sample"), "{}", words(&out));
    assert_eq!(fs::read(&path).unwrap(), b"good");
}

/// Images and checkpoints that are due within an iteration are written at the end of the iteration.
/// So the render always makes progress.
#[test]
fn frequent_writes_wait_for_whole_iterations() {
    let folder = scene();
    let args = split(
        "render s.toml -q --integrator sppm --photons 200000 --spp 3 -o a.png --checkpoint c.exr --checkpoint-interval 0.001s \
         --write-every 0.001s --stats s.json --time-limit 60s",
    );
    done(folder.path(), &args);
    let stats = read_json(&folder.path().join("s.json"));
    assert_eq!(stats["complete"], true, "{stats}");
}

/// The forecast of `-v` includes the memory of stored photons and paths. If this memory exceeds the
/// limit, the render is refused.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn memory_of_stored_light_is_forecast() {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box.toml");
    let folder = folder(&[]);
    let base = [
        "render",
        scene,
        "--size",
        "64x64",
        "--spp",
        "1",
        "-o",
        "a.png",
        "--stats",
        "s.json",
        "--integrator",
    ];
    for method in [
        "sppm --photons 200000",
        "photon-map --photons 200000 --gather-rays 1",
        "vcm --photons 100000",
        "mlt --bootstrap 100000",
        "pssmlt --bootstrap 1000000",
        "bdpt",
        "irradiance-cache",
    ] {
        let usual = joined(&base, &split(method));
        let out = done(folder.path(), &joined(&usual, &["-v"]));
        let said = words(&out);
        let (_, forecast) = said.split_once("memory: a maximum of about ").unwrap();
        let forecast: f64 = forecast.split_whitespace().next().unwrap().parse().unwrap();
        if let Some(peak) = read_json(&folder.path().join("s.json"))["peak_rss_bytes"].as_f64() {
            let peak = peak / 1e6;
            println!("{method}: forecast {forecast}, measured {peak}");
            assert!(
                forecast > 0.8 * peak && forecast < 1.8 * peak,
                "{method}: forecast {forecast}, measured {peak}"
            );
        }
        if method.contains("photons") {
            let said = refused(folder.path(), &joined(&usual, &["-q", "--max-memory", "20M"]), 1);
            assert!(said.contains("--max-memory"), "{said}");
        }
    }
    // Integrators that keep whole paths have a separate limit
    let said = refused(folder.path(), &joined(&base, &split("vcm --photons 60000000")), 2);
    assert!(
        said.contains("--photons 60000000") && said.contains("16777216"),
        "{said}"
    );
    // The path tracer stores no light.
    let out = run(folder.path(), &joined(&base, &split("path -q --max-memory 30M")));
    assert_eq!(code(&out), 0, "{}", words(&out));
}
