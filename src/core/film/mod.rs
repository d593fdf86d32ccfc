//! Sums of samples per pixel, and the image that is computed ("developed") from the sums. This
//! module reads and writes no files.
//!
//! An integrator passes samples to a `Sink` (`integrator`). The sums of a pass are added exactly
//! (`fixed`) to a tile of the film. The result therefore does not depend on order, threads or
//! interruptions. `develop` turns sums into channels.
//!
//! `accumulator` has the sums that every picture needs, `features` the sums for `--aov`, and
//! `part_sums` the sums of light groups, strategies and light path expressions (`light_paths`).
//! `pixel_block` has the sums that one task adds to a pixel, and `iteration` one iteration of a
//! method whose light paths contribute to any pixel. `tile_sums` has the sums of the pixels of a
//! tile, and `packed` packs them to the bytes that they need, which films and checkpoints store.
//! `metering` computes the exposure of a developed image. `spikes` finds pixels whose
//! light comes mostly from one sample.
//!
//! Light paths of bidirectional methods contribute to any pixel. Each iteration of such a method is
//! added to the film as one sample of every pixel, so the film has no splat buffer.

mod accumulator;
mod aov;
mod background_sums;
mod features;
mod filter;
mod fixed;
mod image;
mod iteration;
mod metering;
mod packed;
mod part_sums;
mod path_terms;
mod pixel_block;
mod rect;
mod resample;
mod rgb_image;
mod spikes;
mod tile;
mod tile_sums;

pub use crate::light_paths::{LightPaths, MAX_CLASSES, PathLight};
pub use accumulator::{Accumulator, BLOCK, Block, FirstSurface};
pub use aov::{Aov, LINES, LineStyle};
pub use background_sums::{BackgroundSum, Backing};
use features::FeatureBlock;
pub use features::{Coverage, FeatureSums, Features, Points};
pub use filter::{Filter, FilterKind};
pub use fixed::Fixed;
pub use image::{Channel, Image, Z_BACKGROUND};
pub use iteration::Iteration;
pub use metering::metered;
use part_sums::PartBlock;
pub use part_sums::PartSum;
pub use pixel_block::{FilmSample, PixelBlock};
pub use rect::Rect;
pub use resample::{resample, resample_nearest};
pub use rgb_image::RgbImage;
pub use spikes::Spikes;
pub use tile::Tile;
pub use tile_sums::{Quantities, SampleChange, TileSums};

use crate::math::UVec2;
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

/// Edge of a tile in pixels. The unpacked sums of a tile (52 KB) stay in the second-level cache.
pub(crate) const TILE_SIZE: u32 = 16;

/// Floor of relative errors of a film, as a fraction of its brightness.
const FLOOR_OF_BRIGHTNESS: f64 = 1.0 / 3.0;
/// Floor of the relative errors of a black film, in radiance.
const FLOOR_OF_BLACK: f64 = 0.1;

/// Minimum number of pixels of a film whose sums are packed. Packing adds 2 % to the time of the
/// first samples, and the sums of fewer pixels take at most 109 MB.
const PACKED_PIXELS: u64 = 1 << 19;

/// Bytes of a pixel whose sums are not packed.
const PLAIN_BYTES: u64 = size_of::<Accumulator>() as u64;

/// Maximum number of separate parts of the light: light groups, strategies of a bidirectional
/// method, and light path expressions.
pub const MAX_PARTS: usize = 128;

/// Sums of the pixels of an image, or of a crop of an image, in independent tiles.
#[derive(Clone, Debug)]
pub struct Film {
    resolution: UVec2,
    /// Size of a view.
    view: UVec2,
    crop: Rect,
    first: u32,
    tiles: Vec<Tile>,
    /// Views of the picture, row by row.
    views: Vec<ViewTiles>,
}

/// A view of a picture, and its tiles. Each view has a camera of its own, such as an eye of a
/// stereo picture or a face of a cube map.
#[derive(Clone, Copy, Debug)]
struct ViewTiles {
    /// First pixel of the view.
    corner: UVec2,
    /// Part of the view inside of the crop, in coordinates of the view. It can be empty.
    crop: Rect,
    /// Index of the first tile.
    first: usize,
}

impl ViewTiles {
    /// Index of the tile that contains `pixel`, a pixel of the crop.
    fn index(&self, pixel: UVec2) -> usize {
        let corner = self.crop.min / TILE_SIZE;
        let place = (pixel - self.corner) / TILE_SIZE - corner;
        let columns = (self.crop.max.x - 1) / TILE_SIZE - corner.x + 1;
        self.first + (place.y * columns + place.x) as usize
    }
}

