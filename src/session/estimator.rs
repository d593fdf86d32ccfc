use super::settings::ABOVE_0;
use super::{Error, InvalidSetting};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::film::Film;
use crate::integrator::{
    AmbientOcclusion, DebugIntegrator, DebugView, DirectLight, Directions, DistributedIntegrator, Heuristic,
    Integrator, IrradianceCache, IrradianceCacheIntegrator, NaiveIntegrator, PathIntegrator, RecordMaker, Roulette,
    Sink, Strategy, WhittedIntegrator, World,
};
use crate::io::{FileError, MaxDepth, SceneFile, name_of, named};
use crate::light::{SelectionMode, TriangleSampling};
use crate::math::UVec2;
use crate::render::{self, Irradiance, Observer, Outcome, Statistics, companions};
use crate::sampler::{PerturbedQmc, RenderSampler, SampleKey, Sampler, SamplerKind};
use crate::scene::{Scene, SceneBuilder};
use std::fmt::Display;
use toml::Spanned;

/// An integrator and its switches, as users choose them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimator {
    /// The integrator; the others are its switches, of which each heeds its own.
    pub kind: IntegratorKind,
    /// How directions are drawn and direct light is found.
    pub strategy: Strategy,
    /// How lights are chosen.
    pub light_selection: SelectionMode,
    /// How emitting triangles are sampled.
    pub triangle_sampling: TriangleSampling,
    /// Scattering events at most; `None`: 16, or 4 where paths branch.
    pub max_depth: Option<MaxDepth>,
    /// When paths end at random.
    pub roulette: Roulette,
    /// Whether pixels share their paths.
    pub reuse: bool,
    /// Light samples at the first vertex; `None`: the best number.
    pub light_samples: Option<u32>,
    /// Rays that leave a vertex where paths branch.
    pub branching: u32,
    /// How far away occludes, scene units; `None`: the size of the scene.
    pub ao_distance: Option<f32>,
    /// Likely error of a record of irradiance, as a share, up to which it has a say: Ward's `a`.
    pub cache_error: f32,
    /// Rays that a record of irradiance is made of, about.
    pub cache_rays: u32,
    /// What a debug picture shows.
    pub view: DebugView,
}

/// Integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// [`PathIntegrator`]
    Path,
    /// [`NaiveIntegrator`]
    Naive,
    /// [`WhittedIntegrator`]
    Whitted,
    /// [`DistributedIntegrator`]
    Distributed,
    /// A [`PathIntegrator`] that scatters once.
    Direct,
    /// [`AmbientOcclusion`]
    AmbientOcclusion,
    /// [`DebugIntegrator`]
    Debug,
    /// [`IrradianceCacheIntegrator`]
    IrradianceCache,
}

impl IntegratorKind {
    /// Names, as users type them; the first is the default.
    pub const NAMES: &[(&str, Self)] = &[
        ("path", Self::Path),
        ("naive", Self::Naive),
        ("whitted", Self::Whitted),
        ("distributed", Self::Distributed),
        ("direct", Self::Direct),
        ("ao", Self::AmbientOcclusion),
        ("debug", Self::Debug),
        ("irradiance-cache", Self::IrradianceCache),
    ];
}

pub(crate) const DIRECTIONS: &[(&str, Directions)] = &[
    ("bsdf", Directions::Bsdf),
    ("cosine", Directions::Cosine),
    ("uniform", Directions::Uniform),
    ("perturbed-qmc", Directions::PerturbedQmc),
];
pub(crate) const DIRECT: &[(&str, DirectLight)] = &[
    ("mis", DirectLight::Mis),
    ("light", DirectLight::Light),
    ("none", DirectLight::None),
];
pub(crate) const HEURISTICS: &[(&str, Heuristic)] = &[("power", Heuristic::Power), ("balance", Heuristic::Balance)];
pub(crate) const SELECTIONS: &[(&str, SelectionMode)] = &[
    ("auto", SelectionMode::Auto),
    ("power", SelectionMode::Power),
    ("place", SelectionMode::Place),
    ("uniform", SelectionMode::Uniform),
    ("all", SelectionMode::All),
];
pub(crate) const TRIANGLE_SAMPLINGS: &[(&str, TriangleSampling)] = &[
    ("area", TriangleSampling::Area),
    ("solid-angle", TriangleSampling::SolidAngle),
];
pub(crate) const REUSES: &[(&str, bool)] = &[("pixels", true), ("none", false)];
pub(crate) const VIEWS: &[(&str, DebugView)] = &[
    ("normals", DebugView::Normals),
    ("uv", DebugView::Uv),
    ("ids", DebugView::Ids),
];

