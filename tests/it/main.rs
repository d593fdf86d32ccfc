//! The tests of the whole library and of the program, in one test program, which links once: a folder
//! for each subject, with a module for each part of it. `cargo test --test it bsdf::` runs one module.
//!
//! Some tests stand in a program of their own, beside this folder: they measure the memory of their
//! process, or start scripts that they have just written, which fails while another thread starts a
//! process, or run by the thousand in release builds.

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
