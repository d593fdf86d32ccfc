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

    /// Columns and rows of all pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        (self.min.y..self.max.y).flat_map(move |y| (self.min.x..self.max.x).map(move |x| UVec2::new(x, y)))
    }
}

/// A block of pixels that one task works on at a time.
#[derive(Clone, Debug)]
pub struct Tile {
    bounds: Rect,
    pixels: Vec<Accumulator>,
}

impl Tile {
    pub(super) fn new(bounds: Rect) -> Self {
        Self {
            bounds,
            pixels: vec![Accumulator::default(); bounds.area() as usize],
        }
    }

    /// Its place in the image.
    pub fn bounds(&self) -> Rect {
        self.bounds
    }

    /// Each pixel's coordinates and sums, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.bounds.pixels().zip(&self.pixels)
    }

    /// Each pixel's coordinates and sums, row by row.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = (UVec2, &mut Accumulator)> {
        self.bounds.pixels().zip(&mut self.pixels)
    }
}
