//! Primary samples: a sampler whose random numbers are the state of a Markov chain.
//!
//! Steps of the chain are hashes. A number follows from the key of the chain, its accepted steps
//! and the dimension. It is computed on request and does not depend on earlier requests. Values are
//! cached in atomics (`AtomicU64`, relaxed), because samplers are shared by reference. The cache
//! saves work and changes no value.

use super::{Dimension, SampleKey, Sampler, hash};
use crate::math::Vec2;
use crate::math::hash::{GOLDEN_GAMMA, mix};
use std::sync::atomic::{AtomicU64, Ordering};

/// Kinds of mutations of primary samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// All random numbers are drawn again.
    Large,
    /// Each random number moves by a small amount.
    Small,
}

/// Ratio of the largest to the smallest small step.
const STEP_RATIO: f32 = 16.0;

/// Numbers of a Markov chain in the space of primary samples (Kelemen, Szirmay-Kalos, Antal and
/// Csonka 2002): a point of the unit cube, and the proposed step from this point. The cube has one
/// dimension for each random number that a path may request.
///
/// A small step moves each number up or down, with wrap-around in the unit interval, by `size ·
/// 16^−u` with a uniform u. Distances range from `size / 16` to `size`, and shorter distances are
/// more frequent. In §3.2 of the paper the range is 1/1024 to 1/64. All steps of a chain and their
/// decisions are hashes of the chain's key, the step's number and the dimension. Numbers can
/// therefore be moved on request only, with the same result. Numbers are integer multiples of 2⁻³².
/// A step is a permutation of these multiples, so a chain that accepts all steps stays uniform.
#[derive(Debug)]
pub struct PrimarySampler {
    /// Key of the random decisions of the chain: steps, and acceptance.
    key: u64,
    /// Number of steps proposed so far.
    proposed: u32,
    /// Hash key of the point that the last accepted large step reached. The coordinates of this
    /// point are hashes of the key.
    origin: u64,
    /// Hashes of the small steps that were accepted since the last large step.
    steps: Vec<u64>,
    /// Kind and hash of the proposed step, until it is accepted or rejected.
    proposal: Option<(Step, u64)>,
    /// Length of the longest small step.
    size: f32,
    /// Cache of the first coordinates. The upper half of a word is a value. The lower half is the
    /// number of the step after which this value is valid, counted over the whole chain from 1. The
    /// cache saves repeated steps and does not change any coordinate. Words are atomic because
    /// samplers are shared by reference.
    cache: Vec<AtomicU64>,
    /// Number of accepted steps of the whole chain, up to and including the last accepted large
    /// step.
    origin_step: u32,
}

impl PrimarySampler {
    /// A sampler at the point whose coordinates are hashes of `origin`.
    pub fn new(origin: u64) -> Self {
        Self::chain(origin, origin, 0.0, 0)
    }

    /// A chain with the key `key` that starts at the point `origin`, with small steps up to `size`.
    /// Only coordinates of the first `dimensions` dimensions are cached.
    pub fn chain(origin: u64, key: u64, size: f32, dimensions: u32) -> Self {
        Self {
            key,
            proposed: 0,
            origin,
            steps: Vec::new(),
            proposal: None,
            size,
            cache: (0..2 * dimensions).map(|_| AtomicU64::new(0)).collect(),
            origin_step: 0,
        }
    }

    /// Proposes a step: with probability `large_step_probability` a large step, otherwise a small
    /// step. Later draws return the numbers of the proposal.
    pub fn propose(&mut self, large_step_probability: f32) -> Step {
        let step = hash::numbered(self.key, self.proposed);
        self.proposed = self.proposed.wrapping_add(1);
        let kind = if unit(step, STEP_KIND) < large_step_probability {
            Step::Large
        } else {
            Step::Small
        };
        self.proposal = Some((kind, step));
        kind
    }

    /// Accepts the proposed step with probability `probability`. Returns `true` if the step is
    /// accepted. Otherwise the numbers return to their values before the proposal.
    pub fn decide(&mut self, probability: f32) -> bool {
        let Some((kind, step)) = self.proposal.take() else {
            return false;
        };
        let is_accepted = unit(step, ACCEPTANCE) < probability;
        match (is_accepted, kind) {
            (true, Step::Large) => {
                self.origin_step = self.origin_step.wrapping_add(self.steps.len() as u32 + 1);
                self.steps.clear();
                self.origin = step;
            }
            (true, Step::Small) => self.steps.push(step),
            (false, _) => {}
        }
        is_accepted
    }

