//! The background of the image: `image.background` and `--background`.

use super::Value;
use crate::color::Spectrum;
use crate::film::Backing;
use crate::integrator::Background;
use crate::parameter::parameters;
use serde_json::json;

parameters! {
    /// Background of camera rays that leave the scene.
    pub struct BackgroundOptions, heading "", values background_values {
        /// Background of camera rays: light, transparent, gradient or a colour
        ///
        /// `light` shows the lights, such as an environment; `transparent` makes an alpha channel;
        /// `gradient` is a backdrop of radiance 0.8 that darkens towards the top; `gradient:COLOUR`
        /// sets another radiance. A colour is `#rrggbb` in sRGB, a name of CSS such as `orange`, or
        /// one or three linear numbers. Reflections and glass still see the lights.
        background: Background = Background::Light;
    }
}

/// Key of the background in the settings that image files store as `key=value` pairs.
pub const BACKGROUND: &str = "background";

/// The backing (the background of pictures for display) of an image. `settings` are the settings
/// that the image file stores. `None` if the background is neither transparent nor a colour.
pub fn backing_of(settings: &str) -> Option<Backing> {
    let pairs = settings.split(' ').filter_map(|pair| pair.split_once('='));
    let (_, text) = pairs.into_iter().find(|(key, _)| *key == BACKGROUND)?;
    Background::of_text(text)?.backing()
}

/// Prefix of a gradient, before its colour.
const GRADIENT: &str = "gradient:";

impl Value for Background {
    const PLACEHOLDER: &'static str = "COLOUR";
    const KIND: &'static str = "light, transparent, gradient, or a colour: #ffc356 (sRGB), a CSS name such as orange, or linear numbers: 0.5 or 0.2,0.3,0.4";
    const IS_STRING: bool = true;
    const IS_LIST: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        match text.trim() {
            "light" => Some(Self::Light),
            "transparent" => Some(Self::Transparent),
            "gradient" => Some(Self::Gradient(Self::GRADIENT)),
            other => match other.strip_prefix(GRADIENT) {
                Some(rest) => Spectrum::of_text(rest).map(Self::Gradient),
                None => Spectrum::of_text(other).map(Self::Color),
            },
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Light => "light".into(),
            Self::Transparent => "transparent".into(),
            Self::Gradient(radiance) if *radiance == Self::GRADIENT => "gradient".into(),
            Self::Gradient(radiance) => format!("{GRADIENT}{}", color_text(*radiance)),
            Self::Color(radiance) => color_text(*radiance),
        }
    }

    fn schema() -> serde_json::Value {
        let channel = json!({ "type": "number", "minimum": 0 });
        json!({ "anyOf": [
            { "enum": ["light", "transparent", "gradient", "white", "black"] },
            { "type": "string", "pattern": "^(gradient:.+|#([0-9A-Fa-f]{3}){1,2}|[A-Za-z]+|[0-9.eE+ -]+(,[0-9.eE+ -]+){2})$" },
            channel,
            { "type": "array", "items": channel, "minItems": 3, "maxItems": 3 },
            { "type": "array", "items": channel, "minItems": 1, "maxItems": 1 },
        ] })
    }

    /// Returns true if the radiance is valid: finite and not negative.
    fn is_finite(&self) -> bool {
        match self {
            Self::Light | Self::Transparent => true,
            Self::Color(radiance) | Self::Gradient(radiance) => radiance.is_valid(),
        }
    }
}

/// Text of a colour in the form in which users write it, without spaces.
pub(super) fn color_text(color: Spectrum) -> String {
    match color.to_array() {
        [r, g, b] if r == g && g == b => r.to_string(),
        [r, g, b] => format!("{r},{g},{b}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn backgrounds_are_read_and_written() {
        let color = |r, g, b| Background::Color(Spectrum::rgb(r, g, b));
        for (text, expected, written) in [
            ("light", Background::Light, "light"),
            ("transparent", Background::Transparent, "transparent"),
            ("white", color(1.0, 1.0, 1.0), "1"),
            ("black", color(0.0, 0.0, 0.0), "0"),
            ("0.25", color(0.25, 0.25, 0.25), "0.25"),
            ("0.5, 1,2", color(0.5, 1.0, 2.0), "0.5,1,2"),
            ("#FF0000", color(1.0, 0.0, 0.0), "1,0,0"),
            ("gradient", Background::Gradient(Background::GRADIENT), "gradient"),
            (
                "gradient:0.5",
                Background::Gradient(Spectrum::splat(0.5)),
                "gradient:0.5",
            ),
        ] {
            let read = Background::of_text(text);
            assert_eq!(read, Some(expected), "{text}");
            assert_eq!(expected.text(), written);
            assert_eq!(Background::of_text(written), read);
        }
        let Some(Background::Color(grey)) = Background::of_text("#808080") else {
            panic!()
        };
        assert!((grey.mean() - 0.215_86).abs() < 1e-5);
        for wrong in [
            "",
            "greyish",
            "-1",
            "nan",
            "inf",
            "1,2",
            "1,2,3,4",
            "#12345",
            "#+12345",
            "#1234567",
            "#gg0000",
            "gradient:",
            "gradient:x",
            "1 2 3",
        ] {
            assert_eq!(Background::of_text(wrong), None, "{wrong}");
        }
        assert!(!Background::Color(Spectrum::splat(f32::NAN)).is_finite());
    }
}
