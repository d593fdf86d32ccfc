use crate::cli::error::CliError;
use crate::compare::Noise;
use crate::film::{Rect, RgbImage};
use crate::io::{FileError, Rendering, read_rendering};
use std::path::Path;

/// Two images, cropped to their common pixels. Values that are not finite are replaced by black.
pub(super) struct Pair {
    pub window: Rect,
    pub resolution: [u32; 2],
    pub reference: Rendering,
    pub image: Rendering,
    /// Number of pixels with values that are not finite, in the reference and in the image.
    pub not_finite: [usize; 2],
    /// True if the pixels are bit-identical.
    pub is_identical: bool,
    /// True if a file has integer samples. The values of both images are then clamped to the range
    /// of a display, 0 to 1.
    pub is_display: bool,
}

impl Pair {
    /// Reads both images.
    ///
    /// # Errors
    ///
    /// Unreadable files, and images of different sizes or without common pixels.
    pub fn read(reference: &Path, image: &Path) -> Result<Self, CliError> {
        Self::new((reference, read_rendering(reference)?), (image, read_rendering(image)?))
    }

    /// Crops two pictures to their common pixels. Errors use the names `reference` and `image`.
    ///
    /// # Errors
    ///
    /// Images of different sizes or without common pixels.
    pub fn new(
        (reference, mut first): (&Path, Rendering),
        (image, mut second): (&Path, Rendering),
    ) -> Result<Self, CliError> {
        let [a, b] = [first.resolution, second.resolution];
        if a != b {
            let message = format!(
                "has {}x{} pixels, but {} has {}x{}",
                b.x,
                b.y,
                reference.display(),
                a.x,
                a.y
            );
            let help =
                "compare images of the same size; for crops use EXR files, which store the size of the full image";
            return Err(FileError::new(image, message).help(help).into());
        }
        let window = first.window.intersection(second.window);
        if window.area() == 0 {
            let message = format!("has no pixel in common with {}", reference.display());
            return Err(FileError::new(image, message).help("compare crops that overlap").into());
        }
        let is_display = first.is_display || second.is_display;
        for rendering in [&mut first, &mut second] {
            if rendering.window != window {
                *rendering = rendering.cropped(window);
            }
        }
        let bits = |image: &RgbImage| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
        let is_identical = bits(&first.image) == bits(&second.image);
        for raw in [&mut first.raw, &mut second.raw].into_iter().flatten() {
            let wrong = |p: &[f32; 3]| !p.iter().all(|v| v.is_finite());
            raw.pixels.iter_mut().filter(|p| wrong(p)).for_each(|p| *p = [0.0; 3]);
        }
        let mut not_finite = [0; 2];
        let (pixels, others) = (&mut first.image.pixels, &mut second.image.pixels);
        for (a, b) in pixels.iter_mut().zip(others) {
            let wrong = [&*a, &*b].map(|p| !p.iter().all(|v| v.is_finite()));
            (0..2).for_each(|i| not_finite[i] += usize::from(wrong[i]));
            if wrong != [false; 2] {
                (*a, *b) = ([0.0; 3], [0.0; 3]);
            }
            if is_display {
                (*a, *b) = (a.map(|v| v.clamp(0.0, 1.0)), b.map(|v| v.clamp(0.0, 1.0)));
            }
        }
        Ok(Self {
            window,
            resolution: [a.x, a.y],
            reference: first,
            image: second,
            not_finite,
            is_identical,
            is_display,
        })
    }

    /// The images with their noise; `None` if the noise of either is unknown. Denoised images are
    /// returned as they were before the denoiser, because their variances belong to these values.
    pub fn noisy(&self) -> Option<[(&RgbImage, &Noise); 2]> {
        fn noisy(rendering: &Rendering) -> Option<(&RgbImage, &Noise)> {
            let Rendering { image, raw, noise, .. } = rendering;
            Some((raw.as_ref().unwrap_or(image), noise.as_ref()?))
        }
        Some([noisy(&self.reference)?, noisy(&self.image)?])
    }

    /// Returns true if a denoiser has changed one of the images.
    pub fn is_denoised(&self) -> bool {
        self.reference.raw.is_some() || self.image.raw.is_some()
    }
}
