//! Linear colours of light (`spectrum`), and their conversion for displays.

pub mod false_color;
mod spectrum;
pub mod srgb;
pub mod tone;
mod written;
pub mod xyz;

pub use spectrum::{Spectrum, luminance};
pub use tone::{Curve, Exposure, Tone};
pub use written::WRITTEN_COLORS;
