//! Tells the linker where the libraries will be found at run time.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // Embree, which `embree4-sys` has found. Empty where it lies in a system folder, unset where the feature is off.
    match env::var("DEP_EMBREE4_RPATH") {
        Ok(folder) if !folder.is_empty() => println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}"),
        _ => {}
    }
    // Open Image Denoise, where the oidn crate looks for it; that of a system folder is found without.
    if env::var_os("CARGO_FEATURE_OIDN").is_some() {
        println!("cargo::rerun-if-env-changed=OIDN_DIR");
        if let Some(prefix) = env::var_os("OIDN_DIR") {
            let folder = Path::new(&prefix).join("lib");
            let library = folder.join("libOpenImageDenoise.so");
            println!("cargo::rerun-if-changed={}", library.display());
            if library.exists() {
                println!("cargo::rustc-link-arg=-Wl,-rpath,{}", folder.display());
            }
        }
    }
}
