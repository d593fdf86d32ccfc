/// A discrete distribution that is sampled in constant time with Walker's alias method (Walker
/// 1977; built as in Vose 1991).
#[derive(Clone, Debug)]
pub struct AliasTable {
    bins: Vec<Bin>,
}

#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Probability of the bin's index.
    pmf: f32,
    /// Fraction of the bin that belongs to the bin's index. The rest of the bin belongs to `alias`.
    threshold: f32,
    alias: u32,
}

impl AliasTable {
    /// A distribution with probabilities proportional to `weights`, which are finite and ≥ 0.
    ///
    /// `None` if there are no weights, or if all weights are zero.
    pub fn new(weights: &[f64]) -> Option<Self> {
        let sum: f64 = weights.iter().sum();
        if !(sum > 0.0 && sum.is_finite()) {
            return None;
        }
        let n = weights.len();
        let mut bins: Vec<Bin> = weights
            .iter()
            .map(|w| Bin {
                pmf: (w / sum) as f32,
                threshold: 1.0,
                alias: 0,
            })
            .collect();

        // Combine each bin that is not full with a bin that is over-full, until the weight of every
        // bin is 1/n.
        let mut fill: Vec<f64> = weights.iter().map(|w| w / sum * n as f64).collect();
        let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| fill[i] < 1.0);
        while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
            small.pop();
            bins[s].threshold = fill[s] as f32;
            bins[s].alias = l as u32;
            fill[l] -= 1.0 - fill[s];
            if fill[l] < 1.0 {
                large.pop();
                small.push(l);
            }
        }
        // The remaining bins differ from full bins by rounding only. An index with probability zero
        // must never be drawn, so remaining bins of zero weight get an alias with a positive
        // weight.
        let some = weights.iter().position(|&w| w > 0.0)?;
        for i in small.into_iter().chain(large) {
            if weights[i] == 0.0 {
                bins[i].threshold = 0.0;
                bins[i].alias = some as u32;
            }
        }
        Some(Self { bins })
    }

    /// Draws an index with `u` in [0, 1) and returns it with its probability.
    // ANCHOR: sample
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let scaled = u * self.bins.len() as f32;
        let i = (scaled as usize).min(self.bins.len() - 1);
        let bin = self.bins[i];
        let index = if scaled - (i as f32) < bin.threshold {
            i
        } else {
            bin.alias as usize
        };
        (index, self.bins[index].pmf)
    }
    // ANCHOR_END: sample

    /// Probability of `index`.
    pub fn pmf(&self, index: usize) -> f32 {
        self.bins[index].pmf
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frequencies_are_the_probabilities() {
        let weights = [3.0, 0.0, 1.0, 0.5, 5.5, 0.0];
        let table = AliasTable::new(&weights).unwrap();
        let n = 1_000_000;
        let mut counts = [0u32; 6];
        for k in 0..n {
            let (i, pmf) = table.sample((k as f32 + 0.5) / n as f32);
            assert_eq!(pmf, table.pmf(i));
            counts[i] += 1;
        }
        for (i, w) in weights.iter().enumerate() {
            let expected = w / 10.0;
            assert!((table.pmf(i) as f64 - expected).abs() < 1e-7);
            // `u` runs over a regular grid, so the counts are exact up to the spacing of f32
            // values.
            assert!((counts[i] as f64 / n as f64 - expected).abs() < 1e-5, "{i}");
        }
    }

    #[test]
    fn no_positive_weight_is_none() {
        assert!(AliasTable::new(&[]).is_none());
        assert!(AliasTable::new(&[0.0, 0.0]).is_none());
        assert_eq!(AliasTable::new(&[0.0, 2.0]).unwrap().sample(0.1), (1, 1.0));
    }
}
