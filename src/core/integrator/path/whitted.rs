use super::tree::Branch;
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::integrator::path_record;
use crate::integrator::{DirectLight, Integrator, Sink, Strategy, World};
use crate::sampler::{SampleKey, Sampler};

/// Minimum throughput of a branch that is followed (Hall and Greenberg 1983).
const MIN_SHARE: f32 = 1e-3;

/// Recursive ray tracing: mirrors and glass are followed, and other surfaces show direct light (Whitted 1980).
///
/// There is no light from diffuse to diffuse surfaces, so its picture is another one than a path tracer's.
#[derive(Debug)]
pub struct WhittedIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events; `None` leaves the end to the branches' share.
    pub max_depth: Option<u32>,
}

impl<A: Accel> Integrator for WhittedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let root = Branch::from_camera(self.world.camera_ray(key, None, sampler, out));
        self.follow(&root, 1.0, sampler, out);
    }
}

impl<A: Accel> WhittedIntegrator<'_, A> {
    /// Follows `branch`, whose throughput was divided by `eta_squared`, the square of the index of refraction that its ray is in.
    fn follow(&self, branch: &Branch, eta_squared: f32, sampler: &impl Sampler, out: &mut impl Sink) {
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let world = (&self.world, &strategy);
        branch.follow(world, None, self.max_depth, sampler, out, |vertex, beta, out| {
            // Mirror and refracted directions, all of them
            let directions = vertex.bsdf.delta_directions(vertex.wo, TransportMode::Radiance);
            for (i, sample) in directions.enumerate() {
                let beta = beta * sample.f * sample.wi.z.abs();
                let eta_squared = eta_squared * sample.eta * sample.eta;
                if beta.max_component() * eta_squared < MIN_SHARE {
                    continue;
                }
                path_record::scatter(branch.depth, vertex, &sample, sample.pdf, out);
                let child = Branch {
                    ray: self.world.ray_along(vertex, sample.wi),
                    depth: branch.depth + 1,
                    node: branch.node.wrapping_mul(4).wrapping_add(i as u32 + 1),
                    beta,
                };
                self.follow(&child, eta_squared, sampler, out);
            }
        });
    }
}
