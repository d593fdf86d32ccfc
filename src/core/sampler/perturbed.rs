//! Perturbed quasi-Monte Carlo directions (`--directions perturbed-qmc`), as Kim proposed them for
//! hemispheres.
//!
//! A low-discrepancy point set on the sphere (`ball.rs`) has the same points in each pixel, so its
//! errors form a visible pattern. Kim moves each point on a disk in its tangent plane. The
//! positions on the disk come from a second low-discrepancy sequence, indexed by the pixel. The
//! pattern becomes noise, and the points stay well distributed. `integrator/path/strategy.rs` maps
//! the sphere to the hemisphere, uniformly or by the cosine.
//!
//! Random scrambling, here a rotation of the set for each pixel and vertex, makes every direction
//! exactly uniform. The estimate is then unbiased for any points and disks. Without scrambling, the
//! estimate only converges with the number of points and the number of pixels together.
//!
//! docs/notebook/2026-11.md, "Perturbed quasi-Monte Carlo directions", compares these directions
//! with Owen-scrambled Sobol points, which have lower errors.

use super::ball::CubePoints;
use super::halton::radical_inverse;
use super::hash::{numbered, permute, pixel};
use super::sphere::{moved_on_disk, rotation, set_bits};
use super::{AnySampler, Bounce, Dimension, SampleKey, Sampler};
use crate::math::{Vec2, Vec3, hash::mix};
use crate::sampling::warp::square_of_sphere;

/// Options of [`PerturbedQmc`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Perturbation {
    /// Point set in the cube from which the directions are made.
    pub points: CubePoints,
    /// Radius of the disks, as a multiple of 2/√n for n points. At 1 a disk has the area 4π/n: the
    /// area of the sphere divided by the number of points. At 0 points are not moved.
    pub size: f32,
    /// True if the set is rotated at random for each pixel and vertex.
    pub is_scrambled: bool,
}

/// Perturbed quasi-Monte Carlo directions. All other numbers come from another sampler.
///
/// Each of n samples uses a different one of n points. Each vertex has a separate order of the
/// points. n is the largest power of 2 up to the number of samples, at most 1024. The sampler
/// returns points of the unit square that [`uniform_sphere`](crate::sampling::warp::uniform_sphere)
/// maps to the directions.
#[derive(Clone, Copy, Debug)]
pub struct PerturbedQmc {
    others: AnySampler,
    seed: u64,
    options: Perturbation,
    points: &'static [Vec3],
    /// Base-2 logarithm of the number of points.
    bits: u32,
    key: SampleKey,
}

impl PerturbedQmc {
    /// Directions for `seed` and `count` samples per pixel. All other numbers come from `others`.
    pub fn new(seed: u64, count: u32, options: Perturbation, others: AnySampler) -> Self {
        let bits = set_bits(count);
        Self {
            others,
            seed,
            options,
            points: options.points.directions(bits),
            bits,
            key: SampleKey::new(0, 0, 0),
        }
    }

    /// Point of the current sample on the unit sphere, for the decision `dimension`.
    fn point(&self, dimension: Dimension) -> Vec3 {
        // Select a point. The order of points is the same for all pixels and seeds.
        let (sample, n) = (self.key.sample, self.points.len() as u32);
        let index = permute(sample % n, self.bits, mix(dimension.index().into()));
        let mut point = self.points[index as usize];

        // Move the point on a disk. The positions on the disk are well distributed over the pixels.
        if self.options.size > 0.0 {
            let set = numbered(numbered(mix(self.seed), dimension.index()), sample);
            let place = morton(self.key);
            let u = Vec2::new(radical_inverse(2, place, set), radical_inverse(3, place, mix(set)));
            point = moved_on_disk(point, u, 2.0 * self.options.size / (n as f32).sqrt());
        }

        // Rotate the point with the rotation of its set
        if self.options.is_scrambled {
            let block = numbered(pixel(self.seed, self.key), sample >> self.bits);
            point = rotation(numbered(block, dimension.index())) * point;
        }
        point
    }
}

impl Sampler for PerturbedQmc {
    fn start(&mut self, key: SampleKey) {
        self.others.start(key);
        self.key = key;
    }

    fn separate(&mut self) {
        self.others.separate();
    }

    #[inline(never)]
    fn get_1d(&self, dimension: Dimension) -> f32 {
        self.others.get_1d(dimension)
    }

    #[inline(never)]
    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        if dimension.is(Bounce::Direction) {
            square_of_sphere(self.point(dimension))
        } else {
            self.others.get_2d(dimension)
        }
    }
}

