use super::camera::blame;
use super::{Backend, CameraSettings, Error, Estimator, IntegratorKind, InvalidSetting};
use crate::camera::{Camera, CameraDescription};
use crate::color::tone::{Curve, MAX_EXPOSURE, Tone};
use crate::denoise::Denoiser;
use crate::description::{SceneFile, named};
use crate::film::{Aov, BLOCK, Filter, FilterKind, Rect};
use crate::io::{FileError, name_of};
use crate::math::UVec2;
use crate::sampler::{RenderSampler, SamplerKind};
use crate::scene::Scene;
use std::ops::Range;
use toml::Spanned;

/// What a render is to be: size, samples, estimator and the like, as the scene file says, or as whoever changes the fields does.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Size of the image, pixels.
    pub resolution: UVec2,
    /// The pixels to render; `None`: all.
    pub crop: Option<Rect>,
    /// How pixels see the image.
    pub filter: FilterKind,
    /// How far the filter reaches, pixels; `None`: as far as is usual for its kind.
    pub filter_radius: Option<f32>,
    /// Where the picture is taken from.
    pub camera: CameraSettings,
    /// Samples a pixel of the whole picture; with `noise` at most.
    pub spp: u32,
    /// The samples to take, if they are a part of the picture's: their indices.
    pub part: Option<Range<u32>>,
    /// Relative error at which to stop.
    pub noise: Option<f64>,
    /// Of the random numbers.
    pub seed: u64,
    /// Where random numbers come from.
    pub sampler: SamplerKind,
    /// How light is found.
    pub estimator: Estimator,
    /// Further channels.
    pub aovs: Vec<Aov>,
    /// Who answers ray queries.
    pub backend: Backend,
    /// What takes noise out of the picture.
    pub denoiser: Option<Denoiser>,
    /// Threads that load, build and render.
    pub threads: usize,
    /// Whether to take less memory and more time.
    pub compact: bool,
    /// How PNG files show the picture.
    pub tone: Tone,
}

/// Samples that a pixel may have where a noise level is given and nothing else.
pub const MOST_FOR_NOISE: u32 = 1 << 14;

/// Samples a pixel where nothing is said.
const DEFAULT_SPP: u32 = 64;

/// Pixels a side where nothing is said.
const DEFAULT_SIDE: u32 = 512;

/// Pixels a side at most: EXR counts them in signed 32-bit integers, and 2^16 a side is beyond what fits any memory here.
const MOST_PIXELS: u32 = 1 << 16;

/// Threads at most for each processor: many more than are of use, and few enough to start in a moment.
const THREADS_OF_A_PROCESSOR: usize = 64;

/// Advice on numbers.
pub(super) const ABOVE_0: &str = "use a number above 0";

/// Names of the filters that take out noise.
pub(crate) const DENOISERS: &[(&str, Option<Denoiser>)] = &[
    ("off", None),
    ("oidn", Some(Denoiser::Oidn)),
    ("atrous", Some(Denoiser::Atrous)),
    ("gaussian", Some(Denoiser::Gaussian)),
];

impl Default for Settings {
    /// Of a scene file that says nothing.
    fn default() -> Self {
        Self {
            resolution: UVec2::splat(DEFAULT_SIDE),
            crop: None,
            filter: FilterKind::Box,
            filter_radius: None,
            camera: CameraSettings::default(),
            spp: DEFAULT_SPP,
            part: None,
            noise: None,
            seed: 0,
            sampler: SamplerKind::Sobol,
            estimator: Estimator::default(),
            aovs: Vec::new(),
            backend: Backend::ALL[0],
            denoiser: None,
            threads: all_threads(),
            compact: false,
            tone: Tone::default(),
        }
    }
}

/// As many threads as the machine runs at a time.
pub(crate) fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

