use super::aovs::aovs;
use super::args::{LoadArgs, RenderArgs, ToneArgs};
use super::backend::Backend;
use super::error::CliError;
use super::estimator::Estimator;
use super::info::forecast;
use crate::camera::{Camera, CameraError, CameraMotion, CameraParameters, Pose};
use crate::color::tone::{Curve, MAX_EXPOSURE, Tone};
use crate::denoise::{DenoiseError, Denoiser};
use crate::film::{Aov, BLOCK, Film, Filter, FilterKind, Rect};
use crate::io::{CameraSection, FileError, LoadOptions, MtlDialect, SceneFile, in_words};
use crate::math::{Bounds3, UVec2, Vec3};
use crate::sampler::{RenderSampler, SamplerKind};
use crate::scene::Scene;
use crate::texture::TextureFilter;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// Vertical field of view, in degrees, where none is given.
const DEFAULT_FOV: f32 = 40.0;

/// Names of the ways in which textures are looked up.
const TEXTURE_FILTERS: &[(&str, TextureFilter)] = &[("mip", TextureFilter::Mip), ("bilinear", TextureFilter::Bilinear)];

/// Names of the filters that take out noise.
const DENOISERS: &[(&str, Option<Denoiser>)] = &[
    ("off", None),
    ("oidn", Some(Denoiser::Oidn)),
    ("atrous", Some(Denoiser::Atrous)),
    ("gaussian", Some(Denoiser::Gaussian)),
];

/// Samples that a pixel may have where a noise level is given and nothing else.
const MOST_FOR_NOISE: u32 = 1 << 14;

/// What a render command means: flags, scene file and defaults resolved, and checked as far as is possible without
/// loading the geometry.
#[derive(Debug)]
pub(super) struct Job {
    pub scene: SceneFile,
    pub scene_path: PathBuf,
    pub resolution: UVec2,
    pub crop: Rect,
    pub filter: Filter,
    /// Of PNG files.
    pub tone: Tone,
    pub samples: Range<u32>,
    /// Samples of a pixel of the whole picture, of which `samples` may be a part.
    pub total_samples: u32,
    /// Whether samples or pixels are only a part of it.
    pub is_part: bool,
    /// Relative error at which to stop.
    pub noise: Option<f64>,
    /// Seconds of rendering after which to stop.
    pub time_limit: Option<f64>,
    pub seed: u64,
    pub sampler: SamplerKind,
    pub estimator: Estimator,
    /// Further channels.
    pub aovs: Vec<Aov>,
    /// The pixel and sample to explain instead of rendering.
    pub pixel: Option<([u32; 2], u32)>,
    pub backend: Backend,
    /// What takes noise out of the picture.
    pub denoiser: Option<Denoiser>,
    pub threads: usize,
    pub quiet: bool,
    pub verbose: bool,
    pub compact: bool,
    camera: CameraArgs,
}

/// What flags say of the camera.
#[derive(Debug)]
struct CameraArgs {
    position: Option<Vec3>,
    look_at: Option<Vec3>,
    up: Option<Vec3>,
    fov: Option<f32>,
    shutter: Option<[f32; 2]>,
}

impl Job {
    /// Reads the scene file and resolves everything.
    pub fn new(args: &RenderArgs) -> Result<Self, CliError> {
        Self::of_scene(args, read_scene(&args.scene, &args.load)?)
    }

