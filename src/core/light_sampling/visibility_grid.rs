//! Measured visibility of the sky and of lamps from each cell of a grid. Lights and directions of
//! the sky are chosen by this visibility.
//!
//! In a room with windows, nearly all sky directions that are sampled by radiance are occluded.
//! This grid stores, for each cell, the visible fraction of every bin of sky directions
//! (`sky_bins`) and of clusters of other lights. Rays measure the fractions before the first sample
//! (`integrator/visibility.rs`); this module only stores and uses the result. With this grid, users
//! need not define portals at the windows.
//!
//! Each cell has a table for each of 27 representative normals. A point uses the table of the
//! representative normal that is nearest to the normal at the point (`light_grid`). In a table, the
//! probability of a bin is proportional to its radiance, the cosine with the normal and the square
//! root of its visible fraction. The reason for the square root: the second moment of the light
//! from a bin is proportional to the visible fraction, and the variance is minimal if the
//! probability of a bin is proportional to the square root of the second moment. A tenth of all
//! directions is sampled by the light's own distribution, so that every direction can be sampled.
//! Within a bin, directions are also sampled by the light's own distribution. So the density is the
//! light's own density, multiplied by a factor that is constant in the bin.
//!
//! Lights are chosen as in `light_grid`, but the irradiance of each light is multiplied by a
//! function of the light's visible fraction. If the sky is the only light, it is sampled less often
//! in cells from which little of the sky is visible.
//!
//! A table is computed at the first request. It depends on its cell only, so results are
//! bit-identical for any order of threads. Probabilities of bins are multiples of 2⁻¹⁶.
//! docs/notebook/2026-11.md, "Sky through windows", has the gain.

use super::LightSampleContext;
use super::cell_grid::CellGrid;
use super::light_grid::{Entry, LightGrid, NORMALS, normal_direction, normal_index};
use super::sky_bins::SkyBins;
use crate::light::bounds::{ReceiverRegion, soft_cosine};
use crate::light::{Light, LightId, LightSample};
use crate::math::{Vec2, Vec3, float::ALMOST_ONE};
use crate::texture::Texture;
use std::sync::OnceLock;

/// Maximum number of cells.
const MAX_CELLS: usize = 4096;
/// Maximum number of clusters of finite lights.
const MAX_CLUSTERS: usize = 48;
/// Maximum number of lights at infinity. With more lights, visibility is learned for the sky only.
const MAX_INFINITE: usize = 16;
/// Approximate fraction of the sky's bins to which rays are traced from a cell.
const TRACED_BINS: f64 = 0.33;
/// Number of rays from a cell to each cluster of lights.
pub const RAYS_A_CLUSTER: u32 = 2;
/// Fraction of sky directions that are sampled by the light's own distribution, independent of
/// visibility.
const BY_RADIANCE: f64 = 0.1;
/// Bound on the error of the cosine if a representative normal replaces the true normal.
const NORMAL_SPREAD: f32 = 0.35;
/// Minimum visible fraction that is assumed for every light, because few rays are traced.
const MIN_SHARE: f64 = 0.01;
/// Minimum probability that the sky is sampled if it is the only light.
const MIN_RATE: f64 = 0.25;
/// Probabilities in a table are multiples of 1 / `UNITS`.
const UNITS: u32 = 1 << 16;
/// Stored value of the visible fraction 1.
const VISIBLE: f32 = 255.0;

/// Visible fractions of lights, for each cell of a grid.
#[derive(Clone, Debug)]
pub struct VisibilityGrid {
    cells: CellGrid,
    sky: Option<SkyTable>,
    /// Clusters of lights other than the sky.
    clusters: Vec<Vec<LightId>>,
    /// Index of the cluster of each light.
    cluster_of: Vec<Option<u16>>,
    /// Visible fraction of each of `clusters`, cell by cell, in 255ths.
    visible_clusters: Vec<u8>,
    /// Tables of each cell, one for each representative normal.
    tables: Vec<[OnceLock<Box<Table>>; NORMALS]>,
}

/// Data of the sky: an infinitely distant light from many directions.
#[derive(Clone, Debug)]
struct SkyTable {
    id: LightId,
    bins: SkyBins,
    /// Visible fraction of each bin, cell by cell, in 255ths.
    visible: Vec<u8>,
    /// Mean visible fraction of the sky's light over all cells, weighted by the number of points in
    /// each cell.
    mean_share: f64,
}

