//! Light transport: integrators, which compute the light of one pixel sample. Integrators start no
//! threads and do not depend on tiles or files.
//!
//! Each family of integrators has a folder: `path`, `bidirectional`, `photon`, `metropolis` and
//! `irradiance_cache`. All families use the files that are directly in this folder. Families may
//! use `path` and `bidirectional`; these two use no other family.

mod background;
mod bidirectional;
mod first_surface;
mod found_light;
mod irradiance_cache;
mod lines;
mod listeners;
mod metropolis;
mod opacity;
mod path;
mod path_record;
mod photon;
mod pick;
mod search_radius;
mod vertex;
mod visibility;
mod world;

pub use background::{Backdrop, Background, BackgroundLight, CameraView, Shadow};
pub use bidirectional::bdpt::{BidirectionalIntegrator, strategies};
pub use bidirectional::light_tracing::LightIntegrator;
pub use found_light::{FoundLight, LightSource, path_classes};
pub use irradiance_cache::{
    GatheredHemisphere, Gradients, HemisphereHit, IrradianceCache, IrradianceCacheIntegrator, Record, RecordMaker,
    RecordSite, Strata,
};
pub use metropolis::importance_image::{ImportanceImage, ImportanceImageMaker};
pub use metropolis::mlt::PathSpaceIntegrator;
pub use metropolis::options::{Metropolis, MetropolisDirect, MetropolisTarget};
pub use metropolis::pssmlt::PrimarySpaceIntegrator;
pub use opacity::Transmittance;
pub use path::ambient_occlusion::AmbientOcclusion;
pub use path::area::AreaIntegrator;
pub use path::debug::{DebugIntegrator, DebugView};
pub use path::distributed::DistributedIntegrator;
pub use path::integrator::PathIntegrator;
pub use path::naive::{Absorption, EmissionCoin, NaiveIntegrator};
pub use path::one_sample::OneSampleIntegrator;
pub use path::reuse::ReusingPathIntegrator;
pub use path::roulette::{Roulette, Survival};
pub use path::simple::SimpleIntegrator;
pub use path::strategy::{DirectLight, Directions, Heuristic, Strategy};
pub use path::surface_areas::SurfaceAreas;
pub use path::whitted::WhittedIntegrator;
pub use path_record::{EmissionRecord, LightSampleRecord, PathEvent, ScatteringRecord};
pub use photon::grid::{GridItem, PhotonGrid};
pub use photon::photon_map::{FAR_SHARE, NEAR_SHARE, PhotonMapIntegrator, PhotonMaps, PhotonSlice};
pub use photon::photons::{PHOTON_PATHS_A_WORK_ITEM, Photon, PhotonTracer, PhotonWorkItem};
pub use photon::sppm::{IterationPhotons, ProgressivePhotonIntegrator};
pub use photon::tree::{NearestPhotons, PhotonTree};
pub use photon::vcm::{MAX_MERGED_PATHS, MergedPaths, VertexMergingIntegrator, WorkItemPaths};
pub use pick::PickedSurface;
pub use search_radius::{MERGING_PIXELS, PHOTON_PIXELS, ProgressiveRadius, Radii, SearchRadius};
pub use vertex::Vertex;
pub use visibility::{Site, VisibilityLearner};
pub use world::World;

use crate::accel::Accel;
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::math::Vec2;
use crate::sampler::{SampleKey, Sampler};

/// An integrator: computes one sample of one pixel from its key, and passes the light to a sink.
pub trait Integrator: Sync {
    /// Traces the sample `key` with numbers from `sampler` and adds its light to `out`.
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink);

    /// Traces several samples, each into a separate sink of `out`. Work that the samples have in
    /// common may be done once for all of them.
    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (key, out) in keys.iter().zip(out) {
            self.sample(*key, sampler, out);
        }
    }

    /// Number of pixels of a tile whose samples should be traced together: 1 to
    /// [`SAMPLES_AT_ONCE`].
    fn pixels_at_once(&self) -> usize {
        1
    }
}

/// Interface for integrators of other crates, which works with any backend. `Renderer::render_with`
/// renders with such an integrator; `examples/own_integrator.rs` is an example.
pub trait SampleTracer: Sync {
    /// Traces the sample `key` as [`Integrator::sample`] does.
    fn sample<S: Sampler>(&self, world: &World<&dyn Accel>, key: SampleKey, sampler: &mut S, out: &mut impl Sink);
}

/// A [`SampleTracer`] with its world. It is an [`Integrator`].
pub struct TracerIntegrator<'a, T> {
    /// World with the scene, the backend and the camera.
    pub world: World<'a, &'a dyn Accel>,
    /// Integrator from another crate.
    pub tracer: &'a T,
}