    /// Resolves everything for a scene file that was read.
    pub fn of_scene(args: &RenderArgs, scene: SceneFile) -> Result<Self, CliError> {
        let resolution = resolution(args, &scene)?;
        let crop = crop(args, resolution)?;
        let kind = choose(&scene, "filter", &args.filter, &scene.image.filter, FilterKind::NAMES)?;
        let radius = positive(&scene, "filter-radius", args.filter_radius, &scene.image.filter_radius)?;
        let filter = Filter::new(kind, radius.unwrap_or(kind.usual_radius()));

        let tone = tone(&scene, &args.tone)?;

        let settings = &scene.render;
        let noise = positive(&scene, "noise", args.noise, &None)?;
        let spp = match (args.spp, &settings.samples) {
            (Some(0), _) => {
                return Err(CliError::Usage(
                    "--spp 0\n  help: take at least one sample a pixel".into(),
                ));
            }
            (Some(n), _) => n,
            (None, Some(n)) if *n.get_ref() == 0 => {
                return Err(scene
                    .error(n.span(), "samples = 0")
                    .help("take at least one sample a pixel")
                    .into());
            }
            // A flag for the noise is not held back by what the scene file says of samples.
            (None, _) if noise.is_some() => MOST_FOR_NOISE,
            (None, Some(n)) => *n.get_ref(),
            (None, None) => 64,
        };
        if noise.is_some() && (spp < 2 * BLOCK || spp % BLOCK != 0) {
            return Err(CliError::Usage(format!(
                "{spp} samples a pixel with a noise level\n  help: use a multiple of {BLOCK}, {} at least: \
                 errors are estimated from the differences of such blocks",
                2 * BLOCK
            )));
        }
        let samples = samples(args, spp)?;
        let estimator = Estimator::new(&args.estimator, &scene)?;
        let sampler = choose(&scene, "sampler", &args.sampler, &settings.sampler, SamplerKind::NAMES)?;
        let backend = choose(&scene, "backend", &args.backend, &settings.backend, &backends())?;
        let denoiser = choose(&scene, "denoise", &args.denoise, &settings.denoise, DENOISERS)?;
        if args.threads == Some(0) {
            return Err(CliError::Usage("--threads 0\n  help: use at least one thread".into()));
        }

        Ok(Self {
            pixel: args.pixel.map(|pixel| (pixel, args.sample.unwrap_or(0))),
            resolution,
            crop,
            filter,
            tone,
            total_samples: spp.max(samples.end),
            samples,
            is_part: args.samples.is_some() || args.crop.is_some(),
            noise,
            time_limit: args.time_limit,
            seed: args.seed.or(settings.seed).unwrap_or(0),
            aovs: aovs(&args.aov, &scene, &estimator)?,
            estimator,
            sampler,
            backend,
            denoiser,
            threads: args.threads.unwrap_or_else(all_threads),
            quiet: args.quiet,
            verbose: args.verbose,
            compact: args.load.compact,
            camera: CameraArgs {
                position: args.position.map(Vec3::from),
                look_at: args.look_at.map(Vec3::from),
                up: args.up.map(Vec3::from),
                fov: args.fov,
                shutter: args.shutter,
            },
            scene_path: args.scene.clone(),
            scene,
        })
    }

    /// The camera, flags over the scene file over a view that frames `bounds`, and what the scene hash covers of it.
    pub fn camera(&self, bounds: Bounds3) -> Result<(String, Camera), CliError> {
        let from_file = self.scene.camera.as_ref().map(parameters);
        let flags = &self.camera;
        let fov = flags.fov.or(from_file.map(|c| c.vertical_fov)).unwrap_or(DEFAULT_FOV);
        let base = from_file.unwrap_or_else(|| framing(bounds, fov, self.resolution));
        let mut parameters = CameraParameters {
            position: flags.position.unwrap_or(base.position),
            look_at: flags.look_at.unwrap_or(base.look_at),
            up: flags.up.unwrap_or(base.up),
            vertical_fov: fov,
            ..base
        };
        if self.scene.camera.as_ref().is_none_or(|c| c.focus_distance.is_none()) {
            parameters.focus_distance = focus_at_target(&parameters);
        }
        let refused = |error| self.camera_error(&error);
        let Some(motion) = self.motion(&parameters) else {
            let camera = Camera::new(parameters, self.resolution).map_err(refused)?;
            return Ok((format!("{parameters:?}"), camera));
        };
        let camera = Camera::moving(parameters, motion, self.resolution).map_err(refused)?;
        Ok((format!("{parameters:?} {motion:?}"), camera))
    }