impl Settings {
    /// What the scene file says, and the defaults.
    ///
    /// # Errors
    ///
    /// A value that cannot be, with its place in the file.
    pub fn of(file: &SceneFile) -> Result<Self, Error> {
        let (image, render, usual) = (&file.image, &file.render, Self::default());
        let side = |key: &Option<Spanned<u32>>| key.as_ref().map_or(DEFAULT_SIDE, |n| *n.get_ref());
        let settings = Self {
            resolution: UVec2::new(side(&image.width), side(&image.height)),
            filter: named(file, "filter", &image.filter, FilterKind::NAMES)?.unwrap_or(usual.filter),
            filter_radius: image.filter_radius.as_ref().map(|r| *r.get_ref()),
            camera: CameraSettings::of(file),
            spp: render.samples.as_ref().map_or(usual.spp, |n| *n.get_ref()),
            seed: render.seed.unwrap_or(usual.seed),
            sampler: named(file, "sampler", &render.sampler, SamplerKind::NAMES)?.unwrap_or(usual.sampler),
            estimator: Estimator::of(file)?,
            backend: named(file, "backend", &render.backend, Backend::NAMES)?.unwrap_or(usual.backend),
            denoiser: named(file, "denoise", &render.denoise, DENOISERS)?.unwrap_or(usual.denoiser),
            tone: Tone {
                exposure: image.exposure.as_ref().map_or(0.0, |stops| *stops.get_ref()),
                curve: named(file, "tone", &image.tone, Curve::NAMES)?.unwrap_or_default(),
            },
            ..usual
        };
        match settings.wrong_value() {
            Some(wrong) => Err(settings.blame(file, wrong).into()),
            None => Ok(settings),
        }
    }

    /// `wrong` as an error of the scene file that the settings are of.
    fn blame(&self, file: &SceneFile, wrong: InvalidSetting) -> FileError {
        let (image, render) = (&file.image, &file.render);
        let is_wrong = |side: &&Spanned<u32>| !is_side(*side.get_ref());
        let sides = [("width", &image.width), ("height", &image.height)];
        let side = sides
            .iter()
            .find(|(_, side)| side.as_ref().is_some_and(|side| is_wrong(&side)));
        let span = match wrong.setting {
            "size" => side.and_then(|(_, side)| side.as_ref()).map(Spanned::span),
            "filter-radius" => image.filter_radius.as_ref().map(Spanned::span),
            "exposure" => image.exposure.as_ref().map(Spanned::span),
            "spp" => render.samples.as_ref().map(Spanned::span),
            "light-samples" => render.light_samples.as_ref().map(Spanned::span),
            "branching" => render.branching.as_ref().map(Spanned::span),
            "ao-distance" => render.ao_distance.as_ref().map(Spanned::span),
            "chains" => render.chains.as_ref().map(Spanned::span),
            "bootstrap" => render.bootstrap.as_ref().map(Spanned::span),
            "large-step-probability" => render.large_step_probability.as_ref().map(Spanned::span),
            "mutation-size" => render.mutation_size.as_ref().map(Spanned::span),
            "photons" => render.photons.as_ref().map(Spanned::span),
            "photon-count" => render.photon_count.as_ref().map(Spanned::span),
            "gather-rays" => render.gather_rays.as_ref().map(Spanned::span),
            "photon-radius" => render.photon_radius.as_ref().map(Spanned::span),
            "photon-alpha" => render.photon_alpha.as_ref().map(Spanned::span),
            "cache-error" => render.cache_error.as_ref().map(Spanned::span),
            "cache-rays" => render.cache_rays.as_ref().map(Spanned::span),
            _ => None,
        };
        let message = match (wrong.setting, side) {
            ("size", Some((key, Some(pixels)))) => match pixels.get_ref() {
                0 => format!("{key} = 0: the image has no pixels"),
                pixels => format!("{key} = {pixels}"),
            },
            ("spp", _) => format!("samples = {}", wrong.value),
            (key, _) => format!("{} = {}", key.replace('-', "_"), wrong.value),
        };
        let error = file.error(span.unwrap_or(0..0), message);
        error.help(wrong.help)
    }

