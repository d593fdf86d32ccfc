//! Recognition of shapes in meshes: connected components, rectangles, window panes, and hulls around
//! lamps.

mod components;
mod lamp_hulls;
mod panes;
mod rectangles;

pub(super) use components::{components, welded};
pub(crate) use lamp_hulls::HullHit;
pub(super) use lamp_hulls::{around_disk, around_sphere};
pub use panes::Panes;
pub(super) use panes::{FlatPanes, max_thickness};
pub(super) use rectangles::{Part, parts};
