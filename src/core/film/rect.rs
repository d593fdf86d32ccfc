//! Rectangles of pixels.

use crate::math::{UVec2, encode_fields};

/// A half-open rectangle of pixels, origin at the top left of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// First column and row.
    pub min: UVec2,
    /// Column and row after the last.
    pub max: UVec2,
}

encode_fields!(Rect { min, max });

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

    /// Returns true if the rectangle is not empty and inside an image of `resolution` pixels.
    pub fn is_inside(self, resolution: UVec2) -> bool {
        self.area() > 0 && self.max.cmple(resolution).all()
    }

    /// Returns true if `pixel` is in the rectangle.
    pub fn contains(self, pixel: UVec2) -> bool {
        pixel.cmpge(self.min).all() && pixel.cmplt(self.max).all()
    }

    /// Pixels in both rectangles.
    pub fn intersection(self, other: Self) -> Self {
        Self {
            min: self.min.max(other.min),
            max: self.max.min(other.max),
        }
    }

    /// The rectangle moved right and down by `by` pixels.
    pub(crate) fn moved(self, by: UVec2) -> Self {
        Self {
            min: self.min.saturating_add(by),
            max: self.max.saturating_add(by),
        }
    }

    /// The rectangle moved left and up by `by` pixels.
    pub(crate) fn moved_back(self, by: UVec2) -> Self {
        Self {
            min: self.min.saturating_sub(by),
            max: self.max.saturating_sub(by),
        }
    }

    /// Index of `pixel`, row by row; `None` outside the rectangle.
    pub(super) fn index(self, pixel: UVec2) -> Option<usize> {
        self.contains(pixel).then(|| {
            let at = pixel - self.min;
            (at.y * self.size().x + at.x) as usize
        })
    }

    /// Columns and rows of all pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        (self.min.y..self.max.y).flat_map(move |y| (self.min.x..self.max.x).map(move |x| UVec2::new(x, y)))
    }
}
