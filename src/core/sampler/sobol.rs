//! Scrambled (0,2)-sequences, one for each dimension of each pixel. The order of the points and
//! their digits are scrambled by hashes of seed, pixel and dimension, so the sampler has no state.

use super::{Dimension, SampleKey, Sampler, hash};
use crate::math::{Vec2, hash::GOLDEN_GAMMA};
use multiversion::multiversion;
use std::array::from_fn;

/// Sobol's (0,2)-sequence with Owen scrambling by hashes (Burley 2020, "Practical Hash-based Owen
/// Scrambling").
///
/// Each dimension of each pixel has a separate sequence. Seed, pixel and dimension select how the
/// order and the digits of the sequence are scrambled, so that there is no correlation between
/// dimensions. Within one dimension, the first 2ᵏ samples and every later aligned block of 2ᵏ
/// samples are stratified in all elementary intervals.
#[derive(Clone, Copy, Debug)]
pub struct Sobol {
    seed: u64,
    /// Hash of the seed and the pixel.
    key: u64,
    /// Index of the sample, with its binary digits reversed.
    reversed: u32,
}

impl Sobol {
    /// A sampler for the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            key: 0,
            reversed: 0,
        }
    }

    /// Shuffled index in the sequence, and scrambling seeds for the digits of the two coordinates.
    fn place(&self, dimension: Dimension) -> (u32, [u32; 2]) {
        let bits = hash::numbered(self.key, dimension.index());
        // Scrambling the digits of the index shuffles the points, and keeps aligned blocks together
        let index = scramble(self.reversed, order(bits)).reverse_bits();
        (index, [(bits >> 32) as u32, bits as u32])
    }
}

impl Sampler for Sobol {
    fn start(&mut self, key: SampleKey) {
        self.key = hash::pixel(self.seed, key);
        self.reversed = key.sample.reverse_bits();
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        let (index, [seed, _]) = self.place(dimension);
        hash::unit_f32(scramble(index, seed).reverse_bits())
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let (index, [seed_x, seed_y]) = self.place(dimension);
        let x = scramble(index, seed_x).reverse_bits();
        let y = scramble(second_dimension(index), seed_y).reverse_bits();
        Vec2::new(hash::unit_f32(x), hash::unit_f32(y))
    }

    #[inline]
    fn get_2ds<const N: usize>(&self, dimensions: [Dimension; N]) -> [Vec2; N] {
        const { assert!(N <= 4) };
        let mut bits = [0; 4];
        for (bits, dimension) in bits.iter_mut().zip(dimensions) {
            *bits = hash::numbered(self.key, dimension.index());
        }
        let [x, y] = points_of_four_sequences(self.reversed, bits[0], bits[1], bits[2], bits[3]);
        from_fn(|i| Vec2::new(x[i], y[i]))
    }

    #[inline]
    fn get_2ds_of(&self, key: SampleKey, _: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        let pixel = hash::pixel(self.seed, key);
        let [a, b] = dimensions.map(|dimension| hash::numbered(pixel, dimension.index()));
        let [x, y] = points_of_two_sequences(key.sample, a, b);
        from_fn(|i| [i, i + 4].map(|i| Vec2::new(x[i], y[i])))
    }
}

// Several points are computed as vectors, and the code is also compiled for AVX2. Integer
// arithmetic gives the same bits on all processors. The seeds of the sequences are passed in
// registers, because an array that is written number by number must reach memory before a vector
// can be read from the array.

/// Points of four sequences at one index: the x coordinates of all points, then the y coordinates.
#[multiversion(targets("x86_64+avx2"))]
fn points_of_four_sequences(reversed: u32, a: u64, b: u64, c: u64, d: u64) -> [[f32; 4]; 2] {
    points([reversed; 4], [a, b, c, d])
}

/// Points of two sequences at four indices from `sample` on: the x coordinates of the first
/// sequence, the x coordinates of the second sequence, then the y coordinates in the same order.
#[multiversion(targets("x86_64+avx2"))]
fn points_of_two_sequences(sample: u32, a: u64, b: u64) -> [[f32; 8]; 2] {
    let reversed = from_fn(|i| sample.wrapping_add(i as u32 % 4).reverse_bits());
    points(reversed, [a, a, a, a, b, b, b, b])
}

/// Points as drawn by [`Sobol::get_2d`]. `reversed` has the indices with their binary digits
/// reversed, and `bits` has the scrambling seeds of the sequences.
#[inline(always)]
fn points<const N: usize>(reversed: [u32; N], bits: [u64; N]) -> [[f32; N]; 2] {
    let index: [u32; N] = from_fn(|i| scramble(reversed[i], order(bits[i])).reverse_bits());
    let x: [u32; N] = from_fn(|i| scramble(index[i], (bits[i] >> 32) as u32).reverse_bits());
    let y: [u32; N] = from_fn(|i| scramble(second_dimension(index[i]), bits[i] as u32).reverse_bits());
    [x, y].map(|digits| digits.map(hash::unit_f32))
}

