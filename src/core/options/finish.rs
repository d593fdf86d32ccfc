//! Steps that make the image from the sums of a render: denoising, exposure, tone curve and lines.

use super::{Denoising, LineColor, Value};
use crate::color::Tone;
use crate::color::tone::{Curve, Exposure};
use crate::denoise::Denoiser;
use std::fmt;

/// Denoiser, exposure, tone curve and lines of a render. Checkpoints and files of parts store these
/// settings, so that images made from the files equal the images of the render.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Finish {
    /// Exposure and tone curve of PNG files.
    pub tone: Tone,
    /// The denoiser, if there is one.
    pub denoiser: Option<Denoiser>,
    /// Radius of the denoiser in pixels; `None` for the default of the denoiser.
    pub denoise_radius: Option<f32>,
    /// Colour of the lines that are drawn over PNG files.
    pub lines: Option<LineColor>,
}

impl fmt::Display for Finish {
    /// Writes `key=value` pairs, such as `tone=agx exposure=auto denoise=oidn`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let denoising = self.denoiser.map_or(Denoising::Off, Denoising::By);
        write!(f, "{} denoise={}", self.tone, denoising.text())?;
        if let Some(radius) = self.denoise_radius {
            write!(f, " denoise_radius={radius}")?;
        }
        match self.lines {
            Some(color) => write!(f, " lines={}", color.text()),
            None => Ok(()),
        }
    }
}

impl Finish {
    /// Parses text that was written by `Display` of [`Finish`]. Missing or invalid values get
    /// defaults.
    pub fn of_text(text: &str) -> Self {
        let value = |key: &str| {
            let mut pairs = text.split(' ').filter_map(|pair| pair.split_once('='));
            pairs.find(|(k, _)| *k == key).map(|(_, value)| value)
        };
        let radius = value("denoise_radius").and_then(f32::of_text);
        Self {
            tone: Tone {
                exposure: value("exposure")
                    .and_then(Exposure::of_text)
                    .filter(Exposure::is_finite)
                    .unwrap_or_default(),
                curve: value("tone").and_then(Curve::of_text).unwrap_or_default(),
            },
            denoiser: value("denoise")
                .and_then(Denoising::of_text)
                .and_then(Denoising::denoiser),
            denoise_radius: radius.filter(|radius| radius.is_finite()),
            lines: value("lines").and_then(LineColor::of_text).filter(Value::is_finite),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;

    #[test]
    fn text_round_trip_keeps_all_values() {
        let finish = Finish {
            tone: Tone {
                exposure: Exposure::Studio,
                curve: Curve::Agx,
            },
            denoiser: Some(Denoiser::Gaussian),
            denoise_radius: Some(3.5),
            lines: Some(LineColor(Spectrum::rgb(0.25, 0.5, 1.0))),
        };
        for finish in [finish, Finish::default()] {
            assert_eq!(Finish::of_text(&finish.to_string()), finish, "{finish}");
        }
        assert_eq!(
            finish.to_string(),
            "tone=agx exposure=studio denoise=gaussian denoise_radius=3.5 lines=0.25,0.5,1"
        );
        for unknown in [
            "",
            "tone=x exposure=inf denoise",
            "denoise_radius=nan exposure=1e9 lines=-1",
        ] {
            assert_eq!(Finish::of_text(unknown), Finish::default(), "{unknown}");
        }
    }
}
