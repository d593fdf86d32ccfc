//! Intel Embree 4. All `unsafe` code of this crate is in this folder.
//!
//! Embree never calls back into Rust while rays are traced; the one callback counts bytes during builds.

#![allow(unsafe_code)]

mod device;
mod packet;
mod probe;
mod raw;
mod scene;

pub use device::{Device, EmbreeError};
pub use raw::{raw_hits, raw_occlusions};
pub use scene::EmbreeAccel;

/// The name users type.
pub const NAME: &str = "embree";
