//! Parameters of integrators: keys, ranges, help and defaults.
//!
//! A default that depends on the scene or the integrator is described in words (`default "…"`). Its
//! value is computed in `pipeline/run.rs`, and the default of a search radius in
//! `integrator/search_radius.rs`. Defaults that differ between integrators are in `integrators.rs`.

use super::IntegratorKind;
use crate::integrator::{
    Absorption, DebugView, DirectLight, Directions, EmissionCoin, Heuristic, MetropolisDirect, MetropolisTarget,
    Survival,
};
use crate::light::TriangleSampling;
use crate::light_sampling::SelectionMode;
use crate::parameter::{Range, Value, named, parameters};
use crate::sampler::CubePoints;
use serde_json::json;
use std::fmt;

parameters! {
    /// The integrator and its parameters. Each integrator reads only its own
    /// ([`IntegratorKind::parameters`]).
    pub struct IntegratorOptions, heading "Integrator", values values {
        /// Integrator: the method that finds light
        integrator: IntegratorKind = IntegratorKind::Path;
        /// Maximum number of scattering events; 0 shows emission only, none means 1024
        max_depth: MaxDepth = MaxDepth(Some(16));
        /// Scattering events before Russian roulette may end a path; at least 1 with reuse
        roulette_depth: u32 = 1;
        /// Survival in Russian roulette: throughput, luminance, constant:P or threshold:T
        ///
        /// `throughput` is the largest channel of the throughput, `luminance` its luminance, and
        /// `threshold:T` the ratio of the largest channel to T; the maximum is 0.95. With
        /// `constant:P` all paths survive with the probability P, from above 0 to 1; at 1
        /// `max_depth` alone ends paths.
        roulette: Survival = Survival::LargestChannel;
        /// Distribution of the directions sampled at surfaces
        ///
        /// `perturbed-qmc` (by the cosine) and `perturbed-qmc-uniform` take low-discrepancy points
        /// of the cube, keep the points inside the unit ball, project them to the sphere, and move
        /// each on a disk. `fibonacci` takes spherical Fibonacci points, by the cosine.
        directions: Directions = Directions::Bsdf;
        /// Points in the cube from which perturbed-qmc makes directions
        direction_points: CubePoints = CubePoints::Halton;
        /// Radius of the disks on which perturbed-qmc moves points; 0 moves none
        ///
        /// A disk of radius 1 is as large as the area of the sphere divided by the number of
        /// points.
        direction_perturbation: f32 = 1.0, in Range::FromTo(0.0, 16.0);
        /// Random rotation of the points of perturbed-qmc in each pixel; off is biased
        ///
        /// With `off` all pixels use the same points, and `direction_perturbation` moves them. If
        /// `direction_perturbation` is 0, the error shows as a regular pattern.
        direction_scrambling: Scrambling = Scrambling::On;
        /// Direct light: light sampling (light), rays that hit lights (none), or both (mis)
        direct: DirectLight = DirectLight::Mis;
        /// Heuristic of multiple importance sampling
        mis: Heuristic = Heuristic::Power;
        /// Light selection: by visibility, place or power, uniform, all, or auto
        ///
        /// `place` weighs each light by its unoccluded contribution. `visibility` learns, before
        /// the first sample, which parts of the sky and which other lights each part of the scene
        /// sees. `auto` is `visibility` in rooms that see a sky, if `direct` is `mis`; else `place`
        /// with more than two lights and `power` with fewer. `all` samples every lamp at every
        /// vertex: connected emitting triangles are one lamp.
        light_selection: SelectionMode = SelectionMode::Auto;
        /// Light samples of the largest lamp at each vertex, with light selection all
        ///
        /// Other lamps take at least one sample, in proportion to the square root of their area.
        /// Skies take as many as the largest lamp.
        lamp_samples: u32 = 1, in Range::FromTo(1, 64);
        /// Sampling of emitting triangles: by area or by solid angle
        triangle_sampling: TriangleSampling = TriangleSampling::Area;
        /// Path reuse between pixels of a tile
        reuse: PathReuse = PathReuse::Pixels;
        /// Maximum luminance of a sample's light after the first bounce; biased
        ///
        /// Indirect light above this luminance is scaled down, sample by sample. This removes
        /// fireflies and some light.
        clamp_indirect: Clamp = Clamp(None);
        /// Light samples at the first vertex of a path; default 1 without reuse
        light_samples: u32 = 1, in Range::FromTo(1, 1024);
        /// Surfaces at which naive flips a coin between emission and reflection
        emission_coin: EmissionCoin = EmissionCoin::Emitters;
        /// Probability that the coin of naive chooses emission
        emission_probability: f32 = 0.5, in Range::FromTo(0.01, 0.99);
        /// Absorption in naive: a factor of the throughput (weight), or by chance
        ///
        /// With `chance` a lobe is chosen by its albedo, and the path ends with the probability
        /// that remains.
        absorption: Absorption = Absorption::Weight;
        /// Probability that a vertex of one-sample takes direct light, not indirect light
        direct_probability: f32 = 0.5, in Range::FromTo(0.01, 0.99);
        /// Rays that leave each vertex of distributed
        branching: u32 = 4, in Range::AtLeast(1);
        /// Maximum number of scattering events of distributed; max_depth applies too
        tree_depth: u32 = 4, in Range::FromTo(1, 1024);
        /// Distance in scene units within which surfaces occlude, in ao
        ao_distance: f32, default "from the size of the room; outdoors the diameter of the scene", in Range::Above(0.0);
        /// Photon paths per iteration of sppm and vcm; total of photon-map
        photons: u32, default "number of pixels; vcm: 65536 at most", in Range::FromTo(1, 1 << 26);
        /// Search radius of photons in scene units; initial radius of sppm and vcm
        photon_radius: f32, default "sppm: three pixels; vcm: one; photon-map: from the scene", in Range::Above(0.0);
        /// Radius reduction factor of sppm and vcm; 1 keeps the radius
        ///
        /// After iteration i, counted from 1, r² shrinks by (i + α) / (i + 1). Smaller values give
        /// less blur and more noise.
        photon_alpha: f32 = 2.0 / 3.0, in Range::AboveTo(0.0, 1.0);
        /// Number of nearest photons in a density estimate of photon-map
        photon_count: u32 = 64, in Range::FromTo(2, 1 << 16);
        /// Final gather rays of photon-map
        gather_rays: u32 = 4, in Range::FromTo(1, 100);
        /// Error bound of irradiance-cache (a of Ward); smaller is more accurate
        cache_error: f32 = 0.3, in Range::AboveTo(0.0, 1.0);
        /// Approximate number of rays of a record of irradiance-cache
        cache_rays: u32 = 1024, in Range::FromTo(16, 1 << 20);
        /// Property of the first surface that debug shows
        ///
        /// `uv` shows fractional parts of texture coordinates as red and green; blue means none.
        /// `depth` goes from white to black through the scene's bounding box. `light-count` counts
        /// the visible lights, `ray-cost` the rays of a sample of `path`.
        debug_view: DebugView = DebugView::Normals;
        /// Direct light of Metropolis methods: by ordinary path tracing or by the chains
        ///
        /// This choice also applies to lamps seen in mirrors and through glass.
        metropolis_direct: MetropolisDirect = MetropolisDirect::Ordinary;
        /// Target of Markov chains: luminance, or luminance relative to the surroundings
        ///
        /// `relative` divides the light of a path by a rough picture at its pixel, so dark regions
        /// get as many paths as bright ones.
        metropolis_target: MetropolisTarget = MetropolisTarget::Relative;
        /// Markov chains per iteration; together they make one mutation per pixel
        chains: u32, default "one per 256 mutations, at least 16", in Range::AtLeast(1);
        /// Samples of bdpt per iteration, from which chains start
        bootstrap: u32, default "one per 8 mutations, at least 512", in Range::AtLeast(1);
        /// Fraction of large steps among the mutations of pssmlt
        large_step_probability: f32 = 0.3, in Range::FromTo(0.0, 1.0);
        /// Maximum small step of pssmlt, as a fraction of the range of a random number
        mutation_size: f32 = 1.0 / 64.0, in Range::AboveTo(0.0, 0.5);
    }
}

