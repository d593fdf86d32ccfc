//! Paths from the camera joined to paths from lights.

pub(crate) mod bdpt;
pub(crate) mod connection;
pub(crate) mod light_tracing;
pub(crate) mod subpath;
