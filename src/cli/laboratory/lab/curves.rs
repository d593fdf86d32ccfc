//! Convergence curves: relMSE over samples and over seconds on logarithmic axes, with the slopes of
//! fitted lines.

use super::Comparison;
use super::runs::Snapshot;
use crate::cli::plot::{LogLog, PLOT_SIZE, SvgTarget, escaped, mark, slope, svg_head};
use std::fmt::Write;

/// Horizontal axis of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    Samples,
    Seconds,
}

impl Measure {
    /// Points of a curve with a known error and positive coordinates.
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

    /// Exponent of the power law fitted to a curve.
    pub fn slope(self, snapshots: &[Snapshot]) -> Option<f64> {
        slope(&self.points(snapshots))
    }

    /// Text with the slopes; `None` with too few points.
    pub fn in_words(snapshots: &[Snapshot]) -> Option<String> {
        let samples = Self::Samples.slope(snapshots)?;
        let points = Self::Samples.points(snapshots).len();
        let falls = if samples < 0.0 {
            format!("relMSE falls as N^{samples:.2}")
        } else {
            format!("relMSE does not fall: N^{samples:.2}")
        };
        let seconds = Self::Seconds
            .slope(snapshots)
            .map_or(String::new(), |slope| format!(" and as t^{slope:.2}"));
        Some(format!("{falls} in samples{seconds} in seconds ({points} points)"))
    }
}

/// Position of the legend, and height of its lines.
const LEGEND: [f64; 2] = [72.0, 366.0];
const LINE: f64 = 20.0;

/// Picture of the curves of all estimators: two plots side by side, and a legend below.
pub(super) fn svg(comparison: &Comparison, place: SvgTarget) -> String {
    let rows = comparison.rendered().count();
    let size = [2.0 * PLOT_SIZE[0], LEGEND[1] + LINE * rows as f64];
    let mut text = svg_head(size, "Convergence: relMSE against samples and against seconds", place);
    for (measure, name, title, shift) in [
        (Measure::Samples, "samples", "relMSE against samples per pixel", 0.0),
        (Measure::Seconds, "seconds", "relMSE against seconds", PLOT_SIZE[0]),
    ] {
        let curve = |(_, run): (_, &super::ContenderRun)| measure.points(&run.snapshots);
        let curves: Vec<_> = comparison.rendered().map(curve).collect();
        let plot = LogLog {
            title,
            name,
            curves: &curves,
            guides: &[],
        };
        plot.draw(&mut text, [shift, 0.0]);
    }
    for (row, (contender, run)) in comparison.rendered().enumerate() {
        let y = LEGEND[1] + LINE * row as f64;
        let words = Measure::in_words(&run.snapshots).map_or(String::new(), |words| format!(": {words}"));
        let label = escaped(&format!("{}{words}", contender.name));
        mark(&mut text, row, LEGEND[0], y - 4.0);
        let _ = writeln!(text, "<text x=\"{}\" y=\"{y}\">{label}</text>", LEGEND[0] + 14.0);
    }
    text + "</svg>\n"
}
