//! Errors of an image against a reference: bias, MSE, relMSE and PSNR.

use super::relative_change;
use crate::color::{Spectrum, srgb};
use crate::film::RgbImage;
use thiserror::Error;

/// Constant in the divisor of relative squared errors, which is the squared reference plus this
/// constant, in squared radiance. Without the constant, dark pixels would dominate.
const DARK: f64 = 0.01;

/// Errors of an image against a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Mean of the image, by channel.
    pub mean: [f64; 3],
    /// Mean of the reference, by channel.
    pub reference_mean: [f64; 3],
    /// Mean squared difference over pixels and channels.
    pub mse: f64,
    /// Mean over channels and pixels of `(x − ref)² / (ref² + 0.01)`, without the worst 0.1 % of
    /// the pixels, because such outliers would dominate the mean.
    pub rel_mse: f64,
    /// [`Errors::rel_mse`] of the means of square blocks with edges of [`Errors::BLOCKS`] pixels.
    /// This is the error at low spatial frequencies. It remains after a denoiser or the eye has
    /// averaged neighbouring pixels. Blocks at the right and lower borders are smaller.
    pub block_rel_mse: [f64; 3],
    /// Mean squared difference over pixels and channels of displayed values: clamped to [0, 1] and
    /// encoded as sRGB.
    pub display_mse: f64,
}

/// Fraction of the pixels that [`Errors::rel_mse`] includes.
const KEPT: f64 = 0.999;

/// Error for images of different sizes.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("the image has {}x{} pixels, but the reference has {}x{}", image[0], image[1], reference[0], reference[1])]
pub struct SizeMismatch {
    image: [usize; 2],
    reference: [usize; 2],
}

impl Errors {
    /// Edges in pixels of the blocks of [`Errors::block_rel_mse`].
    pub const BLOCKS: [usize; 3] = [4, 16, 64];

    /// Errors of `image` against `reference`.
    pub fn new(image: &RgbImage, reference: &RgbImage) -> Result<Self, SizeMismatch> {
        same_size(image, reference)?;
        let pairs = || image.pixels.iter().zip(&reference.pixels);
        let per_pixel = |f: fn(f64, f64) -> f64| {
            let channels = move |(x, r): (&[f32; 3], &[f32; 3])| -> f64 {
                (0..3).map(|c| f(x[c] as f64, r[c] as f64)).sum::<f64>() / 3.0
            };
            pairs().map(channels).collect::<Vec<f64>>()
        };
        let squares = per_pixel(|x, r| (x - r).powi(2));
        let shown = per_pixel(|x, r| (srgb::encode(x as f32) as f64 - srgb::encode(r as f32) as f64).powi(2));
        Ok(Self {
            mean: mean(image),
            reference_mean: mean(reference),
            mse: average(&squares),
            rel_mse: rel_mse(&image.pixels, &reference.pixels),
            block_rel_mse: Self::BLOCKS
                .map(|edge| rel_mse(&means_of_blocks(image, edge), &means_of_blocks(reference, edge))),
            display_mse: average(&shown),
        })
    }

    /// Mean of the image minus mean of the reference, by channel.
    pub fn bias(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| self.mean[c] - self.reference_mean[c])
    }

    /// Bias relative to the reference's mean: 0 if both means are 0, and infinite if only the
    /// reference's mean is 0.
    pub fn relative_bias(&self) -> [f64; 3] {
        [0, 1, 2].map(|c| relative_change(self.reference_mean[c], self.mean[c]))
    }

    /// Peak signal-to-noise ratio in decibels, `−10 log10` of [`Errors::display_mse`]. The peak is
    /// 1, the display's white, because linear light has no peak. Infinite if the displayed values
    /// are equal.
    pub fn psnr(&self) -> f64 {
        -10.0 * self.display_mse.log10()
    }
}

/// Differences of luminance by pixel, scaled as in [`Errors::rel_mse`]: `(Y − Yref) / (Yref² +
/// 0.01)^(1/2)`.
pub fn relative_differences(image: &RgbImage, reference: &RgbImage) -> Vec<f32> {
    let luminance = |p: &[f32; 3]| Spectrum::from(*p).luminance();
    let pairs = image.pixels.iter().zip(&reference.pixels);
    let difference = |(x, r): (f32, f32)| (x - r) / (r * r + DARK as f32).sqrt();
    pairs.map(|(x, r)| difference((luminance(x), luminance(r)))).collect()
}

/// Returns an error unless both images have the same size.
pub(super) fn same_size(image: &RgbImage, reference: &RgbImage) -> Result<(), SizeMismatch> {
    let sizes = [image, reference].map(|i| [i.width, i.height]);
    if sizes[0] == sizes[1] && image.pixels.len() == reference.pixels.len() {
        return Ok(());
    }
    Err(SizeMismatch {
        image: sizes[0],
        reference: sizes[1],
    })
}

