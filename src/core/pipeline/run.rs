//! Choice of the integrator: makes an integrator over a backend from its settings, and
//! prepares its data before the first sample. No other code makes this choice.

use super::AnyAccel;
use crate::accel::{Accel, Dispatch};
use crate::film::{Film, Filter};
use crate::integrator::{
    self, AreaIntegrator, BidirectionalIntegrator, DebugIntegrator, DistributedIntegrator, Heuristic, ImportanceImage,
    ImportanceImageMaker, Integrator, IrradianceCache, IrradianceCacheIntegrator, IterationIntegrator, LightIntegrator,
    MERGING_PIXELS, Metropolis, MetropolisTarget, NaiveIntegrator, OneSampleIntegrator, PHOTON_PIXELS, PathIntegrator,
    PathSpaceIntegrator, PhotonMapIntegrator, PhotonMaps, PhotonTracer, PrimarySpaceIntegrator,
    ProgressivePhotonIntegrator, ProgressiveRadius, RecordMaker, ReusingPathIntegrator, Roulette, SearchRadius, Sink,
    Strategy, SurfaceAreas, VertexMergingIntegrator, VisibilityLearner, WhittedIntegrator, World,
};
use crate::math::UVec2;
use crate::options::{ChosenIntegrator, DirectSettings, IrradianceCacheSettings, MaxDepth, PathReuse, PathSettings};
use crate::render::{
    self, DynSink, Irradiance, Monomorphic, Observer, Outcome, SampleIntegrator, SampleRecord, Statistics,
    StopCondition, companions,
};
use crate::sampler::{RenderSampler, SampleKey, Sampler};
use std::sync::OnceLock;

/// Strategies for directions and direct light, from settings.
macro_rules! strategy {
    ($settings:expr) => {
        Strategy {
            directions: $settings.directions,
            direct: $settings.direct,
            heuristic: $settings.mis,
        }
    };
}

/// Russian roulette, from settings.
macro_rules! roulette {
    ($settings:expr) => {
        Roulette {
            depth: $settings.roulette_depth,
            survival: $settings.roulette,
        }
    };
}

/// Search radius of a progressive integrator, from its settings. The default first radius
/// is `$pixels` times the width of a pixel.
macro_rules! radius {
    ($settings:expr, $pixels:expr) => {
        ProgressiveRadius {
            first: $settings
                .photon_radius
                .map_or(SearchRadius::Pixels($pixels), SearchRadius::Fixed),
            alpha: $settings.photon_alpha,
        }
    };
}

/// Options of Markov chains, from settings.
macro_rules! metropolis {
    ($settings:expr) => {
        Metropolis {
            direct: $settings.metropolis_direct,
            target: $settings.metropolis_target,
            chains: $settings.chains,
            bootstrap: $settings.bootstrap,
            ..Metropolis::default()
        }
    };
}

/// Data that all samples of an image use. Made once, before the first sample.
#[derive(Debug)]
pub struct Preparation {
    irradiance: Irradiance,
    photons: OnceLock<PhotonMaps>,
    importance: OnceLock<ImportanceImage>,
    areas: OnceLock<SurfaceAreas>,
    ao_distance: OnceLock<f32>,
}

impl Preparation {
    /// Empty data for an image of `resolution` pixels.
    pub fn new(resolution: UVec2, seed: u64) -> Self {
        Self {
            irradiance: Irradiance::new(resolution, seed),
            photons: OnceLock::new(),
            importance: OnceLock::new(),
            areas: OnceLock::new(),
            ao_distance: OnceLock::new(),
        }
    }

    /// Fraction of the irradiance cache's records that are doubtful: most of their light comes from
    /// few of their rays. `None` if there are no records.
    pub fn doubtful_records(&self) -> Option<f64> {
        let cache = self.irradiance.cache().filter(|cache| !cache.is_empty())?;
        Some(cache.doubtful_share())
    }
}

