//! The path tracer. `PathIntegrator::li` is the whole algorithm: it follows one path.
//!
//! At each vertex a path adds the light that the surface emits, samples one light through a shadow
//! ray, and continues in a direction sampled from the BSDF. Light that both strategies can find is
//! weighted by the power heuristic (Veach 1997, §9.2).
//!
//! The order of the steps follows from measurements (docs/notebook/2026-11.md, "Single steps"). The
//! random numbers of a vertex are computed before the ray to the vertex is traced. The next ray is
//! ready before the shadow ray is traced, so that the CPU need not wait between the two rays. The
//! camera rays of sixteen samples are traced as one packet. After the first hit rays diverge, and
//! packets gain nothing. A packet of the shadow rays of sixteen first vertices was tried, and was
//! slower because of the data stored between the stages.
//!
//! `pipeline/run.rs` monomorphises the path tracer per backend, because a call that the compiler
//! cannot inline costs some percent of the time of a ray.

use super::camera_packet::CameraPacket;
use super::direct::{Direct, LightNumbers, trace};
use super::state::{NextSegment, PathState, RayResult};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::integrator::listeners::ClampingSink;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Integrator, Roulette, SAMPLES_AT_ONCE, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Vec2;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::sampling::Wavelength;

/// Unidirectional path tracing with next-event estimation. By default lights and BSDF are sampled
/// at every vertex and combined by the power heuristic. Russian roulette on the throughput ends
/// paths (Kajiya 1986; Veach 1997, ch. 9–10).
#[derive(Debug)]
pub struct PathIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Sampling of directions and of direct light.
    pub strategy: Strategy,
    /// Maximum number of scattering events. 0 shows only emission. `None`: only roulette ends
    /// paths.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Number of light samples at the first vertex. All other vertices have one light sample.
    pub light_samples: u32,
    /// Maximum luminance of a sample's light after the first bounce. `None`: no clamping. Clamping
    /// makes the estimate biased.
    pub clamp_indirect: Option<f32>,
}

// Derived impls would require `A: Clone`, though `A` is only behind a reference.
impl<A> Clone for PathIntegrator<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A> Copy for PathIntegrator<'_, A> {}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        match self.clamp_indirect {
            None => self.trace(keys, sampler, out),
            Some(limit) => with_clamped(limit, out, |out| self.trace(keys, sampler, out)),
        }
    }
}

/// Calls `trace` with sinks that limit indirect light to the luminance `limit`.
pub(crate) fn with_clamped(limit: f32, out: &mut [impl Sink], trace: impl FnOnce(&mut [&mut dyn Sink])) {
    let mut clamped: Vec<ClampingSink> = out.iter_mut().map(|out| ClampingSink::new(out)).collect();
    let mut sinks: Vec<&mut dyn Sink> = clamped.iter_mut().map(|out| out as _).collect();
    trace(&mut sinks);
    clamped.into_iter().for_each(|out| out.finish(limit));
}

