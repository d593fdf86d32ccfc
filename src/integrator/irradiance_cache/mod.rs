//! Irradiance caching: the indirect light of matte surfaces from few places, and interpolated between them (Ward, Rubinstein and Clear 1988, "A
//! Ray Tracing Solution for Diffuse Interreflection").
//!
//! What the cache says is biased. `hemisphere` finds irradiance and gradients of what rays see, `record` is what is kept of that, `cache` has all
//! records and interpolates, `maker` makes them; which are made, and when, is decided elsewhere.

mod cache;
mod hemisphere;
mod maker;
mod record;

pub use cache::IrradianceCache;
pub use hemisphere::{GatheredHemisphere, Seen, Strata};
pub use maker::{Place, RecordMaker};
pub use record::{Gradients, Record};

use super::direct::Vertex;
use super::path::{Segment, Start, VertexNumbers};
use super::{DirectLight, Gathered, Integrator, PathIntegrator, RayKind, Sink};
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
        let mut start = Start {
            path: Segment::from_camera(world.camera_ray(key, None, sampler, out)),
            hit: None,
            sampler: &*sampler,
            key,
        };
        let mut radiance = R::default();
        let mut only_mirrors = true;
        for depth in 0.. {
            // The next vertex, and what it emits
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            start.hit = world.intersect(&start.path.ray, kind, out);
            let slot = BsdfSlot::new();
            let (emitted, vertex) = self.path.arrive::<R>(&start.path, start.hit, &slot);
            radiance += emitted;
            let (Some(hit), Some(vertex)) = (start.hit, vertex) else {
                break;
            };
            if depth == 0 {
                out.first_surface(world.first_surface(&hit, &vertex));
            }

            // A step of the path; its light sample and what its ray meets are direct light.
            let (direct, next) = match depth {
                0 => self.path.first_step(&vertex, &start, out),
                _ => {
                    let u = VertexNumbers::draw(sampler, depth);
                    self.path.step(&vertex, &start.path, depth, &u, out)
                }
            };
            radiance += direct;
            let indirect = only_mirrors.then(|| self.indirect(&vertex, depth)).flatten();
            if let Some(indirect) = indirect {
                // The cache has all else.
                radiance += R::from(indirect) * start.path.beta;
                if let Some(next) = next.filter(|_| self.path.strategy.direct != DirectLight::Light) {
                    let hit = world.intersect(&next.ray, RayKind::Bounce, out);
                    let slot = BsdfSlot::new();
                    radiance += self.path.arrive::<R>(&next, hit, &slot).0;
                }
                break;
            }
            let Some(next) = next else { break };
            only_mirrors &= next.is_delta();
            start.path = next;
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
}

/// Which of the cache's records hold for a surface that is met after `depth` scatterings. Where their number is limited, there is the less left
/// for the light that comes to it.
fn layer(max_depth: Option<u32>, depth: u32) -> u32 {
    max_depth.map_or(0, |_| depth)
}
