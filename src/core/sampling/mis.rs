//! Weights of multiple importance sampling (Veach 1997, §9.2). The density of a strategy with n
//! samples is n times the density of one sample.
//!
//! The functions here combine two strategies, for `integrator/path`.
//! `integrator/bidirectional/connection/weights.rs` computes the weights of bidirectional
//! strategies. The option `Heuristic` of `integrator/path/strategy.rs` selects the heuristic for
//! both.

/// Balance heuristic: the weight of the strategy with the density `pdf`, if the second strategy has
/// the density `other`. Returns 0 if `pdf` is 0, and 1 if `other` is 0.
pub fn balance_heuristic(pdf: f32, other: f32) -> f32 {
    if pdf <= 0.0 {
        return 0.0;
    }
    1.0 / (1.0 + other / pdf)
}

/// Power heuristic with β = 2: the weight of the strategy with the density `pdf`, if the second
/// strategy has the density `other`.
///
/// Returns 0 if `pdf` is 0, and 1 if `other` is 0. Ratios are formed first, so that large densities
/// do not overflow.
// ANCHOR: power
pub fn power_heuristic(pdf: f32, other: f32) -> f32 {
    if pdf <= 0.0 {
        return 0.0;
    }
    let ratio = other / pdf;
    1.0 / (1.0 + ratio * ratio)
}
// ANCHOR_END: power

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_of_all_strategies_sum_to_one() {
        for (a, b) in [
            (1.0, 2.0),
            (0.1, 0.1),
            (1e-30, 1e30),
            (1e30, 1e29),
            (0.0, 3.0),
            (2.0, 0.0),
        ] {
            for heuristic in [balance_heuristic, power_heuristic] {
                let sum = heuristic(a, b) + heuristic(b, a);
                assert!((sum - 1.0).abs() < 1e-6, "{a} {b} {sum}");
            }
        }
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
        assert_eq!(power_heuristic(3.0, 1.0), 0.9);
        assert_eq!(balance_heuristic(3.0, 1.0), 0.75);
    }
}
