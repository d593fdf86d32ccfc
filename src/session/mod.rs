//! A render from scene file to picture: what programs that use this crate stand on, the command line among them.
//!
//! [`Settings`] say what is wanted; a [`Session`] holds the scene; its [`Renderer`] has an acceleration structure as well, and adds samples to a
//! [`RenderState`] for as long as an observer lets it. A render may be stopped and resumed any number of times: the bits are those of a single run.
//!
//! Values of the scene file are checked when `Settings` are made of it, each by itself, with its place in the file. Combinations are checked
//! (`Settings::check`) after flags, or a program, have changed them. Those errors name flags, because most readers of them have typed some.
//!
//! [`method`](crate::method) chooses the acceleration structure and the integrator, once each, before the first ray.

mod camera;
#[cfg(feature = "view")]
mod change;
mod drawing;
mod guesses;
mod hash;
mod lighting;
mod memory;
mod merge;
mod renderer;
mod settings;
mod sisters;
mod state;
mod version;

pub use crate::method::{Error, InvalidSetting};
pub use camera::CameraSettings;
pub(crate) use camera::{FoundCamera, inspect_camera};
pub use guesses::Guesses;
pub use merge::{Joined, Parts};
pub use renderer::{Renderer, Unfinished};
pub use settings::{MAX_SAMPLES_FOR_NOISE, Settings};
pub use state::RenderState;
pub use version::{BUILD, version_text};

pub(crate) use crate::method::{AnyAccel, Prepared, RenderContext};
pub(crate) use drawing::name_of_axis;
pub(crate) use memory::Memory;
pub(crate) use renderer::denoised;
pub(crate) use settings::all_threads;

use crate::camera::{Camera, CameraDescription, CameraParameters};
use crate::description::{Loaded, SceneFile, Unlit, load_scene_to_light};
use crate::files::MemoryLimit;
use crate::film::{Aov, Filter};
use crate::guess::{CameraGuess, Plan, Sisters};
use crate::integrator::{Backdrop, World};
use crate::io::{Finding, LoadObserver, Warning};
use crate::light::LightSelection;
use crate::light_paths::{LightPathError, LightPaths};
use crate::lint;
use crate::math::Vec3;
use crate::options::Method;
use crate::scene::Scene;
use memory::{check_pixels, within_memory};
use settings::{Surveyed, Wanted};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// A scene that is in memory, with all that is settled about its render.
pub struct Session {
    settings: Settings,
    scene: Scene,
    camera: Camera,
    /// What the camera is made of.
    description: CameraDescription,
    filter: Filter,
    backdrop: Backdrop,
    /// Made when it is first asked for.
    scene_hash: OnceLock<String>,
    warnings: Vec<Warning>,
    /// What separates light paths, where they are distinguished.
    paths: Option<Arc<LightPaths>>,
    /// Guess of the camera, if one was made.
    camera_guess: Option<CameraGuess>,
    /// Evidence of other files of the folder on the upright axis, if it was needed.
    sisters: Sisters,
    /// Given settings of the camera, without guesses, which `settings` include if light or ground were guessed or changed.
    said_camera: CameraSettings,
    /// Description of the guess of light or ground, if one was made.
    lit_words: Option<LitWords>,
    /// The scene file in a light that was guessed, or that depends on a guessed camera.
    lit_file: Option<SceneFile>,
    /// Files that the scene was read from.
    files: Vec<PathBuf>,
    /// Bytes that the render takes at most, about.
    memory: u64,
    pool: rayon::ThreadPool,
    /// Choice of lights of the scene, and what it has learned.
    light_selection: LightSelection,
    /// The acceleration structure, where it outlives a renderer.
    kept: Option<AnyAccel<'static>>,
    /// Seconds in which camera and light were guessed.
    guess_seconds: f64,
}

impl Session {
    /// Reads the scene's files. `observer` is told how far that is; `&()` is not interested.
    ///
    /// # Errors
    ///
    /// Settings that cannot be, wrong files, a scene that takes more memory than it may.
    pub fn load(file: &SceneFile, settings: Settings, observer: &dyn LoadObserver) -> Result<Self, Error> {
        settings.check()?;
        let limit = MemoryLimit::of(file.load.max_memory);
        if file.ground.is_some() {
            settings.method().check_catching()?;
        }
        // Before anything is read; groups of lights are not known yet.
        check_pixels(&settings, settings.light_paths.len(), limit)?;
        let pool = thread_pool(settings.threads)?;
        let method = settings.method();
        let builder = method.scene_builder();
        let (loaded, unlit) = pool.install(|| load_scene_to_light(file, builder, observer))?;
        Self::settle((file, settings), (loaded, Some(unlit)), pool, observer)
    }

