//! Sets the run-time library folders for the linker and for the program's build script.

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

/// Folders of Embree and Open Image Denoise that the system does not search.
fn folders() -> Vec<String> {
    let mut folders = Vec::new();
    // Folder of Embree, as found by `embree4-sys`. Empty if it is a system folder, unset if the
    // feature is off.
    folders.extend(env::var("DEP_EMBREE4_RPATH").ok().filter(|folder| !folder.is_empty()));
    // Folder of Open Image Denoise in which the oidn crate searches. A system folder needs no
    // entry.
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