impl<A: Accel> PathIntegrator<'_, A> {
    /// Traces the samples `keys`, one path per sample.
    fn trace<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        let mut packet = CameraPacket::new();
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            packet.trace(&self.world, keys, sampler, false, out);
            for (i, (&key, out)) in keys.iter().zip(out).enumerate() {
                let (path, traced) = packet.path(i);
                let numbers = PathNumbers::start(&self.world, key, sampler);
                self.li(path, Some(traced), numbers, out);
                if self.world.scene.ground().is_some() {
                    self.catch_shadow(path, traced, numbers, out);
                }
            }
        }
    }

    /// Follows one path, and adds the light that arrives along the ray of `path`. `traced` is the
    /// result of the first ray query, if the query was made already.
    #[inline(never)]
    pub(crate) fn li<S: Sampler>(
        &self,
        mut path: PathState,
        mut traced: Option<RayResult>,
        numbers: PathNumbers<S>,
        out: &mut impl Sink,
    ) {
        loop {
            // Random numbers do not depend on the hit, so the CPU computes them while it traces the
            // ray
            let u = numbers.vertex(path.depth, self.roulette);

            // Find the next surface. Emission is weighted against the light samples of the previous
            // vertex
            let Some(hit) = path.intersect(&self.world, traced.take(), out) else {
                return self.strategy.add_sky(&self.world, &path, out);
            };
            let slot = BsdfSlot::new();
            let vertex = path.vertex(&self.world, &hit, numbers.wavelength.as_ref(), &slot, out);
            self.strategy.add_emission(&self.world, &path, &vertex, out);
            if Some(path.depth) == self.max_depth {
                return;
            }

            // Sample a light (next-event estimation). Its shadow ray is traced below
            let direct = self.sample_light(&path, &vertex, &u, out);

            // Sample the BSDF and play Russian roulette
            let next = self.scatter(&path, &vertex, self.roulette, &u, out);

            // Add direct light. The shadow ray is traced last, so that the next ray follows without
            // delay
            trace(direct, &self.world, &path, &vertex, out);
            match next {
                Some(next) => path.advance(next),
                None => return,
            }
        }
    }

    /// Samples the BSDF at `vertex` and plays `roulette`. Returns the next segment, or `None` if
    /// the path ends there.
    #[inline(always)]
    pub(crate) fn scatter<S: Sampler>(
        &self,
        path: &PathState,
        vertex: &Vertex,
        roulette: Roulette,
        u: &VertexNumbers<S>,
        out: &mut impl Sink,
    ) -> Option<NextSegment> {
        let directions = self.strategy.directions;
        let sample = directions.sample(vertex, u.lobe(vertex.bsdf), u.direction)?;
        // Roulette ignores the change of radiance by refraction, because radiance that shrinks on
        // its way into glass grows again on its way out.
        let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
        let factor = roulette.play(path.depth, judged, u.roulette)?;
        let light_samples = if path.depth == 0 { self.light_samples } else { 1 };
        Some(path.scatter(&self.world, vertex, &sample, factor, light_samples, out))
    }

    /// Samples lights for `vertex`. Traces the shadow rays of all light samples except the last.
    /// Returns the last light sample, whose shadow ray the caller must trace.
    ///
    /// The light samples of the first vertex are numbered consecutively over all samples of the
    /// pixel, so that all of them are stratified jointly.
    #[inline(always)]
    pub(crate) fn sample_light<S: Sampler>(
        &self,
        path: &PathState,
        vertex: &Vertex,
        u: &VertexNumbers<S>,
        out: &mut impl Sink,
    ) -> Option<Direct> {
        let (world, strategy, count) = (&self.world, &self.strategy, self.light_samples);
        if let Some(u) = &u.light {
            return Direct::sample(world, path, vertex, strategy, 1, u, out);
        }
        let PathNumbers { key, sampler, .. } = u.numbers;
        if count == 1 {
            // A single light sample uses the numbers of the path.
            let u = LightNumbers::draw(sampler, 0);
            return Direct::sample(world, path, vertex, strategy, 1, &u, out);
        }
        let mut last = None;
        for i in (0..count).step_by(4) {
            let first = SampleKey {
                sample: key.sample.wrapping_mul(count).wrapping_add(i),
                ..key
            };
            let several = (count - i).min(4);
            let numbers = LightNumbers::draw_several(sampler, first, several);
            let numbers = &numbers[..several as usize];
            // Trace each shadow ray after the next sample is ready.
            let add = |next, out: &mut _| {
                trace(std::mem::replace(&mut last, next), world, path, vertex, out);
            };
            self.sample_four_lights(path, vertex, numbers, out, add);
        }
        last
    }

    /// Calls `add` with a light sample of `vertex` for each element of `numbers` (1 to 4 elements).
    /// The samples equal the results of [`Direct::sample`].
    #[inline(always)]
    fn sample_four_lights<S: Sampler, K: Sink>(
        &self,
        path: &PathState,
        vertex: &Vertex,
        numbers: &[LightNumbers<S>],
        out: &mut K,
        mut add: impl FnMut(Option<Direct>, &mut K),
    ) {
        let (world, strategy, count) = (&self.world, &self.strategy, self.light_samples);
        if !strategy.samples_lights() || vertex.bsdf.is_delta() {
            return;
        }
        let (scene, selection) = (world.scene, world.light_selection);
        if selection.all().is_some() {
            for u in numbers {
                add(Direct::sample(world, path, vertex, strategy, count, u, out), out);
            }
            return;
        }
        // Choose a light for each sample
        let (context, time) = (vertex.light_context(), vertex.point.time);
        let (mut ids, mut pmfs, mut points) = ([None; 4], [0.0; 4], [Vec2::ZERO; 4]);
        for (i, u) in numbers.iter().enumerate().take(4) {
            points[i] = u.point;
            if let Some((id, pmf)) = selection.sample(scene.lights(), &context, u.choice) {
                (ids[i], pmfs[i]) = (Some(id), pmf);
            }
        }
        // Sample a direction to each of these lights, and evaluate the radiance from this direction
        let lights = selection.sample_four(scene.lights(), ids, &context, time, points, scene.textures());
        for i in 0..4 {
            if let (Some(id), Some(light)) = (ids[i], &lights[i]) {
                let expected = count as f32 * pmfs[i];
                add(
                    Direct::of_sample(world, vertex, strategy, id, expected, light, out),
                    out,
                );
            }
        }
    }
}

