//! Whether two pictures differ by more than their noise, where both say how noisy they are.

use super::{Rect, RgbImage, TILE_SIZE};
use crate::math::UVec2;
use statrs::function::{beta::checked_beta_reg, erf::erfc};
use std::collections::BTreeMap;

/// What is known of the noise of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Estimated variance of each pixel's mean, by channel; infinite where nothing is known.
    pub variance: Vec<[f32; 3]>,
    /// Number of samples of each pixel, on which the variance is based.
    pub samples: Vec<f32>,
    /// Whether up to `SHARING` pixels of a tile may have errors in common.
    pub is_shared: bool,
}

/// Pixels that share their paths, at most: so much larger than that of independent pixels the variance of a tile's mean may be (the errors of a group
/// then add up as they are, and not their squares).
const SHARING: f64 = 16.0;

/// How large the parts of the pictures are that a test compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// One pixel: Student's t, with the degrees of freedom of the picture with fewer samples. Where light is found rarely, most pixels
    /// have not seen how noisy they are: a variance counts no less than the mean over the 5 × 5 pixels around it, and over its tile.
    Pixel,
    /// The mean over a tile of 16 × 16 pixels, by the pixels' variances, which count no less than in the 3 × 3 tiles around it.
    Tile,
    /// A square of 4 × 4 tiles: Student's t of the relative differences of its tiles, whose errors are independent of each other.
    Region,
    /// The same of the whole picture.
    Whole,
}

/// The test of one scale that is furthest off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// Which scale.
    pub scale: Scale,
    /// Tests of this scale: places times channels.
    pub tests: usize,
    /// Its pixels.
    pub window: Rect,
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Mean of the reference there.
    pub reference: f64,
    /// Mean of the image there.
    pub image: f64,
    /// By what share the image is brighter than the reference; of regions and the whole the tiles' mean, weighted by how well each is known.
    pub difference: f64,
    /// Difference over its standard deviation: normal of tiles, else Student's t.
    pub score: f64,
    /// The chance that noise alone takes one of the tests of this scale so far off.
    pub p: f64,
}

/// What a family of tests says of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The chance of a false alarm that was allowed.
    pub level: f64,
    /// The chance that noise alone takes the most extreme of all tests so far off.
    pub p: f64,
    /// The most extreme test of each scale; of a scale without tests there is none.
    pub extremes: Vec<Extreme>,
}

impl Verdict {
    /// Of pictures of the pixels of `window`. `None` where they are not that, or where their variances tell nothing, as after one sample.
    ///
    /// All tests are one family: each scale has an equal share of the chance of a false alarm, and within a scale each test (Šidák 1967).
    /// Variances that are too large, such as those of low-discrepancy samples, only make alarms rarer.
    ///
    /// Regions and the whole are judged by the spread of the differences of their tiles, which needs no variance to be right: where samples are
    /// equally many, differences are as often positive as negative, and sums of such over the root of their squares have normal tails at
    /// most, however skewed the samples are (Efron 1969, "Student's t-Test Under Symmetry Conditions").
    pub fn new(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise), level: f64) -> Option<Self> {
        let pixels = Pixels::new(window, reference, image)?;
        let tiles: Vec<&Tile> = pixels.tiles.iter().collect();
        let regions = regions(&tiles);
        let scales = [
            pixels.extreme(),
            extreme(Scale::Tile, tiles.iter().flat_map(|tile| tile.tests())),
            extreme(Scale::Region, regions.iter().flat_map(|region| spread_tests(region))),
            extreme(Scale::Whole, spread_tests(&tiles).into_iter()),
        ];
        let extremes: Vec<Extreme> = scales.into_iter().flatten().collect();
        let least = extremes.iter().map(|e| e.p).min_by(f64::total_cmp)?;
        Some(Self {
            level,
            p: of_family(least, extremes.len()),
            extremes,
        })
    }

    /// Whether noise alone is not enough to make the difference.
    pub fn differs(&self) -> bool {
        self.p < self.level
    }

    /// The most telling of all tests.
    pub fn worst(&self) -> Option<&Extreme> {
        self.extremes.iter().min_by(|a, b| a.p.total_cmp(&b.p))
    }
}

