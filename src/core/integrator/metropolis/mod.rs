//! Metropolis light transport: Markov chains of paths.
//!
//! `pssmlt` walks in the space of the random numbers that make a path, `mlt` in the space of paths. `options` has what both share, `importance_image`
//! their target. Both implement `IterationIntegrator`: an iteration has its own starting paths and chains and is unbiased by itself, so that a render has
//! the same bits however it is split. The price is that chains are short.
//!
//! Path tracing finds direct light, and lamps seen in mirrors and through glass (`OrdinaryLight`), by default. Metropolis sampling has no advantage
//! where all light is found anyway (Veach and Guibas 1997), and puts most of its samples where lamps are. `--metropolis-direct metropolis` leaves
//! all light to chains. On `globe`, whose lamp has three quarters of the picture's light in a dozen pixels, the mean of the lamp's light was then
//! between a quarter and twice what is right.
//!
//! The errors of neighbouring pixels are correlated, because a chain that stays somewhere brightens its neighbourhood. The variance channel is right
//! for each pixel by itself. `embrasure compare` lets all pixels of a tile have all of their errors in common, the worst case.
//! `tests/it/transport/metropolis.rs` judges regions by their variance over iterations.
//!
//! docs/benchmarks.md, "Metropolis light transport", has the figures behind the defaults.

pub(crate) mod importance_image;
pub(crate) mod mlt;
pub(crate) mod options;
pub(crate) mod pssmlt;
pub(crate) mod visits;
