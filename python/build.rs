//! Tells the linker where the extension module finds its libraries at run time.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
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
        return;
    }
    // In place, where the libraries of the build are: Embree, which `embree4-sys` has found, and Open Image Denoise.
    match env::var("DEP_EMBREE4_RPATH") {
        Ok(folder) if !folder.is_empty() => println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}"),
        _ => {}
    }
    if env::var_os("CARGO_FEATURE_OIDN").is_some() {
        println!("cargo::rerun-if-env-changed=OIDN_DIR");
        let prefix = env::var_os("OIDN_DIR").map(|prefix| Path::new(&prefix).join("lib"));
        if let Some(folder) = prefix.filter(|folder| folder.join("libOpenImageDenoise.so").exists()) {
            println!("cargo::rustc-link-arg=-Wl,-rpath,{}", folder.display());
        }
    }
}
