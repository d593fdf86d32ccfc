//! Sums of all pixels of a tile: as numbers while a task changes them ([`TileSums`]), and packed
//! ([`Groups`]). Large films and checkpoints store packed sums.
//!
//! A tile has the following groups of columns, each with one number per pixel:
//!
//! 1. the sums of [`Accumulator`]: fixed point of 128 bits, of 64 bits, counts, and spreads;
//! 2. with a background: its three sums, and their spread;
//! 3. three sums for each part of the light;
//! 4. with features: their sums, the number of samples on lines, and, for objects, parts and
//!    materials, the maximum number of different ids in a pixel, and for each of these an id and
//!    its number of samples.

use super::accumulator::ExactSums;
use super::features::SUMS;
use super::fixed::Narrow;
use super::packed::{Group, Packed, Packer, Unpacker};
use super::{Accumulator, BackgroundSum, Coverage, FeatureSums, Fixed, PartSum, PixelBlock, Rect};
use crate::math::UVec2;
use std::ops::Range;

/// Expected number of bytes of a packed pixel, without optional quantities. More bytes take more
/// time, because the packed bytes are then moved.
const USUAL_BYTES: usize = 80;

/// Quantities that a film sums in addition to the sums of [`Accumulator`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Quantities {
    /// True if the fraction of the background is summed.
    pub has_background: bool,
    /// True if features of the first surface are summed.
    pub has_features: bool,
    /// Number of separately summed parts of the light.
    pub parts: usize,
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

/// Sums of all pixels of a tile, which can be changed. [`Tile::open`](super::Tile::open) returns
/// them, and [`Tile::close`](super::Tile::close) stores them again.
#[derive(Clone, Debug)]
pub struct TileSums {
    bounds: Rect,
    pixels: Vec<Accumulator>,
    /// Sums of features, one per pixel; empty without features.
    features: Vec<FeatureSums>,
    /// Number of separate parts of the light. `part_sums` holds the sums of the parts, pixel by
    /// pixel.
    parts: usize,
    part_sums: Vec<PartSum>,
    /// Sum of the background's fraction for each pixel; empty if the fraction is not summed.
    background: Vec<BackgroundSum>,
}

impl TileSums {
    /// Sums of no samples for the pixels of `bounds`.
    pub(super) fn new(bounds: Rect, quantities: Quantities) -> Self {
        let pixels = bounds.area() as usize;
        let optional = |is_there: bool| if is_there { pixels } else { 0 };
        Self {
            bounds,
            pixels: vec![Accumulator::default(); pixels],
            features: vec![FeatureSums::default(); optional(quantities.has_features)],
            parts: quantities.parts,
            part_sums: vec![PartSum::default(); quantities.parts * pixels],
            background: vec![BackgroundSum::default(); optional(quantities.has_background)],
        }
    }

    /// Coordinates and sums of each pixel, row by row.
    pub fn iter(&self) -> impl Iterator<Item = (UVec2, &Accumulator)> {
        self.bounds.pixels().zip(&self.pixels)
    }

    /// Coordinates and sums of each pixel, row by row.
    pub(super) fn into_pixels(self) -> impl Iterator<Item = (UVec2, Accumulator)> {
        self.bounds.pixels().zip(self.pixels)
    }

    /// Sums of the pixel with index `i`, row by row.
    ///
    /// # Panics
    /// If the tile has no such pixel.
    pub fn pixel(&self, i: usize) -> &Accumulator {
        &self.pixels[i]
    }

    /// Sums of the features of each pixel, row by row; empty without features.
    pub fn features(&self) -> &[FeatureSums] {
        &self.features
    }

    /// Sums of each part of the light at the pixel with index `i`; empty if the film has no parts.
    pub(super) fn part_sums(&self, i: usize) -> &[PartSum] {
        self.part_sums.get(self.part_range(i)).unwrap_or_default()
    }

    /// Sums of the background's fraction of each pixel, row by row; empty if they are not summed.
    pub(super) fn background(&self) -> &[BackgroundSum] {
        &self.background
    }

