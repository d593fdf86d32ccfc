//! Intel Embree 4. All `unsafe` code of this crate is in this folder.
//!
//! - bindgen runs over the headers that belong to the library. The loaded library must have their major version and not be older; `device` checks
//!   that. `handles` owns what Embree makes, `scene` builds, and `query` and `packet` trace.
//! - The version does not say how a library was compiled, so `probe` traces three rays on each new device.
//! - Errors are asked for after each call of a build, never for a ray.
//! - Scenes are built with high quality and the robust flag: without it rays pass between triangles, and medium quality is slower
//!   (docs/benchmarks.md, "Single steps").
//! - Embree reads vertices and indices in the scene's arrays, which it borrows: a `Vec3` has the 16 bytes that Embree loads.
//! - A mesh that changes its shape has two vertex buffers, and placements are time steps. Each prototype is an Embree scene.
//! - Rays are stored in 16-byte words, as Embree loads them. Stored field by field, every query waited for its own stores, 3.5 % of a render.
//! - Embree's interval holds both ends. The wrapper moves them in by one float and starts at the smallest positive number at least, so that a surface
//!   on which a ray starts is not found.
//! - `t` of one hit may differ in its last digit between single rays, packets and occlusion (measured with AVX-512 and motion).
//! - Where a triangle is tiny as its ray sees it, of 10⁻¹⁸ square units, Embree's barycentrics are both −0; the wrapper then computes them in f64.
//!
//! Embree calls back into Rust in one place only, the memory monitor, which counts bytes while a scene is built.

#![allow(unsafe_code)]

mod device;
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

/// The name users type.
pub const NAME: &str = "embree";
