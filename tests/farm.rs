//! Tests of the scripts of the render farm. Stand-ins that only log their arguments replace the
//! program and the scheduler. `make test-farm` runs the scripts with the real program and
//! scheduler.
#![cfg(unix)]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use support::program::{folder, printed, words};
use tempfile::TempDir;

/// Environment of a farm script: `bin` with stand-ins that log their arguments, and a scene in a
/// folder with a space.
struct Farm {
    folder: TempDir,
}

impl Farm {
    fn new() -> Self {
        let farm = Self { folder: folder(&[]) };
        fs::create_dir_all(farm.path("bin")).unwrap();
        fs::create_dir_all(farm.path("my scenes")).unwrap();
        fs::write(farm.path("my scenes/room & hall.toml"), "").unwrap();
        // The stand-in for `sbatch` logs its arguments, and prints the number of the job: 100, 101,
        // …
        farm.program(
            "sbatch",
            "printf '[%s]' \"$@\" >>sbatch.log; echo >>sbatch.log; echo $((99 + $(wc -l <sbatch.log)))",
        );
        // The stand-in for `squeue` prints one of three files that the test writes: the parts in
        // the queue, the merge in the queue, or the state of a job.
        farm.program(
            "squeue",
            "case \"$*\" in *%F_%K) cat queued ;; *%i) cat merges ;; *) cat state ;; esac 2>/dev/null || true",
        );
        farm.program("scancel", "echo \"$@\" >>scancel.log");
        farm.program("scontrol", "echo \"$@\" >>scontrol.log");
        farm
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn program(&self, name: &str, script: &str) {
        let path = self.path("bin").join(name);
        let folder = self.folder.path().display();
        fs::write(&path, format!("#!/bin/bash\ncd '{folder}'\n{script}\n")).unwrap();
        fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o755)).unwrap();
    }

    fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        let path = format!(
            "{}:{}",
            self.path("bin").display(),
            std::env::var("PATH").unwrap_or_default()
        );
        command
            .current_dir(self.folder.path())
            .env("PATH", path)
            .stdin(Stdio::null());
        command.env("EMBRASURE", self.path("bin/embrasure"));
        for name in ["SLURM_JOB_ID", "SLURM_CPUS_PER_TASK", "CUE_THREADS"] {
            command.env_remove(name);
        }
        command
    }

    /// Runs a script of scripts/farm.
    fn run(&self, script: &str, args: &[&str]) -> Output {
        let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts/farm");
        self.command(&scripts.join(script)).args(args).output().unwrap()
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_default()
    }

    fn write(&self, name: &str, words: &str) {
        fs::write(self.path(name), words).unwrap();
    }
}

const RENDER: [&str; 9] = [
    "my scenes/room & hall.toml",
    "-o",
    "a b.exr",
    "--spp",
    "1000",
    "--parts",
    "4",
    "--",
    "--size=32x32",
];

/// Sample ranges are contiguous from 0 to the end. Each starts at the first sample of a pass, and
/// their lengths differ by at most one pass.
#[test]
fn samples_are_cut_evenly() {
    let script = "source scripts/farm/plan
        for samples in 1 63 64 65 100 128 640 1000 1024 5120 65537 1000000; do
            for parts in 1 2 3 7 8 16 1000; do
                cut_samples $samples $parts; echo $samples $parts ${ranges[@]}
            done
        done";
    let out = Command::new("bash").args(["-c", script]).output().unwrap();
    assert!(out.status.success(), "{}", words(&out));
    let mut cases = 0;
    for line in printed(&out).lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let (samples, parts): (u64, usize) = (words[0].parse().unwrap(), words[1].parse().unwrap());
        let ranges: Vec<[u64; 2]> = words[2..]
            .iter()
            .map(|range| {
                let (a, b) = range.split_once("..").unwrap();
                [a.parse().unwrap(), b.parse().unwrap()]
            })
            .collect();
        assert_eq!(ranges.len(), parts.min(samples.div_ceil(64) as usize), "{line}");
        assert_eq!((ranges[0][0], ranges[ranges.len() - 1][1]), (0, samples), "{line}");
        assert!(
            ranges.windows(2).all(|w| w[0][1] == w[1][0] && w[1][0] % 64 == 0),
            "{line}"
        );
        let passes = || ranges.iter().map(|[a, b]| b.div_ceil(64) - a / 64);
        assert!(passes().min() >= Some(1), "{line}");
        assert!(passes().max().unwrap() - passes().min().unwrap() <= 1, "{line}");
        cases += 1;
    }
    assert_eq!(cases, 12 * 7);
}