/// Seed of the order of a sequence's points. `bits` is the scrambling seed of the sequence. The
/// result must differ between sequences, but it may depend on the seeds of the digits.
#[inline(always)]
pub(super) fn order(bits: u64) -> u32 {
    (bits.wrapping_mul(GOLDEN_GAMMA) >> 32) as u32
}

/// Second coordinate of Sobol's point `index`, with its binary digits in reversed order. In this
/// order, the first coordinate is the index.
///
/// The generator matrix is Pascal's triangle modulo 2: entry (i, j) is 1 if j has a 1 at each
/// binary digit at which i has a 1 (theorem of Lucas). The product with the matrix is a sum over
/// supersets, one digit at a time.
#[inline(always)]
pub(super) fn second_dimension(index: u32) -> u32 {
    let mut y = index;
    y ^= (y >> 1) & 0x5555_5555;
    y ^= (y >> 2) & 0x3333_3333;
    y ^= (y >> 4) & 0x0f0f_0f0f;
    y ^= (y >> 8) & 0x00ff_00ff;
    y ^= (y >> 16) & 0x0000_ffff;
    y
}

/// Owen scrambling of a number whose digits are in reversed order. Each digit is flipped by a hash
/// of the digits below it (Laine and Karras 2011; constants of Burley 2020, listing 2).
#[inline(always)]
pub(super) fn scramble(mut x: u32, seed: u32) -> u32 {
    x = x.wrapping_add(seed);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Bounce, points};

    #[test]
    fn the_second_dimension_has_sobols_direction_numbers() {
        // Expect v₀ = 1/2 and vⱼ₊₁ = vⱼ ⊕ vⱼ/2, for the primitive polynomial x + 1
        let mut v = vec![1u32 << 31];
        for j in 0..31 {
            v.push(v[j] ^ (v[j] >> 1));
        }
        for index in (0..10_000).chain([u32::MAX, 0x8000_0001]) {
            let bits = (0..32).filter(|j| (index >> j) & 1 == 1);
            let expected = bits.fold(0, |y, j| y ^ v[j as usize]);
            assert_eq!(second_dimension(index).reverse_bits(), expected, "{index}");
        }
    }

    #[test]
    fn aligned_blocks_are_nets() {
        // Each elementary interval of area 2⁻ᵏ, of any shape, contains one of 2ᵏ points.
        for (k, start) in [(0, 3), (1, 0), (3, 8), (4, 0), (4, 48), (6, 64), (8, 256)] {
            let n = 1u32 << k;
            for seed in 0..20 {
                let block = points(
                    Sobol::new(seed),
                    17,
                    Dimension::bounce(2, Bounce::Direction),
                    start..start + n,
                );
                for a in 0..=k {
                    let cell = |p: &Vec2| ((p.x * (1 << a) as f32) as u32, (p.y * (1 << (k - a)) as f32) as u32);
                    let mut cells: Vec<_> = block.iter().map(cell).collect();
                    cells.sort_unstable();
                    cells.dedup();
                    assert_eq!(
                        cells.len(),
                        n as usize,
                        "{n} points from {start}, seed {seed}, 2^{a} columns"
                    );
                }
            }
        }
    }

    #[test]
    fn single_variates_are_stratified() {
        let mut sampler = Sobol::new(3);
        let mut cells = [0; 64];
        for sample in 64..128 {
            sampler.start(SampleKey::new(1, 2, sample));
            cells[(sampler.get_1d(Dimension::bounce(0, Bounce::Lobe)) * 64.0) as usize] += 1;
        }
        assert_eq!(cells, [1; 64]);
    }

    /// Mean squared error of the mean of `f` over `n` points, estimated over 200 seeds. `exact` is
    /// the exact mean of `f`.
    fn error(n: u32, exact: f64, f: impl Fn(Vec2) -> f64) -> f64 {
        const SEEDS: u64 = 200;
        let one = |seed| {
            let p = points(Sobol::new(seed), 3, Dimension::PIXEL, 0..n);
            (p.iter().map(|p| f(*p)).sum::<f64>() / n as f64 - exact).powi(2)
        };
        (0..SEEDS).map(one).sum::<f64>() / SEEDS as f64
    }

    /// The variance falls as n⁻³ for smooth integrands, and as n⁻³ᐟ² for integrands with an edge
    /// (Owen 1997). For independent samples it falls as n⁻¹.
    #[test]
    fn errors_fall_as_theory_says() {
        let slope = |f: &dyn Fn(Vec2) -> f64, exact| {
            let (few, many) = (error(16, exact, f), error(1024, exact, f));
            (many / few).log2() / 6.0
        };
        let smooth = slope(&|p: Vec2| (p.x * p.x * (1.0 + p.y)) as f64, 0.5);
        let edge = slope(
            &|p: Vec2| f64::from(u8::from(p.x * p.x + p.y * p.y < 1.0)),
            std::f64::consts::FRAC_PI_4,
        );
        assert!((smooth + 3.0).abs() < 0.3, "smooth: {smooth}");
        assert!((edge + 1.5).abs() < 0.2, "edge: {edge}");
    }
}
