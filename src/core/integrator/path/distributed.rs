use super::tree::Branch;
use crate::accel::Accel;
use crate::integrator::{Integrator, Sink, Strategy, World};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Monte Carlo ray tracing with branches: several rays leave every vertex (Cook et al. 1984). The
/// expected image equals the image of path tracing. The number of rays is about `branching` to the
/// power of the depth.
#[derive(Debug)]
pub struct DistributedIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Sampling of directions and of direct light.
    pub strategy: Strategy,
    /// Maximum number of scattering events of a branch. There is no roulette.
    pub max_depth: u32,
    /// Number of rays from each vertex, ≥ 1.
    pub branching: u32,
}

impl<A: Accel> Integrator for DistributedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let ray = self.world.camera_ray(key, None, sampler, out);
        self.follow(Branch::from_camera(ray), sampler, out);
    }
}

impl<A: Accel> DistributedIntegrator<'_, A> {
    /// Traces `branch` and all branches that follow it. The nodes of the tree of rays are numbered
    /// breadth first.
    fn follow(&self, branch: Branch, sampler: &impl Sampler, out: &mut impl Sink) {
        let (world, parent) = (&self.world, branch.node);
        branch.follow(
            world,
            &self.strategy,
            Some(self.max_depth),
            sampler,
            out,
            |vertex, path, out| {
                // Trace several rays instead of one
                for i in 1..=self.branching {
                    let node = parent.wrapping_mul(self.branching).wrapping_add(i);
                    let u_lobe = sampler.get_1d(Dimension::bounce(node, Bounce::Lobe));
                    let u = sampler.get_2d(Dimension::bounce(node, Bounce::Direction));
                    let sample = self.strategy.directions.sample(vertex, u_lobe, u);
                    let Some(sample) = sample.filter(|sample| !(path.beta * sample.weight).is_black()) else {
                        continue;
                    };
                    let path = path.after(path.scatter(world, vertex, &sample, 1.0 / self.branching as f32, 1, out));
                    self.follow(Branch { path, node }, sampler, out);
                }
            },
        );
    }
}
