//! Choice of a light by place: tables of light probabilities over a grid of the scene.
//!
//! Each cell of the grid has a table for each of 26 representative normals, and a table for points
//! without normal. A point uses the table of the representative normal that is nearest to the
//! normal at the point. A table contains the irradiance that each light would cause in the cell
//! without occlusion. The first grid covers the lights. Larger grids surround it, each twice as
//! large as the next smaller grid. So a wide plain around the lights does not make the cells of the
//! first grid larger. A table is computed at the first request. It depends on its cell only, so
//! results are bit-identical for any order of threads.
//!
//! A table has an entry for each of up to 64 clusters of lights. The clusters are a cut of a
//! hierarchy of the lights (`tree`; Walter et al. 2005). Within a cluster, a light is chosen by
//! power. Without tables, the hierarchy would be traversed at each vertex, with two nodes evaluated
//! per level. A table needs one binary search.
//!
//! 2 % of the choices are made by power, independent of the estimates, and each cluster has a
//! probability of at least 2⁻²⁰. So every light can be sampled. docs/notebook/2026-11.md, "By
//! place", has the gain and the variants that were tried.

use super::tree::{LightTree, ReceiverRegion};
use super::{Light, LightId, LightSampleContext};
use crate::math::{Bounds3, Vec3};
use std::sync::OnceLock;

/// Cells along the longest side of a grid.
const RESOLUTION: u32 = 24;
/// Maximum number of grids.
const MAX_LEVELS: u32 = 16;
/// Maximum number of light clusters per cell.
const MAX_CLUSTERS: usize = 64;
/// Number of representative normals: each coordinate is negative, near zero or positive. If all
/// coordinates are near zero, the point has no normal.
pub(super) const NORMALS: usize = 27;
/// Fraction of the choices that are made by power, in every cell.
const BY_POWER: f64 = 0.02;
/// Minimum probability of a cluster, 2⁻²⁰. Random numbers are multiples of 2⁻²⁴, so 16 random
/// numbers select the cluster.
const MIN_PROBABILITY: f64 = 1.0 / (1u32 << 20) as f64;
/// Minimum power that is assumed for a light, as a fraction of the total power, so that rounding
/// does not remove the light from sums.
const MIN_POWER: f64 = 1.0 / (1u64 << 40) as f64;

/// Choice of a light by its unoccluded irradiance at the lit point. The irradiance is estimated for
/// clusters of lights, which are a cut of a [`LightTree`] (Walter et al. 2005).
#[derive(Clone, Debug)]
pub(super) struct LightGrid {
    tree: LightTree,
    /// Emitting lights: the lights of the tree in its order, then the lights at infinity.
    order: Vec<LightId>,
    /// Position of each light in `order`.
    positions: Vec<Option<u32>>,
    /// For each position, the summed power of all lights before it. The last value is the total
    /// power.
    power_before: Vec<f64>,
    scene_radius: f32,
    grids: Grids,
    cells: Vec<OnceLock<Box<Cell>>>,
}

/// Distributions of a cell, one for each representative normal.
type Cell = [OnceLock<Box<[Entry]>>; NORMALS];

/// A cluster of lights, as an interval of a cumulative distribution.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// End of the cluster's interval in [0, 1].
    upper: f32,
    /// Length of the cluster's interval: the probability of the cluster.
    pmf: f32,
    /// Position of the cluster's first light in the order of the lights.
    first: u32,
    count: u32,
}

impl LightGrid {
    /// Grid over `lights` with the powers `powers`, in a scene with the given bounds and radius;
    /// `None` if there is no emission.
    pub fn new(lights: &[Light], powers: &[f64], bounds: Bounds3, scene_radius: f32) -> Option<Self> {
        let total: f64 = powers.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let emitting = || lights.iter().zip(powers).enumerate().filter(|(_, (_, p))| **p > 0.0);
        let sources: Vec<_> = emitting().filter_map(|(i, (l, _))| Some((i, l.bounds()?))).collect();
        let grids = Grids::new(sources.iter().map(|(_, s)| s.center).collect(), bounds, scene_radius);
        let tree = LightTree::new(sources);
        let infinite = emitting().filter(|(_, (l, _))| l.bounds().is_none()).map(|(i, _)| i);
        let indices: Vec<usize> = tree.order().iter().copied().chain(infinite).collect();

        let mut positions = vec![None; lights.len()];
        let mut power_before = vec![0.0];
        let mut sum = 0.0;
        let min = MIN_POWER * total;
        for (position, &i) in (0..).zip(&indices) {
            positions[i] = Some(position);
            sum += powers[i].max(min);
            power_before.push(sum);
        }
        Some(Self {
            tree,
            order: indices.into_iter().map(|i| LightId(i as u32)).collect(),
            positions,
            power_before,
            scene_radius,
            cells: vec![OnceLock::new(); grids.len()],
            grids,
        })
    }

