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
//! power. A table needs one binary search.
//!
//! A cell with many lights around it is larger than the distance between lights. One table cannot
//! describe the light at all points of such a cell. There the hierarchy itself is descended: at
//! each node, one of the two children is chosen by its estimated irradiance at the receiving point
//! (Conty and Kulla 2018, "Importance Sampling of Many Lights with Adaptive Tree Splitting"). The
//! descent ends at a node that is small as seen from the point. In this node, a light is chosen by
//! power. `Node::irradiance_at` has the estimate.
//!
//! 2 % of the choices are made by power, independent of the estimates, and each cluster has a
//! probability of at least 2⁻²⁰. So every light can be sampled. docs/notebook/2026-11.md, "By
//! place", has the gain and the variants that were tried.

mod grids;

use super::LightSampleContext;
use super::tree::{Cluster, LightTree, Node};
use crate::light::bounds::ReceiverRegion;
use crate::light::{Light, LightId};
use crate::math::{Bounds3, Vec3};
use grids::Grids;
use std::sync::OnceLock;

/// Maximum number of light clusters per cell.
const MAX_CLUSTERS: usize = 64;
/// Maximum ratio of radius to distance of a group of lights in which a light is chosen by power.
const FAR: f32 = 0.25;
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
    /// For each cell of the innermost grid, true if many lights are around it; empty if this is so
    /// for no cell.
    dense: Vec<bool>,
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
    /// Index of the cluster's node in the tree.
    node: u32,
    /// True if a descent of the tree chooses a light of the cluster; false if power decides.
    is_descended: bool,
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
        let centers: Vec<Vec3> = sources.iter().map(|(_, s)| s.center).collect();
        let grids = Grids::new(&centers, bounds, scene_radius);
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
            dense: grids.dense_cells(&centers),
            grids,
        })
    }

    /// Splits all lights except `except` into clusters: at most `max` clusters of finite lights, as
    /// seen from the middle of the grids, and one cluster per light at infinity.
    pub fn clusters(&self, lights: &[Light], except: Option<LightId>, max: usize) -> Vec<Vec<LightId>> {
        let (center, radius) = self.grids.ball_of_all();
        let region = ReceiverRegion {
            center,
            radius,
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
        self.sample_entries(self.entries(lights, context)?, context, u)
    }

    /// Samples a light for `context` from the distribution `entries`; returns it with its
    /// probability.
    pub fn sample_entries(&self, entries: &[Entry], context: &LightSampleContext, u: f32) -> Option<(LightId, f32)> {
        let i = entries
            .partition_point(|e| e.upper <= u)
            .min(entries.len().saturating_sub(1));
        let entry = entries.get(i)?;
        if entry.count == 1 {
            return Some((*self.order.get(entry.first as usize)?, entry.pmf));
        }
        // The position of `u` in the interval chooses a light of the cluster.
        let v = f64::from(1.0 - (entry.upper - u) / entry.pmf);
        let cluster = self.tree.nodes().get(entry.node as usize)?;
        let (position, share) = if entry.is_descended {
            self.descent(context).sample(entry.node as usize, v)?
        } else {
            let position = by_power(&self.power_before, cluster, v);
            (position, power_share(&self.power_before, cluster, position))
        };
        Some((*self.order.get(position as usize)?, entry.pmf * share as f32))
    }

    /// Probability of `light` for `context`.
    pub fn pmf(&self, lights: &[Light], context: &LightSampleContext, light: LightId) -> f32 {
        let entries = self.entries(lights, context);
        entries.map_or(0.0, |entries| self.pmf_of_entries(entries, context, light))
    }

    /// Probability of `light` for `context` in the distribution `entries`.
    pub fn pmf_of_entries(&self, entries: &[Entry], context: &LightSampleContext, light: LightId) -> f32 {
        let pmf = || {
            let position = (*self.positions.get(light.0 as usize)?)?;
            let entry = entries.get(entries.partition_point(|e| e.first <= position).checked_sub(1)?)?;
            if entry.count == 1 {
                return Some(entry.pmf);
            }
            let cluster = self.tree.nodes().get(entry.node as usize)?;
            let share = if entry.is_descended {
                self.descent(context).share(entry.node as usize, position)?
            } else {
                power_share(&self.power_before, cluster, position)
            };
            Some(entry.pmf * share as f32)
        };
        pmf().unwrap_or(0.0)
    }

    /// Choice of a light of a cluster for the receiving point `context`.
    fn descent(&self, context: &LightSampleContext) -> Descent<'_> {
        Descent {
            nodes: self.tree.nodes(),
            power_before: &self.power_before,
            context: *context,
        }
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
        let cut = self.tree.cut(lights, region, MAX_CLUSTERS);
        let is_dense = self.is_dense(region.center);
        let mut parts: Vec<(Cluster, f64)> = match self.tree.nodes().first() {
            Some(root) if is_dense => {
                let all = Cluster {
                    first: 0,
                    count: root.count,
                    node: 0,
                    irradiance: cut.iter().map(|cluster| cluster.irradiance).sum(),
                };
                vec![(all, f64::from(all.irradiance))]
            }
            _ => cut
                .into_iter()
                .map(|cluster| (cluster, self.corrected(&cluster, corrected)))
                .collect(),
        };
        for (position, id) in (0..).zip(&self.order).skip(self.tree.order().len()) {
            let light = lights.get(id.0 as usize);
            let irradiance = light.map_or(0.0, |l| l.irradiance_from_infinity(region, self.scene_radius));
            let cluster = Cluster {
                first: position,
                count: 1,
                node: 0,
                irradiance: irradiance as f32,
            };
            parts.push((cluster, corrected(*id, irradiance)));
        }

        // Mix the probability by irradiance with a little probability by power, and apply the
        // minimum
        let sum: f64 = parts.iter().map(|(_, irradiance)| irradiance).sum();
        let by_place = if sum > 0.0 && sum.is_finite() {
            1.0 - BY_POWER
        } else {
            0.0
        };
        let total_power = self.power_before.last().copied().unwrap_or(1.0);
        let weight = |&(cluster, irradiance): &(Cluster, f64)| {
            let power = power_of(&self.power_before, cluster.first, cluster.count);
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
                first: part.0.first,
                count: part.0.count,
                node: part.0.node,
                is_descended: is_dense,
            }
        });
        entries.collect()
    }

    /// Sum of the refined irradiances of the lights of `cluster`.
    fn corrected(&self, cluster: &Cluster, corrected: &dyn Fn(LightId, f64) -> f64) -> f64 {
        let ids = self
            .order
            .get(cluster.first as usize..(cluster.first + cluster.count) as usize);
        let ids = ids.unwrap_or_default();
        let share = f64::from(cluster.irradiance) / ids.len().max(1) as f64;
        ids.iter().map(|&id| corrected(id, share)).sum()
    }

    /// Returns true if many lights are around `p`.
    fn is_dense(&self, p: Vec3) -> bool {
        self.dense.get(self.grids.cell(p)).copied().unwrap_or(false)
    }
}

