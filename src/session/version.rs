//! Name of the build, and versions of the program's components.
//!
//! `build.rs` computes the name: a SHA-256 of the sources, `Cargo.lock`, the compiler's version and
//! the target processor. The name does not depend on git or on the folder of the sources. Results
//! of different builds may differ in some bits, so `--resume` and `merge` reject files of another
//! build, with help.

#[cfg(feature = "obvhs")]
use crate::accel::bvh;
#[cfg(feature = "embree")]
use crate::accel::embree;
use std::collections::BTreeSet;
use std::fs;

/// Name of this build: a hash of its sources and of the compiler options (`build.rs`). Results of
/// different builds may differ in some bits.
pub const BUILD: &str = env!("EMBRASURE_BUILD");

/// Text with the name, version and build of this program, the backends that are built in, and the
/// paths of libraries. Each is on a separate line.
pub fn version_text() -> String {
    let mut text = format!("embrasure {} (build {BUILD})", env!("CARGO_PKG_VERSION"));
    #[cfg(feature = "embree")]
    match embree::Device::new(1) {
        Ok(device) => text += &format!("\nbackend embree {} ({})", device.version(), device.isa()),
        Err(error) => text += &format!("\nbackend embree: {error}"),
    }
    #[cfg(feature = "obvhs")]
    {
        text += &format!("\nbackend obvhs {} (pure Rust)", bvh::VERSION);
    }
    text += "\nbackend brute (every triangle against every ray, for checks)";
    for library in libraries() {
        text += &format!("\nlibrary {library}");
    }
    text
}

/// Paths of the libraries Embree and Open Image Denoise that the process has loaded, if the system
/// lists them.
fn libraries() -> BTreeSet<String> {
    const NAMES: [&str; 2] = ["libembree4", "libOpenImageDenoise.so"];
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let paths = maps
        .lines()
        .filter_map(|line| line.find('/').map(|start| &line[start..]));
    let is_named = |path: &&str| {
        let name = path.rsplit('/').next().unwrap_or_default();
        NAMES.iter().any(|known| name.starts_with(known))
    };
    paths.filter(is_named).map(String::from).collect()
}