    /// Adds `samples` to the sums of `pixel` or subtracts them, as `change` says. Does nothing if
    /// the pixel is not in the tile.
    pub fn change(&mut self, pixel: UVec2, samples: &PixelBlock, change: SampleChange) {
        let Some(index) = self.bounds.index(pixel) else {
            return;
        };
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
        if self.parts > 0 {
            self.change_parts(index, samples, change);
        }
    }

    /// Adds the sums of `pixel` in `other`.
    pub(super) fn merge(&mut self, pixel: UVec2, other: &Self) {
        let (Some(index), Some(from)) = (self.bounds.index(pixel), other.bounds.index(pixel)) else {
            return;
        };
        let sums = &other.pixels[from];
        if let (Some(own), Some(features)) = (self.features.get_mut(index), other.features.get(from)) {
            own.merge(features);
        }
        if let (Some(own), Some(background)) = (self.background.get_mut(index), other.background.get(from)) {
            own.merge(background, [self.pixels[index].samples(), sums.samples()]);
        }
        for (own, part) in self.part_sums_mut(index).iter_mut().zip(other.part_sums(from)) {
            *own = own.plus(*part);
        }
        self.pixels[index].merge(sums);
    }

    fn change_parts(&mut self, index: usize, samples: &PixelBlock, change: SampleChange) {
        for (sum, part) in self.part_sums_mut(index).iter_mut().zip(samples.part_sums()) {
            *sum = match change {
                SampleChange::Add | SampleChange::AddAlone => sum.plus(part),
                SampleChange::TakeBack => sum.minus(part),
            };
        }
    }

    fn part_sums_mut(&mut self, i: usize) -> &mut [PartSum] {
        let range = self.part_range(i);
        self.part_sums.get_mut(range).unwrap_or_default()
    }

    fn part_range(&self, i: usize) -> Range<usize> {
        i * self.parts..(i + 1) * self.parts
    }

    /// The sums of a tile that is moved to `bounds`.
    pub(super) fn moved(self, bounds: Rect) -> Self {
        Self { bounds, ..self }
    }

    /// Packs all sums.
    pub(super) fn pack(&self) -> Packed {
        let mut packer = Packer::new(self.pixels.len(), USUAL_BYTES);
        packer.group(self.pixels.iter().map(|pixel| &pixel.exact.wide));
        packer.group(self.pixels.iter().map(|pixel| &pixel.exact.narrow));
        packer.group(self.pixels.iter().map(|pixel| &pixel.exact.counts));
        packer.group(self.pixels.iter().map(|pixel| &pixel.block_spread));
        if !self.background.is_empty() {
            packer.group(self.background.iter().map(|background| &background.sum));
            packer.group(self.background.iter().map(|background| [background.block_spread]));
        }
        for part in 0..self.parts {
            let sums = self.part_sums.chunks_exact(self.parts);
            packer.group(sums.map(|sums| &sums[part].0));
        }
        if self.features.is_empty() {
            return packer.finish();
        }
        packer.group(self.features.iter().map(|features| &features.sums));
        packer.group(self.features.iter().map(|features| [features.lines]));
        for of_kind in COVERAGES {
            let coverages = || self.features.iter().map(of_kind);
            let levels = coverages().map(Coverage::len).max().unwrap_or(0);
            packer.number(levels as u32);
            for level in 0..levels {
                packer.group(coverages().map(|coverage| <[u32; 2]>::from(coverage.at(level))));
            }
        }
        packer.finish()
    }
}

/// Coverages of a pixel: objects, parts and materials.
const COVERAGES: [fn(&FeatureSums) -> &Coverage; 3] = [|f| &f.objects, |f| &f.parts, |f| &f.materials];

/// Packed sums of a tile, of which single pixels can be read.
pub(super) struct Groups<'a> {
    wide: Group<'a, Fixed, 8>,
    narrow: Group<'a, Narrow, 6>,
    counts: Group<'a, u32, 2>,
    spread: Group<'a, f64, 3>,
    background: Option<(Group<'a, Fixed, 3>, Group<'a, f64, 1>)>,
    parts: Vec<Group<'a, Fixed, 3>>,
    features: Option<FeatureGroups<'a>>,
}

