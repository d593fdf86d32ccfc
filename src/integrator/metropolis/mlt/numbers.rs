use crate::math::Vec2;
use crate::math::hash::{GOLDEN_GAMMA, mix, unit_f32};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Random numbers of a Markov chain, by SplitMix64: their count is not known in advance.
#[derive(Clone, Debug)]
pub(super) struct Numbers(u64);

impl Numbers {
    /// The numbers named by `key`. Where they start depends on the sampler's own numbers there, and so on the seed.
    pub fn of(key: SampleKey, sampler: &mut impl Sampler) -> Self {
        sampler.start(key);
        let pixel = sampler.get_2d(Dimension::PIXEL);
        let others = [Bounce::Lobe, Bounce::Decisions, Bounce::Direction].map(|what| Dimension::bounce(0, what));
        let [a, b, c] = others.map(|dimension| sampler.get_1d(dimension));
        let bits = [pixel.x, pixel.y, a, b, c].map(|u| u.to_bits() as u64);
        let key = [key.x, key.y, key.sample].map(u64::from);
        Self(
            bits.into_iter()
                .chain(key)
                .fold(0, |hash, word| mix(hash.wrapping_add(GOLDEN_GAMMA) ^ word)),
        )
    }

    /// The next one, in [0, 1).
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(GOLDEN_GAMMA);
        unit_f32(mix(self.0))
    }

    /// The next two.
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    /// Draws an index with a probability proportional to its weight; `None` where all are 0.
    pub fn choose(&mut self, weights: impl Iterator<Item = f64> + Clone) -> Option<usize> {
        let total: f64 = weights.clone().sum();
        let mut left = self.next() as f64 * total;
        let mut last = None;
        for (index, weight) in weights.enumerate() {
            if weight > 0.0 {
                last = Some(index);
                if left < weight {
                    break;
                }
                left -= weight;
            }
        }
        last
    }
}