    /// How the camera of `parameters` moves and when it looks; `None` where nothing is said of it.
    fn motion(&self, parameters: &CameraParameters) -> Option<CameraMotion> {
        let section = self.scene.camera.as_ref();
        let key = |close: fn(&CameraSection) -> &Option<Spanned<[f32; 3]>>| {
            let close = section.and_then(|section| close(section).as_ref());
            close.map(|v| Vec3::from(*v.get_ref()))
        };
        let (position, look_at, up) = (
            key(|c| &c.position_close),
            key(|c| &c.look_at_close),
            key(|c| &c.up_close),
        );
        let moves = position.or(look_at).or(up).is_some();
        let shutter = section.and_then(|c| c.shutter.as_ref()).map(|s| *s.get_ref());
        let shutter = self.camera.shutter.or(shutter);
        (moves || shutter.is_some()).then(|| CameraMotion {
            close: moves.then(|| Pose {
                position: position.unwrap_or(parameters.position),
                look_at: look_at.unwrap_or(parameters.look_at),
                up: up.unwrap_or(parameters.up),
            }),
            shutter: shutter.unwrap_or([0.0, 1.0]),
        })
    }

    /// Blames the key of the scene file's camera, unless flags had a say.
    fn camera_error(&self, error: &CameraError) -> CliError {
        let flags = &self.camera;
        let flagged = flags.position.is_some()
            || flags.look_at.is_some()
            || flags.up.is_some()
            || flags.fov.is_some()
            || flags.shutter.is_some();
        match &self.scene.camera {
            Some(section) if !flagged => {
                let key = match error.parameter {
                    "look_at" => Some(section.look_at.span()),
                    "up" => section.up.as_ref().map(Spanned::span),
                    "vertical_fov" => section.vertical_fov.as_ref().map(Spanned::span),
                    "lens_radius" => section.lens_radius.as_ref().map(Spanned::span),
                    "focus_distance" => section.focus_distance.as_ref().map(Spanned::span),
                    "shutter" => section.shutter.as_ref().map(Spanned::span),
                    "close" => {
                        let keys = [&section.position_close, &section.look_at_close, &section.up_close];
                        keys.into_iter().flatten().next().map(Spanned::span)
                    }
                    _ => None,
                };
                let span = key.unwrap_or_else(|| section.position.span());
                let blame = self.scene.error(span, error.to_string());
                blame.help("correct the [camera]").into()
            }
            _ => CliError::Usage(format!(
                "{error}\n  help: correct --position, --look-at, --up, --fov or --shutter"
            )),
        }
    }

    /// The scene, compact if that is asked for or if only then its render keeps to `--max-memory`, and about how many bytes that takes at
    /// most. An error, before they are taken, where that is too much.
    pub fn within_memory(&self, scene: Scene) -> Result<(Scene, u64), CliError> {
        let denoising = self.denoiser.map_or(0, |denoiser| denoiser.bytes(self.crop.area()));
        let groups = match self.aovs.contains(&Aov::Lights) {
            true => Film::light_group_bytes(self.crop, scene.light_groups().names().len()),
            false => 0,
        };
        let peak =
            |scene: &Scene| forecast(&self.scene, scene, self.crop).peak(self.backend.name()) + denoising + groups;
        let scene = if self.compact { scene.into_compact() } else { scene };
        let (usual, limit) = (peak(&scene), self.scene.options.max_memory);
        let Some(limit) = limit.filter(|limit| usual > *limit) else {
            return Ok((scene, usual));
        };
        let scene = scene.into_compact();
        let compact = peak(&scene);
        if compact > limit {
            return Err(CliError::Failed(format!(
                "{}: the render takes about {}: more than the {} of --max-memory\n  help: allow more, render a smaller \
                 picture or a --crop, or let objects share their OBJ",
                self.scene_path.display(),
                in_words(compact),
                in_words(limit)
            )));
        }
        Ok((scene, compact))
    }

    /// Name and version of what takes out noise, if anything is to. An error, before any work, where it cannot be used.
    pub fn denoiser_version(&self) -> Result<Option<String>, CliError> {
        let version = self.denoiser.map(Denoiser::version).transpose();
        version.map_err(|error| match error {
            DenoiseError::NotBuilt => CliError::Usage(error.to_string()),
            _ => CliError::Failed(error.to_string()),
        })
    }