/// Light samples at the first vertex at most.
const MOST_LIGHT_SAMPLES: u32 = 1024;
/// Scatterings at most where none are given; a branching integrator cannot afford as many as a path.
const DEFAULT_DEPTH: u32 = 16;
const DEFAULT_DEPTH_BRANCHING: u32 = 4;
const DEFAULT_BRANCHING: u32 = 4;
/// Error and rays of a record of irradiance; errors above 1 say nothing, and with fewer rays gradients are noise.
const DEFAULT_CACHE_ERROR: f32 = 0.3;
const DEFAULT_CACHE_RAYS: u32 = 1024;
const LEAST_CACHE_RAYS: u32 = 16;
const MOST_CACHE_RAYS: u32 = 1 << 20;
/// Rays that the last vertices of one sample may send at most: seconds for a single sample.
const MOST_BRANCHES: f64 = 1e7;

impl Default for Estimator {
    /// The best one.
    fn default() -> Self {
        Self {
            kind: IntegratorKind::Path,
            strategy: Strategy::default(),
            light_selection: SelectionMode::default(),
            triangle_sampling: TriangleSampling::default(),
            max_depth: None,
            roulette: Roulette::default(),
            reuse: true,
            light_samples: None,
            branching: DEFAULT_BRANCHING,
            ao_distance: None,
            cache_error: DEFAULT_CACHE_ERROR,
            cache_rays: DEFAULT_CACHE_RAYS,
            view: DebugView::default(),
        }
    }
}

impl Estimator {
    /// What the scene file says, over the best.
    pub(super) fn of(file: &SceneFile) -> Result<Self, FileError> {
        let (best, render) = (Self::default(), &file.render);
        let number = |key: &Option<Spanned<u32>>| key.as_ref().map(|n| *n.get_ref());
        Ok(Self {
            kind: named(file, "integrator", &render.integrator, IntegratorKind::NAMES)?.unwrap_or(best.kind),
            strategy: Strategy {
                directions: named(file, "directions", &render.directions, DIRECTIONS)?.unwrap_or_default(),
                direct: named(file, "direct", &render.direct, DIRECT)?.unwrap_or_default(),
                heuristic: named(file, "mis", &render.mis, HEURISTICS)?.unwrap_or_default(),
            },
            light_selection: named(file, "light-selection", &render.light_selection, SELECTIONS)?.unwrap_or_default(),
            triangle_sampling: named(file, "triangle-sampling", &render.triangle_sampling, TRIANGLE_SAMPLINGS)?
                .unwrap_or_default(),
            max_depth: render.max_depth,
            roulette: render.roulette_depth.map_or(best.roulette, |depth| Roulette { depth }),
            reuse: named(file, "reuse", &render.reuse, REUSES)?.unwrap_or(best.reuse),
            light_samples: number(&render.light_samples),
            branching: number(&render.branching).unwrap_or(best.branching),
            ao_distance: render.ao_distance.as_ref().map(|d| *d.get_ref()),
            cache_error: render.cache_error.as_ref().map_or(best.cache_error, |e| *e.get_ref()),
            cache_rays: number(&render.cache_rays).unwrap_or(best.cache_rays),
            view: named(file, "view", &render.view, VIEWS)?.unwrap_or_default(),
        })
    }

