//! Renders that are stopped, killed, or split into parts and merged are bit-identical to one
//! uninterrupted render. Written data is never lost.

use crate::support::program::{
    assert_same_bits, code, command, done, folder, joined, limited, read_json, refused, run, signal, split,
    wait_for_work, words,
};
use crate::support::read_channel;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SPP: u32 = 320;

/// The lamp of the scene as a group, and a sky in no group.
const LIGHT_GROUPS: &str = "[[light_group]]\nname = \"lamps\"\nmaterials = [\"lamp\"]\n\
                            [[light]]\ntype = \"constant\"\nradiance = [0.2, 0.3, 0.4]\n";

/// A folder with a small scene, `s.toml`: a lit floor and a Phong panel, and nothing in the
/// background.
fn scene() -> TempDir {
    folder(&[
        (
            "a.mtl",
            "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl panel\nKd 0.2 0.3 0.2\nKs 0.5 0.5 0.5\nNs 20\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n",
        ),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nv -1 1 -1\nv 1 1 -1\nv -1 1 1\n\
             usemtl floor\nf 1 2 3 4\nusemtl panel\nf 1 4 5 7\nusemtl lamp\nf 4 3 6 5\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\n\
             [image]\nwidth = 44\nheight = 29\n[[object]]\nobj = \"a.obj\"\n",
        ),
    ])
}

/// Asserts that two images in `folder` have the same bits.
fn assert_same(folder: &TempDir, one: &str, other: &str) {
    assert_same_bits(&folder.path().join(one), &folder.path().join(other));
}

/// The number of threads, interruptions and parts of a render change no bit of the image. The order
/// in which parts are merged changes no bit either.
#[test]
fn threads_stops_and_parts_change_no_bit() {
    let folder = scene();
    let file = folder.path().join("s.toml");
    let text = fs::read_to_string(&file).unwrap() + LIGHT_GROUPS;
    fs::write(&file, text).unwrap();
    let spp = SPP.to_string();
    let usual: &[&str] = &["render", "s.toml", "-q", "--spp", &spp, "--aov", "lights"];
    done(folder.path(), &joined(usual, &["-o", "one.exr", "--threads", "2"]));
    let one = |name: &str| read_channel(&folder.path().join("one.exr"), name);
    assert!(one("light_lamps.G") != one("G") && one("light_default.G") != one("G"));
    assert!(one("samples").iter().all(|&n| n == SPP as f32));

    let mut interruptions = 0;
    for (threads, parts) in [("1", 1), ("3", 1), ("1", 2), ("2", 5)] {
        for interrupted in [false, true] {
            let name = |part: u32, kind: &str| format!("{threads}-{parts}-{interrupted}-{part}-{kind}.exr");
            let blocks = SPP / 64;
            let mut files = Vec::new();
            for part in 0..parts {
                let range = format!("{}..{}", blocks * part / parts * 64, blocks * (part + 1) / parts * 64);
                let (state, picture) = (name(part, "state"), name(part, "picture"));
                let mut args = joined(usual, &["--threads", threads, "--checkpoint", &state, "-o", &picture]);
                if parts > 1 {
                    args.extend(["--samples", &range]);
                }
                if interrupted {
                    // Increase the time limit, so that the loop ends
                    let mut limit = 0.01;
                    while run_for(folder.path(), &args, limit) {
                        limit *= 1.5;
                        interruptions += 1;
                    }
                } else {
                    done(folder.path(), &args);
                }
                files.push(if parts > 1 && part % 2 == 0 { picture } else { state });
            }
            let merged = name(0, "merged");
            for turn in 0..files.len() {
                files.rotate_left(1);
                if turn % 2 == 1 {
                    files.reverse();
                }
                let mut args = vec!["merge", "-q", "-o", &merged];
                args.extend(files.iter().map(String::as_str));
                done(folder.path(), &args);
                assert_same(&folder, &merged, "one.exr");
            }
        }
    }
    assert!(interruptions > 10, "{interruptions}");
}

