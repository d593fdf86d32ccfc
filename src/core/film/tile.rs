//! Tiles: blocks of pixels to which one task adds samples.

use super::packed::Packed;
use super::tile_sums::Groups;
use super::{
    Accumulator, BackgroundSum, Backing, FeatureSums, LightPaths, PartSum, PixelBlock, Quantities, Rect, SampleChange,
    TileSums,
};
use crate::math::UVec2;
use std::borrow::Cow;
use std::sync::Arc;

/// A block of pixels to which one task at a time adds samples.
///
/// To change the sums of its pixels, a task opens the tile, changes the returned [`TileSums`], and
/// closes the tile with them.
#[derive(Clone, Debug)]
pub struct Tile {
    cell: Rect,
    bounds: Rect,
    /// Index of the first sample.
    first: u32,
    /// Number of samples per pixel that are scheduled.
    target: u32,
    /// Number of samples per pixel.
    samples: u32,
    quantities: Quantities,
    /// Classifier of light paths, if the last parts are light path expressions.
    light_paths: Option<Arc<LightPaths>>,
    /// Background whose fraction is summed.
    backing: Option<Backing>,
    /// True if the sums are packed between two tasks.
    is_packed: bool,
    sums: Sums,
}

/// Sums of all pixels of a tile between two tasks.
#[derive(Clone, Debug)]
enum Sums {
    /// There are no samples.
    Empty,
    /// As numbers.
    Plain(TileSums),
    Packed(Packed),
}

impl Tile {
    /// Empty tile for the part of `cell` inside `crop`, for samples from `first` on. Its sums are
    /// packed if `is_packed` is true.
    pub(super) fn new(cell: Rect, crop: Rect, first: u32, is_packed: bool) -> Self {
        Self {
            cell,
            bounds: cell.intersection(crop),
            first,
            target: 0,
            samples: 0,
            quantities: Quantities::default(),
            light_paths: None,
            backing: None,
            is_packed,
            sums: Sums::Empty,
        }
    }

    /// Chooses whether the sums are packed between two tasks. The tile must be empty.
    #[cfg(test)]
    pub(super) fn set_is_packed(&mut self, is_packed: bool) {
        self.is_packed = is_packed;
    }

    /// The tile moved right and down by `by` pixels.
    pub(super) fn moved(self, by: UVec2) -> Self {
        let (cell, bounds) = (self.cell.moved(by), self.bounds.moved(by));
        self.placed(cell, bounds)
    }

    /// The tile moved left and up by `by` pixels.
    pub(super) fn moved_back(self, by: UVec2) -> Self {
        let (cell, bounds) = (self.cell.moved_back(by), self.bounds.moved_back(by));
        self.placed(cell, bounds)
    }

    fn placed(self, cell: Rect, bounds: Rect) -> Self {
        let sums = match self.sums {
            Sums::Plain(sums) => Sums::Plain(sums.moved(bounds)),
            sums => sums,
        };
        Self {
            cell,
            bounds,
            sums,
            ..self
        }
    }

    /// Pixels of the tile in the full image, including pixels outside the crop.
    pub fn cell(&self) -> Rect {
        self.cell
    }

    /// Pixels of the tile, in image coordinates.
    pub fn bounds(&self) -> Rect {
        self.bounds
    }

    /// Copy of the sums of all pixels, to change them.
    pub fn open(&self) -> TileSums {
        self.read().into_owned()
    }

