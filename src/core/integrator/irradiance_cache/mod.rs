//! Irradiance caching: indirect light of matte surfaces is computed at few points and interpolated between them (Ward, Rubinstein and Clear 1988, "A
//! Ray Tracing Solution for Diffuse Interreflection"), with the gradients of Ward and Heckbert (1992).
//!
//! `hemisphere` estimates irradiance and its gradients from rays, `record` holds one result, `cache` stores all records in an octree and
//! interpolates, and `maker` makes records. `render/irradiance.rs` decides where records are made, before the first sample; then the cache is frozen.
//!
//! The method is biased. Direct light is not: it is estimated by light sampling and by rays, as in `path`. Rays of a hemisphere therefore leave out
//! what the first surface emits, and carry all other light. Where the camera meets a point without a valid record, the path goes on as in `path`,
//! which is unbiased there. Records are made where all others are above 0.7 of the error at which they are no longer valid, so that such points are
//! few.
//!
//! Behind mirrors less of `max_depth` is left. Each number of scattering events before the surface therefore has records of its own, unless the depth
//! is unlimited.
//!
//! - A record's radius is the harmonic mean distance of its hemisphere, less where the gradient is steep, and between 20 and 200 pixels. It is at
//!   most the radius of a neighbour plus the distance to it (Křivánek et al. 2006). Without that rule cornell needs a third of the records and has
//!   nearly twice the error, because neighbours see what one record misses.
//! - Weights fall linearly to 0. Ward's weights, which are infinite at the record, show the noise of each record; they had a tenth more error.
//! - There is at most one record for 8 pixels: among leaves, paths are faster.
//!
//! docs/benchmarks.md, "Irradiance cache", compares it with `path`.

mod cache;
mod hemisphere;
mod maker;
mod record;

pub use cache::IrradianceCache;
pub use hemisphere::{GatheredHemisphere, Seen, Strata};
pub use maker::{RecordMaker, RecordSite};
pub use record::{Gradients, Record};

use super::path::direct::trace;
use super::path::integrator::PathNumbers;
use super::path::state::PathState;
use super::vertex::Vertex;
use super::{DirectLight, FoundLight, Integrator, PathEvent, PathIntegrator, Sink};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::film::Points;
use crate::material::BsdfSlot;
use crate::sampler::{SampleKey, Sampler};
use maker::is_cached;
use std::f32::consts::FRAC_1_PI;

/// Maximum number of mirrors and panes behind which surfaces have records.
const MAX_MIRRORS: u32 = 8;

/// Path tracing in which the indirect light of the first matte surface, behind mirrors and glass too, comes from a cache, if that knows it.
///
/// Biased: the cache is wrong by about as much as its error allows. Where it has no say paths go on as they would without it.
#[derive(Debug)]
pub struct IrradianceCacheIntegrator<'a, A> {
    /// Path tracing, for all light that the cache does not know.
    pub path: PathIntegrator<'a, A>,
    /// The records.
    pub cache: &'a IrradianceCache,
}

impl<A: Accel> Integrator for IrradianceCacheIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let PathIntegrator { world, strategy, .. } = &self.path;
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        let numbers = PathNumbers {
            key,
            sampler,
            wavelength: None,
        };
        let mut only_mirrors = true;
        loop {
            // Find the next surface, and add emitted light
            let depth = path.depth;
            let slot = BsdfSlot::new();
            let vertex = path.next_vertex(world, None, &slot, out);
            strategy.add_found(world, &path, vertex.as_ref(), out);
            let Some(vertex) = vertex else { return };
            if depth == 0 && world.features {
                let mut first = world.first_surface(&vertex);
                if let Some(features) = &mut first.features {
                    features.points = self.records_at(&vertex);
                }
                out.first_surface(first);
            }
            if self.path.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Sample lights
            let u = numbers.vertex(depth, self.path.roulette);
            let direct = self.path.sample_light(&path, &vertex, &u, out);
            trace(direct, world, (&path, &vertex), out);

            // Sample the BSDF and play Russian roulette
            let next = self.path.scatter(&path, &vertex, self.path.roulette, &u, out);

            // End with the indirect light that the cache knows, and the other half of the estimate of direct light
            if let Some(indirect) = only_mirrors.then(|| self.indirect(&vertex, depth)).flatten() {
                if out.records() {
                    out.record(PathEvent::Cached);
                }
                out.light(FoundLight::sum(indirect * path.beta, depth + 2));
                if let Some(next) = next.filter(|_| strategy.direct != DirectLight::Light) {
                    let mut next = path.after(next);
                    let slot = BsdfSlot::new();
                    let vertex = next.next_vertex(world, None, &slot, out);
                    strategy.add_found(world, &next, vertex.as_ref(), out);
                }
                return;
            }
            let Some(next) = next else { return };
            path.go_on(next);
            only_mirrors &= path.is_delta();
        }
    }
}

impl<A: Accel> IrradianceCacheIntegrator<'_, A> {
    /// Records about `vertex`, which the camera sees first.
    fn records_at(&self, vertex: &Vertex) -> Points {
        if !is_cached(vertex, 0, self.path.max_depth) {
            return Points::default();
        }
        let dot = 0.5 * self.path.world.camera.pixel_width(vertex.point.p, vertex.point.time);
        let n = vertex.point.ns * 1f32.copysign(vertex.wo.z);
        self.cache.points(vertex.point.p, n, layer(self.path.max_depth, 0), dot)
    }

    /// The indirect light that `vertex` scatters, as far as the cache knows it.
    fn indirect(&self, vertex: &Vertex, depth: u32) -> Option<Spectrum> {
        if !is_cached(vertex, depth, self.path.max_depth) {
            return None;
        }
        let n = vertex.point.ns * 1f32.copysign(vertex.wo.z);
        let layer = layer(self.path.max_depth, depth);
        let irradiance = self.cache.irradiance(vertex.point.p, n, layer)?;
        Some(vertex.bsdf.albedo() * irradiance * FRAC_1_PI)
    }
}

/// Which of the cache's records hold for a surface that is met after `depth` scatterings. Where their number is limited, there is the less left
/// for the light that comes to it.
fn layer(max_depth: Option<u32>, depth: u32) -> u32 {
    max_depth.map_or(0, |_| depth)
}