/// Probabilities of sky bins and of lights in a cell, for normals near one direction.
#[derive(Clone, Debug)]
struct Table {
    /// Starts of intervals, in units of 1 / [`UNITS`]: first the intervals of the rows of bins,
    /// then the intervals of the bins in each row.
    starts: Box<[u16]>,
    /// Distribution over the lights; empty if the sky is the only light.
    entries: Box<[Entry]>,
    /// Probability that the sky is sampled at a point, if the sky is the only light.
    rate: f32,
}

/// Target of the rays that measure visibility.
#[derive(Clone, Copy, Debug)]
pub enum VisibilityTarget {
    /// Directions of the sky in the bin with this index.
    Bin(usize),
    /// Cluster of lights with this index.
    Cluster(usize),
}

impl VisibilityGrid {
    /// Makes a grid over the surface points `points`, with unknown visibility. The number of cells
    /// is limited so that `max_rays` rays suffice for all targets of all cells. `grid` is the light
    /// grid of `lights`, if there are several lights. `None` if there are no points, or if there is
    /// nothing to learn: no light shines from many directions, and there is at most one lamp.
    pub(super) fn new(lights: &[Light], grid: Option<&LightGrid>, points: &[Vec3], max_rays: usize) -> Option<Self> {
        let all = (0..).map(LightId).zip(lights);
        let skies = all.filter_map(|(id, light)| Some((id, light.power(1.0), SkyBins::new(light)?)));
        // Choose the sky with the highest power; the first if powers are equal
        let sky = skies
            .reduce(|a, b| if b.1 > a.1 { b } else { a })
            .filter(|sky| sky.1 > 0.0);
        let except = sky.as_ref().map(|sky| sky.0);
        let mut clusters = grid.map_or(Vec::new(), |grid| grid.clusters(lights, except, MAX_CLUSTERS));
        if clusters.len() > MAX_CLUSTERS + MAX_INFINITE || (sky.is_none() && clusters.len() < 2) {
            clusters.clear();
        }
        let mut cluster_of = vec![None; lights.len()];
        for (number, ids) in (0..).zip(&clusters) {
            ids.iter().for_each(|id| cluster_of[id.0 as usize] = Some(number));
        }
        let bins = sky.as_ref().map_or(0, |sky| sky.2.len());
        let rays = TRACED_BINS * bins as f64 + f64::from(RAYS_A_CLUSTER) * clusters.len() as f64;
        if rays == 0.0 {
            return None;
        }
        let cells = CellGrid::new(points, ((max_rays as f64 / rays) as usize).clamp(1, MAX_CELLS))?;
        let count = cells.len();
        Some(Self {
            sky: sky.map(|(id, _, bins)| SkyTable {
                id,
                visible: vec![0; count * bins.len()],
                bins,
                mean_share: 0.0,
            }),
            visible_clusters: vec![0; count * clusters.len()],
            clusters,
            cluster_of,
            tables: (0..count).map(|_| [const { OnceLock::new() }; NORMALS]).collect(),
            cells,
        })
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Index of the cell of the point `p`; `None` if this cell contains no known surface.
    pub fn cell(&self, p: Vec3) -> Option<usize> {
        self.cells.number(p)
    }

    /// Group of each cell. A group is a block of up to 2 × 2 × 2 cells. Groups are numbered in the
    /// order of their first cells.
    pub fn groups(&self) -> Vec<usize> {
        self.cells.groups()
    }

    /// Number of bins of the sky.
    pub fn bins(&self) -> usize {
        self.sky.as_ref().map_or(0, |sky| sky.bins.len())
    }

    /// Indices of the bin `bin` and of all bins that share an edge or a corner with it.
    pub fn bins_around(&self, bin: usize) -> impl Iterator<Item = usize> + use<> {
        let (rows, columns) = self
            .sky
            .as_ref()
            .map_or((1, 1), |sky| (sky.bins.rows(), sky.bins.columns()));
        let (row, column) = (bin / columns, bin % columns);
        let rows = row.saturating_sub(1)..(row + 2).min(rows);
        rows.flat_map(move |r| [columns - 1, 0, 1].map(|c| r * columns + (column + c) % columns))
    }

    /// The targets of visibility rays: each bin of the sky, then each cluster of other lights.
    pub fn targets(&self) -> impl Iterator<Item = VisibilityTarget> + use<> {
        let clusters = (0..self.clusters.len()).map(VisibilityTarget::Cluster);
        (0..self.bins()).map(VisibilityTarget::Bin).chain(clusters)
    }

    /// Samples unoccluded light from `target` at `p` and `time`; `None` if no light arrives.
    pub fn sample_target(
        &self,
        lights: &[Light],
        target: VisibilityTarget,
        p: Vec3,
        time: f32,
        u: Vec2,
        textures: &[Texture],
    ) -> Option<LightSample> {
        match (target, &self.sky) {
            (VisibilityTarget::Bin(bin), Some(sky)) => {
                let columns = sky.bins.columns();
                sky.bins
                    .sample(lights.get(sky.id.0 as usize)?, bin / columns, bin % columns, u)
            }
            (VisibilityTarget::Bin(_), None) => None,
            (VisibilityTarget::Cluster(number), _) => {
                let ids = self.clusters.get(number)?;
                // Choose a light with `u.x`. The remainder of `u.x` samples the point on the light.
                let x = u.x * ids.len() as f32;
                let i = (x as usize).min(ids.len().checked_sub(1)?);
                let light = lights.get(ids[i].0 as usize)?;
                light.sample(p, time, Vec2::new((x - i as f32).clamp(0.0, ALMOST_ONE), u.y), textures)
            }
        }
    }

    /// The grid with the visible fractions `found` of all targets ([`VisibilityGrid::targets`]),
    /// cell by cell. Few rays measure a fraction, so fractions are averaged with the fractions of
    /// neighbouring bins and cells, which are probably similar. `counts` has the number of points
    /// of each cell.
    pub fn with_visibility(mut self, found: &[f32], counts: &[usize]) -> Self {
        let (bins, stride) = (self.bins(), self.bins() + self.clusters.len());
        let at = |cell: usize, target: usize| found.get(cell * stride + target).copied().unwrap_or(0.0);
        let mut mean = 0.0;
        for cell in 0..self.cells.len() {
            let neighbours = self.cells.neighbours(cell);
            let smoothed = |target: usize, beside: &[usize]| {
                let mut sum = 4.0 * at(cell, target);
                let mut weight = 4.0;
                let near = neighbours.iter().flatten().map(|&near| at(near as usize, target));
                for share in near.chain(beside.iter().map(|&beside| at(cell, beside))) {
                    sum += share;
                    weight += 1.0;
                }
                (VISIBLE * sum / weight).ceil().clamp(0.0, VISIBLE) as u8
            };
            if let Some(sky) = &mut self.sky {
                let (rows, columns) = (sky.bins.rows(), sky.bins.columns());
                let mut share = 0.0;
                for bin in 0..bins {
                    let (row, column) = (bin / columns, bin % columns);
                    let mut beside = vec![
                        row * columns + (column + 1) % columns,
                        row * columns + (column + columns - 1) % columns,
                    ];
                    beside.extend((row > 0).then(|| bin - columns));
                    beside.extend((row + 1 < rows).then_some(bin + columns));
                    sky.visible[cell * bins + bin] = smoothed(bin, &beside);
                    share += f64::from(sky.bins.masses()[bin] * at(cell, bin));
                }
                mean += share * counts.get(cell).copied().unwrap_or(0) as f64;
            }
            for i in 0..self.clusters.len() {
                self.visible_clusters[cell * self.clusters.len() + i] = smoothed(bins + i, &[]);
            }
        }
        if let Some(sky) = &mut self.sky {
            sky.mean_share = mean / counts.iter().sum::<usize>().max(1) as f64;
        }
        self
    }

    /// Samples a light of the scene's `lights`; `grid` is their light grid, if there are several
    /// lights. The outer value is `None` if the position of `context` has no data in this grid. The
    /// inner value is `None` if no light is sampled.
    #[inline]
    pub(super) fn choose(
        &self,
        lights: &[Light],
        grid: Option<&LightGrid>,
        context: &LightSampleContext,
        u: f32,
    ) -> Option<Option<(LightId, f32)>> {
        let table = self.table(lights, grid, context)?;
        match (grid, &self.sky) {
            (Some(grid), _) => Some(grid.sample_entries(&table.entries, context, u)),
            (None, Some(sky)) => Some((u < table.rate).then_some((sky.id, table.rate))),
            (None, None) => None,
        }
    }

    /// Probability that [`VisibilityGrid::choose`] samples `light`; `None` if the position of
    /// `context` has no data in this grid.
    #[inline]
    pub(super) fn pmf(
        &self,
        lights: &[Light],
        grid: Option<&LightGrid>,
        context: &LightSampleContext,
        light: LightId,
    ) -> Option<f32> {
        let table = self.table(lights, grid, context)?;
        match (grid, &self.sky) {
            (Some(grid), _) => Some(grid.pmf_of_entries(&table.entries, context, light)),
            (None, Some(sky)) => Some(if sky.id == light { table.rate } else { 0.0 }),
            (None, None) => None,
        }
    }

    /// Samples light of the sky that arrives at `context`. The outer value is `None` if the light
    /// `id` is not the sky, or if the position of `context` has no data in this grid.
    pub(super) fn sample(
        &self,
        id: LightId,
        lights: &[Light],
        grid: Option<&LightGrid>,
        context: &LightSampleContext,
        u: Vec2,
    ) -> Option<Option<LightSample>> {
        let sky = self.sky.as_ref().filter(|sky| sky.id == id)?;
        let table = &self.table(lights, grid, context)?.starts;
        let (rows, columns) = (sky.bins.rows(), sky.bins.columns());
        let (row, v, row_units) = draw(&table[..rows], u.y);
        let first = rows + row * columns;
        let (column, h, column_units) = draw(&table[first..first + columns], u.x);
        let factor = sky.factor(row * columns + column, row_units, column_units);
        let light = lights.get(id.0 as usize)?;
        let sample = sky.bins.sample(light, row, column, Vec2::new(h, v));
        Some(sample.map(|sample| LightSample {
            pdf: sample.pdf * factor,
            ..sample
        }))
    }

    /// Density of [`VisibilityGrid::sample`] divided by the density of the light's own sampling,
    /// for the light `id`, the direction `wi` and the context `context`.
    pub(super) fn pdf_factor(
        &self,
        id: LightId,
        lights: &[Light],
        grid: Option<&LightGrid>,
        context: &LightSampleContext,
        wi: Vec3,
    ) -> f32 {
        let factor = || {
            let sky = self.sky.as_ref().filter(|sky| sky.id == id)?;
            let table = &self.table(lights, grid, context)?.starts;
            let (rows, columns) = (sky.bins.rows(), sky.bins.columns());
            let bin = sky.bins.bin(lights.get(id.0 as usize)?, wi);
            let (row, column) = (bin / columns, bin % columns);
            let first = rows + row * columns;
            let column_units = units(&table[first..first + columns], column);
            Some(sky.factor(bin, units(&table[..rows], row), column_units))
        };
        factor().unwrap_or(1.0)
    }

    /// Table for `context`. The first request computes the table. `None` if the position of
    /// `context` has no data in this grid.
    #[inline]
    fn table(&self, lights: &[Light], grid: Option<&LightGrid>, context: &LightSampleContext) -> Option<&Table> {
        let cell = self.cells.number(context.p)?;
        let normal = normal_index(context.n);
        let table = self.tables.get(cell)?.get(normal)?;
        Some(match table.get() {
            Some(table) => table,
            None => table.get_or_init(|| self.make(lights, grid, cell, normal_direction(normal))),
        })
    }

    #[cold]
    #[inline(never)]
    fn make(&self, lights: &[Light], grid: Option<&LightGrid>, cell: usize, normal: Vec3) -> Box<Table> {
        // Compute the starts of the bins, and the fraction of the sky's light that arrives
        let (starts, share) = self
            .sky
            .as_ref()
            .map_or((Box::default(), 0.0), |sky| sky.starts(cell, normal));
        let (center, radius) = self.cells.ball(cell);
        let region = ReceiverRegion { center, radius, normal };
        let corrected = |id: LightId, irradiance: f64| {
            if self.sky.as_ref().is_some_and(|sky| sky.id == id) {
                // Without occlusion `share` is about 1/4, the mean of max(cos θ, 0) over the
                // sphere.
                return irradiance * (4.0 * share).max(MIN_SHARE);
            }
            let cluster = self.cluster_of.get(id.0 as usize).copied().flatten();
            let visible = cluster.map(|i| {
                let share = self.visible_clusters[cell * self.clusters.len() + usize::from(i)];
                (f64::from(share) / f64::from(VISIBLE)).max(MIN_SHARE).sqrt()
            });
            irradiance * visible.unwrap_or(1.0)
        };
        let entries = grid.map(|grid| grid.distribution(lights, &region, &corrected));
        let mean = self.sky.as_ref().map_or(0.0, |sky| sky.mean_share);
        let rate = if mean > 0.0 {
            // `share` includes the cosine with the normal, whose mean is about 1/2. So twice
            // `share` is about the visible fraction.
            2.0 * share / mean
        } else {
            0.0
        };
        Box::new(Table {
            starts,
            entries: entries.unwrap_or_default(),
            rate: rate.clamp(MIN_RATE, 1.0) as f32,
        })
    }

    /// Bytes of the arrays and of all tables computed so far.
    pub fn bytes(&self) -> usize {
        let table = |table: &Table| size_of::<Table>() + size_of_val(&*table.starts) + size_of_val(&*table.entries);
        let made = self.tables.iter().flatten().filter_map(OnceLock::get);
        let tables: usize = made.map(|made| table(made)).sum();
        let sky = self.sky.as_ref().map_or(0, |sky| sky.visible.len() + sky.bins.bytes());
        self.cells.bytes() + size_of_val(self.tables.as_slice()) + self.visible_clusters.len() + sky + tables
    }
}

impl SkyTable {
    /// Probability of a bin in the table of a cell, divided by its probability under the light's
    /// own distribution.
    fn factor(&self, bin: usize, row_units: u32, column_units: u32) -> f32 {
        let mass = self.bins.masses()[bin];
        if mass > 0.0 {
            (row_units as f32 * column_units as f32) * (1.0 / (UNITS as f32 * UNITS as f32)) / mass
        } else {
            0.0
        }
    }

