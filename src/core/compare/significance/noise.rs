//! Values and variances of the pixels and tiles of two images. A variance that is lower than the
//! mean variance of the neighbours is raised to this mean.

use crate::film::{Rect, RgbImage, TILE_SIZE};
use crate::math::{UVec2, encode_variants};

/// Noise of a picture: variances, numbers of samples, and kind of common errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Estimated variance of each pixel's mean, by channel; infinite if unknown.
    pub variance: Vec<[f32; 3]>,
    /// Number of samples of each pixel, on which the variance is based.
    pub samples: Vec<f32>,
    /// Kind of errors that pixels have in common.
    pub common: CommonErrors,
}

/// Maximum number of pixels that share their light paths. The variance of the mean of a tile may be
/// larger than for independent pixels by this factor, because the errors of such a group of pixels
/// add up linearly.
const SHARING: f64 = 16.0;

/// Kinds of errors that pixels have in common, in ascending order of severity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CommonErrors {
    /// No errors in common, because each pixel has separate paths.
    None,
    /// Errors that up to 16 pixels of a tile have in common, because these pixels share camera
    /// paths or parts of light paths.
    Tile,
    /// Errors that all pixels have in common in one sample, because a photon contributes to many
    /// pixels, or because a Markov chain stays in bright areas. Samples are independent of each
    /// other, so the variance of each pixel is right.
    Sample,
    /// Errors that all samples have in common, because they use the same photon map or irradiance
    /// cache. No variance includes these errors.
    Picture,
}

encode_variants!(CommonErrors {
    0 => None,
    1 => Tile,
    2 => Sample,
    3 => Picture,
});

impl CommonErrors {
    /// Names in files.
    pub const NAMES: &[(&str, Self)] = &[
        ("none", Self::None),
        ("tile", Self::Tile),
        ("sample", Self::Sample),
        ("picture", Self::Picture),
    ];

    /// Maximum number of pixels of a tile that have the same error.
    fn sharing(self) -> f64 {
        match self {
            Self::None => 1.0,
            Self::Tile => SHARING,
            Self::Sample | Self::Picture => f64::INFINITY,
        }
    }
}

/// All pixels of a window, row by row, and its tiles.
pub(super) struct Pixels {
    pub(super) window: Rect,
    pub(super) pixels: Vec<Pixel>,
    pub(super) tiles: Vec<NoiseTile>,
    /// Kind of the errors that pixels have in common. If the two pictures have different kinds, it
    /// is the more severe one.
    pub(super) common: CommonErrors,
    /// Approximate number of rare bright samples that cause most of the noise, if the pictures
    /// differ in their sampling; else `None`.
    pub(super) rare: Option<f64>,
}

pub(super) struct Pixel {
    /// Values of reference and image.
    pub(super) values: [[f64; 3]; 2],
    /// Variance of the difference of the values. It is at least the mean variance of the
    /// surrounding pixels.
    variance: [f64; 3],
    /// Degrees of freedom of the estimates of the variance.
    pub(super) freedom: f64,
}

impl Pixels {
    /// Pixels of both pictures. `None` unless both have the number of pixels of the window.
    pub(super) fn new(window: Rect, reference: (&RgbImage, &Noise), image: (&RgbImage, &Noise)) -> Option<Self> {
        let sources = [NoisyPicture::new(window, reference)?, NoisyPicture::new(window, image)?];
        let common = reference.1.common.max(image.1.common);
        let grid = Grid { window };
        let mut tiles: Vec<NoiseTile> = (0..grid.tiles())
            .map(|tile| NoiseTile::new(&sources, grid, tile, common))
            .collect();
        let mut pixels = Vec::with_capacity(window.area() as usize);
        for (i, at) in window.pixels().enumerate() {
            let tile = grid.tile_of(at);
            let values = [0, 1].map(|k| sources[k].values[i]);
            let freedom = (f64::min(sources[0].samples[i], sources[1].samples[i]) - 1.0).max(1.0);
            // A pixel with unknown noise is left out of its tile.
            if sources.iter().all(|source| is_known(&source.variance[i])) {
                tiles[tile].add(&values, freedom);
            }
            let variance = |c: usize| {
                // Even without noise, values have the rounding error of 32-bit floats.
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
                freedom,
            });
        }
        // Search for rare samples only if tiles have no common errors. Pictures whose tiles have
        // common errors have other tests.
        let rare = (common <= CommonErrors::Tile).then(|| rare_samples(&sources, tiles.len()));
        Some(Self {
            window,
            pixels,
            tiles,
            common,
            rare: rare.flatten(),
        })
    }
}