/// Resumes the render with a time limit in seconds. Returns true if it is incomplete.
fn run_for(folder: &Path, args: &[&str], seconds: f64) -> bool {
    limited(folder, &joined(args, &["--resume", "--stats", "stats.json"]), seconds);
    let stats = read_json(&folder.join("stats.json"));
    assert_eq!(stats["stop"] == "samples", stats["complete"] == true, "{stats}");
    stats["complete"] == false
}

/// A crop has the pixels of the whole image. Merged crops give the whole image, also with sample
/// ranges.
#[test]
fn crops_and_ranges_are_merged() {
    let folder = scene();
    let usual = split("render s.toml -q --spp 128");
    let render = |more: &[&str]| done(folder.path(), &joined(&usual, more));
    render(&["-o", "one.exr"]);
    render(&["--crop", "0,0,17,29", "-o", "left.exr"]);
    render(&["--crop", "17,0,44,12", "-o", "top.exr"]);
    render(&["--crop", "17,12,44,29", "--samples", "0..64", "-o", "first.exr"]);
    render(&split("--crop 17,12,44,29 --samples 64..128 --checkpoint second.exr"));
    let all = ["second.exr", "left.exr", "first.exr", "top.exr"];
    done(
        folder.path(),
        &[&["merge", "-q", "-o", "all.exr", "-o", "all.png"], &all[..]].concat(),
    );
    assert_same(&folder, "all.exr", "one.exr");
    assert!(folder.path().join("all.png").exists());

    let merge = |parts: &[&str]| refused(folder.path(), &[&["merge", "-o", "no.exr"], parts].concat(), 1);
    let said = merge(&["left.exr", "top.exr", "first.exr"]);
    assert!(
        said.contains("samples 64..128 of pixels 17,12 to 44,29 are missing from all parts"),
        "{said}"
    );
    let said = merge(&["left.exr", "first.exr", "second.exr"]);
    assert!(
        said.contains("samples 0..128 of pixels 17,0 to 44,12 are missing from all parts"),
        "{said}"
    );
    let said = merge(&["left.exr", "top.exr", "first.exr", "second.exr", "first.exr"]);
    assert!(
        said.contains("samples 0..64 of pixel 17,12 are also in first.exr"),
        "{said}"
    );
    let said = merge(&["one.exr"]);
    assert!(said.contains("but not the sums"), "{said}");
    assert!(!folder.path().join("no.exr").exists());
    // If requested, only the existing parts are merged
    done(
        folder.path(),
        &split("merge -q --allow-gaps -o some.exr left.exr first.exr"),
    );
    let some = read_channel(&folder.path().join("some.exr"), "samples");
    assert_eq!(some.len(), 44 * 29);
    let count = |n: f32| some.iter().filter(|&&s| s == n).count();
    assert_eq!((count(128.0), count(64.0), count(0.0)), (17 * 29, 27 * 17, 27 * 12));
}

/// Parts may be merged in several steps. The results of the first steps are parts again.
#[test]
fn parts_are_merged_step_by_step() {
    let folder = scene();
    let usual = split("render s.toml -q --spp 256");
    let render = |more: &[&str]| done(folder.path(), &joined(&usual, more));
    let merged = |more: &[&str]| done(folder.path(), &[&["merge", "-q"], more].concat());
    render(&["-o", "one.exr"]);
    for (name, range) in [
        ("a.exr", "0..64"),
        ("b.exr", "64..128"),
        ("c.exr", "128..192"),
        ("d.exr", "192..256"),
    ] {
        render(&["--samples", range, "--checkpoint", name]);
    }
    merged(&["a.exr", "b.exr", "--checkpoint", "ab.exr"]);
    merged(&["d.exr", "c.exr", "--checkpoint", "cd.exr"]);
    merged(&["cd.exr", "ab.exr", "-o", "all.exr"]);
    assert_same(&folder, "all.exr", "one.exr");
    // A gap between parts is still an error, and an image needs all parts.
    let said = refused(folder.path(), &["merge", "a.exr", "c.exr", "--checkpoint", "no.exr"], 1);
    assert!(said.contains("samples 64..128"), "{said}");
    let said = refused(folder.path(), &["merge", "cd.exr", "-o", "no.exr"], 1);
    assert!(said.contains("samples 0..128"), "{said}");
}

