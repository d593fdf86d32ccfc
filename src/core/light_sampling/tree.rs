//! Hierarchy of lights with estimates of their irradiance, without visibility. `light_grid` uses
//! cuts of the hierarchy as clusters of lights.

use crate::light::Light;
use crate::light::bounds::{LightBounds, ReceiverRegion};
use crate::math::{Bounds3, Vec3};

/// Range of the smallest distance of lights in [`Node::irradiance_at`], relative to their largest
/// distance.
const NEAREST: f32 = 1.0 / 256.0;
const FARTHEST: f32 = 0.999;

/// Consecutive lights in the order of a [`LightTree`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Cluster {
    /// Index of the first light.
    pub first: u32,
    /// Number of lights.
    pub count: u32,
    /// Index of the node of these lights.
    pub node: u32,
    /// Estimate of the mean irradiance by these lights in the region for which the cut was made.
    pub irradiance: f32,
}

/// A binary hierarchy of the finite lights (Walter et al. 2005, "Lightcuts"). A cut of the
/// hierarchy has single lights near the receiver, and groups of lights far away.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    /// Nodes, each before its children. The first child is the next node.
    nodes: Vec<Node>,
    /// Index of the light of each leaf, from left to right.
    order: Vec<usize>,
}

/// Consecutive lights in the order of a [`LightTree`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    /// All lights of the node as one source.
    pub source: LightBounds,
    /// Bounding box of the lights.
    pub bounds: Bounds3,
    /// Index of the first light.
    pub first: u32,
    /// Number of lights.
    pub count: u32,
    /// Index of the second child. The first child is the next node.
    pub second: u32,
}

impl LightTree {
    /// Tree over `sources`, pairs of the index of a light and its bounds. The two children of a
    /// node have equal numbers of lights, or numbers that differ by one. So the depth is log₂ n.
    pub fn new(mut sources: Vec<(usize, LightBounds)>) -> Self {
        let mut nodes = Vec::with_capacity(2 * sources.len());
        if !sources.is_empty() {
            build(&mut sources, 0, &mut nodes);
        }
        Self {
            nodes,
            order: sources.into_iter().map(|(index, _)| index).collect(),
        }
    }

    /// All nodes, each before its children; the root first.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Index of the light of each leaf, from left to right.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Divides all lights into at most `max` clusters for `region`. Splits the cluster with the
    /// largest error bound first.
    pub fn cut(&self, lights: &[Light], region: &ReceiverRegion, max: usize) -> Vec<Cluster> {
        let Some(root) = self.nodes.first() else {
            return Vec::new();
        };
        let part = |index: usize, node: &Node| self.part(lights, region, index, node);
        let mut parts = Vec::with_capacity(max);
        parts.push(part(0, root));
        while parts.len() < max {
            let (mut worst, mut error) = (0, 0.0);
            for (i, part) in parts.iter().enumerate() {
                if part.error > error {
                    (worst, error) = (i, part.error);
                }
            }
            if error <= 0.0 {
                break;
            }
            let index = parts[worst].index;
            let second = self.nodes[index].second as usize;
            parts[worst] = part(index + 1, &self.nodes[index + 1]);
            parts.push(part(second, &self.nodes[second]));
        }
        parts.sort_unstable_by_key(|part| part.cluster.first);
        parts.into_iter().map(|part| part.cluster).collect()
    }

    fn part(&self, lights: &[Light], region: &ReceiverRegion, index: usize, node: &Node) -> CutNode {
        let light = match node.count {
            1 => self.order.get(node.first as usize).and_then(|&i| lights.get(i)),
            _ => None,
        };
        let (irradiance, error) = match light {
            Some(light) => (light.irradiance(region), 0.0),
            None => {
                let irradiance = region.irradiance(&node.source);
                (
                    irradiance,
                    irradiance * (region.angle(&node.source) + node.source.spread),
                )
            }
        };
        CutNode {
            index,
            error,
            cluster: Cluster {
                first: node.first,
                count: node.count,
                node: index as u32,
                irradiance,
            },
        }
    }
}

impl Node {
    /// Squared ratio of the radius of the bounding box to its distance from `p`.
    pub fn angle_squared(&self, p: Vec3) -> f32 {
        let half = 0.5 * (self.bounds.max - self.bounds.min);
        half.length_squared() / self.bounds.center().distance_squared(p)
    }

