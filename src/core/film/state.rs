//! Conversion of all sums of a film to named words of 32 bits, for checkpoints.

use super::features::SUMS;
use super::fixed::Narrow;
use super::{Accumulator, BackgroundSum, Coverage, FeatureSums, Film, Fixed, PartSum, Tile};
use crate::math::UVec2;

/// Names of the sums of type [`Fixed`].
const FIXED: [&str; 8] = [
    "sum.R",
    "sum.G",
    "sum.B",
    "squares.R",
    "squares.G",
    "squares.B",
    "Z",
    "emitted",
];
/// Names of the sums of type [`Narrow`].
const NARROW: [&str; 6] = ["albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z"];
/// Names of the sums of type f64.
const FLOATS: [&str; 3] = ["spread.R", "spread.G", "spread.B"];
/// Names of counts.
const COUNTS: [&str; 2] = ["surfaces", "samples"];

// For each kind of words, the index after the last word
const FIXED_END: usize = FIXED.len() * Fixed::WORDS;
const NARROW_END: usize = FIXED_END + NARROW.len() * Narrow::WORDS;
const FLOATS_END: usize = NARROW_END + FLOATS.len() * 2;

/// State of a pixel as words of 32 bits, for checkpoints.
impl Accumulator {
    /// Number of words of a pixel.
    pub const WORDS: usize = FLOATS_END + COUNTS.len();

    /// Names of the words, such as `sum.R.0`: quantity, then index (lowest word first).
    pub fn word_names() -> Vec<String> {
        let parts = |names: &'static [&str], words: usize| {
            let words = move |name: &&str| (0..words).map(|i| format!("{name}.{i}")).collect::<Vec<_>>();
            names.iter().flat_map(words)
        };
        let counts = COUNTS.iter().map(|name| name.to_string());
        parts(&FIXED, Fixed::WORDS)
            .chain(parts(&NARROW, Narrow::WORDS))
            .chain(parts(&FLOATS, 2))
            .chain(counts)
            .collect()
    }

    /// All words, in the order of [`Accumulator::word_names`].
    pub fn to_words(&self) -> [u32; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        let fixed = self
            .sum
            .iter()
            .chain(&self.sum_of_squares)
            .chain([&self.depth, &self.emitted]);
        for (words, sum) in words.chunks_exact_mut(Fixed::WORDS).zip(fixed) {
            words.copy_from_slice(&sum.to_words());
        }
        let narrow = self.albedo.iter().chain(&self.normal);
        for (words, sum) in words[FIXED_END..].chunks_exact_mut(Narrow::WORDS).zip(narrow) {
            words.copy_from_slice(&sum.to_words());
        }
        for (words, spread) in words[NARROW_END..].chunks_exact_mut(2).zip(self.block_spread) {
            words.copy_from_slice(&words_of(spread));
        }
        words[FLOATS_END..].copy_from_slice(&[self.surfaces, self.samples]);
        words
    }

    /// Accumulator with the words of [`Accumulator::to_words`].
    pub fn from_words(words: &[u32; Self::WORDS]) -> Self {
        let fixed = |i: usize| Fixed::from_words(std::array::from_fn(|w| words[i * Fixed::WORDS + w]));
        let narrow = |i: usize| Narrow::from_words(std::array::from_fn(|w| words[FIXED_END + i * Narrow::WORDS + w]));
        let float = |i: usize| float_of([0, 1].map(|w| words[NARROW_END + 2 * i + w]));
        Self {
            sum: [0, 1, 2].map(fixed),
            sum_of_squares: [3, 4, 5].map(fixed),
            depth: fixed(6),
            emitted: fixed(7),
            albedo: [0, 1, 2].map(narrow),
            normal: [3, 4, 5].map(narrow),
            block_spread: [0, 1, 2].map(float),
            surfaces: words[FLOATS_END],
            samples: words[FLOATS_END + 1],
        }
    }
}

/// Words of a float, the lowest word first.
fn words_of(float: f64) -> [u32; 2] {
    let bits = float.to_bits();
    [bits as u32, (bits >> 32) as u32]
}

/// Float whose words are the result of [`words_of`].
fn float_of([low, high]: [u32; 2]) -> f64 {
    f64::from_bits(u64::from(low) | u64::from(high) << 32)
}

/// Name of the number of samples on lines in [`FeatureSums`].
const LINES: &str = "lines";
/// Names of the coverages of [`FeatureSums`].
const COVERAGES: [&str; 3] = ["objects", "parts", "materials"];

/// Name of [`BackgroundSum`].
const BACKGROUND: &str = "background";

/// Number of words of one part of the light.
const LIGHT_WORDS: usize = 3 * Fixed::WORDS;

/// Layout of the words of a pixel: the sums of the pixel, the sample target of the tile, and, if
/// present, parts of the light and features.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StateLayout {
    /// Number of separately summed parts of the light.
    parts: usize,
    /// True if the fraction of the background is summed.
    has_background: bool,
    /// Maximum numbers of different objects, parts and materials in a pixel; `None` without
    /// features.
    levels: Option<[usize; 3]>,
}

