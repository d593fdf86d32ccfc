//! Russian roulette: ends paths of small throughput at random and raises the weight of the
//! survivors (Arvo and Kirk 1990, "Particle Transport and Image Synthesis").
//!
//! By default roulette may end a path after its second scattering event. The default survival
//! probability is the largest channel of the throughput (in `path` divided by 0.5), at most 0.95.
//! docs/notebook/2026-11.md, "Russian roulette", compares rules by the product of noise and time.
//!
//! Refraction divides the throughput by the squared relative index of refraction. The survival
//! probability uses the throughput without this division, because radiance that shrinks on its way
//! into glass grows again on its way out. For shared paths, `reuse` uses a minimum of the
//! throughput. `integrator/visibility.rs`, which learns which parts of the sky are visible, has a
//! separate roulette.

use crate::color::Spectrum;

/// Maximum survival probability of the rules that use the throughput. Because it is below 1, every
/// path ends, even in a closed room without absorption.
const MAX_SURVIVAL: f32 = 0.95;

// ANCHOR: roulette
/// Rule of Russian roulette: ends paths of small throughput at random, and increases the weight of
/// the survivors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roulette {
    /// Minimum number of scattering events before roulette may end a path.
    pub depth: u32,
    /// Rule for the survival probability.
    pub survival: Survival,
}

/// Rule for the survival probability of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Survival {
    /// Largest channel of the throughput, at most 0.95.
    LargestChannel,
    /// Luminance of the throughput, at most 0.95.
    Luminance,
    /// Constant probability for all paths, in (0, 1]. At 1 only a maximum depth ends paths.
    Constant(f32),
    /// Largest channel of the throughput divided by a threshold above 0; at most 0.95.
    Threshold(f32),
}

impl Roulette {
    /// Returns the factor that compensates for terminated paths, or `None` if this path ends.
    ///
    /// `depth` is the number of scattering events before the last event. `beta` is the throughput
    /// of the path after the last event. `u` is a random number in [0, 1).
    pub(crate) fn play(self, depth: u32, beta: Spectrum, u: f32) -> Option<f32> {
        if depth < self.depth {
            return Some(1.0);
        }
        let survival = match self.survival {
            Survival::LargestChannel => beta.max_component().min(MAX_SURVIVAL),
            Survival::Luminance => beta.luminance().min(MAX_SURVIVAL),
            Survival::Constant(probability) => probability,
            Survival::Threshold(threshold) => (beta.max_component() / threshold).min(MAX_SURVIVAL),
        };
        (u < survival).then(|| 1.0 / survival)
    }
}
// ANCHOR_END: roulette

impl Roulette {
    /// Roulette that may end paths after `depth` scattering events, with the default survival
    /// probability.
    pub fn after(depth: u32) -> Self {
        Self {
            depth,
            survival: Survival::LargestChannel,
        }
    }
}

impl Default for Roulette {
    /// Roulette from depth 1 on. On the project's test scenes, this depth has the smallest product
    /// of noise and time, or nearly the smallest (docs/notebook/2026-11.md, "Russian roulette").
    fn default() -> Self {
        Self::after(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean factor is 1 for every rule. With the rules that use the throughput, every path
    /// ends.
    #[test]
    fn mean_roulette_factor_is_one() {
        const DRAWS: u32 = 1 << 16;
        let rules = [
            Survival::LargestChannel,
            Survival::Luminance,
            Survival::Constant(0.7),
            Survival::Threshold(0.5),
        ];
        for survival in rules {
            let roulette = Roulette { depth: 2, survival };
            for beta in [0.01, 0.3, 0.5, 1.0, 40.0] {
                let play = |depth, i| roulette.play(depth, Spectrum::splat(beta), (i as f32 + 0.5) / DRAWS as f32);
                let (mut sum, mut survivors) = (0.0, 0);
                for factor in (0..DRAWS).filter_map(|i| play(2, i)) {
                    sum += factor as f64;
                    survivors += 1;
                }
                let mean = sum / DRAWS as f64;
                assert!((mean - 1.0).abs() < 1e-3, "{survival:?}, throughput {beta}: {mean}");
                assert!(survivors < DRAWS, "{survival:?}, throughput {beta}");
                assert_eq!(play(1, DRAWS - 1), Some(1.0));
            }
        }
    }
}
