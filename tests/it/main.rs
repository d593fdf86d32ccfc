//! The tests of the whole library and of the program, in one test program, which links once: a module for each subject. `cargo test --test it lights::`
//! runs those of one module.
//!
//! Tests stand in a program of their own, beside this folder, where they measure the memory of their process, start scripts that they have just
//! written (which fails while another thread starts a process), or run by the thousand in release builds.

#[path = "../support/chi_square.rs"]
mod chi_square;
#[path = "../support/mod.rs"]
mod support;

mod agreement;
mod aovs;
mod awkward_obj;
mod backends;
mod background;
mod bent_normals;
mod bidirectional;
mod bodies;
mod bsdf;
mod check;
mod closed_forms;
mod command_line;
mod compare;
mod denoise;
mod develop;
mod dispersion;
mod emission;
mod exr_files;
mod first_picture;
mod fuzz_corpus;
mod ground;
mod guess;
mod guide;
mod hostile_files;
mod irradiance_cache;
mod iterations;
mod lab;
mod layers;
mod library;
mod light_flags;
mod light_groups;
mod light_paths;
mod lights;
mod metropolis;
mod mlt;
mod motion;
mod mtl;
mod panes;
mod patches;
mod paths;
mod photons;
mod plots;
#[cfg(feature = "tobj")]
mod readers;
mod replays;
mod reuse;
mod rust_version;
mod schema;
mod shaped_lights;
mod small_lamps;
mod suite;
mod surfaces;
mod textures;
mod told_repairs;
mod visibility;
mod written_scenes;
