//! Settings of a render: the options of a scene file, changed by flags or by a program. The module
//! also checks combinations of settings.

use super::camera::{FoundCamera, blame, check_shift};
use super::siblings::siblings;
use super::{AnyAccel, CameraSettings, Error, Guesses, InvalidSetting};
use crate::accel::Accel;
use crate::camera::CameraParameters;
use crate::color::tone::{Curve, Tone};
use crate::denoise::Denoiser;
use crate::film::{Aov, BLOCK, Backing, Filter, FilterKind, LineStyle, Rect};
use crate::guess::{CameraFinder, LightGuess, SiblingFiles, Survey};
use crate::integrator::Background;
use crate::light_paths::{LightPathError, LightPaths, PathPart};
use crate::math::UVec2;
use crate::options::{
    BACKGROUND, Backend, BackgroundOptions, ChosenIntegrator, Denoising, FilterOptions, Finish, IntegratorKind,
    IntegratorOptions, LineOptions, Named, OptionGroup, Print, SamplingOptions, SizeOptions, ToneOptions, Value,
    name_of,
};
use crate::render::StopCondition;
use crate::sampler::{RenderSampler, SamplerKind};
use crate::scene::Scene;
use crate::scene_file::{SceneFile, SceneOptions};
use std::ops::Range;

/// Settings of a render, such as size, samples and integrator, from a scene file, flags or a
/// program.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Settings {
    /// Size of the image in pixels.
    pub resolution: UVec2,
    /// Rectangle of pixels to render; `None` for all pixels.
    pub crop: Option<Rect>,
    /// Pixel filter.
    pub filter: FilterKind,
    /// Radius of the pixel filter in pixels; `None` for the default of the filter.
    pub filter_radius: Option<f32>,
    /// Background of camera rays that leave the scene.
    pub background: Background,
    /// Requested guesses for missing settings.
    pub guesses: Guesses,
    /// Camera settings: position, orientation and lens.
    pub camera: CameraSettings,
    /// Number of samples per pixel of the whole picture. If `noise` is set, it is the maximum
    /// number.
    pub spp: u32,
    /// Range of sample indices to render, if this render has only a part of the picture's samples.
    pub part: Option<Range<u32>>,
    /// Relative error at which the render stops, if a noise level is set.
    pub noise: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Sampler, which generates the random numbers.
    pub sampler: SamplerKind,
    /// The integrator and its parameters.
    pub integrator: IntegratorOptions,
    /// Additional channels to store (AOVs).
    pub aovs: Vec<Aov>,
    /// Parts of the light that are stored as additional channels. Light path expressions select
    /// them.
    pub light_paths: Vec<PathPart>,
    /// Ray-tracing backend.
    pub backend: Backend,
    /// Denoiser of the picture.
    pub denoiser: Option<Denoiser>,
    /// Denoiser for the whole picture after its parts are merged. It is set if this render is a
    /// part that is not denoised.
    pub merged_denoiser: Option<Denoiser>,
    /// Radius of the denoiser in pixels; `None` for the default of the denoiser.
    pub denoise_radius: Option<f32>,
    /// Number of threads for loading, building and rendering.
    pub threads: usize,
    /// True to make the scene compact, which needs less memory and more time.
    pub compact: bool,
    /// Tone curve and exposure of PNG files.
    pub tone: Tone,
    /// Scale of the picture on paper, if one is set.
    pub print: Option<Print>,
    /// True if `resolution` is the size of a page. Else the size of drawings to scale is the size
    /// of the scene.
    pub is_page: bool,
    /// Lines along edges: their colour in PNG files, and their style.
    pub lines: LineOptions,
}

/// Maximum number of samples per pixel if only a noise level is set.
pub const MAX_SAMPLES_FOR_NOISE: u32 = 1 << 14;

/// Maximum number of threads per processor. More threads than processors do not make a render
/// faster. This maximum is so small that all threads start quickly.
const THREADS_OF_A_PROCESSOR: usize = 64;

