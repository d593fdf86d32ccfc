//! Colour along paths, and its edge towards displays.

mod spectrum;
pub mod srgb;

pub use spectrum::Spectrum;
