//! The path tracer: `PathIntegrator::li` follows one path, and is the whole algorithm in one function.
//!
//! At each vertex a path adds the light that the surface emits, samples one light through a shadow ray, and goes on in a direction drawn from the
//! BSDF. Light that both strategies can find is weighted by the power heuristic (Veach 1997, §9.2).
//!
//! The order of the steps follows from measurements (docs/benchmarks.md, "Single steps"). The random numbers of a vertex are drawn before its ray is
//! traced. The next ray is ready before the shadow ray is traced, so that the processor need not wait between the two. The camera rays of sixteen
//! samples are traced as one packet; after the first hit rays diverge, and packets gain nothing. Shadow rays of sixteen first vertices as one packet
//! were tried, and lost to what must be stored between the stages.
//!
//! `method/run.rs` monomorphises the path tracer per backend, because a call that the compiler cannot inline costs some percent of a ray.

use super::direct::{Direct, LightNumbers};
use super::hooks::{NoReuse, Reuse};
use super::state::PathState;
use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::bsdf::{Bsdf, BsdfSample};
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::path_record;
use crate::integrator::trail::Trail;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, Integrator, RayKind, RaySink, Roulette, SAMPLES_AT_ONCE, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use std::array::from_fn;

/// Unidirectional path tracing with next-event estimation: by default lights and BSDF are sampled at every vertex and
/// combined by the power heuristic, and Russian roulette on the throughput ends paths (Kajiya 1986; Veach 1997, ch. 9–10).
#[derive(Debug)]
pub struct PathIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How directions are drawn and direct light is found.
    pub strategy: Strategy,
    /// Maximum number of scattering events: 0 shows emission alone, `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Number of light samples at the first vertex; 1 at all others.
    pub light_samples: u32,
    /// Maximum luminance of a sample's light after the first bounce, which makes the estimate biased; `None` leaves light as it is.
    pub clamp_indirect: Option<f32>,
}

// Derived impls would require `A: Clone`, though `A` is only behind a reference.
impl<A> Clone for PathIntegrator<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A> Copy for PathIntegrator<'_, A> {}

/// Start of a path: a ray, and its closest hit.
pub(crate) struct PathStart<'s, S> {
    pub key: SampleKey,
    /// Started with `key`.
    pub sampler: &'s S,
    pub ray: Ray,
    /// First hit of `ray`, behind glass that it passes.
    pub hit: Option<Hit>,
    /// Tint of that glass.
    pub tint: Spectrum,
    /// Scattering events before `ray`: 0 at the camera.
    pub depth: u32,
    /// Depth of the vertex from which on scattered light is summed apart, as [`PathRadiance::tail`].
    pub tail_depth: u32,
    /// Throughput before `ray`, as far as Russian roulette takes it into account; the estimate does not contain it.
    pub roulette_scale: Spectrum,
}

/// Estimate of the radiance that arrives along a path's first ray, in two parts.
pub(crate) struct PathRadiance<R> {
    /// Light emitted at vertices up to the one at [`PathStart::tail_depth`], and scattered before it.
    pub head: R,
    /// Light scattered at that vertex, and emitted or scattered behind it.
    pub tail: R,
    /// Whether the path came to that vertex: `tail` is all of its light where it did not.
    pub has_tail: bool,
}

impl<R: Gathered> PathRadiance<R> {
    pub fn sum(mut self) -> R {
        self.head += self.tail;
        self.head
    }

    /// The sum, with light from beyond the tail's vertex limited.
    pub fn clamped(mut self, limit: Option<f32>) -> R {
        if self.has_tail {
            self.tail = clamped(self.tail, limit);
        }
        self.sum()
    }
}

/// `light`, scaled down to the luminance `limit` where it has more.
#[inline(always)]
pub(crate) fn clamped<R: Gathered>(light: R, limit: Option<f32>) -> R {
    let Some(limit) = limit else {
        return light;
    };
    match light.sum().luminance() {
        luminance if luminance > limit => light * (limit / luminance),
        _ => light,
    }
}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            let packet = CameraPacket::trace(&self.world, keys, sampler, false, out);
            for (i, out) in out.iter_mut().enumerate() {
                let start = packet.start(i, keys);
                let radiance = self.radiance(&start, out);
                out.radiance(radiance.clamped(self.clamp_indirect));
                self.catch_shadow(&start, out);
            }
        }
    }
}

