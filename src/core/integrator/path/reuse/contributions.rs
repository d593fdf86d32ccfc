//! Light that an end scatters, distributed to all pixels that see the end.

use super::end::End;
use super::viewers::{EndScattering, ViewerValues, Viewers, Workspace};
use crate::accel::Accel;
use crate::bsdf::{BsdfSample, ScatteringEvent};
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::found_light::LightSum;
use crate::integrator::listeners::SummingSink;
use crate::integrator::path::direct::{LIGHTS_BETWEEN_CHECKS, each_emission};
use crate::integrator::path::integrator::{PathIntegrator, PathNumbers, VertexNumbers};
use crate::integrator::path::state::{PathState, RayResult};
use crate::integrator::path::strategy::PrevVertex;
use crate::integrator::{FoundLight, PathEvent, RayKind, RaySink, SAMPLES_AT_ONCE, Sink, World, path_record};
use crate::light::{LightId, LightSample};
use crate::material::BsdfSlot;
use crate::math::{Vec2, Vec3};
use crate::sampler::{SampleKey, Sampler};

/// Minimum throughput that roulette assumes for a shared path.
const MIN_SHARED_BETA: f32 = 0.5;

/// Light that the end scatters to its viewers. Viewers are the first vertices that see the end.
#[derive(Default)]
struct Contributions {
    /// Light that the end scatters to every viewer alike.
    alike: Spectrum,
    /// Additional light for each viewer.
    each: [Spectrum; SAMPLES_AT_ONCE],
}

impl Contributions {
    /// Adds `light`, which arrives at the end. For each viewer, the light is multiplied by the
    /// factor of this viewer in `scattered`.
    #[inline(always)]
    fn add(&mut self, light: Spectrum, scattered: &EndScattering) {
        match &scattered.f {
            ViewerValues::Alike(f) => self.alike += light * *f,
            ViewerValues::Each(f) => {
                for (share, f) in self.each.iter_mut().zip(f) {
                    *share += light * *f;
                }
            }
        }
    }

    #[inline(always)]
    fn of(&self, viewer: usize) -> Spectrum {
        let mut share = self.alike;
        share += self.each[viewer];
        share
    }
}

