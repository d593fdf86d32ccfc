use super::args::EstimatorArgs;
use super::error::CliError;
use super::job::{choose, name_of, positive};
use crate::accel::Accel;
use crate::film::Film;
use crate::integrator::{
    AmbientOcclusion, DebugIntegrator, DebugView, DirectLight, Directions, DistributedIntegrator, Heuristic,
    Integrator, NaiveIntegrator, PathIntegrator, Roulette, Sink, Strategy, WhittedIntegrator, World,
};
use crate::io::{MaxDepth, SceneFile};
use crate::light::{SelectionMode, TriangleSampling};
use crate::math::UVec2;
use crate::render::{self, Observer, Outcome, Statistics, companions};
use crate::sampler::{PerturbedQmc, RenderSampler, SampleKey, Sampler, SamplerKind};
use crate::scene::{Scene, SceneBuilder};

/// An integrator and its switches, as users choose them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Estimator {
    pub kind: Kind,
    pub strategy: Strategy,
    pub light_selection: SelectionMode,
    pub triangle_sampling: TriangleSampling,
    pub max_depth: Option<u32>,
    pub roulette: Roulette,
    /// Whether pixels share their paths.
    pub reuse: bool,
    /// Light samples at the first vertex; `None`: the best number.
    pub light_samples: Option<u32>,
    pub branching: u32,
    /// Scene units; `None`: the size of the scene.
    pub ao_distance: Option<f32>,
    pub view: DebugView,
}

/// What `--integrator` names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Path,
    Naive,
    Whitted,
    Distributed,
    Direct,
    AmbientOcclusion,
    Debug,
}