#[test]
fn parts_of_other_renders_are_refused() {
    let folder = scene();
    fs::write(
        folder.path().join("other.toml"),
        fs::read_to_string(folder.path().join("s.toml"))
            .unwrap()
            .replace("[0, 1, 4]", "[0, 1, 5]"),
    )
    .unwrap();
    let render = |scene: &str, name: &str, more: &[&str]| {
        let args = [
            "render",
            scene,
            "-q",
            "--spp",
            "128",
            "--samples",
            "64..128",
            "-o",
            name,
        ];
        done(folder.path(), &joined(&args, more));
    };
    let first = split("render s.toml -q --spp 128 --samples 0..64 -o first.exr");
    done(folder.path(), &first);
    for (scene, more, word) in [
        ("s.toml", &["--seed", "3"][..], "seed 0 and 3"),
        ("s.toml", &["--max-depth", "3"], "settings max_depth=16 and max_depth=3"),
        ("s.toml", &["--size", "40x29"], "image size [44, 29] and [40, 29]"),
        ("other.toml", &[], "scene hash"),
    ] {
        render(scene, "second.exr", more);
        let said = refused(folder.path(), &["merge", "first.exr", "second.exr", "-o", "no.exr"], 1);
        assert!(said.contains("second.exr") && said.contains(word), "{said}");
    }

    let usual: &[&str] = &["render", "s.toml", "--checkpoint", "c.exr", "-o", "o.exr"];
    done(folder.path(), &joined(usual, &["--spp", "100"]));
    let before = fs::read(folder.path().join("c.exr")).unwrap();
    let said = refused(folder.path(), &joined(usual, &["--spp", "100"]), 2);
    assert!(said.contains("already exists"), "{said}");
    for (more, word) in [
        (
            &["--resume", "--spp", "64"][..],
            "already has 100 samples per pixel, more than the requested 64",
        ),
        (&["--resume", "--spp", "200", "--seed", "1"], "seed 0 and 1"),
        (
            &["--resume", "--spp", "200", "--crop", "0,0,9,9"],
            "crop 0,0,44,29 and 0,0,9,9",
        ),
        (
            &["--resume", "--spp", "200", "--sampler", "sobol"],
            "settings sampler=zsobol and sampler=sobol",
        ),
        (&["--resume", "--noise", "0.1"], "settings nothing and noise=0.1"),
    ] {
        let said = refused(folder.path(), &joined(usual, more), 1);
        assert!(said.contains(word), "{said}");
    }
    assert_eq!(fs::read(folder.path().join("c.exr")).unwrap(), before);
}

/// Samples that are added later give a picture that is bit-identical to a picture with all samples
/// at once. This also holds if the first render ended within a block of 64 samples.
#[test]
fn later_samples_give_the_same_bits() {
    let folder = scene();
    let render = |more: &[&str]| done(folder.path(), &[&["render", "s.toml", "-q"], more].concat());
    for (few, many) in [("3", "40"), ("100", "201"), ("64", "128")] {
        let (state, later, once) = (
            format!("{few}.exr"),
            format!("{few}-later.exr"),
            format!("{few}-once.exr"),
        );
        render(&["--checkpoint", &state, "--spp", few, "-o", "few.exr"]);
        render(&[
            "--checkpoint",
            &state,
            "--resume",
            "--spp",
            many,
            "-o",
            &later,
            "--stats",
            "s.json",
        ]);
        render(&["--spp", many, "-o", &once]);
        assert_same(&folder, &later, &once);
        let stats = read_json(&folder.path().join("s.json"));
        assert_eq!(stats["samples"], many.parse::<u64>().unwrap() * 44 * 29);
    }
}

