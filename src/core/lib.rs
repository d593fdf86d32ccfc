//! The renderer of Embrasure, below scene files and the command line: scenes in memory, ray queries, light transport, and formats of files.
//!
//! It is a crate of its own so that it is compiled with full optimisation beside all that renders nothing, which is not. The crate `embrasure` re-exports
//! every module under its name, and is what programs depend on; what may change with which version is said there.
//!
//! From the ground up; a module imports only modules above it in this list. docs/architecture.md says more of each.
//!
//! - [`math`], [`color`], [`sampling`], [`sampler`]: numbers, colours, warps and random numbers
//! - [`parameter`]: how a value that a user can set is read, written, checked and described
//! - [`geometry`], [`texture`], [`bsdf`], [`material`], [`light`], [`camera`], [`film`]: what a picture is made of
//! - [`scene`], [`denoise`], [`compare`]: the frozen scene, denoisers, and errors of a picture
//! - [`accel`]: ray queries over the scene
//! - [`integrator`], [`guess`]: light transport of one pixel sample, or of one iteration; what is guessed of a scene that does not say it
//! - [`options`]: everything that a user can set
//! - [`render`], [`io`]: passes and tiles, and formats of files
//! - [`lint`]: checks of a scene
//! - [`method`]: a method over a backend, chosen once before the first ray

pub mod accel;
pub mod bsdf;
pub mod camera;
pub mod color;
pub mod compare;
pub mod denoise;
pub mod files;
pub mod film;
pub mod geometry;
pub mod guess;
pub mod integrator;
pub mod io;
pub mod light;
pub mod light_paths;
pub mod lint;
pub mod material;
pub mod math;
pub mod method;
pub mod options;
pub mod parameter;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod texture;
