use super::direct::{Direct, LightNumbers, Vertex};
use super::reuse::End;
use super::strategy::Scattered;
use super::{Gathered, Integrator, RayKind, Roulette, SAMPLES_AT_ONCE, Sink, Strategy, World};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::light::Receiver;
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::scene::Incident;
use std::array::from_fn;

/// Unidirectional path tracing with next-event estimation: by default lights and BSDF are sampled at every vertex and
/// combined by the power heuristic, and Russian roulette on the throughput ends paths (Kajiya 1986; Veach 1997, ch. 9–10).
/// Pixels of a tile may share what their paths have found (Bekaert, Sbert and Halton 2002).
#[derive(Debug)]
pub struct PathIntegrator<'a, A> {
    /// What light meets, and from where it is seen.
    pub world: World<'a, A>,
    /// How directions are drawn and direct light is found.
    pub strategy: Strategy,
    /// Scattering events at most: 0 shows emission alone, `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// When paths end at random; with `reuse` not before their second vertex.
    pub roulette: Roulette,
    /// Light samples at the first vertex, which all of a pixel's samples have; one at all others.
    pub light_samples: u32,
    /// Whether samples of different pixels share their paths: all of them look at all second vertices that are matte.
    pub reuse: bool,
}

/// What a shared path is taken to count, at least, in the pixel in which it counts most.
const LEAST_SHARE: f32 = 0.5;

/// The random numbers of one vertex.
pub(super) struct VertexNumbers<'a, S> {
    light: LightNumbers<'a, S>,
    scatter: ScatterNumbers<'a, S>,
}

impl<'a, S: Sampler> VertexNumbers<'a, S> {
    pub fn draw(sampler: &'a S, depth: u32) -> Self {
        let (scatter, choice) = ScatterNumbers::draw(sampler, depth);
        Self {
            light: LightNumbers::with_choice(sampler, depth, choice),
            scatter,
        }
    }
}

/// Those that say how a path goes on.
struct ScatterNumbers<'a, S> {
    sampler: &'a S,
    depth: u32,
    direction: Vec2,
    roulette: f32,
}

impl<'a, S: Sampler> ScatterNumbers<'a, S> {
    /// Also the number that chooses the light, which comes in a pair with that of roulette.
    fn draw(sampler: &'a S, depth: u32) -> (Self, f32) {
        let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
        let numbers = Self {
            sampler,
            depth,
            direction: sampler.get_2d(Dimension::bounce(depth, Bounce::Direction)),
            roulette: decisions.y,
        };
        (numbers, decisions.x)
    }

    /// Those of the first vertex, whose light samples have numbers of their own. Roulette that does not play needs none.
    fn of_first(sampler: &'a S, roulette: Roulette) -> Self {
        if roulette.depth == 0 {
            return Self::draw(sampler, 0).0;
        }
        Self {
            sampler,
            depth: 0,
            direction: sampler.get_2d(Dimension::bounce(0, Bounce::Direction)),
            roulette: 0.0,
        }
    }

    /// Chooses a lobe of `bsdf`, where there are several.
    fn lobe(&self, bsdf: &Bsdf) -> f32 {
        match bsdf {
            Bsdf::Single(_) => 0.0,
            Bsdf::Mix(_) | Bsdf::Layered(_) => self.sampler.get_1d(Dimension::bounce(self.depth, Bounce::Lobe)),
        }
    }
}

/// A path that has left the camera.
pub(super) struct Start<'a, S> {
    pub key: SampleKey,
    /// Turned to `key`.
    pub sampler: &'a S,
    pub path: Segment,
    /// What it meets.
    pub hit: Option<Hit>,
}

/// A path on its way from one vertex to the next.
pub(super) struct Segment {
    pub ray: Ray,
    /// Throughput: what the light that is met along `ray` counts in the pixel.
    pub beta: Spectrum,
    /// What roulette multiplies `beta` by before it judges: squared indices of refraction that `beta` has been divided by, and
    /// what a path that serves several pixels counts in them.
    roulette_scale: f32,
    /// The scattering that `ray` comes from; `None` at the camera.
    scattered: Option<Scattered>,
}

impl Segment {
    /// The first one.
    pub fn from_camera(ray: Ray) -> Self {
        Self {
            ray,
            beta: Spectrum::ONE,
            roulette_scale: 1.0,
            scattered: None,
        }
    }

    /// Whether it leaves a mirror, or the like.
    pub fn is_delta(&self) -> bool {
        self.scattered.is_some_and(|s| s.is_delta)
    }