/// A render with a noise level has rounds, and decides after each round if it stops. After an
/// interruption, it stops after the same round.
#[test]
fn noise_level_resumes_to_the_same_bits() {
    let folder = scene();
    let usual: &[&str] = &["render", "s.toml", "-q", "--noise", "0.004", "--spp", "8192"];
    done(folder.path(), &joined(usual, &["-o", "once.exr"]));
    let args = joined(
        usual,
        &split("-o later.exr --checkpoint c.exr --resume --stats stats.json"),
    );
    let (mut limit, mut stops) = (0.02, 0);
    loop {
        limited(folder.path(), &args, limit);
        let stats = read_json(&folder.path().join("stats.json"));
        if stats["stop"] == "noise" {
            break;
        }
        (limit, stops) = (limit * 1.3, stops + 1);
    }
    assert!(stops > 2, "{stops}");
    assert_same(&folder, "later.exr", "once.exr");
}

/// A render that is killed at any moment, also during a write, resumes to a bit-identical picture.
#[cfg(unix)]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn killed_renders_resume_to_the_same_bits() {
    let kills = if cfg!(any(feature = "embree", feature = "obvhs")) {
        50
    } else {
        5
    };
    let folder = scene();
    let began = Instant::now();
    done(folder.path(), &split("render s.toml -q --spp 6144 -o one.exr"));
    let whole = began.elapsed();
    let args = split("render s.toml -q --spp 6144 --resume --checkpoint c.exr");
    let args = [&args[..], &["--checkpoint-interval", "0.01s", "-o", "later.exr"]].concat();
    let (mut killed, mut runs) = (0, 0);
    while killed < kills {
        let mut child = command(folder.path(), &args).spawn().unwrap();
        // Kill the program at irregular moments, in the first half of the time that a render takes
        // on this machine
        std::thread::sleep(whole * (2 + 37 * runs % 97) / 200);
        child.kill().unwrap();
        let status = child.wait().unwrap();
        // Files that exist are complete.
        if folder.path().join("c.exr").exists() {
            let look = ["merge", "-q", "--allow-gaps", "c.exr", "-o", "look.exr"];
            done(folder.path(), &look);
        }
        if status.code().is_none() {
            killed += 1;
        } else {
            // If a render completed before it was killed, its image has the same bits, and the next
            // run starts from zero.
            assert!(status.success(), "{status}");
            assert_same(&folder, "later.exr", "one.exr");
            fs::remove_file(folder.path().join("c.exr")).unwrap();
        }
        runs += 1;
        assert!(runs < 20 * kills, "{killed} killed of {runs}");
    }
    done(folder.path(), &args);
    assert_same(&folder, "later.exr", "one.exr");
}

/// A termination signal counts as an interrupt: the samples so far are written, and the render can
/// be resumed.
#[cfg(unix)]
#[test]
fn terminated_renders_resume_to_the_same_bits() {
    let folder = scene();
    done(folder.path(), &split("render s.toml -q --spp 2048 -o one.exr"));
    let args = split("render s.toml -q --spp 2048 --checkpoint c.exr -o later.exr");
    let child = command(folder.path(), &args).spawn().unwrap();
    wait_for_work(&child, Duration::from_millis(300));
    signal(&child, "TERM");
    let out = child.wait_with_output().unwrap();
    // On a fast machine the render may be complete, and on a slow machine it may not have started.
    if out.status.code() == Some(130) && folder.path().join("c.exr").exists() {
        assert!(words(&out).contains("interrupted"), "{}", words(&out));
    }
    done(folder.path(), &joined(&args, &["--resume"]));
    assert_same(&folder, "later.exr", "one.exr");
}

/// Signals that are ignored at the start stay ignored, so `nohup` and `trap '' INT` work. Other
/// signals still end the program.
#[cfg(unix)]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn ignored_signals_stay_ignored() {
    let folder = scene();
    let render = "exec \"$0\" render s.toml -q --spp 100000000 --time-limit 4s -o a.png --stats s.json";
    for ignored in ["HUP", "INT", "TERM"] {
        let script = format!("trap '' {ignored}; {render}");
        let mut child = Command::new("sh");
        let child = child
            .current_dir(folder.path())
            .args(["-c", &script, crate::support::program::PROGRAM]);
        let mut child = child.spawn().unwrap();
        wait_for_work(&child, Duration::from_millis(500));
        signal(&child, ignored);
        wait_for_work(&child, Duration::from_millis(1000));
        let ended = child.try_wait().unwrap();
        assert!(ended.is_none(), "{ignored}: {ended:?}");
        // A signal that is not ignored counts as an interrupt.
        signal(&child, if ignored == "TERM" { "INT" } else { "TERM" });
        assert_eq!(child.wait().unwrap().code(), Some(130), "{ignored}");
    }
}

