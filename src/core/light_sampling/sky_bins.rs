use crate::light::{ConstantLight, EnvironmentLight, Light, LightSample};
use crate::math::{Vec2, Vec3, atan2, float::ALMOST_ONE, sin_cos_turns};
use crate::sampling::warp::UNIFORM_SPHERE_PDF;
use std::f32::consts::FRAC_1_PI;
use std::f64::consts::PI;
use std::ops::Range;

/// Maximum number of rows of bins, from the top to the bottom of the sphere of directions. All rows
/// have the same solid angle. A small image has fewer rows.
const ROWS: usize = 16;
/// Maximum number of bins around the vertical axis. A small image has fewer bins.
const COLUMNS: usize = 24;

/// Partition of the directions of an infinitely distant light into bins: rows of latitude, cut into
/// columns.
///
/// A bin of an environment is a rectangle of texels. So the light's own distribution gives the
/// exact probability of a bin, and directions in a bin can be sampled exactly.
#[derive(Clone, Debug)]
pub(super) struct SkyBins {
    rows: usize,
    columns: usize,
    /// Probability of each bin under the light's own sampling, row by row.
    masses: Vec<f32>,
    /// A direction in the middle of each bin.
    middles: Vec<Vec3>,
    /// Bins of texels; `None` for a constant light.
    texels: Option<TexelBins>,
}

/// Bins of an environment, as rectangles of texels.
#[derive(Clone, Debug)]
struct TexelBins {
    /// First row of texels of each row of bins, then the number of rows of texels.
    row_starts: Vec<usize>,
    /// First column of texels of each column of bins, then the number of columns of texels.
    column_starts: Vec<usize>,
    /// Row of bins of each row of texels.
    row_of: Vec<u8>,
    /// Column of bins of each column of texels.
    column_of: Vec<u8>,
    /// For each column of bins and each row of texels: the summed probability of the column's
    /// texels above this row. The last value of a column is the probability of all texels of the
    /// column.
    above: Vec<Vec<f64>>,
}

impl SkyBins {
    /// The bins of `light`; `None` if `light` is finite or comes from a single direction.
    pub fn new(light: &Light) -> Option<Self> {
        match light {
            Light::Constant(_) => Some(Self::of_constant()),
            Light::Environment(light) => Some(Self::of_environment(light)),
            Light::Area(_) | Light::Point(_) | Light::Directional(_) | Light::Sun(_) | Light::Spot(_) => None,
        }
    }

    fn of_constant() -> Self {
        let count = ROWS * COLUMNS;
        let middle = |bin: usize| uniform_in(bin / COLUMNS, bin % COLUMNS, Vec2::splat(0.5));
        Self {
            rows: ROWS,
            columns: COLUMNS,
            masses: vec![1.0 / count as f32; count],
            middles: (0..count).map(middle).collect(),
            texels: None,
        }
    }