    /// Number of `dimension` as an integer, in units of 2⁻³².
    fn number(&self, dimension: Dimension, component: u32) -> u32 {
        let coordinate = coordinate(dimension).wrapping_mul(2).wrapping_add(component);
        match self.proposal {
            Some((Step::Large, step)) => drawn(step, coordinate),
            Some((Step::Small, step)) => self
                .accepted(coordinate)
                .wrapping_add(self.displacement(step, coordinate)),
            None => self.accepted(coordinate),
        }
    }

    /// Coordinate of the chain's current point, without the proposed step.
    fn accepted(&self, coordinate: u32) -> u32 {
        let cached = self.cache.get(coordinate as usize);
        let word = cached.map_or(0, |word| word.load(Ordering::Relaxed));
        // The cached value is invalid if it is from before the last accepted large step.
        let (mut value, taken) = match (word as u32).checked_sub(self.origin_step + 1) {
            Some(taken) => ((word >> 32) as u32, taken as usize),
            None => (drawn(self.origin, coordinate), 0),
        };
        for &step in &self.steps[taken..] {
            value = value.wrapping_add(self.displacement(step, coordinate));
        }
        if let Some(cached) = cached {
            let now = self.origin_step + self.steps.len() as u32 + 1;
            cached.store(((value as u64) << 32) | now as u64, Ordering::Relaxed);
        }
        value
    }

    /// Displacement of the coordinate `coordinate` by the small step with the hash `step`, in units
    /// of 2⁻³².
    fn displacement(&self, step: u64, coordinate: u32) -> u32 {
        let bits = hash::numbered(step, coordinate);
        let u = hash::unit_f32((bits >> 32) as u32);
        let displacement = self.size * (-STEP_RATIO.log2() * u).exp2();
        let displacement = (displacement as f64 * 2f64.powi(32)) as u32;
        if bits & 1 == 0 {
            displacement
        } else {
            displacement.wrapping_neg()
        }
    }
}

/// Indices of the numbers that decide the kind of a step and its acceptance. No dimension has these
/// indices.
const STEP_KIND: u32 = u32::MAX;
const ACCEPTANCE: u32 = u32::MAX - 1;

fn unit(step: u64, which: u32) -> f32 {
    hash::unit_f32((hash::numbered(step, which) >> 32) as u32)
}

/// Coordinate `coordinate` of the point with the hash key `origin`.
fn drawn(origin: u64, coordinate: u32) -> u32 {
    (hash::numbered(origin, coordinate) >> 32) as u32
}

/// Index of the coordinate of a dimension. Light paths and camera paths share the coordinate of the
/// lens point, so the lens point stays the same if the technique changes. A path samples the lens
/// only once.
fn coordinate(dimension: Dimension) -> u32 {
    match dimension.index() {
        index if index & 0xffff == Dimension::LENS.index() => Dimension::LENS.index(),
        index => index,
    }
}

impl Clone for PrimarySampler {
    fn clone(&self) -> Self {
        let word = |word: &AtomicU64| AtomicU64::new(word.load(Ordering::Relaxed));
        Self {
            steps: self.steps.clone(),
            cache: self.cache.iter().map(word).collect(),
            ..*self
        }
    }
}

