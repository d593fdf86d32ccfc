//! A session with its acceleration structure. It renders, resumes renders, and develops pictures.
//!
//! `Renderer::resume` compares the metadata of a file with the render: version, build, scene hash,
//! settings, seed, backend with version and instruction set, size, crop and first sample. Settings
//! name the number of samples only if the sampler depends on it (`hammersley`, `orthogonal`,
//! `--directions perturbed-qmc` and `fibonacci`).

mod denoising;
mod faults;
mod views;

pub use denoising::Unfinished;
pub(crate) use denoising::denoise;

use super::memory::check_pixels;
use super::{AnyAccel, BUILD, Error, Preparation, RenderContext, RenderState, Session};
use crate::accel::{Accel, Auditor, BackendInfo};
use crate::camera::CameraAttributes;
use crate::files::Output;
use crate::film::{Aov, Film, Image};
#[cfg(feature = "view")]
use crate::integrator::PickedSurface;
use crate::integrator::{SampleTracer, TracerIntegrator, World};
use crate::io::{Checkpoint, FeatureNames, FileError, Format, Metadata};
#[cfg(feature = "view")]
use crate::math::UVec2;
use crate::options::view_size_text;
use crate::render::{self, Observer, Outcome, Statistics};
use std::time::Instant;
use views::ViewData;

/// A session with a built acceleration structure. It renders samples, and makes pictures from them.
pub struct Renderer<'a> {
    session: &'a Session,
    accel: AnyAccel<'a>,
    build_seconds: f64,
    prepared: Preparation,
    /// Data of each view; empty if the picture has one view.
    views: Vec<ViewData>,
}

impl<'a> Renderer<'a> {
    pub(super) fn build(session: &'a Session) -> Result<Self, Error> {
        let start = Instant::now();
        session.check_memory()?;
        let accel = session.accel()?;
        // Check the memory again: the acceleration structure of a backend may be larger than
        // estimated
        let parts = session.settings().parts_of_light(session.scene());
        check_pixels(session.settings(), parts, None)?;
        Ok(Self {
            session,
            accel,
            build_seconds: start.elapsed().as_secs_f64(),
            prepared: session.prepared(),
            views: ViewData::of(session),
        })
    }

    /// Renderer that traces rays with `auditor`, a backend that checks the results of some rays.
    pub(crate) fn audited(session: &'a Session, auditor: &'a Auditor<'a>, build_seconds: f64) -> Self {
        Self {
            session,
            accel: AnyAccel::Audited(auditor),
            build_seconds,
            prepared: session.prepared(),
            views: ViewData::of(session),
        }
    }

    /// Ray queries on the acceleration structure, for programs that call the library.
    pub fn queries(&self) -> &dyn Accel {
        self.accel.as_dyn()
    }

