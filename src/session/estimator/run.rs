use super::{DEFAULT_DEPTH_BRANCHING, Estimator, IntegratorKind};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::film::{Film, Filter};
use crate::integrator::{
    AmbientOcclusion, BidirectionalIntegrator, DebugIntegrator, DistributedIntegrator, FrameIntegrator, Heuristic,
    ImportanceImage, ImportanceImageMaker, Integrator, IrradianceCache, IrradianceCacheIntegrator, LightIntegrator,
    MetropolisTarget, NaiveIntegrator, PathIntegrator, PathSpaceIntegrator, PhotonMapIntegrator, PhotonMaps,
    PhotonTracer, PrimarySpaceIntegrator, ProgressivePhotonIntegrator, RecordMaker, ReusingPathIntegrator, Roulette,
    SearchRadius, Sink, VertexMergingIntegrator, WhittedIntegrator, World,
};
use crate::math::UVec2;
use crate::render::{self, Irradiance, Observer, Outcome, Statistics, companions};
use crate::sampler::{SampleKey, Sampler};
use std::sync::OnceLock;

/// What all samples of a picture look at, and which is made once, before the first of them.
#[derive(Debug)]
pub(crate) struct Prepared {
    irradiance: Irradiance,
    photons: OnceLock<PhotonMaps>,
    importance: OnceLock<ImportanceImage>,
}

impl Prepared {
    /// Nothing yet, for a picture of `resolution` pixels.
    pub fn new(resolution: UVec2, seed: u64) -> Self {
        Self {
            irradiance: Irradiance::new(resolution, seed),
            photons: OnceLock::new(),
            importance: OnceLock::new(),
        }
    }
}

