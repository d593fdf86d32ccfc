//! The renderer of Embrasure, below scene files and the command line: scenes in memory, ray
//! queries, light transport, and file formats.
//!
//! It is a separate crate, so that it is compiled with full optimisation, unlike the code that does
//! not render. The crate `embrasure` re-exports every module under its name. Programs depend on
//! that crate; its documentation has the rules for changes between versions.
//!
//! Modules are listed from the lowest layer to the highest. A module imports only modules that are
//! above it in this list. docs/architecture.md describes each module.
//!
//! - [`math`], [`color`], [`sampling`], [`sampler`]: numbers, colours, warps and random numbers
//! - [`parameter`]: reading, writing, checking and describing a value that a user can set
//! - [`geometry`], [`texture`], [`bsdf`], [`material`], [`light`], [`camera`]: the elements of a
//!   scene
//! - [`light_sampling`], [`light_paths`], [`film`]: the choice of a light, classes of light paths,
//!   and the film that sums the pixels
//! - [`scene`], [`denoise`], [`compare`]: the immutable scene, denoisers, and errors of an image
//! - [`accel`]: ray queries over the scene
//! - [`integrator`], [`guess`]: light transport of one pixel sample, or of one iteration; guesses
//!   of missing settings of a scene
//! - [`options`]: everything that a user can set
//! - [`render`], [`io`]: passes and tiles, and file formats
//! - [`lint`]: checks of a scene
//! - [`pipeline`]: the integrator of a render, combined with a ray-tracing backend before the first
//!   ray

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
pub mod light_sampling;
pub mod lint;
pub mod material;
pub mod math;
pub mod options;
pub mod parameter;
pub mod pipeline;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod texture;