impl<A: Accel> PathIntegrator<'_, A> {
    /// The radiance that arrives along the ray of `start`, by following one path that serves its own pixel alone.
    #[inline(never)]
    pub(crate) fn radiance<S: Sampler, R: Gathered>(
        &self,
        start: &PathStart<S>,
        out: &mut impl Sink<Radiance = R>,
    ) -> PathRadiance<R> {
        self.li(start, &[], &mut NoReuse, out)
    }

    /// The radiance that arrives along the ray of `start`, by following one path. The first vertices are made in `slots`, as many as there are, and
    /// `reuse` is told of them; it may end the path at one of them.
    #[inline(always)]
    pub(crate) fn li<'v, S: Sampler, R: Gathered, M: Reuse<'v>>(
        &'v self,
        start: &PathStart<S>,
        slots: &'v [BsdfSlot<'v>],
        reuse: &mut M,
        out: &mut impl Sink<Radiance = R>,
    ) -> PathRadiance<R> {
        let world = &self.world;
        let (mut head, mut radiance, mut has_tail) = (R::default(), R::default(), false);
        let (mut trail, mut head_steps) = (Trail::<R>::new(), 0);
        let mut path = PathState {
            roulette_scale: start.roulette_scale,
            ..PathState::new(start.ray)
        };
        let wavelength = world.wavelength(start.sampler);
        for depth in start.depth.. {
            // Random numbers of a vertex do not depend on the hit: they are drawn before the ray is traced, and so meanwhile, if they are needed.
            let draw = || VertexNumbers::draw(start.sampler, depth, self.roulette);
            let numbers = (!M::ENDS_PATHS).then(draw);

            // Intersect the ray with the scene
            let (hit, transmittance) = if depth == start.depth {
                (start.hit, start.tint)
            } else {
                world.intersect(&path.ray, RayKind::Bounce, out)
            };
            path.beta *= transmittance;
            let Some(hit) = hit else {
                if let Some(escaped) = self.escaped(&path, depth, out) {
                    radiance += escaped;
                    trail.find(escaped);
                }
                break;
            };
            let later = BsdfSlot::new();
            let mut vertex = match slots.get((depth - start.depth) as usize) {
                Some(slot) => {
                    let vertex = world.vertex(&hit, &path.ray, slot);
                    reuse.meet(depth, &vertex, &path, || trail.events());
                    vertex
                }
                None => world.vertex(&hit, &path.ray, &later),
            };
            let bsdf = wavelength
                .as_ref()
                .and_then(|wavelength| world.dispersed(&hit, &later, wavelength));
            let disperses = bsdf.is_some();
            vertex.bsdf = bsdf.unwrap_or(vertex.bsdf);

            path_record::vertex(depth, (&hit, &vertex), path.beta, out);

            // Add emitted light, weighed against the light samples of the previous vertex
            let emitted = self.emitted(&path, (&hit, &vertex), out);
            radiance += emitted;
            trail.find(emitted);

            // End the path at its maximum depth
            if depth == 0 {
                world.see((&hit, &vertex), (&path.ray, path.beta), out);
            }
            if depth == start.tail_depth {
                head = std::mem::take(&mut radiance);
                head_steps = trail.len();
                has_tail = true;
            }
            if self.max_depth.is_some_and(|max| depth >= max) || reuse.ends_path() {
                break;
            }

            // From the first glass on that disperses it, the light is of one wavelength
            if let Some(wavelength) = wavelength.as_ref().filter(|_| disperses && !path.is_dispersed) {
                path.beta *= Spectrum::from(wavelength.weight);
                path.is_dispersed = true;
            }

            // Sample lights (next-event estimation)
            let u = numbers.unwrap_or_else(draw);
            let numbers = (start.key, start.sampler, u.light.as_ref());
            let (mut direct, shadow) = self.sample_lights(&vertex, numbers, out);

            // Sample the BSDF, update the throughput and play Russian roulette
            let (beta, allows_roulette) = (path.beta, reuse.allows_roulette());
            let sample = self.scatter(&mut path, &vertex, depth, &u, allows_roulette, out);

            // Add direct light. Its shadow ray is traced last, so that the next ray can follow it without delay.
            direct += shadow.arrives(world, out);
            let direct = direct * beta;
            radiance += direct;
            path_record::light(direct.sum(), out);
            trail.find(direct);
            let Some(sample) = sample else { break };
            if R::TELLS_PATHS {
                trail.go_on(vertex.event(sample.wi, sample.is_delta()));
            }
        }
        PathRadiance {
            head: trail.told_apart(head, 0..head_steps, world.paths),
            tail: trail.told_apart(radiance, head_steps..trail.len(), world.paths),
            has_tail,
        }
    }

    /// Light of infinitely distant lights that `path` finds where it leaves the scene after `depth`
    /// scattering events. `None` for a camera ray that sees the background.
    #[inline(always)]
    fn escaped<R: Gathered>(&self, path: &PathState, depth: u32, out: &mut impl Sink<Radiance = R>) -> Option<R> {
        if depth == 0 && self.world.see_background(&path.ray, path.beta, out) {
            return None;
        }
        let (scene, prev) = (self.world.scene, path.prev.as_ref());
        let escaped: R = self.strategy.escaped(scene, &path.ray, prev, path.beta);
        self.strategy.record_emitted(scene, &path.ray, prev, None, out);
        path_record::light(escaped.sum(), out);
        Some(escaped)
    }

    /// Light that the surface `met` emits towards the previous vertex of `path`, weighted against the
    /// light samples there.
    #[inline(always)]
    fn emitted<R: Gathered>(&self, path: &PathState, met: (&Hit, &Vertex), out: &mut impl Sink<Radiance = R>) -> R {
        let (scene, prev) = (self.world.scene, path.prev.as_ref());
        let emitted: R = self.strategy.emitted(scene, &path.ray, prev, path.beta, met);
        self.strategy.record_emitted(scene, &path.ray, prev, Some(met), out);
        path_record::light(emitted.sum(), out);
        emitted
    }

    /// Samples the BSDF at `vertex` and plays Russian roulette: `path` gets its next ray and throughput. `None` where it ends.
    #[inline(always)]
    fn scatter<S: Sampler>(
        &self,
        path: &mut PathState,
        vertex: &Vertex,
        depth: u32,
        u: &VertexNumbers<S>,
        allows_roulette: bool,
        out: &mut impl RaySink,
    ) -> Option<BsdfSample> {
        let sample = self
            .strategy
            .directions
            .sample(vertex, u.lobe(vertex.bsdf), u.direction)?;
        path.beta *= sample.weight;
        // That radiance shrinks on its way into glass, to grow again on its way out, is no reason to end.
        path.roulette_scale *= sample.eta * sample.eta;
        let factor = match allows_roulette {
            true => self.roulette.play(depth, path.beta * path.roulette_scale, u.roulette)?,
            false => 1.0,
        };
        path_record::scatter(depth, vertex, &sample, factor, out);
        path.beta *= factor;
        path.ray = self.world.ray_along(vertex, sample.wi);
        let light_samples = if depth == 0 { self.light_samples } else { 1 };
        path.prev = Some(PrevVertex::new(vertex, &sample, light_samples));
        Some(sample)
    }

    /// Samples lights for `vertex`: the light that has been found, and the last sample, whose shadow ray is still to be traced.
    ///
    /// Without `u` it is the first vertex, whose light samples count on through the pixel's samples, so that all of them are stratified together.
    #[inline(always)]
    pub(crate) fn sample_lights<S: Sampler, R: Gathered>(
        &self,
        vertex: &Vertex,
        (key, sampler, u): (SampleKey, &S, Option<&LightNumbers<S>>),
        out: &mut impl Sink<Radiance = R>,
    ) -> (R, Direct<R>) {
        let (world, strategy) = (&self.world, &self.strategy);
        if let Some(u) = u {
            return (R::default(), Direct::sample(world, vertex, strategy, 1, u, out));
        }
        let (mut radiance, mut shadow) = (R::default(), Direct::none());
        let count = self.light_samples;
        let mut add = |next: Direct<R>, out: &mut _| {
            // Each shadow ray is traced when the next sample is ready.
            radiance += std::mem::replace(&mut shadow, next).arrives(world, out);
        };
        if count == 1 {
            // A single sample is the path's own.
            let u = LightNumbers::draw(sampler, 0);
            add(Direct::sample(world, vertex, strategy, 1, &u, out), out);
        } else {
            for i in (0..count).step_by(4) {
                let first = SampleKey {
                    sample: key.sample.wrapping_mul(count).wrapping_add(i),
                    ..key
                };
                let several = (count - i).min(4);
                let numbers = LightNumbers::draw_several(sampler, first, several);
                let numbers = &numbers[..several as usize];
                Direct::sample_four(world, vertex, strategy, count, numbers, out, &mut add);
            }
        }
        (radiance, shadow)
    }
}

