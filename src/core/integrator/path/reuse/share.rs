//! What an end scatters, shared among all pixels that see it.

use super::end::End;
use super::viewers::{ForViewers, Scattered, Viewers, Workspace};
use crate::accel::Accel;
use crate::bsdf::{BsdfSample, ScatteringEvent};
use crate::color::Spectrum;
use crate::film::LightPaths;
use crate::integrator::path::direct::LIGHTS_A_LOOK;
use crate::integrator::path::integrator::{PathIntegrator, PathStart, VertexNumbers};
use crate::integrator::path::strategy::PrevVertex;
use crate::integrator::path_record;
use crate::integrator::trail::seen_after;
use crate::integrator::{Gathered, PathEvent, RaySink, SAMPLES_AT_ONCE, Sink, World};
use crate::light::{LightId, LightSample};
use crate::math::{Vec2, Vec3};
use crate::sampler::{SampleKey, Sampler};

/// Minimum throughput that roulette assumes for a shared path.
const MIN_SHARED_BETA: f32 = 0.5;

/// Light that the end scatters to its viewers.
#[derive(Default)]
struct Shares<R> {
    /// To all of them.
    alike: R,
    /// To each of them besides.
    each: [R; SAMPLES_AT_ONCE],
}

impl<R: Gathered> Shares<R> {
    /// Adds `light` that is scattered to each viewer, for whom it is the event `event`.
    #[inline(always)]
    fn add(
        &mut self,
        light: R,
        scattered: &Scattered,
        event: impl Fn(usize) -> ScatteringEvent,
        paths: Option<&LightPaths>,
    ) {
        match &scattered.f {
            ForViewers::Alike(f) => self.alike.add_scattered(&light, *f, || event(0), paths),
            ForViewers::Each(f) => {
                for (i, (share, f)) in self.each.iter_mut().zip(f).enumerate() {
                    share.add_scattered(&light, *f, || event(i), paths);
                }
            }
        }
    }

    #[inline(always)]
    fn of(&self, viewer: usize) -> R {
        let mut share = self.alike;
        share += self.each[viewer];
        share
    }
}