    /// The first value that cannot be, whatever the others are.
    pub(super) fn wrong_value(&self) -> Option<InvalidSetting> {
        if let Some(n) = self.light_samples.filter(|&n| n > MOST_LIGHT_SAMPLES) {
            let help = format!("{MOST_LIGHT_SAMPLES} at most; more samples a pixel are more of everything");
            return Some(InvalidSetting::new("light-samples", n, help));
        }
        // NaN is none of them.
        if !(self.cache_error > 0.0 && self.cache_error <= 1.0) {
            let help = "use a share above 0, 1 at most: smaller ones are more exact";
            return Some(InvalidSetting::new("cache-error", self.cache_error, help));
        }
        if !(LEAST_CACHE_RAYS..=MOST_CACHE_RAYS).contains(&self.cache_rays) {
            let help = format!("use a number from {LEAST_CACHE_RAYS} to {MOST_CACHE_RAYS}");
            return Some(InvalidSetting::new("cache-rays", self.cache_rays, help));
        }
        let is_length = |d: f32| d > 0.0 && d.is_finite();
        let above_0 = |setting, value: &dyn Display| Some(InvalidSetting::new(setting, value, ABOVE_0));
        match (self.light_samples, self.branching, self.ao_distance) {
            (Some(0), ..) => above_0("light-samples", &0),
            (_, 0, _) => above_0("branching", &0),
            (_, _, Some(d)) if !is_length(d) => above_0("ao-distance", &d),
            _ => None,
        }
    }

    /// Scattering events at most.
    fn max_depth(&self) -> Option<u32> {
        let usual = match self.kind {
            IntegratorKind::Distributed => DEFAULT_DEPTH_BRANCHING,
            _ => DEFAULT_DEPTH,
        };
        self.max_depth.map_or(Some(usual), |depth| depth.0)
    }

    /// Light samples at the first vertex. Where paths are shared, or indirect light is in a cache, its own light is much of the error that is left.
    fn light_samples(&self) -> u32 {
        let is_alone = match self.kind {
            IntegratorKind::Path => self.reuse,
            kind => kind == IntegratorKind::IrradianceCache,
        };
        self.light_samples.unwrap_or(if is_alone { 2 } else { 1 })
    }

    /// Refuses trees that nobody can wait for.
    pub(super) fn check_branches(&self) -> Result<(), Error> {
        let rays = |depth: u32| (self.branching as f64).powf(depth as f64);
        let depth = MaxDepth(self.max_depth());
        match self.max_depth() {
            _ if self.kind != IntegratorKind::Distributed => Ok(()),
            Some(d) if rays(d) <= MOST_BRANCHES => Ok(()),
            _ => Err(Error::Refused(format!(
                "--integrator distributed sends {} rays from every vertex, to a depth of {depth}: too many to wait for\n  \
                 help: lower --branching or --max-depth (branching ^ depth of {MOST_BRANCHES:.0} at most)",
                self.branching
            ))),
        }
    }

