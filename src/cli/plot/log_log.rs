//! A plot with logarithmic axes, and the fitted slope of a curve.

use super::{color, mark, points};
use std::fmt::Write;

/// Width and height of a plot with its margins.
pub(in crate::cli) const PLOT_SIZE: [f64; 2] = [450.0, 350.0];
/// Ends of the axes of a plot, within [`PLOT_SIZE`].
const LEFT: f64 = 64.0;
const RIGHT: f64 = 434.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 300.0;

/// A plot with logarithmic axes. All values are above 0.
pub(in crate::cli) struct LogLog<'a> {
    /// Text above the plot.
    pub title: &'a str,
    /// Name of the horizontal axis.
    pub name: &'a str,
    /// Points of each curve.
    pub curves: &'a [Vec<[f64; 2]>],
    /// Dashed reference lines.
    pub guides: &'a [Vec<[f64; 2]>],
}

impl LogLog<'_> {
    /// Draws the plot with the offset `shift` to the right and down.
    pub fn draw(&self, text: &mut String, shift: [f64; 2]) {
        let values = |axis: usize| {
            self.curves
                .iter()
                .chain(self.guides)
                .flatten()
                .map(move |point| point[axis])
        };
        let x = Axis::over(values(0), LEFT, RIGHT);
        let y = Axis::over(values(1), BOTTOM, TOP);
        let (name, title) = (self.name, self.title);
        // Write the axis range for scripts that locate a value on the horizontal axis
        let _ = writeln!(
            text,
            "<g class=\"plot\" data-measure=\"{name}\" data-from=\"{}\" data-to=\"{}\" data-start=\"{LEFT}\" data-end=\"{RIGHT}\" transform=\"translate({} {})\">",
            x.from, x.to, shift[0], shift[1]
        );
        let _ = writeln!(text, "<text x=\"{LEFT}\" y=\"16\" font-weight=\"bold\">{title}</text>");
        let grid = "stroke=\"currentColor\" stroke-opacity=\"0.2\"";
        for exponent in x.ticks() {
            let at = x.place(10f64.powi(exponent));
            let _ = writeln!(text, "<path d=\"M{at:.1} {TOP}V{BOTTOM}\" {grid}/>");
            let label = power_of_ten(exponent);
            let _ = writeln!(
                text,
                "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{label}</text>",
                BOTTOM + 18.0
            );
        }
        for exponent in y.ticks() {
            let at = y.place(10f64.powi(exponent));
            let _ = writeln!(text, "<path d=\"M{LEFT} {at:.1}H{RIGHT}\" {grid}/>");
            let label = power_of_ten(exponent);
            let _ = writeln!(
                text,
                "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                LEFT - 6.0,
                at + 4.0
            );
        }
        let middle = 0.5 * (LEFT + RIGHT);
        let _ = writeln!(
            text,
            "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{name}</text>",
            BOTTOM + 38.0
        );
        let places = |curve: &[[f64; 2]]| -> Vec<[f64; 2]> {
            let place = |point: &[f64; 2]| [x.place(point[0]), y.place(point[1])];
            curve.iter().map(place).collect()
        };
        for guide in self.guides {
            let line = points(places(guide));
            let _ = writeln!(
                text,
                "<polyline points=\"{line}\" fill=\"none\" stroke=\"currentColor\" stroke-dasharray=\"4 3\"/>"
            );
        }
        for (index, curve) in self.curves.iter().enumerate() {
            let places = places(curve);
            let _ = writeln!(
                text,
                "<g class=\"curve\" data-index=\"{index}\"><polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>",
                points(places.iter().copied()),
                color(index)
            );
            places.iter().for_each(|[x, y]| mark(text, index, *x, *y));
            *text += "</g>\n";
        }
        *text +=
            "<path class=\"cursor\" d=\"\" fill=\"none\" stroke=\"currentColor\" stroke-dasharray=\"4 3\"/>\n</g>\n";
    }
}

/// A logarithmic axis between two powers of ten.
struct Axis {
    /// Powers of ten (exponents) at the ends of the axis.
    from: f64,
    to: f64,
    /// Coordinates of the ends of the axis in the picture.
    start: f64,
    end: f64,
}

impl Axis {
    /// An axis that contains all `values`.
    fn over(values: impl Iterator<Item = f64> + Clone, start: f64, end: f64) -> Self {
        let exponents = values.map(f64::log10);
        let from = exponents.clone().fold(f64::INFINITY, f64::min).floor();
        let to = exponents.fold(f64::NEG_INFINITY, f64::max).ceil();
        let (from, to) = if from.is_finite() {
            (from, to.max(from + 1.0))
        } else {
            (0.0, 1.0)
        };
        Self { from, to, start, end }
    }

    fn place(&self, value: f64) -> f64 {
        let share = (value.log10() - self.from) / (self.to - self.from);
        self.start + share * (self.end - self.start)
    }

    /// Exponents of the powers of ten that get a grid line. There are at most ten.
    fn ticks(&self) -> Vec<i32> {
        let (from, to) = (self.from as i32, self.to as i32);
        let step = ((to - from) / 8 + 1) as usize;
        (from..=to).step_by(step).collect()
    }
}

/// Text of a power of ten.
fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0..=5 => format!("{}", 10i64.pow(exponent as u32)),
        -3..=-1 => format!("{:.*}", -exponent as usize, 10f64.powi(exponent)),
        _ => format!("1e{exponent}"),
    }
}

/// Minimum number of points for a slope.
const MIN_POINTS: usize = 3;

/// Slope of the least-squares line through the logarithms of `points`. `None` for too few points,
/// or for points with equal x.
pub(in crate::cli) fn slope(points: &[[f64; 2]]) -> Option<f64> {
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

    #[test]
    fn axes_hold_their_values() {
        let axis = Axis::over([0.02, 3.0, 900.0].into_iter(), 10.0, 110.0);
        assert_eq!((axis.from, axis.to), (-2.0, 3.0));
        assert_eq!([0.01, 1000.0].map(|value| axis.place(value)), [10.0, 110.0]);
        assert_eq!(axis.ticks(), [-2, -1, 0, 1, 2, 3]);
        // A single value, or no value, gives an axis of one decade.
        let one = Axis::over([1.0].into_iter(), 0.0, 1.0);
        assert_eq!((one.from, one.to, one.place(1.0)), (0.0, 1.0, 0.0));
        assert_eq!(Axis::over(std::iter::empty(), 0.0, 1.0).to, 1.0);
        assert!(Axis::over([1e-30, 1e30].into_iter(), 0.0, 1.0).ticks().len() <= 10);
    }

    #[test]
    fn powers_of_ten_can_be_read() {
        assert_eq!(
            [-4, -2, 0, 3, 6].map(power_of_ten),
            ["1e-4", "0.01", "1", "1000", "1e6"]
        );
    }
}
