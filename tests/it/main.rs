//! Tests of the whole library and of the program, in one test program, which links once. Each
//! subject has a folder, each part of it a module. `cargo test --test it bsdf::` runs one module.
//!
//! Some tests are separate programs beside this folder, for one of three reasons. They measure the
//! memory of their process. Or they start scripts that they have just written, which fails while
//! another thread starts a process. Or they run by the thousand in release builds.

#[path = "../support/chi_square.rs"]
mod chi_square;
#[path = "../support/mod.rs"]
mod support;

mod commands;
mod files;
mod lighting;
mod materials;
mod pictures;
mod project;
mod rays;
mod transport;
