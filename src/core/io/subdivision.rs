//! Number of subdivision steps, given directly or by the maximum edge length in pixels.

use crate::geometry::MAX_STEPS;
use crate::parameter::Value;
use serde_json::json;

/// Prefix of the text of [`Subdivision::Pixels`], before the edge length in pixels.
const PIXELS: &str = "pixels:";

/// Number of subdivision steps of an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Subdivision {
    /// The given number of steps, at most [`MAX_STEPS`].
    Steps(u32),
    /// The smallest number of steps after which no edge is longer than this number of pixels, as
    /// seen from the camera. A reader without a camera makes no steps.
    Pixels(f32),
}

impl Subdivision {
    /// Number of steps. 0 if the number depends on the camera.
    pub fn steps(self) -> u32 {
        match self {
            Self::Steps(steps) => steps,
            Self::Pixels(_) => 0,
        }
    }

    /// Maximum length of an edge in pixels, if the number of steps depends on the camera.
    pub fn pixels(self) -> Option<f32> {
        match self {
            Self::Steps(_) => None,
            Self::Pixels(pixels) => Some(pixels),
        }
    }
}

impl Value for Subdivision {
    const PLACEHOLDER: &'static str = "N";
    const KIND: &'static str =
        "a number of steps from 0 to 12, or pixels:W for edges of at most W pixels, above 0, such as pixels:1.5";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        let value = match text.strip_prefix(PIXELS) {
            Some(pixels) => Self::Pixels(pixels.trim().parse().ok()?),
            None => Self::Steps(text.parse().ok()?),
        };
        value.is_finite().then_some(value)
    }

    fn text(&self) -> String {
        match self {
            Self::Steps(steps) => steps.to_string(),
            Self::Pixels(pixels) => format!("{PIXELS}{pixels}"),
        }
    }

    fn schema() -> serde_json::Value {
        json!({ "anyOf": [
            { "type": "integer", "minimum": 0, "maximum": MAX_STEPS },
            { "type": "string", "pattern": "^pixels: *[0-9.][0-9.eE+-]*$" },
        ] })
    }

    /// Returns true if the number of steps is in its range, or the number of pixels is positive and
    /// finite.
    fn is_finite(&self) -> bool {
        match *self {
            Self::Steps(steps) => steps <= MAX_STEPS,
            Self::Pixels(pixels) => pixels > 0.0 && pixels.is_finite(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_of_parsed_value_is_unchanged() {
        for text in ["0", "12", "pixels:1.5", "pixels:0.25", "pixels:100"] {
            assert_eq!(
                Subdivision::of_text(text).map(|value| value.text()).as_deref(),
                Some(text)
            );
        }
        let wrong = [
            "",
            "13",
            "-1",
            "1.5",
            "pixels",
            "pixels:",
            "pixels:0",
            "pixels:-1",
            "pixels:nan",
            "pixels:inf",
            "pixels:x",
        ];
        for text in wrong {
            assert_eq!(Subdivision::of_text(text), None, "{text}");
        }
        assert!(Subdivision::KIND.contains(&format!("from 0 to {MAX_STEPS}")));
    }
}