#[test]
fn slurm_gets_the_missing_parts() {
    let farm = Farm::new();
    farm.program("embrasure", "exit 0");
    let submit = |args: &[&str]| {
        let _ = fs::remove_file(farm.path("sbatch.log"));
        let out = farm.run("slurm", args);
        assert!(out.status.success(), "{}", words(&out));
        let log = farm.read("sbatch.log");
        (printed(&out), log.lines().map(str::to_string).collect::<Vec<_>>())
    };
    let work = farm.path("a b.exr.farm").canonicalize();
    assert!(work.is_err());

    // Submit all parts, and the merge
    let (_, jobs) = submit(&[&["--sbatch=--time=1:00:00", "--cpus", "2"], RENDER.as_slice()].concat());
    let work = farm.path("a b.exr.farm").canonicalize().unwrap();
    let work = work.to_str().unwrap();
    assert_eq!(jobs.len(), 2, "{jobs:?}");
    for word in [
        "[--array=0-3]",
        "[--requeue]",
        "[--open-mode=append]",
        "[--signal=B:TERM@60]",
        "[--cpus-per-task=2]",
        "[--time=1:00:00]",
        &format!("[--output={work}/logs/part-%a.log][{work}/part][{work}]"),
    ] {
        assert!(jobs[0].contains(word), "no {word} in {}", jobs[0]);
    }
    for word in [
        "[--dependency=afterok:100]",
        "[--kill-on-invalid-dep=yes]",
        &format!("[{work}/merge][{work}]"),
    ] {
        assert!(jobs[1].contains(word), "no {word} in {}", jobs[1]);
    }

    // Parts 0 and 2 are complete, part 1 is in the queue, and part 3 has failed. Part 3 is
    // submitted again, and the merge waits for parts 1 and 3.
    let again = [&["--cpus", "2"], RENDER.as_slice()].concat();
    for name in ["0.done", "2.done", "3.failures"] {
        farm.write(&format!("a b.exr.farm/parts/{name}"), "");
    }
    farm.write("queued", "100_1\n");
    farm.write("merges", "101\n");
    let (_, jobs) = submit(&again);
    assert_eq!(jobs.len(), 2, "{jobs:?}");
    assert!(jobs[0].contains("[--array=3]"), "{}", jobs[0]);
    assert!(jobs[1].contains("[--dependency=afterok:100_1:100]"), "{}", jobs[1]);
    assert!(farm.read("scancel.log").contains("-merge"), "the old merge stays");
    assert!(!farm.path("a b.exr.farm/parts/3.failures").exists());

    // If all missing parts and the merge are in the queue, nothing is submitted.
    farm.write("queued", "100_1\n102_3\n");
    assert!(submit(&again).1.is_empty());

    // If all parts are complete, only the merge is submitted. After the merge nothing is submitted.
    farm.write("queued", "");
    farm.write("merges", "");
    for name in ["1.done", "3.done"] {
        farm.write(&format!("a b.exr.farm/parts/{name}"), "");
    }
    let (_, jobs) = submit(&again);
    assert!(
        jobs.len() == 1 && jobs[0].contains("merge") && !jobs[0].contains("--dependency"),
        "{jobs:?}"
    );
    farm.write("a b.exr.farm/merged", "");
    farm.write("a b.exr", "");
    let (said, jobs) = submit(&again);
    assert!(jobs.is_empty() && said.contains("nothing is left to do"), "{said}");

    // Only this render can use the folder.
    let other = again
        .iter()
        .map(|a| if *a == "1000" { "2000" } else { a })
        .collect::<Vec<_>>();
    let out = farm.run("slurm", &other);
    assert_eq!(out.status.code(), Some(1));
    assert!(words(&out).contains("work folder of another render"), "{}", words(&out));
    for (args, word) in [
        (["x.toml", "--spp", "64", "--parts", "1"], "-o OUT.exr"),
        (["x.toml", "-o", "x.exr", "--spp", "010"], "`010`"),
        (["x.toml", "-o", "x.exr", "--speed", "1"], "--speed"),
    ] {
        let out = farm.run("slurm", &args);
        assert_eq!(out.status.code(), Some(2));
        assert!(words(&out).contains(word), "{}", words(&out));
    }
}

