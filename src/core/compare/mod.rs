//! Comparison of images: errors against a reference (`metrics`), FLIP (`flip`), and significance
//! tests of a difference (`significance`).

mod flip;
mod metrics;
mod significance;

pub use flip::{Exposures, Flip};
pub use metrics::{Errors, SizeMismatch, relative_differences};
pub use significance::{CommonErrors, ExtremeTest, MIN_RARE, Noise, Scale, Significance, pixel_scores};

/// Difference of `image` and `reference`, relative to `reference`: 0 if both are 0, and infinite if
/// only `reference` is 0.
fn relative_change(reference: f64, image: f64) -> f64 {
    if image == reference {
        0.0
    } else {
        // Adding 0 turns a reference of −0 into 0.
        (image - reference) / (reference + 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::relative_change;

    #[test]
    fn relative_change_of_zeros_is_zero() {
        assert_eq!(relative_change(2.0, 2.5), 0.25);
        assert_eq!(relative_change(2.0, 1.0), -0.5);
        assert_eq!((relative_change(0.0, 0.0), relative_change(0.0, -0.0)), (0.0, 0.0));
        assert_eq!(relative_change(-0.0, 1.0), f64::INFINITY);
        assert_eq!(relative_change(0.0, -1.0), f64::NEG_INFINITY);
    }
}
