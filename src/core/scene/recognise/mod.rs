//! Recognition of shapes in meshes: connected components, rectangles and window panes.

mod components;
mod panes;
mod rectangles;

pub(super) use components::{components, welded};
pub use panes::Panes;
pub(super) use panes::{FlatPanes, max_thickness};
pub(super) use rectangles::{EmitterShape, parts};
