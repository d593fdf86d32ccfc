use super::settings::ABOVE_0;
use super::{Error, InvalidSetting};
use crate::accel::Accel;
use crate::film::{Film, Filter};
use crate::integrator::{
    AmbientOcclusion, BidirectionalIntegrator, DebugIntegrator, DebugView, DirectLight, Directions,
    DistributedIntegrator, FrameIntegrator, Heuristic, Integrator, LightIntegrator, Metropolis, MetropolisDirect,
    NaiveIntegrator, PathIntegrator, PathSpaceIntegrator, PrimarySpaceIntegrator, Roulette, Sink, Strategy,
    WhittedIntegrator, World,
};
use crate::io::{FileError, MaxDepth, SceneFile, name_of, named};
use crate::light::{SelectionMode, TriangleSampling};
use crate::math::UVec2;
use crate::render::{self, Observer, Outcome, Statistics, companions};
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
    /// What a debug picture shows.
    pub view: DebugView,
    /// How Markov chains go.
    pub metropolis: Metropolis,
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
    /// [`LightIntegrator`]
    Light,
    /// [`BidirectionalIntegrator`]
    Bidirectional,
    /// [`PrimarySpaceIntegrator`]
    PrimarySpace,
    /// [`PathSpaceIntegrator`]
    PathSpace,
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
        ("light", Self::Light),
        ("bdpt", Self::Bidirectional),
        ("pssmlt", Self::PrimarySpace),
        ("mlt", Self::PathSpace),
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

pub(crate) const METROPOLIS_DIRECT: &[(&str, MetropolisDirect)] = &[
    ("ordinary", MetropolisDirect::Ordinary),
    ("metropolis", MetropolisDirect::Metropolis),
];

/// Light samples at the first vertex at most.
const MOST_LIGHT_SAMPLES: u32 = 1024;
/// Scatterings at most where none are given; a branching integrator cannot afford as many as a path.
const DEFAULT_DEPTH: u32 = 16;
const DEFAULT_DEPTH_BRANCHING: u32 = 4;
const DEFAULT_BRANCHING: u32 = 4;
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
            view: DebugView::default(),
            metropolis: Metropolis::default(),
        }
    }
}

