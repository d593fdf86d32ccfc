//! Rectangles of pixels, and tiles: the blocks of pixels to whose sums one task adds.

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
    /// One past the last column and row.
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

/// Change of the sums of a pixel by samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// Adds the samples that come next.
    Add,
    /// Adds one sample that is in no block.
    AddAlone,
    /// Takes the samples out again that came last, part of a block.
    TakeBack,
}

/// A block of pixels that one task works on at a time.
#[derive(Clone, Debug)]
pub struct Tile {
    cell: Rect,
    bounds: Rect,
    /// Index of the first sample that it takes.
    first: u32,
    /// Samples per pixel that it was promised.
    target: u32,
    pixels: Vec<Accumulator>,
    /// One a pixel, or none.
    features: Vec<FeatureSums>,
    /// Parts of the light that are distinguished, and the sums of each, pixel by pixel.
    parts: usize,
    part_sums: Vec<PartSum>,
    /// The classifier of paths, if the last parts are classes of paths.
    light_paths: Option<Arc<LightPaths>>,
    /// Sums of the share in which samples see the background: one a pixel, or none.
    background: Vec<BackgroundSum>,
    /// The background that these samples see.
    backing: Option<Backing>,
}

impl Tile {
    /// The part of `cell` that is inside `crop`, for samples from `first` on.
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

    /// The block of the full image that it is of; a crop leaves a part of it.
    pub fn cell(&self) -> Rect {
        self.cell
    }

    /// Pixels of the tile in the image.
    pub fn bounds(&self) -> Rect {
        self.bounds
    }

