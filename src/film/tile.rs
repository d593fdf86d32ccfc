use super::Accumulator;
use crate::math::UVec2;

/// A half-open rectangle of pixels, origin at the top left of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column and row.
    pub min: UVec2,
    /// One past the last column and row.
    pub max: UVec2,
}

impl Rect {
    /// The whole image of `resolution` pixels.
    pub fn full(resolution: UVec2) -> Self {
        Self {
            min: UVec2::ZERO,
            max: resolution,
        }
    }

    /// Columns and rows.
    pub fn size(self) -> UVec2 {
        self.max.saturating_sub(self.min)
    }

    /// Number of pixels.
    pub fn area(self) -> u64 {
        self.size().x as u64 * self.size().y as u64
    }

    /// Whether it holds at least a pixel and none outside an image of `resolution` pixels.
    pub fn is_inside(self, resolution: UVec2) -> bool {
        self.area() > 0 && self.max.cmple(resolution).all()
    }

    /// Whether `pixel` is one of it.
    pub fn contains(self, pixel: UVec2) -> bool {
        pixel.cmpge(self.min).all() && pixel.cmplt(self.max).all()
    }

    /// What both have.
    pub fn intersection(self, other: Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// Columns and rows of all pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        (self.min.y..self.max.y).flat_map(move |y| (self.min.x..self.max.x).map(move |x| UVec2::new(x, y)))
    }
}

/// A block of pixels that one task works on at a time.
#[derive(Clone, Debug)]
pub struct Tile {
    cell: Rect,
    bounds: Rect,
    pixels: Vec<Accumulator>,
}

impl Tile {
    /// The part of `cell` that is inside `crop`.
    pub(super) fn new(cell: Rect, crop: Rect) -> Self {
        let bounds = cell.intersection(crop);
        Self {
            cell,
            bounds,
            pixels: vec![Accumulator::default(); bounds.area() as usize],
        }
    }

    /// The block of the full image that it is of; a crop leaves a part of it.
    pub fn cell(&self) -> Rect {
        self.cell
    }

    /// Its place in the image.
    pub fn bounds(&self) -> Rect {
        self.bounds
    }

    /// Each pixel's coordinates and sums, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.bounds.pixels().zip(&self.pixels)
    }

    /// Samples that each pixel has.
    pub fn samples(&self) -> u32 {
        self.pixels.first().map_or(0, Accumulator::samples)
    }

    /// Mean over its pixels of [`Accumulator::squared_error`].
    pub fn error(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(Accumulator::squared_error).sum();
        sum / self.pixels.len().max(1) as f64
    }

    /// The sums of the pixel in this column and row of the image, if it is in the tile.
    pub fn sums_mut(&mut self, pixel: UVec2) -> Option<&mut Accumulator> {
        if !self.bounds.contains(pixel) {
            return None;
        }
        let at = pixel - self.bounds.min;
        self.pixels.get_mut((at.y * self.bounds.size().x + at.x) as usize)
    }
}
