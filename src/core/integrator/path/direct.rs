//! Direct light at a vertex: light sampling with a shadow ray, and emitted light that a scattered ray meets, weighted against each other (Veach 1997,
//! §9.2).
//!
//! The path tracer, its relatives, `irradiance_cache` and the photon methods share this estimate.

use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::path_record::{self, EmissionRecord, LightSampleRecord};
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, PathEvent, RayKind, RaySink, Sink, Strategy, World};
use crate::light::{LightId, LightSample, LightSampleContext};
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::scene::{Incident, Scene};

/// The random numbers of one estimate of direct light.
pub(crate) struct LightNumbers<'a, S> {
    /// Chooses the light.
    pub choice: f32,
    /// Chooses the point on it.
    pub point: Vec2,
    sampler: &'a S,
    /// The sample whose numbers they are, where it is not the one that `sampler` was started with.
    key: Option<SampleKey>,
    depth: u32,
}

impl<'a, S: Sampler> LightNumbers<'a, S> {
    /// Draws the numbers of the vertex after `depth` scattering events.
    #[inline(always)]
    pub fn draw(sampler: &'a S, depth: u32) -> Self {
        let dimensions = [Bounce::Decisions, Bounce::LightPoint];
        let [decisions, point] = sampler.get_2ds(dimensions.map(|what| Dimension::bounce(depth, what)));
        Self::new(sampler, depth, decisions.x, point)
    }

    /// The numbers `choice` and `point`, which have been drawn.
    #[inline(always)]
    pub fn new(sampler: &'a S, depth: u32, choice: f32, point: Vec2) -> Self {
        Self {
            choice,
            point,
            sampler,
            key: None,
            depth,
        }
    }

    /// Draws the numbers of the first vertex for `count` samples from `key` on, at most four. Other numbers are unspecified.
    #[inline(always)]
    pub fn draw_several(sampler: &'a S, key: SampleKey, count: u32) -> [Self; 4] {
        let dimensions = [Bounce::Decisions, Bounce::LightPoint].map(|what| Dimension::bounce(0, what));
        let mut next = key;
        sampler.get_2ds_of(key, count, dimensions).map(|[decisions, point]| {
            let key = next;
            next.sample = next.sample.wrapping_add(1);
            Self {
                key: Some(key),
                ..Self::new(sampler, 0, decisions.x, point)
            }
        })
    }

    /// Draws the other numbers, where the one that chooses the light has been drawn.
    #[inline(always)]
    pub fn with_choice(sampler: &'a S, depth: u32, choice: f32) -> Self {
        let point = sampler.get_2d(Dimension::bounce(depth, Bounce::LightPoint));
        Self::new(sampler, depth, choice, point)
    }

    /// Draws the point of the sample number `index`, where all lamps are sampled.
    pub fn point_of(&self, index: u32) -> Vec2 {
        let dimension = Dimension::bounce(self.depth, Bounce::LightPoint).nth(index);
        let Some(key) = self.key else {
            return self.sampler.get_2d(dimension);
        };
        let mut sampler = self.sampler.clone();
        sampler.start(key);
        sampler.get_2d(dimension)
    }
}

impl Strategy {
    /// Gives `add` the light that `ray` finds, times the throughput `beta`: emitted by the surface `met`, or by infinitely distant lights where it
    /// meets none. It is weighed against the light samples of the previous vertex.
    #[inline(always)]
    pub(crate) fn found<R: Gathered>(
        &self,
        scene: &Scene,
        ray: &Ray,
        prev: Option<&PrevVertex>,
        beta: Spectrum,
        met: Option<(&Hit, &Vertex)>,
        mut add: impl FnMut(R),
    ) {
        match met {
            Some(met) => add(self.emitted(scene, ray, prev, beta, met)),
            None => scene
                .escaped(from(ray, prev), ray.direction)
                .for_each(|light| add(self.weighed(prev, beta, light, scene))),
        }
    }

    /// Light that the surface that `ray` meets emits, times the throughput `beta`, weighed against the light samples of the previous vertex.
    #[inline(always)]
    pub(crate) fn emitted<R: Gathered>(
        &self,
        scene: &Scene,
        ray: &Ray,
        prev: Option<&PrevVertex>,
        beta: Spectrum,
        (hit, vertex): (&Hit, &Vertex),
    ) -> R {
        match scene.emitted(hit, &from(ray, prev), vertex.point.p, ray.direction, ray.time) {
            Some(light) => self.weighed(prev, beta, light, scene),
            None => R::default(),
        }
    }

    /// Light of the infinitely distant lights that `ray` escapes to, times the throughput `beta`, weighed against the light samples of the previous
    /// vertex.
    #[inline(never)]
    pub(crate) fn escaped<R: Gathered>(
        &self,
        scene: &Scene,
        ray: &Ray,
        prev: Option<&PrevVertex>,
        beta: Spectrum,
    ) -> R {
        let mut sum = R::default();
        self.found(scene, ray, prev, beta, None, |light| sum += light);
        sum
    }