    /// The same way, for the light that goes back along it and counts in several pixels, in each by a factor of its own. What
    /// that will be is not known yet; roulette goes by the pixel that followed the path, as long as that is not a dark one.
    fn shared(self) -> Self {
        Self {
            beta: Spectrum::ONE,
            roulette_scale: self.roulette_scale * self.beta.max_component().max(LEAST_SHARE),
            ..self
        }
    }
}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            // Camera rays, as one packet
            let mut samplers: [S; SAMPLES_AT_ONCE] = from_fn(|_| sampler.clone());
            let mut time = None;
            let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
            for (((ray, key), sampler), out) in rays.iter_mut().zip(keys).zip(&mut samplers).zip(&mut *out) {
                *ray = self.world.camera_ray(*key, time, sampler, out);
                // Paths that are shared must be of one time.
                time = time.or(self.reuse.then_some(ray.time));
            }
            let mut hits = [None; SAMPLES_AT_ONCE];
            let n = keys.len();
            self.world.accel.intersect_coherent(&rays[..n], &mut hits[..n]);
            out.iter_mut().for_each(|out| out.ray(RayKind::Camera));
            if self.world.scene.has_holes() {
                for ((hit, ray), out) in hits.iter_mut().zip(&rays).zip(&mut *out) {
                    *hit = self.world.past_holes(*ray, *hit, RayKind::Camera, out);
                }
            }

            // Each path by itself
            let slots: [BsdfSlot; SAMPLES_AT_ONCE] = from_fn(|_| BsdfSlot::new());
            let mut firsts = [const { None }; SAMPLES_AT_ONCE];
            let mut ends = [const { None }; SAMPLES_AT_ONCE];
            for i in 0..n {
                let start = Start {
                    key: keys[i],
                    sampler: &samplers[i],
                    path: Segment::from_camera(rays[i]),
                    hit: hits[i],
                };
                (firsts[i], ends[i]) = self.follow(start, &slots[i], &mut out[i]);
            }

            // All first vertices look at the ends, if there are any.
            for (owner, end) in ends.iter().enumerate() {
                if let Some(end) = end {
                    end.light_all(&self.world, self.strategy.directions, &firsts, owner, out);
                }
            }
        }
    }

    fn pixels_at_once(&self) -> usize {
        if self.reuse { SAMPLES_AT_ONCE } else { 1 }
    }
}

