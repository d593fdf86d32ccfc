//! Tells the linker, and the build script of the program, where the libraries will be found at run time.

use std::env;
use std::path::Path;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let folders = folders();
    for folder in &folders {
        println!("cargo::rustc-link-arg=-Wl,-rpath,{folder}");
    }
    println!("cargo::metadata=rpath={}", folders.join(":"));
}

/// Folders of Embree and Open Image Denoise that the system does not search by itself.
fn folders() -> Vec<String> {
    let mut folders = Vec::new();
    // Embree, which `embree4-sys` has found. Empty where it lies in a system folder, unset where the feature is off.
    folders.extend(env::var("DEP_EMBREE4_RPATH").ok().filter(|folder| !folder.is_empty()));
    // Open Image Denoise, where the oidn crate looks for it; that of a system folder is found without.
    if env::var_os("CARGO_FEATURE_OIDN").is_some() {
        println!("cargo::rerun-if-env-changed=OIDN_DIR");
        if let Ok(prefix) = env::var("OIDN_DIR") {
            let folder = Path::new(&prefix).join("lib");
            let library = folder.join("libOpenImageDenoise.so");
            println!("cargo::rerun-if-changed={}", library.display());
            if library.exists() {
                folders.push(folder.display().to_string());
            }
        }
    }
    folders
}
