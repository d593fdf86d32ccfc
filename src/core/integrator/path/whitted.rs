use super::state::PathState;
use super::tree::Branch;
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::integrator::{DirectLight, Integrator, Sink, Strategy, World};
use crate::sampler::{SampleKey, Sampler};

/// Minimum throughput of a branch. Branches with a smaller throughput end (Hall and Greenberg
/// 1983).
const MIN_SHARE: f32 = 1e-3;

/// Recursive ray tracing (Whitted 1980): mirrors and glass are followed, and all other surfaces
/// have direct light only.
///
/// Light between diffuse surfaces is missing, so the image differs from the image of a path tracer.
#[derive(Debug)]
pub struct WhittedIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events. `None`: only `MIN_SHARE` ends branches.
    pub max_depth: Option<u32>,
}

impl<A: Accel> Integrator for WhittedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let ray = self.world.camera_ray(key, None, sampler, out);
        self.follow(Branch::from_camera(ray), sampler, out);
    }
}

impl<A: Accel> WhittedIntegrator<'_, A> {
    /// Traces `branch` and all mirrored and refracted branches that follow it.
    fn follow(&self, branch: Branch, sampler: &impl Sampler, out: &mut impl Sink) {
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let (world, parent) = (&self.world, branch.node);
        branch.follow(world, &strategy, self.max_depth, sampler, out, |vertex, path, out| {
            // Follow all directions of mirror reflection and refraction
            let directions = vertex.bsdf.delta_directions(vertex.wo, TransportMode::Radiance);
            for (i, sample) in directions.enumerate() {
                // Do not divide by the probability of the lobe, because all lobes are followed.
                let weight = sample.f * sample.wi.z.abs();
                let share = path.beta * weight * path.roulette_scale * (sample.eta * sample.eta);
                if share.max_component() < MIN_SHARE {
                    continue;
                }
                let next = PathState {
                    beta: path.beta * weight,
                    ..path.after(path.scatter(world, vertex, &sample, sample.pdf, 1, out))
                };
                let branch = Branch {
                    path: next,
                    node: parent.wrapping_mul(4).wrapping_add(i as u32 + 1),
                };
                self.follow(branch, sampler, out);
            }
        });
    }
}