impl Pixel {
    /// Difference of the values divided by its standard deviation; `None` if the standard deviation
    /// is unknown.
    pub(super) fn score(&self, channel: usize) -> Option<f64> {
        let [reference, image] = self.values.map(|v| v[channel]);
        ratio(image - reference, self.variance[channel].sqrt())
    }
}

/// `a / b` if both are finite, with 0 / 0 = 0.
pub(super) fn ratio(a: f64, b: f64) -> Option<f64> {
    (a.is_finite() && b.is_finite()).then(|| if a == 0.0 { 0.0 } else { a / b })
}

/// A picture with four variances: of each pixel, of the pixels around it, of each tile, and of the
/// tiles around it.
struct NoisyPicture {
    values: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
    variance_around: Vec<[f64; 3]>,
    samples: Vec<f64>,
    /// Mean variances of the tiles.
    tiles: Vec<[f64; 3]>,
    tiles_around: Vec<[f64; 3]>,
}

impl NoisyPicture {
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

/// A pixel counts as made of rare samples if at most this number of equal samples explains its mean
/// and its variance.
const FEW_SAMPLES: f64 = 4.0;

/// Mean number of rare samples per tile above which the variances of most tiles are correct.
const RARE_OF_A_TILE: f64 = 4.0;

/// Approximate number of rare samples that cause most of the noise of two pictures. `None` if there
/// are many such samples. `None` also if they are equally likely in both pictures, because
/// differences are then symmetric, even for rare samples.
///
/// If a single sample makes up a pixel of mean m, the variance v of the pixel is m². If k equal
/// samples make up the pixel, v is m² / k. Pixels that consist of few samples may have most of the
/// variance. The number of rare samples is then about `(Σ v)² / Σ v²`, summed over these pixels.
///
/// The two variances of each pixel show whether the pictures were sampled alike. If they were, each
/// of the two variances is the larger one with the same probability, for any distribution of the
/// samples.
fn rare_samples(sources: &[NoisyPicture; 2], tiles: usize) -> Option<f64> {
    let sum = |v: &[f64; 3]| v.iter().sum::<f64>();
    let (mut all, mut rare, mut squares) = (0.0, 0.0, 0.0);
    for source in sources {
        for (value, variance) in source.values.iter().zip(&source.variance) {
            let (mean, variance) = (sum(value), sum(variance));
            if !variance.is_finite() {
                continue;
            }
            all += variance;
            if FEW_SAMPLES * variance >= mean * mean {
                rare += variance;
                squares += variance * variance;
            }
        }
    }
    let events = rare * rare / squares;
    let pairs = sources[0].variance.iter().zip(&sources[1].variance);
    let (larger, smaller) = pairs.fold((0.0, 0.0), |(larger, smaller), (a, b)| {
        let (a, b) = (sum(a), sum(b));
        (
            larger + f64::from(u8::from(a > b)),
            smaller + f64::from(u8::from(a < b)),
        )
    });
    let is_alike = f64::max(larger, smaller) <= 2.0 * f64::min(larger, smaller);
    // Without rare samples, `events` is NaN, and the comparison is false.
    (!is_alike && rare > 0.5 * all && events < RARE_OF_A_TILE * tiles as f64).then_some(events)
}

/// For each entry of `variance`, the mean of the known entries in a square around this entry. The
/// side of the square is `2 · radius + 1` entries.
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

/// Mean of the known variances; 0 if there are none.
fn mean_of<'a>(variances: impl Iterator<Item = &'a [f64; 3]>) -> [f64; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for v in variances.filter(|v| is_known(v)) {
        (0..3).for_each(|c| sum[c] += v[c]);
        count += 1.0;
    }
    sum.map(|s| s / f64::max(count, 1.0))
}

