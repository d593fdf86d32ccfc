//! A render from scene file to picture: the interface of programs that use this crate, such as the
//! command line.
//!
//! [`Settings`] describe the render. A [`Session`] has the loaded scene. A [`Renderer`] of the
//! session has an acceleration structure, and adds samples to a [`RenderState`] until an observer
//! stops the render. A render may be stopped and resumed any number of times: the result is
//! bit-identical to a single run.
//!
//! Single values of a scene file are checked when the file is read. These errors name the place in
//! the file. `Settings::check` checks combinations of values, after flags or a program have changed
//! the values. These errors name flags, because most users have typed flags.
//!
//! [`pipeline`](crate::pipeline) selects the acceleration structure and the integrator once, before
//! the first ray.

mod camera;
#[cfg(feature = "view")]
mod change;
mod drawing;
mod guessed_picture;
mod guesses;
mod hash;
mod levels;
mod lighting;
mod memory;
mod merge;
mod renderer;
mod settings;
mod siblings;
mod state;
mod version;
mod views;

pub use crate::pipeline::{Error, InvalidSetting};
pub use camera::CameraSettings;
pub(crate) use camera::{FoundCamera, inspect_camera};
pub use guesses::Guesses;
pub use merge::{JoinedPicture, PictureParts};
pub use renderer::{Renderer, Unfinished};
pub use settings::{MAX_SAMPLES_FOR_NOISE, Settings};
pub use state::RenderState;
pub use version::{BUILD, version_text};

pub(crate) use crate::pipeline::{AnyAccel, Preparation, RenderContext};
pub(crate) use drawing::name_of_axis;
pub(crate) use guessed_picture::camera_and_lit;
pub(crate) use lighting::LitWords;
pub(crate) use memory::Memory;
pub(crate) use renderer::denoise;
pub(crate) use settings::all_threads;

use crate::camera::{Camera, CameraDescription, CameraParameters, View};
use crate::files::MemoryLimit;
use crate::film::{Aov, Filter};
use crate::guess::{CameraGuess, Plan, SiblingFiles};
use crate::integrator::{Backdrop, World};
use crate::io::{Finding, LoadObserver, Warning};
use crate::light_paths::{LightPathError, LightPaths};
use crate::light_sampling::LightSelection;
use crate::lint;
use crate::math::Vec3;
use crate::options::ChosenIntegrator;
use crate::scene::Scene;
use crate::scene_file::{LoadedScene, SceneFile, UnlitScene, load_scene_to_light};
use memory::{check_pixels, within_memory};
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// A loaded scene with all settings of its render.
pub struct Session {
    settings: Settings,
    scene: Scene,
    camera: Camera,
    /// Views of the picture, each with a separate camera, such as the two eyes of a stereo picture.
    views: Vec<View>,
    /// Description of the camera.
    description: CameraDescription,
    filter: Filter,
    backdrop: Backdrop,
    /// Scene hash, computed at the first use.
    scene_hash: OnceLock<String>,
    warnings: Vec<Warning>,
    /// Classifier of light paths, if light path channels are requested.
    paths: Option<Arc<LightPaths>>,
    /// Guess of the camera, if one was made.
    camera_guess: Option<CameraGuess>,
    /// Evidence from other files of the folder for the upright axis, if it was needed.
    siblings: SiblingFiles,
    /// Camera settings as given, without guesses. `settings` include guesses if light or ground
    /// were guessed or changed.
    given_camera: CameraSettings,
    /// Description of the guess of light or ground, if one was made.
    lit_words: Option<LitWords>,
    /// The scene file with guessed light, with light that was placed for a guessed camera, or with
    /// numbers of subdivision steps that follow from the camera. `None` if nothing changed.
    lit_file: Option<SceneFile>,
    /// Files from which the scene was read.
    files: Vec<PathBuf>,
    /// Estimated peak memory of the render in bytes.
    memory: u64,
    pool: rayon::ThreadPool,
    /// Selection of the lights of the scene, with the learned visibility of lights.
    light_selection: LightSelection,
    /// The acceleration structure, if it is kept for several renderers.
    kept: Option<AnyAccel<'static>>,
    /// Time in seconds to guess the camera and the light.
    guess_seconds: f64,
}

