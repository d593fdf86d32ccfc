//! Integrators that trace paths from the camera: the path tracer, its variants, and simpler
//! methods.
//!
//! `integrator` is the path tracer; `reuse` shares paths between pixels. Both use `state` (a path
//! between two vertices), `direct` (direct light at a vertex), `strategy` (sampling of directions
//! and of direct light) and `roulette`. The other modules are simpler estimators of the same light,
//! built from the same modules: docs/guide/explanation/estimators.md compares them. `whitted` and
//! `distributed` share `tree`.

pub(crate) mod ambient_occlusion;
pub(crate) mod area;
mod camera_packet;
pub(crate) mod debug;
pub(crate) mod direct;
pub(crate) mod distributed;
pub(crate) mod integrator;
pub(crate) mod naive;
pub(crate) mod one_sample;
pub(crate) mod reuse;
pub(crate) mod roulette;
mod shadow_catcher;
pub(crate) mod simple;
pub(crate) mod state;
pub(crate) mod strategy;
pub(crate) mod surface_areas;
mod tree;
pub(crate) mod whitted;