    /// The first value that cannot be, whatever the others are.
    fn wrong_value(&self) -> Option<InvalidSetting> {
        let UVec2 { x: width, y: height } = self.resolution;
        let wrong = |setting, value: &dyn std::fmt::Display, help: &str| InvalidSetting::new(setting, value, help);
        // NaN is none of all.
        let is_length = |r: f32| r > 0.0 && r.is_finite();
        if width == 0 || height == 0 {
            let value = format!("{width}x{height}: the image has no pixels");
            return Some(wrong("size", &value, "use 1x1 or more"));
        }
        if !is_side(width) || !is_side(height) {
            let help = format!("at most {MOST_PIXELS} pixels a side");
            return Some(wrong("size", &format!("{width}x{height}"), &help));
        }
        if let Some(radius) = self.filter_radius.filter(|&r| !is_length(r)) {
            return Some(wrong("filter-radius", &radius, ABOVE_0));
        }
        if self.tone.exposure.is_nan() || self.tone.exposure.abs() > MAX_EXPOSURE {
            let help = format!("use stops from -{MAX_EXPOSURE} to {MAX_EXPOSURE}");
            return Some(wrong("exposure", &self.tone.exposure, &help));
        }
        if self.spp == 0 {
            return Some(wrong("spp", &0, "take at least one sample a pixel"));
        }
        if let Some(level) = self.noise.filter(|&level| !(level > 0.0 && level.is_finite())) {
            return Some(wrong("noise", &level, ABOVE_0));
        }
        if self.threads == 0 {
            return Some(wrong("threads", &0, "use at least one thread"));
        }
        let processors = all_threads();
        let most = processors.saturating_mul(THREADS_OF_A_PROCESSOR);
        if self.threads > most {
            let plural = if processors == 1 { "" } else { "s" };
            let help = format!("use {most} at most: this machine has {processors} processor{plural}");
            return Some(wrong("threads", &self.threads, &help));
        }
        self.estimator.wrong_value()
    }

