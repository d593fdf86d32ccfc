//! The project itself: its guide, its layers, its oldest compiler, and the comparison suite.

mod guide;
mod layers;
mod rust_version;
mod suite;
