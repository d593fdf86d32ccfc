//! Direct light at a vertex: light sampling with a shadow ray, and emission that a scattered ray
//! hits. Both strategies are weighted by MIS (Veach 1997, §9.2).
//!
//! The integrators of `path`, `irradiance_cache` and `photon` share this estimate.

use super::state::PathState;
use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::path_record::{EmissionRecord, LightSampleRecord};
use crate::integrator::vertex::Vertex;
use crate::integrator::{FoundLight, LightSource, PathEvent, Sink, Strategy, World};
use crate::light::{LightId, LightSample};
use crate::light_sampling::LightSampleContext;
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::sampling::Wavelength;
use crate::scene::{Incident, Scene};

/// Random numbers of one light sample.
pub(crate) struct LightNumbers<'a, S> {
    /// Random number that chooses the light.
    pub choice: f32,
    /// Random number for the point on the light.
    pub point: Vec2,
    sampler: &'a S,
    /// Sample key of these numbers, if `sampler` was started with another key.
    key: Option<SampleKey>,
    depth: u32,
}

impl<'a, S: Sampler> LightNumbers<'a, S> {
    /// Draws the random numbers of a light sample at the vertex after `depth` scattering events.
    #[inline(always)]
    pub fn draw(sampler: &'a S, depth: u32) -> Self {
        let dimensions = [Bounce::Decisions, Bounce::LightPoint];
        let [decisions, point] = sampler.get_2ds(dimensions.map(|what| Dimension::bounce(depth, what)));
        Self::new(sampler, depth, decisions.x, point)
    }

    /// Random numbers of a light sample, of which `choice` and `point` are already drawn.
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

    /// Draws the random numbers of `count` light samples at the first vertex, for the sample keys
    /// from `key` on. `count` is 1 to 4. Elements of the result from `count` on are unspecified.
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

    /// Draws the random number of the point; `choice` is already drawn.
    #[inline(always)]
    pub fn with_choice(sampler: &'a S, depth: u32, choice: f32) -> Self {
        let point = sampler.get_2d(Dimension::bounce(depth, Bounce::LightPoint));
        Self::new(sampler, depth, choice, point)
    }

