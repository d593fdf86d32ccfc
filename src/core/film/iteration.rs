//! An iteration of a method whose light paths may contribute to any pixel. It is one sample of
//! every pixel of a film.

use super::{Block, Film, FilmSample, FirstSurface, LightPaths, PixelBlock, Rect};
use crate::color::Spectrum;
use crate::math::UVec2;

/// One sample of every pixel of a film. Each light path can add light to any pixel.
#[derive(Clone, Debug)]
pub struct Iteration {
    crop: Rect,
    /// Pixels, row by row.
    pixels: Vec<IterationPixel>,
    /// Number of separately summed parts of the light, plus the number of classes of light paths.
    /// `part_sums` holds the sums of all of them, pixel by pixel.
    parts: usize,
    part_sums: Vec<[f64; 3]>,
    /// Fraction of the background's light in the sample of each pixel; empty if the film does not
    /// sum this fraction.
    background: Vec<[f64; 3]>,
}

/// Sums of one sample of a pixel so far.
#[derive(Clone, Copy, Debug, Default)]
struct IterationPixel {
    radiance: [f64; 3],
    surface: Option<FirstSurface>,
    is_on_line: bool,
}

impl Iteration {
    /// Iteration without any light yet, for the pixels of `film`.
    pub fn of(film: &Film) -> Self {
        let crop = film.crop();
        let parts = film.parts_before_paths() + film.light_paths().map_or(0, LightPaths::classes);
        Self {
            crop,
            pixels: vec![IterationPixel::default(); crop.area() as usize],
            parts,
            part_sums: vec![[0.0; 3]; crop.area() as usize * parts],
            background: match film.backing() {
                Some(_) => vec![[0.0; 3]; crop.area() as usize],
                None => Vec::new(),
            },
        }
    }

    /// Pixels of the iteration.
    pub fn crop(&self) -> Rect {
        self.crop
    }

    /// Adds radiance to `pixel`. Does nothing if `pixel` is outside the crop. Sums depend on the
    /// order of the calls in their last bits, so callers must add in a fixed order.
    pub fn add(&mut self, pixel: UVec2, radiance: Spectrum) {
        let Some(index) = self.index(pixel) else { return };
        add(&mut self.pixels[index].radiance, radiance);
    }

    /// Adds radiance to one part of the light of `pixel`, not to its total.
    pub fn add_to_part(&mut self, pixel: UVec2, part: usize, radiance: Spectrum) {
        let index = self.index(pixel).filter(|_| part < self.parts);
        if let Some(index) = index {
            add(&mut self.part_sums[index * self.parts + part], radiance);
        }
    }

    /// Sets the first surface of the sample of `pixel`.
    pub fn see(&mut self, pixel: UVec2, surface: FirstSurface) {
        if let Some(index) = self.index(pixel) {
            self.pixels[index].surface = Some(surface);
        }
    }

    /// Marks the sample of `pixel` as a sample on a line of a drawing.
    pub fn draw(&mut self, pixel: UVec2) {
        if let Some(index) = self.index(pixel) {
            self.pixels[index].is_on_line = true;
        }
    }

    /// Sets the fraction of the background's light in the sample of `pixel`.
    pub fn see_background(&mut self, pixel: UVec2, share: [f64; 3]) {
        let index = self.index(pixel);
        if let Some(value) = index.and_then(|index| self.background.get_mut(index)) {
            *value = share;
        }
    }

    /// Sets `sample` to the sample of `pixel`.
    pub(super) fn pixel(&self, pixel: UVec2, sample: &mut PixelBlock) {
        sample.clear();
        let Some(index) = self.index(pixel) else { return };
        let IterationPixel {
            radiance,
            surface,
            is_on_line,
        } = &self.pixels[index];
        let surface = surface.as_ref();
        sample.add(&FilmSample {
            surface,
            is_on_line: *is_on_line,
            ..FilmSample::default()
        });
        sample.light = Block::alone(*radiance, surface);
        let sums = &self.part_sums[index * self.parts..(index + 1) * self.parts];
        let (parts, classes) = sums.split_at(sample.parts.sums().len());
        sample.parts.set(parts);
        sample.classes.set(classes);
        sample.background = self.background.get(index).copied().unwrap_or_default();
    }

    fn index(&self, pixel: UVec2) -> Option<usize> {
        self.crop.contains(pixel).then(|| {
            let at = pixel - self.crop.min;
            (at.y * self.crop.size().x + at.x) as usize
        })
    }
}

fn add(sum: &mut [f64; 3], values: Spectrum) {
    for (sum, value) in sum.iter_mut().zip(values.to_array()) {
        *sum += value as f64;
    }
}
