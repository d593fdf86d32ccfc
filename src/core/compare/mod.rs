//! Comparing images: errors against a reference (`metrics`), FLIP (`flip`), and significance tests of a difference (`significance`).

mod flip;
mod metrics;
mod significance;

pub use flip::{Exposures, Flip};
pub use metrics::{Errors, SizeMismatch, relative_differences};
pub use significance::{CommonErrors, Extreme, MIN_RARE, Noise, Scale, Significance, pixel_scores};