/// Source of the random numbers of a path.
pub(crate) struct PathNumbers<'s, S> {
    pub key: SampleKey,
    /// Sampler, started with `key`.
    pub sampler: &'s S,
    /// Wavelength of the light, if the scene has dispersive glass.
    pub wavelength: Option<Wavelength>,
}

// Derived impls would require `S: Clone`, though `S` is only behind a reference.
impl<S> Clone for PathNumbers<'_, S> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<S> Copy for PathNumbers<'_, S> {}

/// Random numbers of one vertex.
pub(crate) struct VertexNumbers<'s, S> {
    numbers: PathNumbers<'s, S>,
    depth: u32,
    /// Random numbers of the light sample at the vertex. `None` at the first vertex, for which
    /// [`PathIntegrator::sample_light`] draws the numbers of each light sample.
    pub light: Option<LightNumbers<'s, S>>,
    /// Random number for the direction.
    pub direction: Vec2,
    pub roulette: f32,
}

impl<'s, S: Sampler> PathNumbers<'s, S> {
    /// Starts `sampler` with `key`.
    #[inline(always)]
    pub fn start<A: Accel>(world: &World<A>, key: SampleKey, sampler: &'s mut S) -> Self {
        sampler.start(key);
        Self {
            key,
            wavelength: world.wavelength(sampler),
            sampler,
        }
    }

    /// Random numbers of the vertex after `depth` scattering events. The number for roulette is
    /// drawn at the first vertex only if roulette may end paths there.
    #[inline(always)]
    pub fn vertex(self, depth: u32, roulette: Roulette) -> VertexNumbers<'s, S> {
        let sampler = self.sampler;
        if depth == 0 {
            let decisions = if roulette.depth > 0 {
                Vec2::ZERO
            } else {
                sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions))
            };
            return VertexNumbers {
                numbers: self,
                depth,
                light: None,
                direction: sampler.get_2d(Dimension::bounce(depth, Bounce::Direction)),
                roulette: decisions.y,
            };
        }
        let dimensions = [Bounce::Decisions, Bounce::LightPoint, Bounce::Direction];
        let [decisions, point, direction] = sampler.get_2ds(dimensions.map(|what| Dimension::bounce(depth, what)));
        VertexNumbers {
            numbers: self,
            depth,
            light: Some(LightNumbers::new(sampler, depth, decisions.x, point)),
            direction,
            roulette: decisions.y,
        }
    }
}

impl<S: Sampler> VertexNumbers<'_, S> {
    /// Random number that chooses a lobe of `bsdf`; 0 if `bsdf` has a single lobe.
    pub fn lobe(&self, bsdf: &Bsdf) -> f32 {
        match bsdf {
            Bsdf::Single(_) => 0.0,
            Bsdf::Mix(_) | Bsdf::Layered(_) => self.numbers.sampler.get_1d(Dimension::bounce(self.depth, Bounce::Lobe)),
        }
    }
}