/// Score of each pixel's channel that is furthest off, as [`Scale::Pixel`] has it, 0 where nothing is known; `None` as for [`Verdict::new`].
pub fn pixel_scores(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise)) -> Option<Vec<f32>> {
    let pixels = Pixels::new(window, reference, image)?.pixels;
    let furthest = |pixel: &Pixel| {
        let scores = (0..3).filter_map(|c| pixel.score(c));
        scores.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0) as f32
    };
    Some(pixels.iter().map(furthest).collect())
}

/// The chance that the least of `tests` independent p-values is `p` or less (Šidák 1967); of dependent ones that are as often too small together
/// it is less.
fn of_family(p: f64, tests: usize) -> f64 {
    -f64::exp_m1(tests as f64 * f64::ln_1p(-p))
}

/// P(|z| ≥ `score`) of a normal variable.
fn normal_tails(score: f64) -> f64 {
    erfc(score.abs() / std::f64::consts::SQRT_2)
}

/// P(|t| ≥ `score`) of Student's t.
fn student_tails(score: f64, freedom: f64) -> f64 {
    // From there on a score of 6 is as rare as a normal one, to 3 %.
    if freedom > 1e4 {
        return normal_tails(score);
    }
    student_tails_by_share(freedom / (freedom + score * score), freedom)
}

/// The same of a score whose `ν / (ν + t²)` is `share`.
fn student_tails_by_share(share: f64, freedom: f64) -> f64 {
    // P = I_share(ν / 2, 1 / 2), the regularised incomplete beta function
    checked_beta_reg(0.5 * freedom, 0.5, share.clamp(0.0, 1.0)).unwrap_or(1.0)
}

/// One test before it is corrected for the others.
struct Test {
    window: Rect,
    channel: usize,
    means: [f64; 2],
    difference: f64,
    score: f64,
    p: f64,
}

/// The test with the smallest p.
fn extreme(scale: Scale, tests: impl Iterator<Item = Test>) -> Option<Extreme> {
    let mut count = 0;
    let least = tests.inspect(|_| count += 1).min_by(|a, b| a.p.total_cmp(&b.p))?;
    Some(least.extreme(scale, count))
}

impl Test {
    fn extreme(self, scale: Scale, tests: usize) -> Extreme {
        Extreme {
            scale,
            tests,
            window: self.window,
            channel: self.channel,
            reference: self.means[0],
            image: self.means[1],
            difference: self.difference,
            score: self.score,
            p: of_family(self.p, tests),
        }
    }
}

/// All pixels of a window, row by row, and its tiles.
struct Pixels {
    window: Rect,
    pixels: Vec<Pixel>,
    tiles: Vec<Tile>,
}

struct Pixel {
    /// Of reference and image.
    values: [[f64; 3]; 2],
    /// Of the difference, where those around it have a say.
    variance: [f64; 3],
    /// Of the estimates of the variance.
    freedom: f64,
}

