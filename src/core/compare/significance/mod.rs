//! Significance tests: do two images differ by more than their noise, where both have variances?
//!
//! docs/guide/reference/compare.md says what is tested at the four scales (pixel, tile, region, whole) and how often the answer is wrong. The scales follow from how
//! errors are correlated. Pixels that share paths have errors in common, so a tile allows for sixteen times the variance of its pixels. Scales larger
//! than a tile are judged by the variance between its tiles, which share nothing. That variance is right under any sampler, whereas the variance
//! channel is too large for low-discrepancy points.
//!
//! Some methods have photons, records or chains that reach across tiles (`CommonErrors`; the renderer writes the attribute `embrasure.commonErrors`).
//! Where samples are independent iterations (`pssmlt`, `mlt`, `sppm`), pixels are judged as usual, and tiles as if all errors of their pixels were
//! one. Where all samples use one map (`photon-map`, `irradiance-cache`), no variance is right. The whole is then judged by its tiles as if there
//! were few of them.

mod noise;

use super::relative_change;
use crate::film::{Rect, RgbImage, TILE_SIZE};
use crate::math::UVec2;
pub use noise::{CommonErrors, Noise};
use noise::{NoiseTile, Pixel, Pixels, ratio};
use statrs::function::{beta::checked_beta_reg, erf::erfc};
use std::collections::BTreeMap;

/// Size of the parts of the pictures that a test compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// One pixel: Student's t, with the degrees of freedom of the picture with fewer samples. Where light is found rarely, most pixels
    /// have not seen how noisy they are: a variance counts no less than the mean over the 5 × 5 pixels around it, and over its tile.
    Pixel,
    /// The mean over a tile of 16 × 16 pixels, by the pixels' variances, which count no less than in the 3 × 3 tiles around it. Where all pixels of a sample
    /// may have errors in common: as if they had all of them, which is the worst that there can be, by Student's t.
    Tile,
    /// A square of 4 × 4 tiles: Student's t of the relative differences of its tiles, whose errors are independent of each other.
    Region,
    /// Student's t of the tiles of the whole picture. Where tiles may have errors in common: as if there were four times fewer, and sixteen or eight at most.
    Whole,
}

/// The test of one scale that is furthest off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// Which scale.
    pub scale: Scale,
    /// Tests of this scale: places times channels.
    pub tests: usize,
    /// Pixels of the test.
    pub window: Rect,
    /// 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Mean of the reference there.
    pub reference: f64,
    /// Mean of the image there.
    pub image: f64,
    /// `image` minus `reference` as a share of `reference`: 0 where both are 0, and infinite where only the reference is.
    pub difference: f64,
    /// Difference over its standard deviation: normal of tiles, else Student's t. That of regions and the whole is of the mean of the tiles' relative
    /// differences, weighted by how well each is known, which may have another sign than `difference`.
    pub score: f64,
    /// The chance that noise alone takes one of the tests of this scale so far off.
    pub p: f64,
}

/// What a family of tests says of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Significance {
    /// The chance of a false alarm that was allowed.
    pub level: f64,
    /// The chance that noise alone takes the most extreme of all tests so far off.
    pub p: f64,
    /// The most extreme test of each scale; of a scale without tests there is none.
    pub extremes: Vec<Extreme>,
    /// Which errors pixels may have in common, in the picture where that is worse: it decides what is tested.
    pub common: CommonErrors,
    /// About how many samples the noise consists of, where these are rare and the pictures differ in how they find them: heavy tails. The whole alone is tested
    /// then, and nothing where they are fewer than [`MIN_RARE`].
    pub rare: Option<f64>,
}

/// Rare samples, at least, of which a sum is told from another one: the chance that half of 50 expected ones are missing is below 10^-4.
pub const MIN_RARE: f64 = 50.0;

