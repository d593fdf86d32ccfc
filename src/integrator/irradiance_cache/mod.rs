//! Irradiance caching: the indirect light of matte surfaces from few places, and interpolated between them (Ward, Rubinstein and Clear 1988, "A Ray
//! Tracing Solution for Diffuse Interreflection").
//!
//! What the cache says is biased. `hemisphere` finds irradiance and gradients of what rays see, `record` is what is kept of that, `cache` has all records
//! and interpolates, `maker` makes them; which are made, and when, is decided elsewhere.

mod cache;
mod hemisphere;
mod maker;
mod record;

pub use cache::IrradianceCache;
pub use hemisphere::{Gathered as GatheredHemisphere, Seen, Strata};
pub use maker::{Place, RecordMaker};
pub use record::{Gradients, Record};

use super::direct::{Direct, LightNumbers, Vertex};
use super::path::{Segment, VertexNumbers};
use super::{DirectLight, Gathered, Integrator, PathIntegrator, RayKind, Sink, Strategy};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::material::BsdfSlot;
use crate::sampler::{SampleKey, Sampler};
use maker::is_cached;
use std::f32::consts::FRAC_1_PI;

/// Mirrors and panes behind which surfaces have records at most.
const MOST_MIRRORS: u32 = 8;

/// Path tracing in which the indirect light of the first matte surface, behind mirrors and glass too, comes from a cache, if that knows it.
///
/// Biased: the cache is wrong by about as much as its error allows. Where it has no say paths go on as they would without it.
#[derive(Debug)]
pub struct IrradianceCacheIntegrator<'a, A> {
    /// What light meets, and how paths go on without the cache; shares no paths.
    pub path: PathIntegrator<'a, A>,
    /// The records.
    pub cache: &'a IrradianceCache,
}

/// How direct light is found where the cache knows all other light: no scattered ray looks for it as well.
const BESIDE_THE_CACHE: Strategy = Strategy {
    direct: DirectLight::Light,
    directions: super::Directions::Bsdf,
    heuristic: super::Heuristic::Power,
};

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
        let world = &self.path.world;
        let mut path = Segment::from_camera(world.camera_ray(key, None, sampler, out));
        let mut radiance = R::default();
        let mut only_mirrors = true;
        for depth in 0.. {
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let hit = world.intersect(&path.ray, kind, out);
            let slot = BsdfSlot::new();
            let (emitted, vertex) = self.path.arrive::<R>(&path, hit, &slot);
            radiance += emitted;
            let (Some(hit), Some(vertex)) = (hit, vertex) else {
                break;
            };
            if depth == 0 {
                out.first_surface(world.first_surface(&hit, &vertex));
            }

            // Direct and indirect light, if the cache knows that, and then nothing is left
            if only_mirrors {
                if let Some(indirect) = self.indirect(&vertex, depth) {
                    radiance += self.direct(&vertex, depth, key, sampler, out) * path.beta;
                    radiance += R::from(indirect) * path.beta;
                    break;
                }
            }

            // One more step of the path
            let u = VertexNumbers::draw(sampler, depth);
            let (direct, next) = self.path.step(&vertex, &path, depth, &u, out);
            radiance += direct;
            let Some(next) = next else { break };
            only_mirrors &= next.is_delta();
            path = next;
        }
        radiance
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

    /// The direct light that `vertex` scatters, by sampling lights. Of a pixel's samples, light samples count on.
    fn direct<S: Sampler, R: Gathered>(
        &self,
        vertex: &Vertex,
        depth: u32,
        key: SampleKey,
        sampler: &S,
        out: &mut impl Sink<Radiance = R>,
    ) -> R {
        let world = &self.path.world;
        let count = self.path.light_samples;
        let mut sum = R::default();
        let mut sampler = sampler.clone();
        for i in 0..count {
            sampler.start(SampleKey {
                sample: key.sample.wrapping_mul(count).wrapping_add(i),
                ..key
            });
            let u = LightNumbers::draw(&sampler, depth);
            sum += Direct::sample(world, vertex, &BESIDE_THE_CACHE, count, &u, out).arrives(world, out);
        }
        sum
    }
}

/// Which of the cache's records hold for a surface that is met after `depth` scatterings. Where their number is limited, there is the less left for the light that
/// comes to it.
fn layer(max_depth: Option<u32>, depth: u32) -> u32 {
    max_depth.map_or(0, |_| depth)
}