impl Pixels {
    /// `None` unless all have as many pixels as the window.
    fn new(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise)) -> Option<Self> {
        let sources = [Source::new(window, reference)?, Source::new(window, image)?];
        let is_shared = reference.1.is_shared || image.1.is_shared;
        let sharing = if is_shared { SHARING } else { 1.0 };
        let grid = Grid { window };
        let mut tiles: Vec<Tile> = (0..grid.tiles())
            .map(|tile| Tile::new(&sources, grid, tile, sharing))
            .collect();
        let mut pixels = Vec::with_capacity(window.area() as usize);
        for (i, at) in window.pixels().enumerate() {
            let tile = grid.tile_of(at);
            let values = [0, 1].map(|k| sources[k].values[i]);
            // Where nothing is known of a pixel's noise it says nothing of its tile.
            if sources.iter().all(|source| is_known(&source.variance[i])) {
                tiles[tile].add(&values);
            }
            let variance = |c: usize| {
                // What rounding to 32 bits leaves even of a difference without noise
                let rounding = f32::EPSILON as f64 * f64::max(values[0][c].abs(), values[1][c].abs());
                sources
                    .iter()
                    .map(|source| source.pixel_variance(i, tile, c))
                    .sum::<f64>()
                    + rounding * rounding
            };
            pixels.push(Pixel {
                values,
                variance: [0, 1, 2].map(variance),
                freedom: (f64::min(sources[0].samples[i], sources[1].samples[i]) - 1.0).max(1.0),
            });
        }
        Some(Self { window, pixels, tiles })
    }

    /// The most extreme pixel.
    fn extreme(&self) -> Option<Extreme> {
        let mut tests = 0;
        let mut worst: Option<(Test, f64)> = None;
        for (at, pixel) in self.window.pixels().zip(&self.pixels) {
            for channel in 0..3 {
                let Some(score) = pixel.score(channel) else { continue };
                tests += 1;
                // A smaller score of no less freedom need not be looked at further.
                let is_less =
                    |(test, freedom): &(Test, f64)| score.abs() <= test.score.abs() && pixel.freedom >= *freedom;
                if worst.as_ref().is_some_and(is_less) {
                    continue;
                }
                let p = student_tails(score, pixel.freedom);
                if worst.as_ref().is_none_or(|(test, _)| p < test.p) {
                    let max = at + UVec2::ONE;
                    let test = Test {
                        window: Rect { min: at, max },
                        channel,
                        means: pixel.values.map(|v| v[channel]),
                        difference: pixel.values[1][channel] / pixel.values[0][channel] - 1.0,
                        score,
                        p,
                    };
                    worst = Some((test, pixel.freedom));
                }
            }
        }
        worst.map(|(test, _)| test.extreme(Scale::Pixel, tests))
    }
}

impl Pixel {
    /// Difference over its standard deviation, where that is known.
    fn score(&self, channel: usize) -> Option<f64> {
        let [reference, image] = self.values.map(|v| v[channel]);
        ratio(image - reference, self.variance[channel].sqrt())
    }
}

/// `a / b` where both are finite, and 0 / 0 = 0.
fn ratio(a: f64, b: f64) -> Option<f64> {
    (a.is_finite() && b.is_finite()).then(|| if a == 0.0 { 0.0 } else { a / b })
}

/// One picture, and how noisy it is around each pixel and tile.
struct Source {
    values: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
    variance_around: Vec<[f64; 3]>,
    samples: Vec<f64>,
    /// Means over the tiles.
    tiles: Vec<[f64; 3]>,
    tiles_around: Vec<[f64; 3]>,
}

impl Source {
    fn new(window: Rect, (image, noise): (&RgbImage, &Noise)) -> Option<Self> {
        let lengths = [image.pixels.len(), noise.variance.len(), noise.samples.len()];
        let area = window.area();
        if area == 0 || lengths.iter().any(|&n| n as u64 != area) {
            return None;
        }
        let grid = Grid { window };
        let variance: Vec<[f64; 3]> = noise.variance.iter().map(|v| v.map(f64::from)).collect();
        let tiles = grid.means(&variance);
        Some(Self {
            values: image.pixels.iter().map(|v| v.map(f64::from)).collect(),
            variance_around: surroundings(&variance, window.size().x as usize, 2),
            samples: noise.samples.iter().map(|n| *n as f64).collect(),
            tiles_around: surroundings(&tiles, grid.columns(), 1),
            variance,
            tiles,
        })
    }

    fn pixel_variance(&self, pixel: usize, tile: usize, channel: usize) -> f64 {
        let own = self.variance[pixel][channel];
        own.max(self.variance_around[pixel][channel])
            .max(self.tiles[tile][channel])
    }

    fn tile_variance(&self, tile: usize, channel: usize) -> f64 {
        f64::max(self.tiles[tile][channel], self.tiles_around[tile][channel])
    }
}

fn is_known(variance: &[f64; 3]) -> bool {
    variance.iter().all(|v| v.is_finite())
}

/// Means over the squares of `2 · radius + 1` entries a side around each entry, of those that are known.
fn surroundings(variance: &[[f64; 3]], width: usize, radius: usize) -> Vec<[f64; 3]> {
    let height = variance.len() / width.max(1);
    let around = |at: usize, end: usize| at.saturating_sub(radius)..(at + radius + 1).min(end);
    let mean = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = around(y, height).filter_map(|y| variance.get(y * width..)?.get(around(x, width)));
        mean_of(rows.flatten())
    };
    (0..variance.len()).map(mean).collect()
}

