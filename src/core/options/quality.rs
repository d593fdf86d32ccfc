//! Quality of an image: one name that selects samples, noise level and denoiser.

use super::{Denoising, SamplingOptions};
use crate::denoise::Denoiser;
use crate::parameter::{OptionGroup, named, parameters};

parameters! {
    /// Samples, noise level and denoiser together.
    pub struct QualityOptions, heading "", values values {
        /// Sets samples, noise level and denoiser; --spp, --noise, --denoise override it
        ///
        /// `draft`: 4 samples; `good`: 16; `final`: up to 2048, until the relative error is 0.01.
        /// The denoiser is `oidn` (`oidn-fast` for `draft`) if it is built in, else `atrous`.
        /// `samples` and `denoise` of the scene file override its `quality`; the flag `--quality`
        /// overrides all three.
        quality: Quality, default "good for a bare OBJ, else none";
    }
}

/// Quality of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// For a first preview.
    Draft,
    /// For presentation, rendered in seconds.
    Good,
    /// Nearly without noise.
    Final,
}

named! {
    Quality: "draft" => Self::Draft, "good" => Self::Good, "final" => Self::Final;
}

/// Relative error at which an image of the quality `final` is complete.
const FINAL_NOISE: f64 = 0.01;

impl Quality {
    /// Number of samples and denoiser that the quality selects.
    pub fn sampling(self) -> SamplingOptions {
        let samples = match self {
            Self::Draft => 4,
            Self::Good => 16,
            Self::Final => 2048,
        };
        SamplingOptions {
            samples: Some(samples),
            denoise: Some(Denoising::By(match self {
                Self::Draft => Denoiser::fast(),
                Self::Good | Self::Final => Denoiser::best(),
            })),
            ..SamplingOptions::default()
        }
    }

    /// Relative error at which the render stops; `None` if the quality has no noise level.
    pub fn noise(self) -> Option<f64> {
        (self == Self::Final).then_some(FINAL_NOISE)
    }
}

impl QualityOptions {
    /// Copy of `sampling` in which unset samples and denoiser are replaced by the values of the
    /// quality.
    pub fn under(&self, sampling: SamplingOptions) -> SamplingOptions {
        match self.quality {
            Some(quality) => sampling.or(quality.sampling()),
            None => sampling,
        }
    }

    /// Noise level of the quality; `None` if `sampling` sets a number of samples.
    pub fn noise(&self, sampling: &SamplingOptions) -> Option<f64> {
        self.quality.filter(|_| sampling.samples.is_none())?.noise()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_option_overrides_quality() {
        let quality = QualityOptions {
            quality: Some(Quality::Final),
        };
        let said = SamplingOptions {
            samples: Some(7),
            ..SamplingOptions::default()
        };
        let both = quality.under(said);
        assert_eq!((both.samples, quality.noise(&said)), (Some(7), None));
        assert_eq!(both.denoise, Some(Denoising::By(Denoiser::best())));
        let none = SamplingOptions::default();
        assert_eq!(quality.noise(&none), Some(FINAL_NOISE));
        assert_eq!(QualityOptions::default().under(said), said);
    }
}