impl<'v> End<'v> {
    /// Follows the path from here and gives each path whose first vertex sees the end its share of the light that is scattered here. `start` is that of
    /// the path `owner`, which has found the end; `work` is that of its group. The shares go to the sinks, or into `indirect` if there is one.
    #[inline(always)]
    pub fn light_all<A: Accel, S: Sampler, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        start: &PathStart<S>,
        work: &mut Workspace<'_, 'v>,
        owner: usize,
        (out, mut indirect): (&mut [impl Sink<Radiance = R>], Option<&mut [R; SAMPLES_AT_ONCE]>),
    ) {
        let (world, strategy) = (&path.world, &path.strategy);
        let u = VertexNumbers::draw(start.sampler, self.depth, path.roulette);
        let mut shares = Shares::default();
        // Many light samples are occluded: the viewers are found once light arrives.
        let mut viewers = None;

        // Sample lights
        if let Some(u) = u.light.as_ref().filter(|_| strategy.samples_lights()) {
            let mut add = |(id, expected): (LightId, f32), u: Vec2, out: &mut [_]| {
                let Some((light, wi, radiance)) = self.sample_light(world, id, u, &mut out[owner]) else {
                    return;
                };
                let viewers = viewers.get_or_insert_with(|| Viewers::find(self, owner, world, work, out));
                let scattered = viewers.scattered(self, work, wi);
                let pdf = expected * light.pdf;
                let weight = strategy.light_weight(pdf, light.is_delta, scattered.pdf);
                let light = R::of_light(radiance * (weight / pdf), id, world.scene);
                shares.add(light, &scattered, |i| viewers.event(self, work, i, wi), world.paths);
            };
            let selection = world.scene.light_selection();
            match selection.all() {
                Some(lamps) => {
                    for index in 0..lamps.samples() {
                        if index % LIGHTS_A_LOOK == LIGHTS_A_LOOK - 1 && out[owner].is_cancelled() {
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
        if let Some((sample, factor, next)) = sample.and_then(|sample| self.play(path, &sample, start, &u)) {
            path_record::scatter(self.depth, &self.vertex, &sample, factor, &mut out[owner]);
            if out[owner].records() {
                out[owner].record(PathEvent::SharedPath);
            }
            let next = next.traced(world, &mut out[owner]);
            let radiance = path.radiance(&next, &mut out[owner]);
            // Light emitted where the ray ends, and light scattered there
            let (emitted, scattered) = match radiance.has_tail {
                true => (radiance.head, radiance.tail),
                false => (radiance.tail, R::default()),
            };
            if sample.is_delta() {
                // No other path finds it.
                let light = radiance.sum() * (self.beta * sample.weight * factor);
                let light = light.scattered(|| self.vertex.event(sample.wi, true), world.paths);
                let light = seen_after(light, &self.events, world.paths);
                self.record_share(start.key, &mut out[owner]);
                match &mut indirect {
                    None => out[owner].radiance(light),
                    Some(indirect) => indirect[owner] += light,
                }
            } else if !emitted.sum().is_black() || !scattered.sum().is_black() {
                let viewers = viewers.get_or_insert_with(|| Viewers::find(self, owner, world, work, out));
                let for_viewers = viewers.scattered(self, work, sample.wi);
                let mut light = scattered;
                if !emitted.sum().is_black() {
                    let prev = PrevVertex {
                        pdf: for_viewers.pdf,
                        ..PrevVertex::new(&self.vertex, &sample, 1)
                    };
                    light += next.emitted(world, strategy, &prev);
                }
                if for_viewers.pdf > 0.0 {
                    let event = |i| viewers.event(self, work, i, sample.wi);
                    shares.add(light * (factor / for_viewers.pdf), &for_viewers, event, world.paths);
                }
            }
        }

        // Shares of all viewers
        let Some(viewers) = viewers else { return };
        for (i, candidate) in viewers.of(work).iter().enumerate() {
            let share = candidate.seen(shares.of(i), work, world.paths) * (candidate.beta * (1.0 / viewers.pdf));
            self.record_share(start.key, &mut out[candidate.index]);
            match &mut indirect {
                None => out[candidate.index].radiance(share),
                Some(indirect) => indirect[candidate.index] += share,
            }
        }
    }

    /// Records that light of the end, which the path of the sample `owner` has found, is added next.
    #[inline(always)]
    fn record_share(&self, owner: SampleKey, out: &mut impl RaySink) {
        if out.records() {
            out.record(PathEvent::Shared {
                owner: [owner.x, owner.y],
                p: self.vertex.point.p,
            });
        }
    }

    /// Samples the light `id`: the sample, its direction in the local frame, and the radiance that arrives; `None` if none does.
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
        let to = (&vertex.light_context(), vertex.point.time);
        let light = world
            .scene
            .light_selection()
            .sample_light(lights, id, to, u, textures)?;
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

    /// Plays roulette before the path goes on by `sample`: what makes up for the paths that end, and the start of the rest.
    #[inline(always)]
    fn play<'s, A: Accel, S: Sampler>(
        &self,
        path: &PathIntegrator<A>,
        sample: &BsdfSample,
        start: &PathStart<'s, S>,
        u: &VertexNumbers<S>,
    ) -> Option<(BsdfSample, f32, PathStart<'s, S>)> {
        let eta = sample.eta * sample.eta;
        let scale = match sample.is_delta() {
            true => self.beta * self.roulette_scale * eta,
            // Roulette goes by the pixel that follows the path, as long as that is not a dark one.
            false => self.roulette_scale * (self.beta.max_component().max(MIN_SHARED_BETA) * eta),
        };
        let factor = path.roulette.play(self.depth, sample.weight * scale, u.roulette)?;
        let next = PathStart {
            key: start.key,
            sampler: start.sampler,
            ray: path.world.ray_along(&self.vertex, sample.wi),
            hit: None,
            tint: Spectrum::ONE,
            depth: self.depth + 1,
            tail_depth: self.depth + 1,
            roulette_scale: sample.weight * factor * scale,
        };
        Some((*sample, factor, next))
    }
}