/// Camera rays of several samples, traced as one packet.
pub(crate) struct CameraPacket<S> {
    samplers: [S; SAMPLES_AT_ONCE],
    rays: [Ray; SAMPLES_AT_ONCE],
    hits: [Option<Hit>; SAMPLES_AT_ONCE],
    /// Tint of the glass before each hit.
    pub tints: [Spectrum; SAMPLES_AT_ONCE],
}

impl<S: Sampler> CameraPacket<S> {
    /// Traces the camera rays of `keys`, at most [`SAMPLES_AT_ONCE`]; `is_one_time` gives all of them the time of the first.
    #[inline(always)]
    pub fn trace<A: Accel>(
        world: &World<A>,
        keys: &[SampleKey],
        sampler: &S,
        is_one_time: bool,
        out: &mut [impl Sink],
    ) -> Self {
        let mut packet = Self {
            samplers: from_fn(|_| sampler.clone()),
            rays: [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE],
            hits: [None; SAMPLES_AT_ONCE],
            tints: [Spectrum::ONE; SAMPLES_AT_ONCE],
        };
        let mut time = None;
        let samples = packet.rays.iter_mut().zip(&mut packet.samplers);
        for ((ray, sampler), (key, out)) in samples.zip(keys.iter().zip(&mut *out)) {
            *ray = world.camera_ray(*key, time, sampler, out);
            time = time.or(is_one_time.then_some(ray.time));
        }
        let (rays, hits) = (&packet.rays[..keys.len()], &mut packet.hits[..keys.len()]);
        world.accel.intersect_coherent(rays, hits);
        out.iter_mut().for_each(|out| out.ray(RayKind::Camera));
        let absorbs = world.scene.has_absorption();
        if world.lets_pass(RayKind::Camera) || absorbs {
            for (i, out) in out.iter_mut().enumerate().take(keys.len()) {
                let u = (world.scene.has_thin_surfaces()).then(|| packet.samplers[i].get_1d(Dimension::THIN_SURFACES));
                (packet.hits[i], packet.tints[i]) = match absorbs {
                    true => world.first_in_bodies(&packet.rays[i], packet.hits[i], RayKind::Camera, u, out),
                    false => world.first_opaque(packet.rays[i], packet.hits[i], RayKind::Camera, u, out),
                };
            }
        }
        packet
    }