impl StateLayout {
    /// Layout that has enough words for every pixel of `film`.
    pub fn of_film(film: &Film) -> Self {
        let features = || film.crop().pixels().filter_map(|pixel| film.features(pixel));
        let max = |of: fn(&FeatureSums) -> &Coverage| features().map(|f| of(f).len()).max().unwrap_or(0);
        Self {
            parts: film.parts(),
            has_background: film.backing().is_some(),
            levels: film
                .has_features()
                .then(|| [max(|f| &f.objects), max(|f| &f.parts), max(|f| &f.materials)]),
        }
    }

    /// Layout whose words have these names, in any order; `None` if the names match no layout.
    pub fn of_names(names: &[String]) -> Option<Self> {
        let levels = COVERAGES.map(|kind| {
            let level = |i: &usize| names.contains(&format!("{kind}.{i}.id"));
            (0..).take_while(level).count()
        });
        let has_features = names.iter().any(|name| name == "P.X.0");
        let parts = (0..).take_while(|i| names.contains(&format!("light.{i}.R.0"))).count();
        let layout = Self {
            parts,
            has_background: names.contains(&format!("{BACKGROUND}.R.0")),
            levels: has_features.then_some(levels),
        };
        let wanted = layout.names();
        (wanted.len() == names.len() && wanted.iter().all(|name| names.contains(name))).then_some(layout)
    }

    /// Number of separately summed parts of the light.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Returns true if the fraction of the background is summed.
    pub fn has_background(&self) -> bool {
        self.has_background
    }

    /// Returns true if there are features.
    pub fn has_features(&self) -> bool {
        self.levels.is_some()
    }

    /// Names of the words, in order.
    pub fn names(&self) -> Vec<String> {
        let mut names = Accumulator::word_names();
        names.push("target".into());
        let words = |name: &str| [0, 1, 2, 3].map(|i| format!("{name}.{i}"));
        if self.has_background {
            let channels = ["R", "G", "B"].map(|c| format!("{BACKGROUND}.{c}"));
            names.extend(channels.iter().flat_map(|name| words(name)));
            names.extend([0, 1].map(|i| format!("{BACKGROUND}.spread.{i}")));
        }
        let of_part = |part: usize| ["R", "G", "B"].map(|c| format!("light.{part}.{c}"));
        names.extend((0..self.parts).flat_map(of_part).flat_map(|name| words(&name)));
        if let Some(levels) = self.levels {
            names.extend(SUMS.iter().flat_map(|(name, _)| words(name)));
            names.push(LINES.into());
            for (kind, levels) in COVERAGES.iter().zip(levels) {
                names.extend((0..levels).flat_map(|i| [format!("{kind}.{i}.id"), format!("{kind}.{i}.count")]));
            }
        }
        names
    }

    /// Appends all words of `pixel` in `tile` to `words`, in the order of [`StateLayout::names`].
    /// The tile's film must have this layout.
    pub fn append(&self, tile: &Tile, pixel: UVec2, words: &mut Vec<u32>) {
        debug_assert!(
            tile.parts() == self.parts
                && tile.backing().is_some() == self.has_background
                && tile.has_features() == self.has_features()
        );
        let sums = tile.sums(pixel).map(Accumulator::to_words);
        words.extend(sums.unwrap_or([0; Accumulator::WORDS]));
        words.push(tile.target());
        if let Some(BackgroundSum { sum, block_spread }) = tile.background(pixel) {
            words.extend(sum.iter().flat_map(|sum| sum.to_words()));
            words.extend(words_of(block_spread));
        }
        let light = tile.part_sums(pixel).iter().flat_map(|PartSum(sum)| sum);
        words.extend(light.flat_map(|sum| sum.to_words()));
        let (Some(features), Some(levels)) = (tile.features(pixel), self.levels) else {
            return;
        };
        words.extend(features.sums.iter().flat_map(|sum| sum.to_words()));
        words.push(features.lines);
        let coverages = [&features.objects, &features.parts, &features.materials];
        for (coverage, levels) in coverages.into_iter().zip(levels) {
            let end = words.len() + 2 * levels;
            words.extend(coverage.iter().take(levels).flat_map(|(id, count)| [id, count]));
            words.resize(end, 0);
        }
    }

