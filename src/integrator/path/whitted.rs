use super::direct::{Direct, LightNumbers};
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::color::Spectrum;
use crate::integrator::{DirectLight, Integrator, RayKind, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
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

/// A ray of the tree.
struct Branch {
    ray: Ray,
    depth: u32,
    /// Number in the tree, which names the random numbers of its vertex.
    node: u32,
    /// Throughput.
    beta: Spectrum,
    /// Square of the index of refraction that the ray is in, which `beta` was divided by.
    eta_squared: f32,
}

impl<A: Accel> Integrator for WhittedIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let root = Branch {
            ray: self.world.camera_ray(key, None, sampler, out),
            depth: 0,
            node: 0,
            beta: Spectrum::ONE,
            eta_squared: 1.0,
        };
        self.follow(root, sampler, out);
    }
}

impl<A: Accel> WhittedIntegrator<'_, A> {
    fn follow(&self, mut branch: Branch, sampler: &impl Sampler, out: &mut impl Sink) {
        if out.is_cancelled() {
            return;
        }
        let (world, ray) = (&self.world, branch.ray);
        let kind = if branch.depth == 0 {
            RayKind::Camera
        } else {
            RayKind::Bounce
        };
        let hit = world.intersect(&ray, kind, &mut branch.beta, out);
        if branch.depth == 0 && hit.is_none() && world.see_background(&ray, branch.beta, out) {
            return;
        }

        // Emission and direct light
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let slot = BsdfSlot::new();
        let vertex = hit.map(|hit| world.vertex(&hit, &ray, &slot));
        let met = hit.as_ref().zip(vertex.as_ref());
        strategy.emitted(world.scene, &ray, None, branch.beta, met, |light| out.radiance(light));
        let Some((hit, vertex)) = met else { return };
        if branch.depth == 0 {
            world.see((hit, vertex), (&ray, branch.beta), false, out);
        }
        if self.max_depth.is_some_and(|max| branch.depth >= max) {
            return;
        }
        let u = LightNumbers::draw(sampler, branch.node);
        let direct = Direct::sample(world, vertex, &strategy, 1, &u, out).arrives(world, out);
        out.radiance(direct * branch.beta);

        // Mirror and refracted directions, all of them
        let directions = vertex.bsdf.delta_directions(vertex.wo, TransportMode::Radiance);
        for (i, sample) in directions.enumerate() {
            let beta = branch.beta * sample.f * sample.wi.z.abs();
            let eta_squared = branch.eta_squared * sample.eta * sample.eta;
            if beta.max_component() * eta_squared < MIN_SHARE {
                continue;
            }
            let child = Branch {
                ray: vertex.ray_along(sample.wi),
                depth: branch.depth + 1,
                node: branch.node.wrapping_mul(4).wrapping_add(i as u32 + 1),
                beta,
                eta_squared,
            };
            self.follow(child, sampler, out);
        }
    }
}
