//! Trees of rays, of `whitted` and `distributed`: several rays leave a vertex, and each is a branch.

use super::direct::{Direct, LightNumbers};
use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::Sampler;

/// A ray of the tree.
pub(super) struct Branch {
    pub ray: Ray,
    /// Scattering events before it.
    pub depth: u32,
    /// Number in the tree, which names the random numbers of the vertex at its end.
    pub node: u32,
    /// Throughput.
    pub beta: Spectrum,
}

impl Branch {
    /// The root: a ray from the camera.
    pub fn from_camera(ray: Ray) -> Self {
        Self {
            ray,
            depth: 0,
            node: 0,
            beta: Spectrum::ONE,
        }
    }

    /// Adds emission and direct light at the end of the branch, which comes from `prev`, as along a path, and lets `go_on` follow the branches that leave
    /// the vertex there, to which it gives the throughput. Past `max_depth` scattering events there is emission alone.
    pub fn follow<A: Accel, O: Sink>(
        &self,
        (world, strategy): (&World<A>, &Strategy),
        prev: Option<&PrevVertex>,
        max_depth: Option<u32>,
        sampler: &impl Sampler,
        out: &mut O,
        go_on: impl FnOnce(&Vertex, Spectrum, &mut O),
    ) {
        if out.is_cancelled() {
            return;
        }
        let (slot, mut beta) = (BsdfSlot::new(), self.beta);
        let met = strategy.arrive(world, (&self.ray, self.depth), prev, &mut beta, &slot, out);
        let Some((_, vertex)) = &met else { return };
        if max_depth.is_some_and(|max| self.depth >= max) {
            return;
        }
        let u = LightNumbers::draw(sampler, self.node);
        let direct = Direct::sample(world, vertex, strategy, 1, &u, out).arrives(world, out);
        out.radiance(direct * beta);
        go_on(vertex, beta, out);
    }
}