/// Rectangles of the views of a picture with `resolution` pixels, row by row. `view` is the size of
/// a view.
pub(crate) fn views_of(resolution: UVec2, view: UVec2) -> Vec<Rect> {
    let count = resolution / view.max(UVec2::ONE);
    let rows = (0..count.y).flat_map(|y| (0..count.x).map(move |x| UVec2::new(x, y)));
    rows.map(|cell| Rect::full(view).moved(cell * view)).collect()
}

impl Film {
    /// Empty film for the pixels in `crop` of an image of `resolution` pixels.
    ///
    /// # Panics
    /// If the crop is empty or not inside the image. Callers check it with [`Rect::is_inside`].
    pub fn new(resolution: UVec2, crop: Rect) -> Self {
        Self::starting_at(resolution, crop, 0)
    }

    /// Empty film for samples from the index `first_sample` on.
    ///
    /// # Panics
    /// Like [`Film::new`].
    pub fn starting_at(resolution: UVec2, crop: Rect, first_sample: u32) -> Self {
        Self::of_views((resolution, resolution), crop, first_sample)
    }

    /// Empty film of a picture with `resolution` pixels. The picture is a grid of views of `view`
    /// pixels each.
    ///
    /// # Panics
    /// Like [`Film::new`].
    pub fn of_views((resolution, view): (UVec2, UVec2), crop: Rect, first_sample: u32) -> Self {
        assert!(crop.is_inside(resolution), "crop {crop:?} outside {resolution}");
        let is_packed = crop.area() >= PACKED_PIXELS;
        let (mut tiles, mut views) = (Vec::new(), Vec::new());
        for bounds in views_of(resolution, view) {
            let inside = bounds.intersection(crop);
            let part = ViewTiles {
                corner: bounds.min,
                crop: inside.moved_back(bounds.min),
                first: tiles.len(),
            };
            views.push(part);
            if inside.area() == 0 {
                continue;
            }
            // Tiles are aligned to the full view, not to the crop, so that pixels of a crop are the
            // same as in the full view.
            let corner = part.crop.min / TILE_SIZE * TILE_SIZE;
            for y in (corner.y..part.crop.max.y).step_by(TILE_SIZE as usize) {
                for x in (corner.x..part.crop.max.x).step_by(TILE_SIZE as usize) {
                    let cell = Self::cell(bounds.size(), UVec2::new(x, y));
                    tiles.push(Tile::new(cell.moved(bounds.min), inside, first_sample, is_packed));
                }
            }
        }
        Self {
            resolution,
            view,
            crop,
            first: first_sample,
            tiles,
            views,
        }
    }

    /// Size of a view; the size of the image if it has one view.
    pub fn view_size(&self) -> UVec2 {
        self.view
    }

    /// Calls `work` with a film that holds only the view with the index `index`, as if this view
    /// were the whole picture. The samples of this film are samples of `self` after the call.
    /// Returns `None`, without a call, if the crop contains no pixel of the view.
    pub fn with_view<T>(&mut self, index: usize, work: impl FnOnce(&mut Self) -> T) -> Option<T> {
        let ViewTiles { corner, crop, first } = *self.views.get(index)?;
        if crop.area() == 0 {
            return None;
        }
        let end = self.views.get(index + 1).map_or(self.tiles.len(), |next| next.first);
        let mut part = Self {
            resolution: self.view,
            view: self.view,
            crop,
            first: self.first,
            tiles: self
                .tiles
                .drain(first..end)
                .map(|tile| tile.moved_back(corner))
                .collect(),
            views: vec![ViewTiles {
                corner: UVec2::ZERO,
                crop,
                first: 0,
            }],
        };
        let done = work(&mut part);
        self.tiles
            .splice(first..first, part.tiles.into_iter().map(|tile| tile.moved(corner)));
        Some(done)
    }

    /// Bounds of the tile that contains `pixel`, in an image of `resolution` pixels.
    pub fn cell(resolution: UVec2, pixel: UVec2) -> Rect {
        let min = pixel / TILE_SIZE * TILE_SIZE;
        let max = min.saturating_add(UVec2::splat(TILE_SIZE)).min(resolution);
        Rect { min, max }
    }

    /// Bounds of the tiles that overlap `crop`, each clipped to `crop`, row by row.
    pub fn cells(resolution: UVec2, crop: Rect) -> Vec<Rect> {
        let corner = crop.min / TILE_SIZE * TILE_SIZE;
        let rows = (corner.y..crop.max.y).step_by(TILE_SIZE as usize);
        let corners = rows.flat_map(|y| {
            (corner.x..crop.max.x)
                .step_by(TILE_SIZE as usize)
                .map(move |x| UVec2::new(x, y))
        });
        corners
            .map(|corner| Self::cell(resolution, corner).intersection(crop))
            .collect()
    }

