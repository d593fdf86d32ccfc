//! Renders with an integrator over a backend. `backend` chooses the backend, `run` chooses the
//! integrator, `checks` rejects settings and scenes that the integrator does not support, and
//! `common_errors` describes how the errors of pixels are correlated. Sessions use this module.
//! `compiled` is for programs that construct their own integrators.
//!
//! Functions take [`AnyAccel`] and [`RenderSampler`] and are not generic, so they are compiled
//! here, with full optimisation, and not again in the calling program.
//!
//! For the samples of the image, `path` and `direct` are monomorphised per backend, because a call
//! that the compiler cannot inline costs some percent of the time of a ray. All other integrators,
//! and samples with separate light groups, call `&dyn Accel`. Compiling each of them for every
//! backend, observer and kind of light would take minutes, and rays are a smaller part of the work
//! of these integrators. `render/dispatch.rs` has the calls.
//!
//! `options/integrators.rs` lists the parameters of each integrator. The metadata of files, and the
//! warnings about unused flags, come from that list.

mod backend;
mod checks;
mod common_errors;
mod compiled;
mod error;
mod run;

pub use backend::AnyAccel;
pub use compiled::CompiledIntegrator;
pub use error::{Error, InvalidSetting};
pub use run::{Preparation, RenderContext};

use crate::integrator::{DirectLight, Directions, strategies};
use crate::light::TriangleSampling;
use crate::light_sampling::{LightChoice, SelectionMode};
use crate::options::{ChosenIntegrator, IntegratorKind, MaxDepth};
use crate::sampler::{Fibonacci, Perturbation, PerturbedQmc, RenderSampler, SamplerKind};
use crate::scene::SceneBuilder;

impl ChosenIntegrator {
    /// Maximum number of scattering events, if the integrator has one.
    fn max_depth(&self) -> Option<MaxDepth> {
        self.value("max_depth")
    }

    /// Sampling of directions, if the integrator has this option.
    fn directions(&self) -> Option<Directions> {
        self.value("directions")
    }

    /// Strategies for direct light, if the integrator has this option.
    fn direct(&self) -> Option<DirectLight> {
        self.value("direct")
    }

    /// Returns true if the integrator samples lights at surface points and weights them by MIS
    /// against other strategies. Without MIS, light selection by learned visibility would seldom
    /// sample light that no learning ray has reached, and would then give the sample a large
    /// weight.
    fn weighs_lights(&self) -> bool {
        let has_choice = self.value::<SelectionMode>("light_selection").is_some();
        use IntegratorKind::{Area, Light, OneSample, Whitted};
        let samples_alone = matches!(self.kind(), Light | Whitted | OneSample | Area);
        has_choice && !samples_alone && self.direct().is_none_or(|direct| direct == DirectLight::Mis)
    }

    /// Light selection of the integrator.
    pub fn light_choice(&self) -> LightChoice {
        LightChoice {
            mode: self.value("light_selection").unwrap_or_default(),
            lamp_samples: self.value("lamp_samples").unwrap_or(1),
        }
    }

    /// Sampling of emitting triangles. The scene builder needs this option, because the option
    /// decides which triangles are joined to rectangles.
    pub fn triangle_sampling(&self) -> TriangleSampling {
        self.value("triangle_sampling").unwrap_or_default()
    }

    /// Builder for scenes with the triangle sampling of the integrator.
    pub fn scene_builder(&self) -> SceneBuilder {
        let mut builder = SceneBuilder::new();
        builder.triangle_sampling(self.triangle_sampling());
        builder
    }

    /// Returns true if the integrator estimates the light of each source separately, as light
    /// groups need. Records of irradiance contain the light of all sources together.
    pub fn gathers_light(&self) -> bool {
        use IntegratorKind::{AmbientOcclusion, Debug, IrradianceCache};
        !matches!(self.kind(), AmbientOcclusion | Debug | IrradianceCache)
    }

    /// Returns true if the integrator interpolates between precomputed points: photons, or records
    /// of irradiance.
    pub fn has_points(&self) -> bool {
        matches!(self.kind(), IntegratorKind::PhotonMap | IntegratorKind::IrradianceCache)
    }

    /// Names of the integrator's strategies, in the order of their channels. `s1_t2` is the
    /// strategy with 1 light vertex and 2 camera vertices.
    pub fn strategies(&self) -> Vec<String> {
        match self {
            Self::Bidirectional(settings) => match settings.max_depth {
                MaxDepth(Some(depth)) => strategies(depth).map(|(s, t)| format!("s{s}_t{t}")).collect(),
                MaxDepth(None) => Vec::new(),
            },
            _ => Vec::new(),
        }
    }

    /// A sampler of `kind` for `count` samples per pixel, with the direction sampling of the
    /// integrator.
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

    /// Returns true if the random numbers of the integrator depend on the total number of samples
    /// per pixel.
    pub fn needs_count(&self) -> bool {
        use Directions::{Fibonacci, PerturbedQmc, PerturbedQmcUniform};
        matches!(self.directions(), Some(Fibonacci | PerturbedQmc | PerturbedQmcUniform))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{IntegratorOptions, Named};

    fn integrator(kind: IntegratorKind) -> ChosenIntegrator {
        ChosenIntegrator::new(&IntegratorOptions {
            integrator: Some(kind),
            ..IntegratorOptions::default()
        })
    }

    /// Parameters that several integrators share are found by their names.
    #[test]
    fn shared_parameters_have_their_types() {
        for (_, kind) in IntegratorKind::NAMES {
            let integrator = integrator(*kind);
            let reads = |key: &str| kind.parameters().contains(&key);
            assert_eq!(integrator.max_depth().is_some(), reads("max_depth"));
            assert_eq!(integrator.directions().is_some(), reads("directions"));
            assert_eq!(integrator.direct().is_some(), reads("direct"));
            assert_eq!(
                integrator.value::<SelectionMode>("light_selection").is_some(),
                reads("light_selection")
            );
            assert_eq!(
                integrator.value::<TriangleSampling>("triangle_sampling").is_some(),
                reads("triangle_sampling")
            );
        }
    }
}