    /// A builder for scenes whose lights are sampled as this says.
    pub(crate) fn scene_builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        builder.light_selection(self.light_selection);
        builder.triangle_sampling(self.triangle_sampling);
        builder
    }

    /// Says so where the scene's lights cannot be found: light that comes from single points or directions is never met by
    /// chance. An error where that is all the light there is, else a warning.
    pub(crate) fn check_lights(&self, scene: &Scene) -> Result<Option<String>, Error> {
        let samples_lights = match self.kind {
            IntegratorKind::Naive => false,
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::IrradianceCache => self.strategy.samples_lights(),
            IntegratorKind::Whitted | IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => true,
        };
        let shining = || scene.lights().iter().filter(|l| l.power(1.0) > 0.0);
        let Some(light) = shining().find(|l| l.is_delta()).filter(|_| !samples_lights) else {
            return Ok(None);
        };
        let words = format!(
            "a {} light cannot be met by following rays, and {} samples no lights",
            light.kind(),
            if self.kind == IntegratorKind::Naive {
                "--integrator naive"
            } else {
                "--direct none"
            }
        );
        if shining().all(|l| l.is_delta()) {
            let help = "use --integrator path with --direct light or mis, or give the scene a light that has a size";
            return Err(Error::Refused(format!(
                "{words}: the picture would be black\n  help: {help}"
            )));
        }
        Ok(Some(format!("{words}: its light is missing from the picture")))
    }

    /// Says so where an irradiance cache knows nothing: a record holds for its time alone.
    pub(crate) fn check_motion(&self, scene: &Scene, camera: &Camera) -> Option<String> {
        let [open, close] = camera.shutter();
        let is_in_vain = self.kind == IntegratorKind::IrradianceCache && scene.is_moving() && open < close;
        let words = "the scene moves while the shutter is open: the irradiance cache stays empty, and the picture is that of paths alone";
        is_in_vain.then(|| words.into())
    }

    /// Whether it gathers the light of lights, which can then be told apart. Records of irradiance are of all lights together.
    pub(crate) fn gathers_light(&self) -> bool {
        !matches!(
            self.kind,
            IntegratorKind::AmbientOcclusion | IntegratorKind::Debug | IntegratorKind::IrradianceCache
        )
    }

    /// A sampler of `kind`, for `count` samples of a pixel, as the directions want it.
    pub(crate) fn sampler(&self, kind: SamplerKind, seed: u64, count: u32) -> RenderSampler {
        let sampler = kind.with_seed(seed, count);
        match self.strategy.directions {
            Directions::PerturbedQmc => RenderSampler::PerturbedQmc(PerturbedQmc::new(seed, count, sampler)),
            Directions::Bsdf | Directions::Cosine | Directions::Uniform => RenderSampler::Plain(sampler),
        }
    }

    /// Whether its random numbers depend on how many samples a pixel gets in all.
    pub(crate) fn knows_count(&self) -> bool {
        self.strategy.directions == Directions::PerturbedQmc
    }

    /// The name users type.
    pub fn name(&self) -> &'static str {
        name_of(IntegratorKind::NAMES, self.kind)
    }

    /// Everything that decides the pixels, as `key=value` pairs.
    pub(crate) fn settings(&self) -> String {
        let depth = MaxDepth(self.max_depth());
        let strategy = self.strategy;
        let mut text = format!("integrator={}", self.name());
        match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::IrradianceCache => {
                text += &format!(
                    " directions={} direct={} mis={}",
                    name_of(DIRECTIONS, strategy.directions),
                    name_of(DIRECT, strategy.direct),
                    name_of(HEURISTICS, strategy.heuristic)
                );
            }
            IntegratorKind::AmbientOcclusion => text += &format!(" ao_distance={:?}", self.ao_distance),
            IntegratorKind::Debug => text += &format!(" view={}", name_of(VIEWS, self.view)),
            IntegratorKind::Naive | IntegratorKind::Whitted => {}
        }
        let samples_lights = match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::IrradianceCache => strategy.samples_lights(),
            IntegratorKind::Whitted => true,
            IntegratorKind::Naive | IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => false,
        };
        if samples_lights {
            text += &format!(
                " light_selection={} triangle_sampling={}",
                name_of(SELECTIONS, self.light_selection),
                name_of(TRIANGLE_SAMPLINGS, self.triangle_sampling)
            );
        }
        match self.kind {
            IntegratorKind::Path => {
                let (roulette, reuse) = (self.roulette.depth, name_of(REUSES, self.reuse));
                let lights = self.light_samples();
                text + &format!(" max_depth={depth} roulette_depth={roulette} reuse={reuse} light_samples={lights}")
            }
            IntegratorKind::Naive => text + &format!(" max_depth={depth} roulette_depth={}", self.roulette.depth),
            IntegratorKind::IrradianceCache => {
                let (roulette, lights) = (self.roulette.depth, self.light_samples());
                let (error, rays) = (self.cache_error, self.cache_rays);
                text + &format!(
                    " max_depth={depth} roulette_depth={roulette} light_samples={lights} cache_error={error} cache_rays={rays}"
                )
            }
            IntegratorKind::Distributed => text + &format!(" max_depth={depth} branching={}", self.branching),
            IntegratorKind::Whitted => text + &format!(" max_depth={depth}"),
            IntegratorKind::Direct => text + &format!(" light_samples={}", self.light_samples()),
            IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => text,
        }
    }

    /// Makes what has to be there before the first sample, which is nothing but for an irradiance cache.
    pub(crate) fn prepare<A: Accel>(
        &self,
        world: World<A>,
        irradiance: &Irradiance,
        observer: &impl Observer,
    ) -> (Outcome, Statistics) {
        if self.kind != IntegratorKind::IrradianceCache {
            return (Outcome::Complete, Statistics::default());
        }
        let maker = RecordMaker {
            path: self.plain_path(world),
            rays: self.cache_rays,
        };
        irradiance.fill(&maker, self.cache_error, observer)
    }

    /// The paths beside an irradiance cache, each by itself.
    fn plain_path<'a, A: Accel>(&self, world: World<'a, A>) -> PathIntegrator<'a, A> {
        PathIntegrator {
            world,
            strategy: self.strategy,
            max_depth: self.max_depth(),
            roulette: self.roulette,
            light_samples: self.light_samples(),
            reuse: false,
        }
    }

    /// Adds to every pixel of `film` the samples before the one with index `end`, or fewer where `noise` names a relative error that is small
    /// enough.
    pub(crate) fn render<A: Accel>(
        &self,
        (world, irradiance): (World<A>, &Irradiance),
        sampler: &impl Sampler,
        film: &mut Film,
        end: u32,
        noise: Option<f64>,
        observer: &impl Observer,
    ) -> (Outcome, Statistics) {
        struct Render<'a, S, O> {
            sampler: &'a S,
            film: &'a mut Film,
            end: u32,
            noise: Option<f64>,
            observer: &'a O,
        }
        impl<S: Sampler, O: Observer> Task for Render<'_, S, O> {
            type Output = (Outcome, Statistics);
            fn run(self, integrator: &impl Integrator) -> Self::Output {
                let Self {
                    sampler,
                    film,
                    end,
                    noise,
                    observer,
                } = self;
                match noise {
                    None => render::render(integrator, sampler, film, end, observer),
                    Some(level) => render::render_to_noise(integrator, sampler, film, level, end, observer),
                }
            }
        }
        let (outcome, prepared) = self.prepare(world, irradiance, observer);
        if outcome == Outcome::Stopped {
            return (outcome, prepared);
        }
        let (outcome, statistics) = self.with_integrator(
            world,
            irradiance.cache(),
            Render {
                sampler,
                film,
                end,
                noise,
                observer,
            },
        );
        (outcome, prepared.merge(statistics))
    }

    /// Traces the sample `key`, and those that a render traces together with it, after [`Estimator::prepare`]; `sink` makes the sinks, told
    /// whether it is for `key` itself.
    pub(crate) fn sample<A: Accel, O: Sink>(
        &self,
        (world, irradiance): (World<A>, &Irradiance),
        (resolution, key): (UVec2, SampleKey),
        sampler: &mut impl Sampler,
        sink: impl Fn(bool) -> O,
    ) {
        struct Sample<'a, S, F> {
            resolution: UVec2,
            key: SampleKey,
            sampler: &'a mut S,
            sink: F,
        }
        impl<S: Sampler, O: Sink, F: Fn(bool) -> O> Task for Sample<'_, S, F> {
            type Output = ();
            fn run(self, integrator: &impl Integrator) {
                let keys = companions(integrator, self.resolution, self.key);
                let mut sinks: Vec<O> = keys.iter().map(|key| (self.sink)(*key == self.key)).collect();
                integrator.samples(&keys, self.sampler, &mut sinks);
            }
        }
        self.with_integrator(
            world,
            irradiance.cache(),
            Sample {
                resolution,
                key,
                sampler,
                sink,
            },
        );
    }

    /// The one place that chooses the integrator.
    fn with_integrator<A: Accel, T: Task>(
        &self,
        world: World<A>,
        irradiance: Option<&IrradianceCache>,
        task: T,
    ) -> T::Output {
        let Self { strategy, roulette, .. } = *self;
        let (max_depth, light_samples) = (self.max_depth(), self.light_samples());
        let path = |max_depth, reuse| PathIntegrator {
            world,
            strategy,
            max_depth,
            roulette,
            light_samples,
            reuse,
        };
        match self.kind {
            IntegratorKind::Path => task.run(&path(max_depth, self.reuse)),
            // One scattering is a path of depth 1, which has nothing to share.
            IntegratorKind::Direct => task.run(&path(Some(1), false)),
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
            IntegratorKind::IrradianceCache => {
                let empty = IrradianceCache::new(self.cache_error, world.scene.bounds());
                task.run(&IrradianceCacheIntegrator {
                    path: self.plain_path(world),
                    cache: irradiance.unwrap_or(&empty),
                })
            }
        }
    }
}

/// What is done with an integrator, whichever it is.
trait Task {
    type Output;
    fn run(self, integrator: &impl Integrator) -> Self::Output;
}
