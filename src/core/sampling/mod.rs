//! Maps from uniform variates to sampled values and densities. This module does not make random
//! numbers and does not depend on the scene.

mod alias;
pub mod distribution;
pub mod mis;
pub mod spherical_rectangle;
pub mod spherical_triangle;
pub mod warp;
mod wavelengths;

pub use alias::AliasTable;
pub use wavelengths::Wavelength;
