use super::{Dimension, Independent, SampleKey, Sampler};
use crate::math::{Vec2, float::ALMOST_ONE};

/// Pairs of samples with mirrored numbers: u and 1 − u (Hammersley and Morton 1956). In each pair,
/// the part of the integrand that is odd about the centre of the unit cube cancels. Pairs are
/// independent of each other.
#[derive(Clone, Copy, Debug)]
pub struct Antithetic {
    first: Independent,
    mirrored: bool,
}

impl Antithetic {
    /// A sampler for the given seed.
    pub fn new(seed: u64) -> Self {
        Self {
            first: Independent::new(seed),
            mirrored: false,
        }
    }
}

impl Sampler for Antithetic {
    fn start(&mut self, key: SampleKey) {
        self.first.start(SampleKey {
            sample: key.sample / 2,
            ..key
        });
        self.mirrored = key.sample % 2 == 1;
    }

    fn get_1d(&self, dimension: Dimension) -> f32 {
        let u = self.first.get_1d(dimension);
        if self.mirrored { ALMOST_ONE - u } else { u }
    }

    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        let u = self.first.get_2d(dimension);
        if self.mirrored { ALMOST_ONE - u } else { u }
    }
}