/// Packed sums of features.
struct FeatureGroups<'a> {
    sums: Group<'a, Fixed, { SUMS.len() }>,
    lines: Group<'a, u32, 1>,
    /// Ids and numbers of samples by kind and level.
    coverages: [Vec<Group<'a, u32, 2>>; 3],
}

impl<'a> FeatureGroups<'a> {
    fn new(unpacker: &mut Unpacker<'a>) -> Option<Self> {
        let (sums, lines) = (unpacker.group()?, unpacker.group()?);
        let mut coverages = [const { Vec::new() }; 3];
        for groups in &mut coverages {
            for _ in 0..unpacker.number()? {
                groups.push(unpacker.group()?);
            }
        }
        Some(Self { sums, lines, coverages })
    }

    fn pixel(&self, i: usize) -> FeatureSums {
        let [objects, parts, materials] = self.coverages.each_ref().map(|groups| {
            let mut coverage = Coverage::default();
            let entries = groups.iter().map(|group| group.get(i));
            entries
                .filter(|[_, count]| *count > 0)
                .for_each(|[id, count]| coverage.add(id, count));
            coverage
        });
        let [lines] = self.lines.get(i);
        FeatureSums {
            sums: self.sums.get(i),
            lines,
            objects,
            parts,
            materials,
        }
    }
}

impl<'a> Groups<'a> {
    /// Groups of a tile of `pixels` pixels that sums `quantities`. `None` if the bytes do not have
    /// these groups.
    pub fn new(packed: &'a Packed, pixels: usize, quantities: Quantities) -> Option<Self> {
        let unpacker = &mut packed.unpack(pixels);
        let groups = Self {
            wide: unpacker.group()?,
            narrow: unpacker.group()?,
            counts: unpacker.group()?,
            spread: unpacker.group()?,
            background: if quantities.has_background {
                Some((unpacker.group()?, unpacker.group()?))
            } else {
                None
            },
            parts: (0..quantities.parts).map(|_| unpacker.group()).collect::<Option<_>>()?,
            features: if quantities.has_features {
                Some(FeatureGroups::new(unpacker)?)
            } else {
                None
            },
        };
        unpacker.is_done().then_some(groups)
    }

    /// Sums of the pixel with index `i`.
    pub fn pixel(&self, i: usize) -> Accumulator {
        Accumulator {
            exact: ExactSums {
                wide: self.wide.get(i),
                narrow: self.narrow.get(i),
                counts: self.counts.get(i),
            },
            block_spread: self.spread.get(i),
        }
    }

    /// Sums of the background's fraction, if they are summed.
    pub fn background(&self, i: usize) -> Option<BackgroundSum> {
        let (sum, block_spread) = self.background.as_ref()?;
        let [block_spread] = block_spread.get(i);
        Some(BackgroundSum {
            sum: sum.get(i),
            block_spread,
        })
    }

    /// Sums of each part of the light.
    pub fn parts(&self, i: usize) -> impl Iterator<Item = PartSum> {
        self.parts.iter().map(move |group| PartSum(group.get(i)))
    }

    /// Sums of features, if they are summed.
    pub fn features(&self, i: usize) -> Option<FeatureSums> {
        self.features.as_ref().map(|groups| groups.pixel(i))
    }