/// The scene with its backend and camera, and the prepared data of an image.
#[derive(Debug)]
pub struct RenderContext<'a, A> {
    /// Scene, backend and camera.
    pub world: World<'a, A>,
    /// Data made once, before the first sample.
    pub prepared: &'a Preparation,
}

// Derived impls would require `A: Clone`, though `A` is only behind a reference.
impl<A> Clone for RenderContext<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A> Copy for RenderContext<'_, A> {}

impl ChosenIntegrator {
    /// Adds samples to every pixel of `film` until the condition `stop` holds.
    pub fn render(
        &self,
        RenderContext { world, prepared }: RenderContext<AnyAccel>,
        sampler: &RenderSampler,
        film: &mut Film,
        stop: StopCondition,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        let (outcome, preparing) = self.prepare(RenderContext { world, prepared }, sampler, observer);
        if outcome == Outcome::Stopped {
            return (outcome, preparing);
        }
        // The render loop is compiled separately for Embree. All other backends use dynamic
        // dispatch, which costs about 1 % per query and keeps the build short.
        let (outcome, statistics) = match world.accel {
            #[cfg(feature = "embree")]
            AnyAccel::Embree(accel) => {
                let world = world.with_accel(&**accel);
                self.render_by(RenderContext { world, prepared }, sampler, film, stop, observer)
            }
            accel => {
                let accel = accel.as_dyn();
                let world = world.with_accel(&accel);
                self.render_by(RenderContext { world, prepared }, sampler, film, stop, observer)
            }
        };
        (outcome, preparing.merge(statistics))
    }

