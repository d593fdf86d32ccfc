//! A method over a backend: the choice of the backend (`backend`) and of the integrator (`run`), which settings and scenes a method refuses (`checks`),
//! and how its errors are correlated (`common_errors`). Sessions stand on it. Programs that make integrators
//! themselves render by `compiled`.
//!
//! Functions take [`AnyAccel`] and [`RenderSampler`], and nothing generic: what a program calls is compiled here, with full optimisation, and not in the program.
//!
//! `path` and `direct` are monomorphised per backend for the picture's own samples, because a call that the compiler cannot inline costs some percent
//! of a ray. All other integrators, and samples whose light groups are distinguished, ask for rays by `&dyn Accel`. They are many: compiling each for
//! every backend, observer and kind of light would take minutes, and a ray is a smaller part of their work. `render/dispatch.rs` has the calls.
//!
//! `options/method.rs` lists which integrator reads which parameter. The metadata of files, and the warnings of flags that are not read, come from
//! that list.

mod backend;
mod checks;
mod common_errors;
mod compiled;
mod error;
mod run;

pub use backend::AnyAccel;
pub use compiled::CompiledIntegrator;
pub use error::{Error, InvalidSetting};
pub use run::{Prepared, RenderContext};

use crate::integrator::{DirectLight, Directions, strategies};
use crate::light::{LightChoice, SelectionMode, TriangleSampling};
use crate::options::{IntegratorKind, MaxDepth, Method};
use crate::sampler::{Fibonacci, Perturbation, PerturbedQmc, RenderSampler, SamplerKind};
use crate::scene::SceneBuilder;

impl Method {
    /// Maximum number of scattering events, if the method has one.
    fn max_depth(&self) -> Option<MaxDepth> {
        self.value("max_depth")
    }

    /// How directions are sampled, if the method can do it in several ways.
    fn directions(&self) -> Option<Directions> {
        self.value("directions")
    }

    /// How direct light is found, if the method can do it in several ways.
    fn direct(&self) -> Option<DirectLight> {
        self.value("direct")
    }

    /// Whether the method samples lights towards surfaces and weighs them by MIS against other ways to find them. By itself, the sampling of lights by a
    /// learned visibility would seldom find light that no ray has seen, and find it bright.
    fn weighs_lights(&self) -> bool {
        let has_choice = self.value::<SelectionMode>("light_selection").is_some();
        use IntegratorKind::{Area, Light, OneSample, Whitted};
        let samples_alone = matches!(self.kind(), Light | Whitted | OneSample | Area);
        has_choice && !samples_alone && self.direct().is_none_or(|direct| direct == DirectLight::Mis)
    }

    /// How the method chooses lights.
    pub fn light_choice(&self) -> LightChoice {
        LightChoice {
            mode: self.value("light_selection").unwrap_or_default(),
            lamp_samples: self.value("lamp_samples").unwrap_or(1),
        }
    }

    /// How emitting triangles are sampled. It decides which triangles are joined to rectangles, and so
    /// it belongs to the scene.
    pub fn triangle_sampling(&self) -> TriangleSampling {
        self.value("triangle_sampling").unwrap_or_default()
    }

    /// A builder for scenes whose triangles are sampled as the method needs it.
    pub fn scene_builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        builder.triangle_sampling(self.triangle_sampling());
        builder
    }

    /// Whether the method gathers the light of lights, which can then be distinguished. Records of irradiance are of all lights together.
    pub fn gathers_light(&self) -> bool {
        use IntegratorKind::{AmbientOcclusion, Debug, IrradianceCache};
        !matches!(self.kind(), AmbientOcclusion | Debug | IrradianceCache)
    }

    /// Whether the method interpolates between points that were made before: photons, or records of irradiance.
    pub fn has_points(&self) -> bool {
        matches!(self.kind(), IntegratorKind::PhotonMap | IntegratorKind::IrradianceCache)
    }

    /// Names of the method's strategies by vertices from the light and from the camera, in its own order.
    pub fn strategies(&self) -> Vec<String> {
        match self {
            Self::Bidirectional(settings) => match settings.max_depth {
                MaxDepth(Some(depth)) => strategies(depth).map(|(s, t)| format!("s{s}_t{t}")).collect(),
                MaxDepth(None) => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    /// A sampler of `kind`, for `count` samples of a pixel, as the method's directions want it.
    pub fn sampler(&self, kind: SamplerKind, seed: u64, count: u32) -> RenderSampler {
        let sampler = kind.with_seed(seed, count);
        match self.directions() {
            Some(Directions::Fibonacci) => RenderSampler::Fibonacci(Fibonacci::new(seed, count, sampler)),
            Some(Directions::PerturbedQmc | Directions::PerturbedQmcUniform) => {
                let options = Perturbation {
                    points: self.value("direction_points").unwrap_or_default(),
                    size: self.value("direction_perturbation").unwrap_or_default(),
                    is_scrambled: !self.repeats_directions(),
                };
                RenderSampler::PerturbedQmc(PerturbedQmc::new(seed, count, options, sampler))
            }
            _ => RenderSampler::Plain(sampler),
        }
    }

    /// Whether the method's random numbers depend on how many samples a pixel gets in all.
    pub fn knows_count(&self) -> bool {
        use Directions::{Fibonacci, PerturbedQmc, PerturbedQmcUniform};
        matches!(self.directions(), Some(Fibonacci | PerturbedQmc | PerturbedQmcUniform))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{IntegratorOptions, Named};

    fn method(kind: IntegratorKind) -> Method {
        Method::new(&IntegratorOptions {
            integrator: Some(kind),
            ..IntegratorOptions::default()
        })
    }

    /// Parameters that several methods share are found by their names.
    #[test]
    fn shared_parameters_have_their_types() {
        for (_, kind) in IntegratorKind::NAMES {
            let method = method(*kind);
            let reads = |key: &str| kind.parameters().contains(&key);
            assert_eq!(method.max_depth().is_some(), reads("max_depth"));
            assert_eq!(method.directions().is_some(), reads("directions"));
            assert_eq!(method.direct().is_some(), reads("direct"));
            assert_eq!(
                method.value::<SelectionMode>("light_selection").is_some(),
                reads("light_selection")
            );
            assert_eq!(
                method.value::<TriangleSampling>("triangle_sampling").is_some(),
                reads("triangle_sampling")
            );
        }
    }
}