    /// Records the light that [`Strategy::found`] adds.
    #[inline(always)]
    pub(crate) fn record_emitted(
        &self,
        scene: &Scene,
        ray: &Ray,
        prev: Option<&PrevVertex>,
        met: Option<(&Hit, &Vertex)>,
        out: &mut impl RaySink,
    ) {
        if !out.records() {
            return;
        }
        let from = from(ray, prev);
        let lights: Vec<Incident> = match met {
            Some((hit, vertex)) => {
                let light = scene.emitted(hit, &from, vertex.point.p, ray.direction, ray.time);
                light.into_iter().collect()
            }
            None => scene.escaped(from, ray.direction).collect(),
        };
        for light in lights.into_iter().filter(|light| !light.radiance.is_black()) {
            out.record(PathEvent::Emission(EmissionRecord {
                light: light.id,
                direction: ray.direction,
                scattering_pdf: prev.filter(|prev| !prev.is_delta).map_or(0.0, |prev| prev.pdf),
                light_pdf: light.pdf,
                weight: self.emission_weight(prev, &light),
                radiance: light.radiance,
            }));
        }
    }

    #[inline(always)]
    fn weighed<R: Gathered>(&self, prev: Option<&PrevVertex>, beta: Spectrum, light: Incident, scene: &Scene) -> R {
        let weight = self.emission_weight(prev, &light);
        R::of_light(beta * light.radiance * weight, light.id, scene)
    }
}

/// Where light that `ray` finds could have been sampled from.
#[inline(always)]
fn from(ray: &Ray, prev: Option<&PrevVertex>) -> LightSampleContext {
    prev.map_or(LightSampleContext::any_side(ray.origin), |prev| prev.from)
}

impl Strategy {
    /// Follows `ray`, which leaves `prev` after `depth` scatterings, to its first surface. Emission that it meets, and the background, go to `out`. `None`
    /// where it meets no surface.
    pub(super) fn arrive<'v, A: Accel>(
        &self,
        world: &'v World<A>,
        (ray, depth): (&Ray, u32),
        prev: Option<&PrevVertex>,
        beta: &mut Spectrum,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Option<(Hit, Vertex<'v>)> {
        let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
        let (hit, transmittance) = world.intersect(ray, kind, out);
        *beta *= transmittance;
        if depth == 0 && hit.is_none() && world.see_background(ray, *beta, out) {
            return None;
        }
        let vertex = hit.map(|hit| world.vertex(&hit, ray, slot));
        let met = hit.as_ref().zip(vertex.as_ref());
        if let Some(met) = met {
            path_record::vertex(depth, met, *beta, out);
        }
        self.record_emitted(world.scene, ray, prev, met, out);
        self.found(world.scene, ray, prev, *beta, met, |light| out.radiance(light));
        let met = hit.zip(vertex)?;
        if depth == 0 {
            world.see((&met.0, &met.1), (ray, *beta), out);
        }
        Some(met)
    }
}

/// Number of light samples between two checks for cancellation, where all lamps are sampled.
pub(crate) const LIGHTS_A_LOOK: u32 = 64;

/// Light that sampled lights send to a vertex and on to the viewer, weighed against following scattered rays.
///
/// This is the half of the estimator that samples lights (Veach 1997, §9.2); the other half is the emission that a
/// scattered ray meets.
pub(crate) enum Direct<R> {
    /// Light that is known to arrive.
    Known(R),
    /// Light that arrives unless its shadow ray is blocked.
    Unless(Ray, R),
}

impl<R: Gathered> Direct<R> {
    /// No light.
    #[inline(always)]
    pub fn none() -> Self {
        Self::Known(R::default())
    }