    /// Random number for the point on the light of light sample `index`, if all lamps are sampled.
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
    /// Finds the next vertex of `path`, and adds the emission that its ray hits. Returns `None` if
    /// the ray leaves the scene. `slot` stores the BSDF of the vertex.
    #[inline(always)]
    pub(crate) fn next_vertex<'v, A: Accel>(
        &self,
        world: &'v World<A>,
        path: &mut PathState,
        wavelength: Option<&Wavelength>,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Option<Vertex<'v>> {
        let vertex = path.next_vertex(world, wavelength, slot, out);
        self.add_found(world, path, vertex.as_ref(), out);
        vertex
    }

    /// Samples a light for `vertex` (next-event estimation), and adds the light if it is not
    /// occluded.
    #[inline(always)]
    pub(crate) fn add_direct_light<A: Accel>(
        &self,
        world: &World<A>,
        path: &PathState,
        vertex: &Vertex,
        u: &LightNumbers<impl Sampler>,
        out: &mut impl Sink,
    ) {
        let direct = Direct::sample(world, path, vertex, self, 1, u, out);
        trace(direct, world, path, vertex, out);
    }

    /// Adds the emission that the ray of `path` hits: of the surface `vertex`, or of infinitely
    /// distant lights if `vertex` is `None`.
    #[inline(always)]
    pub(crate) fn add_found<A: Accel>(
        &self,
        world: &World<A>,
        path: &PathState,
        vertex: Option<&Vertex>,
        out: &mut impl Sink,
    ) {
        match vertex {
            Some(vertex) => self.add_emission(world, path, vertex, out),
            None => self.add_sky(world, path, out),
        }
    }

    /// Adds the emission of the surface `vertex` along the ray of `path`, weighted against the
    /// light samples of the previous vertex.
    #[inline(always)]
    pub(crate) fn add_emission<A: Accel>(
        &self,
        world: &World<A>,
        path: &PathState,
        vertex: &Vertex,
        out: &mut impl Sink,
    ) {
        if path.skips_emission {
            return;
        }
        if let Some(light) = emitted(world, path, vertex) {
            self.add_weighted(world.scene, path, light, out);
        }
    }

    /// Adds the radiance of the infinitely distant lights along the ray of `path`, weighted against
    /// the light samples of the previous vertex. For a camera ray, adds the background.
    #[inline(never)]
    pub(crate) fn add_sky<A: Accel>(&self, world: &World<A>, path: &PathState, out: &mut impl Sink) {
        if path.skips_emission || (path.depth == 0 && world.see_background(&path.ray, path.beta, out)) {
            return;
        }
        for light in world
            .scene
            .escaped(world.light_selection, context(path), path.ray.direction)
        {
            self.add_weighted(world.scene, path, light, out);
        }
    }

    /// Adds the emission `light` that the ray of `path` hits, weighted against the light samples of
    /// the previous vertex.
    #[inline(always)]
    pub(crate) fn add_weighted(&self, scene: &Scene, path: &PathState, light: Incident, out: &mut impl Sink) {
        let prev = path.prev.as_ref();
        let weight = self.emission_weight(prev, &light);
        if out.records() && !light.radiance.is_black() {
            out.record(PathEvent::Emission(EmissionRecord {
                light: light.id,
                direction: path.ray.direction,
                scattering_pdf: prev.filter(|prev| !prev.is_delta).map_or(0.0, |prev| prev.pdf),
                light_pdf: light.pdf,
                weight,
                radiance: light.radiance,
            }));
        }
        let radiance = path.beta * light.radiance * weight;
        out.light(FoundLight::of(radiance, light.id, scene, path.depth));
    }
}

/// Calls `find` with each light that the ray of `path` hits: the emission of the surface `vertex`,
/// or each infinitely distant light if `vertex` is `None`.
pub(super) fn each_emission<A: Accel>(
    world: &World<A>,
    path: &PathState,
    vertex: Option<&Vertex>,
    find: impl FnMut(Incident),
) {
    match vertex {
        Some(vertex) => emitted(world, path, vertex).into_iter().for_each(find),
        None => {
            let lights = world
                .scene
                .escaped(world.light_selection, context(path), path.ray.direction);
            lights.for_each(find);
        }
    }
}

/// Emission of the surface `vertex` along the ray of `path`, if the surface emits light.
#[inline(always)]
pub(super) fn emitted<A: Accel>(world: &World<A>, path: &PathState, vertex: &Vertex) -> Option<Incident> {
    let ray = &path.ray;
    let segment = (vertex.point.p, ray.direction);
    world
        .scene
        .emitted(world.light_selection, &vertex.hit, &context(path), segment, ray.time)
}

/// Light sampling context of the vertex at the start of the ray of `path`. MIS uses this context
/// for light that the ray hits.
#[inline(always)]
fn context(path: &PathState) -> LightSampleContext {
    let prev = path.prev.as_ref();
    prev.map_or(LightSampleContext::any_side(path.ray.origin), |prev: &PrevVertex| {
        prev.from
    })
}

/// Number of light samples between two checks for cancellation, if all lamps are sampled.
pub(crate) const LIGHTS_BETWEEN_CHECKS: u32 = 64;

/// A light sample at a vertex, weighted against scattered rays. Its shadow ray is not traced yet.
///
/// A light sample is one of the two strategies for direct light (Veach 1997, §9.2). The other
/// strategy is the emission that a scattered ray hits.
pub(crate) struct Direct {
    ray: Ray,
    /// Unit direction to the light, local frame.
    wi: Vec3,
    light: LightId,
    /// Radiance that the vertex scatters if the light is not occluded, with the MIS weight and
    /// divided by the density.
    radiance: Spectrum,
}

