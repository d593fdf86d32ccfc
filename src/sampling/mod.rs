//! From uniform variates to values and densities. No random numbers are made here, and no scene is known.

mod alias;
pub mod distribution;
pub mod mis;
pub mod spherical_triangle;
pub mod warp;

pub use alias::AliasTable;
