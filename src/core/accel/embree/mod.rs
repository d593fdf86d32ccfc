//! Intel Embree 4. All `unsafe` code of this crate is in this folder.
//!
//! - bindgen reads the headers of the library. `device` checks the loaded library: it must have the
//!   major version of the headers and not be older. `handles` owns Embree's objects, `scene` builds
//!   Embree scenes, and `query` and `packet` trace rays.
//! - The version number of a library does not tell its build options. To test these options,
//!   `probe` traces three rays on each new device.
//! - Errors are checked after each call of a build, but not after a ray.
//! - Scenes are built with high quality and the robust flag. Without the flag, rays pass between
//!   triangles. Medium quality is slower (docs/notebook/2026-11.md, "Single steps").
//! - Embree reads vertices and indices from the arrays of the scene, without a copy. A `Vec3` has
//!   the 16 bytes that Embree loads for a vertex.
//! - A deforming mesh has two vertex buffers, and moving placements are time steps. Each prototype
//!   is an Embree scene.
//! - Rays are stored in 16-byte words, as Embree loads them. If rays were stored field by field,
//!   every query would have a store-forwarding stall (3.5 % of the time of a render).
//! - Embree's ray interval is closed, the interval of a `Ray` is open. The wrapper therefore moves
//!   both ends inwards to the next float. The lower end is at least the smallest positive normal
//!   number, so that a ray does not hit the surface at its origin.
//! - For the same ray and triangle, the last digit of `t` may differ between single rays, packets
//!   and occlusion (measured with AVX-512 and motion).
//! - If the projected triangle is tiny (10⁻¹⁸ square units), Embree's barycentrics are both −0. The
//!   wrapper then computes the barycentrics in f64.
//! - Before a build, the memory that the loader has freed returns to the system (`free_memory`).
//!   The C library would keep it beside the memory of Embree.
//!
//! Embree calls back into Rust in one place only: the memory monitor, which counts bytes during
//! builds.

#![allow(unsafe_code)]

mod device;
mod free_memory;
mod handles;
mod packet;
mod probe;
mod query;
mod raw;
mod ray;
mod scene;

pub use device::{Device, EmbreeError};
pub use raw::{raw_hits, raw_occlusions};
pub use scene::EmbreeAccel;

/// Name of the backend on the command line.
pub const NAME: &str = "embree";