impl<'v> End<'v> {
    /// Continues the path `owner`, which found the end, with the random numbers `numbers` of that
    /// path. Adds the light that the end scatters to each pixel whose first vertex sees the end.
    /// `work` is the workspace of the group.
    #[inline(always)]
    pub fn light_all<A: Accel, S: Sampler, O: Sink>(
        &self,
        path: &PathIntegrator<A>,
        numbers: PathNumbers<S>,
        work: &mut Workspace<'_, 'v>,
        owner: usize,
        out: &mut [O],
    ) {
        let (world, strategy) = (&path.world, &path.strategy);
        let u = numbers.vertex(self.depth, path.roulette);
        let mut contributions = Contributions::default();
        // Find the viewers only if light arrives, because many light samples are occluded.
        let mut viewers = None;

        // Sample lights
        if let Some(u) = u.light.as_ref().filter(|_| strategy.samples_lights()) {
            let mut add = |(id, expected): (LightId, f32), u: Vec2, out: &mut [O]| {
                let Some((light, wi, radiance)) = self.sample_light(world, id, u, &mut out[owner]) else {
                    return;
                };
                let viewers = viewers.get_or_insert_with(|| Viewers::find(self, owner, world, work, out));
                let scattered = viewers.scattered(self, work, wi);
                let pdf = expected * light.pdf;
                let weight = strategy.light_weight(pdf, light.is_delta, scattered.pdf);
                let radiance = radiance * (weight / pdf);
                contributions.add(radiance, &scattered);
                if out[owner].separates_parts() {
                    let light = FoundLight::of(radiance, id, world.scene, 0);
                    self.pass_part(light, &scattered, wi, viewers, work, out);
                }
            };
            let selection = world.light_selection;
            match selection.all() {
                Some(lamps) => {
                    for index in 0..lamps.samples() {
                        if index % LIGHTS_BETWEEN_CHECKS == LIGHTS_BETWEEN_CHECKS - 1 && out[owner].is_cancelled() {
                            break;
                        }
                        add(lamps.choose(index, u.choice), u.point_of(index), out);
                    }
                }
                None => {
                    let light = selection.sample(world.scene.lights(), &self.vertex.light_context(), u.choice);
                    light.into_iter().for_each(|light| add(light, u.point, out));
                }
            }
        }

        // Sample the BSDF, and follow the path
        let u_lobe = u.lobe(self.vertex.bsdf);
        let sample = strategy.directions.sample(&self.vertex, u_lobe, u.direction);
        if let Some((sample, factor, next)) = sample.and_then(|sample| self.play(path, &sample, &u)) {
            let own = &mut out[owner];
            path_record::scatter(self.depth, &self.vertex, &sample, factor, own);
            if own.records() {
                own.record(PathEvent::SharedPath);
            }
            let traced = world.intersect(&next.ray, RayKind::Bounce, own);
            let mut rest = SummingSink::new(next.depth, own);
            path.li(next, Some(traced), numbers, &mut rest);
            // Sum of the light scattered behind the end, and the emission that the ray hits
            let mut light = rest.sum;
            if sample.is_delta() {
                // No other path finds this light, so it is added only to the owner.
                light = path.add_emitted(&next, traced, sample.pdf, light, own);
                self.record_contribution(numbers.key, own);
                light.pass_on(self.beta * sample.weight * factor, self.depth + 2, own);
            } else if !light.radiance.is_black() || path.finds_emission(&next, traced) {
                let viewers = viewers.get_or_insert_with(|| Viewers::find(self, owner, world, work, out));
                let scattered = viewers.scattered(self, work, sample.wi);
                light = path.add_emitted(&next, traced, scattered.pdf, light, &mut out[owner]);
                if scattered.pdf > 0.0 {
                    let factor = factor / scattered.pdf;
                    contributions.add(light.radiance * factor, &scattered);
                    for part in light.parts() {
                        let part = FoundLight {
                            radiance: part.radiance * factor,
                            ..part.light()
                        };
                        self.pass_part(part, &scattered, sample.wi, viewers, work, out);
                    }
                }
            }
        }

        // Add the scattered light to the pixel of each viewer
        let Some(viewers) = viewers else { return };
        for (i, candidate) in viewers.of(work).iter().enumerate() {
            let share = contributions.of(i) * (candidate.beta * (1.0 / viewers.pdf));
            let out = &mut out[candidate.index];
            self.record_contribution(numbers.key, out);
            out.light(FoundLight::sum(share, self.depth + 1));
        }
    }

    /// Passes the light `light` of one source to the sink of each viewer. The light arrives at the
    /// end from the direction `wi` (local frame).
    #[inline(never)]
    fn pass_part(
        &self,
        light: FoundLight,
        scattered: &EndScattering,
        wi: Vec3,
        viewers: &Viewers,
        work: &Workspace<'_, 'v>,
        out: &mut [impl Sink],
    ) {
        for (i, candidate) in viewers.of(work).iter().enumerate() {
            let out = &mut out[candidate.index];
            let f = match &scattered.f {
                ViewerValues::Alike(f) => *f,
                ViewerValues::Each(f) => f[i],
            };
            let (before, events) = if out.separates_paths() {
                viewers.events(self, work, i, wi)
            } else {
                (self.depth, Vec::new())
            };
            let events: Vec<ScatteringEvent> = events.into_iter().chain(light.events.iter().copied()).collect();
            out.part(FoundLight {
                radiance: light.radiance * f * (candidate.beta * (1.0 / viewers.pdf)),
                scatterings: (before + events.len() as u32).max(2),
                events: &events,
                ..light
            });
        }
    }

    /// Records that the next added light comes from the end. `owner` is the sample whose path found
    /// the end.
    #[inline(always)]
    fn record_contribution(&self, owner: SampleKey, out: &mut impl RaySink) {
        if out.records() {
            out.record(PathEvent::Shared {
                owner: [owner.x, owner.y],
                p: self.vertex.point.p,
            });
        }
    }

