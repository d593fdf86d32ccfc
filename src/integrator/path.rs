use super::direct::{Direct, LightNumbers, Vertex};
use super::strategy::Scattered;
use super::{Integrator, RayKind, Roulette, SAMPLES_AT_ONCE, Sink, Strategy, World};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{Hit, ray_towards};
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use std::array::from_fn;

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

/// A path on its way from one vertex to the next.
struct Segment {
    ray: Ray,
    /// Throughput: what the light that is met along `ray` counts in the pixel.
    beta: Spectrum,
    /// Product of the squared indices of refraction that `beta` has been divided by.
    eta_squared: f32,
    /// The scattering that `ray` comes from; `None` at the camera.
    scattered: Option<Scattered>,
}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let ray = self.world.camera_ray(key, sampler);
        let hit = self.world.intersect(&ray, RayKind::Camera, out);
        self.follow(ray, hit, sampler, out);
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            let mut samplers: [S; SAMPLES_AT_ONCE] = from_fn(|_| sampler.clone());
            let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
            for ((ray, key), sampler) in rays.iter_mut().zip(keys).zip(&mut samplers) {
                *ray = self.world.camera_ray(*key, sampler);
            }
            let mut hits = [None; SAMPLES_AT_ONCE];
            let n = keys.len();
            self.world.accel.intersect_coherent(&rays[..n], &mut hits[..n]);
            for (((ray, hit), sampler), out) in rays.into_iter().zip(hits).zip(&samplers).zip(out) {
                out.ray(RayKind::Camera);
                self.follow(ray, hit, sampler, out);
            }
        }
    }
}

impl<A: Accel> PathIntegrator<'_, A> {
    /// Follows the path that begins with the camera's `ray`, whose closest hit is `hit`.
    #[inline(always)]
    fn follow<S: Sampler>(&self, ray: Ray, mut hit: Option<Hit>, sampler: &S, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let mut radiance = Spectrum::ZERO;
        let mut path = Segment {
            ray,
            beta: Spectrum::ONE,
            eta_squared: 1.0,
            scattered: None,
        };
        let mut u = VertexNumbers::draw(sampler, 0);
        for depth in 0.. {
            let Some(met) = hit else {
                // Escaped: infinitely distant lights
                for light in world.scene.escaped(path.ray.direction) {
                    radiance += path.beta * light.radiance * strategy.emission_weight(path.scattered.as_ref(), &light);
                }
                break;
            };

            // The surface, and the light it emits by itself
            let vertex = world.vertex(&met, &path.ray);
            let from = path.scattered.as_ref().map_or(path.ray.origin, |s| s.p);
            if let Some(light) = world.scene.emitted(&met, from, vertex.point.p, path.ray.direction) {
                radiance += path.beta * light.radiance * strategy.emission_weight(path.scattered.as_ref(), &light);
            }
            if depth == 0 {
                out.first_surface(world.first_surface(&vertex));
            }
            if self.max_depth.is_some_and(|max| depth >= max) {
                break;
            }

            // Next-event estimation finds the light that arrives straight from a light, a scattered ray all other light. The
            // shadow ray is traced last, so that the next one can follow it without delay.
            let direct = Direct::sample(world, &vertex, strategy, &u.light, out);
            let next = self.scatter(&vertex, &path, depth, &u);
            radiance += path.beta * direct.arrives(world, out);
            let Some(next) = next else { break };
            path = next;
            // The next vertex's numbers do not depend on what is hit: they are drawn before the ray, and so while it is traced.
            u = VertexNumbers::draw(sampler, depth + 1);
            hit = world.intersect(&path.ray, RayKind::Bounce, out);
        }
        out.radiance(radiance);
    }

    /// Goes on from `vertex` in a sampled direction, unless all is absorbed or Russian roulette ends the path.
    #[inline(always)]
    fn scatter<S>(&self, vertex: &Vertex, path: &Segment, depth: u32, u: &VertexNumbers<S>) -> Option<Segment> {
        let directions = self.strategy.directions;
        let sample = directions.sample(vertex.bsdf, vertex.wo, u.lobe, u.direction)?;
        let beta = path.beta * sample.weight;
        // That radiance shrinks on its way into glass, to grow again on its way out, is no reason to end.
        let eta_squared = path.eta_squared * sample.eta * sample.eta;
        let factor = self.roulette.play(depth, beta * eta_squared, u.roulette)?;
        Some(Segment {
            ray: ray_towards(&vertex.point, vertex.frame.to_world(sample.wi)),
            beta: beta * factor,
            eta_squared,
            scattered: Some(Scattered {
                p: vertex.point.p,
                pdf: sample.pdf,
                is_delta: sample.is_delta(),
            }),
        })
    }
}