/// Random rotation of the point set of directions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scrambling {
    /// The point set is rotated at random for each pixel and vertex.
    On,
    /// The point set is not rotated.
    Off,
}

named! {
    Scrambling: "on" => Self::On, "off" => Self::Off;
}

/// Path reuse between pixels, or separate paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PathReuse {
    /// Samples of different pixels share their paths.
    Pixels,
    /// Each sample has a separate path.
    None,
}

named! {
    PathReuse: "pixels" => Self::Pixels, "none" => Self::None;
}

/// Maximum luminance of the indirect light of a sample, W·sr⁻¹·m⁻²; `None` for no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp(pub Option<f32>);

impl Value for Clamp {
    const PLACEHOLDER: &'static str = "RADIANCE";
    const KIND: &'static str = "a number above 0, or off";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        match text {
            "off" => Some(Self(None)),
            _ => text.parse().ok().map(|limit| Self(Some(limit))),
        }
    }

    fn text(&self) -> String {
        self.0.map_or("off".into(), |limit| limit.to_string())
    }

    fn schema() -> serde_json::Value {
        json!({ "anyOf": [{ "type": "number", "exclusiveMinimum": 0 }, { "enum": ["off"] }] })
    }

    /// Returns true if the limit is valid: positive and finite. Programs that use the library can
    /// set invalid limits.
    fn is_finite(&self) -> bool {
        self.0.is_none_or(|limit| limit > 0.0 && limit.is_finite())
    }
}

