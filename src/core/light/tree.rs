//! Hierarchy of lights with estimates of their irradiance, without visibility. `light_grid` uses
//! cuts of the hierarchy as clusters of lights.

use super::Light;
use crate::math::{Bounds3, Vec3};

/// Position, size and emission of one finite light, or of several finite lights treated as one.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightBounds {
    /// Middle of the bounding sphere, world space.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Luminance of the maximum radiant intensity over all directions, W/sr.
    pub intensity: f32,
    /// Mean of the directions of maximum emission, weighted by intensity. The mean is shorter if
    /// the directions differ.
    pub axis: Vec3,
    /// Bound on the error of a cosine if `axis` replaces the direction of a single light.
    pub spread: f32,
}

impl LightBounds {
    /// A light with equal emission in all directions. With its `axis` and `spread`, [`soft_cosine`]
    /// is 1 for every direction.
    pub fn isotropic(center: Vec3, intensity: f32) -> Self {
        Self {
            center,
            radius: 0.0,
            intensity,
            axis: Vec3::ZERO,
            spread: 4.0,
        }
    }

    /// Bounds of both sources together.
    fn and(&self, other: &Self) -> Self {
        let intensity = self.intensity + other.intensity;
        let t = if intensity > 0.0 {
            other.intensity / intensity
        } else {
            0.5
        };
        let mean = |a: Vec3, b: Vec3| a * (1.0 - t) + b * t;
        let center = mean(self.center, other.center);
        let reach = |s: &Self| s.center.distance(center) + s.radius;
        let axis = mean(self.axis, other.axis);
        // If the axis of one source is replaced by the mean axis, the error of a cosine is at most
        // the distance between both vectors.
        let spread = |s: &Self| s.spread + s.axis.distance(axis);
        Self {
            center,
            radius: reach(self).max(reach(other)),
            intensity,
            axis,
            spread: (1.0 - t) * spread(self) + t * spread(other),
        }
    }
}

/// Receiving points in a ball, with normals near one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReceiverRegion {
    /// Centre of the bounding sphere of the points, in world space.
    pub center: Vec3,
    /// Radius of the bounding sphere.
    pub radius: f32,
    /// Unit direction near the normals of the points. Zero if both sides of the surface receive
    /// light.
    pub normal: Vec3,
}

/// Bound on the error of the cosine if [`ReceiverRegion::normal`] replaces the true normal.
const NORMAL_SPREAD: f32 = 0.25;

impl ReceiverRegion {
    /// Mean of max(cos θ, 0). θ is the angle between `wi` and the normal of a point of the region.
    /// Different positions of points and light change cos θ by up to `spread`. Returns 1/2 if both
    /// sides receive light.
    pub fn cosine(&self, wi: Vec3, spread: f32) -> f32 {
        if self.normal == Vec3::ZERO {
            return 0.5;
        }
        soft_cosine(wi.dot(self.normal), spread + NORMAL_SPREAD)
    }

    /// Estimate of the mean irradiance from `source`, without shadows.
    pub fn irradiance(&self, source: &LightBounds) -> f32 {
        self.irradiance_by(source.center, source.radius, |wi, spread| {
            source.intensity * soft_cosine(-wi.dot(source.axis), spread + source.spread)
        })
    }

    /// Estimate of the mean irradiance from a spherical source with the given `center` and
    /// `radius`. The function `intensity` returns the intensity towards the region. It takes the
    /// direction to the source, and a bound on the error of a cosine with this direction.
    pub fn irradiance_by(&self, center: Vec3, radius: f32, intensity: impl FnOnce(Vec3, f32) -> f32) -> f32 {
        // The mean squared distance between points of two balls is larger than the squared distance
        // of their centres. `d` is divided by the square root of this mean. So `wi` is shorter than
        // 1, and near 0 if the centres are close.
        let d = center - self.center;
        let squared = d.length_squared() + 0.5 * (self.radius * self.radius + radius * radius);
        let inverse = 1.0 / squared.sqrt();
        let (wi, spread) = (d * inverse, (self.radius + radius) * inverse);
        intensity(wi, spread) * self.cosine(wi, spread) / squared
    }

    /// Angular radius of `source` as seen from the region, approximately: radius divided by
    /// distance.
    fn angle(&self, source: &LightBounds) -> f32 {
        let distance = self.center.distance(source.center).max(self.radius);
        if source.radius > 0.0 {
            source.radius / distance
        } else {
            0.0
        }
    }
}

/// Range of the smallest distance of lights in [`Node::irradiance_at`], relative to their largest
/// distance.
const NEAREST: f32 = 1.0 / 256.0;
const FARTHEST: f32 = 0.999;

/// Mean of `max(cos + x, 0)` for x uniform in [−spread, spread]: a clamped cosine with an uncertain
/// angle.
pub(super) fn soft_cosine(cos: f32, spread: f32) -> f32 {
    if cos >= spread {
        cos
    } else if cos <= -spread {
        0.0
    } else {
        let x = cos + spread;
        x * x / (4.0 * spread)
    }
}

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

    #[test]
    fn soft_cosines_are_means() {
        for (cos, spread) in [(0.7, 0.2), (0.1, 0.3), (-0.1, 0.3), (-0.5, 0.4), (0.0, 4.0), (0.3, 0.0)] {
            const N: u32 = 100_000;
            let x = |i| cos + spread * (2.0 * (i as f32 + 0.5) / N as f32 - 1.0);
            let mean = (0..N).map(|i| x(i).max(0.0) as f64).sum::<f64>() / N as f64;
            let got = soft_cosine(cos, spread) as f64;
            assert!((got - mean).abs() < 1e-4, "{cos} {spread}: {got} {mean}");
        }
    }

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
