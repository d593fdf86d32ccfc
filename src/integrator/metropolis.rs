use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::sampler::{Dimension, Sampler};

/// How Metropolis light transport is done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metropolis {
    /// Who finds the light that is scattered once, or not at all.
    pub direct: MetropolisDirect,
    /// What chains are after.
    pub target: MetropolisTarget,
    /// Chains in a frame; `None`: as many as serve its number of pixels well.
    pub chains: Option<u32>,
    /// Paths in a frame that tell how much light there is and where chains start; `None`: as many as serve its number of pixels well.
    pub bootstrap: Option<u32>,
    /// Share of large steps, 0 to 1.
    pub large_step_probability: f32,
    /// The longest small step, as a share of the range of a random number, above 0 and 0.5 at most.
    pub mutation_size: f32,
}

impl Default for Metropolis {
    /// Steps as Kelemen et al. have them.
    fn default() -> Self {
        Self {
            direct: MetropolisDirect::Ordinary,
            target: MetropolisTarget::Relative,
            chains: None,
            bootstrap: None,
            large_step_probability: 0.3,
            mutation_size: 1.0 / 64.0,
        }
    }
}

/// Who finds direct light, and light that is not scattered at all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MetropolisDirect {
    /// Path tracing, a sample a pixel: chains would go where it is bright, and do no better (Veach and Guibas 1997, §5.4).
    #[default]
    Ordinary,
    /// Chains, as all other light.
    Metropolis,
}

/// What Markov chains are after: they visit paths in proportion to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MetropolisTarget {
    /// The luminance that a path brings to the picture.
    Luminance,
    /// That over what a [`TestPicture`] shows at its place, so that dark places get about as many paths as bright ones (two-stage Metropolis light
    /// transport, Veach and Guibas 1997).
    #[default]
    Relative,
}

impl Metropolis {
    /// Vertices, at least, of the paths that chains carry.
    pub(super) fn least_vertices(&self) -> usize {
        match self.direct {
            MetropolisDirect::Ordinary => 4,
            MetropolisDirect::Metropolis => 2,
        }
    }
}

/// A name for what the sampler stands at: chains draw all of their own numbers from it.
pub(super) fn name(sampler: &impl Sampler) -> u64 {
    let [a, b] = [Dimension::PIXEL, Dimension::LENS].map(|dimension| sampler.get_2d(dimension));
    let word = |x: f32, y: f32| ((x.to_bits() as u64) << 32) | y.to_bits() as u64;
    mix(mix(word(a.x, a.y).wrapping_add(GOLDEN_GAMMA)) ^ word(b.x, b.y))
}

/// A number in [0, 1) made of a hash.
pub(super) fn unit(hash: u64) -> f64 {
    (mix(hash) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}
