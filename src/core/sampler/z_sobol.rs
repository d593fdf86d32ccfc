use super::hash::{numbered, pixel, unit_f32};
use super::sobol::{scramble, second_dimension};
use super::{Dimension, SampleKey, Sampler};
use crate::math::{Vec2, hash::mix};

/// Pixels on a side of the square that shares a sequence, as a power of two.
const SIDE_BITS: u32 = 8;

/// Sobol's (0,2)-sequence handed out to pixels along a Z-shaped curve, the four parts of every square in a random order (Ahmed and
/// Wonka 2020, "Screen-Space Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels").
///
/// Neighbouring pixels share a stretch of the sequence, so that their errors differ and cancel over an area; each pixel's own samples are as
/// well distributed as those of `sobol`, up to the count that is given ahead, after which another order begins.
#[derive(Clone, Copy, Debug)]
pub struct ZSobol {
    seed: u64,
    /// Of seed, square and what exceeds the count.
    key: u64,
    /// Place along the curve, then the sample.
    index: u32,
    /// Samples of a pixel, as a power of two.
    sample_bits: u32,
}

impl ZSobol {
    /// A sampler for the given seed and number of samples of a pixel.
    pub fn new(seed: u64, count: u32) -> Self {
        let bits = u32::BITS - count.saturating_sub(1).leading_zeros();
        Self {
            seed,
            key: 0,
            index: 0,
            sample_bits: bits.min(u32::BITS - 2 * SIDE_BITS),
        }
    }

    /// The place in the sequence, and bits for two coordinates.
    fn place(&self, dimension: Dimension) -> (u32, u64) {
        let key = numbered(self.key, dimension.index());
        let bits = 2 * SIDE_BITS + self.sample_bits;
        // Digits of base 4, highest first, each permuted by a hash of those above it; of an odd bit at the end, by a flip
        let (mut index, mut at) = (0, bits);
        while at > 0 {
            let width = at.min(2);
            at -= width;
            let digit = (self.index >> at) & ((1 << width) - 1);
            let above = (self.index as u64) >> (at + width);
            let order = mix(numbered(key, at).wrapping_add(above));
            index = (index << width)
                | if width == 2 {
                    permute_4(digit, order)
                } else {
                    digit ^ (order as u32 & 1)
                };
        }
        (index, mix(key))
    }
}

impl Sampler for ZSobol {
    fn start(&mut self, key: SampleKey) {
        let mask = (1 << SIDE_BITS) - 1;
        let square = SampleKey {
            x: key.x >> SIDE_BITS,
            y: key.y >> SIDE_BITS,
            sample: 0,
        };
        let (set, within) = (
            key.sample as u64 >> self.sample_bits,
            key.sample as u64 & ((1u64 << self.sample_bits) - 1),
        );
        self.key = mix(pixel(self.seed, square) ^ set);
        let curve = spread(key.x & mask) | (spread(key.y & mask) << 1);
        self.index = (((curve as u64) << self.sample_bits) | within) as u32;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        let (index, seeds) = self.place(dimension);
        unit_f32(scramble(index, (seeds >> 32) as u32).reverse_bits())
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let (index, seeds) = self.place(dimension);
        let x = scramble(index, (seeds >> 32) as u32).reverse_bits();
        let y = scramble(second_dimension(index), seeds as u32).reverse_bits();
        Vec2::new(unit_f32(x), unit_f32(y))
    }
}

/// One of the 24 orders of four digits, by repeated choice of those left.
fn permute_4(digit: u32, order: u64) -> u32 {
    let mut left = [0, 1, 2, 3];
    let mut choice = (order >> 32) as u32 % 24;
    for i in 0..3 {
        let n = 4 - i as u32;
        left.swap(i, i + (choice % n) as usize);
        choice /= n;
    }
    left[digit as usize & 3]
}

/// The low eight bits of `x`, each followed by a zero.
fn spread(x: u32) -> u32 {
    (0..SIDE_BITS).fold(0, |z, bit| z | (((x >> bit) & 1) << (2 * bit)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Bounce;

    /// Over every aligned square of pixels the samples are a net: what makes errors cancel.
    #[test]
    fn squares_of_pixels_share_a_net() {
        for (side_bits, count) in [(1, 1u32), (2, 1), (1, 4), (3, 1), (2, 16), (1, 8)] {
            let side = 1 << side_bits;
            let n = (side * side * count) as usize;
            let k = n.ilog2();
            for seed in 0..10 {
                let mut sampler = ZSobol::new(seed, count);
                let mut points = Vec::new();
                for (x, y, s) in (0..side * side * count).map(|i| (i % side, i / side % side, i / side / side)) {
                    sampler.start(SampleKey::new(40 + x, 72 + y, s));
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

    #[test]
    fn all_orders_of_four_occur() {
        let mut seen = std::collections::BTreeSet::new();
        for order in 0..24u64 {
            let all = [0, 1, 2, 3].map(|digit| permute_4(digit, order << 32));
            seen.insert(all);
            let mut sorted = all;
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3]);
        }
        assert_eq!(seen.len(), 24);
    }
}
