//! Pictures to scale: the scale on paper, and the resolution of the paper.

use crate::math::{Encode, encode_fields};
use crate::parameter::{Range, Value, parameters};
use serde_json::json;

/// Length of an inch in metres.
const INCH: f64 = 0.0254;

parameters! {
    /// Scale of the image on paper.
    pub struct PrintOptions, heading "", values print {
        /// Scale of an orthographic picture on paper, such as 1:50
        ///
        /// It sets the image size: from the bounding box of the scene with `elevation` or `--plan`,
        /// or from `ortho_height`. Without these, it sets the height of the view from the image
        /// size. The unit is `unit`, or that of the OBJ file's comments, or else a metre.
        scale: DrawingScale, default "off";
        /// Pixels per inch of a picture to scale
        dpi: f32 = 300.0, in Range::FromTo(1.0, 100_000.0);
    }
}

/// Ratio of a length on paper to a length in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawingScale([f64; 2]);

impl DrawingScale {
    /// Maximum of each of the two numbers of a scale.
    const MAX: f64 = 1e6;

    /// Ratio of a length on paper to the same length in the scene.
    pub fn ratio(self) -> f64 {
        let [paper, scene] = self.0;
        paper / scene
    }
}

impl Value for DrawingScale {
    const PLACEHOLDER: &'static str = "RATIO";
    const KIND: &'static str = "two numbers above 0 with a colon, as in 1:50";
    const IS_STRING: bool = true;
    const IS_NUMBER: bool = false;

    fn of_text(text: &str) -> Option<Self> {
        let (paper, scene) = text.split_once(':')?;
        let number = |text: &str| {
            let number: f64 = text.trim().parse().ok()?;
            (number > 0.0 && number <= Self::MAX).then_some(number)
        };
        Some(Self([number(paper)?, number(scene)?]))
    }

    fn text(&self) -> String {
        let [paper, scene] = self.0;
        format!("{paper}:{scene}")
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "string", "pattern": "^ *[0-9]*\\.?[0-9]+ *: *[0-9]*\\.?[0-9]+ *$" })
    }
}

/// Scale and resolution of a picture on paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Print {
    /// Scale on paper.
    pub scale: DrawingScale,
    /// Resolution in pixels per inch.
    pub dpi: f32,
}

encode_fields!(Print { scale, dpi });

impl Encode for DrawingScale {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.0.encode(sink);
    }
}

impl Print {
    /// Scale and resolution according to `options`; `None` if no scale is set.
    pub fn of(options: &PrintOptions) -> Option<Self> {
        options.scale.map(|scale| Self {
            scale,
            dpi: options.dpi(),
        })
    }

    /// Number of pixels per metre in the scene.
    pub fn pixels_per_metre(self) -> f64 {
        f64::from(self.dpi) / INCH * self.scale.ratio()
    }

    /// Number of pixels per metre of paper, as PNG files store it.
    pub fn pixels_per_metre_of_paper(self) -> u32 {
        (f64::from(self.dpi) / INCH).round() as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_two_numbers() {
        let scale = DrawingScale::of_text("1:50").unwrap();
        assert_eq!((scale.ratio(), scale.text().as_str()), (0.02, "1:50"));
        assert_eq!(DrawingScale::of_text("2 : 1").unwrap().ratio(), 2.0);
        for text in ["50", "1:0", "1:", ":5", "-1:50", "1:nan", "1:inf", "1:2:3", "a:b"] {
            assert_eq!(DrawingScale::of_text(text), None, "{text}");
        }
        // 3 m at 1:50 are 6 cm of paper.
        let print = Print { scale, dpi: 300.0 };
        assert!((3.0 * print.pixels_per_metre() - 708.66).abs() < 0.01);
        assert_eq!(print.pixels_per_metre_of_paper(), 11811);
    }
}