impl Default for Settings {
    /// Settings of a scene file without keys.
    fn default() -> Self {
        Self::new(&SceneOptions::default(), CameraSettings::default())
    }
}

/// Number of threads that the machine can run in parallel.
pub(crate) fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

/// Requested results of a survey of the scene: the survey itself, and a guess of the light.
#[derive(Clone, Copy, Default)]
pub(super) struct GuessSelection {
    pub survey: bool,
    pub light: bool,
}

/// Survey of a scene, and the light guessed from it.
pub(super) struct SceneSurvey {
    pub survey: Survey,
    /// Guess of the light, if it was requested.
    pub light: Option<LightGuess>,
}

impl Settings {
    /// Settings of a scene file, with defaults for missing keys.
    pub fn of(file: &SceneFile) -> Self {
        Self::new(&file.options, CameraSettings::of(file))
    }

    /// Settings of `options`, with defaults for missing values.
    pub(crate) fn new(options: &SceneOptions, camera: CameraSettings) -> Self {
        let (size, filter) = (options.size.of_projection(options.camera.projection()), &options.filter);
        let noise = options.quality.noise(&options.sampling);
        let sampling = options.quality.under(options.sampling);
        Self {
            resolution: UVec2::new(size.width(), size.height()),
            crop: None,
            filter: filter.filter(),
            filter_radius: filter.filter_radius(),
            background: options.background.background(),
            guesses: Guesses::default(),
            camera,
            spp: sampling.samples(),
            part: None,
            noise,
            seed: sampling.seed(),
            sampler: sampling.sampler(),
            integrator: options.integrator,
            aovs: options.lines.color().map(|_| Aov::Lines).into_iter().collect(),
            light_paths: Vec::new(),
            backend: sampling.backend(),
            denoiser: sampling.denoise().denoiser(),
            merged_denoiser: None,
            denoise_radius: sampling.denoise_radius(),
            threads: all_threads(),
            compact: false,
            tone: options.tone.tone_settings(),
            print: Print::of(&options.print),
            is_page: false,
            lines: options.lines,
        }
    }

    /// The integrator of the render, with its parameters.
    pub fn chosen_integrator(&self) -> ChosenIntegrator {
        ChosenIntegrator::new(&self.integrator)
    }

    /// Returns the first setting whose value is out of its range. Values of files and flags were
    /// checked when they were read, but a program may set any value.
    fn invalid(&self) -> Option<InvalidSetting> {
        let UVec2 { x: width, y: height } = self.resolution;
        let size = SizeOptions {
            width: Some(width),
            height: Some(height),
        };
        let filter = FilterOptions {
            filter_radius: self.filter_radius,
            ..FilterOptions::default()
        };
        let background = BackgroundOptions {
            background: Some(self.background),
        };
        let tone = ToneOptions {
            exposure: Some(self.tone.exposure),
            ..ToneOptions::default()
        };
        let sampling = SamplingOptions {
            samples: Some(self.spp),
            ..SamplingOptions::default()
        };
        if let Some(invalid) = size.invalid() {
            return Some(InvalidSetting::new("size", format!("{width}x{height}"), invalid.help));
        }
        let groups = [
            filter.invalid(),
            background.invalid(),
            tone.invalid(),
            sampling.invalid(),
            self.lines.invalid(),
        ];
        if let Some(invalid) = groups.into_iter().flatten().chain(self.integrator.invalid()).next() {
            return Some(invalid.into());
        }
        let invalid =
            |setting, value: &dyn std::fmt::Display, help: &str| Some(InvalidSetting::new(setting, value, help));
        if let Some(level) = self.noise.filter(|&level| !(level > 0.0 && level.is_finite())) {
            return invalid("noise", &level, "use a number above 0");
        }
        if self.threads == 0 {
            return invalid("threads", &0, "use at least one thread");
        }
        let processors = all_threads();
        let max = processors.saturating_mul(THREADS_OF_A_PROCESSOR);
        if self.threads > max {
            let plural = if processors == 1 { "" } else { "s" };
            let help = format!("use at most {max}: this machine has {processors} processor{plural}");
            return invalid("threads", &self.threads, &help);
        }
        None
    }