    /// The acceleration structure.
    pub(crate) fn accel(&self) -> &AnyAccel<'a> {
        &self.accel
    }

    /// Data that all samples share. It is ready after the first sample of [`Renderer::render`], or
    /// after [`Renderer::prepare`].
    pub(crate) fn prepared(&self) -> &Preparation {
        &self.prepared
    }

    /// Fraction of the records of an irradiance cache that are doubtful: most of their light comes
    /// from few of their rays. If the picture has several views, it is the maximum over the views.
    /// `None` if there are no records.
    pub(crate) fn doubtful_records(&self) -> Option<f64> {
        let all = std::iter::once(&self.prepared).chain(self.views.iter().map(|view| &view.prepared));
        all.filter_map(Preparation::doubtful_records).reduce(f64::max)
    }

    fn context(&self) -> RenderContext<'_, AnyAccel<'a>> {
        RenderContext {
            world: self.world(),
            prepared: &self.prepared,
        }
    }

    /// World of the session. It finds lines along edges if the picture has the channel `lines`.
    fn world(&self) -> World<'_, AnyAccel<'a>> {
        let settings = self.session.settings();
        World {
            lines: settings.aovs.contains(&Aov::Lines).then(|| settings.lines.style()),
            ..self.session.world(&self.accel)
        }
    }

    /// Computes the data that all samples share, before the first sample.
    pub(crate) fn prepare(&self) {
        let settings = self.session.settings();
        let context = self.context();
        self.session.install(|| {
            settings
                .chosen_integrator()
                .prepare(context, &settings.random_numbers(), &())
        });
    }

    /// Picks the first surface in the middle of a pixel, if a surface is visible there.
    #[cfg(feature = "view")]
    pub(crate) fn pick(&self, pixel: UVec2) -> Option<PickedSurface> {
        let accel = self.accel.as_dyn();
        self.session.world(&accel).pick(self.session.views(), pixel)
    }

    /// Divides the picture into a grid of `size` cells, and finds the cells that show the picked
    /// surface. Returns run lengths, which alternate between cells without and cells with the
    /// surface.
    #[cfg(feature = "view")]
    pub(crate) fn outline(&self, picked: &PickedSurface, size: UVec2) -> Vec<u32> {
        let accel = self.accel.as_dyn();
        let world = self.session.world(&accel);
        self.session
            .install(|| world.outline(self.session.views(), picked, size))
    }

    /// The session of this renderer.
    pub fn session(&self) -> &'a Session {
        self.session
    }

    /// Name, version and instruction set of the backend.
    pub fn backend(&self) -> BackendInfo {
        self.accel.as_dyn().info()
    }

    /// Time in seconds to build the acceleration structure.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// Size of the acceleration structure in bytes.
    pub fn accel_bytes(&self) -> u64 {
        self.accel.as_dyn().bytes()
    }

    /// State of a render without samples.
    pub fn start(&self) -> RenderState {
        let settings = self.session.settings();
        let sizes = (settings.resolution, self.session.view_size());
        let film = Film::of_views(sizes, settings.crop(), settings.samples().start);
        let mut state = RenderState::new(film, settings.backing(), self.feature_names().as_ref());
        self.separate_paths(&mut state);
        state
    }

    /// State of the render in `checkpoint`, to resume it.
    ///
    /// # Errors
    ///
    /// The checkpoint belongs to another render, or has more samples than requested.
    pub fn resume(&self, checkpoint: Checkpoint) -> Result<RenderState, Error> {
        let settings = self.session.settings();
        let refused = |message: String, help: &str| Err(FileError::new(&checkpoint.path, message).help(help).into());
        let build = &checkpoint.metadata.build;
        if build != BUILD {
            return refused(
                format!(
                    "build {build} of this program wrote this checkpoint; this is build {BUILD}, whose results may differ in their last bits"
                ),
                "resume it with the build that wrote it (embrasure --version prints the build), or start again with another --checkpoint",
            );
        }
        let film = &checkpoint.film;
        let (there, here) = (film.crop(), settings.crop());
        let difference = if film.resolution() != settings.resolution {
            Some(format!("image size {} and {}", film.resolution(), settings.resolution))
        } else if there != here {
            let corners = [there, here].map(|r| format!("{},{},{},{}", r.min.x, r.min.y, r.max.x, r.max.y));
            Some(format!("crop {} and {}", corners[0], corners[1]))
        } else if checkpoint.metadata.first_sample != settings.samples().start {
            let first = checkpoint.metadata.first_sample;
            Some(format!("first sample {first} and {}", settings.samples().start))
        } else {
            checkpoint.metadata.difference(&self.metadata_after(0.0, false))
        };
        if let Some(difference) = difference {
            return refused(
                format!(
                    "this checkpoint belongs to another render: {difference} (in the checkpoint and in this render)"
                ),
                "use the earlier flags, also those for reading the scene such as --smooth and --material; or name another --checkpoint",
            );
        }
        let max = film.tiles().iter().map(|tile| tile.next_sample()).max().unwrap_or(0);
        let wanted = settings.samples().end;
        if max > wanted {
            return refused(
                format!("this checkpoint already has {max} samples per pixel, more than the requested {wanted}"),
                "ask for as many or more: samples cannot be removed",
            );
        }
        let mut state = RenderState::of_checkpoint(checkpoint)?;
        self.separate_paths(&mut state);
        Ok(state)
    }

    /// Prepares `state` to store light paths separately, if light path channels are requested.
    fn separate_paths(&self, state: &mut RenderState) {
        if let Some(paths) = self.session.paths() {
            state.film.separate_paths(paths);
        }
    }

    /// Adds the missing samples to `state`. Ends when all samples are added, when the noise level
    /// is reached, or when `observer` stops the render. A stopped render can be resumed. The
    /// picture is bit-identical for all numbers of threads and all times of stopping. If the render
    /// is stopped early, `state` may have no sample ([`RenderState::is_empty`]).
    pub fn render(&self, state: &mut RenderState, observer: &dyn Observer) -> Outcome {
        let settings = self.session.settings();
        let (sampler, integrator) = (settings.random_numbers(), settings.chosen_integrator());
        let render = |context: RenderContext<'_, _>, film: &mut Film, stop| {
            let render = || integrator.render(context, &sampler, film, stop, observer);
            self.session.install(render)
        };
        add_samples(state, |film| self.render_views(film, &render))
    }

    /// Like [`Renderer::render`], but with an integrator of the caller: `tracer` traces each
    /// sample, instead of the integrator in the settings. The metadata of files has the integrator
    /// of the settings ([`Metadata::settings`]) nevertheless.
    pub fn render_with(&self, state: &mut RenderState, tracer: &impl SampleTracer, observer: &dyn Observer) -> Outcome {
        let accel = self.accel.as_dyn();
        let settings = self.session.settings();
        let sampler = settings.random_numbers();
        let render = |context: RenderContext<'_, AnyAccel<'a>>, film: &mut Film, stop| {
            let world = context.world.with_accel(&accel);
            let integrator = TracerIntegrator { world, tracer };
            let render = || render::render_samples(&integrator, &sampler, film, stop, &observer);
            self.session.install(render)
        };
        add_samples(state, |film| self.render_views(film, &render))
    }

    /// Metadata for a picture of `state`. `is_complete` is true if no samples are missing.
    pub fn metadata(&self, state: &RenderState, is_complete: bool) -> Metadata {
        self.metadata_after(state.seconds, is_complete)
    }

    fn metadata_after(&self, render_seconds: f64, is_complete: bool) -> Metadata {
        let (session, settings, info) = (self.session, self.session.settings(), self.backend());
        let samples = settings.samples();
        let attributes = settings.camera.attributes(&session.mean_camera());
        Metadata {
            version: env!("CARGO_PKG_VERSION").into(),
            build: BUILD.into(),
            scene_hash: session.scene_hash().into(),
            settings: settings.describe() + &view_size_text(settings.resolution, session.view_size()),
            common_errors: Some(settings.chosen_integrator().common_errors()),
            first_sample: samples.start,
            end_sample: samples.end,
            total_samples: settings.total_samples(),
            seed: settings.seed,
            backend: info.name.into(),
            backend_version: format!("{} {}", info.version, info.isa),
            render_seconds,
            complete: is_complete,
            features: self.feature_names(),
            finish: settings.finish().to_string(),
            denoiser: None,
            tone: None,
            bias: settings.chosen_integrator().bias(),
            origin: settings.camera.origin_text(),
            camera: Some(CameraAttributes {
                // Several views have no common matrix and no common window
                world_to_ndc: attributes.world_to_ndc.filter(|_| session.views().len() == 1),
                screen_window: attributes.screen_window.filter(|_| session.views().len() == 1),
                ..attributes
            }),
            print: settings.print,
        }
    }

    /// Names of the additional channels, if any are requested.
    fn feature_names(&self) -> Option<FeatureNames> {
        let (settings, scene) = (self.session.settings(), self.session.scene());
        let aovs = &settings.aovs;
        let is_wanted = !(aovs.is_empty() && settings.light_paths.is_empty());
        is_wanted.then(|| FeatureNames {
            aovs: self
                .session
                .settings()
                .aov_names()
                .into_iter()
                .map(String::from)
                .collect(),
            objects: scene.objects().to_vec(),
            parts_of_objects: if aovs.iter().any(|aov| aov.names_parts()) {
                let names = scene.part_names();
                names.parts().map(|part| names.name(part).into_owned()).collect()
            } else {
                Vec::new()
            },
            materials: scene.materials().iter().map(|m| m.name.clone()).collect(),
            lights: if aovs.contains(&Aov::Lights) {
                scene.light_groups().names().to_vec()
            } else {
                Vec::new()
            },
            strategies: if aovs.contains(&Aov::Strategies) {
                self.session.settings().chosen_integrator().strategies()
            } else {
                Vec::new()
            },
            paths: settings
                .light_paths
                .iter()
                .map(|part| part.layer().to_string())
                .collect(),
        })
    }

    /// The current picture with the requested channels, not denoised.
    pub fn develop(&self, state: &RenderState) -> Image {
        let with_error = self.session.settings().noise.is_some();
        state.develop(with_error, self.feature_names().as_ref())
    }

    /// Writes `image`, the picture of `state`, to all `outputs`, and returns the errors. If the
    /// render is a part of a picture, EXR files also get the sums, so that parts can be joined
    /// ([`PictureParts`](super::PictureParts)). If there are no samples, no file is written, and
    /// existing files are kept.
    #[must_use = "the errors name the files that were not written"]
    pub fn write(
        &self,
        state: &RenderState,
        image: &Image,
        outputs: &[(Format, Output)],
        metadata: &Metadata,
    ) -> Vec<FileError> {
        state.write(image, outputs, self.session.settings().is_part(), metadata)
    }

    /// Saves `state` if [`Renderer::write`] could not write any EXR file of `outputs`. The new file
    /// `NAME.rescue.exr` is beside the first output. It has `R G B` and all sums, so that the
    /// render can be resumed. `None` if there are no outputs or no samples.
    pub fn rescue(
        &self,
        state: &RenderState,
        outputs: &[(Format, Output)],
        metadata: &Metadata,
    ) -> Option<Result<Output, FileError>> {
        state.rescue(outputs, metadata)
    }
}

/// Calls `take`, which adds samples to the film of `state`. Adds the statistics and the time of
/// these samples to `state`.
fn add_samples(state: &mut RenderState, take: impl FnOnce(&mut Film) -> (Outcome, Statistics)) -> Outcome {
    let start = Instant::now();
    let (outcome, statistics) = take(&mut state.film);
    state.statistics = std::mem::take(&mut state.statistics).merge(statistics);
    state.seconds += start.elapsed().as_secs_f64();
    outcome
}