    /// Sets the state of `pixel` in `tile` from `words`. The tile must be empty.
    pub fn put(&self, tile: &mut Tile, pixel: UVec2, words: &[u32]) {
        let Some((own, [target, further @ ..])) = words.split_first_chunk::<{ Accumulator::WORDS }>() else {
            return;
        };
        tile.set_target(*target);
        if let Some(sums) = tile.sums_mut(pixel) {
            *sums = Accumulator::from_words(own);
        }
        let fixed = |words: &[u32]| Fixed::from_words([words[0], words[1], words[2], words[3]]);
        let further = match (tile.background_mut(pixel), further.split_at_checked(LIGHT_WORDS)) {
            (Some(sum), Some((words, [low, high, further @ ..]))) => {
                *sum = BackgroundSum {
                    sum: [0, 1, 2].map(|c| fixed(&words[c * Fixed::WORDS..])),
                    block_spread: float_of([*low, *high]),
                };
                further
            }
            _ => further,
        };
        let (light, features) = further.split_at(self.parts * LIGHT_WORDS);
        let parts = light.chunks_exact(LIGHT_WORDS);
        for (PartSum(sum), words) in tile.part_sums_mut(pixel).iter_mut().zip(parts) {
            *sum = [0, 1, 2].map(|c| fixed(&words[c * Fixed::WORDS..]));
        }
        let (Some(sums), Some(levels)) = (tile.features_mut(pixel), self.levels) else {
            return;
        };
        let (values, [lines, coverages @ ..]) = features.split_at(SUMS.len() * Fixed::WORDS) else {
            return;
        };
        let mut coverages = coverages;
        sums.lines = *lines;
        for (sum, words) in sums.sums.iter_mut().zip(values.chunks_exact(Fixed::WORDS)) {
            *sum = fixed(words);
        }
        let of_kinds = [&mut sums.objects, &mut sums.parts, &mut sums.materials];
        for (coverage, levels) in of_kinds.into_iter().zip(levels) {
            let words;
            (words, coverages) = coverages.split_at(2 * levels);
            for entry in words.chunks_exact(2).filter(|entry| entry[1] > 0) {
                coverage.add(entry[0], entry[1]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Backing, Block, Features, FilmSample, FirstSurface, Rect, SampleChange};
    use crate::math::{Vec2, Vec3};
    use std::collections::HashSet;

    #[test]
    fn words_represent_a_pixel() {
        let mut a = Accumulator::default();
        for i in 0..4 {
            let mut block = Block::default();
            for j in 0..64 {
                let surface = FirstSurface {
                    albedo: Spectrum::rgb(0.1, 0.2, 0.3),
                    normal: Vec3::new(-0.6, 0.0, 0.8),
                    depth: 3.5,
                    emitted: 2.5,
                    features: None,
                };
                block.add(
                    Spectrum::rgb(0.1 * i as f32, j as f32, 7e-5),
                    (j % 3 == 0).then_some(&surface),
                );
            }
            a.add(&block);
        }
        let words = a.to_words();
        assert_eq!(Accumulator::from_words(&words), a);
        // Each word has a unique name.
        let names: HashSet<String> = Accumulator::word_names().into_iter().collect();
        assert_eq!((names.len(), words.len()), (Accumulator::WORDS, Accumulator::WORDS));
        assert!(names.contains("sum.G.3") && names.contains("spread.B.1") && names.contains("samples"));
    }

    #[test]
    fn words_represent_parts_and_features() {
        let size = UVec2::new(3, 2);
        let empty = || {
            let film = Film::new(size, Rect::full(size));
            film.with_features().with_parts(2).with_backing(Backing::Transparent)
        };
        let mut film = empty();
        let tile = &mut film.tiles_mut()[0];
        for (i, pixel) in Rect::full(size).pixels().enumerate() {
            let mut block = tile.block();
            let surface = FirstSurface {
                albedo: Spectrum::ONE,
                normal: Vec3::Y,
                depth: 1.0,
                emitted: 0.0,
                features: Some(Features {
                    p: Vec3::new(0.3, -2.0, i as f32),
                    uv: Vec2::new(0.1, 0.2),
                    motion: Vec2::ZERO,
                    points: Default::default(),
                    object: i as u32,
                    part: 7,
                    material: 1,
                }),
            };
            block.add(&FilmSample {
                surface: Some(&surface),
                background: Spectrum::rgb(0.3 - i as f32, 0.1, 7.0),
                parts: &[Spectrum::rgb(0.1, i as f32, -7e5), Spectrum::splat(1e-6)],
                ..FilmSample::default()
            });
            tile.change(pixel, &block, SampleChange::Add);
        }
        let layout = StateLayout::of_film(&film);
        let names = layout.names();
        assert_eq!(StateLayout::of_names(&names), Some(layout));
        assert!(names.contains(&"light.1.B.3".to_string()) && layout.parts() == 2);
        // A list with a missing name is not a layout.
        assert_eq!(StateLayout::of_names(&names[1..]), None);

        let mut read = empty();
        for pixel in Rect::full(size).pixels() {
            let mut words = Vec::new();
            layout.append(&film.tiles()[0], pixel, &mut words);
            assert_eq!(words.len(), names.len());
            layout.put(&mut read.tiles_mut()[0], pixel, &words);
            let [a, b] = [&film, &read].map(|film| film.tile_at(pixel).unwrap());
            assert_eq!(a.part_sums(pixel), b.part_sums(pixel));
            assert_eq!(a.features(pixel), b.features(pixel));
            assert_eq!(a.background(pixel), b.background(pixel));
        }
    }
}