    /// Lets the film sum the [`Features`] of the first surfaces of samples.
    pub fn with_features(mut self) -> Self {
        self.tiles.iter_mut().for_each(Tile::sum_features);
        self
    }

    /// Returns true if features are summed.
    pub fn has_features(&self) -> bool {
        self.quantities().has_features
    }

    /// Sums of the features of `pixel`, if they are summed.
    pub fn features(&self, pixel: UVec2) -> Option<FeatureSums> {
        self.tile_at(pixel)?.features(pixel)
    }

    /// Adds `parts` extra sums per pixel, for light groups, strategies or light path expressions.
    pub fn with_parts(mut self, parts: usize) -> Self {
        self.tiles.iter_mut().for_each(|tile| tile.sum_parts(parts));
        self
    }

    /// Number of separately summed parts of the light.
    pub fn parts(&self) -> usize {
        self.quantities().parts
    }

    /// Lets the film sum `quantities`, the background of which is `backing`.
    pub(crate) fn with_quantities(mut self, quantities: Quantities, backing: Option<Backing>) -> Self {
        self.tiles
            .iter_mut()
            .for_each(|tile| tile.sum_quantities(quantities, backing));
        self
    }

    /// Quantities that are summed in addition to the sums of every film.
    pub fn quantities(&self) -> Quantities {
        self.tiles.first().map_or(Quantities::default(), Tile::quantities)
    }

    /// Separates the light of samples by the light path expressions `paths`. The layers of the
    /// expressions are the last parts of [`Film::with_parts`].
    pub fn separate_paths(&mut self, paths: &Arc<LightPaths>) {
        self.tiles
            .iter_mut()
            .for_each(|tile| tile.separate_paths(paths.clone()));
    }

    /// Classifier of light paths, if any.
    pub fn light_paths(&self) -> Option<&LightPaths> {
        self.tiles.first()?.light_paths().map(|paths| &**paths)
    }

    /// Number of parts of the light before the parts of light path expressions.
    pub fn parts_before_paths(&self) -> usize {
        self.tiles.first().map_or(0, Tile::parts_before_paths)
    }

    /// Lets the film sum, for each pixel, the fraction of the light of the background `backing`
    /// that the pixel receives. The developed image then has coverage channels.
    pub fn with_backing(mut self, backing: Backing) -> Self {
        self.tiles.iter_mut().for_each(|tile| tile.sum_background(backing));
        self
    }

    /// Background whose fraction is summed, if any.
    pub fn backing(&self) -> Option<Backing> {
        self.tiles.first().and_then(Tile::backing)
    }

    /// Coverage of `pixel` by surfaces, 0 to 1, for red, green and blue. `None` if the film does
    /// not sum the fraction of the background.
    ///
    /// The coverage is 1 minus the fraction of the background. The film sums this fraction, and not
    /// the fraction of surfaces, because of filters with negative lobes, whose weights do not sum
    /// to 1. In front of a background of constant radiance, a pixel then equals the pixel of an
    /// opaque render.
    pub fn coverage(&self, pixel: UVec2) -> Option<[f32; 3]> {
        let tile = self.tile_at(pixel)?;
        let (background, samples) = (tile.background(pixel)?, tile.sums(pixel)?.samples());
        Some(background.coverage(samples))
    }

    /// Memory for coverage in all pixels of `crop`, in bytes: the sums and the channels.
    pub fn coverage_bytes(crop: Rect) -> u64 {
        crop.area().saturating_mul((28 + 3 * size_of::<f32>()) as u64)
    }

    /// Size of the full image.
    pub fn resolution(&self) -> UVec2 {
        self.resolution
    }

    /// Part of the image that this film holds.
    pub fn crop(&self) -> Rect {
        self.crop
    }

    /// Index of the first sample of each pixel.
    pub fn first_sample(&self) -> u32 {
        self.first
    }

    /// All tiles.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// Tile that contains `pixel`; `None` outside the crop.
    pub fn tile_at(&self, pixel: UVec2) -> Option<&Tile> {
        self.tiles.get(self.tile_index(pixel)?)
    }

    /// Mutable [`Film::tile_at`].
    pub fn tile_at_mut(&mut self, pixel: UVec2) -> Option<&mut Tile> {
        let index = self.tile_index(pixel)?;
        self.tiles.get_mut(index)
    }

