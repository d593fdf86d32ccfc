//! Passes the folders of libraries to the linker, so that the extension module finds them at run
//! time.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    configure_python();
    println!("cargo::rerun-if-env-changed=EMBRASURE_MOVABLE");
    // The libraries of an installed wheel are in lib/embrasure/lib of the environment, where the
    // program also searches them (scripts/wheel). The package is in lib/pythonX.Y/site-packages, or
    // on some systems in lib64/pythonX.Y/site-packages. `pip install --target` puts the package
    // beside the folder lib.
    for folder in [
        "../../../embrasure/lib",
        "../../../../lib/embrasure/lib",
        "../lib/embrasure/lib",
    ] {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-rpath,$ORIGIN/{folder}");
    }
    if env::var_os("EMBRASURE_MOVABLE").is_some_and(|value| !value.is_empty()) {
        // Use DT_RPATH instead of DT_RUNPATH, as in the build script of the main crate
        println!("cargo::rustc-link-arg-cdylib=-Wl,--disable-new-dtags");
        return;
    }
    // For builds that are not installed: add the folders of the build's libraries, which the build
    // script of the renderer has found
    let folders = env::var("DEP_EMBRASURE_CORE_RPATH").unwrap_or_default();
    for folder in folders.split(':').filter(|folder| !folder.is_empty()) {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
}

/// Sets the configuration `python` if scripts/setup-python has made the environment of the Python
/// tests. Without this configuration, the Python tests are ignored. `EMBRASURE_REQUIRE_PYTHON`
/// always sets the configuration, so that the tests fail if the environment is missing.
fn configure_python() {
    const MADE: &str = "../.deps/python/pins";
    println!("cargo::rustc-check-cfg=cfg(python)");
    println!("cargo::rerun-if-changed={MADE}");
    println!("cargo::rerun-if-env-changed=EMBRASURE_REQUIRE_PYTHON");
    if Path::new(MADE).exists() || env::var_os("EMBRASURE_REQUIRE_PYTHON").is_some() {
        println!("cargo::rustc-cfg=python");
    }
}
