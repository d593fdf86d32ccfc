use super::strategy::PrevVertex;
use super::tree::Branch;
use crate::accel::Accel;
use crate::integrator::path_record;
use crate::integrator::{Integrator, Sink, Strategy, World};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Monte Carlo ray tracing that branches: every vertex sends out several rays (Cook et al. 1984). The mean is that of path
/// tracing; the number of rays grows as a power of the depth.
#[derive(Debug)]
pub struct DistributedIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How directions are drawn and direct light is found.
    pub strategy: Strategy,
    /// Maximum number of scattering events; there is no roulette.
    pub max_depth: u32,
    /// Number of rays that leave each vertex, ≥ 1.
    pub branching: u32,
}

impl<A: Accel> Integrator for DistributedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let root = Branch::from_camera(self.world.camera_ray(key, None, sampler, out));
        self.follow(&root, None, sampler, out);
    }
}

impl<A: Accel> DistributedIntegrator<'_, A> {
    /// Follows `branch`, which comes from `prev`; `None` at the camera. Nodes are numbered breadth first.
    fn follow(&self, branch: &Branch, prev: Option<&PrevVertex>, sampler: &impl Sampler, out: &mut impl Sink) {
        let world = (&self.world, &self.strategy);
        branch.follow(world, prev, Some(self.max_depth), sampler, out, |vertex, beta, out| {
            // Several rays in place of one
            for i in 1..=self.branching {
                let node = branch.node.wrapping_mul(self.branching).wrapping_add(i);
                let u_lobe = sampler.get_1d(Dimension::bounce(node, Bounce::Lobe));
                let u = sampler.get_2d(Dimension::bounce(node, Bounce::Direction));
                let Some(sample) = self.strategy.directions.sample(vertex, u_lobe, u) else {
                    continue;
                };
                let child = Branch {
                    ray: self.world.ray_along(vertex, sample.wi),
                    depth: branch.depth + 1,
                    node,
                    beta: beta * sample.weight / self.branching as f32,
                };
                if !child.beta.is_black() {
                    path_record::scatter(branch.depth, vertex, &sample, 1.0 / self.branching as f32, out);
                    self.follow(&child, Some(&PrevVertex::new(vertex, &sample, 1)), sampler, out);
                }
            }
        });
    }
}