    /// Returns an error if a value is invalid, or if values cannot be combined.
    pub fn check(&self) -> Result<(), Error> {
        if let Some(invalid) = self.invalid() {
            return Err(invalid.into());
        }
        if !Backend::ALL.contains(&self.backend) {
            return Err(self.backend.absence().into());
        }
        self.denoiser.map(Denoiser::version).transpose()?;
        let integrator = self.chosen_integrator();
        let refused = |setting, value: String, help: String| Err(InvalidSetting::new(setting, value, help).into());
        if let (Some(radius), None) = (self.denoise_radius, self.denoiser.and_then(Denoiser::default_radius)) {
            let help = "leave it out, or render with --denoise=gaussian";
            return refused(
                "denoise-radius",
                format!("{radius}: the denoiser has no radius"),
                help.into(),
            );
        }
        if self.aovs.contains(&Aov::Lights) && !integrator.gathers_light() {
            let does = match integrator.kind() {
                IntegratorKind::IrradianceCache => "cannot separate light groups",
                _ => "gathers no light",
            };
            let value = format!("lights: --integrator {} {does}", integrator.name());
            let gathers = IntegratorKind::NAMES.iter().filter(|(_, kind)| {
                let options = IntegratorOptions {
                    integrator: Some(*kind),
                    ..self.integrator
                };
                ChosenIntegrator::new(&options).gathers_light()
            });
            let names: Vec<&str> = gathers.map(|(name, _)| *name).collect();
            return refused("aov", value, format!("use one of the integrators {}", names.join(", ")));
        }
        if self.aovs.contains(&Aov::Points) && !integrator.has_points() {
            let value = format!(
                "points: --integrator {} makes neither photons nor irradiance records",
                integrator.name()
            );
            return refused("aov", value, "use --integrator photon-map or irradiance-cache".into());
        }
        if self.aovs.contains(&Aov::Strategies) {
            integrator.check_strategies()?;
        }
        if !self.light_paths.is_empty() {
            integrator.check_light_paths(&self.light_paths)?;
            if let Err(LightPathError { message, help }) = self.paths() {
                return refused("aov", message, help);
            }
        }
        integrator.check_background(self.background)?;
        if let Some(crop) = self.crop.filter(|crop| !crop.is_inside(self.resolution)) {
            let (min, max, size) = (crop.min, crop.max, self.resolution);
            let value = format!(
                "{},{},{},{} holds no pixel or leaves the image of {}x{}",
                min.x, min.y, max.x, max.y, size.x, size.y
            );
            return refused("crop", value, "use X0 < X1 and Y0 < Y1, inside the image".into());
        }
        if self.noise.is_some() && (self.spp < 2 * BLOCK || self.spp % BLOCK != 0) {
            let value = format!("{} with --noise", self.spp);
            let help = format!(
                "use a multiple of {BLOCK}, at least {}, because errors are estimated from the differences between blocks of samples",
                2 * BLOCK
            );
            return refused("spp", value, help);
        }
        if let Some(Range { start, end }) = self.part {
            let value = format!("{start}..{end}");
            if start >= end {
                return refused(
                    "samples",
                    value,
                    "write the first sample and one past the last, as in 64..128".into(),
                );
            }
            if self.noise.is_some() {
                let help = "--noise decides the number of samples, so the picture cannot be split by samples".into();
                return refused("samples", value, help);
            }
            if start % BLOCK != 0 || (end % BLOCK != 0 && end != self.spp) {
                let help = format!(
                    "parts start and end at multiples of {BLOCK}; the last part may end at --spp; --crop splits the picture by pixels"
                );
                return refused("samples", value, help);
            }
        }
        integrator.check()
    }

