//! Metropolis light transport: Markov chains of paths.

pub(crate) mod importance_image;
pub(crate) mod mlt;
pub(crate) mod options;
pub(crate) mod pssmlt;
