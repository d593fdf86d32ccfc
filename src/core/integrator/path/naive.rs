use super::direct::emitted;
use super::state::PathState;
use crate::accel::Accel;
use crate::integrator::{Directions, Integrator, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Kajiya's path tracing by brute force: only emission that a path hits by chance counts (Kajiya
/// 1986). A random decision chooses between emission and reflection at a surface.
///
/// Each event has a separate probability, as in textbooks. The probabilities are options, so that
/// users can see how each one changes the noise. The path tracer instead multiplies its throughput
/// by these probabilities, which has less error.
#[derive(Debug)]
pub struct NaiveIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Sampling of directions.
    pub directions: Directions,
    /// Surfaces on which a random decision chooses between emission and reflection.
    pub emission_coin: EmissionCoin,
    /// Probability of emission in this decision, in (0, 1).
    pub emission_probability: f32,
    /// Treatment of absorption.
    pub absorption: Absorption,
    /// Maximum number of scattering events. `None`: only roulette ends paths.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
}

/// Surfaces on which a random decision chooses between emission and reflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmissionCoin {
    /// Only surfaces that emit and reflect.
    #[default]
    Emitters,
    /// All surfaces. If the decision is emission and the surface emits nothing, the path ends
    /// without light.
    EveryHit,
}

/// Treatment of absorption by surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Absorption {
    /// Absorption is a factor of the throughput. Lobes are chosen in proportion to the light that
    /// they reflect.
    #[default]
    Weight,
    /// Absorption is random: lobes are chosen by their albedos, and the path ends with the
    /// remaining probability (analog Monte Carlo).
    Chance,
}

impl<'a, A> NaiveIntegrator<'a, A> {
    /// Kajiya's original options: uniform directions, emission or reflection with probability 0.5
    /// on surfaces that emit and reflect, and absorption as a factor of the throughput.
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
        // Lights are not sampled, so emission that a ray hits has the weight 1.
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

            // Choose emission or reflection at random
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
            // Continue in a direction of that lobe
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let sample = self.directions.sample(&vertex, u_lobe, direction);
            let Some(sample) = sample else { return };
            let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
            let Some(factor) = self.roulette.play(depth, judged, decisions.y) else {
                return;
            };
            path = PathState {
                prev: None,
                ..path.after(path.scatter(world, &vertex, &sample, factor, 0, out))
            };
            // ANCHOR_END: reflect
        }
    }
}
