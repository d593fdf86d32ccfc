//! Computes the name of the build, and tells the linker the folders in which the program finds its
//! libraries at run time.

use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs, io};

/// Files and folders that determine the bits of a picture. Some may be missing in a package.
const SOURCES: [&str; 8] = [
    "Cargo.lock",
    "Cargo.toml",
    "build.rs",
    "src",
    "sys/build",
    "sys/build.rs",
    "sys/oidn/src",
    "sys/src",
];

fn main() {
    println!("cargo::rustc-env=EMBRASURE_BUILD={}", build_name());
    configure_shared();
    configure_chromium();
    configure_long();
    configure_machine();
    // An installed program has its libraries beside it, in any location (scripts/install). A
    // program built for other machines searches no other folder.
    println!("cargo::rerun-if-env-changed=EMBRASURE_MOVABLE");
    println!("cargo::rustc-link-arg-bins=-Wl,-rpath,$ORIGIN/../lib/embrasure/lib");
    if env::var_os("EMBRASURE_MOVABLE").is_some_and(|value| !value.is_empty()) {
        // Unlike DT_RUNPATH, DT_RPATH also applies to libraries of libraries. Debian's Embree needs
        // oneTBB and does not set a path.
        println!("cargo::rustc-link-arg-bins=-Wl,--disable-new-dtags");
        return;
    }
    // Folders of the renderer's libraries, which the build script of the renderer has found. Empty
    // if the libraries are in system folders.
    let folders = env::var("DEP_EMBRASURE_CORE_RPATH").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}

/// Sets the configuration `shared` if the scenes of `../shared` exist. Without the configuration,
/// tests that need these scenes are ignored. `EMBRASURE_REQUIRE_SHARED` sets the configuration even
/// if the folder is missing, so that these tests fail. A folder that appears later is found when
/// this script runs again.
fn configure_shared() {
    println!("cargo::rustc-check-cfg=cfg(shared)");
    println!("cargo::rerun-if-env-changed=EMBRASURE_REQUIRE_SHARED");
    let folders = ["scenes", "suite"].map(|name| Path::new("../shared").join(name));
    let exists = folders.iter().all(|folder| folder.is_dir());
    if exists {
        // Cargo checks all files below a folder, and would run this script in every build if the
        // path were missing. Therefore Cargo gets the path of a single file.
        println!("cargo::rerun-if-changed=../shared/suite/cornell/cornell.toml");
    }
    if exists || env::var_os("EMBRASURE_REQUIRE_SHARED").is_some() {
        println!("cargo::rustc-cfg=shared");
    }
}

/// Sets the configuration `chromium` and the variable `EMBRASURE_CHROMIUM`, the path of the
/// browser. Without the configuration, tests that open a page in a browser are ignored.
/// `EMBRASURE_REQUIRE_CHROMIUM` also sets the configuration if there is no browser, so that these
/// tests fail. A browser that is installed later is found when this script runs again.
fn configure_chromium() {
    println!("cargo::rustc-check-cfg=cfg(chromium)");
    println!("cargo::rerun-if-env-changed=EMBRASURE_REQUIRE_CHROMIUM");
    let names = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];
    let folders = env::var_os("PATH").unwrap_or_default();
    let program = env::split_paths(&folders)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|program| program.is_file());
    if let Some(program) = &program {
        println!("cargo::rerun-if-changed={}", program.display());
        println!("cargo::rustc-env=EMBRASURE_CHROMIUM={}", program.display());
    }
    if program.is_some() || env::var_os("EMBRASURE_REQUIRE_CHROMIUM").is_some() {
        println!("cargo::rustc-cfg=chromium");
    }
}

/// Sets the configuration `long` if `EMBRASURE_LONG` is set. Without the configuration, slow tests
/// are ignored.
fn configure_long() {
    println!("cargo::rustc-check-cfg=cfg(long)");
    println!("cargo::rerun-if-env-changed=EMBRASURE_LONG");
    if env::var_os("EMBRASURE_LONG").is_some() {
        println!("cargo::rustc-cfg=long");
    }
}

/// Sets the configuration `root` if the user root builds, and the configuration `python` if python3
/// and readelf exist. Without a configuration, the tests that need it are ignored.
fn configure_machine() {
    println!("cargo::rustc-check-cfg=cfg(root, python)");
    let output_of = |program: &str, arg: &str| Command::new(program).arg(arg).output();
    if output_of("id", "-u").is_ok_and(|out| out.stdout.trim_ascii() == b"0") {
        println!("cargo::rustc-cfg=root");
    }
    let is_there = |program: &str| output_of(program, "--version").is_ok_and(|out| out.status.success());
    if is_there("python3") && is_there("readelf") {
        println!("cargo::rustc-cfg=python");
    }
}

/// Hash of the sources, the compiler's version and the target processor. It does not depend on the
/// folder of the sources. Features of the crate are not included, because files name the backend
/// that traced the rays, and no other feature changes the bits of a picture.
fn build_name() -> String {
    let mut hash = Sha256::new();
    for source in SOURCES {
        println!("cargo::rerun-if-changed={source}");
        for path in files(Path::new(source)).unwrap_or_default() {
            let content = fs::read(&path).unwrap_or_default();
            hash.update(format!("{} {}\n", path.display(), content.len()));
            hash.update(content);
        }
    }
    let compiler = env::var_os("RUSTC").unwrap_or("rustc".into());
    let version = Command::new(compiler).arg("--version").output();
    hash.update(version.map(|output| output.stdout).unwrap_or_default());
    for name in ["TARGET", "CARGO_CFG_TARGET_FEATURE"] {
        hash.update(format!("{}\n", env::var(name).unwrap_or_default()));
    }
    let digest = hash.finalize();
    digest.iter().take(6).map(|byte| format!("{byte:02x}")).collect()
}

/// All files below `path` in the order of their names. Hidden files, such as backups of editors,
/// are not sources.
fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(path.exists().then(|| path.to_path_buf()).into_iter().collect());
    }
    let entries: io::Result<Vec<_>> = fs::read_dir(path)?.map(|entry| Ok(entry?.path())).collect();
    let mut entries = entries?;
    entries.sort();
    let is_hidden = |path: &PathBuf| {
        path.file_name()
            .is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
    };
    let below = entries.iter().filter(|path| !is_hidden(path)).map(|path| files(path));
    Ok(below.collect::<io::Result<Vec<_>>>()?.concat())
}
