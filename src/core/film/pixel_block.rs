//! All sums of one pixel in one task.

use super::path_terms::terms;
use super::{Block, FeatureBlock, FirstSurface, LightPaths, PartBlock, PartSum};
use crate::color::Spectrum;
use std::sync::Arc;

/// One sample of a pixel, as it is added to the film.
#[derive(Clone, Copy, Debug, Default)]
pub struct FilmSample<'a> {
    /// Radiance times the weight of the sample in the pixel filter.
    pub radiance: Spectrum,
    /// First surface, if the camera ray hits one.
    pub surface: Option<&'a FirstSurface>,
    /// True if the sample lies on a line of a drawing.
    pub is_on_line: bool,
    /// Fraction of the background's light that the sample receives, times the weight of the sample.
    pub background: Spectrum,
    /// Weighted radiance of each part of the light, without the layers of light path expressions.
    /// Empty if the film sums no parts.
    pub parts: &'a [Spectrum],
    /// Weighted radiance of each class of light paths. Empty if the film separates no paths.
    pub classes: &'a [Spectrum],
}

/// Sums of the samples of one pixel in one task: at most [`BLOCK`](super::BLOCK) samples.
#[derive(Clone, Debug)]
pub struct PixelBlock {
    pub(super) light: Block,
    pub(super) features: Option<FeatureBlock>,
    pub(super) parts: PartBlock,
    /// Radiance by class of light paths.
    pub(super) classes: PartBlock,
    /// Classifier of light paths, if the last parts of the light are light path expressions.
    light_paths: Option<Arc<LightPaths>>,
    /// Sum of the fraction of the background's light over the samples.
    pub(super) background: [f64; 3],
}

impl PixelBlock {
    /// Empty sums of radiance, of features if `has_features`, of `parts` parts of the light, and of
    /// the classes of `light_paths`, if any.
    pub(super) fn new(has_features: bool, parts: usize, light_paths: Option<Arc<LightPaths>>) -> Self {
        let classes = light_paths.as_ref().map_or(0, |paths| paths.classes());
        Self {
            light: Block::default(),
            features: has_features.then(FeatureBlock::default),
            parts: PartBlock::new(parts),
            classes: PartBlock::new(classes),
            light_paths,
            background: [0.0; 3],
        }
    }

    /// Makes all sums zero.
    pub fn clear(&mut self) {
        self.light = Block::default();
        if let Some(features) = &mut self.features {
            features.clear();
        }
        self.parts.clear();
        self.classes.clear();
        self.background = [0.0; 3];
    }

    /// Adds one sample.
    #[inline(always)]
    pub fn add(&mut self, sample: &FilmSample) {
        self.light.add(sample.radiance, sample.surface);
        let features = sample.surface.and_then(|surface| surface.features.as_ref());
        if let (Some(block), Some(features)) = (&mut self.features, features) {
            block.add(features);
        }
        if let (Some(block), true) = (&mut self.features, sample.is_on_line) {
            block.add_line();
        }
        self.parts.add(sample.parts);
        self.classes.add(sample.classes);
        for (sum, share) in self.background.iter_mut().zip(sample.background.to_array()) {
            *sum += f64::from(share);
        }
    }

    /// Sum of each part of the light, then of each layer of light path expressions.
    pub(super) fn part_sums(&self) -> impl Iterator<Item = PartSum> {
        let parts = self.parts.sums().iter().map(|sum| PartSum::new(*sum));
        let paths = self.light_paths.iter();
        let of_paths = paths.flat_map(|paths| terms(paths, self.classes.sums(), self.light.sum()));
        parts.chain(of_paths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Backing, Features, Film, Points, Rect, SampleChange, Tile};
    use crate::math::{UVec2, Vec2, Vec3};

    /// A tile of one pixel that sums all quantities.
    fn tile() -> Tile {
        let size = UVec2::ONE;
        let film = Film::new(size, Rect::full(size)).with_features().with_parts(2);
        film.with_backing(Backing::Transparent).tiles()[0].clone()
    }

    fn block(range: std::ops::Range<u32>) -> PixelBlock {
        let mut block = tile().block();
        for i in range {
            let surface = FirstSurface {
                albedo: Spectrum::splat(0.1 * i as f32),
                normal: Vec3::Y,
                depth: i as f32,
                emitted: 0.3,
                features: Some(Features {
                    p: Vec3::new(i as f32 * 0.1, 1e-6, -3e4),
                    uv: Vec2::new(0.3, 1.0 / (i + 1) as f32),
                    motion: Vec2::ZERO,
                    points: Points::default(),
                    object: i % 3,
                    part: 3,
                    material: 7,
                }),
            };
            block.add(&FilmSample {
                radiance: Spectrum::splat(1.0 / (i + 1) as f32),
                surface: (i % 2 == 0).then_some(&surface),
                is_on_line: i % 3 == 0,
                background: Spectrum::splat(0.1),
                parts: &[
                    Spectrum::rgb(0.1, i as f32, 1e9),
                    Spectrum::splat(1e-6 / (i + 1) as f32),
                ],
                classes: &[],
            });
        }
        block
    }

    /// Text of all sums of the pixel. Spreads are left out, because they depend on full blocks.
    fn sums(tile: &Tile) -> String {
        let pixel = UVec2::ZERO;
        let light = tile
            .sums(pixel)
            .map(|sums| (sums.samples(), [0, 1, 2].map(|c| sums.mean(c))));
        let background = tile.background(pixel).map(|sum| sum.sum);
        format!(
            "{light:?} {:?} {:?} {background:?}",
            tile.features(pixel),
            tile.part_sums(pixel)
        )
    }

    #[test]
    fn sums_do_not_depend_on_order_and_blocks_are_taken_back_exactly() {
        let pixel = UVec2::ZERO;
        let blocks = [block(0..2), block(2..40), block(40..100)];
        let sum = |blocks: &[&PixelBlock]| {
            let mut tile = tile();
            blocks
                .iter()
                .for_each(|block| tile.change(pixel, block, SampleChange::Add));
            tile
        };
        let [a, b, c] = &blocks;
        let mut all = sum(&[a, b, c]);
        assert_eq!(sums(&all), sums(&sum(&[c, b, a])));
        let mut merged = sum(&[a, b]);
        merged.merge(&sum(&[c]));
        assert_eq!(sums(&all), sums(&merged));
        let parts = all.part_sums(pixel);
        assert!((parts[0].mean(1, 100) - 49.5).abs() < 1e-9 && (parts[1].mean(2, 100) - 5.187e-8).abs() < 1e-10);
        all.change(pixel, c, SampleChange::TakeBack);
        all.change(pixel, b, SampleChange::TakeBack);
        assert_eq!(sums(&all), sums(&sum(&[a])));
    }

    #[test]
    fn a_cleared_block_adds_nothing() {
        let mut cleared = block(0..16);
        cleared.clear();
        let mut tile = tile();
        let before = sums(&tile);
        tile.change(UVec2::ZERO, &cleared, SampleChange::Add);
        assert_eq!(sums(&tile), before);
    }
}