impl<A: Accel> PathIntegrator<'_, A> {
    /// No path that is to be shared ends before its second vertex: that a surface is dark says nothing of its neighbours.
    fn roulette(&self) -> Roulette {
        Roulette {
            depth: self.roulette.depth.max(u32::from(self.reuse)),
        }
    }

    /// Follows the path from the camera. Where paths are shared, what a matte second vertex scatters is not yet its own: that end is
    /// given back, and the first vertex.
    #[inline(always)]
    fn follow<'v, S: Sampler, R: Gathered>(
        &'v self,
        start: Start<S>,
        slot: &'v BsdfSlot,
        out: &mut impl Sink<Radiance = R>,
    ) -> (Option<Vertex<'v>>, Option<End<R>>) {
        let (mut radiance, first) = self.arrive::<R>(&start.path, start.hit, slot);
        let mut end = None;
        if let (Some(first), Some(hit)) = (&first, &start.hit) {
            out.first_surface(self.world.first_surface(hit, first));
            let (direct, next) = self.first_step(first, &start, out);
            radiance += direct;
            if let Some(next) = next {
                let hit = self.world.intersect(&next.ray, RayKind::Bounce, out);
                let slot = BsdfSlot::new();
                let (emitted, second) = self.arrive(&next, hit, &slot);
                radiance += emitted;
                match second {
                    Some(second) if self.reuse && !next.is_delta() && End::<R>::can_be(&second) => {
                        let light = self.scattered(&second, next.shared(), 1, start.sampler, out);
                        end = Some(End::new(&second, light));
                    }
                    Some(second) => radiance += self.scattered(&second, next, 1, start.sampler, out),
                    None => {}
                }
            }
        }
        out.radiance(radiance);
        (first, end)
    }

    /// The light that `path` meets: what is emitted where it arrives, and the vertex that is there, if any.
    #[inline(always)]
    pub(super) fn arrive<'v, R: Gathered>(
        &'v self,
        path: &Segment,
        hit: Option<Hit>,
        slot: &'v BsdfSlot,
    ) -> (R, Option<Vertex<'v>>) {
        let (scene, strategy) = (self.world.scene, &self.strategy);
        let from = path.scattered.map_or(Receiver::any_side(path.ray.origin), |s| s.from);
        let counted = |light: Incident| {
            let weight = strategy.emission_weight(path.scattered.as_ref(), &light);
            R::of_light(path.beta * light.radiance * weight, light.id, scene)
        };
        let mut radiance = R::default();
        let Some(met) = hit else {
            // Escaped: infinitely distant lights
            for light in scene.escaped(from, path.ray.direction) {
                radiance += counted(light);
            }
            return (radiance, None);
        };
        // The surface, and the light it emits by itself
        let vertex = self.world.vertex(&met, &path.ray, slot);
        if let Some(light) = scene.emitted(&met, &from, vertex.point.p, path.ray.direction, path.ray.time) {
            radiance = counted(light);
        }
        (radiance, Some(vertex))
    }

    /// The light that `vertex`, which `path` has come to after `depth` scatterings, scatters.
    #[inline(always)]
    pub(super) fn scattered<S: Sampler, R: Gathered>(
        &self,
        vertex: &Vertex,
        path: Segment,
        depth: u32,
        sampler: &S,
        out: &mut impl Sink<Radiance = R>,
    ) -> R {
        let u = VertexNumbers::draw(sampler, depth);
        let (mut radiance, mut next) = self.step(vertex, &path, depth, &u, out);
        for depth in depth + 1.. {
            let Some(path) = next else { break };
            // A vertex's numbers do not depend on what is hit: they are drawn before the ray, and so while it is traced.
            let u = VertexNumbers::draw(sampler, depth);
            let hit = self.world.intersect(&path.ray, RayKind::Bounce, out);
            let slot = BsdfSlot::new();
            let (emitted, vertex) = self.arrive::<R>(&path, hit, &slot);
            radiance += emitted;
            let Some(vertex) = vertex else { break };
            let (direct, onwards) = self.step(&vertex, &path, depth, &u, out);
            radiance += direct;
            next = onwards;
        }
        radiance
    }

    /// The step from the first vertex, where several light samples may be taken: of a pixel's `n` paths, `n` times as many.
    #[inline(always)]
    pub(super) fn first_step<S: Sampler, R: Gathered>(
        &self,
        vertex: &Vertex,
        start: &Start<S>,
        out: &mut impl Sink<Radiance = R>,
    ) -> (R, Option<Segment>) {
        if self.max_depth == Some(0) {
            return (R::default(), None);
        }
        // Light samples count on through the pixel's samples, so that all of them are stratified together. Each shadow ray is traced when
        // the next sample is ready.
        let mut radiance = R::default();
        let mut direct = Direct::none();
        let mut sampler = start.sampler.clone();
        for i in 0..self.light_samples {
            // A single one is the path's own.
            if self.light_samples > 1 {
                sampler.start(SampleKey {
                    sample: start.key.sample.wrapping_mul(self.light_samples).wrapping_add(i),
                    ..start.key
                });
            }
            let u = LightNumbers::draw(&sampler, 0);
            let next = Direct::sample(&self.world, vertex, &self.strategy, self.light_samples, &u, out);
            radiance += std::mem::replace(&mut direct, next).arrives(&self.world, out);
        }
        let u = ScatterNumbers::of_first(start.sampler, self.roulette());
        let next = self.scatter(vertex, &start.path, 0, self.light_samples, &u);
        radiance += direct.arrives(&self.world, out);
        (radiance, next)
    }

    /// Next-event estimation finds the light that arrives straight from a light, a scattered ray all other light. The
    /// shadow ray is traced last, so that the next one can follow it without delay.
    #[inline(always)]
    pub(super) fn step<S: Sampler, R: Gathered>(
        &self,
        vertex: &Vertex,
        path: &Segment,
        depth: u32,
        u: &VertexNumbers<S>,
        out: &mut impl Sink<Radiance = R>,
    ) -> (R, Option<Segment>) {
        if self.max_depth.is_some_and(|max| depth >= max) {
            return (R::default(), None);
        }
        let direct = Direct::sample(&self.world, vertex, &self.strategy, 1, &u.light, out);
        let next = self.scatter(vertex, path, depth, 1, &u.scatter);
        (direct.arrives(&self.world, out) * path.beta, next)
    }

    /// Goes on from `vertex` in a sampled direction, unless all is absorbed or Russian roulette ends the path.
    #[inline(always)]
    fn scatter<S: Sampler>(
        &self,
        vertex: &Vertex,
        path: &Segment,
        depth: u32,
        light_samples: u32,
        u: &ScatterNumbers<S>,
    ) -> Option<Segment> {
        let directions = self.strategy.directions;
        let sample = directions.sample(vertex.bsdf, vertex.wo, u.lobe(vertex.bsdf), u.direction)?;
        let beta = path.beta * sample.weight;
        // That radiance shrinks on its way into glass, to grow again on its way out, is no reason to end.
        let roulette_scale = path.roulette_scale * sample.eta * sample.eta;
        let factor = self.roulette().play(depth, beta * roulette_scale, u.roulette)?;
        Some(Segment {
            ray: vertex.ray_along(sample.wi),
            beta: beta * factor,
            roulette_scale,
            scattered: Some(Scattered {
                from: vertex.receiver(),
                pdf: sample.pdf,
                is_delta: sample.is_delta(),
                light_samples,
            }),
        })
    }
}