/// Index of a pixel along the Morton curve, from the lower 16 bits of its coordinates.
fn morton(key: SampleKey) -> u32 {
    let spread = |v: u32| {
        let v = v & 0xffff;
        let v = (v | v << 8) & 0x00ff_00ff;
        let v = (v | v << 4) & 0x0f0f_0f0f;
        let v = (v | v << 2) & 0x3333_3333;
        (v | v << 1) & 0x5555_5555
    };
    spread(key.x) | spread(key.y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{SamplerKind, points};
    use crate::sampling::warp::uniform_sphere;

    const ALL: [CubePoints; 3] = [CubePoints::Halton, CubePoints::Hammersley, CubePoints::Sobol];

    fn sampler(seed: u64, count: u32, options: Perturbation) -> PerturbedQmc {
        PerturbedQmc::new(seed, count, options, SamplerKind::Sobol.with_seed(seed, count))
    }

    fn options(points: CubePoints, size: f32, is_scrambled: bool) -> Perturbation {
        Perturbation {
            points,
            size,
            is_scrambled,
        }
    }

    const DIMENSION: fn(u32) -> Dimension = |depth| Dimension::bounce(depth, Bounce::Direction);

    #[test]
    fn samples_can_be_replayed_and_other_dimensions_use_other_sampler() {
        for options in [
            options(CubePoints::Halton, 1.0, true),
            options(CubePoints::Sobol, 0.5, false),
        ] {
            let of = |seed, x, depth, samples| points(sampler(seed, 100, options), x, DIMENSION(depth), samples);
            let whole = of(5, 2, 3, 0..200);
            for sample in [0, 1, 63, 64, 99, 100, 199] {
                assert_eq!(of(5, 2, 3, sample..sample + 1)[0], whole[sample as usize]);
            }
            for other in [of(6, 2, 3, 0..200), of(5, 3, 3, 0..200), of(5, 2, 4, 0..200)] {
                assert!(whole.iter().zip(&other).filter(|(a, b)| a == b).count() < 3);
            }
            for dimension in [Dimension::PIXEL, Dimension::bounce(2, Bounce::LightPoint)] {
                let sobol = points(SamplerKind::Sobol.with_seed(5, 100), 2, dimension, 0..200);
                assert_eq!(points(sampler(5, 100, options), 2, dimension, 0..200), sobol);
            }
        }
    }

    /// Without perturbation and scrambling, all pixels and seeds have the same points in the same
    /// order.
    #[test]
    fn plain_sets_are_the_same_everywhere() {
        for set in ALL {
            let of = |seed, x| points(sampler(seed, 64, options(set, 0.0, false)), x, DIMENSION(0), 0..64);
            assert_eq!(of(1, 2), of(3, 40));
            let mut found: Vec<_> = of(1, 2).into_iter().map(uniform_sphere).collect();
            for point in set.directions(6) {
                let nearest =
                    (0..found.len()).min_by(|&a, &b| found[a].distance(*point).total_cmp(&found[b].distance(*point)));
                let nearest = found.swap_remove(nearest.unwrap());
                assert!(nearest.distance(*point) < 2e-3, "{nearest} {point}");
            }
        }
    }

    /// Points are moved uniformly on disks of the expected radius.
    #[test]
    fn points_move_on_their_disks() {
        let [still, moved] = [0.0, 1.0].map(|size| {
            let options = options(CubePoints::Halton, size, false);
            let of_seed = |seed| points(sampler(seed, 64, options), 3, DIMENSION(0), 0..64);
            let all = (0..256).flat_map(of_seed).map(uniform_sphere);
            all.collect::<Vec<_>>()
        });
        // Squared tangents of the angles by which points were moved. On a disk their mean is half
        // the radius squared, with a standard error of 0.45 %.
        let squared = 0.25f32 * 0.25;
        let tangents = still
            .iter()
            .zip(&moved)
            .map(|(a, b)| (*b / a.dot(*b) - *a).length_squared());
        let tangents: Vec<f32> = tangents.collect();
        assert!(tangents.iter().all(|&t| t < 1.02 * squared));
        let mean = tangents.iter().sum::<f32>() / tangents.len() as f32;
        assert!((mean / (0.5 * squared) - 1.0).abs() < 0.02, "{mean}");
    }

    /// χ² of single samples over 16 × 16 cells of equal area. Each sample has a different seed and
    /// pixel. Scrambled samples are exactly uniform.
    #[test]
    fn scrambled_directions_are_uniform() {
        for (set, sample, count) in [
            (CubePoints::Halton, 0, 64),
            (CubePoints::Hammersley, 70, 64),
            (CubePoints::Sobol, 5, 1),
        ] {
            let mut counts = [0.0f64; 256];
            for i in 0..51_200 {
                let mut sampler = sampler(i / 7, count, options(set, 1.0, true));
                sampler.start(SampleKey::new(i as u32 % 7, 3, sample));
                let u = sampler.get_2d(DIMENSION(2));
                assert!(u.cmpge(Vec2::ZERO).all() && u.cmplt(Vec2::ONE).all());
                counts[(u.x * 16.0) as usize * 16 + (u.y * 16.0) as usize] += 1.0;
            }
            let chi2: f64 = counts.iter().map(|c| (c - 200.0).powi(2) / 200.0).sum();
            // 255 degrees of freedom: standard deviation 22.6
            assert!(chi2 < 255.0 + 5.0 * 22.6, "{sample} of {count}: χ² = {chi2}");
        }
    }
}
