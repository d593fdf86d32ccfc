//! Values that users choose by name.

use crate::color::tone::Curve;
use crate::compare::CommonErrors;
use crate::film::FilterKind;
use crate::guess::View;
use crate::integrator::{
    Absorption, DebugView, DirectLight, Directions, EmissionCoin, Heuristic, MetropolisDirect, MetropolisTarget,
};
use crate::light::{SelectionMode, TriangleSampling};
use crate::sampler::{CubePoints, SamplerKind};
use crate::texture::TextureFilter;

/// Values each of which has a name, as users type it.
pub trait Named: Copy + PartialEq + 'static {
    /// All of them; the first is the default.
    const NAMES: &'static [(&'static str, Self)];
}

/// Names the values of a type.
#[macro_export]
macro_rules! named {
    ($($ty:ty: $($name:literal => $value:expr),+;)*) => {
        $(impl $crate::options::Named for $ty {
            const NAMES: &'static [(&'static str, Self)] = &[$(($name, $value)),+];
        })*
    };
}
pub use named;

named! {
    Directions: "bsdf" => Self::Bsdf, "cosine" => Self::Cosine, "uniform" => Self::Uniform, "perturbed-qmc" => Self::PerturbedQmc,
        "perturbed-qmc-uniform" => Self::PerturbedQmcUniform, "fibonacci" => Self::Fibonacci;
    CubePoints: "halton" => Self::Halton, "hammersley" => Self::Hammersley, "sobol" => Self::Sobol;
    DirectLight: "mis" => Self::Mis, "light" => Self::Light, "none" => Self::None;
    EmissionCoin: "emitters" => Self::Emitters, "every-hit" => Self::EveryHit;
    Absorption: "weight" => Self::Weight, "chance" => Self::Chance;
    Heuristic: "power" => Self::Power, "balance" => Self::Balance;
    SelectionMode: "auto" => Self::Auto, "power" => Self::Power, "place" => Self::Place, "visibility" => Self::Visibility, "uniform" => Self::Uniform, "all" => Self::All;
    TriangleSampling: "area" => Self::Area, "solid-angle" => Self::SolidAngle;
    DebugView: "normals" => Self::Normals, "uv" => Self::Uv, "barycentrics" => Self::Barycentrics, "ids" => Self::Ids, "material" => Self::Material,
        "albedo" => Self::Albedo, "depth" => Self::Depth, "wireframe" => Self::Wireframe, "facing" => Self::Facing, "light-count" => Self::LightCount,
        "ray-cost" => Self::RayCost;
    MetropolisDirect: "ordinary" => Self::Ordinary, "metropolis" => Self::Metropolis;
    MetropolisTarget: "relative" => Self::Relative, "luminance" => Self::Luminance;
}

macro_rules! named_elsewhere {
    ($($ty:ty),*) => {
        $(impl Named for $ty {
            const NAMES: &'static [(&'static str, Self)] = <$ty>::NAMES;
        })*
    };
}
named_elsewhere!(CommonErrors, FilterKind, SamplerKind, Curve, TextureFilter, View);

/// The name of `value` among those `known`.
pub fn name_of<T: PartialEq>(known: &[(&'static str, T)], value: T) -> &'static str {
    known.iter().find(|(_, v)| *v == value).map_or("", |(name, _)| name)
}

/// All names, with commas between them.
pub fn join_names<T>(known: &[(&str, T)]) -> String {
    let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// Minimum similarity of two names of which one may be meant by the other (Jaro and Winkler, 0 to 1).
const SIMILAR: f64 = 0.8;

/// The name among `known` that is most like `name`, if one may be meant.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let scored = known.into_iter().map(|k| (strsim::jaro_winkler(name, k), k));
    let best = scored.max_by(|(a, _), (b, _)| a.total_cmp(b));
    best.filter(|(score, _)| *score >= SIMILAR).map(|(_, k)| k)
}
