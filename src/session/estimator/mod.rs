mod checks;
mod common_errors;
mod memory;
mod run;
mod switches;

pub(crate) use run::Prepared;
pub(crate) use switches::SWITCHES;

use crate::description::{MaxDepth, SceneFile, named};
use crate::integrator::{
    DebugView, DirectLight, Directions, Heuristic, Metropolis, MetropolisDirect, MetropolisTarget, Roulette, Strategy,
    strategies,
};
use crate::io::{FileError, name_of};
use crate::light::{SelectionMode, TriangleSampling};
use crate::sampler::{PerturbedQmc, RenderSampler, SamplerKind};
use crate::scene::SceneBuilder;
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
    /// How Markov chains go.
    pub metropolis: Metropolis,
    /// Paths of photons; `None`: as many as is usual.
    pub photons: Option<u32>,
    /// How far away photons count, in the first frame where frames differ, scene units; `None`: by the width of a pixel.
    pub photon_radius: Option<f32>,
    /// How quickly that shrinks: the share of new photons that disks of progressive photon mapping keep.
    pub photon_alpha: f32,
    /// Photons that photon mapping makes one estimate of.
    pub photon_count: u32,
    /// Rays that photon mapping gathers by.
    pub gather_rays: u32,
}

/// Integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntegratorKind {
    /// [`PathIntegrator`](crate::integrator::PathIntegrator)
    Path,
    /// [`NaiveIntegrator`](crate::integrator::NaiveIntegrator)
    Naive,
    /// [`WhittedIntegrator`](crate::integrator::WhittedIntegrator)
    Whitted,
    /// [`DistributedIntegrator`](crate::integrator::DistributedIntegrator)
    Distributed,
    /// A [`PathIntegrator`](crate::integrator::PathIntegrator) that scatters once.
    Direct,
    /// [`AmbientOcclusion`](crate::integrator::AmbientOcclusion)
    AmbientOcclusion,
    /// [`DebugIntegrator`](crate::integrator::DebugIntegrator)
    Debug,
    /// [`LightIntegrator`](crate::integrator::LightIntegrator)
    Light,
    /// [`BidirectionalIntegrator`](crate::integrator::BidirectionalIntegrator)
    Bidirectional,
    /// [`PrimarySpaceIntegrator`](crate::integrator::PrimarySpaceIntegrator)
    PrimarySpace,
    /// [`ProgressivePhotonIntegrator`](crate::integrator::ProgressivePhotonIntegrator)
    ProgressivePhotons,
    /// [`PhotonMapIntegrator`](crate::integrator::PhotonMapIntegrator)
    PhotonMap,
    /// [`VertexMergingIntegrator`](crate::integrator::VertexMergingIntegrator)
    VertexMerging,
    /// [`PathSpaceIntegrator`](crate::integrator::PathSpaceIntegrator)
    PathSpace,
    /// [`IrradianceCacheIntegrator`](crate::integrator::IrradianceCacheIntegrator)
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
        ("light", Self::Light),
        ("bdpt", Self::Bidirectional),
        ("pssmlt", Self::PrimarySpace),
        ("sppm", Self::ProgressivePhotons),
        ("photon-map", Self::PhotonMap),
        ("vcm", Self::VertexMerging),
        ("mlt", Self::PathSpace),
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

/// Scatterings at most where the strategies of all lengths are told apart.
const MOST_STRATEGIES_DEPTH: u32 = 6;

pub(crate) const METROPOLIS_DIRECT: &[(&str, MetropolisDirect)] = &[
    ("ordinary", MetropolisDirect::Ordinary),
    ("metropolis", MetropolisDirect::Metropolis),
];

pub(crate) const METROPOLIS_TARGETS: &[(&str, MetropolisTarget)] = &[
    ("relative", MetropolisTarget::Relative),
    ("luminance", MetropolisTarget::Luminance),
];

