//! Budget of a contender: samples or seconds.

use crate::render::last_cut;

/// Factor between the sample counts of successive snapshots of a curve.
const STEP: u32 = 4;

/// Budget of a contender, in samples or in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Budget {
    /// Samples per pixel.
    Samples(u32),
    /// Seconds of rendering.
    Seconds(f64),
}

/// Next step of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    /// Samples per pixel at the end of the step.
    pub end: u32,
    /// True if the budget is spent at the end of the step.
    pub is_last: bool,
}

impl Budget {
    /// Budgets of `--spp` or `--time`, ascending and unique.
    pub fn of(samples: &[u32], seconds: &[f64]) -> Vec<Self> {
        const DEFAULT: u32 = 64;
        let mut budgets: Vec<Self> = match (samples, seconds) {
            ([], []) => vec![Self::Samples(DEFAULT)],
            (samples, []) => samples.iter().copied().map(Self::Samples).collect(),
            (_, seconds) => seconds.iter().copied().map(Self::Seconds).collect(),
        };
        budgets.sort_by(|a, b| a.amount().total_cmp(&b.amount()));
        budgets.dedup();
        budgets
    }

    /// Maximum number of snapshots until `budgets` are spent. For seconds, the snapshots up to 4⁹
    /// samples are counted.
    pub fn snapshots(budgets: &[Self]) -> u64 {
        const MAX_POINTS: u32 = 10;
        let marks = budgets.iter().map(|budget| match budget {
            Self::Samples(samples) => samples.max(&1).ilog(STEP) + 1,
            Self::Seconds(_) => MAX_POINTS,
        });
        u64::from(marks.max().unwrap_or(0)) + budgets.len() as u64
    }

    fn amount(self) -> f64 {
        match self {
            Self::Samples(samples) => samples.into(),
            Self::Seconds(seconds) => seconds,
        }
    }

    /// The step after `done` samples, which took `seconds`. The step ends at the next power of 4 or
    /// at the end of the budget, whichever comes first. With a budget in seconds, the step may end
    /// earlier than both.
    pub fn step(self, done: u32, seconds: f64) -> Step {
        let mark = next_mark(done);
        match self {
            Self::Samples(samples) => Step {
                end: mark.min(samples),
                is_last: mark >= samples,
            },
            Self::Seconds(_) if done == 0 => Step { end: 1, is_last: false },
            Self::Seconds(budget) => {
                // Number of samples that fit in the rest of the budget, if samples take as long as
                // before; at most `done`
                let affordable = ((budget - seconds) * f64::from(done) / seconds).clamp(0.0, done.into()) as u32;
                let cut = last_cut(done.saturating_add(affordable));
                if cut > done {
                    Step {
                        end: cut.min(mark),
                        is_last: false,
                    }
                } else {
                    // A cut is a sample count between two passes of the renderer. A step that does
                    // not end at a cut must be the last step, because a following step would take
                    // some samples again.
                    Step {
                        end: done.saturating_add(affordable),
                        is_last: true,
                    }
                }
            }
        }
    }
}

/// The power of 4 above `done`.
fn next_mark(done: u32) -> u32 {
    let mut mark = 1u32;
    while mark <= done && mark < u32::MAX {
        mark = mark.saturating_mul(STEP);
    }
    mark
}

/// Returns true if a curve has a point at `samples` samples.
pub(super) fn is_mark(samples: u32) -> bool {
    samples.is_power_of_two() && samples.trailing_zeros() % STEP.trailing_zeros() == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(budget: Budget, rate: f64) -> Vec<u32> {
        let (mut done, mut ends) = (0, Vec::new());
        loop {
            let step = budget.step(done, f64::from(done) / rate);
            done = step.end;
            ends.push(done);
            if step.is_last {
                return ends;
            }
        }
    }

    #[test]
    fn samples_go_by_powers_of_four() {
        assert_eq!(ends(Budget::Samples(1), 1.0), [1]);
        assert_eq!(ends(Budget::Samples(10), 1.0), [1, 4, 10]);
        assert_eq!(ends(Budget::Samples(64), 1.0), [1, 4, 16, 64]);
        assert_eq!(
            Budget::Samples(100).step(10, 1.0),
            Step {
                end: 16,
                is_last: false
            }
        );
        assert_eq!(ends(Budget::Samples(u32::MAX), 1.0).last(), Some(&u32::MAX));
        assert!([1, 4, 16, 64, 256].into_iter().all(is_mark) && ![0, 2, 8, 63].into_iter().any(is_mark));
    }

    /// A step that does not end at a cut between passes is the last step. At a constant number of
    /// samples per second, the whole budget is spent, to within the time of one sample.
    #[test]
    fn seconds_are_spent() {
        for (seconds, expected) in [(0.01, 1), (0.5, 5), (1.0, 10), (2.5, 25), (10.0, 100), (100.0, 1000)] {
            let ends = ends(Budget::Seconds(seconds), 10.0);
            assert!(
                ends.last().is_some_and(|&n| n.abs_diff(expected) <= 1),
                "{seconds}: {ends:?}"
            );
            let [before @ .., _] = ends.as_slice() else { panic!() };
            assert!(before.iter().all(|&n| last_cut(n) == n), "{ends:?}");
        }
    }

    #[test]
    fn budgets_ascend() {
        let of = |samples: &[u32], seconds: &[f64]| Budget::of(samples, seconds);
        assert_eq!(of(&[], &[]), [Budget::Samples(64)]);
        assert_eq!(of(&[10, 1, 10], &[]), [Budget::Samples(1), Budget::Samples(10)]);
        assert_eq!(Budget::snapshots(&of(&[64, 10], &[])), 6);
        assert_eq!(of(&[], &[2.0, 0.5]), [Budget::Seconds(0.5), Budget::Seconds(2.0)]);
    }
}