/// A closed room of one material without absorption; its lamp is small.
fn furnace(material: &str) -> TempDir {
    let mtl = format!("newmtl wall\n{material}\nnewmtl lamp\nKd 0 0 0\nKe 5 5 5\n");
    folder(&[
        ("f.mtl", mtl.as_str()),
        (
            "f.obj",
            "mtllib f.mtl\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
             v -0.01 0.99 -0.01\nv 0.01 0.99 -0.01\nv 0.01 0.99 0.01\nv -0.01 0.99 0.01\n\
             usemtl wall\nf 1 2 3 4\nf 6 5 8 7\nf 5 1 4 8\nf 2 6 7 3\nf 4 3 7 8\nf 5 6 2 1\nusemtl lamp\nf 9 10 11 12\n",
        ),
        (
            "f.toml",
            "version = 1\n[camera]\nposition = [0, 0, 0]\nlook_at = [0.3, 0.2, -1]\n[image]\nwidth = 64\nheight = 64\n\
             [[object]]\nobj = \"f.obj\"\n",
        ),
    ])
}

/// All values of `--integrator`.
const INTEGRATORS: &str = "path naive one-sample area whitted distributed direct ao debug light bdpt pssmlt sppm photon-map vcm mlt irradiance-cache";

/// The time limit ends a render even if a single sample takes seconds, or a path without roulette
/// is endless.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn every_integrator_ends_by_its_time_limit() {
    let white = furnace("Kd 1 1 1");
    let endless = "--max-depth none --roulette-depth 4000000000";
    let mut methods: Vec<String> = split(INTEGRATORS).into_iter().map(String::from).collect();
    methods.extend([
        format!("path {endless}"),
        format!("naive {endless}"),
        format!("light {endless}"),
        format!("bdpt {endless}"),
        format!("sppm {endless}"),
        format!("vcm {endless}"),
        format!("photon-map --gather-rays 100 --photon-count 65536 {endless}"),
        format!("irradiance-cache --cache-rays 1048576 {endless}"),
        "distributed --branching 3162 --max-depth 2".into(),
        "mlt --chains 1 --size 1024x1024".into(),
        "pssmlt --chains 1 --size 1024x1024".into(),
        "path --light-samples 1024 --light-selection all".into(),
    ]);
    for method in methods {
        let line = format!("render f.toml -q --spp 1000000 -o a.png --integrator {method}");
        let began = Instant::now();
        limited(white.path(), &split(&line), 0.3);
        let took = began.elapsed();
        assert!(took < Duration::from_secs(20), "{method}: {took:?}");
    }
}

/// An interrupt ends every integrator, and the samples so far are written.
#[cfg(unix)]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn every_integrator_ends_by_an_interrupt() {
    let white = furnace("Kd 0.8 0.8 0.8");
    for method in split(INTEGRATORS) {
        let line =
            format!("render f.toml -q --spp 1000000 -o {method}.exr --checkpoint {method}.state --integrator {method}");
        let child = command(white.path(), &split(&line)).spawn().unwrap();
        wait_for_work(&child, Duration::from_millis(600));
        signal(&child, "INT");
        let began = Instant::now();
        let out = child.wait_with_output().unwrap();
        let took = began.elapsed();
        assert_eq!(code(&out), 130, "{method}: {}", words(&out));
        assert!(took < Duration::from_secs(20), "{method}: {took:?}");
        let is_written = white.path().join(format!("{method}.exr")).exists();
        assert!(
            is_written || words(&out).contains("before the first sample"),
            "{method}: {}",
            words(&out)
        );
    }
}