    /// The camera.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Seconds in which camera and light were guessed, or the camera that is named was placed.
    pub(crate) fn guess_seconds(&self) -> f64 {
        self.guess_seconds
    }

    /// Settles the camera of a scene that was read, and its light: `unlit` builds it again.
    fn settle(
        (file, settings): (&SceneFile, Settings),
        (loaded, unlit): (Loaded, Option<Unlit>),
        pool: rayon::ThreadPool,
        observer: &dyn LoadObserver,
    ) -> Result<Self, Error> {
        let limit = MemoryLimit::of(file.load.max_memory);
        let method = settings.method();
        let Loaded {
            scene,
            mut warnings,
            files,
        } = loaded;
        check_groups(&settings, &scene)?;
        let settings = settings.drawn(&scene)?;
        settings.check()?;
        check_pixels(&settings, settings.parts_of_light(&scene), limit)?;
        let (scene, memory) = within_memory(file, &settings, scene, limit)?;
        observer.begin("finding camera and light", 1);
        let start = Instant::now();
        let (found, lit) = camera_and_lit(file, &settings, (&scene, &warnings), &pool)?;
        let guess_seconds = start.elapsed().as_secs_f64();
        let FoundCamera {
            camera,
            description,
            guess,
            sisters,
        } = found;
        if let Some(lit) = lit {
            let relit = Self::relit((&lit.file, lit.settings), (scene, unlit), pool, observer)?;
            return Ok(Self {
                camera_guess: guess,
                guess_seconds: guess_seconds + relit.guess_seconds,
                lit_words: lit.words,
                lit_file: Some(lit.file.clone()),
                said_camera: settings.camera,
                sisters,
                ..relit
            });
        }
        method.check_ground(&scene)?;
        let light_selection = scene.light_selection(method.light_choice());
        let extent = lint::inspect_extent(&scene, &|message| file.whole(message));
        warnings.extend(extent.iter().map(Finding::warning));
        warnings.extend(method_warnings(&method, (&scene, &light_selection), &camera)?);
        Ok(Self {
            backdrop: backdrop(&settings, &description.parameters),
            scene_hash: OnceLock::new(),
            filter: settings.filter(),
            said_camera: settings.camera,
            paths: light_paths(&settings)?,
            settings,
            scene,
            light_selection,
            camera,
            description,
            warnings,
            camera_guess: guess,
            sisters,
            lit_words: None,
            lit_file: None,
            files,
            memory,
            pool,
            kept: None,
            guess_seconds,
        })
    }

    /// The scene in the light of `file`. It is read again only if it is not as it was read.
    fn relit(
        (file, settings): (&SceneFile, Settings),
        (scene, unlit): (Scene, Option<Unlit>),
        pool: rayon::ThreadPool,
        observer: &dyn LoadObserver,
    ) -> Result<Self, Error> {
        settings.check()?;
        if file.ground.is_some() {
            settings.method().check_catching()?;
        }
        let loaded = match unlit {
            Some(unlit) => pool.install(|| unlit.lit(file, scene, observer))?,
            None => None,
        };
        match loaded {
            Some(loaded) => Self::settle((file, settings), (loaded, None), pool, observer),
            None => Self::load(file, settings, observer),
        }
    }

    /// Takes a scene that was made in code, seen by `camera`; what the settings say of cameras does not count.
    ///
    /// # Errors
    ///
    /// Settings that cannot be, a camera that sees nothing, lights that the estimator cannot find.
    pub fn new(scene: Scene, camera: CameraParameters, settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        check_pixels(&settings, settings.parts_of_light(&scene), MemoryLimit::of(None))?;
        check_groups(&settings, &scene)?;
        let scene = if settings.compact { scene.into_compact() } else { scene };
        let memory = Memory::new(&scene, &settings).peak();
        let description = CameraDescription::still(camera);
        let camera = description.camera(settings.resolution)?;
        let method = settings.method();
        method.check_ground(&scene)?;
        let light_selection = scene.light_selection(method.light_choice());
        let warnings = method_warnings(&method, (&scene, &light_selection), &camera)?;
        Ok(Self {
            backdrop: backdrop(&settings, &description.parameters),
            scene_hash: OnceLock::new(),
            filter: settings.filter(),
            camera,
            description,
            warnings,
            camera_guess: None,
            sisters: Sisters::default(),
            lit_words: None,
            lit_file: None,
            said_camera: settings.camera,
            files: Vec::new(),
            memory,
            pool: thread_pool(settings.threads)?,
            paths: light_paths(&settings)?,
            settings,
            scene,
            light_selection,
            kept: None,
            guess_seconds: 0.0,
        })
    }

