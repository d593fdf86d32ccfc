//! Irradiance caching (Ward, Rubinstein and Clear 1988, "A Ray Tracing Solution for Diffuse
//! Interreflection"). Indirect light of matte surfaces is computed at few points, and interpolated
//! between these points. The interpolation uses the gradients of Ward and Heckbert (1992).
//!
//! `hemisphere` estimates irradiance and its gradients from rays, `record` defines an irradiance
//! record, `cache` stores all records in an octree and interpolates between them, and `maker` makes
//! records. `render/irradiance.rs` chooses the positions of records and fills the cache before the
//! first sample. Samples do not change the cache.
//!
//! Only indirect light is biased. Direct light is estimated by light sampling and by scattered
//! rays, as in `path`. So the rays of a hemisphere ignore the emission of the first surface, and
//! find all other light. If there is no valid record at a point, the path continues as in `path`,
//! so the estimate at this point is unbiased. Such points are few, because a new record is made if
//! the errors of all existing records are above 0.7 of the maximum error.
//!
//! Behind mirrors, fewer scattering events are left until `max_depth`. So records are separated by
//! the number of scattering events before the surface, unless the depth is unlimited.
//!
//! - The radius of a record is the harmonic mean distance of its hemisphere rays. It is smaller if
//!   the gradient is steep, and between 20 and 200 pixels. It is at most the radius of a neighbour
//!   plus the distance to this neighbour (Křivánek et al. 2006). Without this limit, the scene
//!   cornell needs only a third as many records, but has nearly twice the error. The reason is that
//!   neighbours find surfaces that one record misses.
//! - The weight of a record falls linearly to 0. Ward's weights are infinite at the position of the
//!   record, so the noise of each record is visible. With Ward's weights, the error was a tenth
//!   larger.
//! - There is at most one record per 8 pixels. If a scene needs more records, such as one with many
//!   leaves, path tracing is faster.
//!
//! docs/notebook/2026-11.md, "Irradiance cache", compares irradiance caching with `path`.

mod cache;
mod hemisphere;
mod maker;
mod record;

pub use cache::IrradianceCache;
pub use hemisphere::{GatheredHemisphere, HemisphereHit, Strata};
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

/// Maximum number of mirrors and panes on a camera path in front of a surface with records.
const MAX_MIRRORS: u32 = 8;

/// Path tracing with an irradiance cache for the indirect light of the first matte surface, also
/// behind mirrors and glass.
///
/// The method is biased: the relative error of light from the cache is about the error limit. At
/// points without valid records, paths continue as without a cache.
#[derive(Debug)]
pub struct IrradianceCacheIntegrator<'a, A> {
    /// Path tracer for all light that is not in the cache.
    pub path: PathIntegrator<'a, A>,
    /// Irradiance records, complete before the first sample.
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
            // Find the next surface, and add its emission
            let depth = path.depth;
            let slot = BsdfSlot::new();
            let Some(vertex) = strategy.next_vertex(world, &mut path, None, &slot, out) else {
                return;
            };
            if depth == 0 && world.features {
                let mut first = world.first_surface(&vertex, out);
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
            trace(direct, world, &path, &vertex, out);

            // Sample the BSDF and play Russian roulette
            let next = self.path.scatter(&path, &vertex, self.path.roulette, &u, out);

            // If the cache has the indirect light, add this light. Then trace the scattered ray for
            // direct light only, and end the path
            if let Some(indirect) = only_mirrors.then(|| self.indirect(&vertex, depth)).flatten() {
                if out.records() {
                    out.record(PathEvent::Cached);
                }
                out.light(FoundLight::sum(indirect * path.beta, depth + 2));
                if let Some(next) = next.filter(|_| strategy.direct != DirectLight::Light) {
                    let mut next = path.after(next);
                    strategy.next_vertex(world, &mut next, None, &BsdfSlot::new(), out);
                }
                return;
            }
            let Some(next) = next else { return };
            path.advance(next);
            only_mirrors &= path.is_delta();
        }
    }
}

impl<A: Accel> IrradianceCacheIntegrator<'_, A> {
    /// Statistics of the records that are valid at `vertex`, the first vertex of a camera path.
    fn records_at(&self, vertex: &Vertex) -> Points {
        if !is_cached(vertex, 0, self.path.max_depth) {
            return Points::default();
        }
        let dot = 0.5 * self.path.world.camera.pixel_width(vertex.point.p, vertex.point.time);
        let n = vertex.point.ns * 1f32.copysign(vertex.wo.z);
        self.cache.points(vertex.point.p, n, layer(self.path.max_depth, 0), dot)
    }

    /// Indirect light that `vertex` scatters to the camera. `None` if the cache has no valid record
    /// there.
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

/// Layer of the cache for surfaces after `depth` scattering events. With a maximum depth, each
/// `depth` has a separate layer, because fewer events are left for the light that arrives there.
fn layer(max_depth: Option<u32>, depth: u32) -> u32 {
    max_depth.map_or(0, |_| depth)
}
