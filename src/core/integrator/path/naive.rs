use super::direct::emitted;
use super::state::PathState;
use crate::accel::Accel;
use crate::integrator::{Directions, Integrator, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Kajiya's path tracing by brute force: light counts only where a path happens to meet it (Kajiya 1986). A surface emits or reflects, by the flip of a
/// coin.
///
/// Its probabilities are those of textbooks, where each event has a chance of its own. They are free, so that their cost can be seen; the path tracer
/// keeps them as factors of its throughput, which has less error.
#[derive(Debug)]
pub struct NaiveIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How directions are drawn.
    pub directions: Directions,
    /// Where the coin is flipped that decides between emission and reflection.
    pub emission_coin: EmissionCoin,
    /// Probability that the coin chooses emission, in (0, 1).
    pub emission_probability: f32,
    /// How absorption counts.
    pub absorption: Absorption,
    /// Maximum number of scattering events; `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
}

/// Where a coin decides between emission and reflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmissionCoin {
    /// On surfaces that do both.
    #[default]
    Emitters,
    /// On all surfaces: where the coin chooses the emission of a surface that has none, the path ends without light.
    EveryHit,
}

/// How the light counts that surfaces absorb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Absorption {
    /// As a factor of the throughput; lobes are chosen by their shares of what is reflected.
    #[default]
    Weight,
    /// By chance: lobes are chosen by their albedos, and the path ends with the probability that remains (analog Monte Carlo).
    Chance,
}

impl<'a, A> NaiveIntegrator<'a, A> {
    /// Kajiya's own: uniform directions, a fair coin where a surface emits and reflects, and absorption as a weight.
    pub fn new(world: World<'a, A>, max_depth: Option<u32>, roulette: Roulette) -> Self {
        Self {
            world,
            directions: Directions::Uniform,
            emission_coin: EmissionCoin::Emitters,
            emission_probability: 0.5,
            absorption: Absorption::Weight,
            max_depth,
            roulette,
        }
    }
}

impl<A: Accel> Integrator for NaiveIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        // No light is sampled: what a ray finds counts in full.
        let (world, strategy) = (&self.world, Strategy::default());
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        let wavelength = world.wavelength(sampler);

        loop {
            let depth = path.depth;
            let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
            let slot = BsdfSlot::new();
            let Some(vertex) = path.next_vertex(world, wavelength.as_ref(), &slot, out) else {
                return strategy.add_sky(world, &path, out);
            };

            // Emit or reflect, by the flip of a coin
            let emitted = emitted(world, &path, &vertex).filter(|light| !light.radiance.is_black());
            let reflects = self.max_depth.is_none_or(|max| depth < max) && !vertex.bsdf.albedo().is_black();
            let probability = match (reflects, self.emission_coin, emitted) {
                (false, ..) => 1.0,
                (true, EmissionCoin::Emitters, None) => 0.0,
                (true, ..) => self.emission_probability,
            };
            // ANCHOR: emit
            if decisions.x < probability {
                path.beta = path.beta / probability;
                return strategy.add_emission(world, &path, &vertex, out);
            }
            path.beta = path.beta / (1.0 - probability);
            // ANCHOR_END: emit

            // Choose a lobe, or absorption
            let mut u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            if self.absorption == Absorption::Chance {
                let albedo = vertex.bsdf.albedo().max_component().min(1.0);
                if u_lobe >= albedo {
                    return;
                }
                u_lobe /= albedo;
                path.beta = path.beta / albedo;
            }

            // ANCHOR: reflect
            // Go on in a direction of that lobe
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let sample = self.directions.sample(&vertex, u_lobe, direction);
            let Some(sample) = sample else { return };
            let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
            let Some(factor) = self.roulette.play(depth, judged, decisions.y) else {
                return;
            };
            path = PathState {
                prev: None,
                ..path.after(path.scatter(world, &vertex, &sample, (factor, 0), out))
            };
            // ANCHOR_END: reflect
        }
    }
}
