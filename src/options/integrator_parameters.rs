//! Parameters of integrators: keys, ranges, help and defaults.
//!
//! A default that depends on scene or method is given in words (`default "…"`). Its value is computed in `session/method/run.rs`, and that of a
//! search radius in `integrator/search_radius.rs`. Defaults that differ between methods are in `method.rs`.

use super::{IntegratorKind, Range, Value, names::named, parameters};
use crate::integrator::{DebugView, DirectLight, Directions, Heuristic, MetropolisDirect, MetropolisTarget};
use crate::light::{SelectionMode, TriangleSampling};
use serde_json::json;
use std::fmt;

parameters! {
    /// How light transport is estimated: the integrator and its parameters. Each integrator reads its own ([`IntegratorKind::parameters`]).
    pub struct IntegratorOptions, heading "Integrator", values values {
        /// Integrator: the method that finds light
        integrator: IntegratorKind = IntegratorKind::Path;
        /// Maximum number of scattering events; 0 shows emission alone, none is 1024
        max_depth: MaxDepth = MaxDepth(Some(16));
        /// Scattering events before Russian roulette may end a path; 1 at least with reuse
        roulette_depth: u32 = 1;
        /// Distribution from which directions are sampled at surfaces
        ///
        /// `perturbed-qmc` is the cosine by low-discrepancy points on the sphere, each jittered.
        directions: Directions = Directions::Bsdf;
        /// Direct light: sampling lights, following rays (none), or both (mis)
        direct: DirectLight = DirectLight::Mis;
        /// Heuristic of multiple importance sampling
        mis: Heuristic = Heuristic::Power;
        /// Choice of lights: by visibility, place or power, uniform, all, or auto
        ///
        /// `place` weighs each light by what it would send there if nothing were between. `visibility` learns, before the first sample, what of the sky
        /// and of other lights is seen from each part of the scene. `auto` is `visibility` in rooms that see a sky, if lights are weighed by MIS; else
        /// `place` among more than two lights and `power` among fewer. `all` samples every light at every vertex.
        light_selection: SelectionMode = SelectionMode::Auto;
        /// Sampling of emitting triangles: by area or by solid angle
        triangle_sampling: TriangleSampling = TriangleSampling::Area;
        /// Path reuse between pixels of a tile
        reuse: PathReuse = PathReuse::Pixels;
        /// Maximum luminance of a sample's light after the first bounce; makes it biased
        ///
        /// Light of more than one scattering is scaled down to this luminance, sample by sample, which takes out fireflies and some light with them.
        clamp_indirect: Clamp = Clamp(None);
        /// Light samples at the first vertex of a path; 1 without reuse
        light_samples: u32 = 1, in Range::FromTo(1, 1024);
        /// Rays that leave each vertex of distributed
        branching: u32 = 4, in Range::AtLeast(1);
        /// Distance in scene units within which surfaces occlude, for ao
        ao_distance: f32, default "diameter of the scene", in Range::Above(0.0);
        /// Photon paths per iteration of sppm and vcm; of photon-map in all
        photons: u32, default "number of pixels; vcm: 65536 at most", in Range::FromTo(1, 1 << 26);
        /// Search radius of photons in scene units; of sppm and vcm the first one
        photon_radius: f32, default "sppm: three pixels; vcm: one; photon-map: by the scene", in Range::Above(0.0);
        /// Radius reduction factor of sppm and vcm; 1 keeps the radius
        ///
        /// After iteration i, counted from 1, r² shrinks by (i + α) / (i + 1): smaller values trade blur for noise.
        photon_alpha: f32 = 2.0 / 3.0, in Range::AboveTo(0.0, 1.0);
        /// Photons of one density estimate of photon-map, the nearest ones
        photon_count: u32 = 64, in Range::FromTo(2, 1 << 16);
        /// Final gather rays of photon-map
        gather_rays: u32 = 4, in Range::FromTo(1, 100);
        /// Error bound of a record of irradiance-cache: Ward's a
        cache_error: f32 = 0.3, in Range::AboveTo(0.0, 1.0);
        /// Rays from which a record of irradiance-cache is made, about
        cache_rays: u32 = 1024, in Range::FromTo(16, 1 << 20);
        /// What debug shows
        debug_view: DebugView = DebugView::Normals;
        /// Direct light of Metropolis methods: by ordinary path tracing or by the chains
        ///
        /// So are lamps that are seen in mirrors and through glass.
        metropolis_direct: MetropolisDirect = MetropolisDirect::Ordinary;
        /// Target of Markov chains: light relative to the place's, or its luminance
        ///
        /// `relative` divides the light of a path by that of a rough picture at its place, so that dark places get as many paths as bright ones.
        metropolis_target: MetropolisTarget = MetropolisTarget::Relative;
        /// Markov chains per iteration, which share a mutation per pixel
        chains: u32, default "a chain per 256 mutations, 16 or more", in Range::AtLeast(1);
        /// Bootstrap paths per iteration, at which chains start
        bootstrap: u32, default "a path per 4 mutations, 1024 or more; mlt: 8, 512", in Range::AtLeast(1);
        /// Share of large steps among the mutations of pssmlt
        large_step_probability: f32 = 0.3, in Range::FromTo(0.0, 1.0);
        /// Largest small step of pssmlt, as a share of the range of a random number
        mutation_size: f32 = 1.0 / 64.0, in Range::AboveTo(0.0, 0.5);
    }
}

/// Which paths are shared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathReuse {
    /// Samples of different pixels share their paths.
    Pixels,
    /// Each sample has its path alone.
    None,
}

named! {
    PathReuse: "pixels" => Self::Pixels, "none" => Self::None;
}

/// Maximum luminance of a sample's indirect light, W·sr⁻¹·m⁻²; `None` leaves light as it is.
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

    /// Whether the limit leaves light: it may have been set by code.
    fn is_finite(&self) -> bool {
        self.0.is_none_or(|limit| limit > 0.0 && limit.is_finite())
    }
}

/// Scattering events of a path at most, also where nothing else bounds them: milliseconds for a single path. Roulette from the first
/// vertices on lets 10⁻²³ of the paths come so far.
const MAX_SCATTERINGS: u32 = 1024;

/// Maximum number of scattering events; `None` leaves the end to roulette.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaxDepth(pub Option<u32>);

impl MaxDepth {
    /// The bound for integrators: there is always one.
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

    /// Whether the depth is in bounds: it may have been set by code.
    fn is_finite(&self) -> bool {
        self.0.is_none_or(|n| n <= MAX_SCATTERINGS)
    }
}
