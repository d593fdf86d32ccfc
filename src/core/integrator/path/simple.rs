//! Path tracing in its shortest form. Read this module first.
//!
//! The radiance along a ray is the light that the surface emits, plus the light that it scatters
//! (Kajiya 1986): `L = Le + ∫ f L cos θ dω`. A path estimates the integral by one random direction
//! at each surface. The light of lamps is sampled separately, by a random point of a lamp, because
//! few random directions find a lamp.
//!
//! There are no MIS weights and no roulette: `integrator` adds both, and has far less error in the
//! same time. This integrator cannot be selected in renders; tests compare it with `path`.

use super::direct::LightNumbers;
use super::state::PathState;
use crate::accel::Accel;
use crate::integrator::{DirectLight, Directions, Heuristic, Integrator, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Path tracing without MIS weights and without roulette.
#[derive(Debug)]
pub struct SimpleIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events of a path.
    pub max_depth: u32,
}

/// Lamps are sampled. Emission that a ray hits counts only on camera rays and on rays that leave a
/// delta lobe, for which lamps cannot be sampled.
const SAMPLED: Strategy = Strategy {
    directions: Directions::Bsdf,
    direct: DirectLight::Light,
    heuristic: Heuristic::Power,
};

impl<A: Accel> Integrator for SimpleIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        loop {
            // Add Le: the emitted radiance of the next surface, or of the sky
            let slot = BsdfSlot::new();
            let vertex = path.next_vertex(world, None, &slot, out);
            SAMPLED.add_found(world, &path, vertex.as_ref(), out);
            let Some(vertex) = vertex else { return };
            if path.depth == self.max_depth {
                return;
            }

            // Sample the light of a lamp: a random point on a random lamp, and a shadow ray
            let u = LightNumbers::draw(&*sampler, path.depth);
            SAMPLED.add_direct_light(world, &path, &vertex, &u, out);

            // Sample all other light by a random direction. Multiply the throughput by f cos θ /
            // pdf
            let u_lobe = sampler.get_1d(Dimension::bounce(path.depth, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(path.depth, Bounce::Direction));
            let Some(sample) = vertex.sample(u_lobe, u) else { return };
            path.advance(path.scatter(world, &vertex, &sample, 1.0, 1, out));
        }
    }
}
