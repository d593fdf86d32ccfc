//! Rectangles of pixels, and tiles: blocks of pixels to which one task adds samples.

use super::path_terms::terms;
use super::{Accumulator, BackgroundSum, Backing, FeatureSums, LightPaths, PartSum, PixelBlock};
use crate::math::{UVec2, encode_fields};
use std::ops::Range;
use std::sync::Arc;

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

    /// Columns and rows of all pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = UVec2> {
        (self.min.y..self.max.y).flat_map(move |y| (self.min.x..self.max.x).map(move |x| UVec2::new(x, y)))
    }
}

/// Operation on the sums of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleChange {
    /// Adds the next samples.
    Add,
    /// Adds one sample that is in no block.
    AddAlone,
    /// Subtracts the samples that were added last. They must be fewer than a full block.
    TakeBack,
}

/// A block of pixels to which one task at a time adds samples.
#[derive(Clone, Debug)]
pub struct Tile {
    cell: Rect,
    bounds: Rect,
    /// Index of the first sample.
    first: u32,
    /// Number of samples per pixel that are scheduled.
    target: u32,
    pixels: Vec<Accumulator>,
    /// Sums of features, one per pixel; empty without features.
    features: Vec<FeatureSums>,
    /// Number of separate parts of the light. `part_sums` holds the sums of the parts, pixel by
    /// pixel.
    parts: usize,
    part_sums: Vec<PartSum>,
    /// Classifier of light paths, if the last parts are light path expressions.
    light_paths: Option<Arc<LightPaths>>,
    /// Sum of the background's fraction for each pixel; empty if the fraction is not summed.
    background: Vec<BackgroundSum>,
    /// Background whose fraction is summed.
    backing: Option<Backing>,
}

impl Tile {
    /// Empty tile for the part of `cell` inside `crop`, for samples from `first` on.
    pub(super) fn new(cell: Rect, crop: Rect, first: u32) -> Self {
        let bounds = cell.intersection(crop);
        Self {
            cell,
            bounds,
            first,
            target: 0,
            features: Vec::new(),
            parts: 0,
            part_sums: Vec::new(),
            light_paths: None,
            background: Vec::new(),
            backing: None,
            pixels: vec![Accumulator::default(); bounds.area() as usize],
        }
    }

    /// The tile moved right and down by `by` pixels.
    pub(super) fn moved(self, by: UVec2) -> Self {
        Self {
            cell: self.cell.moved(by),
            bounds: self.bounds.moved(by),
            ..self
        }
    }

