//! Denoisers: filters that reduce the noise of a developed image. They add a bias that more samples
//! do not remove.
//!
//! `--denoise` filters the image right before files are written. The channels `R G B` then have the
//! denoised image, and `raw.R raw.G raw.B` the rendered image. If a denoiser fails, the raw image
//! is still written. The version of the denoiser's library is checked before the render begins.
//!
//! All filters use channels that the film has for each pixel. Their results are bit-identical with
//! any number of threads. docs/denoise.md compares them.

mod atrous;
mod bright;
mod coverage;
mod gaussian;
mod layers;
#[cfg(feature = "oidn")]
mod oidn;

use crate::film::{Channel, Image};
use crate::math::{UVec2, Vec3};
use layers::Layers;
use thiserror::Error;

/// A filter that removes noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Denoiser {
    /// The neural network of Open Image Denoise 2, guided by albedo and normal; needs the feature
    /// `oidn`.
    Oidn,
    /// The small network of Open Image Denoise 2, with unfiltered guides: for previews.
    OidnFast,
    /// An edge-avoiding wavelet filter, guided by albedo, normal, depth and variance.
    Atrous,
    /// A Gaussian blur.
    Gaussian,
}

/// Error of a denoiser.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum DenoiseError {
    /// The program was built without this filter.
    #[error(
        "this program was built without Open Image Denoise\n  help: use --denoise=atrous or --denoise=gaussian, or run scripts/setup oidn and build with --features oidn"
    )]
    NotBuilt,
    /// A channel that the filter needs is missing.
    #[error("the image has no channel {0}\n  help: denoise an EXR file that this program wrote")]
    NoChannel(&'static str),
    /// Open Image Denoise failed.
    #[error("Open Image Denoise: {0}\n  help: use --denoise=atrous or --denoise=off")]
    Oidn(String),
    /// The filter failed.
    #[error("denoising failed: {0}\n  help: use another denoiser, or --denoise=off")]
    Failed(String),
}

/// Memory limit of Open Image Denoise in MiB, without the images. It is enough to filter 1920 ×
/// 1080 pixels at once. Open Image Denoise filters larger pictures in tiles.
const OIDN_MB: u32 = 2000;

/// Multiple of pixels to which Open Image Denoise pads pictures in both directions.
const OIDN_BLOCK: u64 = 16;

const COLOR: [&str; 3] = ["R", "G", "B"];
const RAW: [&str; 3] = ["raw.R", "raw.G", "raw.B"];
const ALBEDO: [&str; 3] = ["albedo.R", "albedo.G", "albedo.B"];
const NORMAL: [&str; 3] = ["N.X", "N.Y", "N.Z"];
const EMITTED: &str = "emitted";
const SAMPLES: &str = "samples";
const VARIANCE: [&str; 3] = ["variance.R", "variance.G", "variance.B"];

impl Denoiser {
    /// Open Image Denoise if it is built in and works, else the wavelet filter.
    pub fn best() -> Self {
        match Self::Oidn.version() {
            Ok(_) => Self::Oidn,
            Err(_) => Self::Atrous,
        }
    }

    /// [`Denoiser::best`] for previews: the small network instead of the large one.
    pub fn fast() -> Self {
        match Self::best() {
            Self::Oidn => Self::OidnFast,
            other => other,
        }
    }

    /// Name of the filter, with the version of its library if it has one: `oidn 2.5.1`. Returns an
    /// error if the filter is not available.
    pub fn version(self) -> Result<String, DenoiseError> {
        match self {
            #[cfg(feature = "oidn")]
            Self::Oidn => oidn::version("oidn"),
            #[cfg(feature = "oidn")]
            Self::OidnFast => oidn::version("oidn-fast"),
            #[cfg(not(feature = "oidn"))]
            Self::Oidn | Self::OidnFast => Err(DenoiseError::NotBuilt),
            Self::Atrous => Ok("atrous".into()),
            Self::Gaussian => Ok("gaussian".into()),
        }
    }

    /// Number of pixels that the filter processes for a picture of this size. Open Image Denoise
    /// pads pictures to multiples of 16 pixels in both directions. The padded size determines the
    /// time and the memory.
    pub fn pixels(self, size: UVec2) -> u64 {
        let [width, height] = size.to_array().map(u64::from);
        match self {
            Self::Oidn | Self::OidnFast => width.next_multiple_of(OIDN_BLOCK) * height.next_multiple_of(OIDN_BLOCK),
            Self::Atrous | Self::Gaussian => width * height,
        }
    }

    /// Maximum number of bytes that are needed to denoise `pixels` pixels, in addition to the
    /// image. Measured on pictures of 512² to 3840 × 2160 pixels, and rounded up (docs/denoise.md,
    /// "Memory").
    pub fn bytes(self, pixels: u64) -> u64 {
        match self {
            Self::Oidn | Self::OidnFast => 220 * pixels + (960 * pixels).min(u64::from(OIDN_MB) << 20),
            Self::Atrous => 280 * pixels,
            Self::Gaussian => 140 * pixels,
        }
    }