    /// Samples the light `id` at the end and traces the shadow ray. Returns the light sample, its
    /// direction in the local frame, and the arriving radiance. `None` if no light arrives.
    #[inline(always)]
    fn sample_light<A: Accel>(
        &self,
        world: &World<A>,
        id: LightId,
        u: Vec2,
        out: &mut impl Sink,
    ) -> Option<(LightSample, Vec3, Spectrum)> {
        let vertex = &self.vertex;
        let (lights, textures) = (world.scene.lights(), world.scene.textures());
        let (context, time) = (vertex.light_context(), vertex.point.time);
        let light = world
            .light_selection
            .sample_light(lights, id, &context, time, u, textures)?;
        let wi = vertex.frame.to_local(light.wi);
        if light.radiance.is_black() || (wi.z * vertex.wo.z <= 0.0 && !vertex.bsdf.is_transmitting()) {
            return None;
        }
        let ray = light
            .shadow_ray(world.origin(vertex, wi, light.wi))
            .when(vertex.point.time);
        let ray = ray.within(vertex.body_towards(wi));
        let arrives = world.transmittance(&ray, out);
        (!arrives.is_blocked()).then(|| (light, wi, light.radiance * arrives.color()))
    }

    /// Plays roulette before the path continues in the direction of `sample`. Returns `sample`, the
    /// factor that compensates for terminated paths, and the state of the path behind the end, with
    /// throughput 1. `None` if the path ends.
    #[inline(always)]
    fn play<A: Accel, S: Sampler>(
        &self,
        path: &PathIntegrator<A>,
        sample: &BsdfSample,
        u: &VertexNumbers<S>,
    ) -> Option<(BsdfSample, f32, PathState)> {
        let eta = sample.eta * sample.eta;
        let scale = if sample.is_delta() {
            self.beta * self.roulette_scale * eta
        } else {
            // Roulette uses the throughput of the pixel that traces the path, with a minimum for
            // dark pixels.
            self.roulette_scale * (self.beta.max_component().max(MIN_SHARED_BETA) * eta)
        };
        let factor = path.roulette.play(self.depth, sample.weight * scale, u.roulette)?;
        let next = PathState {
            depth: self.depth + 1,
            roulette_scale: sample.weight * factor * scale,
            prev: Some(PrevVertex::new(&self.vertex, sample, 1)),
            skips_emission: true,
            ..PathState::new(path.world.ray_along(&self.vertex, sample.wi))
        };
        Some((*sample, factor, next))
    }
}

impl<A: Accel> PathIntegrator<'_, A> {
    /// Returns `true` if the ray of `path` hits emission. `traced` is the result of the ray query.
    #[inline(always)]
    fn finds_emission(&self, path: &PathState, (hit, _): RayResult) -> bool {
        let scene = self.world.scene;
        match hit {
            Some(hit) => scene.shape(hit.geom).first_light.is_some() && self.is_emitting(path, Some(hit)),
            None => scene.has_infinite_lights() && self.is_emitting(path, None),
        }
    }

    #[inline(never)]
    fn is_emitting(&self, path: &PathState, hit: Option<Hit>) -> bool {
        let slot = BsdfSlot::new();
        let mut is_found = false;
        let vertex = hit.map(|hit| self.world.vertex(&hit, &path.ray, None, &slot));
        each_emission(&self.world, path, vertex.as_ref(), |light| {
            is_found |= !light.radiance.is_black();
        });
        is_found
    }

    /// Returns the sum of `light` and the emission that the ray of `path` hits. `traced` is the
    /// result of the ray query, and `pdf` is the density with which the direction of the ray was
    /// sampled.
    #[inline(always)]
    fn add_emitted(
        &self,
        path: &PathState,
        traced: RayResult,
        pdf: f32,
        light: LightSum,
        out: &mut impl Sink,
    ) -> LightSum {
        if self.finds_emission(path, traced) {
            self.with_emission(path, traced, pdf, light, out)
        } else {
            light
        }
    }

    #[inline(never)]
    fn with_emission(
        &self,
        path: &PathState,
        (hit, transmittance): RayResult,
        pdf: f32,
        light: LightSum,
        out: &mut impl Sink,
    ) -> LightSum {
        let slot = BsdfSlot::new();
        let vertex = hit.map(|hit| self.world.vertex(&hit, &path.ray, None, &slot));
        let path = PathState {
            beta: transmittance,
            prev: path.prev.map(|prev| PrevVertex { pdf, ..prev }),
            skips_emission: false,
            ..*path
        };
        let mut sum = SummingSink::new(path.depth, out);
        sum.sum = light;
        self.strategy.add_found(&self.world, &path, vertex.as_ref(), &mut sum);
        sum.sum
    }
}
