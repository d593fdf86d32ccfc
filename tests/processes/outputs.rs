//! Written files: complete files are never lost, input files are not overwritten, and errors are
//! reported.
#![cfg(unix)]

use crate::support::program::{
    assert_same_bits, code, command, done, folder, joined, json, printed, read_json, refused, run, split, words,
    write_grey_png,
};
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A folder with a small scene that reads a file of each kind: `s.toml`, `a.obj`, `a.mtl`, `t.png`,
/// `sky.exr`, `places.txt`.
fn scene() -> TempDir {
    let folder = folder(&[
        ("a.mtl", "newmtl floor\nKd 0.5 0.4 0.3\nmap_Kd t.png\n"),
        (
            "a.obj",
            "mtllib a.mtl\nv -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt 0 0\nusemtl floor\nf 1/1 2/1 3/1 4/1\n",
        ),
        ("places.txt", "1 0 0 0  0 1 0 0  0 0 1 0\n1 0 0 3  0 1 0 0  0 0 1 0\n"),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 1, 4]\nlook_at = [0, 0.3, 0]\n\
             [image]\nwidth = 4\nheight = 3\n[render]\nsamples = 2\nbackend = \"brute\"\n[[object]]\nobj = \"a.obj\"\n\
             instances = \"places.txt\"\n[[light]]\ntype = \"environment\"\nimage = \"sky.exr\"\n",
        ),
    ]);
    write_grey_png(&folder.path().join("t.png"), &[200, 90]);
    let texel = |x: usize, y: usize| (1.0f32, x as f32, y as f32);
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 4, 2, texel).unwrap();
    folder
}

/// Names and contents of all files of a folder.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = paths.map(|path| (path.clone(), fs::read(&path).unwrap())).collect();
    files.sort();
    files
}

/// Names in a scene have characters in Latin-1, beyond Latin-1, and beyond 16 bits. The EXR file
/// stores all of these names.
#[test]
fn exr_files_store_names_of_all_scripts() {
    use exr::prelude::*;
    let names = ["木", "Küche", "дом", "лампа 🦀"];
    let mtl = names
        .map(|name| format!("newmtl {name}\nKd .5 .5 .5\nKe 1 1 1\n"))
        .concat();
    let faces = names.map(|name| format!("usemtl {name}\nf 1 2 3\n")).concat();
    let folder = folder(&[
        ("材料.mtl", &mtl),
        (
            "場面.obj",
            &format!("mtllib 材料.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}"),
        ),
        (
            "сцена.toml",
            "version = 1\n[image]\nwidth = 4\nheight = 4\n[[object]]\nobj = \"場面.obj\"\nname = \"объект 🦀\"\n",
        ),
    ]);
    let usual = split("render сцена.toml -q --backend brute --aov P,id,cryptomatte --checkpoint c.exr --resume");
    done(folder.path(), &joined(&usual, &split("--spp 2 -o x.exr -o x.png")));
    done(folder.path(), &joined(&usual, &split("--spp 4 -o y.exr")));
    assert!(folder.path().join("x.png").is_file());

    // All bytes of the attributes are ASCII, and the manifest has the names.
    let file = read_first_flat_layer_from_file(folder.path().join("y.exr")).unwrap();
    let mut found = Vec::new();
    for (key, value) in &file.layer_data.attributes.other {
        let AttributeValue::Text(text) = value else { continue };
        assert!(text.as_slice().iter().all(u8::is_ascii), "{key}: {text}");
        if key.to_string().ends_with("/manifest") {
            let manifest: serde_json::Value = serde_json::from_str(&text.to_string()).unwrap();
            found.extend(manifest.as_object().unwrap().keys().cloned());
        }
    }
    for name in names.iter().chain(&["объект 🦀"]) {
        assert!(found.iter().any(|f| f == name), "{name} is not in {found:?}");
    }
}

