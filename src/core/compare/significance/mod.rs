//! Significance tests: tell whether two images with known variances differ by more than their
//! noise.
//!
//! docs/guide/reference/compare.md describes the tests at the four scales (pixel, tile, region,
//! whole) and their rates of error. The scales follow from the correlation of errors. Pixels that
//! share light paths have common errors. The variance of the sum of a tile may therefore be sixteen
//! times as large as for independent pixels. Scales larger than a tile use the variance between
//! tiles, because tiles have no common errors. This variance is right for any sampler. With
//! low-discrepancy points, the variances in the channel `variance` of the picture are too large.
//!
//! In some methods, one photon, record or chain contributes to several tiles (`CommonErrors`; the
//! renderer writes the attribute `embrasure.commonErrors`). If samples are independent iterations
//! (`pssmlt`, `mlt`, `sppm`), pixels are tested as usual, and tiles as if all pixels of a tile had
//! the same error. If all samples use one map (`photon-map`, `irradiance-cache`), no variance
//! includes the error of the map. Only the whole picture is then tested, as if it had fewer tiles.

mod noise;

use super::relative_change;
use crate::film::{Rect, RgbImage, TILE_SIZE};
use crate::math::UVec2;
pub use noise::{CommonErrors, Noise};
use noise::{NoiseTile, Pixel, Pixels, ratio};
use statrs::function::{beta::checked_beta_reg, erf::erfc};
use std::collections::BTreeMap;

/// Size of the regions that a test compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Single pixel: Student's t, with the degrees of freedom of the picture with fewer samples. If
    /// few samples find light, the estimated variance of most pixels is too low. The variance is
    /// therefore at least the mean over the 5 × 5 pixels around the pixel, and at least the mean
    /// over the pixel's tile.
    Pixel,
    /// Mean over a tile of 16 × 16 pixels. The variance of the mean follows from the variances of
    /// the pixels. The variance of a pixel is at least the mean over the 3 × 3 tiles around the
    /// tile. If all pixels may have a common error in each sample ([`CommonErrors::Sample`]), the
    /// tile is tested by Student's t for the worst case, in which all pixels of the tile have the
    /// same error.
    Tile,
    /// A square of 4 × 4 tiles: Student's t of the relative differences of the tiles. The test
    /// assumes that the errors of tiles are independent.
    Region,
    /// Student's t of the tiles of the whole picture. If tiles may have common errors, the test
    /// assumes that a quarter of the tiles is independent, but at most sixteen tiles for
    /// [`CommonErrors::Sample`], and at most eight for [`CommonErrors::Picture`].
    Whole,
}

/// The test with the smallest p-value of one scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtremeTest {
    /// Size of the regions that the test compares.
    pub scale: Scale,
    /// Number of tests of this scale: positions times channels.
    pub tests: usize,
    /// Pixels that the test compares.
    pub window: Rect,
    /// Channel: 0 red, 1 green, 2 blue.
    pub channel: usize,
    /// Mean of the reference in `window`.
    pub reference: f64,
    /// Mean of the image in `window`.
    pub image: f64,
    /// `image` minus `reference`, relative to `reference`: 0 if both are 0, and infinite if only
    /// `reference` is 0.
    pub difference: f64,
    /// Difference divided by its standard deviation. The score has Student's t-distribution. The
    /// score of a tile is normally distributed, unless all pixels may have common errors in each
    /// sample. For regions and the whole, the difference is the weighted mean of the relative
    /// differences of tiles. The weights follow from the tiles' variances, so `score` and
    /// `difference` may have different signs.
    pub score: f64,
    /// Probability that noise alone gives at least one test of this scale a score as extreme as
    /// this: the p-value, corrected for the number of tests.
    pub p: f64,
}

/// Result of a family of tests of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct Significance {
    /// Significance level: the allowed probability of a false alarm.
    pub level: f64,
    /// Probability that noise alone gives at least one of all tests a score as extreme as the worst
    /// score: the p-value, corrected for the number of scales.
    pub p: f64,
    /// Most extreme test of each scale; scales without tests are left out.
    pub extremes: Vec<ExtremeTest>,
    /// Kind of the errors that pixels have in common. If the two pictures have different kinds, it
    /// is the more severe one. The kind determines which tests are made.
    pub common: CommonErrors,
    /// Approximate number of rare bright samples that cause most of the noise (heavy tails). `None`
    /// if there are no such samples, or if both pictures were sampled alike. If there are rare
    /// samples, only the whole picture is tested. If there are fewer than [`MIN_RARE`] rare
    /// samples, nothing is tested.
    pub rare: Option<f64>,
}