/// Tiles of the full picture that overlap a window, row by row.
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

    /// Index of the tile of a pixel of the window.
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

    /// Mean of the known variances in each tile. `variance` has one entry for each pixel of the
    /// window.
    fn means(self, variance: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut of_tile: Vec<Vec<&[f64; 3]>> = vec![Vec::new(); self.tiles()];
        for (at, v) in self.window.pixels().zip(variance) {
            of_tile[self.tile_of(at)].push(v);
        }
        of_tile.into_iter().map(|all| mean_of(all.into_iter())).collect()
    }
}

/// A tile, with sums over its pixels with known noise.
pub(super) struct NoiseTile {
    pub(super) window: Rect,
    pub(super) pixels: f64,
    /// Sums of reference and image.
    pub(super) sums: [[f64; 3]; 2],
    /// Variance of a pixel's difference: the mean over the pixels of the tile.
    variance: [f64; 3],
    /// Variance of a pixel's difference. It is at least the mean variance of the surrounding tiles.
    pub(super) wide_variance: [f64; 3],
    /// Maximum number of pixels that have the same error.
    pub(super) sharing: f64,
    /// Degrees of freedom of the estimate of the variance: infinite if the estimate comes from many
    /// pixels with independent errors, else the minimum over the pixels.
    pub(super) freedom: f64,
    common: CommonErrors,
}

impl NoiseTile {
    fn new([a, b]: &[NoisyPicture; 2], grid: Grid, tile: usize, common: CommonErrors) -> Self {
        Self {
            window: grid.window_of(tile),
            pixels: 0.0,
            sums: [[0.0; 3]; 2],
            variance: [0, 1, 2].map(|c| a.tiles[tile][c] + b.tiles[tile][c]),
            wide_variance: [0, 1, 2].map(|c| a.tile_variance(tile, c) + b.tile_variance(tile, c)),
            sharing: common.sharing(),
            freedom: f64::INFINITY,
            common,
        }
    }

    fn add(&mut self, values: &[[f64; 3]; 2], freedom: f64) {
        self.pixels += 1.0;
        if self.common >= CommonErrors::Sample {
            self.freedom = self.freedom.min(freedom);
        }
        for (sums, values) in self.sums.iter_mut().zip(values) {
            (0..3).for_each(|c| sums[c] += values[c]);
        }
    }

    /// Means of reference and image over the tile; NaN if the tile has no pixels.
    pub(super) fn means(&self, channel: usize) -> [f64; 2] {
        self.sums.map(|sums| sums[channel] / self.pixels)
    }

    /// Variance of the difference of the means, if groups of `sharing` pixels have the same error.
    /// `of_pixel` is the variance of a pixel's difference.
    pub(super) fn variance(&self, of_pixel: f64, sharing: f64, channel: usize) -> f64 {
        // The rounding errors of all pixels may have the same sign.
        let rounding = f32::EPSILON as f64 * self.means(channel).into_iter().fold(0.0, f64::max);
        of_pixel * sharing.min(self.pixels) / self.pixels + rounding * rounding
    }

    /// Returns the difference of the means of the tile, divided by the mean of both pictures, and
    /// the variance of this relative difference. `None` if both pictures are black.
    pub(super) fn relative(&self, channel: usize) -> Option<(f64, f64)> {
        let [reference, image] = self.means(channel);
        let mean = 0.5 * (reference + image);
        let variance = self.variance(self.variance[channel], 1.0, channel) / (mean * mean);
        (mean > 0.0 && variance > 0.0 && variance.is_finite()).then(|| ((image - reference) / mean, variance))
    }
}