    fn of_environment(light: &EnvironmentLight) -> Self {
        let [width, height] = light.size();
        let latitude = |i: usize| (1.0 - 2.0 * i as f64 / ROWS as f64).acos() / PI;
        let row_starts = starts(height, (0..=ROWS).map(latitude));
        let column_starts = starts(width, (0..=COLUMNS).map(|i| i as f64 / COLUMNS as f64));
        let (rows, columns) = (row_starts.len() - 1, column_starts.len() - 1);
        let distribution = light.distribution();
        let above = column_starts.windows(2).map(|ends| {
            let mut sum = 0.0;
            let row = |row| {
                sum += distribution.probability(row, &(ends[0]..ends[1]));
                sum
            };
            std::iter::once(0.0).chain((0..height).map(row)).collect()
        });
        let texels = TexelBins {
            above: above.collect(),
            row_of: bins_of(&row_starts),
            column_of: bins_of(&column_starts),
            row_starts,
            column_starts,
        };
        let bins = || (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let middle = |(row, column)| {
            let middle = |ends: Range<usize>, n| 0.5 * (ends.start + ends.end) as f64 / n as f64;
            light
                .at(middle(texels.columns(column), width), middle(texels.rows(row), height))
                .0
        };
        Self {
            rows,
            columns,
            masses: bins().map(|(row, column)| texels.mass(row, column) as f32).collect(),
            middles: bins().map(middle).collect(),
            texels: Some(texels),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of bins in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of bins.
    pub fn len(&self) -> usize {
        self.masses.len()
    }

    /// Probability of each bin under the light's own sampling, row by row.
    pub fn masses(&self) -> &[f32] {
        &self.masses
    }

    /// A unit direction in the middle of each bin, row by row.
    pub fn middles(&self) -> &[Vec3] {
        &self.middles
    }

    /// The bin of the unit direction `wi`. `light` is the light of these bins.
    pub fn bin(&self, light: &Light, wi: Vec3) -> usize {
        let (row, column) = match (light, &self.texels) {
            (Light::Environment(light), Some(texels)) => {
                let st = light.place_of(wi);
                let texel = |x: f32, bins: &[u8]| bins[((x * bins.len() as f32) as usize).min(bins.len() - 1)] as usize;
                (texel(st.y, &texels.row_of), texel(st.x, &texels.column_of))
            }
            _ => {
                let step = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
                let around = 0.5 + atan2(wi.x, -wi.z) * (0.5 * FRAC_1_PI);
                (step(0.5 - 0.5 * wi.y, self.rows), step(around, self.columns))
            }
        };
        row * self.columns + column
    }

    /// Samples a direction in the bin at `row` and `column`. `light` is the light of these bins.
    /// Within the bin, directions are sampled as by the light itself. The density in the result is
    /// the density of the light itself over all directions, not only over the bin. `None` if the
    /// light never samples a direction in the bin.
    pub fn sample(&self, light: &Light, row: usize, column: usize, u: Vec2) -> Option<LightSample> {
        match (light, &self.texels) {
            (Light::Constant(ConstantLight { radiance }), None) => Some(LightSample {
                wi: uniform_in(row, column, u),
                radiance: *radiance,
                pdf: UNIFORM_SPHERE_PDF,
                is_delta: false,
                target: None,
            }),
            (Light::Environment(light), Some(texels)) => {
                let (texel_row, v) = texels.sample_row(row, column, u.y)?;
                let (place, pdf) =
                    light
                        .distribution()
                        .sample_within(texel_row, &texels.columns(column), Vec2::new(u.x, v));
                light.sample_at(place, pdf)
            }
            _ => None,
        }
    }

    /// Bytes of the tables.
    pub fn bytes(&self) -> usize {
        let above = |texels: &TexelBins| {
            texels
                .above
                .iter()
                .map(|sums| size_of_val(sums.as_slice()))
                .sum::<usize>()
        };
        self.len() * (size_of::<f32>() + size_of::<Vec3>()) + self.texels.as_ref().map_or(0, above)
    }
}

impl TexelBins {
    fn rows(&self, row: usize) -> Range<usize> {
        self.row_starts[row]..self.row_starts[row + 1]
    }

    fn columns(&self, column: usize) -> Range<usize> {
        self.column_starts[column]..self.column_starts[column + 1]
    }

    fn mass(&self, row: usize, column: usize) -> f64 {
        let (rows, above) = (self.rows(row), &self.above[column]);
        above[rows.end] - above[rows.start]
    }

    /// Samples a row of texels in a bin. Returns the row, and the remainder of `u` rescaled to [0,
    /// 1).
    fn sample_row(&self, row: usize, column: usize, u: f32) -> Option<(usize, f32)> {
        let rows = self.rows(row);
        let above = &self.above[column][rows.start..=rows.end];
        let (low, high) = (above[0], above[rows.len()]);
        if high <= low {
            return None;
        }
        let x = low + u as f64 * (high - low);
        let i = above.partition_point(|&sum| sum <= x).clamp(1, rows.len()) - 1;
        let (low, high) = (above[i], above[i + 1]);
        let v = if high > low {
            (x - low) / (high - low)
        } else {
            return None;
        };
        Some((rows.start + i, (v as f32).clamp(0.0, ALMOST_ONE)))
    }
}

/// Direction in a bin of a constant light. It is uniform in the bin's solid angle if `u` is uniform
/// in [0, 1)².
fn uniform_in(row: usize, column: usize, u: Vec2) -> Vec3 {
    let y = 1.0 - 2.0 * (row as f32 + u.y) / ROWS as f32;
    // Column 0 begins half a turn from −z. The half turn flips the signs of sine and cosine.
    let (sin, cos) = sin_cos_turns((column as f32 + u.x) / COLUMNS as f32);
    let r = (1.0 - y * y).max(0.0).sqrt();
    Vec3::new(-r * sin, y, r * cos)
}

/// Index of the first texel of each bin, then `count`. The bins divide a line of `count` texels at
/// the fractions `shares`, which ascend from 0 to 1. Bins without texels are left out.
fn starts(count: usize, shares: impl Iterator<Item = f64>) -> Vec<usize> {
    let mut starts: Vec<usize> = shares.map(|share| (share * count as f64).round() as usize).collect();
    starts.dedup();
    starts
}

/// The bin of each texel, for bins with the starts `starts`.
fn bins_of(starts: &[usize]) -> Vec<u8> {
    let bins = starts.windows(2).enumerate();
    bins.flat_map(|(i, ends)| std::iter::repeat_n(i as u8, ends[1] - ends[0]))
        .collect()
}