    /// Splits all lights except `except` into clusters: at most `max` clusters of finite lights, as
    /// seen from the middle of the grids, and one cluster per light at infinity.
    pub fn clusters(&self, lights: &[Light], except: Option<LightId>, max: usize) -> Vec<Vec<LightId>> {
        let half = self.grids.half * 2f32.powi(self.grids.levels as i32 - 1);
        let region = ReceiverRegion {
            center: self.grids.center,
            radius: half.length(),
            normal: Vec3::ZERO,
        };
        let ids = |range: std::ops::Range<usize>| self.order.get(range).unwrap_or_default().to_vec();
        let cut = self.tree.cut(lights, &region, max).into_iter();
        let clusters = cut.map(|c| ids(c.first as usize..(c.first + c.count) as usize));
        let infinite = (self.tree.order().len()..self.order.len()).map(|i| ids(i..i + 1));
        clusters
            .chain(infinite)
            .filter(|ids| *ids != except.as_slice())
            .collect()
    }

    /// Samples a light for `context`; returns it with its probability.
    #[inline]
    pub fn sample(&self, lights: &[Light], context: &LightSampleContext, u: f32) -> Option<(LightId, f32)> {
        self.sample_entries(self.entries(lights, context)?, u)
    }

    /// Samples a light from the distribution `entries`; returns it with its probability.
    pub fn sample_entries(&self, entries: &[Entry], u: f32) -> Option<(LightId, f32)> {
        let i = entries
            .partition_point(|e| e.upper <= u)
            .min(entries.len().saturating_sub(1));
        let entry = entries.get(i)?;
        if entry.count == 1 {
            return Some((*self.order.get(entry.first as usize)?, entry.pmf));
        }
        // The position of `u` in the interval chooses a light of the cluster by power.
        let v = 1.0 - (entry.upper - u) / entry.pmf;
        let (range, before, power) = self.cluster(entry)?;
        let x = before[0] + v as f64 * power;
        let k = before[1..].partition_point(|&p| p <= x).min(range.len() - 1);
        let share = (before[k + 1] - before[k]) / power;
        Some((*self.order.get(range.start + k)?, entry.pmf * share as f32))
    }

    /// Probability of `light` for `context`.
    pub fn pmf(&self, lights: &[Light], context: &LightSampleContext, light: LightId) -> f32 {
        let entries = self.entries(lights, context);
        entries.map_or(0.0, |entries| self.pmf_of_entries(entries, light))
    }

    /// Probability of `light` in the distribution `entries`.
    pub fn pmf_of_entries(&self, entries: &[Entry], light: LightId) -> f32 {
        let pmf = || {
            let position = (*self.positions.get(light.0 as usize)?)?;
            let entry = entries.get(entries.partition_point(|e| e.first <= position).checked_sub(1)?)?;
            if entry.count == 1 {
                return Some(entry.pmf);
            }
            let (_, before, power) = self.cluster(entry)?;
            let k = (position - entry.first) as usize;
            Some(entry.pmf * ((before.get(k + 1)? - before.get(k)?) / power) as f32)
        };
        pmf().unwrap_or(0.0)
    }

    /// Returns three values for a cluster: the range of its lights in the order of the lights, the
    /// cumulative power before each of these lights and after the last, and the total power.
    fn cluster(&self, entry: &Entry) -> Option<(std::ops::Range<usize>, &[f64], f64)> {
        let range = entry.first as usize..(entry.first + entry.count) as usize;
        let before = self.power_before.get(range.start..=range.end)?;
        Some((range.clone(), before, before[range.len()] - before[0]))
    }