/// Input files stay unchanged if an output has the path of an input, or leads to it by links or
/// other spellings. The error comes before any ray is traced.
#[test]
fn outputs_never_overwrite_input_files() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    symlink("a.obj", path("link.exr")).unwrap();
    symlink("link.exr", path("second.exr")).unwrap();
    fs::hard_link(path("t.png"), path("hard.png")).unwrap();
    fs::create_dir(path("sub")).unwrap();
    symlink("..", path("sub/up")).unwrap();
    fs::write(path("report.json"), "{}").unwrap();
    done(folder.path(), &split("render s.toml -q -o a.exr"));
    done(folder.path(), &split("render s.toml -q -o r.png"));
    fs::create_dir(path("parts")).unwrap();
    done(
        folder.path(),
        &split("render s.toml -q --spp 128 --samples 0..64 -o parts/a.exr"),
    );
    done(
        folder.path(),
        &split("render s.toml -q --spp 128 --samples 64..128 -o parts/b.exr"),
    );
    fs::remove_dir_all(path("sub")).unwrap();
    fs::rename(path("parts/a.exr"), path("1.exr")).unwrap();
    fs::rename(path("parts/b.exr"), path("2.exr")).unwrap();
    fs::remove_dir(path("parts")).unwrap();
    let before = contents(folder.path());
    for line in [
        "render s.toml --stats s.toml -o n.exr",
        "render s.toml --stats ./a.obj -o n.exr",
        "render s.toml --stats a.mtl -o n.exr",
        "render s.toml --stats places.txt -o n.exr",
        "render s.toml -o t.png",
        "render s.toml -o hard.png",
        "render s.toml -o sky.exr",
        "render s.toml -o second.exr",
        "render a.obj --backend brute -o link.exr",
        "render a.obj --backend brute --checkpoint a.obj --resume -o n.exr",
        "merge 1.exr 2.exr -o 1.exr",
        "develop 1.exr -o r.png -o ./1.exr",
        "merge 1.exr 2.exr -o n.exr --checkpoint ./2.exr",
        "compare a.exr r.png -o r.png",
        "explain s.toml floor -o t.png",
        "explain s.toml floor -o sky.exr",
        "audit s.toml --backend brute --against obvhs --replay report.json -o report.json",
        "lab s.toml --reference t.png -o t",
    ] {
        let said = words(&run(folder.path(), &split(line)));
        // Audits need two backends; some builds have one.
        let is_refused = said.contains("would overwrite") || (line.starts_with("audit") && said.contains("help:"));
        assert!(is_refused, "{line}: {said}");
        assert!(contents(folder.path()) == before, "{line} has changed a file");
    }
}

#[test]
fn outputs_never_overwrite_each_other() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    symlink("new.exr", path("dangling.exr")).unwrap();
    for line in [
        "-o a.exr -o ./a.exr",
        "-o new.exr -o dangling.exr",
        "-o a.png --stats a.png",
        "-o a.exr --checkpoint a.exr",
        "-o a.exr --stats s.json --checkpoint ./s.json",
    ] {
        let said = refused(folder.path(), &joined(&["render", "s.toml"], &split(line)), 2);
        assert!(
            said.contains("is the same file as") && said.contains("help:"),
            "{line}: {said}"
        );
    }
    assert!(!path("a.exr").exists() && !path("new.exr").exists());
}

/// Names that cannot be written are refused before the scene is read: the scene of this test does
/// not exist.
#[test]
fn unwritable_names_are_refused_first() {
    let folder = scene();
    fs::create_dir(folder.path().join("folder.exr")).unwrap();
    symlink("loop.exr", folder.path().join("loop.exr")).unwrap();
    let long = format!("{}.exr", "x".repeat(252));
    for name in [
        &*long,
        "new.exr/",
        "new.exr/.",
        "s.toml/x.exr",
        "gone/x.exr",
        "folder.exr",
        "loop.exr",
        "gone/../x.exr",
    ] {
        let said = refused(folder.path(), &["render", "a.obj", "--backend", "brute", "-o", name], 1);
        assert!(
            said.contains("cannot write") && said.contains("help:"),
            "{name}: {said}"
        );
        assert!(
            !said.contains("nothing in the scene"),
            "{name} was refused after the scene was read: {said}"
        );
    }
}

#[test]
fn links_to_missing_files_are_followed() {
    let folder = scene();
    let path = |name: &str| folder.path().join(name);
    symlink("real.exr", path("link.exr")).unwrap();
    for _ in 0..2 {
        done(folder.path(), &split("render s.toml -q -o link.exr"));
        assert!(fs::symlink_metadata(path("link.exr")).unwrap().is_symlink());
        assert!(fs::symlink_metadata(path("real.exr")).unwrap().is_file());
    }
}

