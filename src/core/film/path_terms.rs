//! Terms that a block of samples adds to the layers of light path expressions. The layers add up to
//! the picture exactly.
//!
//! The radiance of each sample, and of each class of light paths in the sample, is rounded to f32.
//! The sum of the classes therefore differs from the sample by some units in the last place. For
//! each block of samples, the difference is added to the brightest class, in fixed point. The sums
//! of all classes are then bit-identical to the picture, and remain so over blocks, parts of a
//! render and merging, unless a sum leaves the range of [`Fixed`].

use super::fixed::Fixed;
use super::part_sums::PartSum;
use crate::light_paths::LightPaths;

/// Returns the term that a block of samples adds to each layer. `classes` are the sums of the block
/// by class of light paths. `picture` is the block's sum of all light.
pub(super) fn terms(paths: &LightPaths, classes: &[[f64; 3]], picture: [f64; 3]) -> Vec<PartSum> {
    let mut terms = vec![PartSum::default(); paths.layers().len()];
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
            let members = sums.iter().enumerate().filter(|(class, _)| paths.is_in(*class, part));
            term.0[c] = members.fold(Fixed::default(), |all, (_, sum)| all.plus(*sum));
        }
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::PartBlock;
    use crate::light_paths::PathPart;
    use crate::math::hash::{GOLDEN_GAMMA, mix};

    /// The terms of all layers add up to the block's sum exactly, for any rounding.
    #[test]
    fn terms_add_up_to_the_bit() {
        let mut parts = Vec::new();
        for name in ["emission", "direct", "indirect", "bounces:2"] {
            PathPart::add(&mut parts, PathPart::parse(name).unwrap()).unwrap();
        }
        let paths = LightPaths::new(&parts).unwrap();
        let mut state = 5u64;
        let mut roll = |n: u64| {
            state = mix(state.wrapping_add(GOLDEN_GAMMA));
            state % n
        };
        let (mut sums, mut total) = (vec![PartSum::default(); parts.len()], [0.0; 3].map(Fixed::new));
        for _ in 0..50 {
            let mut block = PartBlock::new(paths.classes());
            let mut picture = [0.0; 3];
            for _ in 0..20 {
                let classes: Vec<Spectrum> = (0..paths.classes())
                    .map(|_| Spectrum::rgb(roll(1000) as f32 / 3.0, 10f32.powi(roll(9) as i32 - 6), 0.0))
                    .collect();
                let sum = classes
                    .iter()
                    .fold(Spectrum::ZERO, |sum, class| sum + *class)
                    .to_array();
                block.add(&classes);
                for c in 0..3 {
                    picture[c] += f64::from(sum[c]) * (1.0 + 1e-7);
                }
            }
            for (sum, term) in sums.iter_mut().zip(terms(&paths, block.sums(), picture)) {
                *sum = sum.plus(term);
            }
            total = [0, 1, 2].map(|c| total[c].plus(Fixed::new(picture[c])));
        }
        for whole in [&sums[..3], &sums[3..]] {
            let sum = whole.iter().fold(PartSum::default(), |all, sum| all.plus(*sum));
            assert_eq!(sum, PartSum(total));
        }
        assert!(sums.iter().all(|sum| sum.mean(0, 1) > 0.0));
    }
}
