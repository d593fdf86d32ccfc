//! Estimators of light transport: means against closed forms and against each other, noise, and
//! bit-identical renders.

mod agreement;
mod bent_normals;
pub mod bidirectional;
mod closed_forms;
mod irradiance_cache;
mod iterations;
#[cfg(feature = "embree")]
mod masked_lamps;
mod metropolis;
mod mlt;
mod motion;
mod panes;
mod paths;
mod photons;
mod replays;
mod reuse;