/// One render writes a checkpoint. A second render is refused while the first one runs, but not
/// after the first one was killed.
#[test]
fn a_checkpoint_has_one_writer() {
    let folder = scene();
    let args = split(
        "render s.toml --backend brute --size 64x64 --spp 1000000 --checkpoint c.exr --resume --checkpoint-interval 0.1s -o x.exr",
    );
    let mut first = command(folder.path(), &args).stderr(Stdio::null()).spawn().unwrap();
    let start = Instant::now();
    while !folder.path().join("c.exr").exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let said = run(folder.path(), &args);
    first.kill().unwrap();
    first.wait().unwrap();
    let (said, owner) = (words(&said), format!("process {}", first.id()));
    assert!(said.contains(&format!("c.exr: {owner} is writing this file")), "{said}");
    let merged = run(folder.path(), &split("merge c.exr --allow-gaps --checkpoint d.exr"));
    assert_eq!(code(&merged), 0, "{}", words(&merged));

    // The next run removes temporary files of the killed run.
    let args = joined(&args, &["--time-limit", "0.01s"]);
    done(folder.path(), &args);
    let left: Vec<_> = contents(folder.path())
        .into_iter()
        .filter(|(path, _)| path.file_name().unwrap().to_string_lossy().starts_with('.'))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

/// A full disk is an error; a closed pipe is not.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn errors_of_standard_output_are_reported() {
    let folder = scene();
    done(folder.path(), &split("render s.toml -q -o a.exr"));
    let lines = [
        "info s.toml",
        "info s.toml --json",
        "check s.toml --json",
        "explain s.toml floor",
        "compare a.exr a.exr",
        "compare a.exr a.exr --json",
        "bench s.toml --backend brute --size 4x4",
        "lab s.toml --size 4x4 --spp 1 --backend brute --methods path -o lab",
        "render s.toml --pixel 1,1",
        "render s.toml -q --stats - -o b.exr",
        "man",
        "completions bash",
        "--version",
        "--help",
        "render --help",
    ];
    for line in lines {
        if Path::new("/dev/full").exists() {
            let full = fs::File::options().write(true).open("/dev/full").unwrap();
            let out = command(folder.path(), &split(line)).stdout(full).output().unwrap();
            assert_eq!(code(&out), 1, "{line}: {}", words(&out));
            assert!(
                words(&out).contains("cannot write to the standard output"),
                "{line}: {}",
                words(&out)
            );
        }
        // Write to a pipe whose other end is closed
        let mut reader = Command::new("true").stdin(Stdio::piped()).spawn().unwrap();
        let writer = reader.stdin.take().unwrap();
        reader.wait().unwrap();
        let out = command(folder.path(), &split(line)).stdout(writer).output().unwrap();
        assert!(
            code(&out) == 0 && !words(&out).contains("error"),
            "{line}: {}",
            words(&out)
        );
    }
}

/// If standard error cannot be written, the render still completes.
#[test]
fn full_standard_error_does_not_stop_a_render() {
    let folder = scene();
    if !Path::new("/dev/full").exists() {
        return;
    }
    for (line, expected) in [
        ("render s.toml -v -o x.exr", 0),
        ("check gone.toml", 1),
        ("render", 2),
        ("bogus", 2),
    ] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let out = command(folder.path(), &split(line)).stderr(full).output().unwrap();
        assert_eq!(code(&out), expected, "{line}");
    }
    assert!(folder.path().join("x.exr").exists());
}

#[test]
fn statistics_can_go_to_standard_output() {
    let folder = scene();
    let out = done(folder.path(), &split("render s.toml --stats - -o x.exr"));
    let stats = json(&out);
    assert_eq!((&stats["samples"], &stats["complete"]), (&24.into(), &true.into()));
    assert!(!folder.path().join("-").exists());
    let version = printed(&run(folder.path(), &["--version"]));
    assert!(
        version.contains(&format!("(build {})", stats["build"].as_str().unwrap())),
        "{version}"
    );
}

