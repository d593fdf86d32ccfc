//! Density estimation: photons, and light paths to merge with.

pub(crate) mod density;
pub(crate) mod grid;
pub(crate) mod photon_map;
pub(crate) mod photons;
pub(crate) mod sppm;
pub(crate) mod tree;
pub(crate) mod vcm;
