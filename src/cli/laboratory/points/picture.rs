//! Picture of a point set: its projections, with errors of integrals below.

use super::convergence::{Convergence, SEEDS, fitted};
use super::projections::{PointDomain, Projection};
use crate::cli::plot::{LogLog, PLOT_SIZE, SvgTarget, color, escaped, mark, svg_head};
use std::fmt::Write;

/// Number of projections in a row, and size of a projection with its margins.
const COLUMNS: usize = 4;
const PANEL: [f64; 2] = [225.0, 250.0];
/// Side of a projection, and its position in its panel.
const SIDE: f64 = 195.0;
const LEFT: f64 = 15.0;
const TOP: f64 = 30.0;
/// Height of the title, and height of a line of a legend.
const TITLE: f64 = 40.0;
const LINE: f64 = 18.0;

/// SVG text of the picture.
pub(super) fn svg(
    (name, count): (&str, u32),
    independent: [f64; 2],
    shown: &[Projection],
    measured: &[Convergence],
) -> String {
    let lines = measured
        .iter()
        .map(|convergence| convergence.curves.len() + 1)
        .max()
        .unwrap_or(0);
    let plot = [PLOT_SIZE[0], PLOT_SIZE[1] + LINE * lines as f64 + 10.0];
    let plots_top = TITLE + PANEL[1] * shown.len().div_ceil(COLUMNS) as f64 + 20.0;
    let height = plots_top + plot[1] * measured.len().div_ceil(2) as f64;
    let title = format!("{name}: {count} points, discrepancy and convergence");
    let mut text = svg_head([2.0 * PLOT_SIZE[0], height], &title, SvgTarget::File);
    let _ = writeln!(
        text,
        "<text x=\"{LEFT}\" y=\"22\" font-size=\"16\" font-weight=\"bold\">{}, {count} points</text>",
        escaped(name)
    );
    for (i, projection) in shown.iter().enumerate() {
        let [column, row] = [i % COLUMNS, i / COLUMNS].map(|v| v as f64);
        draw(
            &mut text,
            projection,
            independent,
            [PANEL[0] * column, TITLE + PANEL[1] * row],
        );
    }
    for (i, convergence) in measured.iter().enumerate() {
        let shift = [plot[0] * (i % 2) as f64, plots_top + plot[1] * (i / 2) as f64];
        draw_convergence(&mut text, convergence, shift);
    }
    text + "</svg>\n"
}

/// Draws a projection with its frame, names and discrepancy.
fn draw(text: &mut String, projection: &Projection, [star, cap]: [f64; 2], [x, y]: [f64; 2]) {
    let _ = writeln!(text, "<g transform=\"translate({} {y})\" font-size=\"11\">", x + LEFT);
    let _ = writeln!(text, "<text y=\"{}\">{}</text>", TOP - 6.0, escaped(&projection.name));
    let (half, bottom) = (0.5 * SIDE, TOP + SIDE);
    let frame = match projection.shape {
        PointDomain::Square => format!("<rect y=\"{TOP}\" width=\"{SIDE}\" height=\"{SIDE}\""),
        PointDomain::Disk => format!("<circle cx=\"{half}\" cy=\"{}\" r=\"{half}\"", TOP + half),
    };
    let _ = writeln!(
        text,
        "{frame} fill=\"none\" stroke=\"currentColor\" stroke-opacity=\"0.4\"/>"
    );
    let place = |p: &crate::math::Vec2| {
        let [u, v] = match projection.shape {
            PointDomain::Square => [p.x, p.y],
            PointDomain::Disk => [0.5 * (p.x + 1.0), 0.5 * (p.y + 1.0)],
        };
        [f64::from(u) * SIDE, bottom - f64::from(v) * SIDE]
    };
    // Draw all dots as one path with round caps. The radius leaves gaps between dots.
    let radius = (0.3 * SIDE / (projection.points.len().max(1) as f64).sqrt()).clamp(0.4, 2.5);
    let dots: String = projection
        .points
        .iter()
        .map(|p| format!("M{:.1} {:.1}h0", place(p)[0], place(p)[1]))
        .collect();
    let _ = writeln!(
        text,
        "<path d=\"{dots}\" stroke=\"{}\" stroke-width=\"{:.2}\" stroke-linecap=\"round\" fill=\"none\"/>",
        color(1),
        2.0 * radius
    );
    if let Some(discrepancy) = projection.discrepancy {
        let (words, independent) = match projection.shape {
            PointDomain::Square => ("star discrepancy", star),
            PointDomain::Disk => ("cap discrepancy", cap),
        };
        let _ = writeln!(
            text,
            "<text y=\"{}\">{words} {discrepancy:.4} (random {independent:.4})</text>",
            bottom + 14.0
        );
    }
    *text += "</g>\n";
}

/// Draws the errors of an integral with a legend. The error of independent samples is a dashed
/// line.
fn draw_convergence(text: &mut String, convergence: &Convergence, [x, y]: [f64; 2]) {
    let integral = &convergence.integral;
    let positive = |curve: &[[f64; 2]]| curve.iter().copied().filter(|point| point[1] > 0.0).collect::<Vec<_>>();
    let curves: Vec<_> = convergence.curves.iter().map(|(_, curve)| positive(curve)).collect();
    let numbers = convergence.curves.first().map_or(&[][..], |(_, curve)| curve);
    let random = numbers
        .iter()
        .map(|[n, _]| [*n, (integral.variance / n).sqrt()])
        .collect();
    let plot = LogLog {
        title: &format!("{}: {}", integral.name, integral.formula),
        name: "samples",
        curves: &curves,
        guides: &[random],
    };
    plot.draw(text, [x, y]);
    let legend = |i: usize| y + PLOT_SIZE[1] + 12.0 + LINE * i as f64;
    for (i, (name, curve)) in convergence.curves.iter().enumerate() {
        let falls = fitted(curve).map_or(String::new(), |slope| format!(": falls as N^{slope:.2}"));
        mark(text, i, x + 72.0, legend(i) - 4.0);
        let _ = writeln!(
            text,
            "<text x=\"{}\" y=\"{}\">{}{falls}</text>",
            x + 86.0,
            legend(i),
            escaped(name)
        );
    }
    let _ = writeln!(
        text,
        "<text x=\"{}\" y=\"{}\" fill-opacity=\"0.7\">dashed: independent samples, N^−0.5; {SEEDS} seeds</text>",
        x + 66.0,
        legend(convergence.curves.len())
    );
}