/// Names of files, materials and objects contain terminal escapes that would move the cursor, set
/// colours, or set the window title. The program does not print the escapes.
#[test]
fn names_send_no_escapes_to_the_terminal() {
    let evil = "\u{1b}[31mred\u{7f}\u{9b}2J\u{1b}]0;title\u{7}";
    let folder = folder(&[
        (
            "a.mtl",
            &format!("newmtl {evil}\nKd .9 .9 .9\nKs .9 .9 .9\nmap_Kd {evil}.png\n"),
        ),
        (
            &format!("{evil}.obj"),
            &format!("mtllib a.mtl {evil}.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {evil}\nf 1 2 3\nf 1 1 9\n"),
        ),
        (
            "good.obj",
            &format!("mtllib a.mtl {evil}.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl {evil}\nf 1 2 3\n"),
        ),
    ]);
    let obj = format!("{evil}.obj");
    let cases: &[&[&str]] = &[
        &["render", &obj],
        &["check", &obj],
        &["check", &obj, "--json"],
        &["info", "good.obj"],
        &["info", "good.obj", "--json"],
        &["explain", "good.obj", evil],
        &["explain", "good.obj", &evil[1..]],
        &[
            "render",
            "good.obj",
            "--backend",
            "brute",
            "--size",
            "4x4",
            "--spp",
            "1",
            "-o",
            &format!("{evil}.png"),
        ],
        &[
            "render",
            "good.obj",
            "--backend",
            "brute",
            "--size",
            "4x4",
            "--pixel",
            "1,2",
        ],
        &["compare", &format!("{evil}.png"), &format!("{evil}.png")],
        &["render", "good.obj", "--bogus", evil],
        &["render", "good.obj", "--size", evil],
        &["render", "line\nbreak.toml"],
    ];
    for args in cases {
        let out = run(folder.path(), args);
        let all = printed(&out) + &words(&out);
        let shown = all.chars().find(|c| c.is_control() && *c != '\n' && *c != '\t');
        assert_eq!(shown, None, "{args:?}: {all:?}");
        let is_named = ["\\u001b", "red", "line\\u000abreak"]
            .iter()
            .any(|name| all.contains(name));
        assert!(is_named || args.contains(&"--bogus"), "{args:?}: {all}");
        if args.contains(&"--json") {
            json(&out);
        }
    }
}

/// If an image cannot be written, the other files are written, and the sums of the image are saved
/// in a rescue file.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs LD_PRELOAD")]
fn unwritable_image_affects_no_other_file() {
    let folder = scene();
    fs::write(folder.path().join("x.rescue.exr"), "mine").unwrap();
    let line = "render s.toml -q --threads 1 -o x.exr -o x.png --stats x.json";
    let faulty = FailingCommand::new(folder, line, &["x.exr", "x.png"]);
    faulty.restore();
    let out = faulty.run("rename", 1).unwrap();
    assert_eq!(code(&out), 1);
    let said = words(&out);
    assert!(
        said.contains("x.exr: cannot write") && said.contains("x.rescue-2.exr"),
        "{said}"
    );
    let path = |name: &str| faulty.folder.path().join(name);
    assert!(!path("x.exr").exists() && faulty.is_right("x.png", &faulty.right[1].1));
    assert_eq!(read_json(&path("x.json"))["complete"], true);
    assert_eq!(fs::read(path("x.rescue.exr")).unwrap(), b"mine");

    // The rescue file has all sums, so the image can be made from it.
    done(
        faulty.folder.path(),
        &split("render s.toml -q --checkpoint x.rescue-2.exr --resume -o y.exr"),
    );
    assert_same_bits(&path("y.exr"), &faulty.right[0].1);
    // If a checkpoint has the sums, no rescue file is written.
    let line = "render s.toml -q --threads 1 --checkpoint c.exr -o z.exr";
    let faulty = FailingCommand::new(scene(), line, &["z.exr"]);
    faulty.restore();
    let out = faulty.run("rename", 2).unwrap();
    assert!(code(&out) == 1 && !words(&out).contains("rescue"), "{}", words(&out));
    assert!(!faulty.folder.path().join("z.exr").exists() && faulty.folder.path().join("c.exr").exists());
}

