//! Convergence curves: relMSE against samples and against seconds, in logarithms, with the slopes of lines fitted to them.

mod plot;

pub(super) use plot::{Place, color, escaped, svg};

use super::runs::Snapshot;

/// What a curve's error is plotted against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Samples,
    Seconds,
}

impl Measure {
    /// The points of a curve: those with an error and a place in a logarithmic plot.
    pub fn points(self, snapshots: &[Snapshot]) -> Vec<[f64; 2]> {
        let x = |snapshot: &Snapshot| match self {
            Self::Samples => f64::from(snapshot.samples),
            Self::Seconds => snapshot.seconds,
        };
        let points = snapshots
            .iter()
            .filter_map(|snapshot| Some([x(snapshot), snapshot.rel_mse?]));
        points
            .filter(|point| point.iter().all(|v| *v > 0.0 && v.is_finite()))
            .collect()
    }

    /// Exponent of the power law that is fitted to a curve.
    pub fn slope(self, snapshots: &[Snapshot]) -> Option<f64> {
        slope(&self.points(snapshots))
    }

    /// Both slopes in words; `None` where there are too few points.
    pub fn in_words(snapshots: &[Snapshot]) -> Option<String> {
        let samples = Self::Samples.slope(snapshots)?;
        let points = Self::Samples.points(snapshots).len();
        let falls = match samples < 0.0 {
            true => format!("relMSE falls as N^{samples:.2}"),
            false => format!("relMSE does not fall: N^{samples:.2}"),
        };
        let seconds = Self::Seconds
            .slope(snapshots)
            .map_or(String::new(), |slope| format!(" and as t^{slope:.2}"));
        Some(format!("{falls} in samples{seconds} in seconds ({points} points)"))
    }
}

/// Points from which on a line is worth a number.
const MIN_POINTS: usize = 3;

/// Slope of the line through the logarithms of `points`, by least squares of the errors; `None` for too few points, or points of one place.
fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let count = points.len() as f64;
    let logarithms = || points.iter().map(|point| point.map(f64::ln));
    let [mean_x, mean_y] = [0, 1].map(|axis| logarithms().map(|point| point[axis]).sum::<f64>() / count);
    let covariance: f64 = logarithms().map(|[x, y]| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = logarithms().map(|[x, _]| (x - mean_x).powi(2)).sum();
    (points.len() >= MIN_POINTS && variance > 0.0).then(|| covariance / variance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_of_power_laws_are_their_exponents() {
        for exponent in [-2.0, -1.0, -0.5, 0.25] {
            let points = [1.0, 4.0, 16.0, 100.0f64].map(|x| [x, 3.0 * x.powf(exponent)]);
            assert!((slope(&points).unwrap() - exponent).abs() < 1e-12);
        }
        // Least squares by hand: ln y = (0, 0, 3) at ln x = (0, 1, 2) has the slope 1.5.
        let points = [(0.0, 0.0), (1.0, 0.0), (2.0, 3.0)].map(|(x, y): (f64, f64)| [x.exp(), y.exp()]);
        assert!((slope(&points).unwrap() - 1.5).abs() < 1e-12);
        assert_eq!(slope(&points[..2]), None);
        assert_eq!(slope(&[[2.0, 1.0], [2.0, 2.0], [2.0, 3.0]]), None);
    }
}
