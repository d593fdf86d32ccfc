//! Trees of rays for `whitted` and `distributed`: several rays leave a vertex. Each of these rays
//! is a branch.

use super::direct::LightNumbers;
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
        world: &World<A>,
        strategy: &Strategy,
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
        let Some(vertex) = strategy.next_vertex(world, &mut path, wavelength.as_ref(), &slot, out) else {
            return;
        };
        if max_depth.is_some_and(|max| path.depth >= max) {
            return;
        }
        let u = LightNumbers::draw(sampler, self.node);
        strategy.add_direct_light(world, &path, &vertex, &u, out);
        continue_path(&vertex, &path, out);
    }
}
