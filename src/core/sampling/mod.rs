//! From uniform variates to values and densities. No random numbers are made here, and no scene is known.

mod alias;
pub mod distribution;
pub mod mis;
pub mod spherical_rectangle;
pub mod spherical_triangle;
pub mod warp;
mod wavelengths;

pub use alias::AliasTable;
pub use wavelengths::Wavelength;
