//! Lines of drawings: their colour in PNG files, their width, and the edges that they show.

use super::background::color_text;
use crate::color::Spectrum;
use crate::film::LineStyle;
use crate::parameter::{Range, Value, parameters};
use serde_json::json;

parameters! {
    /// Lines along edges, as in a drawing.
    pub struct LineOptions, heading "", values line_values {
        /// Draw edges and silhouettes over PNG files, in this colour
        ///
        /// The lines are the edges of objects, parts and materials, creases and silhouettes. They
        /// are also the channel `lines` of EXR files, as with `--aov lines`.
        lines: DrawnLines, default "off";
        /// Width of lines in pixels
        lines_width: f32 = 1.5, in Range::FromTo(0.1, 64.0);
        /// Minimum angle in degrees between two faces for a line on their edge
        lines_angle: f32 = 30.0, in Range::FromTo(1.0, 180.0);
    }
}

impl LineOptions {
    /// Style of the lines.
    pub fn style(&self) -> LineStyle {
        LineStyle {
            width: self.lines_width(),
            angle: self.lines_angle(),
        }
    }

    /// Colour of the lines that are drawn over PNG files.
    pub fn color(&self) -> Option<LineColor> {
        self.lines.and_then(|lines| lines.0)
    }
}

/// Colour of the lines that are drawn over PNG files. `None` means no lines. A flag with this value
/// switches off the lines of a scene file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnLines(pub Option<LineColor>);

impl Value for DrawnLines {
    const PLACEHOLDER: &'static str = LineColor::PLACEHOLDER;
    const KIND: &'static str =
        "off, or a colour: #ffc356 (sRGB), a CSS name such as orange, or linear numbers: 0.5 or 0.2,0.3,0.4";
    const IS_STRING: bool = true;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        if text.trim() == "off" {
            return Some(Self(None));
        }
        LineColor::of_text(text).map(|color| Self(Some(color)))
    }

    fn text(&self) -> String {
        self.0.map_or("off".into(), |color| color.text())
    }

    /// The schema of a colour: its names of colours include `off`.
    fn schema() -> serde_json::Value {
        LineColor::schema()
    }

    /// Returns true if the colour is valid: finite and not negative.
    fn is_finite(&self) -> bool {
        self.0.is_none_or(|color| color.is_finite())
    }
}

/// Colour of lines: a linear radiance that a display shows without a tone curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineColor(pub Spectrum);

impl Value for LineColor {
    const PLACEHOLDER: &'static str = "COLOUR";
    const KIND: &'static str =
        "a colour: #ffc356 (sRGB), a CSS name such as orange, or linear numbers: 0.5 or 0.2,0.3,0.4";
    const IS_STRING: bool = true;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        Spectrum::of_text(text.trim()).map(Self)
    }

    fn text(&self) -> String {
        color_text(self.0)
    }

    fn schema() -> serde_json::Value {
        let channel = json!({ "type": "number", "minimum": 0 });
        json!({ "anyOf": [
            { "type": "string", "pattern": "^(#([0-9A-Fa-f]{3}){1,2}|[A-Za-z]+|[0-9.eE+ -]+(,[0-9.eE+ -]+){2})$" },
            channel,
            { "type": "array", "items": channel, "minItems": 3, "maxItems": 3 },
            { "type": "array", "items": channel, "minItems": 1, "maxItems": 1 },
        ] })
    }

    /// Returns true if the colour is valid: finite and not negative.
    fn is_finite(&self) -> bool {
        self.0.is_valid()
    }
}
