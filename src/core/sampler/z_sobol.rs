use super::hash::{numbered, pixel, unit_f32};
use super::sobol::{order, scramble, second_dimension};
use super::{Dimension, SampleKey, Sampler};
use crate::math::{Vec2, hash::mix};
use multiversion::multiversion;
use std::array::from_fn;

/// Base-2 logarithm of the width, in pixels, of the aligned squares whose pixels share a net.
const SIDE_BITS: u32 = 16;

/// Sampler in which the samples of many pixels together are the points of one net.
///
/// In each dimension, the first 2ᵏ samples of each pixel, and every later aligned block of 2ᵏ
/// samples, are a (0, k, 2)-net, as in [`Sobol`](super::Sobol). The samples of all pixels of an
/// aligned square of 2ʳ × 2ʳ pixels are a (0, k + 2r, 2)-net. Neighbouring pixels therefore have
/// different errors, which cancel over an area. Ahmed and Wonka 2020 ("Screen-Space Blue-Noise
/// Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels") reach this
/// property with a Z-shaped curve over the pixels, for a number of samples that is known in
/// advance. This net has the property for all k and r at once.
///
/// The construction follows nets from rational functions (Niederreiter and Özbudak 2002,
/// "Constructions of digital nets using global function fields"), over GF(2). A point is a function
/// f. Its digits in x are the coefficients of f in powers of z, and its digits in y the
/// coefficients in powers of z + 1. Bits of the sample's index are the coefficients of a polynomial
/// of a degree below k. The pixel's digit of level j of the Z-shaped curve, two bits, is the
/// numerator of a fraction with the denominator qʲ⁺¹, where q = z² + z + 1. The functions of a
/// square and of 2ᵏ samples form a space of dimension k + 2r, and have at most k - 1 + 2r poles. A
/// function whose first a digits in x and b digits in y are 0, with a + b = k + 2r, has more zeros
/// than poles, so it is 0. Each elementary interval therefore contains one point.
///
/// In each dimension the order of the samples, the order of the pixels and the digits are scrambled
/// (Owen 1995) by seeds that are the same for all pixels.
#[derive(Clone, Copy, Debug)]
pub struct ZSobol {
    seed: u64,
    /// True after [`Sampler::separate`]: each pixel then has separate nets.
    is_separate: bool,
    /// Hash of the seed and the square of pixels. If nets are separate: hash of the seed and the
    /// pixel.
    key: u64,
    /// Index of the sample, with its binary digits reversed.
    reversed: u32,
    /// Index of the pixel along the Z-shaped curve, with its binary digits reversed; 0 if nets are
    /// separate.
    pixel: u32,
}

impl ZSobol {
    /// A sampler for the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            is_separate: false,
            key: 0,
            reversed: 0,
            pixel: 0,
        }
    }
}

impl Sampler for ZSobol {
    fn start(&mut self, key: SampleKey) {
        self.reversed = key.sample.reverse_bits();
        if self.is_separate {
            self.key = mix(pixel(self.seed, key));
            self.pixel = 0;
        } else {
            let square = SampleKey {
                x: key.x >> SIDE_BITS,
                y: key.y >> SIDE_BITS,
                sample: 0,
            };
            self.key = pixel(self.seed, square);
            self.pixel = (spread(key.x) | (spread(key.y) << 1)).reverse_bits();
        }
    }

    fn separate(&mut self) {
        self.is_separate = true;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        let bits = numbered(self.key, dimension.index());
        let [[x], _] = points([self.reversed], self.pixel, [bits]);
        x
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let bits = numbered(self.key, dimension.index());
        let [[x], [y]] = points([self.reversed], self.pixel, [bits]);
        Vec2::new(x, y)
    }

    #[inline]
    fn get_2ds<const N: usize>(&self, dimensions: [Dimension; N]) -> [Vec2; N] {
        const { assert!(N <= 4) };
        let mut bits = [0; 4];
        for (bits, dimension) in bits.iter_mut().zip(dimensions) {
            *bits = numbered(self.key, dimension.index());
        }
        let [x, y] = points_of_four_dimensions(self.reversed, self.pixel, bits[0], bits[1], bits[2], bits[3]);
        from_fn(|i| Vec2::new(x[i], y[i]))
    }

    #[inline]
    fn get_2ds_of(&self, key: SampleKey, _: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        let mut first = *self;
        first.start(key);
        let [a, b] = dimensions.map(|dimension| numbered(first.key, dimension.index()));
        let [x, y] = points_of_two_dimensions(key.sample, first.pixel, a, b);
        from_fn(|i| [i, i + 4].map(|i| Vec2::new(x[i], y[i])))
    }
}

/// One point in each of four dimensions: the x coordinates of all points, then the y coordinates.
#[multiversion(targets("x86_64+avx2"))]
fn points_of_four_dimensions(reversed: u32, pixel: u32, a: u64, b: u64, c: u64, d: u64) -> [[f32; 4]; 2] {
    points([reversed; 4], pixel, [a, b, c, d])
}

