//! How far pictures are from each other: errors against a reference, FLIP, and whether they differ by more than their noise.

mod flip;
mod metrics;
mod significance;

pub use flip::{Exposures, Flip};
pub use metrics::{Errors, SizeMismatch};
pub use significance::{CommonErrors, Extreme, LEAST_RARE, Noise, Scale, Significance, pixel_scores};