/// Minimum number of rare samples for a test of sums. With 50 expected samples, the probability
/// that half of them are missing is below 10^-4.
pub const MIN_RARE: f64 = 50.0;

impl Significance {
    /// Tests if two pictures of the pixels of `window` differ, at the significance level `level`.
    /// `None` if the pictures have a different number of pixels, or if variances are unknown, as
    /// after one sample.
    ///
    /// All tests are one family. The probability of a false alarm is divided equally among the
    /// scales, and within a scale equally among its tests (Šidák 1967). Estimated variances may be
    /// too large, as for low-discrepancy samples. They only make false alarms rarer.
    ///
    /// Regions and the whole picture are tested by the spread of the differences of their tiles.
    /// These tests need no variance of pixels. With equal numbers of samples, differences have
    /// symmetric distributions. The sum of symmetric differences, divided by the square root of the
    /// sum of their squares, has at most normal tails, for any skewness of the samples (Efron 1969,
    /// "Student's t-Test Under Symmetry Conditions").
    pub fn new(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise), level: f64) -> Option<Self> {
        let pixels = Pixels::new(window, reference, image)?;
        let tiles: Vec<&NoiseTile> = pixels.tiles.iter().collect();
        let common = pixels.common;
        if let Some(rare) = pixels.rare {
            // Most tiles have no rare sample, and therefore a low variance. Means of relative
            // differences, weighted by the inverse variances, would be means over these tiles only.
            // Therefore test the sums of tiles.
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
        // Leave out tests that assume independent tiles if tiles have common errors, and tests that
        // assume correct variances if no variance includes the error of a map.
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
        let extremes: Vec<ExtremeTest> = scales.flatten().collect();
        let min = extremes.iter().map(|e| e.p).min_by(f64::total_cmp)?;
        Some(Self {
            level,
            p: of_family(min, extremes.len()),
            extremes,
            common,
            rare: None,
        })
    }

    /// Returns true if the pictures differ by more than their noise.
    pub fn differs(&self) -> bool {
        self.p < self.level
    }

    /// The test with the smallest p-value of all scales.
    pub fn worst(&self) -> Option<&ExtremeTest> {
        self.extremes.iter().min_by(|a, b| a.p.total_cmp(&b.p))
    }
}

/// Returns for each pixel the score of [`Scale::Pixel`] with the largest absolute value over the
/// channels; 0 if unknown. `None` in the same cases as [`Significance::new`].
pub fn pixel_scores(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise)) -> Option<Vec<f32>> {
    let pixels = Pixels::new(window, reference, image)?.pixels;
    let furthest = |pixel: &Pixel| {
        let scores = (0..3).filter_map(|c| pixel.score(c));
        scores.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0) as f32
    };
    Some(pixels.iter().map(furthest).collect())
}

/// Probability that the minimum of `tests` independent p-values is at most `p` (Šidák 1967). The
/// probability is lower for positively dependent p-values.
fn of_family(p: f64, tests: usize) -> f64 {
    -f64::exp_m1(tests as f64 * f64::ln_1p(-p))
}

/// P(|z| ≥ `score`) of a normal variable.
fn normal_tails(score: f64) -> f64 {
    erfc(score.abs() / std::f64::consts::SQRT_2)
}

/// P(|t| ≥ `score`) of Student's t.
fn student_tails(score: f64, freedom: f64) -> f64 {
    // Above 10⁴ degrees of freedom, the normal distribution approximates the tail at a score of 6
    // with an error of 3 %.
    if freedom > 1e4 {
        return normal_tails(score);
    }
    student_tails_by_share(freedom / (freedom + score * score), freedom)
}

/// P(|T| ≥ t), where T has Student's t-distribution. `share` is ν / (ν + t²), where ν is `freedom`,
/// the degrees of freedom.
fn student_tails_by_share(share: f64, freedom: f64) -> f64 {
    // P = I_share(ν / 2, 1 / 2), the regularised incomplete beta function
    checked_beta_reg(0.5 * freedom, 0.5, share.clamp(0.0, 1.0)).unwrap_or(1.0)
}

/// A test before the correction for multiple tests.
struct Test {
    window: Rect,
    channel: usize,
    means: [f64; 2],
    score: f64,
    p: f64,
}

/// The test with the smallest p-value, corrected for the number of tests.
fn extreme(scale: Scale, tests: impl Iterator<Item = Test>) -> Option<ExtremeTest> {
    let mut count = 0;
    let min = tests.inspect(|_| count += 1).min_by(|a, b| a.p.total_cmp(&b.p))?;
    Some(min.extreme(scale, count))
}