    /// Distribution of the lights in the cell of `context`. The first request computes it.
    #[inline(always)]
    fn entries(&self, lights: &[Light], context: &LightSampleContext) -> Option<&[Entry]> {
        let index = self.grids.cell(context.p);
        let normal = normal_index(context.n);
        let cell = self.cells.get(index)?;
        let entries = cell.get().and_then(|cell| cell[normal].get()).map(Box::as_ref);
        Some(entries.unwrap_or_else(|| self.make(lights, cell, index, normal)))
    }

    #[cold]
    #[inline(never)]
    fn make<'a>(&'a self, lights: &[Light], cell: &'a OnceLock<Box<Cell>>, index: usize, normal: usize) -> &'a [Entry] {
        let cell = cell.get_or_init(|| Box::new([const { OnceLock::new() }; NORMALS]));
        cell[normal].get_or_init(|| {
            let (center, radius) = self.grids.ball(index);
            let region = ReceiverRegion {
                center,
                radius,
                normal: normal_direction(normal),
            };
            self.distribution(lights, &region, &|_, irradiance| irradiance)
        })
    }

    /// Distribution of the lights for receiving points in `region`. `corrected` takes a light and
    /// the estimate of its irradiance in `region`, and returns a refined estimate.
    pub fn distribution(
        &self,
        lights: &[Light],
        region: &ReceiverRegion,
        corrected: &dyn Fn(LightId, f64) -> f64,
    ) -> Box<[Entry]> {
        // Collect the clusters, and a separate entry for each light at infinity
        let cut = self.tree.cut(lights, region, MAX_CLUSTERS).into_iter();
        let mut parts: Vec<(u32, u32, f64)> = cut
            .map(|c| {
                let ids = self
                    .order
                    .get(c.first as usize..(c.first + c.count) as usize)
                    .unwrap_or_default();
                let share = c.irradiance as f64 / ids.len().max(1) as f64;
                (c.first, c.count, ids.iter().map(|&id| corrected(id, share)).sum())
            })
            .collect();
        for (position, id) in (0..).zip(&self.order).skip(self.tree.order().len()) {
            let light = lights.get(id.0 as usize);
            let irradiance = light.map_or(0.0, |l| l.irradiance_from_infinity(region, self.scene_radius));
            parts.push((position, 1, corrected(*id, irradiance)));
        }

        // Mix the probability by irradiance with a little probability by power, and apply the
        // minimum
        let sum: f64 = parts.iter().map(|(.., e)| e).sum();
        let by_place = if sum > 0.0 && sum.is_finite() {
            1.0 - BY_POWER
        } else {
            0.0
        };
        let total_power = self.power_before.last().copied().unwrap_or(1.0);
        let weight = |&(first, count, irradiance): &(u32, u32, f64)| {
            let power = self.power_before[(first + count) as usize] - self.power_before[first as usize];
            let by_irradiance = if by_place > 0.0 {
                by_place * irradiance / sum
            } else {
                0.0
            };
            by_irradiance + (1.0 - by_place) * power / total_power + MIN_PROBABILITY
        };
        let weights: Vec<f64> = parts.iter().map(weight).collect();
        let total: f64 = weights.iter().sum();
        let mut so_far = 0.0;
        let mut lower = 0.0;
        let entries = parts.iter().zip(&weights).enumerate().map(|(i, (part, weight))| {
            so_far += weight;
            let upper = if i + 1 == parts.len() {
                1.0
            } else {
                (so_far / total) as f32
            };
            let pmf = upper - lower;
            lower = upper;
            Entry {
                upper,
                pmf,
                first: part.0,
                count: part.1,
            }
        });
        entries.collect()
    }
}

/// Index, below [`NORMALS`], of the representative normal nearest to `n`. Returns the middle index
/// if `n` is zero.
#[inline(always)]
pub(super) fn normal_index(n: Vec3) -> usize {
    // sin 22.5°: the limit between an axis and a diagonal of a coordinate plane
    const NEAR_ZERO: f32 = 0.382_683_43;
    let digit = |x: f32| usize::from(x > -NEAR_ZERO) + usize::from(x > NEAR_ZERO);
    digit(n.x) + 3 * digit(n.y) + 9 * digit(n.z)
}