    /// [`Table::starts`] of a cell for normals near `normal`. Also returns the fraction of the
    /// sky's light that arrives at the cell, weighted by the cosine with the normal.
    fn starts(&self, cell: usize, normal: Vec3) -> (Box<[u16]>, f64) {
        let (rows, columns, bins) = (self.bins.rows(), self.bins.columns(), self.bins.len());
        let visible = &self.visible[cell * bins..][..bins];
        let masses = self.bins.masses();
        let cosine = |wi: Vec3| {
            if normal == Vec3::ZERO {
                0.5
            } else {
                soft_cosine(wi.dot(normal), NORMAL_SPREAD)
            }
        };
        let mut arriving = 0.0;
        let seen: Vec<f64> = (masses.iter().zip(self.bins.middles()).zip(visible))
            .map(|((&mass, &wi), &share)| {
                let (irradiance, share) = (mass * cosine(wi), share as f32 / VISIBLE);
                arriving += f64::from(irradiance * share);
                f64::from(irradiance * share.sqrt())
            })
            .collect();
        let sum: f64 = seen.iter().sum();
        let by_radiance = if sum > 0.0 { BY_RADIANCE } else { 1.0 };
        let weight = |(seen, &mass): (&f64, &f32)| {
            let by_sight = if sum > 0.0 {
                (1.0 - by_radiance) * seen / sum
            } else {
                0.0
            };
            by_radiance * f64::from(mass) + by_sight
        };
        let weights: Vec<f64> = seen.iter().zip(masses).map(weight).collect();
        let row_weights: Vec<f64> = weights.chunks(columns).map(|row| row.iter().sum()).collect();
        let mut table = Vec::with_capacity(rows + bins);
        push_units(&mut table, &row_weights);
        weights.chunks(columns).for_each(|row| push_units(&mut table, row));
        (table.into_boxed_slice(), arriving)
    }
}

/// Appends to `table` the start of each interval of a distribution with the weights `weights`, in
/// units of 1 / [`UNITS`]. Each weight above 0 gets at least one unit.
fn push_units(table: &mut Vec<u16>, weights: &[f64]) {
    let total: f64 = weights.iter().sum();
    let positive = weights.iter().filter(|w| **w > 0.0).count() as u32;
    let (mut sum, mut before) = (0.0, 0);
    for &weight in weights {
        let shared = if total > 0.0 {
            (sum / total * f64::from(UNITS - positive)).round() as u32
        } else {
            0
        };
        table.push((before + shared).min(UNITS - 1) as u16);
        sum += weight;
        before += u32::from(weight > 0.0);
    }
}

/// Length in units of interval `i`, for intervals with the starts `starts`.
fn units(starts: &[u16], i: usize) -> u32 {
    starts.get(i + 1).map_or(UNITS, |&end| u32::from(end)) - u32::from(starts[i])
}

/// Interval that contains `u`, for intervals with the starts `starts`. Returns the index of the
/// interval, the position of `u` in the interval, from 0 to 1, and the length of the interval in
/// units.
#[inline]
fn draw(starts: &[u16], u: f32) -> (usize, f32, u32) {
    let x = u * UNITS as f32;
    let unit = (x as u32).min(UNITS - 1) as u16;
    // Count the starts up to `unit`. This is faster than a binary search, whose branches are
    // unpredictable.
    let i = starts.iter().map(|&start| u16::from(start <= unit)).sum::<u16>().max(1) as usize - 1;
    let units = units(starts, i);
    let within = (x - f32::from(starts[i])) / units as f32;
    (i, within.clamp(0.0, ALMOST_ONE), units)
}
