use crate::math::hash::{GOLDEN_GAMMA, mix, unit_f32};
use crate::math::{DVec2, Vec2};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler, Stream};

/// Random numbers of a Markov chain, from SplitMix64. A chain may draw any number of them.
#[derive(Clone, Debug)]
pub(super) struct Numbers {
    state: u64,
    /// Position of the chain in the lattice of all chains (unit square), and state of the random
    /// numbers that all chains share. Both are used by [`Numbers::spread`].
    place: DVec2,
    common: u64,
}

/// Step vector of a lattice that fills the unit square evenly for any number of points: powers of
/// the plastic number's inverse (Roberts 2018, R2).
const LATTICE: DVec2 = DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_2);

impl Numbers {
    /// Random numbers of the chain `index` of iteration `iteration`.
    pub fn of_chain(index: u32, iteration: u32, sampler: &mut impl Sampler) -> Self {
        let of = |column, sampler: &mut _| Self::of(SampleKey::of_stream(Stream::Chains, column, iteration), sampler);
        // The last column is the key of the common numbers. No chain uses it.
        let common = of(u32::MAX, sampler).state;
        Self {
            place: LATTICE * f64::from(index),
            common,
            ..of(index, sampler)
        }
    }

    /// Random numbers with the key `key`. Their first state is a hash of the sampler's numbers for
    /// this key, and so depends on the seed.
    pub fn of(key: SampleKey, sampler: &mut impl Sampler) -> Self {
        sampler.start(key);
        let pixel = sampler.get_2d(Dimension::PIXEL);
        let others = [Bounce::Lobe, Bounce::Decisions, Bounce::Direction].map(|what| Dimension::bounce(0, what));
        let [a, b, c] = others.map(|dimension| sampler.get_1d(dimension));
        let bits = [pixel.x, pixel.y, a, b, c].map(|u| u.to_bits() as u64);
        let key = [key.x, key.y, key.sample].map(u64::from);
        let words = bits.into_iter().chain(key);
        let state = words.fold(0u64, |hash, word| mix(hash.wrapping_add(GOLDEN_GAMMA) ^ word));
        Self {
            state,
            place: DVec2::ZERO,
            common: state,
        }
    }

    /// Next random number, in [0, 1).
    pub fn next(&mut self) -> f32 {
        next(&mut self.state)
    }

    /// Next two random numbers, in [0, 1)².
    pub fn next_2d(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    /// Next random point of the unit square, stratified over all chains of an iteration. The n-th
    /// points of all chains form a lattice with a random shift that depends only on n. The points
    /// of one chain are independent and uniform.
    pub fn spread(&mut self) -> Vec2 {
        let shift = [(); 2].map(|()| f64::from(next(&mut self.common)));
        let point = (self.place + DVec2::from(shift)).fract().as_vec2();
        point.min(Vec2::splat(1.0 - 0.5 * f32::EPSILON))
    }

    /// Samples an index in proportion to its weight. `None` if all weights are 0.
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

/// Next random number of SplitMix64, in [0, 1). Advances `state`.
fn next(state: &mut u64) -> f32 {
    *state = state.wrapping_add(GOLDEN_GAMMA);
    unit_f32(mix(*state))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Independent;

    /// The n-th points of 256 chains are stratified over 256 squares. The points of one chain are
    /// distributed like independent points.
    #[test]
    fn points_are_spread_over_chains() {
        let mut sampler = Independent::new(5);
        let square = |p: Vec2| (p.y * 16.0) as usize * 16 + (p.x * 16.0) as usize;
        let mut chains: Vec<Numbers> = (0..256).map(|i| Numbers::of_chain(i, 3, &mut sampler)).collect();
        let mut of_one = [0u32; 256];
        for _ in 0..25 {
            let mut counts = [0u32; 256];
            for chain in &mut chains {
                counts[square(chain.spread())] += 1;
            }
            assert!(*counts.iter().max().unwrap() <= 2);
            // With independent points, a fraction of e⁻¹ of the squares would be empty.
            let empty = counts.iter().filter(|count| **count == 0).count();
            assert!(empty < 60, "{empty} of 256 squares have no point");
        }
        for _ in 0..2560 {
            of_one[square(chains[0].spread())] += 1;
        }
        let chi_squared: f64 = of_one
            .iter()
            .map(|&count| (f64::from(count) - 10.0).powi(2) / 10.0)
            .sum();
        // 255 degrees of freedom: five standard deviations either way
        assert!((142.0..368.0).contains(&chi_squared), "{chi_squared}");
    }
}
