//! Russian roulette: ends paths of small throughput at random and raises the weight of those that survive (Arvo and Kirk 1990, "Particle Transport and
//! Image Synthesis").
//!
//! Roulette may end a path after its second scattering. By default the survival probability is the largest channel of the throughput, 0.95 at most. With
//! Sobol points and path reuse, the defaults, this start has the smallest product of error and time on the suite's cornell and hall, and is 4 % off the
//! smallest on sponza. With independent samples without reuse it has the smallest product on cornell and sponza, and is 4 % off on hall
//! (docs/benchmarks.md, "Russian roulette"). Survival by luminance, and by 0.65 or 0.8 of the largest channel, had larger products.
//!
//! The throughput that roulette sees is multiplied by the squared indices of refraction that the path has been divided by: radiance that shrinks on
//! its way into glass grows again on its way out. `reuse` adds a minimum for shared paths.
//! `integrator/visibility.rs`, which learns which parts of the sky are visible, has a roulette of its own.

use crate::color::Spectrum;

/// Maximum survival probability by throughput, so that every path ends, also in a closed room that absorbs nothing.
const MAX_SURVIVAL: f32 = 0.95;

// ANCHOR: roulette
/// Russian roulette: ends paths at random where little is left to gain, and weighs those that go on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roulette {
    /// Minimum number of scattering events before roulette may end a path.
    pub depth: u32,
    /// Survival probability.
    pub survival: Survival,
}

/// Survival probability of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Survival {
    /// Largest channel of the throughput, 0.95 at most.
    LargestChannel,
    /// Luminance of the throughput, 0.95 at most.
    Luminance,
    /// One probability for all paths, in (0, 1]. At 1 only a maximum depth ends paths.
    Constant(f32),
    /// Largest channel of the throughput over a threshold, above 0; certain where the throughput is above it.
    Threshold(f32),
}

impl Roulette {
    /// The factor that makes up for the paths that end here, or `None` where this one does.
    ///
    /// `depth` scatterings came before the last one; `beta` is the throughput of the path.
    pub(crate) fn play(self, depth: u32, beta: Spectrum, u: f32) -> Option<f32> {
        if depth < self.depth {
            return Some(1.0);
        }
        let survival = match self.survival {
            Survival::LargestChannel => beta.max_component().min(MAX_SURVIVAL),
            Survival::Luminance => beta.luminance().min(MAX_SURVIVAL),
            Survival::Constant(probability) => probability,
            Survival::Threshold(threshold) => (beta.max_component() / threshold).min(1.0),
        };
        (u < survival).then(|| 1.0 / survival)
    }
}
// ANCHOR_END: roulette

impl Roulette {
    /// Roulette with the default survival probability.
    pub fn after(depth: u32) -> Self {
        Self {
            depth,
            survival: Survival::LargestChannel,
        }
    }
}

impl Default for Roulette {
    /// Depth 1. With path reuse it has the smallest product of error and time on the suite's cornell and hall, and is 4 % off the smallest
    /// on sponza (docs/benchmarks.md, "Russian roulette").
    fn default() -> Self {
        Self::after(1)
    }
}