    /// Writes the sums of all pixels to `sums`, which must have no samples.
    pub fn unpack(&self, sums: &mut TileSums) {
        self.wide
            .unpack(sums.pixels.iter_mut().map(|pixel| &mut pixel.exact.wide));
        self.narrow
            .unpack(sums.pixels.iter_mut().map(|pixel| &mut pixel.exact.narrow));
        self.counts
            .unpack(sums.pixels.iter_mut().map(|pixel| &mut pixel.exact.counts));
        self.spread
            .unpack(sums.pixels.iter_mut().map(|pixel| &mut pixel.block_spread));
        for (i, sum) in sums.background.iter_mut().enumerate() {
            *sum = self.background(i).unwrap_or_default();
        }
        for (i, of_pixel) in sums.part_sums.chunks_exact_mut(sums.parts.max(1)).enumerate() {
            of_pixel
                .iter_mut()
                .zip(self.parts(i))
                .for_each(|(sum, part)| *sum = part);
        }
        for (i, features) in sums.features.iter_mut().enumerate() {
            *features = self.features(i).unwrap_or_default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Backing, Features, Film, FilmSample, FirstSurface, LightPaths, Points, Tile};
    use crate::light_paths::PathPart;
    use crate::math::hash::mix;
    use crate::math::{Vec2, Vec3};
    use std::sync::Arc;

    /// Empty film that sums all quantities. Its tiles are packed if `is_packed` is true.
    fn film(is_packed: bool) -> Film {
        let crop = Rect {
            min: UVec2::new(3, 5),
            max: UVec2::new(20, 18),
        };
        let film = Film::new(UVec2::new(40, 20), crop).with_features().with_parts(2);
        let mut film = film.with_backing(Backing::Transparent);
        film.tiles_mut()
            .iter_mut()
            .for_each(|tile| tile.set_is_packed(is_packed));
        film
    }

    /// Samples of a pixel: of small and large radiance of both signs, with and without a surface.
    fn block(tile: &Tile, pixel: UVec2, samples: Range<u32>) -> PixelBlock {
        let mut block = tile.block();
        for i in samples {
            let random = |c: u64| {
                let bits = mix(u64::from(pixel.x) << 40 ^ u64::from(pixel.y) << 20 ^ u64::from(i) ^ c << 60);
                (bits >> 40) as f32 / (1 << 24) as f32
            };
            let radiance = Spectrum::rgb(random(0) * 10f32.powi((i % 19) as i32 - 9), random(1), -random(2));
            let surface = FirstSurface {
                albedo: Spectrum::rgb(random(3), 0.5, 0.0),
                normal: Vec3::new(-random(4), 0.6, random(5)),
                depth: 5.0 * random(6),
                emitted: if i % 9 == 0 { 7e6 } else { 0.0 },
                features: Some(Features {
                    p: Vec3::new(random(7), -2e5 * random(8), 1e-7),
                    uv: Vec2::new(random(9), 0.0),
                    motion: Vec2::ZERO,
                    points: Points::default(),
                    object: i % 3,
                    part: pixel.x,
                    material: 1 << 30,
                }),
            };
            block.add(&FilmSample {
                radiance,
                surface: (i % 4 > 0).then_some(&surface),
                is_on_line: i % 5 == 0,
                background: Spectrum::rgb(random(10), 0.1, 0.0),
                parts: &[radiance * 0.3, Spectrum::splat(-random(11))],
                classes: &[],
            });
        }
        block
    }

    fn change(film: &mut Film, samples: Range<u32>, change: SampleChange) {
        for tile in film.tiles_mut() {
            let mut sums = tile.open();
            for pixel in tile.bounds().pixels() {
                sums.change(pixel, &block(tile, pixel, samples.clone()), change);
            }
            tile.close(sums);
        }
    }

    /// Asserts that the sums of all pixels are equal. Spreads are compared as bits, because they
    /// may be NaN.
    fn assert_equal(a: &Film, b: &Film) {
        for pixel in a.crop().pixels() {
            let [(sums, a), (others, b)] = [a, b].map(|film| (film.sums(pixel).unwrap(), film.tile_at(pixel).unwrap()));
            assert_eq!(sums.exact, others.exact, "{pixel}");
            assert_eq!(
                sums.block_spread.map(f64::to_bits),
                others.block_spread.map(f64::to_bits)
            );
            assert_eq!(a.part_sums(pixel), b.part_sums(pixel));
            assert_eq!(a.features(pixel), b.features(pixel));
            let [a, b] = [a, b].map(|tile| tile.background(pixel).unwrap());
            assert_eq!((a.sum, a.block_spread.to_bits()), (b.sum, b.block_spread.to_bits()));
        }
        for (a, b) in a.tiles().iter().zip(b.tiles()) {
            assert_eq!(
                (a.samples(), a.error(0.1).to_bits()),
                (b.samples(), b.error(0.1).to_bits())
            );
            assert_eq!(a.packed(), b.packed());
        }
    }

    /// Packed sums are the sums, to the bit, after every change of a render, and after merging.
    #[test]
    fn packed_tiles_have_the_sums_of_plain_tiles() {
        let (mut plain, mut packed) = (film(false), film(true));
        assert_equal(&plain, &packed);
        let mut start = 0;
        for end in [1, 2, 4, 64, 128, 192, 200, 256] {
            if end == 256 {
                for film in [&mut plain, &mut packed] {
                    change(film, 192..200, SampleChange::TakeBack);
                }
                start = 192;
            }
            for film in [&mut plain, &mut packed] {
                change(film, start..end, SampleChange::Add);
            }
            start = end;
            assert_equal(&plain, &packed);
        }
        assert!(packed.error() > 0.0 && packed.samples() == 256 * packed.crop().area());
        let names = ["a".into(), "b".into()];
        let developed = |film: &Film| (film.develop(), film.develop_parts(&names));
        assert_eq!(developed(&plain), developed(&packed));

        let mut more = film(true);
        change(&mut more, 256..320, SampleChange::AddAlone);
        let both = |film: &Film| {
            let mut film = film.clone();
            film.merge(&more);
            film
        };
        assert_equal(&both(&plain), &both(&packed));
        let mut empty = film(true);
        empty.merge(&packed);
        assert_equal(&empty, &plain);
    }

    /// Tiles of both kinds have the sums of the packed bytes. Other bytes are found.
    #[test]
    fn sums_are_set_from_packed_bytes() {
        let mut from = film(false);
        change(&mut from, 0..64, SampleChange::Add);
        for is_packed in [false, true] {
            let mut to = film(is_packed);
            for (from, to) in from.tiles().iter().zip(to.tiles_mut()) {
                let bytes = from.packed();
                for wrong in [
                    &bytes[1..],
                    &bytes[..bytes.len() - 1],
                    &[&bytes[..], &[0]].concat(),
                    &[7; 300],
                ] {
                    assert!(to.set_packed(wrong).is_none());
                }
                to.set_packed(&bytes).unwrap();
            }
            assert_equal(&from, &to);
            to.tiles_mut().iter_mut().for_each(|tile| tile.set_packed(&[]).unwrap());
            assert_equal(&film(false), &to);
        }
    }

    /// A film that is loaded before its light is separated by path, as a resumed render is, adds
    /// the same terms to its layers as a film that was separated first.
    #[test]
    fn light_is_separated_after_sums_are_set() {
        let mut names = Vec::new();
        for name in ["emission", "indirect"] {
            PathPart::add(&mut names, PathPart::parse(name).unwrap()).unwrap();
        }
        let paths = Arc::new(LightPaths::new(&names).unwrap());
        let size = UVec2::new(5, 3);
        let empty = || Film::new(size, Rect::full(size)).with_parts(2);
        let add = |film: &mut Film, scale: f32| {
            for tile in film.tiles_mut() {
                let mut block = tile.block();
                let classes = vec![Spectrum::splat(scale); paths.classes()];
                block.add(&FilmSample {
                    radiance: Spectrum::splat(scale * paths.classes() as f32),
                    classes: &classes,
                    ..FilmSample::default()
                });
                for pixel in tile.bounds().pixels() {
                    tile.change(pixel, &block, SampleChange::Add);
                }
            }
        };
        for is_packed in [false, true] {
            let mut first = empty();
            first.separate_paths(&paths);
            add(&mut first, 0.3);
            let mut loaded = empty();
            for (from, to) in first.tiles().iter().zip(loaded.tiles_mut()) {
                to.set_is_packed(is_packed);
                to.set_packed(&from.packed()).unwrap();
            }
            loaded.separate_paths(&paths);
            [&mut first, &mut loaded].into_iter().for_each(|film| add(film, 0.7));
            for pixel in first.crop().pixels() {
                let [sums, of_loaded] = [&first, &loaded].map(|film| film.tile_at(pixel).unwrap().part_sums(pixel));
                assert!(sums.len() == 2 && sums.iter().all(|sum| sum.mean(0, 1) > 0.0));
                assert_eq!(sums, of_loaded);
            }
        }
    }
}