impl Estimator {
    /// Adds to every pixel of `film` the samples before the one with index `end`, or fewer where `noise` names a relative error that is small
    /// enough.
    pub(crate) fn render<A: Accel>(
        &self,
        (world, prepared): (World<A>, &Prepared),
        sampler: &impl Sampler,
        film: &mut Film,
        end: u32,
        noise: Option<f64>,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        struct Render<'a, S> {
            sampler: &'a S,
            film: &'a mut Film,
            end: u32,
            noise: Option<f64>,
            filter: &'a Filter,
            observer: &'a dyn Observer,
        }
        impl<S: Sampler> Task for Render<'_, S> {
            type Output = (Outcome, Statistics);
            fn run(self, integrator: &impl Integrator) -> Self::Output {
                let Self {
                    sampler,
                    film,
                    end,
                    noise,
                    observer,
                    ..
                } = self;
                match noise {
                    None => render::render(integrator, sampler, film, end, &observer),
                    Some(level) => render::render_to_noise(integrator, sampler, film, level, end, &observer),
                }
            }
            fn run_frames(self, integrator: &impl FrameIntegrator) -> Self::Output {
                let numbers = (self.sampler, self.filter);
                render::render_frames(integrator, numbers, self.film, (self.end, self.noise), &self.observer)
            }
        }
        let (outcome, preparing) = self.prepare((world, prepared), sampler, observer);
        if outcome == Outcome::Stopped {
            return (outcome, preparing);
        }
        let render = Render {
            sampler,
            film,
            end,
            noise,
            filter: world.filter,
            observer,
        };
        let (outcome, statistics) = self.with_integrator((world, prepared), render);
        (outcome, preparing.merge(statistics))
    }

    /// Makes what all samples look at and has to be there before the first one: an irradiance cache, photon maps, an importance image, or nothing.
    pub(crate) fn prepare<A: Accel>(
        &self,
        (world, prepared): (World<A>, &Prepared),
        sampler: &impl Sampler,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics) {
        // Compiled once, as below
        let accel: &dyn Accel = world.accel;
        let (world, observer) = (world.with_accel(&accel), &observer);
        match self.kind {
            IntegratorKind::IrradianceCache => {
                let maker = RecordMaker {
                    path: self.plain_path(world),
                    rays: self.cache_rays,
                };
                prepared.irradiance.fill(&maker, self.cache_error, observer)
            }
            IntegratorKind::PhotonMap if prepared.photons.get().is_none() => {
                let tracer = PhotonTracer {
                    world,
                    max_depth: self.most_scatterings(),
                    roulette: self.roulette,
                    min_scatterings: 0,
                };
                let mut statistics = Statistics::default();
                let Some((maps, rays)) = render::photon_maps(&tracer, self.mapped_photons(), sampler, observer) else {
                    return (Outcome::Stopped, statistics);
                };
                statistics.rays = rays;
                // Whoever comes first has what all have.
                drop(prepared.photons.set(maps));
                (Outcome::Complete, statistics)
            }
            IntegratorKind::PrimarySpace | IntegratorKind::PathSpace
                if self.metropolis.target == MetropolisTarget::Relative && prepared.importance.get().is_none() =>
            {
                // Its own switches are no business of the chains.
                let maker = ImportanceImageMaker {
                    world,
                    heuristic: Heuristic::default(),
                    max_depth: self.most_scatterings(),
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

    /// The paths beside an irradiance cache, each by itself.
    fn plain_path<'a, A: Accel>(&self, world: World<'a, A>) -> PathIntegrator<'a, A> {
        PathIntegrator {
            world,
            strategy: self.strategy,
            max_depth: self.most_scatterings(),
            roulette: self.roulette,
            light_samples: self.light_samples(),
        }
    }

    /// How far away photons count in the first frame.
    fn search_radius(&self) -> SearchRadius {
        let usual = SearchRadius::Pixels(self.radius_pixels());
        self.photon_radius.map_or(usual, SearchRadius::Fixed)
    }

    /// Traces the sample `key`, and those that a render traces together with it, after [`Estimator::prepare`]; `sink` makes the sinks, told whether it is for
    /// `key` itself. Gives whether there is such a sample: in frames light goes where it will.
    ///
    /// Backend and sink are reached by dynamic dispatch, so that looking at single samples does not compile all integrators once more.
    pub(crate) fn sample<'s>(
        &self,
        (world, prepared): (World<&dyn Accel>, &Prepared),
        (resolution, key): (UVec2, SampleKey),
        sampler: &mut impl Sampler,
        sink: &dyn Fn(bool) -> Box<dyn Sink<Radiance = Spectrum> + 's>,
    ) -> bool {
        struct Sample<'a, 's, S> {
            resolution: UVec2,
            key: SampleKey,
            sampler: &'a mut S,
            sink: &'a dyn Fn(bool) -> Box<dyn Sink<Radiance = Spectrum> + 's>,
        }
        impl<S: Sampler> Task for Sample<'_, '_, S> {
            type Output = bool;
            fn run(self, integrator: &impl Integrator) -> bool {
                let keys = companions(integrator, self.resolution, self.key);
                let mut sinks: Vec<_> = keys.iter().map(|key| (self.sink)(*key == self.key)).collect();
                integrator.samples(&keys, self.sampler, &mut sinks);
                true
            }
            fn run_frames(self, _: &impl FrameIntegrator) -> bool {
                false
            }
        }
        let sample = Sample {
            resolution,
            key,
            sampler,
            sink,
        };
        self.with_integrator((world, prepared), sample)
    }

    /// The one place that chooses the integrator.
    fn with_integrator<A: Accel, T: Task>(&self, (world, prepared): (World<A>, &Prepared), task: T) -> T::Output {
        let Self { strategy, roulette, .. } = *self;
        let (max_depth, light_samples) = (self.most_scatterings(), self.light_samples());
        let path = |max_depth| PathIntegrator {
            world,
            strategy,
            max_depth,
            roulette,
            light_samples,
        };
        // What the path tracer and its kin are made of is compiled for each backend; of the others, which are many, there is one for all.
        let accel: &dyn Accel = world.accel;
        let any = world.with_accel(&accel);
        let even = ImportanceImage::even();
        let importance = prepared.importance.get().unwrap_or(&even);
        match self.kind {
            IntegratorKind::Path if self.reuse => task.run(&ReusingPathIntegrator { path: path(max_depth) }),
            IntegratorKind::Path => task.run(&path(max_depth)),
            // One scattering is a path of depth 1, which has nothing to share, and for roulette nothing to end.
            IntegratorKind::Direct => task.run(&PathIntegrator {
                roulette: Roulette::default(),
                ..path(Some(1))
            }),
            IntegratorKind::Naive => task.run(&NaiveIntegrator {
                world,
                max_depth,
                roulette,
            }),
            IntegratorKind::Whitted => task.run(&WhittedIntegrator { world, max_depth }),
            IntegratorKind::Distributed => task.run(&DistributedIntegrator {
                world,
                strategy,
                max_depth: max_depth.unwrap_or(DEFAULT_DEPTH_BRANCHING),
                branching: self.branching,
            }),
            IntegratorKind::AmbientOcclusion => task.run(&AmbientOcclusion {
                world,
                distance: self.ao_distance.unwrap_or_else(|| 2.0 * world.scene.bounds().radius()),
            }),
            IntegratorKind::Debug => task.run(&DebugIntegrator { world, view: self.view }),
            IntegratorKind::Light => task.run_frames(&LightIntegrator {
                world: any,
                max_depth,
                roulette,
            }),
            IntegratorKind::Bidirectional => task.run_frames(&BidirectionalIntegrator {
                world: any,
                heuristic: strategy.heuristic,
                max_depth,
                roulette,
            }),
            IntegratorKind::PrimarySpace => task.run_frames(&PrimarySpaceIntegrator {
                world: any,
                heuristic: strategy.heuristic,
                max_depth,
                light_samples,
                metropolis: self.metropolis,
                importance,
            }),
            IntegratorKind::ProgressivePhotons => task.run_frames(&ProgressivePhotonIntegrator {
                world: any,
                strategy,
                max_depth,
                roulette,
                photons: self.photons,
                radius: self.search_radius(),
                alpha: self.photon_alpha,
            }),
            IntegratorKind::VertexMerging => task.run_frames(&VertexMergingIntegrator {
                world: any,
                heuristic: strategy.heuristic,
                max_depth,
                roulette,
                photons: self.photons,
                radius: self.search_radius(),
                alpha: self.photon_alpha,
            }),
            IntegratorKind::PhotonMap => task.run(&PhotonMapIntegrator {
                world: any,
                maps: prepared.photons.get().unwrap_or(&PhotonMaps::new(Vec::new(), 1)),
                strategy,
                max_depth,
                roulette,
                photon_count: self.photon_count,
                radius: self.photon_radius,
                gather_rays: self.gather_rays,
            }),
            IntegratorKind::IrradianceCache => {
                let empty = IrradianceCache::new(self.cache_error, any.scene.bounds());
                task.run(&IrradianceCacheIntegrator {
                    path: self.plain_path(any),
                    cache: prepared.irradiance.cache().unwrap_or(&empty),
                })
            }
            IntegratorKind::PathSpace => task.run_frames(&PathSpaceIntegrator {
                world: any,
                max_depth,
                roulette,
                light_samples,
                metropolis: self.metropolis,
                importance,
            }),
        }
    }
}

/// What is done with an integrator, whichever it is.
trait Task {
    type Output;
    fn run(self, integrator: &impl Integrator) -> Self::Output;
    fn run_frames(self, integrator: &impl FrameIntegrator) -> Self::Output;
}