    /// Estimate of the irradiance at the point `p` with the normal `n`, up to a constant factor.
    /// The normal is zero if both sides of the surface receive light.
    ///
    /// The estimate supposes that the lights are spread over a plane ring around `p`, from the
    /// smallest to the largest distance of the bounding box. With distance r, the cosine at the
    /// surface is h / r, at most 1, where h is the largest height of the box above the surface. The
    /// cosine at the lights is treated alike. So light of a node around `p` comes mainly from its
    /// nearest lights. A bounding sphere, as in Conty and Kulla 2018, does not describe this: with
    /// it, the variance grows with the size of the hierarchy.
    pub fn irradiance_at(&self, p: Vec3, n: Vec3) -> f32 {
        let Bounds3 { min, max } = self.bounds;
        let farthest = (p - min).abs().max((p - max).abs()).length();
        // Lengths are fractions of the largest distance, so squares neither overflow nor vanish
        let scale = 1.0 / farthest;
        let nearest = scale * (p.clamp(min, max) - p).length();
        let a = nearest.clamp(NEAREST, FARTHEST);
        let (middle, half) = (scale * (0.5 * (min + max) - p), scale * (0.5 * (max - min)));
        // Largest distance of the box from the plane through `p` with the normal `axis`
        let height = |axis: Vec3| middle.dot(axis) + half.dot(axis.abs());
        let received = if n == Vec3::ZERO { f32::INFINITY } else { height(n) };
        let emitted = height(-self.source.axis) + self.source.spread;
        let (h, g) = (received.min(emitted), received.max(emitted));
        if h.is_nan() || h <= 0.0 {
            return 0.0;
        }
        // Integrate min(1, h/r) min(1, g/r) / r over r from a to 1, piece by piece
        let mut sum = 0.0;
        let (from, to) = (a, h.min(1.0));
        if to > from {
            sum += logarithm(to) - logarithm(from);
        }
        let (from, to) = (a.max(h), g.min(1.0));
        if to > from {
            sum += h * (to - from) / (from * to);
        }
        let from = a.max(g);
        if from < 1.0 {
            sum += 0.5 * h * g * (1.0 / (from * from) - 1.0);
        }
        self.source.intensity * sum * scale * scale / (1.0 - a * a)
    }
}

/// Natural logarithm of a positive number, linear between powers of two. Its error is at most 0.06.
fn logarithm(x: f32) -> f32 {
    x.to_bits() as f32 * (std::f32::consts::LN_2 / (1u32 << 23) as f32)
}

/// A node in a cut.
struct CutNode {
    index: usize,
    cluster: Cluster,
    /// Bound on the error of the irradiance; 0 for a single light.
    error: f32,
}

/// Adds the node of `sources` and all nodes below it. The first source is leaf `first`.
fn build(sources: &mut [(usize, LightBounds)], first: u32, nodes: &mut Vec<Node>) -> (LightBounds, Bounds3) {
    let index = nodes.len();
    let count = sources.len() as u32;
    let one = sources[0].1;
    let bounds = Bounds3 {
        min: one.center - one.radius,
        max: one.center + one.radius,
    };
    nodes.push(Node {
        source: one,
        bounds,
        first,
        count,
        second: 0,
    });
    if count == 1 {
        return (one, bounds);
    }
    let middles: Bounds3 = sources.iter().map(|(_, s)| s.center).collect();
    let extent = middles.max - middles.min;
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    let half = sources.len() / 2;
    sources.select_nth_unstable_by(half, |(i, a), (j, b)| {
        a.center[axis].total_cmp(&b.center[axis]).then(i.cmp(j))
    });
    let (left, right) = sources.split_at_mut(half);
    let left = build(left, first, nodes);
    let second = nodes.len() as u32;
    let right = build(right, first + half as u32, nodes);
    let source = left.0.and(&right.0);
    let bounds = Bounds3 {
        min: left.1.min.min(right.1.min),
        max: left.1.max.max(right.1.max),
    };
    (nodes[index].source, nodes[index].bounds) = (source, bounds);
    nodes[index].second = second;
    (source, bounds)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::PointLight;

    /// Every light is in one cluster of a cut, and few clusters estimate nearly the same irradiance
    /// as all lights.
    #[test]
    fn cut_contains_each_light_once() {
        let lights: Vec<Light> = (0..1000u32)
            .map(|i| {
                let digits = [i % 10, i / 10 % 10, i / 100].map(|d| d as f32);
                Light::Point(PointLight {
                    position: Vec3::from_array(digits),
                    intensity: Spectrum::splat(1.0 + (i * 7 % 13) as f32),
                })
            })
            .collect();
        let sources = lights.iter().enumerate().map(|(i, l)| (i, l.bounds().unwrap()));
        let tree = LightTree::new(sources.collect());
        let mut order = tree.order().to_vec();
        order.sort_unstable();
        assert!(order.into_iter().eq(0..1000));
        let region = ReceiverRegion {
            center: Vec3::new(2.5, -1.5, 3.5),
            radius: 0.5,
            normal: Vec3::Y,
        };
        let exact: f32 = lights.iter().map(|l| l.irradiance(&region)).sum();
        for max in [1, 2, 64, 2000] {
            let cut = tree.cut(&lights, &region, max);
            assert!(cut.len() <= max);
            let mut next = 0;
            for cluster in &cut {
                assert_eq!(cluster.first, next);
                next += cluster.count;
            }
            assert_eq!(next, 1000);
            let sum: f32 = cut.iter().map(|c| c.irradiance).sum();
            if max >= 64 {
                assert!((sum / exact - 1.0).abs() < 0.1, "{max}: {sum} {exact}");
            }
        }
    }
}