    /// Rectangle of pixels to render.
    pub fn crop(&self) -> Rect {
        self.crop.unwrap_or(Rect::full(self.resolution))
    }

    /// Range of the samples to render for each pixel.
    pub fn samples(&self) -> Range<u32> {
        self.part.clone().unwrap_or(0..self.spp)
    }

    /// Stop condition of the render.
    pub(super) fn stop(&self) -> StopCondition {
        StopCondition {
            end: self.samples().end,
            noise: self.noise,
        }
    }

    /// Number of samples per pixel of the whole picture.
    pub fn total_samples(&self) -> u32 {
        self.spp.max(self.samples().end)
    }

    /// Denoiser, exposure and tone curve of the whole picture.
    pub fn finish(&self) -> Finish {
        Finish {
            tone: self.tone,
            denoiser: self.denoiser.or(self.merged_denoiser),
            denoise_radius: self.denoise_radius,
            lines: self.lines.color(),
        }
    }

    /// The backing of the picture: a transparent or coloured background that replaces the light
    /// behind the scene. `None` if the picture has none.
    pub fn backing(&self) -> Option<Backing> {
        self.background.backing()
    }

    /// Returns true if the render has only a part of the samples or pixels of the picture.
    pub fn is_part(&self) -> bool {
        self.part.is_some() || self.crop.is_some()
    }

    /// The pixel filter with its radius.
    pub fn filter(&self) -> Filter {
        Filter::new(self.filter, self.filter_radius.unwrap_or(self.filter.usual_radius()))
    }

    /// Finds the camera for `scene`. Errors point to keys in `file`, unless flags or a program have
    /// changed the camera.
    pub(crate) fn camera_of(
        &self,
        file: &SceneFile,
        scene: &Scene,
        pool: &rayon::ThreadPool,
    ) -> Result<FoundCamera, Error> {
        Ok(self.camera_and_survey(file, scene, pool, GuessSelection::default())?.0)
    }

    /// Like [`Settings::camera_of`]. Also returns a survey of the scene, if the camera needs a
    /// survey or `selection` requests one. The survey has a guess of the light, if `selection`
    /// requests it.
    pub(super) fn camera_and_survey(
        &self,
        file: &SceneFile,
        scene: &Scene,
        pool: &rayon::ThreadPool,
        selection: GuessSelection,
    ) -> Result<(FoundCamera, Option<SceneSurvey>), Error> {
        // Guesses trace rays, so they need an acceleration structure.
        let accel = if selection.survey || selection.light || self.camera.needs_scene() {
            Some(self.backend.for_guesses().build(scene, pool)?)
        } else {
            None
        };
        let accel = accel.as_ref().map(AnyAccel::as_dyn);
        let finder = accel.map(|accel| self.finder(file, scene, accel, pool));
        let found = pool.install(|| {
            let found = self.camera.found(finder.as_ref(), self.resolution)?;
            check_shift(&found.description, scene, self.resolution)?;
            let CameraParameters { position, look_at, .. } = found.description.parameters;
            let survey = finder.map(|finder| {
                let light = selection.light.then(|| finder.light(position, look_at)).flatten();
                SceneSurvey {
                    survey: *finder.survey(),
                    light,
                }
            });
            Ok((found, survey))
        });
        found.map_err(|error| {
            let is_of_file = self.camera == CameraSettings::of(file);
            let blamed = is_of_file.then(|| blame(file, &error)).flatten();
            blamed.map_or_else(|| error.into(), Error::File)
        })
    }