    /// Builds the acceleration structure.
    ///
    /// # Errors
    ///
    /// The backend's own, such as memory that is not to be had.
    pub fn renderer(&self) -> Result<Renderer<'_>, Error> {
        Renderer::build(self)
    }

    /// Builds the acceleration structure for all renderers to come, where the backend has one that can be kept.
    ///
    /// # Errors
    ///
    /// The backend's own, such as memory that is not to be had.
    pub fn keep_accel(&mut self) -> Result<(), Error> {
        self.check_memory()?;
        self.kept = self.settings.backend.build_kept(&self.scene, &self.pool)?;
        Ok(())
    }

    /// The acceleration structure: the one that is kept, or a new one.
    fn accel(&self) -> Result<AnyAccel<'_>, Error> {
        match &self.kept {
            Some(accel) => Ok(accel.clone()),
            None => self.settings.backend.build(&self.scene, &self.pool),
        }
    }

    /// The acceleration structure for guesses: the one that is kept, or a new one.
    fn accel_for_guesses(&self) -> Result<AnyAccel<'_>, Error> {
        match &self.kept {
            Some(accel) => Ok(accel.clone()),
            None => self.settings.backend.for_guesses().build(&self.scene, &self.pool),
        }
    }

    /// What the render is to be.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What light meets.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What the camera is made of.
    pub fn camera_description(&self) -> &CameraDescription {
        &self.description
    }

    /// SHA-256 over scene and camera, in hexadecimal.
    pub fn scene_hash(&self) -> &str {
        self.scene_hash
            .get_or_init(|| hash::scene_hash(&self.scene, &self.description))
    }

    /// Warnings about the scene.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Guess of the camera, if one was made.
    pub fn camera_guess(&self) -> Option<&CameraGuess> {
        self.camera_guess.as_ref()
    }

    /// Guess of the light, if one was made.
    pub fn light_guess(&self) -> Option<&str> {
        self.lit_words.as_ref()?.light()
    }

    /// Guess of a ground under light that was given, if one was made.
    pub(crate) fn ground_guess(&self) -> Option<&str> {
        self.lit_words.as_ref()?.ground()
    }

    /// The scene file in a light that was guessed, or that depends on a guessed camera; `None` where it is that of the given file.
    pub fn lit_file(&self) -> Option<&SceneFile> {
        self.lit_file.as_ref()
    }

    /// Cameras to choose from, each with the shortest flags that name it.
    ///
    /// # Errors
    ///
    /// Those of building an acceleration structure.
    pub fn candidate_cameras(&self) -> Result<Vec<(String, CameraGuess)>, Error> {
        let accel = self.accel_for_guesses()?;
        let camera = &self.said_camera;
        let finder = || camera.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.sisters);
        Ok(self.pool.install(|| finder().candidates()))
    }

    /// The plan of an interior with `cameras`, `size` pixels along its larger edge, and the
    /// coordinates of its edges in words; `None` of an object.
    ///
    /// # Errors
    ///
    /// Those of building an acceleration structure.
    pub fn plan(&self, cameras: &[CameraGuess], size: usize) -> Result<Option<(Plan, String)>, Error> {
        let accel = self.accel_for_guesses()?;
        let camera = &self.said_camera;
        let finder = || camera.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.sisters);
        Ok(self.pool.install(|| {
            let finder = finder();
            let plan = finder.plan(cameras, size)?;
            let edges = finder.edges_text(&plan);
            Some((plan, edges))
        }))
    }

    /// Sees the scene by another camera, a pinhole.
    ///
    /// # Errors
    ///
    /// A camera that sees nothing.
    pub fn look_through(&mut self, guess: &CameraGuess) -> Result<(), Error> {
        let description = CameraDescription::still(guess.parameters());
        self.camera = description.camera(self.settings.resolution)?;
        self.light_selection.forget();
        self.scene_hash = OnceLock::new();
        self.backdrop = backdrop(&self.settings, &description.parameters);
        self.description = description;
        Ok(())
    }

    /// All files that the scene was read from: nothing may be written over them. None of a scene that was made in code.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// About how many bytes the render takes at most.
    pub fn memory(&self) -> u64 {
        self.memory
    }

    /// Runs `work` with the session's threads.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    pub(crate) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// What all samples of the picture look at, which is yet to be made.
    pub(crate) fn prepared(&self) -> Prepared {
        Prepared::new(self.settings.resolution, self.settings.seed)
    }

    /// What separates light paths, where they are distinguished.
    pub(crate) fn paths(&self) -> Option<&Arc<LightPaths>> {
        self.paths.as_ref()
    }

    /// What integrators work in, where `accel` answers ray queries.
    pub(crate) fn world<'a, A>(&'a self, accel: &'a A) -> World<'a, A> {
        World {
            scene: &self.scene,
            accel,
            light_selection: &self.light_selection,
            camera: &self.camera,
            filter: &self.filter,
            features: self.settings.aovs.iter().any(|aov| aov.is_of_surface()),
            strategies: self.settings.aovs.contains(&Aov::Strategies),
            paths: self.paths.as_deref(),
            backdrop: self.backdrop,
        }
    }
}