/// Of those that are known; 0 if none is.
fn mean_of<'a>(variances: impl Iterator<Item = &'a [f64; 3]>) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for v in variances.filter(|v| is_known(v)) {
        (0..3).for_each(|c| sum[c] += v[c]);
        count += 1.0;
    }
    sum.map(|s| s / f64::max(count, 1.0))
}

/// The tiles of the full picture that a window meets, row by row.
#[derive(Clone, Copy)]
struct Grid {
    window: Rect,
}

impl Grid {
    fn first(self) -> UVec2 {
        self.window.min / TILE_SIZE
    }

    fn size(self) -> UVec2 {
        (self.window.max + UVec2::splat(TILE_SIZE - 1)) / TILE_SIZE - self.first()
    }

    fn columns(self) -> usize {
        self.size().x as usize
    }

    fn tiles(self) -> usize {
        self.columns() * self.size().y as usize
    }

    /// Of a pixel of the window.
    fn tile_of(self, at: UVec2) -> usize {
        let tile = at / TILE_SIZE - self.first();
        tile.y as usize * self.columns() + tile.x as usize
    }

    fn window_of(self, tile: usize) -> Rect {
        let at = UVec2::new((tile % self.columns()) as u32, (tile / self.columns()) as u32);
        let min = (self.first() + at) * TILE_SIZE;
        let max = min + UVec2::splat(TILE_SIZE);
        Rect { min, max }.intersection(self.window)
    }

    /// Means over the tiles of what each pixel of the window has.
    fn means(self, variance: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_tile: Vec<Vec<&[f64; 3]>> = vec![Vec::new(); self.tiles()];
        for (at, v) in self.window.pixels().zip(variance) {
            of_tile[self.tile_of(at)].push(v);
        }
        of_tile.into_iter().map(|all| mean_of(all.into_iter())).collect()
    }
}

/// Sums over the pixels of a tile, of those whose noise is known.
struct Tile {
    window: Rect,
    pixels: f64,
    /// Of reference and image.
    sums: [[f64; 3]; 2],
    /// Mean variance of the difference of a pixel.
    variance: [f64; 3],
    /// The same, where the tiles around it have a say.
    wide_variance: [f64; 3],
    /// Pixels that may have their errors in common.
    sharing: f64,
}

impl Tile {
    fn new([a, b]: &[Source; 2], grid: Grid, tile: usize, sharing: f64) -> Self {
        Self {
            window: grid.window_of(tile),
            pixels: 0.0,
            sums: [[0.0; 3]; 2],
            variance: [0, 1, 2].map(|c| a.tiles[tile][c] + b.tiles[tile][c]),
            wide_variance: [0, 1, 2].map(|c| a.tile_variance(tile, c) + b.tile_variance(tile, c)),
            sharing,
        }
    }

    fn add(&mut self, values: &[[f64; 3]; 2]) {
        self.pixels += 1.0;
        for (sums, values) in self.sums.iter_mut().zip(values) {
            (0..3).for_each(|c| sums[c] += values[c]);
        }
    }

    /// Of reference and image; NaN where no pixel counts.
    fn means(&self, channel: usize) -> [f64; 2] {
        self.sums.map(|sums| sums[channel] / self.pixels)
    }

    /// Of the difference of the means, where `sharing` pixels have their errors in common.
    fn variance(&self, of_pixel: f64, sharing: f64, channel: usize) -> f64 {
        // All pixels may be rounded to the same side.
        let rounding = f32::EPSILON as f64 * self.means(channel).into_iter().fold(0.0, f64::max);
        of_pixel * sharing.min(self.pixels) / self.pixels + rounding * rounding
    }

    fn tests(&self) -> impl Iterator<Item = Test> + '_ {
        (0..3).filter_map(|channel| {
            let means = self.means(channel);
            let variance = self.variance(self.wide_variance[channel], self.sharing, channel);
            let score = ratio(means[1] - means[0], variance.sqrt())?;
            Some(Test {
                window: self.window,
                channel,
                means,
                difference: means[1] / means[0] - 1.0,
                score,
                p: normal_tails(score),
            })
        })
    }

    /// Difference and its variance, each relative to the mean of both pictures; `None` where there is no light.
    fn relative(&self, channel: usize) -> Option<(f64, f64)> {
        let [reference, image] = self.means(channel);
        let mean = 0.5 * (reference + image);
        let variance = self.variance(self.variance[channel], 1.0, channel) / (mean * mean);
        (mean > 0.0 && variance > 0.0 && variance.is_finite()).then(|| ((image - reference) / mean, variance))
    }
}

