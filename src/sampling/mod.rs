//! From uniform variates to values and densities. No random numbers are made here, and no scene is known.

mod alias;
pub mod mis;
pub mod warp;

pub use alias::AliasTable;