    /// An error where a value cannot be, or values do not go together.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(wrong) = self.wrong_value() {
            return Err(wrong.into());
        }
        if !Backend::ALL.contains(&self.backend) {
            return Err(self.backend.absence().into());
        }
        self.denoiser.map(Denoiser::version).transpose()?;
        let refused = |setting, value: String, help: String| Err(InvalidSetting::new(setting, value, help).into());
        if self.aovs.contains(&Aov::Lights) && !self.estimator.gathers_light() {
            let does = match self.estimator.kind {
                IntegratorKind::IrradianceCache => "tells no lights apart",
                _ => "gathers no light",
            };
            let value = format!("lights: --integrator {} {does}", self.estimator.name());
            let gathers = IntegratorKind::NAMES.iter().filter(|(_, kind)| {
                Estimator {
                    kind: *kind,
                    ..self.estimator
                }
                .gathers_light()
            });
            let names: Vec<&str> = gathers.map(|(name, _)| *name).collect();
            return refused("aov", value, format!("use one of {}", names.join(", ")));
        }
        if self.aovs.contains(&Aov::Strategies) {
            self.estimator.check_strategies()?;
        }
        if let Some(crop) = self.crop.filter(|crop| !crop.is_inside(self.resolution)) {
            let (min, max, size) = (crop.min, crop.max, self.resolution);
            let value = format!(
                "{},{},{},{} holds no pixel or leaves the image of {}x{}",
                min.x, min.y, max.x, max.y, size.x, size.y
            );
            return refused("crop", value, "X0 < X1 and Y0 < Y1, inside the image".into());
        }
        if self.noise.is_some() && (self.spp < 2 * BLOCK || self.spp % BLOCK != 0) {
            let value = format!("{} samples a pixel with a noise level", self.spp);
            let help = format!(
                "use a multiple of {BLOCK}, {} at least: errors are estimated from the differences of such blocks",
                2 * BLOCK
            );
            return refused("spp", value, help);
        }
        if let Some(Range { start, end }) = self.part {
            let value = format!("{start}..{end}");
            if start >= end {
                return refused("samples", value, "use the first sample, and one past the last".into());
            }
            if self.noise.is_some() {
                let help = "where noise decides on the number of samples there are no parts".into();
                return refused("samples", value, help);
            }
            if start % BLOCK != 0 || (end % BLOCK != 0 && end != self.spp) {
                let help = format!(
                    "parts start and end at multiples of {BLOCK}, or end where the whole picture does (--spp), so that \
                     they give the bits of one render"
                );
                return refused("samples", value, help);
            }
        }
        self.estimator.check_branches()
    }

    /// The pixels to render.
    pub fn crop(&self) -> Rect {
        self.crop.unwrap_or(Rect::full(self.resolution))
    }

    /// The samples to take of each.
    pub fn samples(&self) -> Range<u32> {
        self.part.clone().unwrap_or(0..self.spp)
    }

    /// Samples of a pixel of the whole picture.
    pub fn total_samples(&self) -> u32 {
        self.spp.max(self.samples().end)
    }

    /// Whether samples or pixels are only a part of the picture's.
    pub fn is_part(&self) -> bool {
        self.part.is_some() || self.crop.is_some()
    }

    /// How pixels see the image.
    pub fn filter(&self) -> Filter {
        Filter::new(self.filter, self.filter_radius.unwrap_or(self.filter.usual_radius()))
    }

    /// The camera that looks at `scene`, and its description. An error is one of `file`, unless flags or a program have changed its camera.
    pub(crate) fn camera_of(&self, file: &SceneFile, scene: &Scene) -> Result<(CameraDescription, Camera), Error> {
        let description = self.camera.describe(scene.bounds(), self.resolution);
        let camera = description.camera(self.resolution).map_err(|error| {
            let is_of_file = self.camera.is_same(&CameraSettings::of(file));
            let blamed = is_of_file.then(|| blame(file, &error)).flatten();
            blamed.map_or_else(|| error.into(), Error::File)
        })?;
        Ok((description, camera))
    }

    /// What decides the pixels besides the scene, as `key=value` pairs.
    pub fn describe(&self) -> String {
        let filter = self.filter();
        let mut settings = format!(
            "{} sampler={} filter={} filter_radius={}",
            self.estimator.settings(),
            self.sampler_name(),
            name_of(FilterKind::NAMES, filter.kind()),
            filter.radius()
        );
        if !self.aovs.is_empty() {
            settings += &format!(" aov={}", self.aov_names().join(","));
        }
        let total = self.total_samples();
        match self.noise {
            Some(level) => settings + &format!(" noise={level} most_samples={total}"),
            // Whether samples are added later, or in parts, is no business of others.
            None if self.sampler.knows_count() || self.estimator.knows_count() => settings + &format!(" count={total}"),
            None => settings,
        }
    }

    /// Parts of the light that are summed by themselves: groups of lights of `scene`, and strategies, weighed and alone.
    pub(super) fn parts_of_light(&self, scene: &Scene) -> usize {
        let groups = match self.aovs.contains(&Aov::Lights) {
            true => scene.light_groups().names().len(),
            false => 0,
        };
        let strategies = match self.aovs.contains(&Aov::Strategies) {
            true => self.estimator.strategies().len(),
            false => 0,
        };
        groups + 2 * strategies
    }

    /// Names of the further channels, in whatever order they were asked for.
    pub(super) fn aov_names(&self) -> Vec<&'static str> {
        let is_wanted = |(_, aov): &&(&'static str, Aov)| self.aovs.contains(aov);
        Aov::NAMES.iter().filter(is_wanted).map(|(name, _)| *name).collect()
    }

    /// The random numbers of the render.
    pub(crate) fn random_numbers(&self) -> RenderSampler {
        // Blocks are what is taken where the count is not known ahead: each is then whole.
        let count = match self.noise {
            Some(_) => BLOCK,
            None => self.total_samples(),
        };
        self.estimator.sampler(self.sampler, self.seed, count)
    }

    /// The sampler's name, as users type it.
    pub fn sampler_name(&self) -> &'static str {
        name_of(SamplerKind::NAMES, self.sampler)
    }
}

/// Whether an image can have so many pixels a side.
fn is_side(pixels: u32) -> bool {
    (1..=MOST_PIXELS).contains(&pixels)
}