impl Value for Survival {
    const PLACEHOLDER: &'static str = "RULE";
    const KIND: &'static str =
        "throughput, luminance, constant:P with P above 0, at most 1, or threshold:T with T above 0";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        let number = |text: &str| text.parse().ok();
        let rule = match text.split_once(':') {
            None if text == "throughput" => Self::LargestChannel,
            None if text == "luminance" => Self::Luminance,
            Some(("constant", probability)) => Self::Constant(number(probability)?),
            Some(("threshold", threshold)) => Self::Threshold(number(threshold)?),
            _ => return None,
        };
        rule.is_finite().then_some(rule)
    }

    fn text(&self) -> String {
        match self {
            Self::LargestChannel => "throughput".into(),
            Self::Luminance => "luminance".into(),
            Self::Constant(probability) => format!("constant:{probability}"),
            Self::Threshold(threshold) => format!("threshold:{threshold}"),
        }
    }

    fn schema() -> serde_json::Value {
        let number = r"[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?";
        json!({ "type": "string", "pattern": format!("^(throughput|luminance|(constant|threshold):{number})$") })
    }

    /// Returns true if the numbers are in their ranges. Programs that use the library can set other
    /// numbers.
    fn is_finite(&self) -> bool {
        match *self {
            Self::LargestChannel | Self::Luminance => true,
            Self::Constant(probability) => probability > 0.0 && probability <= 1.0,
            Self::Threshold(threshold) => threshold > 0.0 && threshold.is_finite(),
        }
    }
}

/// Maximum number of scattering events of a path, if no other limit is set. A single path then
/// takes milliseconds. If roulette begins at the first vertices, a fraction of 10⁻²³ of the paths
/// reaches this maximum.
const MAX_SCATTERINGS: u32 = 1024;

/// Maximum number of scattering events of a path. If it is `None`, only Russian roulette terminates
/// paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxDepth(pub Option<u32>);

impl MaxDepth {
    /// The limit that integrators use. It is always `Some`.
    pub fn limit(self) -> Option<u32> {
        Some(self.0.unwrap_or(MAX_SCATTERINGS))
    }
}

impl fmt::Display for MaxDepth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(depth) => write!(f, "{depth}"),
            None => write!(f, "none"),
        }
    }
}

impl Value for MaxDepth {
    const PLACEHOLDER: &'static str = "N";
    const KIND: &'static str = "a whole number up to 1024, or none";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        match text {
            "none" => Some(Self(None)),
            _ => text
                .parse()
                .ok()
                .filter(|&n| n <= MAX_SCATTERINGS)
                .map(|n| Self(Some(n))),
        }
    }

    fn text(&self) -> String {
        self.to_string()
    }

    fn schema() -> serde_json::Value {
        json!({ "anyOf": [{ "type": "integer", "minimum": 0, "maximum": MAX_SCATTERINGS }, { "enum": ["none"] }] })
    }

    /// Returns true if the depth is in its range. Programs that use the library can set other
    /// depths.
    fn is_finite(&self) -> bool {
        self.0.is_none_or(|n| n <= MAX_SCATTERINGS)
    }
}