    /// [`ChosenIntegrator::render`] for one type of backend, after [`ChosenIntegrator::prepare`].
    fn render_by<A: Dispatch>(
        &self,
        RenderContext { world, prepared }: RenderContext<A>,
        sampler: &RenderSampler,
        film: &mut Film,
        stop: StopCondition,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        struct Render<'a, S> {
            sampler: &'a S,
            film: &'a mut Film,
            stop: StopCondition,
            filter: &'a Filter,
            observer: &'a dyn Observer,
        }
        impl<S: Sampler> Task for Render<'_, S> {
            type Output = (Outcome, Statistics);
            type Sampler = S;
            fn run(self, integrator: &dyn SampleIntegrator<S>) -> Self::Output {
                render::render_samples(integrator, self.sampler, self.film, self.stop, &self.observer)
            }
            fn run_iterations(self, integrator: &impl IterationIntegrator) -> Self::Output {
                let numbers = (self.sampler, self.filter);
                render::render_iterations(integrator, numbers, self.film, self.stop, &self.observer)
            }
        }
        let render = Render {
            sampler,
            film,
            stop,
            filter: world.filter,
            observer,
        };
        self.with_integrator(RenderContext { world, prepared }, render)
    }

    /// Makes the data that must exist before the first sample: learned visibility, an irradiance
    /// cache, photon maps, an importance image, or nothing.
    pub fn prepare(
        &self,
        RenderContext { world, prepared }: RenderContext<AnyAccel>,
        sampler: &RenderSampler,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        let accel = world.accel.as_dyn();
        let (world, observer) = (world.with_accel(&accel), &observer);
        let mut statistics = Statistics::default();
        let learner = VisibilityLearner { world };
        if self.weighs_lights() && learner.is_needed() {
            let Some((visibility, rays)) = render::learn_visibility(&learner, sampler, observer) else {
                return (Outcome::Stopped, statistics);
            };
            statistics.rays = rays;
            world.light_selection.learn(visibility);
        }
        let (outcome, others) = self.prepare_integrator(RenderContext { world, prepared }, sampler, observer);
        (outcome, statistics.merge(others))
    }

    /// Part of [`ChosenIntegrator::prepare`]: makes the data that only this kind of integrator
    /// needs.
    fn prepare_integrator(
        &self,
        RenderContext { world, prepared }: RenderContext<&dyn Accel>,
        sampler: &RenderSampler,
        observer: &&dyn Observer,
    ) -> (Outcome, Statistics) {
        match self {
            Self::IrradianceCache(settings) => {
                let maker = RecordMaker {
                    path: plain_path(world, settings),
                    rays: settings.cache_rays,
                };
                prepared.irradiance.fill(&maker, settings.cache_error, observer)
            }
            Self::PhotonMap(settings) if prepared.photons.get().is_none() => {
                let tracer = PhotonTracer {
                    world,
                    max_depth: settings.max_depth.limit(),
                    roulette: roulette!(settings),
                    min_scatterings: 0,
                };
                let mut statistics = Statistics::default();
                let Some((maps, rays)) = render::photon_maps(&tracer, settings.photons, sampler, observer) else {
                    return (Outcome::Stopped, statistics);
                };
                statistics.rays = rays;
                // If several threads make maps, all use the maps of the thread that is first ready.
                drop(prepared.photons.set(maps));
                (Outcome::Complete, statistics)
            }
            Self::PrimarySpace(_) | Self::PathSpace(_)
                if self.value("metropolis_target") == Some(MetropolisTarget::Relative)
                    && prepared.importance.get().is_none() =>
            {
                // Parameters of the chains do not change the importance image.
                let maker = ImportanceImageMaker {
                    world,
                    heuristic: Heuristic::default(),
                    max_depth: self.max_depth().and_then(MaxDepth::limit),
                    roulette: Roulette::default(),
                };
                let mut statistics = Statistics::default();
                let Some((picture, rays)) = render::importance_image(&maker, sampler, observer) else {
                    return (Outcome::Stopped, statistics);
                };
                statistics.rays = rays;
                drop(prepared.importance.set(picture));
                (Outcome::Complete, statistics)
            }
            _ => (Outcome::Complete, Statistics::default()),
        }
    }

    /// Traces the sample `key`, and the samples that a render traces together with it. Call
    /// [`ChosenIntegrator::prepare`] before. `sink` makes the sink of each sample; its argument is
    /// true for the sample `key`. Returns false, and traces nothing, if the integrator has
    /// iterations, in which light may reach any pixel.
    ///
    /// Backend and sink use dynamic dispatch, so that tracing single samples does not compile all
    /// integrators again.
    pub fn sample<'s>(
        &self,
        RenderContext { world, prepared }: RenderContext<&dyn Accel>,
        (resolution, key): (UVec2, SampleKey),
        sampler: &mut RenderSampler,
        sink: &dyn Fn(bool) -> Box<dyn Sink + 's>,
    ) -> bool {
        struct Sample<'a, 's, S> {
            resolution: UVec2,
            key: SampleKey,
            sampler: &'a mut S,
            sink: &'a dyn Fn(bool) -> Box<dyn Sink + 's>,
        }
        impl<S: Sampler> Task for Sample<'_, '_, S> {
            type Output = bool;
            type Sampler = S;
            fn run(self, integrator: &dyn SampleIntegrator<S>) -> bool {
                let keys = companions(integrator.pixels_at_once(), self.resolution, self.key);
                let mut sinks: Vec<_> = keys.iter().map(|key| (self.sink)(*key == self.key)).collect();
                let mut sinks: Vec<DynSink> = sinks.iter_mut().map(|sink| &mut **sink as _).collect();
                integrator.samples_into(&keys, self.sampler, &mut sinks);
                true
            }
            fn run_iterations(self, _: &impl IterationIntegrator) -> bool {
                false
            }
        }
        let sample = Sample {
            resolution,
            key,
            sampler,
            sink,
        };
        self.with_integrator(RenderContext { world, prepared }, sample)
    }

    /// Runs iteration `index`, and calls `keep` with the record of each sample and chain that
    /// contributes light to `pixel`. Call [`ChosenIntegrator::prepare`] before. Returns true if the
    /// integrator has iterations.
    pub fn record_iteration(
        &self,
        RenderContext { world, prepared }: RenderContext<&dyn Accel>,
        (resolution, pixel, index): (UVec2, UVec2, u32),
        sampler: &RenderSampler,
        keep: &mut dyn FnMut(SampleRecord),
    ) -> bool {
        struct Record<'a, S> {
            place: (UVec2, UVec2),
            index: u32,
            numbers: (&'a S, &'a Filter),
            keep: &'a mut dyn FnMut(SampleRecord),
        }
        impl<S: Sampler> Task for Record<'_, S> {
            type Output = bool;
            type Sampler = S;
            fn run(self, _: &dyn SampleIntegrator<S>) -> bool {
                false
            }
            fn run_iterations(self, integrator: &impl IterationIntegrator) -> bool {
                render::record_iteration(integrator, self.numbers, self.place, self.index, self.keep);
                true
            }
        }
        let record = Record {
            place: (resolution, pixel),
            index,
            numbers: (sampler, world.filter),
            keep,
        };
        self.with_integrator(RenderContext { world, prepared }, record)
    }

    /// Makes the integrator and runs `task` with it. No other code chooses the integrator.
    fn with_integrator<A: Dispatch, T: Task>(&self, context: RenderContext<A>, task: T) -> T::Output {
        let RenderContext { world, prepared } = context;
        // The path tracer is compiled separately for Embree; the many other integrators are
        // compiled once for all backends.
        let accel: &dyn Accel = world.accel;
        let any = world.with_accel(&accel);
        let even = ImportanceImage::even();
        let importance = prepared.importance.get().unwrap_or(&even);
        match self {
            // Do not share dispersed paths, because each path has one wavelength, which differs
            // between pixels.
            Self::Path(s) if s.reuse == PathReuse::Pixels && !world.scene.is_dispersive() => run(
                world,
                ReusingPathIntegrator { path: path(world, s) },
                ReusingPathIntegrator { path: path(any, s) },
                task,
            ),
            Self::Path(s) => run(world, path(world, s), path(any, s), task),
            Self::Direct(s) => run(world, direct(world, s), direct(any, s), task),
            Self::Naive(s) => task.run(&NaiveIntegrator {
                world: any,
                directions: s.directions,
                emission_coin: s.emission_coin,
                emission_probability: s.emission_probability,
                absorption: s.absorption,
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
            }),
            Self::OneSample(s) => task.run(&OneSampleIntegrator {
                world: any,
                direct_probability: s.direct_probability,
                max_depth: s.max_depth.limit(),
            }),
            Self::Area(s) => task.run(&AreaIntegrator {
                world: any,
                areas: prepared.areas.get_or_init(|| SurfaceAreas::new(any.scene)),
                max_depth: s.max_depth.limit(),
            }),
            Self::Whitted(s) => task.run(&WhittedIntegrator {
                world: any,
                max_depth: s.max_depth.limit(),
            }),
            Self::Distributed(s) => task.run(&DistributedIntegrator {
                world: any,
                strategy: strategy!(s),
                max_depth: s.depth(),
                branching: s.branching,
            }),
            Self::AmbientOcclusion(s) => task.run(&integrator::AmbientOcclusion {
                world: any,
                distance: s.ao_distance.unwrap_or_else(|| {
                    let usual = || integrator::AmbientOcclusion::usual_distance(&any);
                    *prepared.ao_distance.get_or_init(usual)
                }),
            }),
            Self::Debug(s) => task.run(&DebugIntegrator {
                world: any,
                view: s.debug_view,
            }),
            Self::Light(s) => task.run_iterations(&LightIntegrator {
                world: any,
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
            }),
            Self::Bidirectional(s) => task.run_iterations(&BidirectionalIntegrator {
                world: any,
                heuristic: s.mis,
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
            }),
            Self::PrimarySpace(s) => task.run_iterations(&PrimarySpaceIntegrator {
                world: any,
                heuristic: s.mis,
                max_depth: s.max_depth.limit(),
                light_samples: s.light_samples,
                metropolis: Metropolis {
                    large_step_probability: s.large_step_probability,
                    mutation_size: s.mutation_size,
                    ..metropolis!(s)
                },
                importance,
            }),
            Self::ProgressivePhotons(s) => task.run_iterations(&ProgressivePhotonIntegrator {
                world: any,
                strategy: strategy!(s),
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
                photons: s.photons,
                radius: radius!(s, PHOTON_PIXELS),
            }),
            Self::VertexMerging(s) => task.run_iterations(&VertexMergingIntegrator {
                world: any,
                heuristic: s.mis,
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
                photons: s.photons,
                radius: radius!(s, MERGING_PIXELS),
            }),
            Self::PhotonMap(s) => task.run(&PhotonMapIntegrator {
                world: any,
                maps: prepared.photons.get().unwrap_or(&PhotonMaps::new(Vec::new(), 1, 1)),
                strategy: strategy!(s),
                max_depth: s.max_depth.limit(),
                roulette: roulette!(s),
                photon_count: s.photon_count,
                radius: s.photon_radius,
                gather_rays: s.gather_rays,
            }),
            Self::IrradianceCache(s) => {
                let empty = IrradianceCache::new(s.cache_error, any.scene.bounds());
                task.run(&IrradianceCacheIntegrator {
                    path: plain_path(any, s),
                    cache: prepared.irradiance.cache().unwrap_or(&empty),
                })
            }
            Self::PathSpace(s) => task.run_iterations(&PathSpaceIntegrator {
                world: any,
                max_depth: s.max_depth.limit(),
                roulette: Roulette::after(s.roulette_depth),
                light_samples: s.light_samples,
                metropolis: metropolis!(s),
                importance,
            }),
        }
    }
}

