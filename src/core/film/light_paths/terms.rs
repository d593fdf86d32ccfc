//! Exact sums of parts: what a block of samples adds to each of them.
//!
//! Each sample is rounded, and so are its classes: in f32 their sum differs from the sample by some units in the last place. The difference is put
//! into the brightest class of a block, on the grid of the exact sums. Sums of all classes are thus those of the picture to the bit, and stay so
//! over blocks, parts of a render and merging, as long as no sum leaves the range of [`Fixed`].

use super::LightPaths;
use crate::film::fixed::Fixed;
use crate::film::part_sums::PartSum;

impl LightPaths {
    /// Terms that a block with the sums `classes` adds to the parts. `picture` is the block's sum of all light.
    pub(in crate::film) fn terms(&self, classes: &[[f64; 3]], picture: [f64; 3]) -> Vec<PartSum> {
        let mut terms = vec![PartSum::default(); self.layers.len()];
        for c in 0..3 {
            let mut sums: Vec<Fixed> = classes.iter().map(|sum| Fixed::new(sum[c])).collect();
            let rest = sums.iter().fold(Fixed::new(picture[c]), |rest, sum| rest.minus(*sum));
            let brightest = (0..sums.len()).reduce(|a, b| {
                if classes[b][c].abs() > classes[a][c].abs() {
                    b
                } else {
                    a
                }
            });
            if let Some(brightest) = brightest {
                sums[brightest] = sums[brightest].plus(rest);
            }
            for (part, term) in terms.iter_mut().enumerate() {
                let members = sums.iter().enumerate().filter(|(class, _)| self.is_in(*class, part));
                term.0[c] = members.fold(Fixed::default(), |all, (_, sum)| all.plus(*sum));
            }
        }
        terms
    }
}