/// A failed part is tried again. A terminated part is not tried again, and its program gets the
/// signal once.
#[test]
fn failed_part_is_tried_again() {
    let farm = Farm::new();
    farm.program("embrasure", "exit 0");
    assert!(farm.run("slurm", &RENDER).status.success());
    let run = |index: &str, slurm: bool| {
        let mut command = farm.command(&farm.path("a b.exr.farm/part"));
        command.arg(farm.path("a b.exr.farm"));
        if slurm {
            command.env("SLURM_ARRAY_TASK_ID", index).env("SLURM_JOB_ID", "7");
        } else {
            command.arg(index);
        }
        let _ = fs::remove_file(farm.path("calls"));
        let out = command.output().unwrap();
        (out.status.code(), farm.read("calls").lines().count())
    };
    let whole = |index: &str| farm.path(&format!("a b.exr.farm/parts/{index}.done")).exists();
    let calls = "printf '[%s]' \"$@\" >>calls; echo >>calls";

    // The second attempt succeeds.
    farm.program(
        "embrasure",
        &format!("{calls}; [ $(wc -l <calls) = 2 ] || kill -KILL $$"),
    );
    assert_eq!((run("1", false), whole("1")), ((Some(0), 2), true));
    let said = farm.read("calls");
    for word in [
        "[--samples][256..512]",
        "[--spp][1000]",
        "[--resume]",
        "[--threads][1]",
        "[--size=32x32]",
    ] {
        assert!(said.contains(word), "no {word} in {said}");
    }
    // If every attempt fails, there are four attempts: the first one and three more.
    farm.program("embrasure", &format!("{calls}; exit 1"));
    assert_eq!((run("2", false), whole("2")), ((Some(1), 4), false));
    // A usage error is not retried.
    farm.program("embrasure", &format!("{calls}; exit 2"));
    assert_eq!(run("3", false), (Some(2), 1));

    // Slurm requeues the job on another node, unless the job is being ended.
    for (code, state, requeued) in [(1, "RUNNING", true), (130, "RUNNING", true), (130, "COMPLETING", false)] {
        let _ = fs::remove_file(farm.path("scontrol.log"));
        farm.write("state", state);
        farm.program("embrasure", &format!("{calls}; exit {code}"));
        assert_eq!(run("0", true), (Some(code), 1));
        assert_eq!(farm.read("scontrol.log") == "requeue 7\n", requeued, "{code} {state}");
    }
    assert_eq!(farm.read("a b.exr.farm/parts/0.failures").lines().count(), 1);

    // A signal to the script reaches the program once. The program then ends without a second
    // signal.
    farm.write("state", "COMPLETING");
    farm.program(
        "embrasure",
        "trap 'echo signal >>calls' TERM; touch ready; for i in {1..500}; do sleep 0.01; [ ! -s calls ] || break; done
         sleep 0.3; exit 130",
    );
    let _ = fs::remove_file(farm.path("calls"));
    let mut part = farm.command(&farm.path("a b.exr.farm/part"));
    let mut part = part
        .arg(farm.path("a b.exr.farm"))
        .arg("0")
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let signal = format!("until [ -e ready ]; do sleep 0.01; done; kill -TERM {}", part.id());
    let sent = Command::new("bash")
        .args(["-c", &signal])
        .current_dir(farm.folder.path())
        .status();
    assert!(sent.unwrap().success());
    assert_eq!(part.wait().unwrap().code(), Some(130));
    assert_eq!(farm.read("calls"), "signal\n");
}

#[test]
fn a_merge_takes_all_parts_in_order() {
    let farm = Farm::new();
    farm.program("embrasure", "printf '[%s]' \"$@\" >merge.log; exit ${MERGE:-0}");
    assert!(
        farm.run("slurm", &[&["-o", "a b.png"], RENDER.as_slice()].concat())
            .status
            .success()
    );
    let run = |code: &str| {
        let mut command = farm.command(&farm.path("a b.png.farm/merge"));
        command.arg(farm.path("a b.png.farm")).env("MERGE", code).output()
    };
    assert_eq!(run("1").unwrap().status.code(), Some(1));
    assert!(!farm.path("a b.png.farm/merged").exists());
    assert_eq!(run("0").unwrap().status.code(), Some(0));
    assert!(farm.path("a b.png.farm/merged").exists());
    let folder = farm.folder.path().canonicalize().unwrap();
    let folder = folder.display();
    assert_eq!(
        farm.read("merge.log"),
        format!("[merge][0.exr][1.exr][2.exr][3.exr][-o][{folder}/a b.png][-o][{folder}/a b.exr]")
    );
}

/// The job specification is XML. bash runs the commands of the specification for a part and for the
/// merge.
#[test]
fn an_opencue_job_has_the_same_parts() {
    let farm = Farm::new();
    farm.program("embrasure", "printf '[%s]' \"$@\" >>calls; echo >>calls");
    let booked = ["--show", "a<b", "--shot", "s1", "--user", "me"];
    let out = farm.run("opencue", &[&booked, RENDER.as_slice()].concat());
    assert!(out.status.success(), "{}", words(&out));
    let xml = farm.read("a b.exr.farm/job.xml");
    assert!(
        xml.contains("<range>0-3</range>") && xml.contains("<show>a&lt;b</show>"),
        "{xml}"
    );

    // Every XML element is closed, in the right order.
    let mut open = Vec::new();
    for tag in xml.split('<').skip(1).filter_map(|t| t.split(['>', ' ']).next()) {
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "{xml}");
        } else if !tag.starts_with(['?', '!']) {
            open.push(tag);
        }
    }
    assert!(open.is_empty(), "{open:?}");

    let commands: Vec<String> = xml
        .split("<cmd>")
        .skip(1)
        .map(|rest| {
            rest.split("</cmd>")
                .next()
                .unwrap()
                .replace("&lt;", "<")
                .replace("&amp;", "&")
        })
        .collect();
    assert_eq!(commands.len(), 2);
    for command in commands {
        let line = command.replace("#IFRAME#", "3");
        let out = farm.command(Path::new("bash")).args(["-c", &line]).output().unwrap();
        assert!(out.status.success(), "{line}: {}", words(&out));
    }
    let calls = farm.read("calls");
    assert!(
        calls.contains("[--samples][768..1000]") && calls.contains("[merge][0.exr]"),
        "{calls}"
    );

    let out = farm.run(
        "opencue",
        &[&["--show", "a", "--shot", "s1", "--user", "root"], RENDER.as_slice()].concat(),
    );
    assert_eq!(out.status.code(), Some(2));
}