/// Runs `task` with an integrator in two forms. `fast` is compiled for the backend and takes the
/// samples of the image. `any` takes all other samples. If the backend uses dynamic dispatch,
/// `fast` would not be faster, and `any` takes all samples.
fn run<A: Dispatch, T: Task>(_: World<A>, fast: impl Integrator, any: impl Integrator, task: T) -> T::Output {
    if A::IS_DYNAMIC {
        task.run(&any)
    } else {
        task.run(&Monomorphic { fast, any })
    }
}

/// The path tracer.
fn path<'a, A: Accel>(world: World<'a, A>, settings: &PathSettings) -> PathIntegrator<'a, A> {
    PathIntegrator {
        world,
        strategy: strategy!(settings),
        max_depth: settings.max_depth.limit(),
        roulette: roulette!(settings),
        light_samples: settings.light_samples,
        clamp_indirect: settings.clamp_indirect.0,
    }
}

/// Path tracer for direct light: paths have a maximum depth of 1, and roulette never terminates
/// them.
fn direct<'a, A: Accel>(world: World<'a, A>, settings: &DirectSettings) -> PathIntegrator<'a, A> {
    PathIntegrator {
        world,
        strategy: strategy!(settings),
        max_depth: Some(1),
        roulette: Roulette::default(),
        light_samples: settings.light_samples,
        clamp_indirect: None,
    }
}

/// The path tracer for an irradiance cache, without path reuse.
fn plain_path<'a, A: Accel>(world: World<'a, A>, settings: &IrradianceCacheSettings) -> PathIntegrator<'a, A> {
    PathIntegrator {
        world,
        strategy: strategy!(settings),
        max_depth: settings.max_depth.limit(),
        roulette: roulette!(settings),
        light_samples: settings.light_samples,
        clamp_indirect: None,
    }
}

/// Operation on an integrator of any type.
trait Task {
    type Output;
    type Sampler: Sampler;
    fn run(self, integrator: &dyn SampleIntegrator<Self::Sampler>) -> Self::Output;
    fn run_iterations(self, integrator: &impl IterationIntegrator) -> Self::Output;
}