    /// Samples a light for `vertex`, as one of `count` samples that will be summed. Where all lamps are sampled their shadow rays are traced
    /// here; a single one is left to [`Direct::arrives`].
    #[inline(always)]
    pub fn sample<A: Accel>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        count: u32,
        u: &LightNumbers<impl Sampler>,
        out: &mut impl Sink<Radiance = R>,
    ) -> Self {
        if !strategy.samples_lights() || vertex.bsdf.is_delta() {
            return Self::none();
        }
        let selection = world.scene.light_selection();
        if let Some(lamps) = selection.all() {
            let mut sum = R::default();
            for index in 0..lamps.samples() {
                if index % LIGHTS_A_LOOK == LIGHTS_A_LOOK - 1 && out.is_cancelled() {
                    break;
                }
                let (id, expected) = lamps.choose(index, u.choice);
                let of = (id, count as f32 * expected);
                let light = Self::of_light(world, vertex, strategy, of, u.point_of(index), out);
                sum += light.arrives(world, out);
            }
            return Self::Known(sum);
        }
        match selection.sample(world.scene.lights(), &vertex.light_context(), u.choice) {
            Some((id, pmf)) => Self::of_light(world, vertex, strategy, (id, count as f32 * pmf), u.point, out),
            None => Self::none(),
        }
    }

    /// Gives `add` a light sample of `vertex` for each of `numbers`, at most four, as [`Direct::sample`] draws it; `count` samples will be summed.
    #[inline(always)]
    pub fn sample_four<A: Accel, S: Sampler, K: Sink<Radiance = R>>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        count: u32,
        numbers: &[LightNumbers<S>],
        out: &mut K,
        mut add: impl FnMut(Self, &mut K),
    ) {
        if !strategy.samples_lights() || vertex.bsdf.is_delta() {
            return;
        }
        let (scene, selection) = (world.scene, world.scene.light_selection());
        if selection.all().is_some() {
            for u in numbers {
                add(Self::sample(world, vertex, strategy, count, u, out), out);
            }
            return;
        }
        // The light of each sample
        let (context, time) = (vertex.light_context(), vertex.point.time);
        let (mut ids, mut pmfs, mut points) = ([None; 4], [0.0; 4], [Vec2::ZERO; 4]);
        for (i, u) in numbers.iter().enumerate().take(4) {
            points[i] = u.point;
            if let Some((id, pmf)) = selection.sample(scene.lights(), &context, u.choice) {
                (ids[i], pmfs[i]) = (Some(id), pmf);
            }
        }
        // Directions towards these lights, and the radiance from there
        let lights = selection.sample_four(scene.lights(), ids, (&context, time), points, scene.textures());
        for i in 0..4 {
            if let (Some(id), Some(light)) = (ids[i], &lights[i]) {
                let of = (id, count as f32 * pmfs[i]);
                add(Self::of_sample(world, vertex, strategy, of, light, out), out);
            }
        }
    }

    /// Samples the light `id`, of which `expected` samples are expected at the vertex.
    #[inline(always)]
    fn of_light<A: Accel>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        (id, expected): (LightId, f32),
        u: Vec2,
        out: &mut impl RaySink,
    ) -> Self {
        let scene = world.scene;
        // A direction towards the light
        let to = (&vertex.light_context(), vertex.point.time);
        let light = scene
            .light_selection()
            .sample_light(scene.lights(), id, to, u, scene.textures());
        match light {
            Some(light) => Self::of_sample(world, vertex, strategy, (id, expected), &light, out),
            None => Self::none(),
        }
    }

    /// Weighs the sample `light` of the light `id`, of which `expected` samples are expected at the vertex.
    #[inline(always)]
    fn of_sample<A: Accel>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        (id, expected): (LightId, f32),
        light: &LightSample,
        out: &mut impl RaySink,
    ) -> Self {
        let scene = world.scene;
        // The scattered light; where it is black no shadow ray is needed.
        let wi = vertex.frame.to_local(light.wi);
        let (f, scattering_pdf) = strategy.directions.eval_pdf(vertex, wi);
        let f = f * wi.z.abs();
        if f.is_black() {
            return Self::none();
        }
        let pdf = expected * light.pdf;
        let weight = strategy.light_weight(pdf, light.is_delta, scattering_pdf);
        if out.records() {
            out.record(PathEvent::LightSample(LightSampleRecord {
                light: id,
                direction: light.wi,
                target: light.target,
                pmf: expected,
                pdf: light.pdf,
                scattering_pdf,
                weight,
                f_cos: f,
                radiance: light.radiance,
                transmittance: None,
            }));
        }
        let ray = light
            .shadow_ray(world.origin(vertex, wi, light.wi))
            .when(vertex.point.time);
        let ray = ray.within(vertex.body_towards(wi));
        let radiance = R::of_light(f * light.radiance * (weight / pdf), id, scene);
        Self::Unless(ray, radiance.scattered(|| vertex.event(wi, false), world.paths))
    }

    /// Traces the shadow ray: the light that arrives.
    #[inline(always)]
    pub fn arrives<A: Accel>(self, world: &World<A>, out: &mut impl Sink<Radiance = R>) -> R {
        match self {
            Self::Known(radiance) => radiance,
            Self::Unless(ray, radiance) => radiance * transmitted(world, &ray, out),
        }
    }
}

/// Transmittance along the shadow ray `ray`.
#[inline(always)]
fn transmitted<A: Accel>(world: &World<A>, ray: &Ray, out: &mut impl RaySink) -> Spectrum {
    let transmittance = world.transmittance(ray, out).color();
    if out.records() {
        out.record(PathEvent::Shadow { transmittance });
    }
    transmittance
}
