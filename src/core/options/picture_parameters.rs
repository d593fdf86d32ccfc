//! Parameters of the image and of its sampling.

use crate::camera::ProjectionKind;
use crate::color::tone::{Curve, Exposure, MAX_EXPOSURE, Tone};
use crate::denoise::Denoiser;
use crate::film::FilterKind;
use crate::math::UVec2;
use crate::parameter::{Named, Range, Value, named, parameters};
use crate::sampler::SamplerKind;
use serde_json::json;

/// Maximum width and height in pixels: EXR stores sizes in signed 32-bit integers, and an image
/// with 2^16 pixels per side exceeds the memory of any machine we use.
const MAX_SIDE: u32 = 1 << 16;

parameters! {
    /// Size of the image.
    pub struct SizeOptions, heading "", values size {
        /// Width of the image in pixels
        width: u32 = 512, in Range::FromTo(1, MAX_SIDE);
        /// Height of the image in pixels
        height: u32 = 512, in Range::FromTo(1, MAX_SIDE);
    }
}

impl SizeOptions {
    /// The size if width or height is set, else the default size of `projection`. By default, a
    /// panorama is twice as wide as high, and a cube map has two rows of three faces.
    pub fn of_projection(self, projection: ProjectionKind) -> Self {
        let default = match projection {
            ProjectionKind::Panorama => UVec2::new(1024, 512),
            ProjectionKind::Cubemap => UVec2::new(1536, 1024),
            _ => UVec2::new(self.width(), self.height()),
        };
        match (self.width, self.height) {
            (None, None) => Self {
                width: Some(default.x),
                height: Some(default.y),
            },
            _ => self,
        }
    }
}

parameters! {
    /// Reconstruction filter.
    pub struct FilterOptions, heading "", values filter {
        /// Pixel filter
        ///
        /// Sample positions follow the filter (importance sampling). `mitchell` has negative lobes:
        /// it sharpens edges, and light beside bright pixels can be negative.
        filter: FilterKind = FilterKind::Box;
        /// Radius of the pixel filter in pixels
        filter_radius: f32, default "0.5 of box, 1 of tent, 2 of mitchell, else 1.5", in Range::Above(0.0);
    }
}

parameters! {
    /// Conversion of the image to PNG files.
    pub struct ToneOptions, heading "", values tone_values {
        /// Exposure of PNG files in stops, each of which doubles the light, auto or studio
        ///
        /// From -64 to 64. `auto` meters the picture. `studio` is the exposure for the studio
        /// light, shifted by a maximum of one stop towards the metered exposure. `render` prints
        /// the stops.
        exposure: Exposure = Exposure::Stops(0.0), default "0; for a bare OBJ studio or auto";
        /// Tone curve of PNG files; srgb clips
        tone: Curve = Curve::Srgb, default "srgb; agx for a bare OBJ";
    }
}

parameters! {
    /// Samples, and their computation.
    pub struct SamplingOptions, heading "", values sampling {
        /// Samples per pixel (with --noise the maximum)
        samples: u32 = 64, default "64; 16 for a bare OBJ; with --noise: 16384", in Range::AtLeast(1), flag "spp";
        /// Seed of the random numbers, 64 bits
        seed: u64 = 0;
        /// Source of random numbers
        ///
        /// `sobol` uses separate Owen-scrambled Sobol points for each decision of a pixel's paths.
        /// In `zsobol` the points of neighbouring pixels are also well distributed together, so
        /// that errors cancel over an area. `cmj` is correlated multi-jittered sampling,
        /// `orthogonal` uses orthogonal arrays.
        sampler: SamplerKind = SamplerKind::ZSobol;
        /// Ray-tracing backend, of those built in (see --version)
        backend: Backend = Backend::ALL[0], default "the first of those built in";
        /// Denoiser; EXR files keep the raw picture beside the result
        ///
        /// See docs/denoise.md.
        denoise: Denoising = Denoising::Off, default "off; for a bare OBJ oidn or atrous; for --denoise without a name oidn", bare "oidn";
        /// Standard deviation in pixels of the denoiser gaussian
        denoise_radius: f32, default "0.7", in Range::FromTo(0.1, 50.0);
    }
}

impl ToneOptions {
    /// Tone curve and exposure of PNG files according to these options.
    pub fn tone_settings(&self) -> Tone {
        Tone {
            exposure: self.exposure(),
            curve: self.tone(),
        }
    }

    /// Copy of `tone`, with the values that these options set.
    pub fn over(&self, tone: Tone) -> Tone {
        Tone {
            exposure: self.exposure.unwrap_or(tone.exposure),
            curve: self.tone.unwrap_or(tone.curve),
        }
    }
}

impl Value for Exposure {
    const PLACEHOLDER: &'static str = "STOPS";
    const KIND: &'static str = "a number of stops from -64 to 64, auto or studio";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        match text {
            "auto" => Some(Self::Auto),
            "studio" => Some(Self::Studio),
            _ => text.parse().ok().map(Self::Stops),
        }
    }

    fn text(&self) -> String {
        self.to_string()
    }

    fn schema() -> serde_json::Value {
        json!({ "anyOf": [{ "type": "number", "minimum": -MAX_EXPOSURE, "maximum": MAX_EXPOSURE }, { "enum": ["auto", "studio"] }] })
    }

    /// Returns true if the exposure is in its range of stops.
    fn is_finite(&self) -> bool {
        self.stops().is_none_or(|stops| stops.abs() <= MAX_EXPOSURE)
    }
}

/// Denoising of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Denoising {
    /// No denoising.
    Off,
    /// Denoising by a filter.
    By(Denoiser),
}

impl Denoising {
    /// The denoiser; `None` if there is no denoising.
    pub fn denoiser(self) -> Option<Denoiser> {
        match self {
            Self::Off => None,
            Self::By(denoiser) => Some(denoiser),
        }
    }
}

/// A ray-tracing backend. Cargo features decide which backends are built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Backend {
    /// Intel Embree (Cargo feature `embree`).
    Embree,
    /// A bounding volume hierarchy by the crate obvhs, in pure Rust (Cargo feature `obvhs`).
    Obvhs,
    /// Brute force: tests every ray against every triangle.
    Brute,
}

impl Backend {
    /// All backends that are built in. The default is first.
    pub const ALL: &[Self] = &[
        #[cfg(feature = "embree")]
        Self::Embree,
        #[cfg(feature = "obvhs")]
        Self::Obvhs,
        Self::Brute,
    ];

    /// Name of the backend, which users type.
    pub fn name(self) -> &'static str {
        super::name_of(Self::NAMES, self)
    }

    /// Backend that traces the rays of camera and light guesses. It is never brute force, which
    /// would take minutes before the first sample. The guesses are the same for all backends.
    pub fn for_guesses(self) -> Self {
        match self {
            Self::Brute => Self::ALL[0],
            fast => fast,
        }
    }
}

named! {
    Denoising: "off" => Self::Off, "oidn" => Self::By(Denoiser::Oidn),
        "oidn-fast" => Self::By(Denoiser::OidnFast), "atrous" => Self::By(Denoiser::Atrous),
        "gaussian" => Self::By(Denoiser::Gaussian);
    Backend: "embree" => Self::Embree, "obvhs" => Self::Obvhs, "brute" => Self::Brute;
}