    /// The tile moved left and up by `by` pixels.
    pub(super) fn moved_back(self, by: UVec2) -> Self {
        Self {
            cell: self.cell.moved_back(by),
            bounds: self.bounds.moved_back(by),
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

    /// Coordinates and sums of each pixel, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.bounds.pixels().zip(&self.pixels)
    }

    /// Starts to sum features.
    pub(super) fn sum_features(&mut self) {
        self.features = vec![FeatureSums::default(); self.pixels.len()];
    }

    /// Returns true if features are summed.
    pub fn has_features(&self) -> bool {
        !self.features.is_empty()
    }

    /// Sums of the features of `pixel`, if they are summed.
    pub fn features(&self, pixel: UVec2) -> Option<&FeatureSums> {
        self.features.get(self.index(pixel)?)
    }

    /// Mutable [`Tile::features`].
    pub(super) fn features_mut(&mut self, pixel: UVec2) -> Option<&mut FeatureSums> {
        let index = self.index(pixel)?;
        self.features.get_mut(index)
    }

    /// Starts to sum `parts` parts of the light.
    pub(super) fn sum_parts(&mut self, parts: usize) {
        self.parts = parts;
        self.part_sums = vec![PartSum::default(); parts * self.pixels.len()];
    }

    /// Number of separately summed parts of the light.
    pub fn parts(&self) -> usize {
        self.parts
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
        self.parts.saturating_sub(of_paths)
    }

    /// Empty block for one pixel, with all sums of the tile.
    pub fn block(&self) -> PixelBlock {
        let classes = self.light_paths.as_ref().map_or(0, |paths| paths.classes());
        PixelBlock::new(self.has_features(), self.parts_before_paths(), classes)
    }

    /// Adds `samples` to the sums of `pixel` or subtracts them, as `change` says. Does nothing if
    /// the pixel is not in the tile.
    pub fn change(&mut self, pixel: UVec2, samples: &PixelBlock, change: SampleChange) {
        let Some(index) = self.index(pixel) else { return };
        let light = &mut self.pixels[index];
        if let Some(sum) = self.background.get_mut(index) {
            match change {
                SampleChange::Add => sum.add(samples.background, samples.light.samples(), light.samples()),
                SampleChange::AddAlone => sum.add_alone(samples.background),
                SampleChange::TakeBack => sum.take_back(samples.background),
            }
        }
        match change {
            SampleChange::Add => light.add(&samples.light),
            SampleChange::AddAlone => light.add_alone(&samples.light),
            SampleChange::TakeBack => light.take_back(&samples.light),
        }
        if let (Some(sums), Some(features)) = (self.features.get_mut(index), &samples.features) {
            match change {
                SampleChange::Add | SampleChange::AddAlone => sums.add(features),
                SampleChange::TakeBack => sums.take_back(features),
            }
        }
        self.change_parts(pixel, samples, change);
    }

    /// Adds the sums of `pixel` in `other`.
    pub(super) fn merge(&mut self, pixel: UVec2, other: &Self) {
        let (Some(index), Some(sums)) = (self.index(pixel), other.sums(pixel)) else {
            return;
        };
        if let (Some(own), Some(features)) = (self.features.get_mut(index), other.features(pixel)) {
            own.merge(features);
        }
        if let (Some(own), Some(background)) = (self.background.get_mut(index), other.background(pixel)) {
            own.merge(&background, [self.pixels[index].samples(), sums.samples()]);
        }
        for (own, part) in self.part_sums_mut(pixel).iter_mut().zip(other.part_sums(pixel)) {
            *own = own.plus(*part);
        }
        self.pixels[index].merge(sums);
    }

    fn change_parts(&mut self, pixel: UVec2, samples: &PixelBlock, change: SampleChange) {
        let of_paths = self
            .light_paths
            .as_ref()
            .map(|paths| terms(paths, samples.classes.sums(), samples.light.sum()));
        let parts = samples.parts.sums().iter().map(|sum| PartSum::new(*sum));
        let parts = parts.chain(of_paths.into_iter().flatten());
        for (sum, part) in self.part_sums_mut(pixel).iter_mut().zip(parts) {
            *sum = match change {
                SampleChange::Add | SampleChange::AddAlone => sum.plus(part),
                SampleChange::TakeBack => sum.minus(part),
            };
        }
    }

    /// Sums of each part of the light at `pixel`; empty if the film has no parts.
    pub fn part_sums(&self, pixel: UVec2) -> &[PartSum] {
        let range = self.part_range(pixel);
        self.part_sums.get(range).unwrap_or_default()
    }

    /// Mutable [`Tile::part_sums`].
    pub(super) fn part_sums_mut(&mut self, pixel: UVec2) -> &mut [PartSum] {
        let range = self.part_range(pixel);
        self.part_sums.get_mut(range).unwrap_or_default()
    }

    fn part_range(&self, pixel: UVec2) -> Range<usize> {
        let n = self.parts;
        self.index(pixel).map_or(0..0, |index| index * n..(index + 1) * n)
    }

    /// Starts to sum the fraction of the background `backing`.
    pub(super) fn sum_background(&mut self, backing: Backing) {
        self.background = vec![BackgroundSum::default(); self.pixels.len()];
        self.backing = Some(backing);
    }

    /// Background whose fraction is summed, if any.
    pub fn backing(&self) -> Option<Backing> {
        self.backing
    }

    /// Fraction of the background's light in the samples of `pixel`, summed over the samples;
    /// `None` if the film does not sum the fraction.
    pub fn background(&self, pixel: UVec2) -> Option<BackgroundSum> {
        self.background.get(self.index(pixel)?).copied()
    }

    /// Mutable [`Tile::background`].
    pub(super) fn background_mut(&mut self, pixel: UVec2) -> Option<&mut BackgroundSum> {
        let index = self.index(pixel)?;
        self.background.get_mut(index)
    }

    /// Number of samples per pixel.
    pub fn samples(&self) -> u32 {
        self.pixels.first().map_or(0, Accumulator::samples)
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
        let sum: f64 = self.pixels.iter().map(Accumulator::luminance).sum();
        sum / self.pixels.len().max(1) as f64
    }

    /// Mean over the pixels of [`Accumulator::squared_error`], with `floor`. With a transparent
    /// background, the mean includes the error of the coverage, so it is the error of the picture
    /// in front of white.
    pub fn error(&self, floor: f64) -> f64 {
        let mut sum: f64 = self.pixels.iter().map(|sums| sums.squared_error(floor)).sum();
        if self.backing == Some(Backing::Transparent) {
            let pixels = self.background.iter().zip(&self.pixels);
            sum += pixels
                .map(|(share, sums)| share.squared_error(sums.samples()))
                .sum::<f64>();
        }
        sum / self.pixels.len().max(1) as f64
    }

    /// Sums of `pixel`, in image coordinates; `None` outside the tile.
    pub fn sums(&self, pixel: UVec2) -> Option<&Accumulator> {
        self.pixels.get(self.index(pixel)?)
    }

    /// Mutable [`Tile::sums`].
    pub fn sums_mut(&mut self, pixel: UVec2) -> Option<&mut Accumulator> {
        let index = self.index(pixel)?;
        self.pixels.get_mut(index)
    }

    fn index(&self, pixel: UVec2) -> Option<usize> {
        self.bounds.contains(pixel).then(|| {
            let at = pixel - self.bounds.min;
            (at.y * self.bounds.size().x + at.x) as usize
        })
    }
}