impl<T: SampleTracer> Integrator for TracerIntegrator<'_, T> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.tracer.sample(&self.world, key, sampler, out);
    }
}

/// Maximum number of samples that are traced together.
pub const SAMPLES_AT_ONCE: usize = 16;

/// Purpose of a ray. Statistics count the rays of each purpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// Ray from the camera.
    Camera,
    /// Ray that leaves a surface after scattering, or leaves a light.
    Bounce,
    /// Shadow ray towards a light.
    Shadow,
}

/// Sink that receives the light that an integrator finds for one sample.
pub trait Sink: RaySink {
    /// Sets the filter weight of the sample: 1, or ±1 for filters with negative lobes. Integrators
    /// call this before they add light.
    fn weight(&mut self, weight: f32);

    /// Adds light to the pixel of the sample.
    fn light(&mut self, light: FoundLight);

    /// Receives the light of one source. [`Sink::light`] receives the sum over several sources,
    /// which includes this light.
    fn part(&mut self, _light: FoundLight) {}

    /// Adds radiance to the pixel of the sample. The radiance does not come from a light of the
    /// scene.
    #[inline(always)]
    fn radiance(&mut self, radiance: Spectrum) {
        self.light(FoundLight {
            radiance,
            source: Some(LightSource::BACKGROUND),
            scatterings: 0,
            events: &[],
        });
    }

    /// Receives the first surface that the camera ray hits.
    fn first_surface(&mut self, surface: FirstSurface);

    /// Receives the background or the ground that the camera ray sees. The sink uses this view to
    /// finish the sample.
    fn camera_view(&mut self, _view: CameraView) {}

    /// Marks the sample as a point on a line of a drawing (`--aov lines`).
    fn line(&mut self) {}

    /// Returns `true` if the sink separates sources of light. Only such a sink needs the parts of
    /// sums ([`Sink::part`]).
    #[inline(always)]
    fn separates_parts(&self) -> bool {
        false
    }

    /// Returns `true` if the sink separates classes of light paths. Only such a sink needs
    /// scattering events ([`Sink::scattered`]).
    #[inline(always)]
    fn separates_paths(&self) -> bool {
        false
    }

    /// Receives a scattering event of the path. `depth` is the number of scattering events before
    /// this event.
    fn scattered(&mut self, _depth: u32, _event: ScatteringEvent) {}
}

/// Sinks behind dynamic dispatch, for code that is not compiled separately for each sink.
impl Sink for &mut (dyn Sink + '_) {
    fn weight(&mut self, weight: f32) {
        (**self).weight(weight);
    }

    fn light(&mut self, light: FoundLight) {
        (**self).light(light);
    }

    fn part(&mut self, light: FoundLight) {
        (**self).part(light);
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        (**self).first_surface(surface);
    }

    fn camera_view(&mut self, view: CameraView) {
        (**self).camera_view(view);
    }

    fn line(&mut self) {
        (**self).line();
    }

    fn separates_parts(&self) -> bool {
        (**self).separates_parts()
    }

    fn separates_paths(&self) -> bool {
        (**self).separates_paths()
    }

    fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        (**self).scattered(depth, event);
    }
}

impl RaySink for &mut (dyn Sink + '_) {
    fn ray(&mut self, kind: RayKind) {
        (**self).ray(kind);
    }

    fn cut_walk(&mut self) {
        (**self).cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        (**self).is_cancelled()
    }

    fn records(&self) -> bool {
        (**self).records()
    }

    fn record(&mut self, event: PathEvent) {
        (**self).record(event);
    }

    fn record_len(&self) -> usize {
        (**self).record_len()
    }

    fn take_record(&mut self, from: usize) -> Vec<PathEvent> {
        (**self).take_record(from)
    }
}

/// An integrator whose light paths may contribute to any pixel. Each iteration is one sample of
/// every pixel.
///
/// An iteration starts with a preparation (photon maps, seeds of chains). Then samples of pixels
/// are traced and Markov chains run, in any order. Random numbers depend only on the index of the
/// iteration and on the index of the sample or chain within it, so any machine may compute any
/// iteration.
pub trait IterationIntegrator: Sync {
    /// Result of one part of the preparation.
    type PreparationPart: Send;
    /// Result of the whole preparation, shared by samples and chains.
    type Preparation: Sync;

    /// Number of parts in which an iteration is prepared.
    fn preparations(&self) -> u32;