/// Mean over channels and pixels of `(x − ref)² / (ref² + 0.01)`, without the worst pixels.
fn rel_mse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let error = |x: f32, r: f32| {
        let (x, r) = (f64::from(x), f64::from(r));
        (x - r).powi(2) / (r * r + DARK)
    };
    let pairs = image.iter().zip(reference);
    let mut errors: Vec<f64> = pairs
        .map(|(x, r)| (0..3).map(|c| error(x[c], r[c])).sum::<f64>() / 3.0)
        .collect();
    errors.sort_by(f64::total_cmp);
    errors.truncate((errors.len() as f64 * KEPT).ceil() as usize);
    average(&errors)
}

/// Means of the pixels of square blocks, row by row.
fn means_of_blocks(image: &RgbImage, edge: usize) -> Vec<[f32; 3]> {
    let columns = image.width.div_ceil(edge);
    let mut sums = vec![([0.0f64; 3], 0u32); columns * image.height.div_ceil(edge)];
    for (i, pixel) in image.pixels.iter().enumerate() {
        let (x, y) = (i % image.width, i / image.width);
        let (sum, count) = &mut sums[y / edge * columns + x / edge];
        for (sum, value) in sum.iter_mut().zip(pixel) {
            *sum += f64::from(*value);
        }
        *count += 1;
    }
    let mean = |(sum, count): ([f64; 3], u32)| sum.map(|sum| (sum / f64::from(count.max(1))) as f32);
    sums.into_iter().map(mean).collect()
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn mean(image: &RgbImage) -> [f64; 3] {
    [0, 1, 2].map(|c| image.pixels.iter().map(|p| p[c] as f64).sum::<f64>() / image.pixels.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: Vec<[f32; 3]>) -> RgbImage {
        RgbImage {
            width: pixels.len(),
            height: 1,
            pixels,
        }
    }

    #[test]
    fn errors_equal_values_by_hand() {
        let reference = image(vec![[1.0, 0.0, 0.3]; 2000]);
        let mut pixels = vec![[1.0, 0.1, 0.3]; 2000];
        pixels[7] = [1e6; 3];
        let errors = Errors::new(&image(pixels), &reference).unwrap();
        // Expected value: (0.1² / 0.01) / 3. The bright pixel is one of the two worst pixels, which
        // are left out.
        assert!((errors.rel_mse - 1.0 / 3.0).abs() < 1e-6, "{errors:?}");
        assert!(errors.mse > 1e8);
        assert_eq!(errors.reference_mean[0], 1.0);
        assert!((errors.mean[0] - 500.9995).abs() < 1e-9);
    }

    /// A checkerboard of ±0.1 has no error in the means of blocks. A square that differs by 0.1
    /// causes an error in the blocks that it covers.
    #[test]
    fn block_error_is_the_error_of_block_means() {
        let picture = |value: fn(usize, usize) -> f32| RgbImage {
            width: 80,
            height: 40,
            pixels: (0..80 * 40).map(|i| [value(i % 80, i / 80); 3]).collect(),
        };
        let reference = picture(|_, _| 0.3);
        let noise = picture(|x, y| if (x + y) % 2 == 0 { 0.4 } else { 0.2 });
        let errors = Errors::new(&noise, &reference).unwrap();
        assert!((errors.rel_mse - 0.1).abs() < 1e-4, "{errors:?}");
        assert!(errors.block_rel_mse.iter().all(|error| *error < 1e-9), "{errors:?}");
        let stain = picture(|x, y| if x < 16 && y < 16 { 0.4 } else { 0.3 });
        let [small, middle, large] = Errors::new(&stain, &reference).unwrap().block_rel_mse;
        // The square covers 16 of 200 small blocks, 1 of 15 middle blocks, and a tenth of the first
        // of two large blocks. The large blocks have 64 × 40 and 16 × 40 pixels.
        assert!((small - 0.1 * 16.0 / 200.0).abs() < 1e-5, "{small}");
        assert!((middle - 0.1 / 15.0).abs() < 1e-5, "{middle}");
        let share = 256.0 / (64.0 * 40.0);
        assert!((large - 0.1 * share * share / 2.0).abs() < 1e-5, "{large}");
    }

    #[test]
    fn bias_and_psnr_equal_values_by_hand() {
        // The sRGB code of 0.5 is 0.735357; values above 1 become 1.
        let (a, b) = (image(vec![[1.0, 0.5, 2.0]; 10]), image(vec![[1.0, 1.0, 4.0]; 10]));
        let errors = Errors::new(&a, &b).unwrap();
        assert_eq!(
            (errors.bias(), errors.relative_bias()),
            ([0.0, -0.5, -2.0], [0.0, -0.5, -0.5])
        );
        let expected = -10.0 * ((1.0f64 - 0.735_357).powi(2) / 3.0).log10();
        assert!((errors.psnr() - expected).abs() < 1e-4, "{}", errors.psnr());
        assert_eq!(Errors::new(&a, &a).unwrap().psnr(), f64::INFINITY);
    }

    #[test]
    fn sizes_must_agree() {
        let error = Errors::new(&image(vec![[0.0; 3]; 2]), &image(vec![[0.0; 3]; 3])).unwrap_err();
        assert_eq!(error.to_string(), "the image has 2x1 pixels, but the reference has 3x1");
    }
}