/// Points of four samples from `sample` on, in two dimensions: the x coordinates of the first
/// dimension, the x coordinates of the second dimension, then the y coordinates in the same order.
#[multiversion(targets("x86_64+avx2"))]
fn points_of_two_dimensions(sample: u32, pixel: u32, a: u64, b: u64) -> [[f32; 8]; 2] {
    let reversed = each(|i| sample.wrapping_add(i as u32 % 4).reverse_bits());
    points(reversed, pixel, [a, a, a, a, b, b, b, b])
}

/// Points of one pixel: x coordinates, then y coordinates. `reversed` has the indices of the
/// samples, with their binary digits reversed. `bits` has the scrambling seeds of the dimensions.
#[inline(always)]
fn points<const N: usize>(reversed: [u32; N], pixel: u32, bits: [u64; N]) -> [[f32; N]; 2] {
    let sample: [u32; N] = each(|i| scramble(reversed[i], order(bits[i])).reverse_bits());
    let numerator: [u32; N] = each(|i| numerator(scramble(pixel, order_of_pixels(bits[i]))));
    // f = sample + numerator / q¹⁶, where 1 / q¹⁶ = 1 / (z³² + z¹⁶ + 1) = 1 + z¹⁶ up to z³¹, also
    // in powers of z + 1
    let x: [u32; N] = each(|i| sample[i] ^ numerator[i] ^ (numerator[i] << 16));
    let y: [u32; N] = each(|i| second_dimension(sample[i] ^ numerator[i]) ^ (second_dimension(numerator[i]) << 16));
    let x: [u32; N] = each(|i| scramble(x[i], (bits[i] >> 32) as u32).reverse_bits());
    let y: [u32; N] = each(|i| scramble(y[i], bits[i] as u32).reverse_bits());
    [x, y].map(|digits| digits.map(unit_f32))
}

/// Array of the values of `of` for all indices. `std::array::from_fn` is not always inlined, and
/// then it is compiled without AVX2.
#[inline(always)]
fn each<const N: usize>(of: impl Fn(usize) -> u32) -> [u32; N] {
    let mut values = [0; N];
    for (i, value) in values.iter_mut().enumerate() {
        *value = of(i);
    }
    values
}

/// Scrambling seed of the order of the pixels. `bits` is the scrambling seed of the dimension.
#[inline(always)]
fn order_of_pixels(bits: u64) -> u32 {
    (bits.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as u32
}

/// Sum of dⱼ qʲ as a polynomial; bits 2j and 2j + 1 of `digits` are the polynomial dⱼ.
#[inline(always)]
fn numerator(digits: u32) -> u32 {
    // Join pairs of neighbouring terms: high qⁿ + low. For powers of two n, qⁿ = z²ⁿ + zⁿ + 1.
    let high = (digits >> 2) & 0x3333_3333;
    let n = digits ^ high ^ (high << 1);
    let high = (n >> 4) & 0x0f0f_0f0f;
    let n = n ^ high ^ (high << 2);
    let high = (n >> 8) & 0x00ff_00ff;
    let n = n ^ high ^ (high << 4);
    let high = n >> 16;
    n ^ high ^ (high << 8)
}

/// The low 16 bits of `x`, spread to the even bits of the result.
fn spread(x: u32) -> u32 {
    let x = (x | (x << 8)) & 0x00ff_00ff;
    let x = (x | (x << 4)) & 0x0f0f_0f0f;
    let x = (x | (x << 2)) & 0x3333_3333;
    (x | (x << 1)) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Bounce;

    /// The samples of every aligned square of pixels are a net, so that errors of pixels cancel.
    #[test]
    fn squares_of_pixels_share_a_net() {
        for (side_bits, count) in [(1, 1u32), (2, 1), (1, 4), (3, 1), (2, 16), (1, 8), (3, 64), (0, 256)] {
            let side = 1 << side_bits;
            let n = (side * side * count) as usize;
            let k = n.ilog2();
            for (seed, begin) in (0..10).zip([0, 1, 3].into_iter().cycle()) {
                let mut sampler = ZSobol::new(seed);
                let mut points = Vec::new();
                for (x, y, s) in (0..side * side * count).map(|i| (i % side, i / side % side, i / side / side)) {
                    sampler.start(SampleKey::new(40 + x, 72 + y, begin * count + s));
                    points.push(sampler.get_2d(Dimension::bounce(1, Bounce::Direction)));
                }
                for a in 0..=k {
                    let cell = |p: &Vec2| ((p.x * (1 << a) as f32) as u32, (p.y * (1 << (k - a)) as f32) as u32);
                    let mut cells: Vec<_> = points.iter().map(cell).collect();
                    cells.sort_unstable();
                    cells.dedup();
                    assert_eq!(cells.len(), n, "{side} x {side} pixels, {count} samples, 2^{a} columns");
                }
            }
        }
    }
}
