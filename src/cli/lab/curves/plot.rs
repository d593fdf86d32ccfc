//! The curves as an SVG picture: two plots with logarithmic axes side by side, and a legend below.
//!
//! Text and axes have the colour of the surrounding text, so that the picture is at home in light and dark pages; as a file it brings both colours.

use super::Measure;
use crate::cli::lab::Comparison;
use std::fmt::Write;

/// Where a picture of curves is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::cli::lab) enum Place {
    /// In a file of its own.
    File,
    /// In a page, whose style it has.
    Page,
}

/// Width of the picture, and of a plot with its margins.
const WIDTH: f64 = 900.0;
const PLOT_WIDTH: f64 = 450.0;
/// Axes of a plot, within its width.
const LEFT: f64 = 64.0;
const RIGHT: f64 = 434.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 300.0;
/// Where the legend begins, and the height of a line of it.
const LEGEND: f64 = 366.0;
const LINE: f64 = 20.0;

/// Colours of the curves, in turn. They differ in lightness too, and stand out on white and on black.
const COLORS: [&str; 8] = [
    "#d1495b", "#2e86c1", "#e08e0b", "#3a9d5d", "#9b59b6", "#8d6e63", "#12a5a5", "#c2559d",
];

/// The colour of a curve.
pub(in crate::cli::lab) fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

const STYLE: &str = "<style>.curves{color:#222;background:#fff}@media (prefers-color-scheme:dark){.curves{color:#ddd;background:#16161a}}</style>";

/// A logarithmic axis between two powers of ten.
struct Axis {
    /// Exponents of its ends.
    from: f64,
    to: f64,
    /// Where the ends are in the picture.
    start: f64,
    end: f64,
}

impl Axis {
    /// One that has room for all `values`.
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

    /// Powers of ten on it, ten at most.
    fn ticks(&self) -> Vec<i32> {
        let (from, to) = (self.from as i32, self.to as i32);
        let step = ((to - from) / 8 + 1) as usize;
        (from..=to).step_by(step).collect()
    }
}

/// A power of ten as people write it.
fn power_of_ten(exponent: i32) -> String {
    match exponent {
        0..=5 => format!("{}", 10i64.pow(exponent as u32)),
        -3..=-1 => format!("{:.*}", -exponent as usize, 10f64.powi(exponent)),
        _ => format!("1e{exponent}"),
    }
}

/// Text within XML.
pub(in crate::cli::lab) fn escaped(text: &str) -> String {
    let controls = |c: char| if c.is_control() { ' ' } else { c };
    let text: String = text.chars().map(controls).collect();
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// The curves of all estimators.
pub(in crate::cli::lab) fn svg(comparison: &Comparison, place: Place) -> String {
    let rows = comparison.rendered().count();
    let height = LEGEND + LINE * rows as f64;
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"curves\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"currentColor\" role=\"img\" aria-label=\"Convergence: relMSE against samples and against seconds\">\n"
    );
    if place == Place::File {
        text += STYLE;
        text += "\n";
    }
    plot(&mut text, comparison, Measure::Samples, 0.0);
    plot(&mut text, comparison, Measure::Seconds, PLOT_WIDTH);
    for (row, (contender, run)) in comparison.rendered().enumerate() {
        let y = LEGEND + LINE * row as f64;
        let words = Measure::in_words(&run.snapshots).map_or(String::new(), |words| format!(": {words}"));
        let label = escaped(&format!("{}{words}", contender.name));
        mark(&mut text, row, LEFT + 8.0, y - 4.0);
        let _ = writeln!(text, "<text x=\"{}\" y=\"{y}\">{label}</text>", LEFT + 22.0);
    }
    text + "</svg>\n"
}

/// A plot with its axes, `shift` to the right.
fn plot(text: &mut String, comparison: &Comparison, measure: Measure, shift: f64) {
    let curves: Vec<Vec<[f64; 2]>> = comparison
        .rendered()
        .map(|(_, run)| measure.points(&run.snapshots))
        .collect();
    let values = |axis: usize| curves.iter().flatten().map(move |point| point[axis]);
    let x = Axis::over(values(0), LEFT, RIGHT);
    let y = Axis::over(values(1), BOTTOM, TOP);
    let (name, title) = match measure {
        Measure::Samples => ("samples", "relMSE against samples a pixel"),
        Measure::Seconds => ("seconds", "relMSE against seconds"),
    };
    // What a script needs to find a place on the horizontal axis
    let _ = writeln!(
        text,
        "<g class=\"plot\" data-measure=\"{name}\" data-from=\"{}\" data-to=\"{}\" data-start=\"{LEFT}\" data-end=\"{RIGHT}\" transform=\"translate({shift} 0)\">",
        x.from, x.to
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
    for (index, curve) in curves.iter().enumerate() {
        let places: Vec<[f64; 2]> = curve
            .iter()
            .map(|point| [x.place(point[0]), y.place(point[1])])
            .collect();
        let line: Vec<String> = places.iter().map(|[x, y]| format!("{x:.2},{y:.2}")).collect();
        let _ = writeln!(
            text,
            "<g class=\"curve\" data-index=\"{index}\"><polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>",
            line.join(" "),
            color(index)
        );
        places.iter().for_each(|[x, y]| mark(text, index, *x, *y));
        *text += "</g>\n";
    }
    *text += "<path class=\"cursor\" d=\"\" fill=\"none\" stroke=\"currentColor\" stroke-dasharray=\"4 3\"/>\n</g>\n";
}

/// The mark of a curve: its shape tells curves apart as its colour does.
fn mark(text: &mut String, index: usize, x: f64, y: f64) {
    let color = color(index);
    let shape = match index % 4 {
        0 => format!("M{:.2} {y:.2}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x - 4.0),
        1 => format!("M{:.2} {:.2}h7v7h-7z", x - 3.5, y - 3.5),
        2 => format!("M{x:.2} {:.2}l4.5 8h-9z", y - 5.0),
        _ => format!("M{x:.2} {:.2}l5 5l-5 5l-5 -5z", y - 5.0),
    };
    let _ = writeln!(text, "<path d=\"{shape}\" fill=\"{color}\"/>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_values() {
        let axis = Axis::over([0.02, 3.0, 900.0].into_iter(), 10.0, 110.0);
        assert_eq!((axis.from, axis.to), (-2.0, 3.0));
        assert_eq!([0.01, 1000.0].map(|value| axis.place(value)), [10.0, 110.0]);
        assert_eq!(axis.ticks(), [-2, -1, 0, 1, 2, 3]);
        // A single value has a decade of its own, and none at all has one too.
        let one = Axis::over([1.0].into_iter(), 0.0, 1.0);
        assert_eq!((one.from, one.to, one.place(1.0)), (0.0, 1.0, 0.0));
        assert_eq!(Axis::over(std::iter::empty(), 0.0, 1.0).to, 1.0);
        assert!(Axis::over([1e-30, 1e30].into_iter(), 0.0, 1.0).ticks().len() <= 10);
    }

    #[test]
    fn numbers_and_names_can_be_read() {
        assert_eq!(
            [-4, -2, 0, 3, 6].map(power_of_ten),
            ["1e-4", "0.01", "1", "1000", "1e6"]
        );
        assert_eq!(escaped("a<b>&\"\u{1}"), "a&lt;b&gt;&amp;&quot; ");
    }
}
