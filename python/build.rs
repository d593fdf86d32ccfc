//! Tells the linker where the extension module finds its libraries at run time.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    configure_python();
    println!("cargo::rerun-if-env-changed=EMBRASURE_MOVABLE");
    // The wheel has the libraries in lib/embrasure/lib of the environment, as the program has them (scripts/wheel): the package is in lib/pythonX.Y/site-packages, in
    // lib64 on some systems, or beside them with `pip install --target`.
    for folder in [
        "../../../embrasure/lib",
        "../../../../lib/embrasure/lib",
        "../lib/embrasure/lib",
    ] {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-rpath,$ORIGIN/{folder}");
    }
    if env::var_os("EMBRASURE_MOVABLE").is_some_and(|value| !value.is_empty()) {
        // DT_RPATH in place of DT_RUNPATH, as in the main crate's build script.
        println!("cargo::rustc-link-arg-cdylib=-Wl,--disable-new-dtags");
        return;
    }
    // In place, where the libraries of the build are, which the renderer's own build script has found.
    let folders = env::var("DEP_EMBRASURE_CORE_RPATH").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}

/// Sets the configuration `python`, without which the Python tests are ignored: where scripts/setup-python has made their environment.
/// `EMBRASURE_REQUIRE_PYTHON` sets it elsewhere, too, so that these tests fail.
fn configure_python() {
    const MADE: &str = "../.deps/python/pins";
    println!("cargo::rustc-check-cfg=cfg(python)");
    println!("cargo::rerun-if-changed={MADE}");
    println!("cargo::rerun-if-env-changed=EMBRASURE_REQUIRE_PYTHON");
    if Path::new(MADE).exists() || env::var_os("EMBRASURE_REQUIRE_PYTHON").is_some() {
        println!("cargo::rustc-cfg=python");
    }
}
