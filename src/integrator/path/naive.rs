use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::trail::Trail;
use crate::integrator::{Directions, Gathered, Integrator, RayKind, Roulette, Sink, Strategy, World};
use crate::light::LightSampleContext;
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Kajiya's path tracing by brute force: directions uniform over the hemisphere, light only where a path happens to meet it
/// (Kajiya 1986). A surface that emits and reflects does one of the two, by the flip of a coin.
#[derive(Debug)]
pub struct NaiveIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events; `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
}

impl<A: Accel> Integrator for NaiveIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.follow(key, sampler, out);
    }
}

impl<A: Accel> NaiveIntegrator<'_, A> {
    /// Follows the path of the sample `key`.
    fn follow<R: Gathered>(&self, key: SampleKey, sampler: &mut impl Sampler, out: &mut impl Sink<Radiance = R>) {
        let mut trail = Trail::<R>::new();
        let world = &self.world;
        let mut ray = world.camera_ray(key, None, sampler, out);
        let mut beta = Spectrum::ONE;
        let mut eta_squared = 1.0;

        for depth in 0.. {
            let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let Some(hit) = world.intersect(&ray, kind, &mut beta, out) else {
                if depth == 0 && world.see_background(&ray, beta, out) {
                    return;
                }
                Strategy::default().emitted(world.scene, &ray, None, beta, None, |light: R| {
                    out.radiance(trail.arriving(light, world.paths));
                });
                return;
            };
            let slot = BsdfSlot::new();
            let vertex = world.vertex(&hit, &ray, &slot);
            if depth == 0 {
                world.see((&hit, &vertex), (&ray, beta), false, out);
            }

            // Emit or reflect: certain where one of them is nothing, else a coin decides.
            let emitted = world.scene.emitted(
                &hit,
                &LightSampleContext::any_side(ray.origin),
                vertex.point.p,
                ray.direction,
                ray.time,
            );
            let emitted = emitted.filter(|light| !light.radiance.is_black());
            let reflects = self.max_depth.is_none_or(|max| depth < max) && !vertex.bsdf.albedo().is_black();
            let chance = match (emitted, reflects) {
                (None, false) => return,
                (Some(_), true) => 0.5,
                _ => 1.0,
            };
            if let (Some(light), true) = (emitted, !reflects || decisions.x < 0.5) {
                let radiance = beta * light.radiance / chance;
                let light = R::of_light(radiance, light.id, world.scene);
                out.radiance(trail.arriving(light, world.paths));
                return;
            }
            beta = beta / chance;

            // On in a uniform direction
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let sample = Directions::Uniform.sample(&vertex, u_lobe, direction);
            let Some(sample) = sample else { return };
            if R::TELLS_PATHS {
                trail.go_on(vertex.event(sample.wi, sample.is_delta()));
            }
            beta *= sample.weight;
            eta_squared *= sample.eta * sample.eta;
            let Some(factor) = self.roulette.play(depth, beta * eta_squared, decisions.y) else {
                return;
            };
            beta *= factor;
            ray = vertex.ray_along(sample.wi);
        }
    }
}
