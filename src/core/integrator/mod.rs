//! Light transport: the mathematics of one pixel sample. No threads, no tiles, no files.
//!
//! One folder for each family of methods: `path`, `bidirectional`, `photon`, `metropolis` and `irradiance_cache`. All of them use the modules at the
//! top. Families may use `path` and `bidirectional`; these two use no other family.

mod background;
mod bidirectional;
mod first_surface;
mod found_light;
mod irradiance_cache;
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
    GatheredHemisphere, Gradients, IrradianceCache, IrradianceCacheIntegrator, Record, RecordMaker, RecordSite, Seen,
    Strata,
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
pub use photon::grid::{PhotonGrid, Placed};
pub use photon::photon_map::{FAR_SHARE, NEAR_SHARE, PhotonMapIntegrator, PhotonMaps, PhotonSlice};
pub use photon::photons::{PHOTON_PATHS_A_WORK_ITEM, Photon, PhotonTracer};
pub use photon::sppm::{IterationPhotons, ProgressivePhotonIntegrator};
pub use photon::tree::{Nearest, PhotonTree};
pub use photon::vcm::{MAX_MERGED_PATHS, MergedPaths, VertexMergingIntegrator, WorkItemPaths};
pub use pick::Picked;
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

/// Computes one sample of one pixel: a key in, contributions out.
pub trait Integrator: Sync {
    /// Traces the sample `key` with numbers from `sampler` and gives what it finds to `out`.
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink);

    /// Traces several samples, each into an `out` of its own: what they have in common may be done once.
    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (key, out) in keys.iter().zip(out) {
            self.sample(*key, sampler, out);
        }
    }

    /// Pixels, of a tile, whose samples are worth tracing together: 1, or up to [`SAMPLES_AT_ONCE`].
    fn pixels_at_once(&self) -> usize {
        1
    }
}

/// An integrator from outside of this crate: how the light of one sample is found, by whichever backend. `Renderer::render_with` renders by it, and
/// `examples/own_integrator.rs` has one.
pub trait SampleTracer: Sync {
    /// Traces the sample `key` with numbers from `sampler` and gives what it finds to `out`, as [`Integrator::sample`] does.
    fn sample<S: Sampler>(&self, world: &World<&dyn Accel>, key: SampleKey, sampler: &mut S, out: &mut impl Sink);
}

/// A [`SampleTracer`] in its world.
pub struct Traced<'a, T> {
    /// What `tracer` works in.
    pub world: World<'a, &'a dyn Accel>,
    /// How light is found.
    pub tracer: &'a T,
}

impl<T: SampleTracer> Integrator for Traced<'_, T> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.tracer.sample(&self.world, key, sampler, out);
    }
}

/// Maximum number of samples that are worth tracing together.
pub const SAMPLES_AT_ONCE: usize = 16;

/// Purpose of a ray; statistics count by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// Onwards from a surface, or out from a light.
    Bounce,
    /// Towards a light.
    Shadow,
}

/// Listens to an integrator that traces one sample: takes the light that its paths find.
pub trait Sink: RaySink {
    /// Filter weight of the sample: 1, or ±1 for filters with negative lobes. Comes first.
    fn weight(&mut self, weight: f32);

    /// Adds light to the pixel of the sample.
    fn light(&mut self, light: FoundLight);

    /// Notes a part of light that [`Sink::light`] gets as a sum over several sources.
    fn part(&mut self, _light: FoundLight) {}

    /// Adds radiance to the pixel of the sample that comes from no light of the scene.
    #[inline(always)]
    fn radiance(&mut self, radiance: Spectrum) {
        self.light(FoundLight {
            radiance,
            source: Some(LightSource::BACKGROUND),
            scatterings: 0,
            events: &[],
        });
    }

    /// Notes what the camera sees first.
    fn first_surface(&mut self, surface: FirstSurface);

    /// Notes that the camera ray sees a background or the ground, by which the sample is finished.
    fn camera_view(&mut self, _view: CameraView) {}

    /// Returns true if sources of light are separated: only then does it need the parts of sums.
    #[inline(always)]
    fn tells_parts(&self) -> bool {
        false
    }

    /// Returns true if classes of paths are separated: only then does it need scattering events.
    #[inline(always)]
    fn tells_paths(&self) -> bool {
        false
    }

    /// Notes the event by which the path leaves the vertex after `depth` scattering events.
    fn scattered(&mut self, _depth: u32, _event: ScatteringEvent) {}
}

