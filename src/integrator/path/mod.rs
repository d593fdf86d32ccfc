//! Paths from the camera: the path tracer, its variants and simpler relatives.

pub(crate) mod ambient_occlusion;
pub(crate) mod debug;
pub(crate) mod direct;
pub(crate) mod distributed;
pub(crate) mod integrator;
pub(crate) mod naive;
pub(crate) mod reuse;
pub(crate) mod roulette;
pub(crate) mod strategy;
pub(crate) mod whitted;