impl Estimator {
    /// What the scene file says, over the best.
    pub(super) fn of(file: &SceneFile) -> Result<Self, FileError> {
        let (best, render) = (Self::default(), &file.render);
        let number = |key: &Option<Spanned<u32>>| key.as_ref().map(|n| *n.get_ref());
        let share = |key: &Option<Spanned<f32>>, best| key.as_ref().map_or(best, |share| *share.get_ref());
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
            view: named(file, "view", &render.view, VIEWS)?.unwrap_or_default(),
            metropolis: Metropolis {
                direct: named(file, "metropolis-direct", &render.metropolis_direct, METROPOLIS_DIRECT)?
                    .unwrap_or_default(),
                chains: number(&render.chains),
                bootstrap: number(&render.bootstrap),
                large_step_probability: share(&render.large_step_probability, best.metropolis.large_step_probability),
                mutation_size: share(&render.mutation_size, best.metropolis.mutation_size),
            },
        })
    }

    /// The first value that cannot be, whatever the others are.
    pub(super) fn wrong_value(&self) -> Option<InvalidSetting> {
        if let Some(n) = self.light_samples.filter(|&n| n > MOST_LIGHT_SAMPLES) {
            let help = format!("{MOST_LIGHT_SAMPLES} at most; more samples a pixel are more of everything");
            return Some(InvalidSetting::new("light-samples", n, help));
        }
        let is_length = |d: f32| d > 0.0 && d.is_finite();
        let above_0 = |setting, value: &dyn Display| Some(InvalidSetting::new(setting, value, ABOVE_0));
        match (self.light_samples, self.branching, self.ao_distance) {
            (Some(0), ..) => above_0("light-samples", &0),
            (_, 0, _) => above_0("branching", &0),
            (_, _, Some(d)) if !is_length(d) => above_0("ao-distance", &d),
            _ => self.wrong_chains(),
        }
    }

    /// The first value of Markov chains that cannot be.
    fn wrong_chains(&self) -> Option<InvalidSetting> {
        let Metropolis {
            chains,
            bootstrap,
            large_step_probability: large,
            mutation_size: size,
            ..
        } = self.metropolis;
        match (chains, bootstrap) {
            (Some(0), _) => Some(InvalidSetting::new("chains", 0, ABOVE_0)),
            (_, Some(0)) => Some(InvalidSetting::new("bootstrap", 0, ABOVE_0)),
            // NaN is in no range.
            _ if !(0.0..=1.0).contains(&large) => Some(InvalidSetting::new(
                "large-step-probability",
                large,
                "use a share from 0 to 1",
            )),
            _ if !(size > 0.0 && size <= 0.5) => {
                let help = "above 0, and 0.5 at most, which is as far as a number in [0, 1) can go either way";
                Some(InvalidSetting::new("mutation-size", size, help))
            }
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

    /// Light samples at the first vertex. Where paths are shared its own light is much of the error that is left.
    fn light_samples(&self) -> u32 {
        let is_shared = self.kind == IntegratorKind::Path && self.reuse;
        self.light_samples.unwrap_or(if is_shared { 2 } else { 1 })
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
            IntegratorKind::Path | IntegratorKind::Direct | IntegratorKind::Distributed => {
                self.strategy.samples_lights()
            }
            IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::PathSpace
            | IntegratorKind::Whitted
            | IntegratorKind::AmbientOcclusion
            | IntegratorKind::Debug => true,
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

    /// Whether it gathers the light of lights, which can then be told apart.
    pub(crate) fn gathers_light(&self) -> bool {
        !matches!(self.kind, IntegratorKind::AmbientOcclusion | IntegratorKind::Debug)
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
            IntegratorKind::Path | IntegratorKind::Direct | IntegratorKind::Distributed => {
                text += &format!(
                    " directions={} direct={} mis={}",
                    name_of(DIRECTIONS, strategy.directions),
                    name_of(DIRECT, strategy.direct),
                    name_of(HEURISTICS, strategy.heuristic)
                );
            }
            IntegratorKind::AmbientOcclusion => text += &format!(" ao_distance={:?}", self.ao_distance),
            IntegratorKind::Debug => text += &format!(" view={}", name_of(VIEWS, self.view)),
            IntegratorKind::Bidirectional | IntegratorKind::PrimarySpace => {
                text += &format!(" mis={}", name_of(HEURISTICS, strategy.heuristic));
            }
            IntegratorKind::Naive | IntegratorKind::Whitted | IntegratorKind::Light | IntegratorKind::PathSpace => {}
        }
        let samples_lights = match self.kind {
            IntegratorKind::Path | IntegratorKind::Direct | IntegratorKind::Distributed => strategy.samples_lights(),
            IntegratorKind::Whitted
            | IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::PathSpace => true,
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
            IntegratorKind::Naive | IntegratorKind::Light | IntegratorKind::Bidirectional => {
                text + &format!(" max_depth={depth} roulette_depth={}", self.roulette.depth)
            }
            IntegratorKind::Distributed => text + &format!(" max_depth={depth} branching={}", self.branching),
            IntegratorKind::PrimarySpace => {
                let lights = self.light_samples();
                text + &format!(" max_depth={depth} light_samples={lights} {}", self.chains())
            }
            IntegratorKind::PathSpace => {
                let (lights, roulette) = (self.light_samples(), self.roulette.depth);
                let chains = self.starts_of_chains();
                text + &format!(" max_depth={depth} roulette_depth={roulette} light_samples={lights} {chains}")
            }
            IntegratorKind::Whitted => text + &format!(" max_depth={depth}"),
            IntegratorKind::Direct => text + &format!(" light_samples={}", self.light_samples()),
            IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => text,
        }
    }

    /// Which Markov chains there are, likewise.
    fn starts_of_chains(&self) -> String {
        let number = |n: Option<u32>| n.map_or("auto".into(), |n| n.to_string());
        let metropolis = &self.metropolis;
        format!(
            "metropolis_direct={} chains={} bootstrap={}",
            name_of(METROPOLIS_DIRECT, metropolis.direct),
            number(metropolis.chains),
            number(metropolis.bootstrap),
        )
    }

    /// How they go, too.
    fn chains(&self) -> String {
        let metropolis = &self.metropolis;
        format!(
            "{} large_step_probability={:?} mutation_size={:?}",
            self.starts_of_chains(),
            metropolis.large_step_probability,
            metropolis.mutation_size
        )
    }

    /// Adds to every pixel of `film` the samples before the one with index `end`, or fewer where `noise` names a relative error that is small
    /// enough.
    pub(crate) fn render<A: Accel>(
        &self,
        world: World<A>,
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
            filter: &'a Filter,
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
                    ..
                } = self;
                match noise {
                    None => render::render(integrator, sampler, film, end, observer),
                    Some(level) => render::render_to_noise(integrator, sampler, film, level, end, observer),
                }
            }
            fn run_frames(self, integrator: &impl FrameIntegrator) -> Self::Output {
                let numbers = (self.sampler, self.filter);
                render::render_frames(integrator, numbers, self.film, (self.end, self.noise), self.observer)
            }
        }
        self.with_integrator(
            world,
            Render {
                sampler,
                film,
                end,
                noise,
                filter: world.filter,
                observer,
            },
        )
    }

    /// Traces the sample `key`, and those that a render traces together with it; `sink` makes the sinks, told whether it is for
    /// `key` itself.
    pub(crate) fn sample<A: Accel, O: Sink>(
        &self,
        world: World<A>,
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
            // Refused before (`Estimator::has_samples_of_pixels`)
            fn run_frames(self, _: &impl FrameIntegrator) {}
        }
        self.with_integrator(
            world,
            Sample {
                resolution,
                key,
                sampler,
                sink,
            },
        );
    }

    /// The one place that chooses the integrator.
    fn with_integrator<A: Accel, T: Task>(&self, world: World<A>, task: T) -> T::Output {
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
            IntegratorKind::Light => task.run_frames(&LightIntegrator {
                world,
                max_depth,
                roulette,
            }),
            IntegratorKind::Bidirectional => task.run_frames(&BidirectionalIntegrator {
                world,
                heuristic: strategy.heuristic,
                max_depth,
                roulette,
            }),
            IntegratorKind::PrimarySpace => task.run_frames(&PrimarySpaceIntegrator {
                world,
                heuristic: strategy.heuristic,
                max_depth,
                light_samples,
                metropolis: self.metropolis,
            }),
            IntegratorKind::PathSpace => task.run_frames(&PathSpaceIntegrator {
                world,
                max_depth,
                roulette,
                light_samples,
                metropolis: self.metropolis,
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
