use super::{Dimension, SampleKey, Sampler, hash};
use crate::math::Vec2;
use crate::math::hash::{GOLDEN_GAMMA, mix};

/// Independent uniform variates by hashing a counter.
///
/// The generator is SplitMix64 (Steele, Lea and Flood 2014) as a function of its counter. A key is
/// a hash of seed, pixel and sample. Dimension `d` reads the number `d` of the key's sequence.
#[derive(Clone, Copy, Debug)]
pub struct Independent {
    seed: u64,
    key: u64,
}

impl Independent {
    /// A sampler for the given seed.
    pub fn new(seed: u64) -> Self {
        Self { seed, key: 0 }
    }

    fn bits(&self, dimension: Dimension) -> u64 {
        hash::numbered(self.key, dimension.index())
    }
}

impl Sampler for Independent {
    fn start(&mut self, key: SampleKey) {
        self.key = mix(hash::pixel(self.seed, key).wrapping_add(GOLDEN_GAMMA) ^ key.sample as u64);
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        hash::unit_f32((self.bits(dimension) >> 32) as u32)
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let bits = self.bits(dimension);
        Vec2::new(hash::unit_f32((bits >> 32) as u32), hash::unit_f32(bits as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Bounce;

    fn at(seed: u64, x: u32, y: u32, sample: u32) -> Independent {
        let mut s = Independent::new(seed);
        s.start(SampleKey::new(x, y, sample));
        s
    }

    #[test]
    fn a_number_depends_on_its_address_alone() {
        let d = Dimension::bounce(3, Bounce::Direction);
        let a = at(7, 10, 20, 5).get_2d(d);
        let mut s = Independent::new(7);
        s.start(SampleKey::new(0, 0, 0));
        s.get_1d(Dimension::PIXEL);
        s.start(SampleKey::new(10, 20, 5));
        assert_eq!(s.get_2d(d), a);
        for other in [at(8, 10, 20, 5), at(7, 20, 10, 5), at(7, 10, 20, 6)] {
            assert_ne!(other.get_2d(d), a);
        }
        assert_ne!(s.get_2d(Dimension::bounce(4, Bounce::Direction)), a);
    }

    /// χ² over `n × n` cells of pairs of variates. Pairs at neighbouring addresses must look
    /// independent.
    fn chi2(pairs: impl Iterator<Item = (f32, f32)>, n: usize) -> f64 {
        let mut counts = vec![0u32; n * n];
        let mut total = 0.0;
        for (a, b) in pairs {
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
            counts[(a * n as f32) as usize * n + (b * n as f32) as usize] += 1;
            total += 1.0;
        }
        let expected = total / (n * n) as f64;
        counts.iter().map(|&c| (c as f64 - expected).powi(2) / expected).sum()
    }

    #[test]
    fn neighbouring_addresses_are_uncorrelated() {
        let n = 16;
        let light = Dimension::bounce(0, Bounce::LightPoint);
        let dir = Dimension::bounce(0, Bounce::Direction);
        let samples = 0..200_000u32;
        let tests: [(&str, f64); 6] = [
            (
                "within a pair",
                chi2(samples.clone().map(|i| at(0, 3, 4, i).get_2d(light).into()), n),
            ),
            (
                "dimensions",
                chi2(
                    samples
                        .clone()
                        .map(|i| (at(0, 3, 4, i).get_1d(light), at(0, 3, 4, i).get_1d(dir))),
                    n,
                ),
            ),
            (
                "samples",
                chi2(
                    samples
                        .clone()
                        .map(|i| (at(0, 3, 4, i).get_1d(dir), at(0, 3, 4, i + 1).get_1d(dir))),
                    n,
                ),
            ),
            (
                "columns",
                chi2(
                    samples.clone().map(|i| {
                        (
                            at(0, i % 1000, i / 1000, 0).get_1d(dir),
                            at(0, i % 1000 + 1, i / 1000, 0).get_1d(dir),
                        )
                    }),
                    n,
                ),
            ),
            (
                "rows",
                chi2(
                    samples.clone().map(|i| {
                        (
                            at(0, i % 1000, i / 1000, 0).get_1d(dir),
                            at(0, i % 1000, i / 1000 + 1, 0).get_1d(dir),
                        )
                    }),
                    n,
                ),
            ),
            (
                "seeds",
                chi2(
                    samples.map(|i| (at(i as u64, 0, 0, 0).get_1d(dir), at(i as u64 + 1, 0, 0, 0).get_1d(dir))),
                    n,
                ),
            ),
        ];
        for (what, x2) in tests {
            // 255 degrees of freedom: mean 255, standard deviation 22.6. A value above 5 standard
            // deviations has a probability of about one in a million.
            assert!(x2 < 255.0 + 5.0 * 22.6, "{what}: χ² = {x2:.1}");
        }
    }
}