/// Dynamic dispatch, for code that is not compiled once more for a sink of its own.
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

    fn tells_parts(&self) -> bool {
        (**self).tells_parts()
    }

    fn tells_paths(&self) -> bool {
        (**self).tells_paths()
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

/// An integrator whose light paths may light any pixel. Each iteration is one sample of every pixel.
///
/// An iteration is prepared (photon maps, seeds of chains), then takes samples of pixels and runs Markov chains, in any order. Random numbers depend
/// on the place within the iteration and on its index alone, so any machine may compute any iteration.
pub trait IterationIntegrator: Sync {
    /// Result of one part of the preparation.
    type Part: Send;
    /// Result of the whole preparation, shared by samples and chains.
    type Prepared: Sync;

    /// Number of parts in which an iteration is prepared.
    fn preparations(&self) -> u32;

    /// Prepares part `index` of `iteration`. `out` counts the rays.
    fn prepare<S: Sampler>(&self, iteration: u32, index: u32, sampler: &mut S, out: &mut impl RaySink) -> Self::Part;

    /// Joins the parts, which are in their order.
    fn join(&self, iteration: u32, parts: Vec<Self::Part>) -> Self::Prepared;

    /// Number of strategies whose light is summed separately.
    fn strategies(&self) -> usize {
        0
    }

    /// Returns true if film points beyond the borders of the picture repeat its directions
    /// ([`Camera::repeats`](crate::camera::Camera::repeats)).
    fn repeats(&self) -> bool {
        false
    }

    /// Whether samples of a pixel light other pixels. Samples outside a crop are then taken too.
    fn sends_light(&self) -> bool;

    /// Traces the sample `key` of a pixel.
    fn sample<S: Sampler>(&self, prepared: &Self::Prepared, key: SampleKey, sampler: &mut S, out: &mut impl SplatSink);

    /// Number of Markov chains of an iteration.
    fn chains(&self) -> u32 {
        0
    }

    /// Runs chain `index` of `iteration`.
    fn chain<S: Sampler>(
        &self,
        _prepared: &Self::Prepared,
        _iteration: u32,
        _index: u32,
        _sampler: &mut S,
        _out: &mut impl SplatSink,
    ) {
    }
}

/// Counts rays, and may record paths.
pub trait RaySink {
    /// Counts a traced ray.
    fn ray(&mut self, kind: RayKind);

    /// Counts a walk through surfaces of an opacity below 1 that was cut at its bound.
    fn cut_walk(&mut self);

    /// Whether the work is to end: what it finds will be thrown away. Loops that may be long look here, and leave.
    fn is_cancelled(&self) -> bool {
        false
    }

    /// Whether the sink records paths: only then are events made for it.
    fn records(&self) -> bool {
        false
    }

    /// Takes an event of a path.
    fn record(&mut self, _event: PathEvent) {}

    /// Number of events so far.
    fn record_len(&self) -> usize {
        0
    }

    /// The events from the place `from` on, which the sink then forgets: a Markov chain records a path where its light is added.
    fn take_record(&mut self, _from: usize) -> Vec<PathEvent> {
        Vec::new()
    }
}

/// A sink of tests, which counts no rays.
#[cfg(test)]
pub(crate) struct Uncounted;

#[cfg(test)]
impl RaySink for Uncounted {
    fn ray(&mut self, _: RayKind) {}
    fn cut_walk(&mut self) {}
}

/// Takes light that falls on other pixels too.
pub trait SplatSink: Sink {
    /// Adds to all pixels that see the place `film` (pixels, origin top left), to each as its filter says, what counts `light` in a pixel whose
    /// filter is 1 there.
    fn splat(&mut self, film: Vec2, light: FoundLight);

    /// Notes what one of [`IterationIntegrator::strategies`] has found, in the sample's own pixel or where `film` says: as it is weighed against others, and by
    /// itself.
    fn strategy(&mut self, index: usize, film: Option<Vec2>, weighed: Spectrum, alone: Spectrum);

    /// Adds light of one class of paths ([`LightPaths`](crate::film::LightPaths)), in the sample's own pixel or where `film` says: a part of what
    /// [`Sink::light`] or [`SplatSink::splat`] gets.
    fn path_class(&mut self, _class: usize, _film: Option<Vec2>, _radiance: Spectrum) {}

    /// Counts `proposed` mutations of the kind `kind`, of which the chain accepted `accepted`.
    fn mutation(&mut self, _kind: &'static str, _proposed: u64, _accepted: u64) {}

    /// Counts a Markov chain that has ended.
    fn chain(&mut self, _counts: ChainCounts) {}
}

/// Markov chains, and how they moved between pixels (`metropolis/visits.rs`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChainCounts {
    /// Chains.
    pub chains: u64,
    /// Mutations of all chains.
    pub mutations: u64,
    /// Squares of the numbers of mutations of one chain in one pixel, summed over pixels and chains.
    pub squared_visits: u64,
    /// Chains with half of their mutations or more in one pixel.
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

    /// Integrated autocorrelation time of the pixel that a chain is in, mutations: 1 where a chain never returns to a pixel. `None` without mutations.
    pub fn autocorrelation_time(self) -> Option<f64> {
        (self.mutations > 0).then(|| self.squared_visits as f64 / self.mutations as f64)
    }
}
