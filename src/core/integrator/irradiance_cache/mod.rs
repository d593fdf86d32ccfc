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

use super::path::integrator::VertexNumbers;
use super::path::state::PathState;
use super::path::strategy::PrevVertex;
use super::path_record;
use super::vertex::Vertex;
use super::{DirectLight, Gathered, Integrator, PathIntegrator, RayKind, RaySink, Sink};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::film::Points;
use crate::geometry::Hit;
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
        let radiance = self.radiance(key, sampler, out);
        out.radiance(radiance);
    }
}

impl<A: Accel> IrradianceCacheIntegrator<'_, A> {
    fn radiance<S: Sampler, R: Gathered>(
        &self,
        key: SampleKey,
        sampler: &mut S,
        out: &mut impl Sink<Radiance = R>,
    ) -> R {
        let PathIntegrator { world, strategy, .. } = &self.path;
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        let mut radiance = R::default();
        let mut only_mirrors = true;
        for depth in 0.. {
            // Intersect, and add emitted light
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let (hit, transmittance) = world.intersect(&path.ray, kind, out);
            path.beta *= transmittance;
            if depth == 0 && hit.is_none() && world.see_background(&path.ray, path.beta, out) {
                break;
            }
            let slot = BsdfSlot::new();
            let vertex = hit.map(|hit| world.vertex(&hit, &path.ray, &slot));
            let met = hit.as_ref().zip(vertex.as_ref());
            radiance += self.emitted::<R>(&path, depth, met, out);
            let Some((hit, vertex)) = met else { break };
            if depth == 0 {
                let mut first = world.first_surface(hit, vertex);
                if let Some(features) = &mut first.features {
                    features.points = self.records_at(vertex);
                }
                out.first_surface(first);
            }
            if self.path.max_depth.is_some_and(|max| depth >= max) {
                break;
            }

            // Sample lights
            let u = VertexNumbers::draw(sampler, depth, self.path.roulette);
            let light_samples = if depth == 0 { self.path.light_samples } else { 1 };
            let (mut direct, shadow) = self.path.sample_lights(vertex, (key, sampler, u.light.as_ref()), out);
            direct += shadow.arrives(world, out);
            let direct = direct * path.beta;
            path_record::light(direct.sum(), out);
            radiance += direct;

            // Sample the BSDF, update the throughput and play Russian roulette
            let u_lobe = u.lobe(vertex.bsdf);
            let sample = strategy.directions.sample(vertex, u_lobe, u.direction);
            let next = sample.and_then(|sample| {
                let beta = path.beta * sample.weight;
                let roulette_scale = path.roulette_scale * sample.eta * sample.eta;
                let factor = self.path.roulette.play(depth, beta * roulette_scale, u.roulette)?;
                path_record::scatter(depth, vertex, &sample, factor, out);
                Some(PathState {
                    ray: world.ray_along(vertex, sample.wi),
                    beta: beta * factor,
                    roulette_scale,
                    is_dispersed: false,
                    prev: Some(PrevVertex::new(vertex, &sample, light_samples)),
                })
            });

            // End with the indirect light that the cache knows, and the other half of the estimate of direct light
            let indirect = only_mirrors.then(|| self.indirect(vertex, depth)).flatten();
            if let Some(indirect) = indirect {
                let indirect = R::from(indirect) * path.beta;
                path_record::cached(indirect.sum(), out);
                radiance += indirect;
                if let Some(mut next) = next.filter(|_| strategy.direct != DirectLight::Light) {
                    let (hit, transmittance) = world.intersect(&next.ray, RayKind::Bounce, out);
                    next.beta *= transmittance;
                    let slot = BsdfSlot::new();
                    let vertex = hit.map(|hit| world.vertex(&hit, &next.ray, &slot));
                    radiance += self.emitted::<R>(&next, depth + 1, hit.as_ref().zip(vertex.as_ref()), out);
                }
                break;
            }
            let Some(next) = next else { break };
            only_mirrors &= next.is_delta();
            path = next;
        }
        radiance
    }

    /// The emitted light that the ray of `path` finds.
    fn emitted<R: Gathered>(
        &self,
        path: &PathState,
        depth: u32,
        met: Option<(&Hit, &Vertex)>,
        out: &mut impl RaySink,
    ) -> R {
        let PathIntegrator { world, strategy, .. } = &self.path;
        let mut sum = R::default();
        strategy.found(world.scene, &path.ray, path.prev.as_ref(), path.beta, met, |light| {
            sum += light
        });
        if let Some(met) = met {
            path_record::vertex(depth, met, path.beta, out);
        }
        strategy.record_emitted(world.scene, &path.ray, path.prev.as_ref(), met, out);
        path_record::light(sum.sum(), out);
        sum
    }

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