impl Sampler for PrimarySampler {
    /// Moves to an independent point for each key.
    fn start(&mut self, key: SampleKey) {
        let origin = mix(hash::pixel(self.key, key).wrapping_add(GOLDEN_GAMMA) ^ key.sample as u64);
        *self = Self::chain(origin, self.key, self.size, self.cache.len() as u32 / 2);
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        hash::unit_f32(self.number(dimension, 0))
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let [x, y] = [0, 1].map(|component| hash::unit_f32(self.number(dimension, component)));
        Vec2::new(x, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::Bounce;

    const HERE: Dimension = Dimension::PIXEL;

    fn there() -> Dimension {
        Dimension::bounce(3, Bounce::Direction)
    }

    /// Asserts by χ² over 256 cells that chains stay uniform after `steps` small steps. Large steps
    /// with the probability `large` are mixed in.
    fn assert_uniform(steps: u32, large: f32) {
        const CHAINS: u32 = 51_200;
        let mut counts = [[0.0f64; 256]; 2];
        for i in 0..CHAINS {
            let mut chain = PrimarySampler::chain(i as u64, !(i as u64), 1.0 / 64.0, if i % 2 == 0 { 100 } else { 0 });
            for _ in 0..steps {
                chain.propose(large);
                assert!(chain.decide(1.0));
            }
            let (p, q) = (chain.get_2d(HERE), chain.get_1d(there()));
            counts[0][(p.x * 16.0) as usize * 16 + (p.y * 16.0) as usize] += 1.0;
            counts[1][(q * 256.0) as usize] += 1.0;
        }
        for counts in counts {
            let expected = CHAINS as f64 / 256.0;
            let chi2: f64 = counts.iter().map(|c| (c - expected).powi(2) / expected).sum();
            // 255 degrees of freedom: standard deviation 22.6
            assert!(chi2 < 255.0 + 5.0 * 22.6, "{steps} steps, {large}: χ² = {chi2}");
        }
    }

    #[test]
    fn steps_that_are_all_accepted_stay_uniform() {
        assert_uniform(0, 0.0);
        assert_uniform(1, 0.0);
        assert_uniform(40, 0.0);
        assert_uniform(20, 0.2);
    }

    /// The pixel coordinate of one long chain has all values equally often.
    #[test]
    fn long_chain_visits_all_values_equally_often() {
        const STEPS: u32 = 400_000;
        let mut chain = PrimarySampler::chain(1, 2, 1.0 / 16.0, 10);
        let mut counts = [0.0f64; 16];
        for _ in 0..STEPS {
            chain.propose(0.1);
            chain.decide(1.0);
            counts[(chain.get_1d(HERE) * 16.0) as usize] += 1.0;
        }
        // Large steps make the chain forget its state within ten steps. The variance is therefore
        // at most 20 times the variance of independent numbers.
        let expected = STEPS as f64 / 16.0;
        let z = |count: f64| (count - expected) / (20.0 * expected).sqrt();
        assert!(counts.iter().all(|&count| z(count).abs() < 4.0), "{counts:?}");
    }

    /// Lengths of small steps have a density proportional to 1 / length, from a sixteenth of `size`
    /// to `size`, in both directions.
    #[test]
    fn small_step_lengths_have_density_one_over_length() {
        const N: usize = 100_000;
        const SIZE: f64 = 1.0 / 64.0;
        let mut counts = [[0.0f64; 16]; 2];
        for i in 0..N as u64 {
            let mut chain = PrimarySampler::chain(i, !i, SIZE as f32, 0);
            let before = chain.get_1d(there());
            chain.propose(0.0);
            let displacement = (chain.get_1d(there()) - before) as f64;
            let displacement = displacement - displacement.round();
            let bin = 16.0 + 4.0 * (displacement.abs() / SIZE).log2();
            assert!((-0.01..16.01).contains(&bin), "{displacement}");
            counts[usize::from(displacement < 0.0)][bin.clamp(0.0, 15.9) as usize] += 1.0;
        }
        let expected = N as f64 / 32.0;
        let chi2: f64 = counts.iter().flatten().map(|c| (c - expected).powi(2) / expected).sum();
        // 31 degrees of freedom: standard deviation 7.9
        assert!(chi2 < 31.0 + 5.0 * 7.9, "χ² = {chi2}");
    }

    /// A number does not depend on earlier requests or on the cache.
    #[test]
    fn numbers_do_not_depend_on_earlier_draws() {
        let mut chains = [100, 100, 0, 30].map(|dimensions| PrimarySampler::chain(5, 6, 0.1, dimensions));
        for i in 0..300 {
            let kinds = [0, 1, 2, 3].map(|c| chains[c].propose(0.1));
            assert!(kinds.iter().all(|kind| *kind == kinds[0]));
            // Read the first chain at every step, and the other chains only at some steps
            chains[0].get_2d(there());
            if i % 7 == 0 {
                chains[1].get_2d(there());
                let all = chains
                    .each_ref()
                    .map(|chain| [chain.get_2d(HERE), chain.get_2d(there())]);
                assert!(all.iter().all(|numbers| *numbers == all[0]), "step {i}");
            }
            for chain in &mut chains {
                chain.decide(0.5);
            }
        }
        let copy = chains[1].clone();
        assert_eq!(copy.get_2d(there()), chains[2].get_2d(there()));
    }

    #[test]
    fn rejected_step_changes_nothing() {
        let mut chain = PrimarySampler::chain(7, 8, 0.1, 30);
        let numbers = |chain: &PrimarySampler| [HERE, there()].map(|dimension| chain.get_2d(dimension));
        let before = numbers(&chain);
        for large in [0.0, 1.0] {
            chain.propose(large);
            assert_ne!(numbers(&chain), before);
            assert!(!chain.decide(0.0));
            assert_eq!(numbers(&chain), before);
        }
    }
}
