//! Embrasure: a production-style path tracer over Intel Embree 4.
//!
//! The rooms, from the ground up; imports run one way, towards the top of this list:
//!
//! - [`math`], [`color`], [`sampling`], [`sampler`]: numbers, colours, warps and where random numbers come from
//! - [`geometry`], [`texture`], [`bsdf`], [`material`], [`light`], [`camera`], [`film`]: what a picture is made of
//! - [`denoise`]: filters that take noise out of a picture
//! - [`scene`], [`accel`]: the frozen scene and the ray queries over it
//! - [`integrator`]: one pixel sample's light transport
//! - [`render`], [`io`]: passes and tiles, and files
//! - [`lint`], [`cli`]: what is likely not meant in a scene, and the command line

pub mod accel;
pub mod bsdf;
pub mod camera;
pub mod cli;
pub mod color;
pub mod denoise;
pub mod film;
pub mod geometry;
pub mod integrator;
pub mod io;
pub mod light;
pub mod lint;
pub mod material;
pub mod math;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scene;
pub mod texture;