    /// Finder of the camera in `scene`. Other OBJ files of the folder are read if the upright axis
    /// is not sure.
    pub(super) fn finder<'a>(
        &self,
        file: &SceneFile,
        scene: &'a Scene,
        accel: &'a dyn Accel,
        pool: &rayon::ThreadPool,
    ) -> CameraFinder<'a> {
        let finder = pool.install(|| {
            self.camera
                .finder(scene, accel, self.resolution, SiblingFiles::default())
        });
        match file.only_obj() {
            Some(obj) if finder.is_unsure_of_up() => finder.with(siblings(&obj, self.backend, pool)),
            _ => finder,
        }
    }

    /// Settings that affect the pixels in addition to the scene, as `key=value` pairs.
    pub fn describe(&self) -> String {
        let (filter, integrator) = (self.filter(), self.chosen_integrator());
        let mut settings = format!(
            "{} sampler={} filter={} filter_radius={}",
            integrator.describe(),
            self.sampler_name(),
            name_of(FilterKind::NAMES, filter.kind()),
            filter.radius()
        );
        if self.background != Background::Light {
            settings += &format!(" {BACKGROUND}={}", self.background.text());
        }
        let aovs = self.aov_names().into_iter().map(String::from);
        let aovs: Vec<String> = aovs.chain(self.light_paths.iter().map(PathPart::describe)).collect();
        if !aovs.is_empty() {
            settings += &format!(" aov={}", aovs.join(","));
        }
        if self.aovs.contains(&Aov::Lines) {
            let LineStyle { width, angle } = self.lines.style();
            settings += &format!(" lines_width={width} lines_angle={angle}");
        }
        let total = self.total_samples();
        match self.noise {
            Some(level) => settings + &format!(" noise={level} max_samples={total}"),
            // Name the number of samples only if the sampler depends on it. With other samplers,
            // samples can be added later or in parts.
            None if self.sampler.needs_count() || integrator.needs_count() => settings + &format!(" count={total}"),
            None => settings,
        }
    }

    /// Classifier of light paths, if channels of light paths are requested.
    ///
    /// # Errors
    ///
    /// Too many channels of light paths.
    pub(super) fn paths(&self) -> Result<Option<LightPaths>, LightPathError> {
        let is_wanted = !self.light_paths.is_empty();
        is_wanted.then(|| LightPaths::new(&self.light_paths)).transpose()
    }

    /// Number of light layers that have separate sums: one for each light group of `scene`, for
    /// each strategy with and without weights, and for each channel of light paths.
    pub(super) fn parts_of_light(&self, scene: &Scene) -> usize {
        let groups = if self.aovs.contains(&Aov::Lights) {
            scene.light_groups().names().len()
        } else {
            0
        };
        let strategies = if self.aovs.contains(&Aov::Strategies) {
            self.chosen_integrator().strategies().len()
        } else {
            0
        };
        groups + 2 * strategies + self.light_paths.len()
    }

    /// Names of the additional channels. The order does not depend on the order in which they were
    /// requested.
    pub(super) fn aov_names(&self) -> Vec<&'static str> {
        let is_wanted = |(_, aov): &&(&'static str, Aov)| self.aovs.contains(aov);
        Aov::NAMES.iter().filter(is_wanted).map(|(name, _)| *name).collect()
    }

    /// Sampler of the render, with its seed and its number of samples.
    pub(crate) fn random_numbers(&self) -> RenderSampler {
        // With a noise level, the number of samples is not known in advance. Samples are then taken
        // in blocks. Use the size of a block as the number, so that each block is a complete point
        // set.
        let count = match self.noise {
            Some(_) => BLOCK,
            None => self.total_samples(),
        };
        self.chosen_integrator().sampler(self.sampler, self.seed, count)
    }

    /// The sampler's name in flags and files.
    pub fn sampler_name(&self) -> &'static str {
        name_of(SamplerKind::NAMES, self.sampler)
    }

    /// The denoiser's name in flags and files.
    pub(crate) fn denoiser_name(&self) -> Option<&'static str> {
        let denoiser = self.denoiser?;
        Some(name_of(Denoising::NAMES, Denoising::By(denoiser)))
    }

    /// The tone curve's name in flags and files.
    pub(crate) fn curve_name(&self) -> &'static str {
        name_of(Curve::NAMES, self.tone.curve)
    }
}
