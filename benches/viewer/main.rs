//! Measures `embrasure view`, and makes screenshots for the guide:
//!
//! ```text
//! cargo bench --bench viewer -- figures [SCENE...]
//! cargo bench --bench viewer -- screenshots FOLDER
//! ```
//!
//! Figures need an idle machine, and a build that optimises this package too: `--config
//! profile.release.package.embrasure.opt-level=1`. Screenshots need Chromium.

#![allow(missing_docs)] // The modules of tests/view also allow missing documentation.

#[path = "../../tests/view/chromium.rs"]
#[allow(dead_code)] // Each program uses only a part of these shared modules.
mod chromium;
#[path = "../../tests/view/coding.rs"]
mod coding;
mod figures;
#[path = "../../tests/view/link.rs"]
mod link;
mod screenshots;
#[path = "../../tests/support/mod.rs"]
mod support;
#[path = "../../tests/view/viewer.rs"]
#[allow(dead_code)]
mod viewer;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

fn main() -> ExitCode {
    // `cargo bench` adds the flag `--bench`, which is meant for test harnesses, and starts the
    // program in the folder of the package.
    let words: Vec<String> = std::env::args().skip(1).filter(|word| word != "--bench").collect();
    match words.split_first() {
        Some((what, scenes)) if what == "figures" => figures::print(scenes),
        Some((what, [folder])) if what == "screenshots" => {
            let folder = PathBuf::from(folder);
            assert!(Path::new(&folder).is_dir(), "{}: no such folder", folder.display());
            screenshots::write(&folder);
        }
        _ => {
            eprintln!("usage: cargo bench --bench viewer -- figures [SCENE...] | screenshots FOLDER");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}