    /// The threads that render.
    pub fn thread_pool(&self) -> Result<rayon::ThreadPool, CliError> {
        thread_pool(self.threads)
    }

    /// What decides the pixels besides the scene, as `key=value` pairs.
    pub fn settings(&self) -> String {
        let mut settings = format!(
            "{} sampler={} filter={} filter_radius={}",
            self.estimator.settings(),
            self.sampler_name(),
            name_of(FilterKind::NAMES, self.filter.kind()),
            self.filter.radius()
        );
        if !self.aovs.is_empty() {
            let names: Vec<&str> = self.aovs.iter().map(|&aov| name_of(Aov::NAMES, aov)).collect();
            settings += &format!(" aov={}", names.join(","));
        }
        match self.noise {
            Some(level) => settings + &format!(" noise={level} most_samples={}", self.total_samples),
            // Whether samples are added later, or in parts, is no business of others.
            None if self.sampler.knows_count() || self.estimator.knows_count() => {
                settings + &format!(" count={}", self.total_samples)
            }
            None => settings,
        }
    }

    /// The random numbers of the render.
    pub fn sampler(&self) -> RenderSampler {
        // Blocks are what is taken where the count is not known ahead: each is then whole.
        let count = if self.noise.is_some() {
            BLOCK
        } else {
            self.total_samples
        };
        self.estimator.sampler(self.sampler, self.seed, count)
    }

    /// The sampler's name, as users type it.
    pub fn sampler_name(&self) -> &'static str {
        name_of(SamplerKind::NAMES, self.sampler)
    }
}

/// The samples to take of a picture of `spp`.
fn samples(args: &RenderArgs, spp: u32) -> Result<Range<u32>, CliError> {
    let Some([first, end]) = args.samples else {
        return Ok(0..spp);
    };
    let refused = |help: String| Err(CliError::Usage(format!("--samples {first}..{end}\n  help: {help}")));
    if args.spp.is_some_and(|spp| end > spp) {
        return refused(format!(
            "the whole picture has {spp} samples a pixel: end at {spp}, or raise --spp"
        ));
    }
    if first % BLOCK != 0 || (end % BLOCK != 0 && end != spp) {
        return refused(format!(
            "parts start and end at multiples of {BLOCK}, or end where the whole picture does (--spp), so that \
             they give the bits of one render"
        ));
    }
    Ok(first..end)
}

/// As many threads as the machine runs at a time.
pub(super) fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

/// So many threads.
pub(super) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, CliError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|error| CliError::Failed(format!("cannot start {threads} threads: {error}")))
}

/// A scene file, or the scene that a bare OBJ stands for, to be read as `args` and itself say.
pub(super) fn read_scene(path: &Path, args: &LoadArgs) -> Result<SceneFile, CliError> {
    let mut scene = match kind_of(path)? {
        SceneKind::Toml => SceneFile::load(path)?,
        SceneKind::Obj => SceneFile::of_obj(path),
    };
    scene.options = load_options(&scene, args)?;
    Ok(scene)
}

/// What describes a scene.
pub(super) enum SceneKind {
    Toml,
    Obj,
}

