//! The laboratory: commands that measure, test and explain estimators. `lab` compares estimators on
//! a scene, `points` sampling patterns, and `bench` backends. `selftest` renders scenes with known
//! results, and `explain` shows the BSDF of a material.
//!
//! Other commands do not use these modules (`tests/it/project/layers.rs`). The laboratory uses the
//! modules of `cli` and also lower layers of the library.

mod bench;
mod explain;
mod lab;
mod points;
mod selftest;

pub(super) use bench::bench;
pub(super) use explain::explain;
pub(super) use lab::lab;
pub(super) use points::points;
pub(super) use selftest::selftest;