impl Significance {
    /// Tests of two pictures of the pixels of `window`. `None` where the pictures have other pixels, or variances are unknown, as after
    /// one sample.
    ///
    /// All tests are one family: each scale has an equal share of the chance of a false alarm, and within a scale each test (Šidák 1967).
    /// Variances that are too large, such as those of low-discrepancy samples, only make alarms rarer.
    ///
    /// Regions and the whole are judged by the spread of the differences of their tiles, which needs no variance to be right: where samples are
    /// equally many, differences are as often positive as negative, and sums of such over the root of their squares have normal tails at
    /// most, however skewed the samples are (Efron 1969, "Student's t-Test Under Symmetry Conditions").
    pub fn new(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise), level: f64) -> Option<Self> {
        let pixels = Pixels::new(window, reference, image)?;
        let tiles: Vec<&NoiseTile> = pixels.tiles.iter().collect();
        let common = pixels.common;
        if let Some(rare) = pixels.rare {
            // Most tiles have seen none of these samples. Means of relative differences, weighted by what tiles know of their noise, would be those of such tiles.
            let tests = (rare >= MIN_RARE).then(|| sum_tests(&tiles));
            let whole = extreme(Scale::Whole, tests.into_iter().flatten());
            return Some(Self {
                level,
                p: whole.as_ref().map_or(1.0, |whole| whole.p),
                extremes: whole.into_iter().collect(),
                common,
                rare: Some(rare),
            });
        }
        // What supposes that tiles are independent, or that variances are right, is left out where they are not.
        let regions = match common {
            CommonErrors::None | CommonErrors::Tile => regions(&tiles),
            CommonErrors::Sample | CommonErrors::Picture => Vec::new(),
        };
        let by_variance = match common {
            CommonErrors::Picture => [None, None],
            _ => [
                pixels.extreme(),
                extreme(Scale::Tile, tiles.iter().flat_map(|tile| tile.tests())),
            ],
        };
        let by_spread = [
            extreme(
                Scale::Region,
                regions.iter().flat_map(|region| spread_tests(region, common)),
            ),
            extreme(Scale::Whole, spread_tests(&tiles, common).into_iter()),
        ];
        let scales = by_variance.into_iter().chain(by_spread);
        let extremes: Vec<Extreme> = scales.flatten().collect();
        let min = extremes.iter().map(|e| e.p).min_by(f64::total_cmp)?;
        Some(Self {
            level,
            p: of_family(min, extremes.len()),
            extremes,
            common,
            rare: None,
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

/// Score of each pixel's channel that is furthest off, as [`Scale::Pixel`] has it, 0 where nothing is known; `None` as for [`Significance::new`].
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

/// Probability of both tails beyond a score whose `ν / (ν + t²)` is `share`.
fn student_tails_by_share(share: f64, freedom: f64) -> f64 {
    // P = I_share(ν / 2, 1 / 2), the regularised incomplete beta function
    checked_beta_reg(0.5 * freedom, 0.5, share.clamp(0.0, 1.0)).unwrap_or(1.0)
}

/// One test before it is corrected for the others.
struct Test {
    window: Rect,
    channel: usize,
    means: [f64; 2],
    score: f64,
    p: f64,
}

/// The test with the smallest p.
fn extreme(scale: Scale, tests: impl Iterator<Item = Test>) -> Option<Extreme> {
    let mut count = 0;
    let min = tests.inspect(|_| count += 1).min_by(|a, b| a.p.total_cmp(&b.p))?;
    Some(min.extreme(scale, count))
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
            difference: relative_change(self.means[0], self.means[1]),
            score: self.score,
            p: of_family(self.p, tests),
        }
    }
}

impl Pixels {
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

impl NoiseTile {
    fn tests(&self) -> impl Iterator<Item = Test> + '_ {
        (0..3).filter_map(|channel| {
            let means = self.means(channel);
            let variance = self.variance(self.wide_variance[channel], self.sharing, channel);
            let score = ratio(means[1] - means[0], variance.sqrt())?;
            Some(Test {
                window: self.window,
                channel,
                means,
                score,
                p: student_tails(score, self.freedom),
            })
        })
    }
}

/// Tiles of each square of 4 × 4, where there is more than one such square.
fn regions<'a>(tiles: &[&'a NoiseTile]) -> Vec<Vec<&'a NoiseTile>> {
    let mut regions: BTreeMap<(u32, u32), Vec<&NoiseTile>> = BTreeMap::new();
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

/// Tiles that have errors of their own, of so many.
fn independent_tiles(tiles: usize, common: CommonErrors) -> f64 {
    match common {
        CommonErrors::None | CommonErrors::Tile => tiles as f64,
        // A photon, a record or a chain reaches some tiles. What all of them have in common, such as how much light chains share out, or how many photons
        // found the one door, must not count for a difference: among sixteen the mean has to be as large as the spread, among eight larger.
        CommonErrors::Sample => (tiles as f64 / 4.0).min(16.0),
        CommonErrors::Picture => (tiles as f64 / 4.0).min(8.0),
    }
}

