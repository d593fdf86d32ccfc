//! The program outside of its build folder: installed below a prefix, moved, and in a Python wheel.
#![cfg(all(feature = "embree", target_os = "linux"))]

use crate::support::program::{PROGRAM, folder, printed};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{fs, str};

fn script(name: &str, args: &[&Path]) -> Output {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scripts").join(name);
    let out = Command::new(path).args(args).output().unwrap();
    let said = str::from_utf8(&out.stderr).unwrap();
    assert!(out.status.success(), "scripts/{name}: {said}");
    out
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] })
        .collect()
}

/// Paths of libraries that `--version` prints.
fn libraries(program: &Path) -> Vec<String> {
    let out = Command::new(program).arg("--version").output().unwrap();
    assert!(out.status.success(), "{}", program.display());
    let lines = printed(&out);
    lines
        .lines()
        .filter_map(|line| line.strip_prefix("library "))
        .map(String::from)
        .collect()
}

#[test]
fn installed_program_can_be_moved_and_removed() {
    let folder = folder(&[("a.txt", "")]);
    let [first, second] = ["first", "second place"].map(|name| folder.path().join(name));
    script("install", &[Path::new("--self-contained"), Path::new(PROGRAM), &first]);
    // A self-contained installation has each library that other machines may lack.
    let brought = libraries(&first.join("bin/embrasure"));
    assert_eq!(brought.len(), libraries(Path::new(PROGRAM)).len(), "{brought:?}");
    let place = fs::canonicalize(&first).unwrap();
    assert!(
        brought.iter().all(|path| Path::new(path).starts_with(&place)),
        "{brought:?}"
    );

    script("install", &[Path::new(PROGRAM), &first]);
    for page in [
        "share/man/man1/embrasure-render.1",
        "share/fish/vendor_completions.d/embrasure.fish",
    ] {
        assert!(fs::metadata(first.join(page)).unwrap().len() > 100, "{page}");
    }
    fs::rename(&first, &second).unwrap();

    // If there are project libraries, they are moved with the program. System libraries stay.
    let is_own = |path: &String| !["/usr/", "/lib"].iter().any(|system| path.starts_with(system));
    let own: Vec<String> = libraries(Path::new(PROGRAM)).into_iter().filter(is_own).collect();
    let found: Vec<String> = libraries(&second.join("bin/embrasure"))
        .into_iter()
        .filter(is_own)
        .collect();
    assert_eq!(found.len(), own.len(), "{found:?}");
    let moved = fs::canonicalize(&second).unwrap();
    assert!(
        found.iter().all(|path| Path::new(path).starts_with(&moved)),
        "{found:?}"
    );
    let scene = second.join("share/embrasure/scenes/cornell-box.toml");
    let out = Command::new(second.join("bin/embrasure"))
        .args(["render", "--spp", "1", "--size", "8x8", "-q", "-o"])
        .arg(folder.path().join("o.png"))
        .arg(&scene)
        .output();
    assert!(out.unwrap().status.success());

    script("install", &[Path::new("--remove"), &second]);
    assert_eq!(files(&second), Vec::<PathBuf>::new());
}

#[test]
#[cfg_attr(not(python), ignore = "needs python3 and readelf")]
#[cfg_attr(all(python, not(long)), ignore = "long")]
fn wheel_content_matches_its_record() {
    let folder = folder(&[("a.txt", "")]);
    let prefix = folder.path().join("prefix");
    script("install", &[Path::new(PROGRAM), &prefix]);
    // In this test, the program takes the place of the extension module, which is not built here.
    let modules = folder.path().join("modules");
    script("python-package", &[Path::new(PROGRAM), &modules]);
    let package = modules.join("embrasure");
    script("wheel", &[&prefix, Path::new("1.2.3"), &package, folder.path()]);
    // Check the wheel with Python's reader of archives, and with the digests that pip checks
    let check = r#"
import base64, csv, glob, hashlib, io, sys, zipfile
[path] = glob.glob(sys.argv[1] + "/embrasure-1.2.3-cp39-abi3-manylinux_2_*.whl")
archive = zipfile.ZipFile(path)
rows = list(csv.reader(io.StringIO(archive.read("embrasure-1.2.3.dist-info/RECORD").decode())))
assert sorted(row[0] for row in rows) == sorted(archive.namelist())
for name, digest, size in rows:
    if digest:
        content = archive.read(name)
        found = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        assert (digest, size) == ("sha256=" + found, str(len(content))), name
mode = archive.getinfo("embrasure-1.2.3.data/scripts/embrasure").external_attr >> 16
assert mode & 0o111, oct(mode)
assert {"embrasure/__init__.py", "embrasure/_native.abi3.so", "embrasure/py.typed"} <= set(archive.namelist())
assert any("libembree4" in name for name in archive.namelist()) or not glob.glob(sys.argv[1] + "/prefix/lib/embrasure/lib/*embree*")
"#;
    let out = Command::new("python3")
        .args(["-c", check])
        .arg(folder.path())
        .output()
        .unwrap();
    assert!(out.status.success(), "{}", str::from_utf8(&out.stderr).unwrap());
}