impl Test {
    fn extreme(self, scale: Scale, tests: usize) -> ExtremeTest {
        ExtremeTest {
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
    /// Test of the most extreme pixel and channel.
    fn extreme(&self) -> Option<ExtremeTest> {
        let mut tests = 0;
        let mut worst: Option<(Test, f64)> = None;
        for (at, pixel) in self.window.pixels().zip(&self.pixels) {
            for channel in 0..3 {
                let Some(score) = pixel.score(channel) else { continue };
                tests += 1;
                // If the score is not more extreme than the worst score so far, and has at least as
                // many degrees of freedom, the p-value is at least as large. Skip the pixel.
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

/// Tiles of each square of 4 × 4 tiles. Empty if there is only one square.
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

/// Number of independent tiles among `tiles` tiles.
fn independent_tiles(tiles: usize, common: CommonErrors) -> f64 {
    match common {
        CommonErrors::None | CommonErrors::Tile => tiles as f64,
        // A photon, a record or a chain contributes to several tiles. Errors that all tiles have in
        // common must not count as a difference. Examples are the distribution of light between
        // chains, or the number of photons through a single door. With sixteen tiles, a difference
        // is significant if its mean is as large as the spread over the tiles. With eight tiles the
        // mean must be larger.
        CommonErrors::Sample => (tiles as f64 / 4.0).min(16.0),
        CommonErrors::Picture => (tiles as f64 / 4.0).min(8.0),
    }
}

/// Tests each channel by the spread of the relative differences of `tiles`.
fn spread_tests(tiles: &[&NoiseTile], common: CommonErrors) -> Vec<Test> {
    let test = |channel| spread_test(tiles, common, channel);
    (0..3).filter_map(test).collect()
}

/// One test for each channel, by the spread of the differences between the sums of reference and
/// image in each of `tiles`. Unlike in [`spread_tests`], bright tiles have more weight than dark
/// tiles.
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

/// Fraction of the sum of squares that is variation around the mean of the `n` terms. `sum` is the
/// sum of the terms, and `squares` is the sum of their squares. With S = sum / √squares, the
/// fraction is 1 − S² / n, which is ν / (ν + t²) for Student's t = S √((n − 1) / (n − S²)). The
/// fraction is 1 if all terms are 0.
fn within_share(sum: f64, squares: f64, n: f64) -> f64 {
    if squares > 0.0 {
        (1.0 - sum * sum / squares / n).clamp(0.0, 1.0)
    } else {
        1.0
    }
}

/// Student's t, with `freedom` degrees of freedom, of terms whose sum is `sum`. `share` is the
/// result of [`within_share`] for the terms.
fn student_score(sum: f64, share: f64, freedom: f64) -> f64 {
    sum.signum() * (freedom * (1.0 - share) / share).sqrt()
}

/// Means of reference and image over all pixels of `tiles`.
fn whole_means(tiles: &[&NoiseTile], channel: usize) -> [f64; 2] {
    let pixels: f64 = tiles.iter().map(|tile| tile.pixels).sum();
    [0, 1].map(|k| tiles.iter().map(|tile| tile.sums[k][channel]).sum::<f64>() / pixels)
}

/// Smallest window that contains all `tiles`.
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
    // Weight each tile by 1 / (its variance + the median variance). Without the median, a tile of a
    // lamp, which has no noise, would have all the weight.
    let weighted = relative.iter().map(|(difference, variance)| {
        let weight = 1.0 / (variance + usual);
        (weight, weight * difference)
    });
    let weights: f64 = weighted.clone().map(|(weight, _)| weight).sum();
    let max = match common {
        CommonErrors::None | CommonErrors::Tile => f64::INFINITY,
        // Few tiles are independent. A difference that varies over the picture increases the
        // spread, and so could not be told from noise. Therefore clamp the absolute value of each
        // term to the median of the absolute values.
        CommonErrors::Sample | CommonErrors::Picture => {
            let sizes = weighted.clone().map(|(_, term)| term.abs());
            let mut sizes: Vec<f64> = sizes.filter(|size| *size > 0.0).collect();
            sizes.sort_by(f64::total_cmp);
            sizes.get(sizes.len() / 2).copied().unwrap_or(0.0)
        }
    };
    let terms = weighted.map(|(_, term)| term.clamp(-max, max));
    let (sum, squares) = terms.fold((0.0, 0.0), |(a, b), term| (a + term, b + term * term));
    // Subtract the rounding error of 32-bit values
    let sum = sum.signum() * (sum.abs() - f32::EPSILON as f64 * weights).max(0.0);
    // If groups of c tiles have the same error, S² and n in S² / n are both c times as large. The
    // share is therefore the same, and only the degrees of freedom change.
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