/// One test a channel, by the spread of the relative differences of `tiles`.
fn spread_tests(tiles: &[&NoiseTile], common: CommonErrors) -> Vec<Test> {
    let test = |channel| spread_test(tiles, common, channel);
    (0..3).filter_map(test).collect()
}

/// One test a channel, by the spread of the differences of `tiles` themselves: each counts as much as it adds to the picture.
fn sum_tests(tiles: &[&NoiseTile]) -> Vec<Test> {
    let test = |channel: usize| {
        let terms = tiles.iter().map(|tile| tile.sums[1][channel] - tile.sums[0][channel]);
        let (sum, squares) = terms.fold((0.0, 0.0), |(a, b), term| (a + term, b + term * term));
        let n = tiles.len() as f64;
        let share = within_share(sum, squares, n);
        Some(Test {
            window: around(tiles)?,
            channel,
            means: whole_means(tiles, channel),
            score: student_score(sum, share, n - 1.0),
            p: if n < 2.0 {
                1.0
            } else {
                student_tails_by_share(share, n - 1.0)
            },
        })
    };
    (0..3).filter_map(test).collect()
}

/// Share of the `squares` of `n` terms that their `sum` does not explain; 1 where all terms are 0. With S the sum over the root of the squares it is
/// 1 − S² / n, which is ν / (ν + t²) for Student's t = S √((n − 1) / (n − S²)).
fn within_share(sum: f64, squares: f64, n: f64) -> f64 {
    if squares > 0.0 {
        (1.0 - sum * sum / squares / n).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// Student's t of terms with that `sum` and [`within_share`], for so many degrees of freedom.
fn student_score(sum: f64, share: f64, freedom: f64) -> f64 {
    sum.signum() * (freedom * (1.0 - share) / share).sqrt()
}

/// Means of reference and image over all pixels of `tiles`.
fn whole_means(tiles: &[&NoiseTile], channel: usize) -> [f64; 2] {
    let pixels: f64 = tiles.iter().map(|tile| tile.pixels).sum();
    [0, 1].map(|k| tiles.iter().map(|tile| tile.sums[k][channel]).sum::<f64>() / pixels)
}

/// The window that holds all of `tiles`.
fn around(tiles: &[&NoiseTile]) -> Option<Rect> {
    let windows = tiles.iter().map(|tile| tile.window);
    windows.reduce(|a, b| Rect {
        min: a.min.min(b.min),
        max: a.max.max(b.max),
    })
}

fn spread_test(tiles: &[&NoiseTile], common: CommonErrors, channel: usize) -> Option<Test> {
    let relative: Vec<(f64, f64)> = tiles.iter().filter_map(|tile| tile.relative(channel)).collect();
    let independent = independent_tiles(relative.len(), common);
    if independent < 2.0 {
        return None;
    }
    let mut variances: Vec<f64> = relative.iter().map(|r| r.1).collect();
    variances.sort_by(f64::total_cmp);
    let usual = variances.get(variances.len() / 2)?;
    // Tiles count by how well they are known, but none much more than the usual one: a lamp has no noise, and would stand alone.
    let weighted = relative.iter().map(|(difference, variance)| {
        let weight = 1.0 / (variance + usual);
        (weight, weight * difference)
    });
    let weights: f64 = weighted.clone().map(|(weight, _)| weight).sum();
    let max = match common {
        CommonErrors::None | CommonErrors::Tile => f64::INFINITY,
        // Few are independent, and a difference that is larger here than there must not look like noise: none counts more than half of them do.
        CommonErrors::Sample | CommonErrors::Picture => {
            let sizes = weighted.clone().map(|(_, term)| term.abs());
            let mut sizes: Vec<f64> = sizes.filter(|size| *size > 0.0).collect();
            sizes.sort_by(f64::total_cmp);
            sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)
        }
    };
    let terms = weighted.map(|(_, term)| term.clamp(-max, max));
    let (sum, squares) = terms.fold((0.0, 0.0), |(a, b), term| (a + term, b + term * term));
    // What rounding to 32 bits may make of it
    let sum = sum.signum() * (sum.abs() - f32::EPSILON as f64 * weights).max(0.0);
    // Of c tiles with one error S² is c times as large, and n is: what is left of them in the share is their number in ν.
    let n = relative.len() as f64;
    let share = within_share(sum, squares, n);
    Some(Test {
        window: around(tiles)?,
        channel,
        means: whole_means(tiles, channel),
        score: student_score(sum, share, independent - 1.0),
        p: student_tails_by_share(share, independent - 1.0),
    })
}

#[cfg(test)]
mod tests;