    /// Each pixel's coordinates and sums, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.bounds.pixels().zip(&self.pixels)
    }

    /// Sums the features of what is met, from now on.
    pub(super) fn sum_features(&mut self) {
        self.features = vec![FeatureSums::default(); self.pixels.len()];
    }

    /// Whether features are summed.
    pub fn has_features(&self) -> bool {
        !self.features.is_empty()
    }

    /// Sums of the features of `pixel`, if there are any.
    pub fn features(&self, pixel: UVec2) -> Option<&FeatureSums> {
        self.features.get(self.index(pixel)?)
    }

    /// Sums of the features of `pixel`, to add to them.
    pub(super) fn features_mut(&mut self, pixel: UVec2) -> Option<&mut FeatureSums> {
        let index = self.index(pixel)?;
        self.features.get_mut(index)
    }

    /// Sums so many parts of the light by themselves, from now on.
    pub(super) fn sum_parts(&mut self, parts: usize) {
        self.parts = parts;
        self.part_sums = vec![PartSum::default(); parts * self.pixels.len()];
    }

    /// Number of parts of the light that are summed by themselves.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Tells the paths of samples apart, from now on: their parts are the last ones.
    pub(super) fn tell_paths(&mut self, paths: Arc<LightPaths>) {
        self.light_paths = Some(paths);
    }

    /// The classifier of paths, if there is one.
    pub fn light_paths(&self) -> Option<&Arc<LightPaths>> {
        self.light_paths.as_ref()
    }

    /// Number of parts before those of light paths.
    pub fn parts_before_paths(&self) -> usize {
        let of_paths = self.light_paths.as_ref().map_or(0, |paths| paths.layers().len());
        self.parts.saturating_sub(of_paths)
    }

    /// Empty sums of one pixel, of all that the tile sums.
    pub fn block(&self) -> PixelBlock {
        let classes = self.light_paths.as_ref().map_or(0, |paths| paths.classes());
        PixelBlock::new(self.has_features(), self.parts_before_paths(), classes)
    }

    /// Changes the sums of `pixel` by `samples`. Does nothing if the pixel is not in the tile.
    pub fn change(&mut self, pixel: UVec2, samples: &PixelBlock, turn: Turn) {
        let Some(index) = self.index(pixel) else { return };
        let light = &mut self.pixels[index];
        if let Some(sum) = self.background.get_mut(index) {
            match turn {
                Turn::Add => sum.add(samples.background, samples.light.samples(), light.samples()),
                Turn::AddAlone => sum.add_alone(samples.background),
                Turn::TakeBack => sum.take_back(samples.background),
            }
        }
        match turn {
            Turn::Add => light.add(&samples.light),
            Turn::AddAlone => light.add_alone(&samples.light),
            Turn::TakeBack => light.take_back(&samples.light),
        }
        if let (Some(sums), Some(features)) = (self.features.get_mut(index), &samples.features) {
            match turn {
                Turn::Add | Turn::AddAlone => sums.add(features),
                Turn::TakeBack => sums.take_back(features),
            }
        }
        self.change_parts(pixel, samples, turn);
    }

    /// Adds the sums that `other` has of `pixel`.
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

    fn change_parts(&mut self, pixel: UVec2, samples: &PixelBlock, turn: Turn) {
        let of_paths = self
            .light_paths
            .as_ref()
            .map(|paths| terms(paths, samples.classes.sums(), samples.light.sum()));
        let parts = samples.parts.sums().iter().map(|sum| PartSum::new(*sum));
        let parts = parts.chain(of_paths.into_iter().flatten());
        for (sum, part) in self.part_sums_mut(pixel).iter_mut().zip(parts) {
            *sum = match turn {
                Turn::Add | Turn::AddAlone => sum.plus(part),
                Turn::TakeBack => sum.minus(part),
            };
        }
    }

    /// Sums of each part of the light at `pixel`; empty where there are none.
    pub fn part_sums(&self, pixel: UVec2) -> &[PartSum] {
        let range = self.part_range(pixel);
        self.part_sums.get(range).unwrap_or_default()
    }

    /// Sums of each part of the light at `pixel`, to add to them.
    pub(super) fn part_sums_mut(&mut self, pixel: UVec2) -> &mut [PartSum] {
        let range = self.part_range(pixel);
        self.part_sums.get_mut(range).unwrap_or_default()
    }

    fn part_range(&self, pixel: UVec2) -> Range<usize> {
        let n = self.parts;
        self.index(pixel).map_or(0..0, |index| index * n..(index + 1) * n)
    }

    /// Sums the share of the background `backing`, from now on.
    pub(super) fn sum_background(&mut self, backing: Backing) {
        self.background = vec![BackgroundSum::default(); self.pixels.len()];
        self.backing = Some(backing);
    }

    /// The background of which the share is summed, if it is.
    pub fn backing(&self) -> Option<Backing> {
        self.backing
    }

    /// Sum over the samples of `pixel` of the share in which each sees the background, if that is summed.
    pub fn background(&self, pixel: UVec2) -> Option<BackgroundSum> {
        self.background.get(self.index(pixel)?).copied()
    }

    /// The sum of [`Tile::background`], to add to it.
    pub(super) fn background_mut(&mut self, pixel: UVec2) -> Option<&mut BackgroundSum> {
        let index = self.index(pixel)?;
        self.background.get_mut(index)
    }

    /// Samples that each pixel has.
    pub fn samples(&self) -> u32 {
        self.pixels.first().map_or(0, Accumulator::samples)
    }

    /// Index of the first sample that it takes.
    pub fn first_sample(&self) -> u32 {
        self.first
    }

    /// Index of the sample that it takes next.
    pub fn next_sample(&self) -> u32 {
        self.first.saturating_add(self.samples())
    }

    /// Samples per pixel that it gets before anything is decided anew.
    pub fn target(&self) -> u32 {
        self.target
    }

    /// Promises so many samples per pixel.
    pub fn set_target(&mut self, samples: u32) {
        self.target = samples;
    }

    /// Mean over its pixels of [`Accumulator::squared_error`], and of that of a transparent background:
    /// the error is then that of the picture over white.
    pub fn error(&self) -> f64 {
        let mut sum: f64 = self.pixels.iter().map(Accumulator::squared_error).sum();
        if self.backing == Some(Backing::Transparent) {
            let pixels = self.background.iter().zip(&self.pixels);
            sum += pixels
                .map(|(share, sums)| share.squared_error(sums.samples()))
                .sum::<f64>();
        }
        sum / self.pixels.len().max(1) as f64
    }

    /// The sums of the pixel in this column and row of the image, if it is in the tile.
    pub fn sums(&self, pixel: UVec2) -> Option<&Accumulator> {
        self.pixels.get(self.index(pixel)?)
    }

    /// The sums of a pixel, to add samples to.
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