    /// The path of the sample `i`.
    pub fn start(&self, i: usize, keys: &[SampleKey]) -> PathStart<'_, S> {
        PathStart {
            key: keys[i],
            sampler: &self.samplers[i],
            ray: self.rays[i],
            hit: self.hits[i],
            tint: self.tints[i],
            depth: 0,
            tail_depth: 1,
            roulette_scale: Spectrum::ONE,
        }
    }
}

impl<S> PathStart<'_, S> {
    /// This start with the closest hit of its ray, which has left a surface.
    #[inline(always)]
    pub fn traced<A: Accel>(self, world: &World<A>, out: &mut impl Sink) -> Self {
        let (hit, tint) = world.intersect(&self.ray, RayKind::Bounce, out);
        Self { hit, tint, ..self }
    }

    /// Light that is emitted where the ray ends, weighed against the light samples of the vertex `prev`, which it has left.
    #[inline(never)]
    pub fn emitted<A: Accel, R: Gathered>(&self, world: &World<A>, strategy: &Strategy, prev: &PrevVertex) -> R {
        let slot = BsdfSlot::new();
        let vertex = self.hit.map(|hit| world.vertex(&hit, &self.ray, &slot));
        let met = self.hit.as_ref().zip(vertex.as_ref());
        match met {
            Some(met) => strategy.emitted(world.scene, &self.ray, Some(prev), self.tint, met),
            None => strategy.escaped(world.scene, &self.ray, Some(prev), self.tint),
        }
    }
}

/// The random numbers of one vertex.
pub(crate) struct VertexNumbers<'s, S> {
    sampler: &'s S,
    depth: u32,
    /// Chooses and samples a light; `None` at the first vertex, where [`PathIntegrator::sample_lights`] draws those of each light sample.
    pub light: Option<LightNumbers<'s, S>>,
    /// Draws the direction.
    pub direction: Vec2,
    pub roulette: f32,
}

impl<'s, S: Sampler> VertexNumbers<'s, S> {
    /// Draws the numbers of the vertex after `depth` scattering events. Roulette that does not play at the first vertex needs none there.
    #[inline(always)]
    pub fn draw(sampler: &'s S, depth: u32, roulette: Roulette) -> Self {
        if depth == 0 {
            let decisions = match roulette.depth > 0 {
                true => Vec2::ZERO,
                false => sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)),
            };
            return Self {
                sampler,
                depth,
                light: None,
                direction: sampler.get_2d(Dimension::bounce(depth, Bounce::Direction)),
                roulette: decisions.y,
            };
        }
        let dimensions = [Bounce::Decisions, Bounce::LightPoint, Bounce::Direction];
        let [decisions, point, direction] = sampler.get_2ds(dimensions.map(|what| Dimension::bounce(depth, what)));
        Self {
            sampler,
            depth,
            light: Some(LightNumbers::new(sampler, depth, decisions.x, point)),
            direction,
            roulette: decisions.y,
        }
    }

    /// Chooses a lobe of `bsdf`, where there are several.
    pub fn lobe(&self, bsdf: &Bsdf) -> f32 {
        match bsdf {
            Bsdf::Single(_) => 0.0,
            Bsdf::Mix(_) | Bsdf::Layered(_) => self.sampler.get_1d(Dimension::bounce(self.depth, Bounce::Lobe)),
        }
    }
}
