//! Trees of rays for `whitted` and `distributed`: several rays leave a vertex. Each of these rays
//! is a branch.

use super::direct::{Direct, LightNumbers, trace};
use super::state::PathState;
use crate::accel::Accel;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::Sampler;

/// A branch of a tree of rays.
pub(super) struct Branch {
    /// Path from the camera whose last ray is the branch.
    pub path: PathState,
    /// Index of the branch in the tree. It selects the random numbers of the vertex at the end of
    /// the branch.
    pub node: u32,
}

impl Branch {
    /// The root of the tree: a ray from the camera.
    pub fn from_camera(ray: Ray) -> Self {
        Self {
            path: PathState::new(ray),
            node: 0,
        }
    }

    /// Adds emission and direct light at the vertex at the end of the branch. Then calls
    /// `continue_path` with the vertex and the path, to follow the next branches. After `max_depth`
    /// scattering events only emission is added.
    pub fn follow<A: Accel, O: Sink>(
        self,
        (world, strategy): (&World<A>, &Strategy),
        max_depth: Option<u32>,
        sampler: &impl Sampler,
        out: &mut O,
        continue_path: impl FnOnce(&Vertex, &PathState, &mut O),
    ) {
        if out.is_cancelled() {
            return;
        }
        let (slot, mut path) = (BsdfSlot::new(), self.path);
        let wavelength = world.wavelength(sampler);
        let vertex = path.next_vertex(world, wavelength.as_ref(), &slot, out);
        strategy.add_found(world, &path, vertex.as_ref(), out);
        let Some(vertex) = vertex else { return };
        if max_depth.is_some_and(|max| path.depth >= max) {
            return;
        }
        let u = LightNumbers::draw(sampler, self.node);
        let direct = Direct::sample(world, (&path, &vertex), strategy, 1, &u, out);
        trace(direct, world, (&path, &vertex), out);
        continue_path(&vertex, &path, out);
    }
}