/// System calls that the test can make fail.
const CALLS: [&str; 6] = ["open", "read", "write", "fsync", "rename", "mmap"];

/// A command in a folder of files. Some system calls of the command fail.
struct FailingCommand {
    folder: TempDir,
    /// Library that makes the calls fail.
    library: PathBuf,
    args: Vec<&'static str>,
    /// Outputs of a run without failing calls.
    right: Vec<(&'static str, PathBuf)>,
    /// All files of the folder before each run.
    before: Vec<(PathBuf, Vec<u8>)>,
    right_folder: TempDir,
}

impl FailingCommand {
    /// The command `line` in `folder`, which writes the files `outputs`.
    fn new(folder: TempDir, line: &'static str, outputs: &[&'static str]) -> Self {
        let right_folder = tempfile::tempdir().unwrap();
        let library = right_folder.path().join("inject.so");
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/faults/inject.c");
        let mut compiler = Command::new("cc");
        compiler
            .args(["-shared", "-fPIC", "-O1", "-o"])
            .arg(&library)
            .arg(source)
            .arg("-ldl");
        // `cc` is available, because Rust links with it.
        let out = compiler.output().unwrap();
        assert!(out.status.success(), "{}", words(&out));
        let before = contents(folder.path());
        let args = split(line);
        done(folder.path(), &args);
        let keep = |name: &&'static str| {
            let copy = right_folder.path().join(name);
            fs::copy(folder.path().join(name), &copy).unwrap();
            (*name, copy)
        };
        let right = outputs.iter().map(keep).collect();
        Self {
            folder,
            library,
            args,
            right,
            before,
            right_folder,
        }
    }

    /// Restores the files that existed before the first run, and deletes all others.
    fn restore(&self) {
        for (path, _) in contents(self.folder.path()) {
            fs::remove_file(path).unwrap();
        }
        for (path, content) in &self.before {
            fs::write(path, content).unwrap();
        }
    }

    /// Runs the command with a failure of the call number `nth`. Returns `None` if there is no such
    /// call.
    fn run(&self, call: &str, nth: u32) -> Option<Output> {
        let mark = self.right_folder.path().join("mark");
        let _ = fs::remove_file(&mark);
        let mut command = command(self.folder.path(), &self.args);
        command
            .env("LD_PRELOAD", &self.library)
            .env("FAULT_FOLDER", self.folder.path().canonicalize().unwrap())
            .env("FAULT_CALL", call)
            .env("FAULT_NTH", nth.to_string())
            .env("FAULT_MARK", &mark);
        let mut child = command.spawn().unwrap();
        let start = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if start.elapsed() > Duration::from_secs(60) {
                child.kill().unwrap();
                panic!("{call} {nth}: hangs");
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        let out = child.wait_with_output().unwrap();
        mark.exists().then_some(out)
    }

    /// Returns true if an output equals the output of a run without faults.
    fn is_right(&self, name: &str, right: &Path) -> bool {
        let path = self.folder.path().join(name);
        match name.rsplit_once('.') {
            Some((_, "exr")) => {
                // Compare only the pixels, because the render time in the file differs.
                assert_same_bits(&path, right);
                true
            }
            Some((_, "json")) => {
                let samples = |path: &Path| read_json(path)["samples"].clone();
                samples(&path) == samples(right)
            }
            _ => fs::read(&path).unwrap() == fs::read(right).unwrap(),
        }
    }

    /// Lets each call of each kind fail in turn. A run must not report success falsely, write
    /// partial files, lose files, panic or hang.
    fn check(&self) {
        for call in CALLS {
            let mut failed = 0;
            for nth in 1.. {
                self.restore();
                let Some(out) = self.run(call, nth) else { break };
                let what = format!("{call} {nth}: {}", words(&out));
                let code = out.status.code().unwrap_or_else(|| panic!("{what}: ended by a signal"));
                assert!(code <= 1 && !words(&out).contains("panicked"), "{what}: {code}");
                assert!(code == 0 || words(&out).contains("error"), "{what}");
                failed += u32::from(code == 1);
                let mut has_floats = false;
                for (name, right) in &self.right {
                    let path = self.folder.path().join(name);
                    let old = self.before.iter().find(|(before, _)| *before == path);
                    let now = fs::read(&path).ok();
                    let is_old = now.as_ref() == old.map(|(_, content)| content);
                    let is_right = (code == 0 || !is_old) && now.is_some() && self.is_right(name, right);
                    assert!(
                        is_right || (code == 1 && is_old),
                        "{what}: {code}, {name} is neither old nor right"
                    );
                    has_floats |= is_right && name.ends_with(".exr");
                }
                // Input files still exist, and only rescue files are left over.
                for (path, content) in &self.before {
                    let is_output = self.right.iter().any(|(name, _)| path.ends_with(name));
                    assert!(
                        is_output || fs::read(path).unwrap() == *content,
                        "{what}: {}",
                        path.display()
                    );
                }
                for (path, _) in contents(self.folder.path()) {
                    let name = path.file_name().unwrap().to_string_lossy().into_owned();
                    let is_known = self.right.iter().any(|(known, _)| *known == name)
                        || self.before.iter().any(|(known, _)| *known == path)
                        || (name.ends_with(".rescue.exr") && !has_floats);
                    assert!(is_known, "{what}: {name} is left over");
                }
            }
            // Failures of some calls have no effect, for example in the search for files of killed
            // runs.
            assert!(failed > 0 || call == "mmap", "no failing {call} made the run fail");
        }
    }
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs LD_PRELOAD")]
fn renders_survive_faults_of_the_system() {
    let folder = scene();
    fs::write(folder.path().join("x.exr"), "an older picture").unwrap();
    let line = "render s.toml -q --threads 1 -o x.exr -o x.png --stats x.json";
    FailingCommand::new(folder, line, &["x.exr", "x.png", "x.json"]).check();
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs LD_PRELOAD")]
fn checkpoints_survive_faults_of_the_system() {
    let folder = scene();
    done(
        folder.path(),
        &split("render s.toml -q --spp 2 --checkpoint c.exr -o old.png"),
    );
    let line = "render s.toml -q --threads 1 --spp 3 --checkpoint c.exr --resume -o x.png";
    FailingCommand::new(folder, line, &["c.exr", "x.png"]).check();
}

/// Regression: if the file system failed to answer, the program treated the checkpoint as missing,
/// and replaced it.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs LD_PRELOAD")]
fn checkpoint_is_kept_if_its_search_fails() {
    let folder = scene();
    let line = "render s.toml -q --threads 1 --spp 3 --checkpoint c.exr -o x.png";
    let faulty = FailingCommand::new(folder, line, &["c.exr", "x.png"]);
    let checkpoint = faulty.folder.path().join("c.exr");
    let kept = fs::read(&checkpoint).unwrap();
    let mut failed = 0;
    for nth in 1.. {
        faulty.restore();
        fs::write(&checkpoint, &kept).unwrap();
        let Some(out) = faulty.run("stat", nth) else { break };
        let what = format!("stat {nth}: {}", words(&out));
        assert_ne!(code(&out), 0, "{what}");
        assert!(!words(&out).contains("does not exist"), "{what}");
        assert!(fs::read(&checkpoint).unwrap() == kept, "{what}");
        failed += u32::from(code(&out) == 1);
    }
    assert!(failed > 0, "no failing stat made the run fail");
}

#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs LD_PRELOAD")]
fn merges_and_compares_survive_system_faults() {
    let folder = scene();
    for (range, name) in [("0..64", "1.exr"), ("64..128", "2.exr")] {
        done(
            folder.path(),
            &split(&format!("render s.toml -q --spp 128 --samples {range} -o {name}")),
        );
    }
    let line = "merge 1.exr 2.exr -q --threads 1 -o x.exr -o x.png --checkpoint c.exr";
    let merge = FailingCommand::new(folder, line, &["x.exr", "x.png", "c.exr"]);
    merge.check();
    merge.restore();
    done(merge.folder.path(), &split("merge 1.exr 2.exr -q -o x.exr"));
    let FailingCommand { folder, .. } = merge;
    let compare = FailingCommand::new(folder, "compare x.exr x.exr -o d.png", &["d.png"]);
    compare.check();
}