/// Between mirrors without absorption, a branch of a ray tree never ends by itself. The program
/// limits the length of branches, and the stack is large enough.
#[test]
fn branches_between_mirrors_end() {
    let mirrors = furnace("Kd 0 0 0\nKs 1 1 1\nillum 3");
    for method in [
        "whitted --max-depth none",
        "whitted --max-depth 1024",
        "distributed --branching 1 --max-depth none --tree-depth 1024",
    ] {
        let line = format!("render f.toml -q --size 16x16 --spp 1 -o a.png --integrator {method}");
        done(mirrors.path(), &split(&line));
    }
    let said = refused(mirrors.path(), &split("render f.toml --max-depth 1025"), 2);
    assert!(
        said.contains("--max-depth 1025") && said.contains("up to 1024"),
        "{said}"
    );
}

/// After an interrupt, commands without images end at once with the exit code of an interrupt, even
/// during measurements.
#[cfg(unix)]
#[test]
fn commands_without_pictures_end_at_once() {
    let folder = scene();
    for line in [
        "bench s.toml --repeat 100000 -q",
        "audit s.toml --against brute --rays 4000000000 -q",
    ] {
        let child = command(folder.path(), &split(line)).spawn().unwrap();
        wait_for_work(&child, Duration::from_millis(500));
        let began = Instant::now();
        signal(&child, "TERM");
        let out = child.wait_with_output().unwrap();
        assert_eq!(out.status.code(), Some(130), "{line}: {}", words(&out));
        assert!(began.elapsed() < Duration::from_secs(20), "{line}");
    }
}

/// Checkpoints are truncated at every KiB, or have a flipped bit. The error is readable, and the
/// file is kept.
#[test]
fn damaged_checkpoints_are_refused() {
    let folder = scene();
    let render = split("render s.toml -q --spp 64 --size 20x9 --checkpoint c.exr -o o.exr");
    done(folder.path(), &render);
    let path = folder.path().join("c.exr");
    let sound = fs::read(&path).unwrap();
    fs::rename(folder.path().join("o.exr"), folder.path().join("sound.exr")).unwrap();
    let args = [&render[..], &["--resume"]].concat();
    for length in (0..sound.len()).step_by(1024).chain([sound.len() - 1]) {
        fs::write(&path, &sound[..length]).unwrap();
        let said = refused(folder.path(), &args, 1);
        assert!(said.contains("c.exr") && said.contains("help"), "{length}: {said}");
        assert_eq!(fs::read(&path).unwrap(), &sound[..length]);
    }
    for i in 0..64 {
        let mut bytes = sound.clone();
        let at = (i * 7919 + 13 * i * i) % bytes.len();
        bytes[at] ^= 1 << (i % 8);
        fs::write(&path, &bytes).unwrap();
        let out = run(folder.path(), &args);
        // Some bytes have no effect on a render, such as bytes of the image so far. Other changes
        // are detected.
        match out.status.code() {
            Some(0) => assert_same(&folder, "o.exr", "sound.exr"),
            Some(1) => assert!(words(&out).contains("c.exr"), "{}", words(&out)),
            code => panic!("{at}: {code:?} {}", words(&out)),
        }
    }
}

/// If outputs can no longer be written, the render reports this, continues, and tries again.
#[cfg(unix)]
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn unwritable_outputs_are_reported() {
    let folder = scene();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    let args = split("render s.toml --spp 4096 --checkpoint out/c.exr --checkpoint-interval 0.05s");
    let args = [
        &args[..],
        &["-o", "out/o.exr", "-o", "kept.exr", "--write-every", "0.05s"],
    ]
    .concat();
    let child = command(folder.path(), &args).spawn().unwrap();
    while !out.join("c.exr").exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    fs::rename(&out, folder.path().join("moved")).unwrap();
    let ended = child.wait_with_output().unwrap();
    let said = words(&ended);
    assert_eq!(ended.status.code(), Some(1), "{said}");
    assert!(
        said.contains("out/c.exr: cannot write") && said.contains("out/o.exr: cannot write"),
        "{said}"
    );
    assert!(folder.path().join("kept.exr").exists());
    // Earlier checkpoints can be resumed from the folder to which they were moved.
    let args = split("render s.toml -q --spp 4096 --checkpoint moved/c.exr --resume -o later.exr");
    done(folder.path(), &args);
    assert_same(&folder, "later.exr", "kept.exr");
}

