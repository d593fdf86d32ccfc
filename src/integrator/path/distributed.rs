use super::direct::{Direct, LightNumbers};
use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::{Integrator, RayKind, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
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

/// A ray of the tree.
struct Branch {
    ray: Ray,
    depth: u32,
    /// Number in the tree, breadth first, which names the random numbers of its vertex.
    node: u32,
    /// Throughput.
    beta: Spectrum,
    /// The vertex that `ray` comes from; `None` at the camera.
    prev: Option<PrevVertex>,
}

impl<A: Accel> Integrator for DistributedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let root = Branch {
            ray: self.world.camera_ray(key, None, sampler, out),
            depth: 0,
            node: 0,
            beta: Spectrum::ONE,
            prev: None,
        };
        self.follow(root, sampler, out);
    }
}

impl<A: Accel> DistributedIntegrator<'_, A> {
    fn follow(&self, mut branch: Branch, sampler: &impl Sampler, out: &mut impl Sink) {
        if out.is_cancelled() {
            return;
        }
        let (world, strategy) = (&self.world, &self.strategy);
        let (ray, prev) = (branch.ray, branch.prev.as_ref());
        let kind = if branch.depth == 0 {
            RayKind::Camera
        } else {
            RayKind::Bounce
        };
        let hit = world.intersect(&ray, kind, &mut branch.beta, out);
        if branch.depth == 0 && hit.is_none() && world.see_background(&ray, branch.beta, out) {
            return;
        }

        // Emission and direct light, as along a path
        let slot = BsdfSlot::new();
        let vertex = hit.map(|hit| world.vertex(&hit, &ray, &slot));
        let met = hit.as_ref().zip(vertex.as_ref());
        strategy.emitted(world.scene, &ray, prev, branch.beta, met, |light| out.radiance(light));
        let Some((hit, vertex)) = met else { return };
        if branch.depth == 0 {
            world.see((hit, vertex), (&ray, branch.beta), false, out);
        }
        if branch.depth >= self.max_depth {
            return;
        }
        let u = LightNumbers::draw(sampler, branch.node);
        let direct = Direct::sample(world, vertex, strategy, 1, &u, out).arrives(world, out);
        out.radiance(direct * branch.beta);

        // Several rays in place of one
        for i in 1..=self.branching {
            let node = branch.node.wrapping_mul(self.branching).wrapping_add(i);
            let u_lobe = sampler.get_1d(Dimension::bounce(node, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(node, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(vertex, u_lobe, u) else {
                continue;
            };
            let child = Branch {
                ray: vertex.ray_along(sample.wi),
                depth: branch.depth + 1,
                node,
                beta: branch.beta * sample.weight / self.branching as f32,
                prev: Some(PrevVertex::new(vertex, &sample, 1)),
            };
            if !child.beta.is_black() {
                self.follow(child, sampler, out);
            }
        }
    }
}
