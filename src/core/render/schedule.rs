//! Passes: ranges of sample indices that are rendered and summed together.
//!
//! Passes end at 1, 2, 4, 8, 16 and 32 samples, so that a whole image exists soon, and from 64 on
//! at every multiple of 64. These ends, called cuts, depend only on the sample indices. A pass is
//! summed separately in f64 before it is added to the film, so the same cuts give the same bits.
//!
//! A render may end between two cuts. For example, 100 samples are two passes of 64 and 36. If more
//! samples are needed later, the 36 samples are traced again and subtracted, and the whole block
//! 64..128 is added. So the sums equal the sums of a render that never stopped at 100.

use crate::film::BLOCK;
use std::ops::Range;

/// Divides the sample indices `samples` into passes over the image.
///
/// The cuts (ends of passes) depend only on the indices. They are at 1, 2, 4, 8, 16 and 32 within
/// the first block, so that a whole image exists soon, then at every multiple of 64. A pass is
/// summed separately before it is added to the film, so the same cuts give the same bits at any
/// time and on any machine.
pub fn passes(samples: Range<u32>) -> impl Iterator<Item = Range<u32>> {
    let mut start = samples.start;
    std::iter::from_fn(move || {
        if start >= samples.end {
            return None;
        }
        let end = next_cut(start).min(samples.end);
        let pass = start..end;
        start = end;
        Some(pass)
    })
}

/// Index of the last cut at or before `sample`: the start of the pass that contains `sample`.
pub fn last_cut(sample: u32) -> u32 {
    if sample < BLOCK {
        sample.checked_ilog2().map_or(0, |log| 1 << log)
    } else {
        sample / BLOCK * BLOCK
    }
}

fn next_cut(sample: u32) -> u32 {
    if sample < BLOCK {
        (sample + 1).next_power_of_two()
    } else {
        (sample / BLOCK + 1).saturating_mul(BLOCK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_depend_on_indices_alone() {
        let ends = |r| passes(r).map(|p| p.end).collect::<Vec<_>>();
        assert_eq!(ends(0..200), [1, 2, 4, 8, 16, 32, 64, 128, 192, 200]);
        assert_eq!(ends(64..200), [128, 192, 200]);
        assert_eq!(ends(16..70), [32, 64, 70]);
        assert!(ends(5..5).is_empty());
        assert_eq!(ends(u32::MAX - 1..u32::MAX), [u32::MAX]);
    }

    #[test]
    fn last_cut_is_start_of_pass() {
        for sample in 0..300 {
            let starts = passes(0..1000).map(|pass| pass.start);
            assert_eq!(Some(last_cut(sample)), starts.take_while(|&s| s <= sample).last());
        }
    }
}
