//! Sums of samples per pixel. No files, no threads, no tone curve.

mod accumulator;
mod filter;
mod image;
mod metrics;
mod tile;

pub use accumulator::{Accumulator, BLOCK, FirstSurface};
pub use filter::{Filter, FilterKind};
pub use image::{Channel, Image, Z_BACKGROUND};
pub use metrics::{Errors, RgbImage, SizeMismatch};
pub use tile::{Rect, Tile};

use crate::math::UVec2;

/// Edge of a tile in pixels: its sums (28 KB) stay in the first-level cache while it is worked on.
const TILE_SIZE: u32 = 16;

/// The pixels of an image, or of a crop of it, as independent tiles.
#[derive(Clone, Debug)]
pub struct Film {
    resolution: UVec2,
    crop: Rect,
    tiles: Vec<Tile>,
}

impl Film {
    /// An empty film for the pixels in `crop` of an image of `resolution` pixels.
    ///
    /// # Panics
    /// If the crop is empty or not inside the image; callers validate it with [`Rect::is_inside`].
    pub fn new(resolution: UVec2, crop: Rect) -> Self {
        assert!(crop.is_inside(resolution), "crop {crop:?} outside {resolution}");
        // Tiles lie where they do in the full image, so that a crop has its pixels.
        let first = crop.min / TILE_SIZE * TILE_SIZE;
        let mut tiles = Vec::new();
        for y in (first.y..crop.max.y).step_by(TILE_SIZE as usize) {
            for x in (first.x..crop.max.x).step_by(TILE_SIZE as usize) {
                tiles.push(Tile::new(Self::cell(resolution, UVec2::new(x, y)), crop));
            }
        }
        Self {
            resolution,
            crop,
            tiles,
        }
    }

    /// The block of pixels, of an image of `resolution` pixels, that `pixel` is worked on with.
    pub fn cell(resolution: UVec2, pixel: UVec2) -> Rect {
        let min = pixel / TILE_SIZE * TILE_SIZE;
        let max = min.saturating_add(UVec2::splat(TILE_SIZE)).min(resolution);
        Rect { min, max }
    }

    /// Size of the full image.
    pub fn resolution(&self) -> UVec2 {
        self.resolution
    }

    /// The part of the image that this film holds.
    pub fn crop(&self) -> Rect {
        self.crop
    }

    /// All tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Each pixel's coordinates and sums, tile by tile.
    pub fn pixels(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.tiles.iter().flat_map(|tile| tile.iter())
    }

    /// All tiles, to add samples to; each may be given to another thread.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Estimate of the mean over all pixels of [`Accumulator::squared_error`].
    pub fn error(&self) -> f64 {
        let sum = |tile: &Tile| tile.error() * tile.bounds().area() as f64;
        self.tiles.iter().map(sum).sum::<f64>() / self.crop.area() as f64
    }

    /// The square root of each tile's error, in all its pixels.
    pub fn error_map(&self) -> Channel {
        Image::error_map(self)
    }

    /// Bytes that a film of this crop takes.
    pub fn bytes(crop: Rect) -> u64 {
        crop.area() * size_of::<Accumulator>() as u64
    }

    /// Means, variances and counts as channels of float32.
    pub fn develop(&self) -> Image {
        Image::from_film(self)
    }
}