/// Tiles of each square of 4 × 4, where there is more than one such square.
fn regions<'a>(tiles: &[&'a Tile]) -> Vec<Vec<&'a Tile>> {
    let mut regions: BTreeMap<(u32, u32), Vec<&Tile>> = BTreeMap::new();
    for tile in tiles {
        let place = tile.window.min / (4 * TILE_SIZE);
        regions.entry((place.y, place.x)).or_default().push(tile);
    }
    if regions.len() > 1 {
        regions.into_values().collect()
    } else {
        Vec::new()
    }
}

/// One test a channel, by the spread of the relative differences of `tiles`.
fn spread_tests(tiles: &[&Tile]) -> Vec<Test> {
    (0..3).filter_map(|channel| spread_test(tiles, channel)).collect()
}

fn spread_test(tiles: &[&Tile], channel: usize) -> Option<Test> {
    let relative: Vec<(f64, f64)> = tiles.iter().filter_map(|tile| tile.relative(channel)).collect();
    if relative.len() < 2 {
        return None;
    }
    let mut variances: Vec<f64> = relative.iter().map(|r| r.1).collect();
    variances.sort_by(f64::total_cmp);
    let usual = variances.get(variances.len() / 2)?;
    // Tiles count by how well they are known, but none much more than the usual one: a lamp has no noise, and would stand alone.
    let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for (difference, variance) in &relative {
        let weight = 1.0 / (variance + usual);
        weights += weight;
        sum += weight * difference;
        squares += (weight * difference).powi(2);
    }
    let mean = sum / weights;
    // What rounding to 32 bits may make of it
    let sum = sum.signum() * (sum.abs() - f32::EPSILON as f64 * weights).max(0.0);
    // With S the sum over the root of the squares, t = S √((n − 1) / (n − S²)), and ν / (ν + t²) is 1 − S² / n.
    let n = relative.len() as f64;
    let share = if squares > 0.0 {
        (1.0 - sum * sum / squares / n).clamp(0.0, 1.0)
    } else {
        1.0
    };
    let all: f64 = tiles.iter().map(|tile| tile.pixels).sum();
    let total = [0, 1].map(|k| tiles.iter().map(|tile| tile.sums[k][channel]).sum::<f64>());
    let windows = tiles.iter().map(|tile| tile.window);
    let window = windows.reduce(|a, b| Rect {
        min: a.min.min(b.min),
        max: a.max.max(b.max),
    })?;
    Some(Test {
        window,
        channel,
        means: total.map(|sum| sum / all),
        // From a share of the mean of both to one of the reference
        difference: (1.0 + 0.5 * mean) / (1.0 - 0.5 * mean) - 1.0,
        score: sum.signum() * ((n - 1.0) * (1.0 - share) / share).sqrt(),
        p: student_tails_by_share(share, n - 1.0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::mix;

    /// Uniform numbers, by count.
    struct Numbers(u64);

    impl Numbers {
        fn uniform(&mut self) -> f64 {
            self.0 += 1;
            (mix(mix(self.0)) >> 11) as f64 / (1u64 << 53) as f64
        }

        /// Box and Muller 1958.
        fn normal(&mut self) -> f64 {
            let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
            radius * (std::f64::consts::TAU * self.uniform()).cos()
        }
    }

    const WINDOW: Rect = Rect {
        min: UVec2::new(10, 7),
        max: UVec2::new(106, 87),
    };

    type Picture = (RgbImage, Noise);

    /// The means of `n` samples of each pixel, of which `sample` draws one.
    fn picture(n: u32, mut sample: impl FnMut(UVec2) -> [f64; 3]) -> Picture {
        let (mut pixels, mut variance) = (Vec::new(), Vec::new());
        for at in WINDOW.pixels() {
            let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
            for _ in 0..n {
                let value = sample(at);
                for c in 0..3 {
                    sum[c] += value[c];
                    squares[c] += value[c] * value[c];
                }
            }
            let n = n as f64;
            pixels.push(sum.map(|s| (s / n) as f32));
            variance.push([0, 1, 2].map(|c| ((squares[c] - sum[c] * sum[c] / n).max(0.0) / (n * (n - 1.0))) as f32));
        }
        let size = WINDOW.size();
        let image = RgbImage {
            width: size.x as usize,
            height: size.y as usize,
            pixels,
        };
        let samples = vec![n as f32; variance.len()];
        (
            image,
            Noise {
                variance,
                samples,
                is_shared: false,
            },
        )
    }

    /// A surface that gets brighter to the right, under noise of 30 % a sample that channels share.
    fn grainy(numbers: &mut Numbers, n: u32) -> Picture {
        picture(n, |at| {
            let x = 1.0 + 0.3 * numbers.normal();
            [0.2, 0.5, 0.1].map(|v| v * (1.0 + at.x as f64 / 50.0) * x)
        })
    }

    /// Light that few samples meet: 1 in 50 has 50 times the mean, beside a little that all have.
    fn spotted(numbers: &mut Numbers, n: u32) -> Picture {
        picture(n, |_| {
            let light = if numbers.uniform() < 0.02 { 50.0 } else { 0.0 };
            [0.1 + 0.9 * light; 3]
        })
    }

    fn judge((a, b): (&Picture, &Picture), level: f64) -> Verdict {
        Verdict::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), level).unwrap()
    }

    fn alarms(pairs: u32, level: f64, mut pair: impl FnMut() -> (Picture, Picture)) -> u32 {
        let mut alarm = || {
            let (a, b) = pair();
            u32::from(judge((&a, &b), level).differs())
        };
        (0..pairs).map(|_| alarm()).sum()
    }

    #[test]
    fn tails_of_the_tables() {
        for (p, expected) in [
            (normal_tails(-1.959_964), 0.05),
            (normal_tails(6.109_41), 1e-9),
            (student_tails(12.706_2, 1.0), 0.05),
            (student_tails(-2.228_14, 10.0), 0.05),
            (student_tails(4.586_9, 10.0), 1e-3),
            (of_family(0.01, 100), 0.633_968),
            (of_family(1e-12, 1000), 1e-9),
        ] {
            assert!((p / expected - 1.0).abs() < 1e-4, "{p}, expected {expected}");
        }
        assert_eq!((student_tails(f64::INFINITY, 3.0), student_tails(0.0, 3.0)), (0.0, 1.0));
    }

    /// At a level of 0.2 there may be 12 false alarms in 60, and 25 with a chance of 1e-4. Skewed noise, and samples that are not equally many, must not
    /// make more.
    #[test]
    fn false_alarms_keep_to_their_level() {
        let mut numbers = Numbers(1);
        let grainy_alarms = alarms(60, 0.2, || (grainy(&mut numbers, 8), grainy(&mut numbers, 8)));
        let uneven = alarms(60, 0.2, || (grainy(&mut numbers, 24), grainy(&mut numbers, 4)));
        let spots = alarms(60, 0.2, || (spotted(&mut numbers, 16), spotted(&mut numbers, 16)));
        let uneven_spots = alarms(20, 0.2, || (spotted(&mut numbers, 128), spotted(&mut numbers, 16)));
        println!("false alarms: {grainy_alarms}, {uneven}, {spots} of 60, {uneven_spots} of 20");
        // The scale of the whole alone has a quarter of the level.
        assert!((1..=25).contains(&grainy_alarms), "{grainy_alarms}");
        assert!(
            uneven <= 25 && spots <= 25 && uneven_spots <= 12,
            "{uneven}, {spots}, {uneven_spots}"
        );
    }

    /// Sixteen pixels of a tile have the same error: by their variances alone, means of tiles are four times too far off.
    #[test]
    fn shared_errors_are_allowed_for() {
        let mut numbers = Numbers(2);
        let mut shared = || {
            let errors: Vec<f64> = (0..16 * 49).map(|_| numbers.normal()).collect();
            let mut picture = picture(2, |_| [1.0; 3]);
            for (i, at) in WINDOW.pixels().enumerate() {
                let tile = at / TILE_SIZE;
                let group = (tile.y * 7 + tile.x) * 16 + (at.x * 5 + at.y) % 16;
                picture.0.pixels[i] = [1.0 + 0.1 * errors[group as usize] as f32; 3];
            }
            picture.1.variance.fill([0.01; 3]);
            picture.1.samples.fill(1e6);
            picture.1.is_shared = true;
            picture
        };
        let pairs: Vec<(Picture, Picture)> = (0..40).map(|_| (shared(), shared())).collect();
        let mut next = pairs.iter().cloned();
        assert!(alarms(40, 0.05, || next.next().unwrap()) <= 9);
        // So they are not where that is not said.
        let mut next = pairs.into_iter().map(|(mut a, mut b)| {
            (a.1.is_shared, b.1.is_shared) = (false, false);
            (a, b)
        });
        assert_eq!(alarms(40, 0.05, || next.next().unwrap()), 40);
    }

    #[test]
    fn differences_are_found_where_they_are() {
        let mut numbers = Numbers(3);
        let (a, b) = (grainy(&mut numbers, 16), grainy(&mut numbers, 16));
        assert!(!judge((&a, &b), 0.01).differs());
        let changed = |f: &dyn Fn(UVec2, [f32; 3]) -> [f32; 3]| {
            let mut image = b.clone();
            let pixels = WINDOW.pixels().zip(&mut image.0.pixels);
            pixels.for_each(|(at, pixel)| *pixel = f(at, *pixel));
            judge((&a, &image), 0.01)
        };
        // The whole by 1 %, where a pixel's error is 7.5 %
        let verdict = changed(&|_, p| p.map(|v| 1.01 * v));
        let worst = verdict.worst().unwrap();
        assert!(verdict.differs() && worst.scale == Scale::Whole, "{verdict:?}");
        assert!(
            (worst.difference - 0.01).abs() < 0.004 && worst.window == WINDOW,
            "{worst:?}"
        );

        // One pixel's green
        let place = UVec2::new(77, 33);
        let verdict = changed(&|at, [r, g, b]| [r, if at == place { 3.0 * g } else { g }, b]);
        let worst = verdict.worst().unwrap();
        assert!(
            verdict.differs() && (worst.scale, worst.channel) == (Scale::Pixel, 1),
            "{verdict:?}"
        );
        assert_eq!(worst.window.min, place);
        assert!(worst.score > 9.0 && worst.p < 0.0025, "{worst:?}");

        // A tile by 5 %, and its neighbour by as much into the other direction
        let verdict = changed(&|at, p| match (at / TILE_SIZE).to_array() {
            [3, 2] => p.map(|v| 1.05 * v),
            [4, 2] => p.map(|v| 0.95 * v),
            _ => p,
        });
        let worst = verdict.worst().unwrap();
        assert!(verdict.differs() && worst.scale == Scale::Tile, "{verdict:?}");
        assert!(
            worst.window.min.y == 32 && [48, 64].contains(&worst.window.min.x),
            "{worst:?}"
        );
    }

    #[test]
    fn what_is_not_known_is_not_judged() {
        let mut numbers = Numbers(4);
        let (a, mut b) = (grainy(&mut numbers, 4), grainy(&mut numbers, 4));
        b.0.pixels.iter_mut().for_each(|p| *p = [7.0; 3]);
        b.1.variance.fill([f32::INFINITY; 3]);
        assert_eq!(Verdict::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), 0.01), None);
        b.1.variance.truncate(5);
        assert_eq!(Verdict::new(WINDOW, (&a.0, &a.1), (&b.0, &b.1), 0.01), None);
        // Without noise, rounding is no difference, and anything else is.
        let same = (
            a.0.clone(),
            Noise {
                variance: vec![[0.0; 3]; a.0.pixels.len()],
                ..a.1.clone()
            },
        );
        let mut rounded = same.clone();
        rounded
            .0
            .pixels
            .iter_mut()
            .for_each(|p| *p = p.map(|v| v * (1.0 + f32::EPSILON)));
        assert!(!judge((&same, &rounded), 0.01).differs());
        rounded.0.pixels[100][2] *= 1.001;
        assert!(judge((&same, &rounded), 0.01).differs());
    }
}
