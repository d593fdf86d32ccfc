//! Scene files, OBJ files and other input, also damaged and hostile.

mod awkward_obj;
mod fuzz_corpus;
mod hostile_files;
mod parts;
#[cfg(feature = "tobj")]
mod readers;
mod schema;
mod smoothing_groups;
mod specification;
pub mod subdivision;
mod told_repairs;
mod wires;
mod written_scenes;
