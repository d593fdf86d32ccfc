//! Metropolis light transport: Markov chains whose states are paths.
//!
//! `pssmlt` mutates the random numbers that make a path, and `mlt` mutates paths. `options` has the
//! options of both integrators. `importance_image` makes chains visit dark places as often as
//! bright places. `pssmlt` and `mlt` implement `IterationIntegrator`. Each iteration has separate
//! start paths and chains, and is an unbiased estimate. So a render is bit-identical for any split
//! into iterations. The disadvantage is that chains are short.
//!
//! By default, path tracing finds direct light, and lamps seen in mirrors and through glass
//! (`OrdinaryLight`). If all light is easy to find, Metropolis sampling has no advantage (Veach and
//! Guibas 1997), and puts most of its samples at lamps. With `--metropolis-direct metropolis`,
//! chains find all light. In the scene `globe`, the lamp has three quarters of the image's light in
//! a dozen pixels. The mean light of these pixels was then between a quarter and twice the correct
//! value.
//!
//! The errors of neighbouring pixels are correlated, because a chain that stays near one pixel
//! brightens the neighbouring pixels. The variance channel is correct for each pixel separately.
//! `embrasure compare` assumes the worst case, that all pixels of a tile have common errors.
//! `tests/it/transport/metropolis.rs` compares regions by their variance over iterations.
//!
//! docs/notebook/2026-11.md, "Metropolis light transport", has the figures behind the defaults.

pub(crate) mod importance_image;
pub(crate) mod mlt;
pub(crate) mod options;
pub(crate) mod pssmlt;
pub(crate) mod visits;
