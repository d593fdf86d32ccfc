//! Maps from uniform variates to values and densities. This module makes no random numbers and has
//! no scene.

mod alias;
pub mod distribution;
pub mod mis;
pub mod spherical_rectangle;
pub mod spherical_triangle;
pub mod warp;
mod wavelengths;

pub use alias::AliasTable;
pub use wavelengths::Wavelength;