/// Choice of a light of a cluster by its irradiance at a point: a descent of the hierarchy.
struct Descent<'a> {
    nodes: &'a [Node],
    power_before: &'a [f64],
    /// The receiving point.
    context: LightSampleContext,
}

impl Descent<'_> {
    /// Samples a light of the node `root` by the random number `v`. Returns the position of the
    /// light in the order of the lights, and its probability.
    fn sample(&self, root: usize, v: f64) -> Option<(u32, f64)> {
        let all = self.nodes.get(root)?;
        // A small part of the lights is chosen by power, for which no estimate can be wrong.
        if v < BY_POWER {
            let position = by_power(self.power_before, all, v / BY_POWER);
            return Some((position, self.share(root, position)?));
        }
        let (mut index, mut node, mut share) = (root, all, 1.0);
        let mut x = (v - BY_POWER) / (1.0 - BY_POWER);
        while node.count > 1 && !self.is_far(node) {
            let q = self.first_share(index);
            (index, x, share) = if x < q {
                (index + 1, x / q, share * q)
            } else {
                (node.second as usize, (x - q) / (1.0 - q), share * (1.0 - q))
            };
            node = self.nodes.get(index)?;
        }
        let position = by_power(self.power_before, node, x);
        share *= power_share(self.power_before, node, position);
        Some((position, self.mixed(all, position, share)))
    }

    /// Probability that [`Descent::sample`] samples the light at `position`.
    fn share(&self, root: usize, position: u32) -> Option<f64> {
        let all = self.nodes.get(root)?;
        let (mut index, mut node, mut share) = (root, all, 1.0);
        while node.count > 1 && !self.is_far(node) {
            let q = self.first_share(index);
            let second = self.nodes.get(node.second as usize)?;
            (index, share) = if position < second.first {
                (index + 1, share * q)
            } else {
                (node.second as usize, share * (1.0 - q))
            };
            node = self.nodes.get(index)?;
        }
        share *= power_share(self.power_before, node, position);
        Some(self.mixed(all, position, share))
    }

    /// Probability of the light at `position` of the node `all`. The descent has the probability
    /// `share`.
    fn mixed(&self, all: &Node, position: u32, share: f64) -> f64 {
        BY_POWER * power_share(self.power_before, all, position) + (1.0 - BY_POWER) * share
    }

    /// Returns true if the lights of `node` are so far away that their power decides.
    fn is_far(&self, node: &Node) -> bool {
        node.angle_squared(self.context.p) < FAR * FAR
    }

    /// Probability of the first child of the node `index`.
    fn first_share(&self, index: usize) -> f64 {
        let [first, second] = [index + 1, self.nodes[index].second as usize].map(|child| &self.nodes[child]);
        let [a, b] = [first, second].map(|node| f64::from(node.irradiance_at(self.context.p, self.context.n)));
        if a + b > 0.0 && (a + b).is_finite() {
            a / (a + b)
        } else {
            // The point is at a light, or no light is above its surface
            let [a, b] = [first, second].map(|node| power_of(self.power_before, node.first, node.count));
            a / (a + b)
        }
    }
}

/// Position of a light of `node`, chosen by power. `before` has the summed power before each light.
fn by_power(before: &[f64], node: &Node, v: f64) -> u32 {
    let first = node.first as usize;
    let before = &before[first..=first + node.count as usize];
    let x = before[0] + v * (before[before.len() - 1] - before[0]);
    node.first + before[1..].partition_point(|&p| p <= x).min(before.len() - 2) as u32
}

/// Probability of the light at `position` if a light of `node` is chosen by power.
fn power_share(before: &[f64], node: &Node, position: u32) -> f64 {
    power_of(before, position, 1) / power_of(before, node.first, node.count)
}

/// Power of the `count` lights from `first` on. `before` has the summed power before each light.
fn power_of(before: &[f64], first: u32, count: u32) -> f64 {
    before[(first + count) as usize] - before[first as usize]
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

#[cfg(test)]
mod tests;