impl Session {
    /// Reads the files of the scene. `observer` is informed about the progress; `&()` ignores the
    /// progress.
    ///
    /// # Errors
    ///
    /// Invalid settings, invalid files, or a scene that exceeds the memory limit.
    pub fn load(file: &SceneFile, settings: Settings, observer: &dyn LoadObserver) -> Result<Self, Error> {
        settings.check()?;
        let limit = MemoryLimit::of(file.load.max_memory);
        if file.ground.is_some() {
            settings.chosen_integrator().check_catching()?;
        }
        // Check before any file is read. The number of light groups is not known yet.
        check_pixels(&settings, settings.light_paths.len(), limit)?;
        if file.has_levels_by_pixels() {
            return Self::load_by_pixels(file, settings, observer);
        }
        let pool = thread_pool(settings.threads)?;
        let integrator = settings.chosen_integrator();
        let builder = integrator.scene_builder();
        let (loaded, unlit) = pool.install(|| load_scene_to_light(file, builder, observer))?;
        Self::settle((file, settings), (loaded, Some(unlit)), pool, observer)
    }

    /// The camera of the whole picture. A cube map is one camera here: its faces are views.
    pub(crate) fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Time in seconds to guess the camera and the light, or to place a named camera.
    pub(crate) fn guess_seconds(&self) -> f64 {
        self.guess_seconds
    }