    /// Default radius in pixels, if the filter has one: the standard deviation of `gaussian`.
    pub fn default_radius(self) -> Option<f32> {
        match self {
            Self::Oidn | Self::OidnFast | Self::Atrous => None,
            Self::Gaussian => Some(gaussian::RADIUS),
        }
    }

    /// [`Denoiser::apply_with`] with the default radius.
    pub fn apply(self, image: &mut Image) -> Result<(), DenoiseError> {
        self.apply_with(image, None)
    }

    /// Writes the denoised picture to `R G B` of `image`, and the raw picture to `raw.R raw.G
    /// raw.B`. With a background, it also writes the denoised and the raw coverage. Other channels
    /// stay, so `variance` is the variance of the raw picture. An image that was denoised before is
    /// denoised again from its raw picture.
    ///
    /// Light of visible lamps that is far brighter than the picture is not filtered.
    ///
    /// Open Image Denoise ignores albedo and normals if one of them is missing; the wavelet filter
    /// needs both, and `Z` and `variance`. Filters without a radius ignore `radius`.
    ///
    /// Uses the threads of rayon's pool; Open Image Denoise creates the same number of threads. On
    /// an error the image is unchanged.
    ///
    /// Each view of the image is denoised separately.
    pub fn apply_with(self, image: &mut Image, radius: Option<f32>) -> Result<(), DenoiseError> {
        let radius = radius.or(self.default_radius()).unwrap_or_default();
        let views = image.views();
        if image.view == image.resolution || views.len() == 1 {
            return self.apply_to_view(image, radius);
        }
        let denoised = views.into_iter().map(|view| {
            let mut part = image.part(view);
            self.apply_to_view(&mut part, radius)?;
            Ok(part)
        });
        let denoised: Vec<Image> = denoised.collect::<Result<_, DenoiseError>>()?;
        denoised.iter().for_each(|part| image.put_part(part));
        Ok(())
    }

    /// Denoises an image of one view.
    fn apply_to_view(self, image: &mut Image, radius: f32) -> Result<(), DenoiseError> {
        let mut layers = Layers::of(image)?;
        let raw = layers.color.clone();
        let bright = bright::take_bright(&mut layers, values(image, EMITTED).ok());
        let filter = |layers: &Layers| self.filter(layers, radius);
        let coverage = image.raw_coverage();
        let (mut denoised, covered) = match coverage.filter(|(_, coverage)| coverage.iter().any(|&a| a != [1.0; 3])) {
            Some((backing, raw)) => {
                let samples = values(image, SAMPLES).ok();
                let behind = Vec3::from(backing.light().to_array());
                let raw: Vec<Vec3> = raw.into_iter().map(Vec3::from).collect();
                // Subtract the light of the background, so that the picture is filtered like a
                // transparent picture.
                let front = layers.color.iter().zip(&raw);
                layers.color = front.map(|(&light, &a)| light - (Vec3::ONE - a) * behind).collect();
                let (mut picture, coverage) = coverage::denoise(&layers, &raw, (samples, bright.as_deref()), filter)?;
                for (light, &a) in picture.iter_mut().zip(&coverage) {
                    *light += (Vec3::ONE - a) * behind;
                }
                (picture, Some((backing, raw, coverage)))
            }
            None => (filter(&layers)?, None),
        };
        if let Some(bright) = bright {
            denoised.iter_mut().zip(bright).for_each(|(sum, bright)| *sum += bright);
        }
        put(image, RAW, &raw);
        put(image, COLOR, &denoised);
        if let Some((backing, raw, coverage)) = covered {
            for (names, values) in [(backing.raw_channels(), raw), (backing.channels(), coverage)] {
                for (c, name) in names.iter().enumerate() {
                    put_values(image, name, values.iter().map(|a| a[c]).collect());
                }
            }
        }
        Ok(())
    }

    fn filter(self, layers: &Layers, radius: f32) -> Result<Vec<Vec3>, DenoiseError> {
        match self {
            #[cfg(feature = "oidn")]
            Self::Oidn => oidn::denoise(layers),
            #[cfg(feature = "oidn")]
            Self::OidnFast => oidn::denoise_fast(layers),
            #[cfg(not(feature = "oidn"))]
            Self::Oidn | Self::OidnFast => Err(DenoiseError::NotBuilt),
            Self::Atrous => Ok(atrous::denoise(atrous::Input::new(layers)?)),
            Self::Gaussian => Ok(gaussian::denoise(&layers.color, layers.size, radius)),
        }
    }
}

