use super::direct::LightNumbers;
use super::state::PathState;
use crate::accel::Accel;
use crate::integrator::{DirectLight, Integrator, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Path tracing with one sample of direct or indirect light at each vertex. A random decision
/// chooses between the two, and the sample is divided by the probability of the choice.
///
/// Direct light comes from light sampling and ends the path, so no roulette is needed. Indirect
/// light comes from the next vertex. The emission of that vertex is already counted as direct
/// light, so it is added only along a delta lobe.
#[derive(Debug)]
pub struct OneSampleIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Probability of direct light, in (0, 1).
    pub direct_probability: f32,
    /// Maximum number of scattering events. `None`: only the choice of direct light ends paths.
    pub max_depth: Option<u32>,
}

impl<A: Accel> Integrator for OneSampleIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        let wavelength = world.wavelength(sampler);

        loop {
            // Find the next surface. Add its emission if the previous vertex did not sample lights
            let depth = path.depth;
            let slot = BsdfSlot::new();
            let Some(vertex) = strategy.next_vertex(world, &mut path, wavelength.as_ref(), &slot, out) else {
                return;
            };
            if self.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Choose direct or indirect light at random. Choose indirect light for delta lobes, for
            // which lights cannot be sampled
            let probability = if vertex.bsdf.is_delta() {
                0.0
            } else {
                self.direct_probability
            };
            let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
            if decisions.y < probability {
                let u = LightNumbers::with_choice(&*sampler, depth, decisions.x);
                path.beta = path.beta / probability;
                strategy.add_direct_light(world, &path, &vertex, &u, out);
                return;
            }

            // Continue the path for indirect light
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(&vertex, u_lobe, direction) else {
                return;
            };
            path.advance(path.scatter(world, &vertex, &sample, 1.0 / (1.0 - probability), 1, out));
        }
    }
}
