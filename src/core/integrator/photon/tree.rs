//! A k-d tree of photons, which finds the k photons nearest to a point.
//!
//! `photon_map` uses a tree instead of a grid, because the densities of photons differ by powers of
//! ten. The tree is built only once, so its construction may take longer. We wrote the tree (about
//! 100 lines) because existing crates store points separately from their data and cannot filter
//! points during the search.
//!
//! The farthest of the k photons sets the radius and is not counted, because `(k − 1) / (π r²)` has
//! no bias if the density of photons is uniform.

use super::photons::Photon;
use crate::math::{Bounds3, Vec3};
use std::collections::BinaryHeap;
use std::ops::Range;

/// Photons sorted by position in a balanced k-d tree (Bentley 1975; Jensen 1996). Finds the photons
/// nearest to a point, for any density.
#[derive(Debug)]
pub struct PhotonTree {
    /// Photons in the order of the tree. The root of a range of photons is in the middle of the
    /// range, and its two subtrees are on either side.
    photons: Vec<Photon>,
    /// For each photon, the axis along which it divides its range: 0, 1 or 2.
    axes: Vec<u8>,
}

/// Result of a search: the photons nearest to a point.
#[derive(Debug)]
pub struct NearestPhotons<'t> {
    /// The photons, in no particular order.
    pub photons: Vec<&'t Photon>,
    /// Squared search radius. No other photon is within the search radius.
    pub squared: f32,
}

impl PhotonTree {
    /// Builds the tree of `photons`. The tree depends only on the photons and their order.
    pub fn new(mut photons: Vec<Photon>) -> Self {
        let mut axes = vec![0; photons.len()];
        // Ranges that must still be divided
        let mut ranges: Vec<Range<usize>> = Vec::with_capacity(64);
        ranges.push(0..photons.len());
        while let Some(range) = ranges.pop() {
            if range.len() < 2 {
                continue;
            }
            let within = &mut photons[range.clone()];
            let bounds: Bounds3 = within.iter().map(Photon::p).collect();
            let size = bounds.max - bounds.min;
            let axis = if size.x >= size.y.max(size.z) {
                0
            } else if size.y >= size.z {
                1
            } else {
                2
            };
            within.select_nth_unstable_by(range.len() / 2, |a, b| a.p()[axis].total_cmp(&b.p()[axis]));
            let middle = middle(&range);
            axes[middle] = axis as u8;
            ranges.extend([range.start..middle, middle + 1..range.end]);
        }
        Self { photons, axes }
    }

    /// Number of photons in the tree.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// Returns `true` if the tree has no photons.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// All photons, in the order of the tree.
    pub fn photons(&self) -> &[Photon] {
        &self.photons
    }

    /// Finds the `count` photons nearest to `p` for which `counts` returns `true`. The farthest of
    /// these photons sets the radius and is not returned. If fewer photons are within `radius`,
    /// returns all of them.
    ///
    /// Let r be the distance of the farthest of the `count` photons. If the photons are uniformly
    /// distributed over a plane, the mean of `(count − 1) / (π r²)` is their density.
    pub fn nearest(&self, p: Vec3, count: usize, radius: f32, counts: impl Fn(&Photon) -> bool) -> NearestPhotons<'_> {
        // Heap of squared distances (as bits) and indices in the tree. Bits of non-negative floats
        // have the order of the floats, so the heap is sorted by distance.
        let mut heap: BinaryHeap<(u32, usize)> = BinaryHeap::with_capacity(count + 1);
        let mut squared = radius * radius;
        // Unvisited halves and their distances from `p`
        let mut ranges: Vec<(Range<usize>, f32)> = Vec::with_capacity(64);
        ranges.push((0..self.photons.len(), 0.0));
        while let Some((range, far)) = ranges.pop() {
            if range.is_empty() || far > squared {
                continue;
            }
            let middle = middle(&range);
            let photon = &self.photons[middle];
            let axis = self.axes[middle] as usize;
            let across = p[axis] - photon.p()[axis];
            let distance = photon.p().distance_squared(p);
            if distance <= squared && counts(photon) {
                heap.push((distance.to_bits(), middle));
                if heap.len() > count {
                    heap.pop();
                }
                if let Some(&(bits, _)) = heap.peek().filter(|_| heap.len() == count) {
                    squared = f32::from_bits(bits);
                }
            }
            // Visit the half that contains `p` first.
            let halves = [range.start..middle, middle + 1..range.end];
            let [near, other] = match (across < 0.0, halves) {
                (true, [a, b]) => [a, b],
                (false, [a, b]) => [b, a],
            };
            ranges.push((other, across * across));
            ranges.push((near, far));
        }
        if heap.len() == count {
            heap.pop();
        }
        NearestPhotons {
            photons: heap.into_iter().map(|(_, i)| &self.photons[i]).collect(),
            squared,
        }
    }
}

fn middle(range: &Range<usize>) -> usize {
    range.start + range.len() / 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::light::LightId;
    use crate::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};

    /// The tree finds the same photons as a sort by distance: many and few photons, large and small
    /// radii, rejected photons, and many photons at one position.
    #[test]
    fn tree_finds_same_photons_as_sort_by_distance() {
        let mut sampler = Independent::new(2);
        let mut at = |i: u32| {
            sampler.start(SampleKey::new(i, 0, 0));
            let xy = sampler.get_2d(Dimension::bounce(0, Bounce::Direction));
            Vec3::new(xy.x, xy.y, 0.1 * sampler.get_1d(Dimension::bounce(0, Bounce::Lobe)))
        };
        let mut places: Vec<Vec3> = (0..2000).map(&mut at).collect();
        places.extend([places[3]; 30]);
        let photon = |(i, p): (usize, &Vec3)| {
            let mut photon = Photon::new(LightId(0), *p, Vec3::Z, Vec3::Z, Spectrum::ONE);
            photon.scatterings = (i % 3) as u16;
            photon
        };
        let photons: Vec<Photon> = places.iter().enumerate().map(photon).collect();
        let tree = PhotonTree::new(photons.clone());
        assert_eq!(tree.len(), photons.len());
        let counts = |photon: &Photon| photon.scatterings < 2;
        for i in 0..200 {
            let p = at(10_000 + i);
            for (count, radius) in [(1, 9.0), (2, 9.0), (50, 9.0), (50, 0.05), (5000, 9.0), (10, 1e-9)] {
                let accepted = photons.iter().filter(|photon| counts(photon));
                let mut expected: Vec<f32> = accepted.map(|photon| photon.p().distance_squared(p)).collect();
                expected.retain(|d| *d <= radius * radius);
                expected.sort_unstable_by(f32::total_cmp);
                let reach = expected.get(count - 1).copied().unwrap_or(radius * radius);
                expected.truncate(if expected.len() < count {
                    expected.len()
                } else {
                    count - 1
                });
                let nearest = tree.nearest(p, count, radius, counts);
                let mut found: Vec<f32> = nearest
                    .photons
                    .iter()
                    .map(|photon| photon.p().distance_squared(p))
                    .collect();
                found.sort_unstable_by(f32::total_cmp);
                assert_eq!((found, nearest.squared), (expected, reach), "{count} within {radius}");
            }
        }
    }

    #[test]
    fn an_empty_tree_has_no_nearest() {
        let tree = PhotonTree::new(Vec::new());
        assert!(tree.is_empty());
        assert!(tree.nearest(Vec3::ZERO, 5, 1.0, |_| true).photons.is_empty());
    }
}