/// Three channels as vectors, row by row.
fn vectors(image: &Image, names: [&'static str; 3]) -> Result<Vec<Vec3>, DenoiseError> {
    let [x, y, z] = names.map(|name| values(image, name));
    let (x, y, z) = (x?, y?, z?);
    Ok(x.iter()
        .zip(y)
        .zip(z)
        .map(|((&x, &y), &z)| Vec3::new(x, y, z))
        .collect())
}

/// Values of the channel `name`.
fn values<'a>(image: &'a Image, name: &'static str) -> Result<&'a [f32], DenoiseError> {
    let channel = image.channel(name).ok_or(DenoiseError::NoChannel(name))?;
    Ok(&channel.values)
}

/// Writes `values` to the channels `names`; missing channels are added.
fn put(image: &mut Image, names: [&'static str; 3], values: &[Vec3]) {
    for (c, name) in names.into_iter().enumerate() {
        put_values(image, name, values.iter().map(|v| v[c]).collect());
    }
}

/// Writes `values` to the channel `name`; a missing channel is added.
fn put_values(image: &mut Image, name: &'static str, values: Vec<f32>) {
    match image.channels.iter_mut().find(|channel| channel.name == name) {
        Some(channel) => channel.values = values,
        None => image.channels.push(Channel {
            name: name.into(),
            values,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Film, FilmSample, FirstSurface, Rect, SampleChange};
    use crate::math::hash::mix;

    /// A crop of a noisy picture with `spp` samples per pixel.
    fn picture(spp: u64) -> Image {
        let crop = Rect {
            min: UVec2::new(5, 3),
            max: UVec2::new(50, 40),
        };
        let mut film = Film::new(UVec2::new(64, 48), crop);
        for tile in film.tiles_mut() {
            for pixel in tile.bounds().pixels() {
                let surface = FirstSurface {
                    albedo: Spectrum::rgb(0.2, 0.5, if pixel.x < 20 { 0.1 } else { 0.9 }),
                    normal: Vec3::Z,
                    depth: 3.0 + 0.1 * pixel.y as f32,
                    emitted: 0.0,
                    features: None,
                };
                let surface = (pixel.y > 8).then_some(&surface);
                let albedo = surface.map_or(Spectrum::ONE, |s| s.albedo);
                let mut block = tile.block();
                for s in 0..spp {
                    let bits = mix(u64::from(pixel.x) << 40 | u64::from(pixel.y) << 20 | s);
                    let u = (bits >> 40) as f32 / (1 << 24) as f32;
                    block.add(&FilmSample {
                        radiance: Spectrum::splat(2.0 * u) * albedo,
                        surface,
                        ..FilmSample::default()
                    });
                }
                tile.change(pixel, &block, SampleChange::Add);
            }
        }
        film.develop()
    }

    /// Filters that are available in this build.
    fn built() -> impl Iterator<Item = Denoiser> {
        let all = [Denoiser::Oidn, Denoiser::OidnFast, Denoiser::Atrous, Denoiser::Gaussian];
        all.into_iter().filter(|d| d.version().is_ok())
    }

    #[test]
    fn the_raw_picture_is_kept() {
        let raw = picture(4);
        for denoiser in built() {
            let mut image = raw.clone();
            denoiser.apply(&mut image).unwrap();
            for (name, kept) in COLOR.into_iter().zip(RAW) {
                assert_eq!(values(&image, kept), values(&raw, name), "{denoiser:?}");
                assert_ne!(values(&image, name), values(&raw, name), "{denoiser:?}");
            }
            assert_eq!(values(&image, "variance.G"), values(&raw, "variance.G"));
            assert!(values(&image, "G").unwrap().iter().all(|v| v.is_finite() && *v >= 0.0));
            // A second call starts from the raw picture again.
            let once = image.clone();
            denoiser.apply(&mut image).unwrap();
            assert_eq!(image, once, "{denoiser:?}");
        }
    }

    #[test]
    fn one_sample_per_pixel_is_denoised() {
        for denoiser in built() {
            let mut image = picture(1);
            denoiser.apply(&mut image).unwrap();
            let green = values(&image, "G").unwrap();
            assert!(green.iter().all(|v| v.is_finite() && *v >= 0.0), "{denoiser:?}");
        }
    }

    #[test]
    fn result_does_not_depend_on_threads() {
        let run = |denoiser: Denoiser, threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let mut image = picture(4);
            pool.install(|| denoiser.apply(&mut image)).unwrap();
            image
        };
        for denoiser in built() {
            let one = run(denoiser, 1);
            for threads in [2, 5] {
                assert!(run(denoiser, threads) == one, "{denoiser:?} with {threads} threads");
            }
        }
    }

    #[test]
    fn missing_channel_is_an_error_and_keeps_the_image() {
        let mut image = picture(4);
        image.channels.retain(|c| c.name != "N.Y");
        let before = image.clone();
        assert_eq!(Denoiser::Atrous.apply(&mut image), Err(DenoiseError::NoChannel("N.Y")));
        assert!(image == before);
    }
}