#[test]
fn usage_of_parts_is_checked() {
    let folder = scene();
    for (args, word) in [
        (&["--samples", "10..64"][..], "multiples of 64"),
        (&["--samples", "0..100", "--spp", "200"], "multiples of 64"),
        (&["--samples", "64..128", "--spp", "100"], "100 samples per pixel"),
        (&["--samples", "64..64"], "64..128"),
        (&["--samples", "0..64", "--noise", "0.1"], "cannot be used with"),
        (&["--resume"], "--checkpoint"),
        (&["--time-limit", "0s"], "above 0"),
    ] {
        let said = refused(folder.path(), &[&["render", "s.toml"], args].concat(), 2);
        assert!(said.contains(word), "{args:?}: {said}");
    }
    // The last range may end at the last sample of the image.
    let usual = ["render", "s.toml", "-q", "--spp", "100"];
    for more in [
        &["--samples", "64..100", "-o", "b.exr"][..],
        &["--samples", "0..64", "-o", "a.exr"],
        &["-o", "one.exr"],
    ] {
        done(folder.path(), &joined(&usual, more));
    }
    done(folder.path(), &["merge", "-q", "a.exr", "b.exr", "-o", "all.exr"]);
    assert_same(&folder, "all.exr", "one.exr");
}

/// A full disk loses neither the previous checkpoint nor the image on another disk. This test needs
/// root. If root cannot mount a disk, as in some containers, the test ends at once.
#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(not(root), ignore = "needs root")]
fn full_disks_lose_nothing() {
    let folder = scene();
    let disk = folder.path().join("disk");
    fs::create_dir(&disk).unwrap();
    let mount = ["-t", "tmpfs", "-o", "size=1m", "tmpfs", "disk"];
    let mounted = Command::new("mount").current_dir(folder.path()).args(mount).output();
    if !mounted.is_ok_and(|out| out.status.success()) {
        println!("skipped: a disk of 1 MB cannot be mounted here");
        return;
    }
    let checked = std::panic::catch_unwind(|| {
        let args = split("render s.toml --checkpoint disk/c.exr --checkpoint-interval 0.02s");
        let args = [&args[..], &["-o", "disk/o.exr", "-o", "kept.exr"]].concat();
        done(folder.path(), &joined(&args, &["-q", "--spp", "64"]));
        let before = fs::read(disk.join("c.exr")).unwrap();
        // The disk has space for the existing file, but not for a second file
        fs::write(disk.join("rest"), vec![0; 1 << 20]).unwrap_err();
        let said = refused(folder.path(), &joined(&args, &["--resume", "--spp", "1024"]), 1);
        assert!(
            said.contains("disk/c.exr: cannot write") && said.contains("disk/o.exr: cannot write"),
            "{said}"
        );
        assert!(said.contains("the render continues"), "{said}");
        assert_eq!(fs::read(disk.join("c.exr")).unwrap(), before);
        let samples = read_channel(&folder.path().join("kept.exr"), "samples");
        assert!(samples.iter().all(|&n| n == 1024.0));
        // With free space again, the render can be resumed.
        fs::remove_file(disk.join("rest")).unwrap();
        done(folder.path(), &joined(&args, &["-q", "--resume", "--spp", "1024"]));
        assert_same(&folder, "disk/o.exr", "kept.exr");

        // A read-only disk is reported before the render starts.
        let remount = ["-o", "remount,ro", "disk"];
        let remounted = Command::new("mount").current_dir(folder.path()).args(remount).status();
        assert!(remounted.is_ok_and(|status| status.success()));
        let before = fs::read(disk.join("c.exr")).unwrap();
        let said = refused(folder.path(), &joined(&args, &["--resume", "--spp", "1000000"]), 1);
        assert!(
            said.to_lowercase().contains("read-only") && said.contains("help:"),
            "{said}"
        );
        assert_eq!(fs::read(disk.join("c.exr")).unwrap(), before);
    });
    let unmounted = Command::new("umount").arg(&disk).status();
    assert!(unmounted.is_ok_and(|status| status.success()));
    if let Err(panic) = checked {
        std::panic::resume_unwind(panic);
    }
}