/// Light samples at the first vertex at most.
const MOST_LIGHT_SAMPLES: u32 = 1024;
/// Scatterings of a path at most, `none` included: milliseconds for a single path. Roulette from the first vertices on lets 10^-23 of the paths come so far.
const MOST_SCATTERINGS: u32 = 1024;
/// Scatterings at most where none are given; a branching integrator cannot afford as many as a path.
const DEFAULT_DEPTH: u32 = 16;
const DEFAULT_DEPTH_BRANCHING: u32 = 4;
const DEFAULT_BRANCHING: u32 = 4;
/// The share of photons that Hachisuka and Jensen (2009) and Knaus and Zwicker (2011) keep.
const DEFAULT_ALPHA: f32 = 2.0 / 3.0;
/// Pixels that a disk of photons reaches in the first frame (docs/benchmarks.md).
const DEFAULT_RADIUS_PIXELS: f32 = 3.0;
/// The same where connections find most of the light: merging loses light at edges at every vertex, that of lamps too.
const DEFAULT_MERGING_PIXELS: f32 = 1.0;
/// Paths of photons at a time at most: each leaves several photons, of 64 bytes.
const MOST_PHOTONS: u32 = 1 << 26;
/// The same where they are kept whole, to merge with: some 1.5 kB each.
const MOST_MERGED_PHOTONS: u32 = 1 << 24;
/// Paths of photons that are sent once.
const DEFAULT_PHOTONS: u32 = 1 << 18;
/// Photons of an estimate.
const DEFAULT_PHOTON_COUNT: u32 = 64;
const MOST_PHOTON_COUNT: u32 = 1 << 16;
const DEFAULT_GATHER_RAYS: u32 = 4;
/// Rays that gather at most: their random numbers have so many places.
const MOST_GATHER_RAYS: u32 = 100;
/// Error and rays of a record of irradiance; errors above 1 say nothing, and with fewer rays gradients are noise.
const DEFAULT_CACHE_ERROR: f32 = 0.3;
const DEFAULT_CACHE_RAYS: u32 = 1024;
const LEAST_CACHE_RAYS: u32 = 16;
const MOST_CACHE_RAYS: u32 = 1 << 20;
/// Rays to the last vertices of one branching sample at most: seconds.
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
            metropolis: Metropolis::default(),
            photons: None,
            photon_radius: None,
            photon_alpha: DEFAULT_ALPHA,
            photon_count: DEFAULT_PHOTON_COUNT,
            gather_rays: DEFAULT_GATHER_RAYS,
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
            cache_error: render.cache_error.as_ref().map_or(best.cache_error, |e| *e.get_ref()),
            cache_rays: number(&render.cache_rays).unwrap_or(best.cache_rays),
            view: named(file, "view", &render.view, VIEWS)?.unwrap_or_default(),
            metropolis: Metropolis {
                direct: named(file, "metropolis-direct", &render.metropolis_direct, METROPOLIS_DIRECT)?
                    .unwrap_or_default(),
                target: named(file, "metropolis-target", &render.metropolis_target, METROPOLIS_TARGETS)?
                    .unwrap_or_default(),
                chains: number(&render.chains),
                bootstrap: number(&render.bootstrap),
                large_step_probability: share(&render.large_step_probability, best.metropolis.large_step_probability),
                mutation_size: share(&render.mutation_size, best.metropolis.mutation_size),
            },
            photons: number(&render.photons),
            photon_radius: render.photon_radius.as_ref().map(|r| *r.get_ref()),
            photon_alpha: render.photon_alpha.as_ref().map_or(best.photon_alpha, |a| *a.get_ref()),
            photon_count: number(&render.photon_count).unwrap_or(best.photon_count),
            gather_rays: number(&render.gather_rays).unwrap_or(best.gather_rays),
        })
    }

    /// Pixels that a disk of photons reaches in the first frame where no length is given.
    fn radius_pixels(&self) -> f32 {
        match self.kind {
            IntegratorKind::VertexMerging => DEFAULT_MERGING_PIXELS,
            _ => DEFAULT_RADIUS_PIXELS,
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

    /// Scattering events at most, for integrators: there is always an end, also where roulette comes late or never.
    fn most_scatterings(&self) -> Option<u32> {
        Some(self.max_depth().unwrap_or(MOST_SCATTERINGS))
    }

    /// Light samples at the first vertex. Where paths are shared, or indirect light is in a cache, its own light is much of the error that is left.
    fn light_samples(&self) -> u32 {
        let is_alone = match self.kind {
            IntegratorKind::Path => self.reuse,
            kind => kind == IntegratorKind::IrradianceCache,
        };
        self.light_samples.unwrap_or(if is_alone { 2 } else { 1 })
    }

    /// A builder for scenes whose lights are sampled as this says.
    pub(crate) fn scene_builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        builder.light_selection(self.light_selection);
        builder.triangle_sampling(self.triangle_sampling);
        builder
    }

    /// Whether it gathers the light of lights, which can then be told apart. Records of irradiance are of all lights together.
    pub(crate) fn gathers_light(&self) -> bool {
        !matches!(
            self.kind,
            IntegratorKind::AmbientOcclusion | IntegratorKind::Debug | IntegratorKind::IrradianceCache
        )
    }

    /// Names of its strategies by vertices from the light and from the camera, in the order in which frames tell them apart.
    pub(crate) fn strategies(&self) -> Vec<String> {
        match (self.kind, self.max_depth()) {
            (IntegratorKind::Bidirectional, Some(depth)) => {
                strategies(depth).map(|(s, t)| format!("s{s}_t{t}")).collect()
            }
            _ => Vec::new(),
        }
    }

    /// A sampler of `kind`, for `count` samples of a pixel, as the directions want it.
    pub(crate) fn sampler(&self, kind: SamplerKind, seed: u64, count: u32) -> RenderSampler {
        let sampler = kind.with_seed(seed, count);
        match self.knows_count() {
            true => RenderSampler::PerturbedQmc(PerturbedQmc::new(seed, count, sampler)),
            false => RenderSampler::Plain(sampler),
        }
    }

    /// Whether its random numbers depend on how many samples a pixel gets in all.
    pub(crate) fn knows_count(&self) -> bool {
        self.reads("directions") && self.strategy.directions == Directions::PerturbedQmc
    }

    /// The name users type.
    pub fn name(&self) -> &'static str {
        name_of(IntegratorKind::NAMES, self.kind)
    }

    /// Paths of photons that are sent once.
    fn mapped_photons(&self) -> u32 {
        self.photons.unwrap_or(DEFAULT_PHOTONS)
    }
}
