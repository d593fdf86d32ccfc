use super::hash::{numbered, permute, permute_few, pixel, unit_f32};
use super::{Dimension, SampleKey, Sampler};
use crate::math::{Vec2, hash::mix};

/// Base-2 logarithm of the maximum number of levels of a factor.
const MAX_BITS: usize = 5;
/// Irreducible polynomials over GF(2), indexed by the degree k, with one bit for each coefficient.
/// The elements of GF(2ᵏ) are the remainders modulo the polynomial.
const POLYNOMIALS: [u32; MAX_BITS + 1] = [0b1, 0b11, 0b111, 0b1011, 0b1_0011, 0b10_0101];

/// Orthogonal arrays of strength 2 (Jarosz et al. 2019, "Orthogonal Array Sampling for Monte Carlo
/// Rendering"). Take *any* two numbers of an array, even of different decisions, as coordinates in
/// the unit square. Each of s × s equal squares then contains one of s² samples. For every number,
/// each of s² intervals also contains one sample.
///
/// Arrays follow Bush's construction over the field of s = 2ᵏ elements: run (a, b) has level a + j
/// b in factor j, for all j of the field. A run is a sample, a factor is one random number of the
/// sample, and the level is the interval that contains this number. Each decision uses two factors,
/// in the order of decisions along a path, so that neighbouring decisions are in one array: four
/// decisions if s is 8, eight if s is 16. Arrays are independent of each other.
///
/// Levels are permuted at random, as in the paper. Each level is one of s intervals of a number.
/// The interval is divided into s parts, one for each level of the decision's other factor, as in
/// correlated multi-jitter. Owen scrambling of the digits, which makes the points of each decision
/// a (0,2)-net, reduced the error less.
///
/// s² is the largest power of 4 up to the number of samples, at most 1024. Blocks of s² samples are
/// independent of each other.
#[derive(Clone, Copy, Debug)]
pub struct Orthogonal {
    seed: u64,
    /// Hash of the seed, the pixel and the block.
    key: u64,
    sample: u32,
    /// Base-2 logarithm of the number of levels of a factor.
    bits: u32,
}

impl Orthogonal {
    /// A sampler for the given seed and number of samples per pixel.
    pub fn new(seed: u64, count: u32) -> Self {
        Self {
            seed,
            key: 0,
            sample: 0,
            bits: (count.max(1).ilog2() / 2).clamp(1, MAX_BITS as u32),
        }
    }

    /// Index of the sample in its block.
    fn within(&self) -> u32 {
        self.sample & ((1 << (2 * self.bits)) - 1)
    }

    /// Levels of the sample in the two factors of a decision, and a key of the decision.
    fn levels(&self, dimension: Dimension) -> (u32, u32, u64) {
        // An array has s factors. Each decision uses two of them.
        let decision_bits = self.bits - 1;
        let array = numbered(self.key, dimension.ordinal() >> decision_bits);
        let pair = dimension.ordinal() & ((1 << decision_bits) - 1);
        // All decisions that draw from the array use the same run
        let run = permute(self.within(), 2 * self.bits, array);
        let (a, b) = (run >> self.bits, run & ((1 << self.bits) - 1));
        // For an even j, the products of the factors j and j + 1 with b differ by b
        let x = a ^ self.product(2 * pair, b);
        (x, x ^ b, numbered(array, dimension.index()))
    }

    /// Product of two elements of the finite field GF(2ᵏ).
    fn product(&self, i: u32, j: u32) -> u32 {
        let polynomial = POLYNOMIALS[self.bits as usize];
        (0..self.bits).rev().fold(0, |sum, digit| {
            let shifted = sum << 1;
            shifted ^ (polynomial * (shifted >> self.bits)) ^ (j * ((i >> digit) & 1))
        })
    }

    /// A number in the stratum of `level`. The level `other` of the decision's other factor selects
    /// a part of the stratum, and `jitter` is the random position in the part.
    fn coordinate(&self, level: u32, other: u32, key: u64, jitter: u32) -> f32 {
        let stratum = permute_few(level, self.bits, key);
        let part = permute_few(other, self.bits, !key);
        let strata_bits = 2 * self.bits;
        // Join the digits with bit operations, because a sum might round up into the next stratum
        unit_f32((((stratum << self.bits) | part) << (32 - strata_bits)) | (jitter >> strata_bits))
    }
}

