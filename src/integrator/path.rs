use super::direct::{LightNumbers, estimate_direct};
use super::strategy::Scattered;
use super::{Integrator, RayKind, Roulette, Sink, Strategy, World};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::ray_towards;
use crate::math::Vec2;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Unidirectional path tracing with next-event estimation: by default lights and BSDF are sampled at every vertex and
/// combined by the power heuristic, and Russian roulette on the throughput ends paths (Kajiya 1986; Veach 1997, ch. 9–10).
#[derive(Debug)]
pub struct PathIntegrator<'a, A> {
    /// What light meets, and from where it is seen.
    pub world: World<'a, A>,
    /// How directions are drawn and direct light is found.
    pub strategy: Strategy,
    /// Scattering events at most: 0 shows emission alone, `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// When paths end at random.
    pub roulette: Roulette,
}

/// The random numbers of one vertex.
struct VertexNumbers<'a, S> {
    light: LightNumbers<'a, S>,
    lobe: f32,
    direction: Vec2,
    roulette: f32,
}

impl<'a, S: Sampler> VertexNumbers<'a, S> {
    fn draw(sampler: &'a S, depth: u32) -> Self {
        let dimension = |what| Dimension::bounce(depth, what);
        Self {
            light: LightNumbers::draw(sampler, depth),
            lobe: sampler.get_1d(dimension(Bounce::Lobe)),
            direction: sampler.get_2d(dimension(Bounce::Direction)),
            roulette: sampler.get_1d(dimension(Bounce::Roulette)),
        }
    }
}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let mut ray = world.camera_ray(key, sampler);
        let sampler = &*sampler;

        let mut radiance = Spectrum::ZERO;
        let mut beta = Spectrum::ONE;
        let mut eta_squared = 1.0;
        let mut scattered: Option<Scattered> = None;

        for depth in 0.. {
            // All draws of a vertex stand in one place, before its ray: none of them depends on what is hit.
            let u = VertexNumbers::draw(sampler, depth);
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let Some(hit) = world.intersect(&ray, kind, out) else {
                // Escaped: infinitely distant lights
                for light in world.scene.escaped(ray.direction) {
                    radiance += beta * light.radiance * strategy.emission_weight(scattered.as_ref(), &light);
                }
                break;
            };

            // The surface, and the light it emits by itself
            let vertex = world.vertex(&hit, &ray);
            let from = scattered.as_ref().map_or(ray.origin, |s| s.p);
            if let Some(light) = world.scene.emitted(&hit, from, vertex.point.p, ray.direction) {
                radiance += beta * light.radiance * strategy.emission_weight(scattered.as_ref(), &light);
            }
            if depth == 0 {
                out.first_surface(world.first_surface(&vertex));
            }
            if self.max_depth.is_some_and(|max| depth >= max) {
                break;
            }

            // Next-event estimation: light that arrives straight from a light
            radiance += beta * estimate_direct(world, &vertex, strategy, &u.light, out);

            // All other light: go on in a sampled direction
            let Some(sample) = strategy.directions.sample(vertex.bsdf, vertex.wo, u.lobe, u.direction) else {
                break;
            };
            beta *= sample.weight();
            eta_squared *= sample.eta * sample.eta;

            // Russian roulette; that radiance shrinks on its way into glass, to grow again on its way out, is no reason to end.
            let Some(factor) = self.roulette.play(depth, beta * eta_squared, u.roulette) else {
                break;
            };
            beta *= factor;

            ray = ray_towards(&vertex.point, vertex.frame.to_world(sample.wi));
            scattered = Some(Scattered {
                p: vertex.point.p,
                pdf: sample.pdf,
                is_delta: sample.is_delta(),
            });
        }
        out.radiance(radiance);
    }
}
