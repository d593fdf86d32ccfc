use super::direct::{Direct, LightNumbers};
use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::path_record;
use crate::integrator::{DirectLight, Integrator, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Path tracing in which each vertex takes one sample of direct plus indirect light: a coin chooses which, and its probability divides the sample.
///
/// Direct light comes from light sampling and ends the path, so no roulette is needed. Indirect light comes from the next vertex; what that emits has
/// been counted as direct light, but where it is met along a delta lobe.
#[derive(Debug)]
pub struct OneSampleIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Probability of direct light, in (0, 1).
    pub direct_probability: f32,
    /// Maximum number of scattering events; `None` leaves the end to the coin.
    pub max_depth: Option<u32>,
}

impl<A: Accel> Integrator for OneSampleIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let mut ray = world.camera_ray(key, None, sampler, out);
        let mut beta = Spectrum::ONE;
        let mut prev: Option<PrevVertex> = None;

        for depth in 0.. {
            // Intersect the ray with the scene, and add light that no light sample has counted
            let slot = BsdfSlot::new();
            let met = strategy.arrive(world, (&ray, depth), prev.as_ref(), &mut beta, &slot, out);
            let Some((_, vertex)) = &met else { return };
            if self.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Direct or indirect light, by the flip of a coin; lights cannot be sampled for delta lobes
            let probability = match vertex.bsdf.is_delta() {
                true => 0.0,
                false => self.direct_probability,
            };
            let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
            if decisions.y < probability {
                let u = LightNumbers::with_choice(&*sampler, depth, decisions.x);
                let direct = Direct::sample(world, vertex, &strategy, 1, &u, out).arrives(world, out);
                out.radiance(direct * (beta / probability));
                return;
            }

            // Indirect light
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(vertex, u_lobe, direction) else {
                return;
            };
            path_record::scatter(depth, vertex, &sample, 1.0 / (1.0 - probability), out);
            beta = beta * sample.weight / (1.0 - probability);
            prev = Some(PrevVertex::new(vertex, &sample, 1));
            ray = world.ray_along(vertex, sample.wi);
        }
    }
}