impl Sampler for Orthogonal {
    fn start(&mut self, key: SampleKey) {
        let block = key.sample >> (2 * self.bits);
        self.key = mix(pixel(self.seed, key) ^ block as u64);
        self.sample = key.sample;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        self.get_2d(dimension).x
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let (x, y, key) = self.levels(dimension);
        let jitter = numbered(key, self.within());
        Vec2::new(
            self.coordinate(x, y, key, (jitter >> 32) as u32),
            self.coordinate(y, x, key.rotate_left(32), jitter as u32),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Bounce, SamplerKind};

    /// Numbers that the sampler draws in `dimensions` for the samples of block `block`. The result
    /// has one list for each number.
    fn numbers(sampler: &mut Orthogonal, dimensions: &[Dimension], block: u32) -> Vec<Vec<f32>> {
        let runs = 1 << (2 * sampler.bits);
        let mut all = vec![Vec::new(); 2 * dimensions.len()];
        for sample in block * runs..(block + 1) * runs {
            sampler.start(SampleKey::new(4, 7, sample));
            for (i, &dimension) in dimensions.iter().enumerate() {
                let p = sampler.get_2d(dimension);
                all[2 * i].push(p.x);
                all[2 * i + 1].push(p.y);
            }
        }
        all
    }

    fn strata(numbers: &[f32], n: u32) -> impl Iterator<Item = u32> {
        numbers.iter().map(move |u| (u * n as f32) as u32)
    }

    /// For any two numbers of an array, each of s × s squares contains one sample. For every
    /// number, each of s² intervals contains one sample.
    #[test]
    fn all_pairs_of_an_array_are_stratified() {
        let camera = [Dimension::PIXEL, Dimension::LENS];
        let bounce = |depth| {
            [Bounce::Decisions, Bounce::LightPoint, Bounce::Lobe, Bounce::Direction]
                .map(|b| Dimension::bounce(depth, b))
        };
        let path: Vec<Dimension> = camera.into_iter().chain((0..8).flat_map(bounce)).collect();
        for (count, s) in [(1, 2), (16, 4), (63, 4), (64, 8), (100, 8), (256, 16), (5000, 32)] {
            for (seed, block) in [(0, 0), (1, 3), (2, 1)] {
                let mut sampler = Orthogonal::new(seed, count);
                for array in path.chunks_exact(s as usize / 2).take(2) {
                    let numbers = numbers(&mut sampler, array, block);
                    for (i, a) in numbers.iter().enumerate() {
                        let mut intervals: Vec<u32> = strata(a, s * s).collect();
                        intervals.sort_unstable();
                        assert!(intervals.into_iter().eq(0..s * s), "{s} levels, number {i}");
                        for (j, b) in numbers.iter().enumerate().skip(i + 1) {
                            let mut squares: Vec<u32> =
                                strata(a, s).zip(strata(b, s)).map(|(x, y)| x * s + y).collect();
                            squares.sort_unstable();
                            assert!(squares.into_iter().eq(0..s * s), "{s} levels, numbers {i} and {j}");
                        }
                    }
                }
            }
        }
    }

    /// Integrands that depend on two decisions have a lower error than with randomly combined
    /// decisions.
    #[test]
    fn integrands_of_two_decisions_have_lower_error() {
        let [here, there] = [Bounce::LightPoint, Bounce::Decisions].map(|what| Dimension::bounce(0, what));
        let error = |kind: SamplerKind| {
            let one = |seed| {
                let mut sampler = kind.with_seed(seed, 64);
                let product = |sample| {
                    sampler.start(SampleKey::new(1, 1, sample));
                    ((sampler.get_2d(here).x - 0.5) * (sampler.get_2d(there).y - 0.5)) as f64
                };
                ((0..64).map(product).sum::<f64>() / 64.0).powi(2)
            };
            (0..500).map(one).sum::<f64>() / 500.0
        };
        let [orthogonal, padded] = [SamplerKind::Orthogonal, SamplerKind::MultiJittered].map(error);
        assert!(orthogonal < 0.1 * padded, "{orthogonal} {padded}");
    }

    #[test]
    fn products_satisfy_field_axioms() {
        for bits in 1..=MAX_BITS as u32 {
            let sampler = Orthogonal::new(0, 1 << (2 * bits));
            assert_eq!(sampler.bits, bits);
            let s = 1 << bits;
            for i in 1..s {
                let mut row: Vec<u32> = (0..s).map(|j| sampler.product(i, j)).collect();
                row.sort_unstable();
                assert!(row.into_iter().eq(0..s), "{bits} {i}");
                for (j, k) in (0..s).flat_map(|j| (0..s).map(move |k| (j, k))) {
                    let product = |i, j| sampler.product(i, j);
                    assert_eq!(product(i, j ^ k), product(i, j) ^ product(i, k));
                    assert_eq!(product(product(i, j), k), product(i, product(j, k)));
                }
            }
        }
    }
}