    fn tile_index(&self, pixel: UVec2) -> Option<usize> {
        if !self.crop.contains(pixel) {
            return None;
        }
        if let [whole] = self.views[..] {
            return Some(whole.index(pixel));
        }
        let view = pixel / self.view;
        let columns = self.resolution.x / self.view.x;
        Some(self.views.get((view.y * columns + view.x) as usize)?.index(pixel))
    }

    /// Sums of `pixel`; `None` outside the crop.
    pub fn sums(&self, pixel: UVec2) -> Option<Accumulator> {
        self.tile_at(pixel)?.sums(pixel)
    }

    /// Adds the sums of another film of the same image. Pixels outside the crop of `self` are left
    /// out.
    pub fn merge(&mut self, other: &Self) {
        for from in &other.tiles {
            let common = from.bounds().intersection(self.crop);
            if common.area() == 0 {
                continue;
            }
            // Tiles of equal views have equal cells, so one tile has all common pixels.
            if let Some(tile) = self.tile_at_mut(common.min) {
                tile.merge(from);
            }
        }
    }

    /// Adds `iteration` as one sample of every pixel. The sample belongs to no block.
    pub fn add_iteration(&mut self, iteration: &Iteration) {
        self.tiles.par_iter_mut().for_each(|tile| {
            let (mut sums, mut sample) = (tile.open(), tile.block());
            for pixel in tile.bounds().pixels() {
                iteration.pixel(pixel, &mut sample);
                sums.change(pixel, &sample, SampleChange::AddAlone);
            }
            tile.close(sums);
        });
    }

    /// Number of samples over all pixels.
    pub fn samples(&self) -> u64 {
        let sum = |tile: &Tile| tile.samples() as u64 * tile.bounds().area();
        self.tiles.iter().map(sum).sum()
    }

    /// Coordinates and sums of each pixel, tile by tile.
    pub fn pixels(&self) -> impl Iterator<Item = (UVec2, Accumulator)> {
        self.tiles.iter().flat_map(|tile| tile.open().into_pixels())
    }

