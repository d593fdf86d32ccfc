//! Time that a Markov chain stays in a pixel, measured as integrated autocorrelation time.
//!
//! An image counts the visits of chains to each pixel. Let `Xᵢ` be 1 if the i-th of n mutations is
//! in pixel p, and `c = Σ Xᵢ` the number of visits. Independent samples would have `E[c²] ≈ E[c]`
//! for a rare pixel. For a chain, both `E[c²]` and the variance are `τ` times as large. Over all
//! pixels
//!
//! ```text
//! τ = 1/n Σₚ cₚ² = 1/n Σᵢⱼ P(mutations i and j are in one pixel)
//! ```
//!
//! `τ` is 1 for a chain that never returns to a pixel, and n for a chain that never leaves a pixel.
//! Visits are fractions, because a mutation counts for the current path and for the proposed path;
//! so `τ` may be below 1.

use crate::integrator::ChainCounts;
use crate::math::Vec2;
use std::collections::HashMap;

/// Number of visits of one chain to each pixel.
#[derive(Debug, Default)]
pub(crate) struct Visits {
    pixels: HashMap<[i32; 2], f64>,
    /// Sum over all pixels of the squared visits.
    squares: f64,
    /// Maximum number of visits over all pixels.
    max: f64,
}

impl Visits {
    /// Adds the fraction `share` of a mutation to the visits of the pixel at the film position
    /// `film` (pixels, origin top left).
    pub fn add(&mut self, film: Vec2, share: f64) {
        let visits = self.pixels.entry(film.floor().as_ivec2().to_array()).or_default();
        self.squares += share * (share + 2.0 * *visits);
        *visits += share;
        self.max = self.max.max(*visits);
    }

    /// Statistics of the chain, which made `mutations` mutations.
    pub fn counts(&self, mutations: u64) -> ChainCounts {
        ChainCounts {
            chains: 1,
            mutations,
            squared_visits: self.squares.round() as u64,
            stuck: u64::from(self.max * 2.0 >= mutations as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(places: impl Iterator<Item = u32>) -> ChainCounts {
        let mut visits = Visits::default();
        let mut mutations = 0;
        for x in places {
            visits.add(Vec2::new(x as f32 + 0.5, 3.0), 1.0);
            mutations += 1;
        }
        visits.counts(mutations)
    }

    /// Chains with known autocorrelation time: a chain with independent pixels, chains with runs of
    /// one length, and a chain that never moves.
    #[test]
    fn autocorrelation_times_of_known_chains() {
        for (counts, time, stuck) in [
            (chain(0..100), 1.0, 0),
            (chain((0..100).map(|i| i / 10)), 10.0, 0),
            (chain((0..100).map(|_| 7)), 100.0, 1),
            (
                chain((0..100).map(|i| if i < 50 { 0 } else { i })),
                (50.0 * 50.0 + 50.0) / 100.0,
                1,
            ),
        ] {
            assert_eq!((counts.autocorrelation_time(), counts.stuck), (Some(time), stuck));
        }
        assert_eq!(ChainCounts::default().autocorrelation_time(), None);
    }

    /// A chain that stays in its pixel with probability q and never returns has the autocorrelation
    /// time (1 + q) / (1 − q).
    #[test]
    fn geometric_stay_has_closed_form_autocorrelation_time() {
        let (q, mut x, mut state) = (0.8, 0, 1u64);
        let counts = chain((0..200_000).map(|_| {
            state = crate::math::hash::mix(state.wrapping_add(crate::math::hash::GOLDEN_GAMMA));
            x += u32::from(crate::math::hash::unit_f64(state) >= q);
            x
        }));
        let time = counts.autocorrelation_time().unwrap();
        assert!((time - (1.0 + q) / (1.0 - q)).abs() < 0.15, "{time}");
    }
}
