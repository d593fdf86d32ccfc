//! Sets the paths of the extension module's libraries at run time for the linker.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    configure_python();
    println!("cargo::rerun-if-env-changed=EMBRASURE_MOVABLE");
    // The wheel has the libraries in lib/embrasure/lib of the environment, like the program
    // (scripts/wheel). The package is in lib/pythonX.Y/site-packages, on some systems in lib64, or
    // beside them with `pip install --target`.
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
    // For builds in place: folders of the build's libraries, found by the renderer's own build
    // script.
    let folders = env::var("DEP_EMBRASURE_CORE_RPATH").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}

/// Sets the configuration `python` if scripts/setup-python has made the environment of the Python
/// tests. Without it, these tests are ignored. `EMBRASURE_REQUIRE_PYTHON` sets it everywhere, so
/// that these tests fail without the environment.
fn configure_python() {
    const MADE: &str = "../.deps/python/pins";
    println!("cargo::rustc-check-cfg=cfg(python)");
    println!("cargo::rerun-if-changed={MADE}");
    println!("cargo::rerun-if-env-changed=EMBRASURE_REQUIRE_PYTHON");
    if Path::new(MADE).exists() || env::var_os("EMBRASURE_REQUIRE_PYTHON").is_some() {
        println!("cargo::rustc-cfg=python");
    }
}