/// A scene file whose light or ground was guessed, or follows the camera.
pub(crate) struct LitFile {
    /// The scene file with the sections of the light.
    pub file: SceneFile,
    /// Settings with the camera that the light is for, and the background of guessed light.
    pub settings: Settings,
    /// Description of what was guessed.
    pub words: Option<LitWords>,
}

/// Description for users of a guess.
#[derive(Clone, Debug)]
pub(crate) enum LitWords {
    /// Of the light, with a ground if that was guessed too.
    Light(String),
    /// Of the ground alone.
    Ground(String),
}

impl LitWords {
    /// Description of a guessed light.
    pub fn light(&self) -> Option<&str> {
        match self {
            Self::Light(words) => Some(words),
            Self::Ground(_) => None,
        }
    }

    /// Description of a ground that was guessed without light.
    pub fn ground(&self) -> Option<&str> {
        match self {
            Self::Light(_) => None,
            Self::Ground(words) => Some(words),
        }
    }
}

/// The camera of `settings` in the scene of `file`. With it the scene file in another light: with a
/// guessed one if nothing lights the scene and `settings`
/// ask for a guess, or with changes of light that depend on a guessed camera. `warnings` are those of loading the scene.
///
/// # Errors
///
/// Those of [`Settings::camera_of`].
pub(crate) fn camera_and_lit(
    file: &SceneFile,
    settings: &Settings,
    (scene, warnings): (&Scene, &[Warning]),
    pool: &rayon::ThreadPool,
) -> Result<(FoundCamera, Option<LitFile>), Error> {
    let wanted = Wanted {
        survey: lighting::may_want_ground(file, settings, scene),
        light: lighting::may_want_light(file, settings, (scene, warnings)),
    };
    let (found, surveyed) = settings.camera_and_survey(file, scene, pool, wanted)?;
    let parameters = &found.description.parameters;
    let lit = match surveyed {
        Some(Surveyed {
            survey,
            light: Some(light),
        }) => Some(lighting::lit(file, settings, (light, &survey), parameters)),
        surveyed => {
            let survey = surveyed.as_ref().map(|surveyed| &surveyed.survey);
            let viewpoint = found.viewpoint(&settings.camera);
            lighting::changed((file, scene, survey), settings, &viewpoint, parameters)
        }
    };
    Ok((found, lit))
}

/// Kinds of the warnings of [`method_warnings`], in their order.
const METHOD_WARNINGS: [&str; 3] = ["unmet-light", "motion", "many-lamps"];

/// What of the scene the method does not find, or takes otherwise.
fn method_warnings(
    method: &Method,
    (scene, selection): (&Scene, &LightSelection),
    camera: &Camera,
) -> Result<Vec<Warning>, Error> {
    method.check_dispersion(scene)?;
    let lights = method.check_lights(scene)?;
    let motion = method.check_motion(scene, camera);
    let lamps = method.check_lamps(selection);
    let warnings = METHOD_WARNINGS.into_iter().zip([lights, motion, lamps]);
    let warnings = warnings.map(|(kind, text)| text.map(|text| Warning::new(kind, text)));
    Ok(warnings.flatten().collect())
}

/// What camera rays see where they leave the scene; up is that of the camera.
fn backdrop(settings: &Settings, camera: &CameraParameters) -> Backdrop {
    Backdrop {
        background: settings.background,
        up: camera.up.normalize_or(Vec3::Y),
    }
}

/// Bytes of a thread's stack: integrators that branch recurse, a vertex at a time. Pages that are not used take no memory.
const STACK: usize = 16 << 20;

/// Pool of so many threads.
pub(crate) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build();
    pool.map_err(|error| Error::Failed(format!("cannot start {threads} threads: {error}")))
}

/// What separates light paths, where `settings` want that.
fn light_paths(settings: &Settings) -> Result<Option<Arc<LightPaths>>, Error> {
    match settings.paths() {
        Ok(paths) => Ok(paths.map(Arc::new)),
        Err(LightPathError { message, help }) => Err(InvalidSetting::new("aov", message, help).into()),
    }
}

/// An error where the lights of a scene that has no groups are to be distinguished.
fn check_groups(settings: &Settings, scene: &Scene) -> Result<(), Error> {
    if settings.aovs.contains(&Aov::Lights) && scene.light_groups().is_empty() {
        let help = "give a [[light]] a `group`, or add a [[light_group]]";
        return Err(InvalidSetting::new("aov", "lights: this scene has no light groups", help).into());
    }
    Ok(())
}
