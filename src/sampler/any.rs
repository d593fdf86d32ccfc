use super::{Dimension, Independent, SampleKey, Sampler, Sobol};
use crate::math::Vec2;

/// The samplers there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// [`Sobol`].
    Sobol,
    /// [`Independent`].
    Independent,
}

impl SamplerKind {
    /// Each by the name that users type, the default first.
    pub const NAMES: &[(&str, Self)] = &[("sobol", Self::Sobol), ("independent", Self::Independent)];

    /// A sampler of this kind.
    pub fn with_seed(self, seed: u64) -> AnySampler {
        match self {
            Self::Sobol => AnySampler::Sobol(Sobol::new(seed)),
            Self::Independent => AnySampler::Independent(Independent::new(seed)),
        }
    }
}

/// A sampler that was chosen when the program runs. Every draw asks which, always with the same answer, which costs less than
/// a renderer for each would.
#[derive(Clone, Debug)]
pub enum AnySampler {
    /// Owen-scrambled Sobol points.
    Sobol(Sobol),
    /// Independent numbers.
    Independent(Independent),
}

impl Sampler for AnySampler {
    fn start(&mut self, key: SampleKey) {
        match self {
            Self::Sobol(sampler) => sampler.start(key),
            Self::Independent(sampler) => sampler.start(key),
        }
    }

    #[inline]
    fn get_1d(&self, dimension: Dimension) -> f32 {
        match self {
            Self::Sobol(sampler) => sampler.get_1d(dimension),
            Self::Independent(sampler) => sampler.get_1d(dimension),
        }
    }

    #[inline]
    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        match self {
            Self::Sobol(sampler) => sampler.get_2d(dimension),
            Self::Independent(sampler) => sampler.get_2d(dimension),
        }
    }
}