    /// Determines the camera and the light of a loaded scene. `unlit` has the data to build the
    /// scene again if the light changes.
    fn settle(
        (file, settings): (&SceneFile, Settings),
        (loaded, unlit): (LoadedScene, Option<UnlitScene>),
        pool: rayon::ThreadPool,
        observer: &dyn LoadObserver,
    ) -> Result<Self, Error> {
        let limit = MemoryLimit::of(file.load.max_memory);
        let integrator = settings.chosen_integrator();
        let LoadedScene {
            scene,
            mut warnings,
            files,
        } = loaded;
        check_groups(&settings, &scene)?;
        let settings = settings.drawn(file, &scene, &pool)?;
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
            siblings,
        } = found;
        if let Some(lit) = lit {
            let relit = Self::relit((&lit.file, lit.settings), (scene, unlit), pool, observer)?;
            return Ok(Self {
                camera_guess: guess,
                guess_seconds: guess_seconds + relit.guess_seconds,
                lit_words: lit.words,
                lit_file: Some(lit.file.clone()),
                given_camera: settings.camera,
                siblings,
                ..relit
            });
        }
        integrator.check_ground(&scene)?;
        let light_selection = scene.light_selection(integrator.light_choice());
        let extent = lint::inspect_extent(&scene, &|message| file.whole(message));
        warnings.extend(extent.iter().map(Finding::warning));
        warnings.extend(integrator_warnings(&integrator, (&scene, &light_selection), &camera)?);
        Ok(Self {
            views: description.views(settings.resolution)?,
            backdrop: backdrop(&settings, &description.parameters),
            scene_hash: OnceLock::new(),
            filter: settings.filter(),
            given_camera: settings.camera,
            paths: light_paths(&settings)?,
            settings,
            scene,
            light_selection,
            camera,
            description,
            warnings,
            camera_guess: guess,
            siblings,
            lit_words: None,
            lit_file: None,
            files,
            memory,
            pool,
            kept: None,
            guess_seconds,
        })
    }

    /// Session with the light of `file`. Keeps the triangles and textures of `scene`. If `unlit` is
    /// missing, or if the triangles or textures differ from the triangles or textures that were
    /// read with `unlit`, the scene is read again.
    fn relit(
        (file, settings): (&SceneFile, Settings),
        (scene, unlit): (Scene, Option<UnlitScene>),
        pool: rayon::ThreadPool,
        observer: &dyn LoadObserver,
    ) -> Result<Self, Error> {
        settings.check()?;
        if file.ground.is_some() {
            settings.chosen_integrator().check_catching()?;
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

    /// Makes a session for a scene made in code, with the camera `camera`. Camera settings in
    /// `settings` are ignored.
    ///
    /// # Errors
    ///
    /// Invalid settings, an invalid camera, or lights that the integrator cannot sample.
    pub fn new(scene: Scene, camera: CameraParameters, settings: Settings) -> Result<Self, Error> {
        settings.check()?;
        check_pixels(&settings, settings.parts_of_light(&scene), MemoryLimit::of(None))?;
        check_groups(&settings, &scene)?;
        let scene = if settings.compact { scene.into_compact() } else { scene };
        let memory = Memory::new(&scene, &settings).peak();
        let description = CameraDescription::still(camera);
        let camera = description.camera(settings.resolution)?;
        let integrator = settings.chosen_integrator();
        integrator.check_ground(&scene)?;
        let light_selection = scene.light_selection(integrator.light_choice());
        let warnings = integrator_warnings(&integrator, (&scene, &light_selection), &camera)?;
        Ok(Self {
            views: description.views(settings.resolution)?,
            backdrop: backdrop(&settings, &description.parameters),
            scene_hash: OnceLock::new(),
            filter: settings.filter(),
            camera,
            description,
            warnings,
            camera_guess: None,
            siblings: SiblingFiles::default(),
            lit_words: None,
            lit_file: None,
            given_camera: settings.camera,
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

    /// Builds the acceleration structure and returns a renderer.
    ///
    /// # Errors
    ///
    /// Errors of the backend, such as a lack of memory.
    pub fn renderer(&self) -> Result<Renderer<'_>, Error> {
        Renderer::build(self)
    }

    /// Builds the acceleration structure and keeps it for all later renderers, if the structure of
    /// the backend can be kept.
    ///
    /// # Errors
    ///
    /// Errors of the backend, such as a lack of memory.
    pub fn keep_accel(&mut self) -> Result<(), Error> {
        self.check_memory()?;
        self.kept = self.settings.backend.build_kept(&self.scene, &self.pool)?;
        Ok(())
    }

    /// The kept acceleration structure, or a new one if none is kept.
    fn accel(&self) -> Result<AnyAccel<'_>, Error> {
        match &self.kept {
            Some(accel) => Ok(accel.clone()),
            None => self.settings.backend.build(&self.scene, &self.pool),
        }
    }

    /// An acceleration structure to trace the rays of guesses: the kept structure, or a new one.
    fn accel_for_guesses(&self) -> Result<AnyAccel<'_>, Error> {
        match &self.kept {
            Some(accel) => Ok(accel.clone()),
            None => self.settings.backend.for_guesses().build(&self.scene, &self.pool),
        }
    }

    /// Settings of the render.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The frozen scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Description of the camera.
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

    /// Description of the guessed light, if light was guessed.
    pub fn light_guess(&self) -> Option<&str> {
        self.lit_words.as_ref()?.light()
    }

    /// Description of the guessed ground, if a ground was guessed and no light.
    pub(crate) fn ground_guess(&self) -> Option<&str> {
        self.lit_words.as_ref()?.ground()
    }

    /// The scene file with guessed light, with light that was placed for a guessed camera, or with
    /// numbers of subdivision steps that follow from the camera. `None` if nothing changed.
    pub fn lit_file(&self) -> Option<&SceneFile> {
        self.lit_file.as_ref()
    }

    /// Candidate cameras. Each has the shortest flags that select it.
    ///
    /// # Errors
    ///
    /// Errors of building an acceleration structure.
    pub fn candidate_cameras(&self) -> Result<Vec<(String, CameraGuess)>, Error> {
        let accel = self.accel_for_guesses()?;
        let camera = &self.given_camera;
        let finder = || camera.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.siblings);
        Ok(self.pool.install(|| finder().candidates()))
    }

    /// Draws the plan of an interior with `cameras`. `size` is the number of pixels along the
    /// longer side of the plan. Also returns a text with the coordinates of the plan's edges.
    /// `None` if the scene is an object.
    ///
    /// # Errors
    ///
    /// Errors of building an acceleration structure.
    pub fn plan(&self, cameras: &[CameraGuess], size: usize) -> Result<Option<(Plan, String)>, Error> {
        let accel = self.accel_for_guesses()?;
        let camera = &self.given_camera;
        let finder = || camera.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.siblings);
        Ok(self.pool.install(|| {
            let finder = finder();
            let plan = finder.plan(cameras, size)?;
            let edges = finder.edges_text(&plan);
            Some((plan, edges))
        }))
    }

    /// Changes the camera to the pinhole camera of `guess`.
    ///
    /// # Errors
    ///
    /// The camera is invalid.
    pub fn look_through(&mut self, guess: &CameraGuess) -> Result<(), Error> {
        let description = CameraDescription::still(guess.parameters());
        self.camera = description.camera(self.settings.resolution)?;
        self.views = description.views(self.settings.resolution)?;
        self.light_selection.forget();
        self.scene_hash = OnceLock::new();
        self.backdrop = backdrop(&self.settings, &description.parameters);
        self.description = description;
        Ok(())
    }

    /// All files from which the scene was read. The program must not overwrite them. Empty for a
    /// scene made in code.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Estimated peak memory of the render in bytes.
    pub fn memory(&self) -> u64 {
        self.memory
    }

    /// Runs `work` on the threads of the session.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool.install(work)
    }

    pub(crate) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// New data that all samples of the picture share. It is not computed yet.
    pub(crate) fn prepared(&self) -> Preparation {
        Preparation::new(self.settings.resolution, self.settings.seed)
    }

    /// Classifier of light paths, if light path channels are requested.
    pub(crate) fn paths(&self) -> Option<&Arc<LightPaths>> {
        self.paths.as_ref()
    }

    /// World for the integrators: the scene and the ray queries of `accel`.
    pub(crate) fn world<'a, A>(&'a self, accel: &'a A) -> World<'a, A> {
        World {
            scene: &self.scene,
            accel,
            light_selection: &self.light_selection,
            camera: &self.camera,
            filter: &self.filter,
            features: self.settings.aovs.iter().any(|aov| aov.is_of_surface()),
            lines: None,
            strategies: self.settings.aovs.contains(&Aov::Strategies),
            paths: self.paths.as_deref(),
            backdrop: self.backdrop,
        }
    }
}