impl Direct {
    /// Samples a light for `vertex`, as one of `count` samples that will be summed. The caller must
    /// trace the shadow ray ([`trace`]). If the light selection samples all lamps, all shadow rays
    /// are traced here, and the result is `None`.
    #[inline(always)]
    pub fn sample<A: Accel>(
        world: &World<A>,
        path: &PathState,
        vertex: &Vertex,
        strategy: &Strategy,
        count: u32,
        u: &LightNumbers<impl Sampler>,
        out: &mut impl Sink,
    ) -> Option<Self> {
        if !strategy.samples_lights() || vertex.bsdf.is_delta() {
            return None;
        }
        let selection = world.light_selection;
        if let Some(lamps) = selection.all() {
            for index in 0..lamps.samples() {
                if index % LIGHTS_BETWEEN_CHECKS == LIGHTS_BETWEEN_CHECKS - 1 && out.is_cancelled() {
                    break;
                }
                let (id, expected) = lamps.choose(index, u.choice);
                let expected = count as f32 * expected;
                let light = Self::of_light(world, vertex, strategy, id, expected, u.point_of(index), out);
                trace(light, world, path, vertex, out);
            }
            return None;
        }
        let (id, pmf) = selection.sample(world.scene.lights(), &vertex.light_context(), u.choice)?;
        Self::of_light(world, vertex, strategy, id, count as f32 * pmf, u.point, out)
    }

    /// Samples the light `id` at the vertex. `expected` is the expected number of samples of this
    /// light at the vertex.
    #[inline(always)]
    fn of_light<A: Accel>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        id: LightId,
        expected: f32,
        u: Vec2,
        out: &mut impl Sink,
    ) -> Option<Self> {
        let scene = world.scene;
        // Sample a direction to the light
        let (context, time) = (vertex.light_context(), vertex.point.time);
        let light = world
            .light_selection
            .sample_light(scene.lights(), id, &context, time, u, scene.textures())?;
        Self::of_sample(world, vertex, strategy, id, expected, &light, out)
    }

    /// Computes the BSDF and the MIS weight for `light`, a sample of the light `id`. Returns `None`
    /// if the BSDF is black. `expected` is the expected number of samples of this light at the
    /// vertex.
    #[inline(always)]
    pub(super) fn of_sample<A: Accel>(
        world: &World<A>,
        vertex: &Vertex,
        strategy: &Strategy,
        id: LightId,
        expected: f32,
        light: &LightSample,
        out: &mut impl Sink,
    ) -> Option<Self> {
        // Evaluate the BSDF times the cosine. If it is black, no shadow ray is needed.
        let wi = vertex.frame.to_local(light.wi);
        let (f, scattering_pdf) = strategy.directions.eval_pdf(vertex, wi);
        let f = f * wi.z.abs();
        if f.is_black() {
            return None;
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
        Some(Self {
            ray: ray.within(vertex.body_towards(wi)),
            wi,
            light: id,
            radiance: f * light.radiance * (weight / pdf),
        })
    }
}

/// Traces the shadow ray of the light sample `direct`, if there is one, and adds the light that
/// `vertex` scatters to the camera.
#[inline(always)]
pub(crate) fn trace<A: Accel>(
    direct: Option<Direct>,
    world: &World<A>,
    path: &PathState,
    vertex: &Vertex,
    out: &mut impl Sink,
) {
    let Some(direct) = direct else { return };
    let transmittance = world.transmittance(&direct.ray, out).color();
    if out.records() {
        out.record(PathEvent::Shadow { transmittance });
    }
    let event = out.separates_paths().then(|| vertex.event(direct.wi, false));
    out.light(FoundLight {
        radiance: direct.radiance * transmittance * path.beta,
        source: Some(LightSource::of(direct.light, world.scene)),
        scatterings: path.depth + 1,
        events: event.as_slice(),
    });
}
