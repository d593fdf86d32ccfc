//! Point sets on the unit sphere: low-discrepancy points of the cube that lie in the unit ball,
//! projected from the centre of the ball to the sphere.
//!
//! Points of the cube [−1, 1)³ outside the unit ball are rejected. If points are uniform in the
//! ball, their directions are uniform on the sphere, so the projection keeps the uniformity of the
//! points. The sets are not random, and are the same in every render.

use super::halton::plain_radical_inverse;
use super::sobol::second_dimension;
use super::sphere::MAX_BITS;
use crate::math::{DVec3, Vec3};
use std::sync::OnceLock;

/// Low-discrepancy points in the cube.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CubePoints {
    /// Halton's sequence in the bases 2, 3 and 5.
    #[default]
    Halton,
    /// Hammersley's set: the first coordinate is the index divided by the number of points, and the
    /// other coordinates are Halton's sequence in the bases 2 and 3.
    Hammersley,
    /// The first three dimensions of Sobol's sequence.
    Sobol,
}

impl CubePoints {
    /// The first 2^`bits` points in the ball, as unit vectors, in the order of the sequence. `bits`
    /// is at most [`MAX_BITS`].
    pub(super) fn directions(self, bits: u32) -> &'static [Vec3] {
        static SETS: [[OnceLock<Vec<Vec3>>; MAX_BITS as usize + 1]; 3] =
            [const { [const { OnceLock::new() }; MAX_BITS as usize + 1] }; 3];
        let bits = bits.min(MAX_BITS);
        SETS[self as usize][bits as usize].get_or_init(|| self.make(1 << bits))
    }

    fn make(self, count: usize) -> Vec<Vec3> {
        match self {
            Self::Halton | Self::Sobol => (1..).filter_map(|i| in_ball(self.point(i, 0))).take(count).collect(),
            // Hammersley's set depends on the number of points in the cube. Use the smallest number
            // that leaves enough points in the ball.
            Self::Hammersley => {
                let set = |n: u32| (0..n).filter_map(move |i| in_ball(self.point(i, n))).take(count);
                let n = (count as u32..).find(|&n| set(n).count() == count).unwrap_or_default();
                set(n).collect()
            }
        }
    }

    /// Point `i` of the unit cube. `n` is the number of points in the cube, which only Hammersley's
    /// set needs.
    fn point(self, i: u32, n: u32) -> DVec3 {
        let unit = |bits: u32| bits as f64 / 2f64.powi(32);
        match self {
            Self::Halton => DVec3::from([2, 3, 5].map(|base| plain_radical_inverse(base, i))),
            Self::Hammersley => {
                let first = (i as f64 + 0.5) / n as f64;
                DVec3::new(first, plain_radical_inverse(2, i), plain_radical_inverse(3, i))
            }
            Self::Sobol => {
                DVec3::from([i.reverse_bits(), second_dimension(i).reverse_bits(), third_dimension(i)].map(unit))
            }
        }
    }
}

/// Third coordinate of Sobol's point `i`, times 2³²: the primitive polynomial is x² + x + 1, and
/// the first direction numbers are 1 and 3 (Joe and Kuo 2008, "Constructing Sobol Sequences with
/// Better Two-Dimensional Projections").
fn third_dimension(i: u32) -> u32 {
    let (mut m, mut next, mut coordinate) = (1u32, 3u32, 0);
    for digit in 0..u32::BITS {
        if i >> digit & 1 == 1 {
            coordinate ^= m << (u32::BITS - 1 - digit);
        }
        (m, next) = (next, (next << 1) ^ (m << 2) ^ m);
    }
    coordinate
}

/// Direction from the centre of the unit cube to `point`; `None` if the point is outside the ball.
fn in_ball(point: DVec3) -> Option<Vec3> {
    let p = 2.0 * point - DVec3::ONE;
    let r2 = p.length_squared();
    (r2 > 0.0 && r2 <= 1.0).then(|| (p / r2.sqrt()).as_vec3a())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{cap_discrepancy, sphere::pair};
    use crate::sampling::warp::uniform_sphere;

    const ALL: [CubePoints; 3] = [CubePoints::Halton, CubePoints::Hammersley, CubePoints::Sobol];

    /// Compares each set with 512 random points, whose discrepancy is about 1/√n = 0.05. The random
    /// points come from the hash function of the other samplers.
    #[test]
    fn sets_are_more_uniform_than_random_points() {
        let random: Vec<Vec3> = (0..512)
            .map(|i| uniform_sphere(pair(crate::math::hash::mix(i))))
            .collect();
        let random = cap_discrepancy(&random);
        for points in ALL {
            let set = points.directions(9);
            assert_eq!(set.len(), 512);
            assert!(set.iter().all(|p| (p.length() - 1.0).abs() < 1e-6));
            let found = cap_discrepancy(set);
            assert!(found < 0.7 * random, "{points:?}: {found}, random points {random}");
        }
    }

    /// Sets of all sizes are complete, and at least 98 % of the points of a set are different.
    #[test]
    fn sets_have_the_requested_number_of_points() {
        for points in ALL {
            for bits in 0..=MAX_BITS {
                let set = points.directions(bits);
                assert_eq!(set.len(), 1 << bits, "{points:?}");
                let mut sorted: Vec<_> = set.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
                sorted.sort_unstable();
                sorted.dedup();
                // Only points on one line through the centre have equal directions.
                assert!(sorted.len() * 100 >= set.len() * 98, "{points:?} {bits}");
            }
        }
    }
}
