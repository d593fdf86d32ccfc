//! Outputs that replace existing files: permissions, hard links and locks, and names that another
//! process takes.
#![cfg(unix)]

use crate::support::program::{command, done, lit_floor, refused, run, signal, split, words};
use std::fs;
use std::os::unix::fs::{PermissionsExt, lchown, symlink};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Maximum time of a command that must not wait. The time is long, because test machines are busy.
const PATIENCE: Duration = Duration::from_secs(120);

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().permissions().mode() & 0o777
}

/// Runs the program, and fails if it does not end.
fn run_to_end(folder: &Path, line: &str) -> Output {
    let mut child = command(folder, &split(line)).spawn().unwrap();
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("{line}: hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().unwrap()
}

#[test]
fn replaced_files_keep_their_permissions() {
    let folder = lit_floor();
    let outputs = ["x.exr", "x.png", "x.json", "d.toml", "c.exr"];
    let line = "render s.toml -q -o x.exr -o x.png --stats x.json --dump-scene d.toml --checkpoint c.exr --resume";
    done(folder.path(), &split(line));
    for mode in [0o600, 0o664] {
        for name in outputs {
            fs::set_permissions(folder.path().join(name), fs::Permissions::from_mode(mode)).unwrap();
        }
        done(folder.path(), &split(&format!("{line} --spp 8")));
        for name in outputs {
            assert_eq!(self::mode(&folder.path().join(name)), mode, "{name}");
        }
    }
}

#[test]
fn hard_links_of_a_replaced_file_are_reported() {
    let folder = lit_floor();
    fs::write(folder.path().join("x.png"), "old").unwrap();
    fs::hard_link(folder.path().join("x.png"), folder.path().join("y.png")).unwrap();
    let said = words(&done(folder.path(), &split("render s.toml -q -o x.png")));
    assert!(
        said.contains("warning: -o x.png: other names") && said.contains("hard links"),
        "{said}"
    );
    assert_eq!(fs::read(folder.path().join("y.png")).unwrap(), b"old");
    let said = words(&done(folder.path(), &split("render s.toml -q -o x.png")));
    assert!(!said.contains("hard links"), "{said}");
}

/// Pipes have the names of a temporary file, of the lock, and of an input. The program does not
/// wait for them.
#[test]
fn pipes_are_not_waited_for() {
    let folder = lit_floor();
    let prefix = |name: &str| {
        use sha2::{Digest, Sha256};
        let digest = Sha256::digest(name);
        let digits: String = digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        format!(".embrasure-{digits}-")
    };
    let pipe = |name: String| {
        let made = Command::new("mkfifo").arg(folder.path().join(name)).status();
        assert!(made.unwrap().success());
    };
    pipe(prefix("x.png") + "x.tmp");
    pipe(prefix("c.exr") + "lock");
    pipe("report.json".into());
    let out = run_to_end(folder.path(), "render s.toml -q -o x.png");
    assert!(out.status.success(), "{}", words(&out));
    for line in [
        "render s.toml -q -o x.png --checkpoint c.exr",
        "audit s.toml --backend embree --against obvhs --replay report.json",
    ] {
        let said = words(&run_to_end(folder.path(), line));
        assert!(
            said.contains("not a regular file") && said.contains("help:"),
            "{line}: {said}"
        );
    }
}

/// A link of another user, in a folder like `/tmp`, points to a file of the user who runs the
/// program. An output through this link is refused. Only root can make such a link for the test.
#[test]
#[cfg_attr(not(root), ignore = "needs root")]
fn links_of_others_in_sticky_folders_are_refused() {
    let folder = lit_floor();
    let path = |name: &str| folder.path().join(name);
    fs::create_dir(path("tmp")).unwrap();
    fs::set_permissions(path("tmp"), fs::Permissions::from_mode(0o1777)).unwrap();
    fs::write(path("notes"), "notes").unwrap();
    symlink("../notes", path("tmp/x.png")).unwrap();
    symlink("..", path("tmp/sub")).unwrap();
    // Some containers do not have this user.
    if lchown(path("tmp/x.png"), Some(65534), None).is_err() {
        return;
    }
    lchown(path("tmp/sub"), Some(65534), None).unwrap();
    for name in ["tmp/x.png", "tmp/sub/x.png"] {
        let said = refused(folder.path(), &["render", "s.toml", "-q", "-o", name], 1);
        assert!(
            said.contains("link of another user") && said.contains("help:"),
            "{name}: {said}"
        );
    }
    assert_eq!(fs::read(path("notes")).unwrap(), b"notes");
    assert!(!path("x.png").exists());
}

/// A folder with a render that writes the checkpoint `c.exr` until it is stopped.
fn with_checkpoint() -> (TempDir, std::process::Child) {
    let folder = lit_floor();
    let line = "render s.toml --spp 10000000 --checkpoint c.exr --checkpoint-interval 0.1s -o x.exr";
    let writer = command(folder.path(), &split(line))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !folder.path().join("c.exr").exists() {
        assert!(start.elapsed() < PATIENCE, "no checkpoint");
        std::thread::sleep(Duration::from_millis(5));
    }
    (folder, writer)
}

#[test]
fn locked_checkpoint_is_not_replaced() {
    let (folder, mut writer) = with_checkpoint();
    let owner = format!("c.exr: process {} is writing this file", writer.id());
    done(folder.path(), &split("render s.toml -q -o y.exr"));
    let said = ["render s.toml -q -o c.exr", "develop y.exr -o c.exr"]
        .map(|line| (line, words(&run(folder.path(), &split(line)))));
    signal(&writer, "INT");
    assert_eq!(writer.wait().unwrap().code(), Some(130));
    for (line, said) in said {
        assert!(said.contains(&owner) && said.contains("help:"), "{line}: {said}");
    }
    // The file is still a checkpoint, and no longer locked.
    done(folder.path(), &split("render s.toml -q --spp 1 -o z.exr"));
    done(folder.path(), &split("merge c.exr --allow-gaps -q -o merged.exr"));
    done(folder.path(), &split("render s.toml -q -o c.exr"));
}

/// A render starts before a second render writes a checkpoint with the same name. The first render
/// must not replace this checkpoint.
#[test]
fn checkpoint_of_a_later_render_is_not_replaced() {
    let folder = lit_floor();
    let long = "render s.toml --spp 10000000";
    let first = format!("{long} -o c.exr --checkpoint first.exr --checkpoint-interval 0.1s");
    let second = format!("{long} -o y.exr --checkpoint c.exr --checkpoint-interval 0.1s");
    let mut children = Vec::new();
    for (line, made) in [(first, "first.exr"), (second, "c.exr")] {
        children.push(command(folder.path(), &split(&line)).spawn().unwrap());
        let start = Instant::now();
        while !folder.path().join(made).exists() {
            assert!(start.elapsed() < PATIENCE, "no {made}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    let second = children.pop().unwrap();
    let first = children.pop().unwrap();
    signal(&first, "INT");
    let out = first.wait_with_output().unwrap();
    let said = words(&out);
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert!(
        said.contains(&format!("c.exr: process {} is writing this file", second.id())),
        "{said}"
    );
    signal(&second, "INT");
    assert!(second.wait_with_output().unwrap().status.code() == Some(130));
    done(folder.path(), &split("merge c.exr --allow-gaps -q -o merged.exr"));
}