    /// Sums of all pixels.
    pub fn read(&self) -> Cow<'_, TileSums> {
        if let Sums::Plain(sums) = &self.sums {
            return Cow::Borrowed(sums);
        }
        let mut sums = TileSums::new(self.bounds, self.quantities);
        if let Some(groups) = self.groups() {
            groups.unpack(&mut sums);
        }
        Cow::Owned(sums)
    }

    /// Replaces the sums of all pixels by `sums`, which [`Tile::open`] returned.
    pub fn close(&mut self, sums: TileSums) {
        self.samples = sums.iter().next().map_or(0, |(_, first)| first.samples());
        self.sums = if self.is_packed {
            Sums::Packed(sums.pack())
        } else {
            Sums::Plain(sums)
        };
    }

    /// Packed sums of all pixels, if they are packed.
    fn groups(&self) -> Option<Groups<'_>> {
        match &self.sums {
            Sums::Packed(packed) => Groups::new(packed, self.bounds.area() as usize, self.quantities),
            _ => None,
        }
    }

    /// Sums of `pixel` that `plain` or `packed` returns; `None` outside the tile. Before the first
    /// sample, they are `T::default()`.
    fn pixel<T: Default>(
        &self,
        pixel: UVec2,
        plain: impl FnOnce(&TileSums, usize) -> T,
        packed: impl FnOnce(&Groups, usize) -> T,
    ) -> Option<T> {
        let index = self.bounds.index(pixel)?;
        Some(match &self.sums {
            Sums::Empty => T::default(),
            Sums::Plain(sums) => plain(sums, index),
            Sums::Packed(_) => self.groups().map_or_else(T::default, |groups| packed(&groups, index)),
        })
    }

    /// Packed sums, for checkpoints; empty before the first sample.
    pub(crate) fn packed(&self) -> Cow<'_, [u8]> {
        match &self.sums {
            Sums::Empty => Cow::default(),
            Sums::Plain(sums) => sums.pack().bytes().to_vec().into(),
            Sums::Packed(packed) => packed.bytes().into(),
        }
    }

    /// Replaces the sums by the packed sums `bytes` of a checkpoint. Returns `None` if the bytes
    /// are not sums of this tile.
    pub(crate) fn set_packed(&mut self, bytes: &[u8]) -> Option<()> {
        if bytes.is_empty() {
            (self.sums, self.samples) = (Sums::Empty, 0);
            return Some(());
        }
        self.sums = Sums::Packed(Packed::of_bytes(bytes));
        self.samples = self.groups()?.pixel(0).samples();
        if !self.is_packed {
            self.sums = Sums::Plain(self.open());
        }
        Some(())
    }

    /// Quantities that are summed in addition to the sums of every film.
    pub(super) fn quantities(&self) -> Quantities {
        self.quantities
    }

    /// Starts to sum `quantities`, the background of which is `backing`. The tile must be empty.
    pub(super) fn sum_quantities(&mut self, quantities: Quantities, backing: Option<Backing>) {
        self.quantities = quantities;
        self.backing = backing;
    }

    /// Starts to sum features. The tile must be empty.
    pub(super) fn sum_features(&mut self) {
        self.quantities.has_features = true;
    }

    /// Sums of the features of `pixel`, if they are summed. To read many pixels, use
    /// [`Tile::read`].
    pub fn features(&self, pixel: UVec2) -> Option<FeatureSums> {
        let plain = |sums: &TileSums, i: usize| sums.features().get(i).cloned();
        let features = self.pixel(pixel, plain, |groups, i| groups.features(i))?;
        self.quantities.has_features.then(|| features.unwrap_or_default())
    }

    /// Starts to sum `parts` parts of the light. The tile must be empty.
    pub(super) fn sum_parts(&mut self, parts: usize) {
        self.quantities.parts = parts;
    }

    /// Number of separately summed parts of the light.
    pub fn parts(&self) -> usize {
        self.quantities.parts
    }

    /// Starts to separate light by light path expressions. The layers of the expressions are the
    /// last parts of the light.
    pub(super) fn separate_paths(&mut self, paths: Arc<LightPaths>) {
        self.light_paths = Some(paths);
    }

    /// Classifier of light paths, if any.
    pub fn light_paths(&self) -> Option<&Arc<LightPaths>> {
        self.light_paths.as_ref()
    }

    /// Number of parts of the light before the parts of light path expressions.
    pub fn parts_before_paths(&self) -> usize {
        let of_paths = self.light_paths.as_ref().map_or(0, |paths| paths.layers().len());
        self.parts().saturating_sub(of_paths)
    }

    /// Empty block for one pixel, with all sums of the tile.
    pub fn block(&self) -> PixelBlock {
        let light_paths = self.light_paths.clone();
        PixelBlock::new(self.quantities.has_features, self.parts_before_paths(), light_paths)
    }

    /// Changes the sums of a single pixel as [`TileSums::change`] does. To change many pixels, open
    /// the tile.
    pub fn change(&mut self, pixel: UVec2, samples: &PixelBlock, change: SampleChange) {
        let mut sums = self.open();
        sums.change(pixel, samples, change);
        self.close(sums);
    }

    /// Adds the sums of all pixels that are also in `other`.
    pub(super) fn merge(&mut self, other: &Self) {
        if matches!(other.sums, Sums::Empty) {
            return;
        }
        let (mut sums, others) = (self.open(), other.read());
        for pixel in self.bounds.intersection(other.bounds).pixels() {
            sums.merge(pixel, &others);
        }
        self.close(sums);
    }

    /// Sums of each part of the light at `pixel`; empty if the film has no parts. To read many
    /// pixels, use [`Tile::read`].
    pub fn part_sums(&self, pixel: UVec2) -> Vec<PartSum> {
        let plain = |sums: &TileSums, i: usize| sums.part_sums(i).to_vec();
        let sums = self.pixel(pixel, plain, |groups, i| groups.parts(i).collect());
        let with_all = |mut sums: Vec<PartSum>| {
            sums.resize(self.parts(), PartSum::default());
            sums
        };
        sums.map_or(Vec::new(), with_all)
    }

    /// Starts to sum the fraction of the background `backing`. The tile must be empty.
    pub(super) fn sum_background(&mut self, backing: Backing) {
        self.quantities.has_background = true;
        self.backing = Some(backing);
    }

    /// Background whose fraction is summed, if any.
    pub fn backing(&self) -> Option<Backing> {
        self.backing
    }

    /// Fraction of the background's light in the samples of `pixel`, summed over the samples;
    /// `None` if the film does not sum the fraction.
    pub fn background(&self, pixel: UVec2) -> Option<BackgroundSum> {
        let plain = |sums: &TileSums, i: usize| sums.background().get(i).copied();
        let sum = self.pixel(pixel, plain, |groups, i| groups.background(i))?;
        self.quantities.has_background.then(|| sum.unwrap_or_default())
    }

    /// Number of samples per pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Index of the first sample.
    pub fn first_sample(&self) -> u32 {
        self.first
    }

    /// Index of the next sample.
    pub fn next_sample(&self) -> u32 {
        self.first.saturating_add(self.samples())
    }

    /// Scheduled number of samples per pixel. When the tile has this number, it is decided whether
    /// more samples follow.
    pub fn target(&self) -> u32 {
        self.target
    }

    /// Sets the scheduled number of samples per pixel.
    pub fn set_target(&mut self, samples: u32) {
        self.target = samples;
    }

    /// Mean over the pixels of the luminance of [`Accumulator::mean`].
    pub fn mean_luminance(&self) -> f64 {
        let sum: f64 = self.read().iter().map(|(_, sums)| sums.luminance()).sum();
        sum / self.bounds.area().max(1) as f64
    }

    /// Mean over the pixels of [`Accumulator::squared_error`], with `floor`. With a transparent
    /// background, the mean includes the error of the coverage, so it is the error of the picture
    /// in front of white.
    pub fn error(&self, floor: f64) -> f64 {
        let sums = self.read();
        let mut sum: f64 = sums.iter().map(|(_, sums)| sums.squared_error(floor)).sum();
        if self.backing == Some(Backing::Transparent) {
            let pixels = sums.background().iter().zip(sums.iter());
            sum += pixels
                .map(|(share, (_, sums))| share.squared_error(sums.samples()))
                .sum::<f64>();
        }
        sum / self.bounds.area().max(1) as f64
    }

    /// Sums of `pixel`, in image coordinates; `None` outside the tile. To read many pixels, use
    /// [`Tile::read`].
    pub fn sums(&self, pixel: UVec2) -> Option<Accumulator> {
        self.pixel(pixel, |sums, i| *sums.pixel(i), |groups, i| groups.pixel(i))
    }
}
