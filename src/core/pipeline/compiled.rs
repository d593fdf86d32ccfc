//! Renders with integrators that the calling program constructs. The render loop is compiled in
//! this crate.

use crate::accel::Accel;
use crate::film::Film;
use crate::integrator::{
    AmbientOcclusion, AreaIntegrator, BidirectionalIntegrator, DebugIntegrator, DistributedIntegrator,
    IrradianceCacheIntegrator, LightIntegrator, NaiveIntegrator, OneSampleIntegrator, PathIntegrator,
    PathSpaceIntegrator, PhotonMapIntegrator, PrimarySpaceIntegrator, ProgressivePhotonIntegrator,
    ReusingPathIntegrator, SimpleIntegrator, VertexMergingIntegrator, WhittedIntegrator,
};
use crate::render::{self, Observer, Outcome, Statistics, StopCondition};
use crate::sampler::RenderSampler;

/// An integrator over a backend behind dynamic dispatch.
///
/// [`Integrator`](crate::integrator::Integrator) and
/// [`IterationIntegrator`](crate::integrator::IterationIntegrator) are generic: a program that
/// calls them compiles the integrator again, with the optimisation level of the program.
/// [`CompiledIntegrator::render`] is compiled in this crate.
/// [`ChosenIntegrator`](crate::options::ChosenIntegrator) makes integrators, and the data that they
/// need, from settings.
pub trait CompiledIntegrator: Sync {
    /// Adds samples to every pixel of `film` until the condition `stop` holds.
    fn render(
        &self,
        sampler: &RenderSampler,
        film: &mut Film,
        stop: StopCondition,
        observer: &dyn Observer,
    ) -> (Outcome, Statistics);
}

/// Implements [`CompiledIntegrator`] for integrators that take samples of pixels.
macro_rules! of_samples {
    ($($integrator:ident),+ $(,)?) => {$(
        impl CompiledIntegrator for $integrator<'_, &dyn Accel> {
            fn render(
                &self,
                sampler: &RenderSampler,
                film: &mut Film,
                stop: StopCondition,
                observer: &dyn Observer,
            ) -> (Outcome, Statistics) {
                render::render_samples(self, sampler, film, stop, &observer)
            }
        }
    )+};
}

/// Implements [`CompiledIntegrator`] for integrators that run iterations.
macro_rules! of_iterations {
    ($($integrator:ident),+ $(,)?) => {$(
        impl CompiledIntegrator for $integrator<'_, &dyn Accel> {
            fn render(
                &self,
                sampler: &RenderSampler,
                film: &mut Film,
                stop: StopCondition,
                observer: &dyn Observer,
            ) -> (Outcome, Statistics) {
                render::render_iterations(self, (sampler, self.world.filter), film, stop, &observer)
            }
        }
    )+};
}

of_samples! {
    AmbientOcclusion, AreaIntegrator, DebugIntegrator, DistributedIntegrator, IrradianceCacheIntegrator,
    NaiveIntegrator, OneSampleIntegrator, PathIntegrator, PhotonMapIntegrator, ReusingPathIntegrator,
    SimpleIntegrator, WhittedIntegrator,
}

of_iterations! {
    BidirectionalIntegrator, LightIntegrator, PathSpaceIntegrator, PrimarySpaceIntegrator,
    ProgressivePhotonIntegrator, VertexMergingIntegrator,
}