    /// All tiles, mutable. Each tile can be used on a different thread.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// Floor of relative errors: a third of the brightness of the picture, in radiance. So an error
    /// does not depend on the unit of radiance, and a dim room needs as many samples as a bright
    /// room.
    ///
    /// The brightness is a power mean of the luminances of all tiles that are not black, with the
    /// exponent 1/2, which is near the encoding of a display. In an arithmetic mean, one visible
    /// lamp would count more than the rest of the picture, and in a geometric mean a dark corner
    /// would.
    pub fn error_floor(&self) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for tile in &self.tiles {
            let luminance = tile.mean_luminance();
            if luminance > 0.0 && luminance.is_finite() {
                let pixels = tile.bounds().area() as f64;
                sum += luminance.sqrt() * pixels;
                area += pixels;
            }
        }
        if area > 0.0 {
            FLOOR_OF_BRIGHTNESS * (sum / area).powi(2)
        } else {
            FLOOR_OF_BLACK
        }
    }

    /// [`Tile::error`] of each tile, with [`Film::error_floor`].
    pub fn tile_errors(&self) -> Vec<f64> {
        let floor = self.error_floor();
        self.tiles.iter().map(|tile| tile.error(floor)).collect()
    }

    /// Estimate of the mean over all pixels of [`Accumulator::squared_error`], with
    /// [`Film::error_floor`].
    pub fn error(&self) -> f64 {
        let errors = self.tile_errors().into_iter().zip(&self.tiles);
        let sum = |(error, tile): (f64, &Tile)| error * tile.bounds().area() as f64;
        errors.map(sum).sum::<f64>() / self.crop.area() as f64
    }

    /// Estimate of the relative error of the picture, the square root of [`Film::error`]. With
    /// fewer than two blocks of samples, the estimate treats samples as independent, so it is too
    /// large for low-discrepancy samples. `None` before the second sample.
    pub fn relative_error(&self) -> Option<f64> {
        let by_blocks = self.error();
        let squared = if by_blocks.is_finite() {
            by_blocks
        } else {
            let floor = self.error_floor();
            let mut sum = 0.0;
            for tile in &self.tiles {
                for (_, sums) in tile.read().iter() {
                    sum += sums.independent_squared_error(floor);
                }
            }
            sum / self.crop.area() as f64
        };
        squared.is_finite().then(|| squared.sqrt())
    }

    /// Channel `error`: the value of each pixel is the square root of [`Tile::error`] of its tile.
    pub fn error_map(&self) -> Channel {
        Image::error_map(self)
    }

    /// Bytes per pixel of a film without samples.
    pub(crate) const EMPTY_BYTES: u64 = 1;

    /// Expected bytes of the sums of all pixels of `crop` with `samples` samples per pixel.
    pub fn bytes(crop: Rect, samples: u32) -> u64 {
        // Bytes of packed sums were measured, and rounded up. From the second block of samples on,
        // pixels have a spread.
        let bytes = match crop.area() {
            0..PACKED_PIXELS => PLAIN_BYTES,
            _ if samples < 2 * BLOCK => 80,
            _ => 112,
        };
        crop.area().saturating_mul(bytes)
    }

    /// Memory for `parts` parts of the light in all pixels of `crop`, in bytes: the sums and the
    /// channels.
    pub fn part_bytes(crop: Rect, parts: usize) -> u64 {
        crop.area()
            .saturating_mul((parts * (27 + size_of::<[f32; 3]>())) as u64)
    }

    /// Memory for the sums of features in all pixels of `crop`, in bytes. It includes heap memory
    /// for up to four ids per pixel and kind.
    pub fn feature_bytes(crop: Rect) -> u64 {
        crop.area().saturating_mul(100)
    }

    /// Memory for the channels of `aovs` in all pixels of `crop`, in bytes. Parts of the light are
    /// not included.
    pub fn aov_bytes(crop: Rect, aovs: &[Aov]) -> u64 {
        let channels: usize = aovs.iter().map(|aov| aov.channel_count()).sum();
        crop.area().saturating_mul((channels * size_of::<f32>()) as u64)
    }

    /// Red, green and blue channels of each part of the light. `names` are the names of their
    /// layers.
    pub fn develop_parts(&self, names: &[String]) -> Vec<Channel> {
        image::develop_parts(self, names)
    }

    /// Channels of `aovs`. Mattes and parts of the light are left out, because they need names.
    /// Pixels without a value are zero.
    pub fn develop_features(&self, aovs: &[Aov]) -> Vec<Channel> {
        aov::develop_features(self, aovs)
    }

    /// Channels with the names `names`. For each pixel, `develop` gets the sums of its tile and its
    /// index in the tile, and appends the values of all channels, in the order of `names`. Without
    /// values, a pixel is 0.
    pub fn develop_channels(
        &self,
        names: impl Iterator<Item = Cow<'static, str>>,
        develop: impl Fn(&TileSums, usize, &mut Vec<f32>),
    ) -> Vec<Channel> {
        image::develop_channels(self, names, develop)
    }

    /// Means, variances and counts as channels of float32.
    pub fn develop(&self) -> Image {
        Image::from_film(self, usize::MAX)
    }

    /// Channels `R G B` of [`Film::develop`] only, in a fraction of the time.
    pub fn develop_picture(&self) -> Image {
        Image::from_film(self, 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;

    /// Floor of a film of 64 × 64 pixels with one sample each, of the radiance that `of` returns.
    fn floor(of: impl Fn(UVec2) -> f32) -> f64 {
        let size = UVec2::splat(64);
        let mut film = Film::new(size, Rect::full(size));
        for tile in film.tiles_mut() {
            for pixel in tile.bounds().pixels() {
                let mut block = tile.block();
                block.add(&FilmSample {
                    radiance: Spectrum::splat(of(pixel)),
                    ..FilmSample::default()
                });
                tile.change(pixel, &block, SampleChange::Add);
            }
        }
        film.error_floor()
    }

    #[test]
    fn floor_is_a_third_of_brightness() {
        for radiance in [1e-4, 0.2, 1.0, 3e4] {
            let third = f64::from(radiance) / 3.0;
            assert!((floor(|_| radiance) / third - 1.0).abs() < 1e-6);
        }
        assert_eq!(floor(|_| 0.0), FLOOR_OF_BLACK);
    }

    #[test]
    fn black_tiles_do_not_lower_floor() {
        let lit = floor(|_| 0.2);
        let half = floor(|pixel| if pixel.x < 32 { 0.2 } else { 0.0 });
        assert!((half / lit - 1.0).abs() < 1e-6);
        // A dim half counts a little, and so does a lamp in one of sixteen tiles.
        let dim = floor(|pixel| if pixel.x < 32 { 0.2 } else { 1e-6 });
        assert!((0.25..0.26).contains(&(dim / lit)), "{}", dim / lit);
        let lamp = floor(|pixel| if pixel.max_element() < 16 { 20.0 } else { 0.2 });
        assert!(lamp / lit < 2.5, "{}", lamp / lit);
    }
}
