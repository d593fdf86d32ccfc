use super::{AnySampler, Dimension, Fibonacci, PerturbedQmc, SampleKey, Sampler};
use crate::math::Vec2;

/// Sampler of a render. Most renders use `Plain`. The other variants are not inlined.
#[derive(Clone, Copy, Debug)]
pub enum RenderSampler {
    /// A single sampler for all numbers.
    Plain(AnySampler),
    /// Spherical Fibonacci points for directions, and another sampler for all other numbers.
    Fibonacci(Fibonacci),
    /// Perturbed points for directions, and another sampler for all other numbers.
    PerturbedQmc(PerturbedQmc),
}

impl Sampler for RenderSampler {
    #[inline]
    fn start(&mut self, key: SampleKey) {
        match self {
            Self::Plain(sampler) => sampler.start(key),
            Self::Fibonacci(sampler) => sampler.start(key),
            Self::PerturbedQmc(sampler) => sampler.start(key),
        }
    }

    fn separate(&mut self) {
        match self {
            Self::Plain(sampler) => sampler.separate(),
            Self::Fibonacci(sampler) => sampler.separate(),
            Self::PerturbedQmc(sampler) => sampler.separate(),
        }
    }

    #[inline(always)]
    fn get_1d(&self, dimension: Dimension) -> f32 {
        match self {
            Self::Plain(sampler) => sampler.get_1d(dimension),
            Self::Fibonacci(sampler) => sampler.get_1d(dimension),
            Self::PerturbedQmc(sampler) => sampler.get_1d(dimension),
        }
    }

    #[inline(always)]
    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        match self {
            Self::Plain(sampler) => sampler.get_2d(dimension),
            Self::Fibonacci(sampler) => sampler.get_2d(dimension),
            Self::PerturbedQmc(sampler) => sampler.get_2d(dimension),
        }
    }

    #[inline(always)]
    fn get_2ds<const N: usize>(&self, dimensions: [Dimension; N]) -> [Vec2; N] {
        match self {
            Self::Plain(sampler) => sampler.get_2ds(dimensions),
            Self::Fibonacci(sampler) => sampler.get_2ds(dimensions),
            Self::PerturbedQmc(sampler) => sampler.get_2ds(dimensions),
        }
    }

    #[inline(always)]
    fn get_2ds_of(&self, key: SampleKey, count: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        match self {
            Self::Plain(sampler) => sampler.get_2ds_of(key, count, dimensions),
            Self::Fibonacci(sampler) => sampler.get_2ds_of(key, count, dimensions),
            Self::PerturbedQmc(sampler) => sampler.get_2ds_of(key, count, dimensions),
        }
    }
}