/// Representative unit normal with the index `index`; zero for the middle index.
pub(super) fn normal_direction(index: usize) -> Vec3 {
    let digit = |i: usize| (i % 3) as f32 - 1.0;
    Vec3::new(digit(index), digit(index / 3), digit(index / 9)).normalize_or_zero()
}

/// Concentric grids, each twice as large as the one within it.
#[derive(Clone, Copy, Debug)]
struct Grids {
    center: Vec3,
    /// Half the side lengths of the innermost grid.
    half: Vec3,
    /// Number of cells along each side of a grid.
    counts: [u32; 3],
    levels: u32,
}

impl Grids {
    /// Grids for lights in the box `lights`, in a scene within `bounds`.
    fn new(lights: Bounds3, bounds: Bounds3, scene_radius: f32) -> Self {
        // Extend the box of the lights by half its size
        let mut inner = lights;
        if !lights.is_empty() {
            let margin = (0.5 * (lights.max - lights.min).max_element()).max(scene_radius / 64.0);
            inner.min = (lights.min - Vec3::splat(margin)).max(bounds.min);
            inner.max = (lights.max + Vec3::splat(margin)).min(bounds.max);
        }
        if inner.is_empty() {
            inner = bounds;
        }
        // The margins are unusual fractions of the size. Walls often have round coordinates or are
        // the scene's bounds, so borders between cells then do not lie on walls. On a border,
        // rounding errors would decide the cell of a point.
        let margins =
            [0.013, 0.029].map(|share| share * (inner.max - inner.min).max_element().max(scene_radius / 64.0));
        inner.min -= margins[0];
        inner.max += margins[1];
        let extent = inner.max - inner.min;
        let size = extent.max_element() / RESOLUTION as f32;
        let size = if size > 0.0 && size.is_finite() { size } else { 1.0 };
        let counts = extent
            .to_array()
            .map(|e| ((e / size).ceil() as u32).clamp(1, RESOLUTION));
        let half = 0.5 * size * Vec3::from_array(counts.map(|n| n as f32));
        let center = inner.center();
        let reach = ((bounds.max - center).max(center - bounds.min) / half).max_element();
        Self {
            center,
            half,
            counts,
            levels: 1 + level_of(reach).min(MAX_LEVELS - 1),
        }
    }

    fn len(&self) -> usize {
        self.levels as usize * self.cells_of_level()
    }

    fn cells_of_level(&self) -> usize {
        self.counts.iter().map(|&n| n as usize).product()
    }

    /// The cell of `p`; the nearest cell if `p` is outside.
    #[inline(always)]
    fn cell(&self, p: Vec3) -> usize {
        let x = (p - self.center) / self.half;
        let level = level_of(x.abs().max_element()).min(self.levels - 1);
        let shrunk = x * f32::from_bits((127 - level) << 23);
        let [nx, ny, nz] = self.counts;
        let digit = |x: f32, n: u32| (((0.5 * x + 0.5) * n as f32) as u32).min(n - 1);
        let [i, j, k] = [digit(shrunk.x, nx), digit(shrunk.y, ny), digit(shrunk.z, nz)];
        (((level * nz + k) * ny + j) * nx + i) as usize
    }

    /// Middle of a cell, and the radius of a ball that encloses it.
    fn ball(&self, cell: usize) -> (Vec3, f32) {
        let [nx, ny, nz] = self.counts.map(|n| n as usize);
        let index = [cell % nx, cell / nx % ny, cell / (nx * ny) % nz];
        let scale = 2f32.powi((cell / self.cells_of_level()) as i32);
        let counts = Vec3::from_array(self.counts.map(|n| n as f32));
        let x = (Vec3::from_array(index.map(|i| i as f32)) + 0.5) / counts * 2.0 - 1.0;
        let size = 2.0 * self.half / counts * scale;
        (self.center + x * self.half * scale, 0.5 * size.length())
    }
}

/// Smallest integer k ≥ 0 for which 2ᵏ is larger than `x`.
#[inline(always)]
fn level_of(x: f32) -> u32 {
    (x.to_bits() >> 23).saturating_sub(126)
}

#[cfg(test)]
mod tests;
