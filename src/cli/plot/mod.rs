//! SVG pictures of commands: colours, marks, text, and plots with logarithmic axes (`log_log`).
//! Also dot graphics in a terminal (`braille`).
//!
//! Text and axes have the colour of the surrounding text, so that a picture fits light and dark
//! pages. A picture in a file has its own styles for light and dark pages.

mod braille;
mod log_log;

pub(super) use braille::Braille;
pub(super) use log_log::{LogLog, PLOT_SIZE, slope};

use std::fmt::Write;

/// Colours of curves in order. They also differ in lightness, and have contrast on white and on
/// black.
const COLORS: [&str; 8] = [
    "#d1495b", "#2e86c1", "#e08e0b", "#3a9d5d", "#9b59b6", "#8d6e63", "#12a5a5", "#c2559d",
];

/// The colour of a curve.
pub(super) fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

/// Location of an SVG picture: a file, or a page that contains the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SvgTarget {
    /// The picture is a separate file.
    File,
    /// The picture is part of a page, and has the style of the page.
    Page,
}

const STYLE: &str = "<style>.curves{color:#222;background:#fff}@media (prefers-color-scheme:dark){.curves{color:#ddd;background:#16161a}}</style>";

/// Beginning of an SVG picture of `width` × `height` units. `label` describes the picture for
/// screen readers. The caller ends the picture with `</svg>`.
pub(super) fn svg_head([width, height]: [f64; 2], label: &str, place: SvgTarget) -> String {
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"curves\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"currentColor\" role=\"img\" aria-label=\"{}\">\n",
        escaped(label)
    );
    if place == SvgTarget::File {
        text += STYLE;
        text += "\n";
    }
    text
}

/// Text escaped for XML.
pub(super) fn escaped(text: &str) -> String {
    let controls = |c: char| if c.is_control() { ' ' } else { c };
    let text: String = text.chars().map(controls).collect();
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// Draws a mark of the curve `index` at `x`, `y`. The marks of curves differ in shape and colour.
pub(super) fn mark(text: &mut String, index: usize, x: f64, y: f64) {
    let color = color(index);
    let shape = match index % 4 {
        0 => format!("M{:.2} {y:.2}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", x - 4.0),
        1 => format!("M{:.2} {:.2}h7v7h-7z", x - 3.5, y - 3.5),
        2 => format!("M{x:.2} {:.2}l4.5 8h-9z", y - 5.0),
        _ => format!("M{x:.2} {:.2}l5 5l-5 5l-5 -5z", y - 5.0),
    };
    let _ = writeln!(text, "<path d=\"{shape}\" fill=\"{color}\"/>");
}

/// Points as an SVG list.
pub(super) fn points(places: impl IntoIterator<Item = [f64; 2]>) -> String {
    let places: Vec<String> = places.into_iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    places.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_text() {
        assert_eq!(escaped("a<b>&\"\u{1}"), "a&lt;b&gt;&amp;&quot; ");
    }
}
