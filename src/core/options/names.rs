//! Types whose values users choose by name.

use crate::camera::{FisheyeMapping, ProjectionKind, StereoLayout};
use crate::color::tone::Curve;
use crate::compare::CommonErrors;
use crate::film::FilterKind;
use crate::guess::{Elevation, NamedView};
use crate::integrator::{
    Absorption, DebugView, DirectLight, Directions, EmissionCoin, Heuristic, MetropolisDirect, MetropolisTarget,
};
use crate::light::TriangleSampling;
use crate::light_sampling::SelectionMode;
use crate::parameter::{Named, named};
use crate::sampler::{CubePoints, SamplerKind};
use crate::texture::TextureFilter;

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
named_elsewhere!(
    CommonErrors,
    Elevation,
    FilterKind,
    FisheyeMapping,
    ProjectionKind,
    SamplerKind,
    StereoLayout,
    Curve,
    TextureFilter,
    NamedView
);
