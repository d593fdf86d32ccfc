mod run;

pub(crate) use run::Prepared;

use super::settings::ABOVE_0;
use super::{Error, InvalidSetting};
use crate::camera::Camera;
use crate::integrator::{
    DebugView, DirectLight, Directions, Heuristic, Metropolis, MetropolisDirect, Roulette, Strategy, strategies,
};
use crate::io::{FileError, MaxDepth, SceneFile, name_of, named};
use crate::light::{SelectionMode, TriangleSampling};
use crate::sampler::{PerturbedQmc, RenderSampler, SamplerKind};
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

/// Light samples at the first vertex at most.
const MOST_LIGHT_SAMPLES: u32 = 1024;
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
        if let Some(n) = self.photons.filter(|&n| n > MOST_PHOTONS) {
            let help = format!("{MOST_PHOTONS} at most; frames of progressive photon mapping add up");
            return Some(InvalidSetting::new("photons", n, help));
        }
        if !(self.photon_alpha > 0.0 && self.photon_alpha <= 1.0) {
            let help = "use a share above 0, at which radii shrink fastest, up to 1, at which they stay";
            return Some(InvalidSetting::new("photon-alpha", self.photon_alpha, help));
        }
        if !(2..=MOST_PHOTON_COUNT).contains(&self.photon_count) {
            let help = format!("use 2 to {MOST_PHOTON_COUNT} photons");
            return Some(InvalidSetting::new("photon-count", self.photon_count, help));
        }
        if !(1..=MOST_GATHER_RAYS).contains(&self.gather_rays) {
            let help = format!("use 1 to {MOST_GATHER_RAYS} rays; more samples a pixel are more of everything");
            return Some(InvalidSetting::new("gather-rays", self.gather_rays, help));
        }
        match (self.photons, self.photon_radius) {
            (Some(0), _) => return above_0("photons", &0),
            (_, Some(r)) if !is_length(r) => return above_0("photon-radius", &r),
            _ => {}
        }
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
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::IrradianceCache => self.strategy.samples_lights(),
            IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::VertexMerging
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

    /// Names of its strategies by vertices from the light and from the camera, in the order in which frames tell them apart.
    pub(crate) fn strategies(&self) -> Vec<String> {
        match (self.kind, self.max_depth()) {
            (IntegratorKind::Bidirectional, Some(depth)) => {
                strategies(depth).map(|(s, t)| format!("s{s}_t{t}")).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Whether strategies can be told apart.
    pub(crate) fn tells_strategies(&self) -> bool {
        self.check_strategies().is_ok()
    }

    /// Refuses to tell strategies apart where there are none, or too many.
    pub(super) fn check_strategies(&self) -> Result<(), InvalidSetting> {
        let wrong = |value: &str, help: &str| Err(InvalidSetting::new("aov", format!("strategies: {value}"), help));
        if self.kind != IntegratorKind::Bidirectional {
            let value = format!("--integrator {} has none", self.name());
            return wrong(&value, "use --integrator bdpt");
        }
        match self.max_depth() {
            Some(depth) if depth <= MOST_STRATEGIES_DEPTH => Ok(()),
            _ => wrong(
                "every length of paths has as many as vertices, and each takes 120 bytes a pixel",
                &format!("use a --max-depth of {MOST_STRATEGIES_DEPTH} at most"),
            ),
        }
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
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
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
            IntegratorKind::Bidirectional | IntegratorKind::PrimarySpace | IntegratorKind::VertexMerging => {
                text += &format!(" mis={}", name_of(HEURISTICS, strategy.heuristic));
            }
            IntegratorKind::Naive | IntegratorKind::Whitted | IntegratorKind::Light | IntegratorKind::PathSpace => {}
        }
        let samples_lights = match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::IrradianceCache => strategy.samples_lights(),
            IntegratorKind::Whitted
            | IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::VertexMerging
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
            IntegratorKind::ProgressivePhotons | IntegratorKind::VertexMerging => {
                text + &format!(
                    " max_depth={depth} roulette_depth={} photons={} photon_radius={} photon_alpha={}",
                    self.roulette.depth,
                    self.photons.map_or("pixels".into(), |n| n.to_string()),
                    self.photon_radius
                        .map_or(format!("{}px", self.radius_pixels()), |r| r.to_string()),
                    self.photon_alpha
                )
            }
            IntegratorKind::PhotonMap => {
                text + &format!(
                    " max_depth={depth} roulette_depth={} photons={} photon_count={} photon_radius={} gather_rays={}",
                    self.roulette.depth,
                    self.mapped_photons(),
                    self.photon_count,
                    self.photon_radius.map_or("scene".into(), |r| r.to_string()),
                    self.gather_rays
                )
            }
            IntegratorKind::IrradianceCache => {
                let (roulette, lights) = (self.roulette.depth, self.light_samples());
                let (error, rays) = (self.cache_error, self.cache_rays);
                text + &format!(
                    " max_depth={depth} roulette_depth={roulette} light_samples={lights} cache_error={error} cache_rays={rays}"
                )
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
}

impl Estimator {
    /// Paths of photons that are sent once.
    fn mapped_photons(&self) -> u32 {
        self.photons.unwrap_or(DEFAULT_PHOTONS)
    }
}