/// What the file is, by its name.
pub(super) fn kind_of(path: &Path) -> Result<SceneKind, FileError> {
    let refused = |message| FileError::new(path, message).help("give a .toml scene file or an .obj file");
    if path.is_dir() {
        return Err(refused("this is a directory, not a scene"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => Ok(SceneKind::Toml),
        Some("obj") => Ok(SceneKind::Obj),
        _ => Err(refused("not a scene by its name")),
    }
}

/// How the files of a scene are read.
pub(super) fn load_options(scene: &SceneFile, args: &LoadArgs) -> Result<LoadOptions, CliError> {
    let settings = &scene.render;
    let dialect = (&args.mtl_dialect, &settings.mtl_dialect);
    Ok(LoadOptions {
        mtl_dialect: choose(scene, "mtl-dialect", dialect.0, dialect.1, MtlDialect::NAMES)?,
        smooth: positive(scene, "smooth", args.smooth, &settings.smooth)?,
        texture_filter: choose(
            scene,
            "texture-filter",
            &args.texture_filter,
            &settings.texture_filter,
            TEXTURE_FILTERS,
        )?,
        max_memory: args.max_memory,
    })
}

/// Pixels a side at most: EXR counts them in signed 32-bit integers, and 2^16 a side is beyond what fits any memory here.
const MAX: u32 = 1 << 16;

/// What `--size` says, if an image can have it.
pub(super) fn checked_size([width, height]: [u32; 2]) -> Result<UVec2, CliError> {
    if width == 0 || height == 0 {
        return Err(CliError::Usage(format!(
            "--size {width}x{height}: the image has no pixels\n  help: use 1x1 or more"
        )));
    }
    if width > MAX || height > MAX {
        return Err(CliError::Usage(format!(
            "--size {width}x{height}\n  help: at most {MAX} pixels a side"
        )));
    }
    Ok(UVec2::new(width, height))
}

fn resolution(args: &RenderArgs, scene: &SceneFile) -> Result<UVec2, CliError> {
    let from_file = |value: &Option<Spanned<u32>>| -> Result<u32, CliError> {
        match value {
            Some(n) if *n.get_ref() > MAX => Err(scene
                .error(n.span(), format!("{} pixels a side", n.get_ref()))
                .help(format!("use at most {MAX}"))
                .into()),
            Some(n) if *n.get_ref() == 0 => Err(scene
                .error(n.span(), "the image has no pixels")
                .help("use 1 or more")
                .into()),
            Some(n) => Ok(*n.get_ref()),
            None => Ok(512),
        }
    };
    match args.size {
        Some(size) => checked_size(size),
        None => Ok(UVec2::new(
            from_file(&scene.image.width)?,
            from_file(&scene.image.height)?,
        )),
    }
}

fn crop(args: &RenderArgs, resolution: UVec2) -> Result<Rect, CliError> {
    let Some([x0, y0, x1, y1]) = args.crop else {
        return Ok(Rect::full(resolution));
    };
    let crop = Rect {
        min: UVec2::new(x0, y0),
        max: UVec2::new(x1, y1),
    };
    if !crop.is_inside(resolution) {
        return Err(CliError::Usage(format!(
            "--crop {x0},{y0},{x1},{y1} holds no pixel or leaves the image of {}x{}\n  help: X0 < X1 and Y0 < Y1, inside the image",
            resolution.x, resolution.y
        )));
    }
    Ok(crop)
}

/// How PNG files show a picture.
pub(super) fn tone(scene: &SceneFile, args: &ToneArgs) -> Result<Tone, CliError> {
    // NaN is out of range too.
    let is_good = |stops: f32| stops.abs() <= MAX_EXPOSURE;
    let help = format!("use stops from -{MAX_EXPOSURE} to {MAX_EXPOSURE}");
    let exposure = match (args.exposure, &scene.image.exposure) {
        (Some(stops), _) if !is_good(stops) => {
            return Err(CliError::Usage(format!("--exposure {stops}\n  help: {help}")));
        }
        (Some(stops), _) => stops,
        (None, Some(stops)) if !is_good(*stops.get_ref()) => {
            let message = format!("exposure = {}", stops.get_ref());
            return Err(scene.error(stops.span(), message).help(help).into());
        }
        (None, stops) => stops.as_ref().map_or(0.0, |stops| *stops.get_ref()),
    };
    Ok(Tone {
        exposure,
        curve: choose(scene, "tone", &args.tone, &scene.image.tone, Curve::NAMES)?,
    })
}

/// What the flag names, else the scene file, else the first of those there are.
pub(super) fn choose<T: Copy>(
    scene: &SceneFile,
    what: &str,
    flag: &Option<String>,
    file: &Option<Spanned<String>>,
    known: &[(&str, T)],
) -> Result<T, CliError> {
    match (flag, file) {
        (Some(name), _) => find(known, name).ok_or_else(|| {
            let names = join_names(known);
            CliError::Usage(format!("unknown {what} `{name}`\n  help: there is {names}"))
        }),
        (None, Some(name)) => check_name(scene, name, what, known),
        (None, None) => Ok(known[0].1),
    }
}

fn backends() -> Vec<(&'static str, Backend)> {
    Backend::ALL.iter().map(|&b| (b.name(), b)).collect()
}

/// The backend that `flag` names.
pub(super) fn find_backend(name: &str, flag: &str) -> Result<Backend, CliError> {
    let known = backends();
    find(&known, name).ok_or_else(|| {
        let names = join_names(&known);
        CliError::Usage(format!("{flag} {name}: unknown backend\n  help: there is {names}"))
    })
}

fn check_name<T: Copy>(
    scene: &SceneFile,
    name: &Spanned<String>,
    what: &str,
    known: &[(&str, T)],
) -> Result<T, CliError> {
    find(known, name.get_ref()).ok_or_else(|| {
        let message = format!("unknown {what} `{}`", name.get_ref());
        let help = format!("there is {}", join_names(known));
        scene.error(name.span(), message).help(help).into()
    })
}

/// The name of `value` among those known.
pub(super) fn name_of<T: PartialEq>(names: &[(&'static str, T)], value: T) -> &'static str {
    names.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

pub(super) fn find<T: Copy>(known: &[(&str, T)], name: &str) -> Option<T> {
    known.iter().find(|(k, _)| *k == name).map(|(_, value)| *value)
}

pub(super) fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// The flag's number, else the scene file's, which must be finite and above 0.
pub(super) fn positive<T: Copy + Default + PartialOrd + std::fmt::Display>(
    scene: &SceneFile,
    what: &str,
    flag: Option<T>,
    file: &Option<Spanned<T>>,
) -> Result<Option<T>, CliError> {
    let is_good = |n: T| n > T::default() && n.to_string() != "inf";
    match (flag, file) {
        (Some(n), _) if !is_good(n) => Err(CliError::Usage(format!("--{what} {n}\n  help: use a number above 0"))),
        (Some(n), _) => Ok(Some(n)),
        (None, Some(n)) if !is_good(*n.get_ref()) => {
            let message = format!("{} = {}", what.replace('-', "_"), n.get_ref());
            Err(scene.error(n.span(), message).help("use a number above 0").into())
        }
        (None, file) => Ok(file.as_ref().map(|n| *n.get_ref())),
    }
}

fn parameters(section: &CameraSection) -> CameraParameters {
    CameraParameters {
        position: Vec3::from(*section.position.get_ref()),
        look_at: Vec3::from(*section.look_at.get_ref()),
        up: section.up.as_ref().map_or(Vec3::Y, |up| Vec3::from(*up.get_ref())),
        vertical_fov: section.vertical_fov.as_ref().map_or(DEFAULT_FOV, |v| *v.get_ref()),
        lens_radius: section.lens_radius.as_ref().map_or(0.0, |v| *v.get_ref()),
        focus_distance: section.focus_distance.as_ref().map_or(1.0, |v| *v.get_ref()),
    }
}

/// A pinhole on the +z side that sees the whole sphere around `bounds`.
fn framing(bounds: Bounds3, vertical_fov: f32, resolution: UVec2) -> CameraParameters {
    let look_at = bounds.center();
    let radius = Some(bounds.radius()).filter(|&r| r > 0.0).unwrap_or(1.0);
    // The narrower of the two fields of view must hold the sphere.
    let half = (0.5 * vertical_fov.clamp(1.0, 179.0)).to_radians();
    let aspect = resolution.x as f32 / resolution.y as f32;
    let narrow = if aspect < 1.0 {
        (half.tan() * aspect).atan()
    } else {
        half
    };
    CameraParameters {
        position: look_at + Vec3::Z * (radius / narrow.sin()),
        look_at,
        up: Vec3::Y,
        vertical_fov,
        lens_radius: 0.0,
        focus_distance: 1.0,
    }
}

/// The distance to `look_at`, for cameras that do not say where they focus.
fn focus_at_target(camera: &CameraParameters) -> f32 {
    Some(camera.position.distance(camera.look_at))
        .filter(|&d| d > 0.0)
        .unwrap_or(1.0)
}