/// Names of integrators; the first is the default.
const KINDS: &[(&str, Kind)] = &[
    ("path", Kind::Path),
    ("naive", Kind::Naive),
    ("whitted", Kind::Whitted),
    ("distributed", Kind::Distributed),
    ("direct", Kind::Direct),
    ("ao", Kind::AmbientOcclusion),
    ("debug", Kind::Debug),
];
const DIRECTIONS: &[(&str, Directions)] = &[
    ("bsdf", Directions::Bsdf),
    ("cosine", Directions::Cosine),
    ("uniform", Directions::Uniform),
    ("perturbed-qmc", Directions::PerturbedQmc),
];
const DIRECT: &[(&str, DirectLight)] = &[
    ("mis", DirectLight::Mis),
    ("light", DirectLight::Light),
    ("none", DirectLight::None),
];
const HEURISTICS: &[(&str, Heuristic)] = &[("power", Heuristic::Power), ("balance", Heuristic::Balance)];
const SELECTIONS: &[(&str, SelectionMode)] = &[
    ("auto", SelectionMode::Auto),
    ("power", SelectionMode::Power),
    ("place", SelectionMode::Place),
    ("uniform", SelectionMode::Uniform),
    ("all", SelectionMode::All),
];
const TRIANGLE_SAMPLINGS: &[(&str, TriangleSampling)] = &[
    ("area", TriangleSampling::Area),
    ("solid-angle", TriangleSampling::SolidAngle),
];
const REUSES: &[(&str, bool)] = &[("pixels", true), ("none", false)];
const VIEWS: &[(&str, DebugView)] = &[
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
/// Rays that the last vertices of one sample may send at most: seconds for a single sample.
const MOST_BRANCHES: f64 = 1e7;

impl Default for Estimator {
    /// The best one.
    fn default() -> Self {
        Self {
            kind: Kind::Path,
            strategy: Strategy::default(),
            light_selection: SelectionMode::default(),
            triangle_sampling: TriangleSampling::default(),
            max_depth: Some(DEFAULT_DEPTH),
            roulette: Roulette::default(),
            reuse: true,
            light_samples: None,
            branching: DEFAULT_BRANCHING,
            ao_distance: None,
            view: DebugView::default(),
        }
    }
}

impl Estimator {
    /// Flags over the scene file over the defaults.
    pub fn new(args: &EstimatorArgs, scene: &SceneFile) -> Result<Self, CliError> {
        let file = &scene.render;
        let kind = choose(scene, "integrator", &args.integrator, &file.integrator, KINDS)?;
        let default_depth = if kind == Kind::Distributed {
            DEFAULT_DEPTH_BRANCHING
        } else {
            DEFAULT_DEPTH
        };
        let max_depth = args
            .max_depth
            .or(file.max_depth)
            .unwrap_or(MaxDepth(Some(default_depth)));
        let estimator = Self {
            kind,
            strategy: Strategy {
                directions: choose(scene, "directions", &args.directions, &file.directions, DIRECTIONS)?,
                direct: choose(scene, "direct", &args.direct, &file.direct, DIRECT)?,
                heuristic: choose(scene, "mis", &args.mis, &file.mis, HEURISTICS)?,
            },
            light_selection: choose(
                scene,
                "light-selection",
                &args.light_selection,
                &file.light_selection,
                SELECTIONS,
            )?,
            triangle_sampling: choose(
                scene,
                "triangle-sampling",
                &args.triangle_sampling,
                &file.triangle_sampling,
                TRIANGLE_SAMPLINGS,
            )?,
            max_depth: max_depth.0,
            roulette: args
                .roulette_depth
                .or(file.roulette_depth)
                .map_or_else(Roulette::default, |depth| Roulette { depth }),
            reuse: choose(scene, "reuse", &args.reuse, &file.reuse, REUSES)?,
            light_samples: light_samples(scene, args)?,
            branching: positive(scene, "branching", args.branching, &file.branching)?.unwrap_or(DEFAULT_BRANCHING),
            ao_distance: positive(scene, "ao-distance", args.ao_distance, &file.ao_distance)?,
            view: choose(scene, "view", &args.view, &file.view, VIEWS)?,
        };
        estimator.check_branches()?;
        Ok(estimator)
    }

    /// Light samples at the first vertex. Where paths are shared its own light is much of the error that is left.
    fn light_samples(&self) -> u32 {
        let is_shared = self.kind == Kind::Path && self.reuse;
        self.light_samples.unwrap_or(if is_shared { 2 } else { 1 })
    }

    /// Refuses trees that nobody can wait for.
    fn check_branches(&self) -> Result<(), CliError> {
        let rays = |depth: u32| (self.branching as f64).powf(depth as f64);
        let depth = MaxDepth(self.max_depth);
        match self.max_depth {
            _ if self.kind != Kind::Distributed => Ok(()),
            Some(d) if rays(d) <= MOST_BRANCHES => Ok(()),
            _ => Err(CliError::Usage(format!(
                "--integrator distributed sends {} rays from every vertex, to a depth of {depth}: too many to wait for\n  \
                 help: lower --branching or --max-depth (branching ^ depth of {MOST_BRANCHES:.0} at most)",
                self.branching
            ))),
        }
    }

    /// A builder for scenes whose lights are sampled as this says.
    pub fn scene_builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        builder.light_selection(self.light_selection);
        builder.triangle_sampling(self.triangle_sampling);
        builder
    }

    /// Says so where the scene's lights cannot be found: light that comes from single points or directions is never met by
    /// chance. An error where that is all the light there is, else a warning.
    pub fn check_lights(&self, scene: &Scene) -> Result<Option<String>, CliError> {
        let samples_lights = match self.kind {
            Kind::Naive => false,
            Kind::Path | Kind::Direct | Kind::Distributed => self.strategy.samples_lights(),
            Kind::Whitted | Kind::AmbientOcclusion | Kind::Debug => true,
        };
        let shining = || scene.lights().iter().filter(|l| l.power(1.0) > 0.0);
        let Some(light) = shining().find(|l| l.is_delta()).filter(|_| !samples_lights) else {
            return Ok(None);
        };
        let words = format!(
            "a {} light cannot be met by following rays, and {} samples no lights",
            light.kind(),
            if self.kind == Kind::Naive {
                "--integrator naive"
            } else {
                "--direct none"
            }
        );
        if shining().all(|l| l.is_delta()) {
            let help = "use --integrator path with --direct light or mis, or give the scene a light that has a size";
            return Err(CliError::Usage(format!(
                "{words}: the picture would be black\n  help: {help}"
            )));
        }
        Ok(Some(format!("{words}: its light is missing from the picture")))
    }

    /// Whether it gathers the light of lights, which can then be told apart.
    pub fn gathers_light(&self) -> bool {
        !matches!(self.kind, Kind::AmbientOcclusion | Kind::Debug)
    }

    /// A sampler of `kind`, for `count` samples of a pixel, as the directions want it.
    pub fn sampler(&self, kind: SamplerKind, seed: u64, count: u32) -> RenderSampler {
        let sampler = kind.with_seed(seed, count);
        match self.strategy.directions {
            Directions::PerturbedQmc => RenderSampler::PerturbedQmc(PerturbedQmc::new(seed, count, sampler)),
            Directions::Bsdf | Directions::Cosine | Directions::Uniform => RenderSampler::Plain(sampler),
        }
    }

    /// Whether its random numbers depend on how many samples a pixel gets in all.
    pub fn knows_count(&self) -> bool {
        self.strategy.directions == Directions::PerturbedQmc
    }

    /// The name users type.
    pub fn name(&self) -> &'static str {
        name_of(KINDS, self.kind)
    }

    /// Everything that decides the pixels, as `key=value` pairs.
    pub fn settings(&self) -> String {
        let depth = MaxDepth(self.max_depth);
        let strategy = self.strategy;
        let mut text = format!("integrator={}", self.name());
        match self.kind {
            Kind::Path | Kind::Direct | Kind::Distributed => {
                text += &format!(
                    " directions={} direct={} mis={}",
                    name_of(DIRECTIONS, strategy.directions),
                    name_of(DIRECT, strategy.direct),
                    name_of(HEURISTICS, strategy.heuristic)
                );
            }
            Kind::AmbientOcclusion => text += &format!(" ao_distance={:?}", self.ao_distance),
            Kind::Debug => text += &format!(" view={}", name_of(VIEWS, self.view)),
            Kind::Naive | Kind::Whitted => {}
        }
        let samples_lights = match self.kind {
            Kind::Path | Kind::Direct | Kind::Distributed => strategy.samples_lights(),
            Kind::Whitted => true,
            Kind::Naive | Kind::AmbientOcclusion | Kind::Debug => false,
        };
        if samples_lights {
            text += &format!(
                " light_selection={} triangle_sampling={}",
                name_of(SELECTIONS, self.light_selection),
                name_of(TRIANGLE_SAMPLINGS, self.triangle_sampling)
            );
        }
        match self.kind {
            Kind::Path => {
                let (roulette, reuse) = (self.roulette.depth, name_of(REUSES, self.reuse));
                let lights = self.light_samples();
                text + &format!(" max_depth={depth} roulette_depth={roulette} reuse={reuse} light_samples={lights}")
            }
            Kind::Naive => text + &format!(" max_depth={depth} roulette_depth={}", self.roulette.depth),
            Kind::Distributed => text + &format!(" max_depth={depth} branching={}", self.branching),
            Kind::Whitted => text + &format!(" max_depth={depth}"),
            Kind::Direct => text + &format!(" light_samples={}", self.light_samples()),
            Kind::AmbientOcclusion | Kind::Debug => text,
        }
    }

    /// Adds to every pixel of `film` the samples before the one with index `end`, or fewer where `noise` names a relative error that is small
    /// enough.
    pub fn render<A: Accel>(
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
        self.with_integrator(
            world,
            Render {
                sampler,
                film,
                end,
                noise,
                observer,
            },
        )
    }

    /// Traces the sample `key`, and those that a render traces together with it; `sink` makes the sinks, told whether it is for
    /// `key` itself.
    pub fn sample<A: Accel, O: Sink>(
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
        let Self {
            strategy,
            roulette,
            max_depth,
            ..
        } = *self;
        let light_samples = self.light_samples();
        let path = |max_depth, reuse| PathIntegrator {
            world,
            strategy,
            max_depth,
            roulette,
            light_samples,
            reuse,
        };
        match self.kind {
            Kind::Path => task.run(&path(max_depth, self.reuse)),
            // One scattering is a path of depth 1, which has nothing to share.
            Kind::Direct => task.run(&path(Some(1), false)),
            Kind::Naive => task.run(&NaiveIntegrator {
                world,
                max_depth,
                roulette,
            }),
            Kind::Whitted => task.run(&WhittedIntegrator { world, max_depth }),
            Kind::Distributed => task.run(&DistributedIntegrator {
                world,
                strategy,
                max_depth: max_depth.unwrap_or(DEFAULT_DEPTH_BRANCHING),
                branching: self.branching,
            }),
            Kind::AmbientOcclusion => task.run(&AmbientOcclusion {
                world,
                distance: self.ao_distance.unwrap_or_else(|| 2.0 * world.scene.bounds().radius()),
            }),
            Kind::Debug => task.run(&DebugIntegrator { world, view: self.view }),
        }
    }
}

/// So many that a sample still ends soon.
fn light_samples(scene: &SceneFile, args: &EstimatorArgs) -> Result<Option<u32>, CliError> {
    let file = &scene.render.light_samples;
    let count = positive(scene, "light-samples", args.light_samples, file)?;
    let Some(n) = count.filter(|&n| n > MOST_LIGHT_SAMPLES) else {
        return Ok(count);
    };
    let (message, help) = (
        format!("{n} light samples"),
        format!("{MOST_LIGHT_SAMPLES} at most; more samples a pixel are more of everything"),
    );
    match file {
        Some(blamed) if args.light_samples.is_none() => Err(scene.error(blamed.span(), message).help(help).into()),
        _ => Err(CliError::Usage(format!("{message}\n  help: {help}"))),
    }
}

/// What is done with an integrator, whichever it is.
trait Task {
    type Output;
    fn run(self, integrator: &impl Integrator) -> Self::Output;
}
