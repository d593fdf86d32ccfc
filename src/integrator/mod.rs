//! Light transport: the mathematics of one pixel sample. No threads, no tiles, no files.

mod ambient_occlusion;
mod debug;
mod direct;
mod distributed;
mod gathered;
mod irradiance_cache;
mod naive;
mod path;
mod reuse;
mod roulette;
mod strategy;
mod whitted;
mod world;

pub use ambient_occlusion::AmbientOcclusion;
pub use debug::{DebugIntegrator, DebugView};
pub use distributed::DistributedIntegrator;
pub use gathered::{ByGroup, Gathered};
pub use irradiance_cache::{
    GatheredHemisphere, Gradients, IrradianceCache, IrradianceCacheIntegrator, Place, Record, RecordMaker, Seen, Strata,
};
pub use naive::NaiveIntegrator;
pub use path::PathIntegrator;
pub use roulette::Roulette;
pub use strategy::{DirectLight, Directions, Heuristic, Strategy};
pub use whitted::WhittedIntegrator;
pub use world::World;

use crate::film::FirstSurface;
use crate::sampler::{SampleKey, Sampler};

/// Computes one sample of one pixel: a key in, contributions out.
pub trait Integrator: Sync {
    /// Traces the sample `key` with numbers from `sampler` and gives what it finds to `out`.
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink);

    /// The same for several samples, each into an `out` of its own: what they have in common may be done once.
    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (key, out) in keys.iter().zip(out) {
            self.sample(*key, sampler, out);
        }
    }

    /// Pixels, of a tile, whose samples are worth tracing together: 1, or up to [`SAMPLES_AT_ONCE`].
    fn pixels_at_once(&self) -> usize {
        1
    }
}

/// Samples that are worth tracing together.
pub const SAMPLES_AT_ONCE: usize = 16;

/// Why a ray is traced; statistics count by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayKind {
    /// From the camera.
    Camera,
    /// Onwards from a surface.
    Bounce,
    /// Towards a light.
    Shadow,
}

/// Takes what an integrator finds in one sample.
pub trait Sink {
    /// Whether groups of lights are told apart.
    type Radiance: Gathered;

    /// What all that is found counts in the pixel of the sample: 1 but for filters with negative lobes and the like. Comes first.
    fn weight(&mut self, weight: f32);

    /// Adds radiance to the pixel of the sample.
    fn radiance(&mut self, radiance: Self::Radiance);

    /// Notes what the camera sees first.
    fn first_surface(&mut self, surface: FirstSurface);

    /// Counts a traced ray.
    fn ray(&mut self, kind: RayKind);
}