/// Kinds of warnings that [`integrator_warnings`] returns.
const INTEGRATOR_WARNINGS: [&str; 3] = ["unmet-light", "motion", "many-lamps"];

/// Warnings about lights, motion and lamps that the integrator cannot find, or treats differently
/// than other integrators.
fn integrator_warnings(
    integrator: &ChosenIntegrator,
    (scene, selection): (&Scene, &LightSelection),
    camera: &Camera,
) -> Result<Vec<Warning>, Error> {
    integrator.check_dispersion(scene)?;
    let lights = integrator.check_lights(scene)?;
    let motion = integrator.check_motion(scene, camera);
    let lamps = integrator.check_lamps(selection);
    let warnings = INTEGRATOR_WARNINGS.into_iter().zip([lights, motion, lamps]);
    let warnings = warnings.map(|(kind, text)| text.map(|text| Warning::new(kind, text)));
    Ok(warnings.flatten().collect())
}

/// Background of camera rays that leave the scene. Its upward direction is the up of the camera.
fn backdrop(settings: &Settings, camera: &CameraParameters) -> Backdrop {
    Backdrop {
        background: settings.background,
        up: camera.up.normalize_or(Vec3::Y),
    }
}

/// Stack size of a thread in bytes. Integrators that branch make a recursive call at each vertex.
/// Unused pages of the stack need no memory.
const STACK: usize = 16 << 20;

/// Makes a pool of `threads` threads.
pub(crate) fn thread_pool(threads: usize) -> Result<rayon::ThreadPool, Error> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .stack_size(STACK)
        .build();
    pool.map_err(|error| Error::Failed(format!("cannot start {threads} threads: {error}")))
}

/// Classifier of light paths, if `settings` have light path channels.
fn light_paths(settings: &Settings) -> Result<Option<Arc<LightPaths>>, Error> {
    match settings.paths() {
        Ok(paths) => Ok(paths.map(Arc::new)),
        Err(LightPathError { message, help }) => Err(InvalidSetting::new("aov", message, help).into()),
    }
}

/// Returns an error if channels of light groups are requested for a scene without light groups.
fn check_groups(settings: &Settings, scene: &Scene) -> Result<(), Error> {
    if settings.aovs.contains(&Aov::Lights) && scene.light_groups().is_empty() {
        let help = "give a [[light]] a `group`, or add a [[light_group]]";
        return Err(InvalidSetting::new("aov", "lights: this scene has no light groups", help).into());
    }
    Ok(())
}