    /// Prepares part `index` of iteration `iteration`. `out` counts the rays.
    fn prepare<S: Sampler>(
        &self,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Self::PreparationPart;

    /// Joins the parts of the preparation, given in the order of their indices.
    fn join(&self, iteration: u32, parts: Vec<Self::PreparationPart>) -> Self::Preparation;

    /// Number of sampling strategies whose light is summed separately.
    fn strategies(&self) -> usize {
        0
    }

    /// Returns `true` if film points outside of the image have the same directions as points inside
    /// the image, as in panoramas ([`Camera::repeats`](crate::camera::Camera::repeats)).
    fn repeats(&self) -> bool {
        false
    }

    /// Returns `true` if samples of a pixel may contribute light to other pixels. Samples outside
    /// of a crop are then traced too.
    fn sends_light(&self) -> bool;

    /// Traces the sample `key` of a pixel.
    fn sample<S: Sampler>(
        &self,
        prepared: &Self::Preparation,
        key: SampleKey,
        sampler: &mut S,
        out: &mut impl SplatSink,
    );

    /// Number of Markov chains of an iteration.
    fn chains(&self) -> u32 {
        0
    }

    /// Runs Markov chain `index` of iteration `iteration`.
    fn chain<S: Sampler>(
        &self,
        _prepared: &Self::Preparation,
        _iteration: u32,
        _index: u32,
        _sampler: &mut S,
        _out: &mut impl SplatSink,
    ) {
    }
}

/// Sink that counts rays, and may record paths.
pub trait RaySink {
    /// Counts a traced ray.
    fn ray(&mut self, kind: RayKind);

    /// Counts a walk through surfaces with opacity below 1 that ended at its maximum number of
    /// surfaces.
    fn cut_walk(&mut self);

    /// Returns `true` if the work is cancelled and its result will be discarded. Long loops call
    /// this and return early.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Returns `true` if the sink records paths. Integrators make events only for such a sink.
    fn records(&self) -> bool {
        false
    }

    /// Records an event of a path.
    fn record(&mut self, _event: PathEvent) {}

    /// Number of recorded path events.
    fn record_len(&self) -> usize {
        0
    }

    /// Removes and returns the recorded events from index `from` on. A Markov chain takes the
    /// events of a proposed path, and records them again when it adds the light of the path.
    fn take_record(&mut self, _from: usize) -> Vec<PathEvent> {
        Vec::new()
    }
}

/// A sink for tests that counts no rays.
#[cfg(test)]
pub(crate) struct NullRaySink;

#[cfg(test)]
impl RaySink for NullRaySink {
    fn ray(&mut self, _: RayKind) {}
    fn cut_walk(&mut self) {}
}

/// A sink that also receives light for pixels other than the pixel of the sample.
pub trait SplatSink: Sink {
    /// Adds `light` to all pixels whose filter reaches the point `film` (pixels, origin top left),
    /// multiplied by the value of each pixel's filter at that point.
    fn splat(&mut self, film: Vec2, light: FoundLight);

    /// Receives the light of strategy `index` of [`IterationIntegrator::strategies`], with its MIS
    /// weight (`weighed`) and without the weight (`alone`). The light falls on the film point
    /// `film`, or on the pixel of the sample if `film` is `None`.
    fn strategy(&mut self, index: usize, film: Option<Vec2>, weighed: Spectrum, alone: Spectrum);

    /// Adds light of one class of light paths ([`LightPaths`](crate::film::LightPaths)) to the
    /// pixel of the sample, or to a film point. [`Sink::light`] or [`SplatSink::splat`] also
    /// receives this light.
    fn path_class(&mut self, _class: usize, _film: Option<Vec2>, _radiance: Spectrum) {}

    /// Counts `proposed` mutations of the kind `kind`, of which `accepted` were accepted.
    fn mutation(&mut self, _kind: &'static str, _proposed: u64, _accepted: u64) {}

    /// Counts a completed Markov chain.
    fn chain(&mut self, _counts: ChainCounts) {}
}

/// Number of Markov chains, and how they moved between pixels (`metropolis/visits.rs`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChainCounts {
    /// Number of chains.
    pub chains: u64,
    /// Number of mutations of all chains.
    pub mutations: u64,
    /// Sum of squared numbers of visits, over all pixels and all chains. A number of visits is the
    /// number of mutations of one chain in one pixel.
    pub squared_visits: u64,
    /// Number of chains with at least half of their mutations in one pixel.
    pub stuck: u64,
}

impl ChainCounts {
    /// Sum of `self` and `other`.
    pub fn plus(self, other: Self) -> Self {
        Self {
            chains: self.chains + other.chains,
            mutations: self.mutations + other.mutations,
            squared_visits: self.squared_visits + other.squared_visits,
            stuck: self.stuck + other.stuck,
        }
    }

    /// Integrated autocorrelation time of the pixel that a chain visits, in mutations: 1 if chains
    /// never return to a pixel. `None` if there were no mutations.
    pub fn autocorrelation_time(self) -> Option<f64> {
        (self.mutations > 0).then(|| self.squared_visits as f64 / self.mutations as f64)
    }
}
