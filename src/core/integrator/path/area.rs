use super::direct::LightNumbers;
use super::state::PathState;
use super::strategy::PrevVertex;
use super::surface_areas::SurfaceAreas;
use crate::accel::Accel;
use crate::geometry::Hit;
use crate::integrator::vertex::Vertex;
use crate::integrator::{DirectLight, Integrator, PathEvent, ScatteringRecord, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Path tracing in which the next vertex is a point sampled uniformly over the area of all
/// surfaces, connected by visibility (the three-point form of the light transport equation; PBR4
/// §13.2). Delta lobes are followed as usual. Direct light comes from light sampling.
///
/// The geometry term cos θ cos θ′ / d² stays in the estimate. The variance of the estimate has no
/// bound near corners, and most sampled points are hidden. The integrator is a reference for
/// comparisons with short paths.
#[derive(Debug)]
pub struct AreaIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Areas of the scene's surfaces.
    pub areas: &'a SurfaceAreas,
    /// Maximum number of scattering events. `None`: only occlusion ends paths.
    pub max_depth: Option<u32>,
}

/// State of a path between two vertices, with the surface point that its ray must reach.
struct PathSegment {
    path: PathState,
    /// Surface point that the ray must hit; `None` at the camera and along a delta lobe.
    target: Option<Hit>,
}

impl<A: Accel> Integrator for AreaIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        let wavelength = world.wavelength(sampler);
        let mut target = None;

        loop {
            // Find the next surface. Add its emission if the previous vertex did not sample lights
            let slot = BsdfSlot::new();
            let Some(vertex) = strategy.next_vertex(world, &mut path, wavelength.as_ref(), &slot, out) else {
                return;
            };

            // End the path if the sampled point is hidden
            if target.is_some_and(|target| !vertex.hit.is_same_surface(&target)) {
                return;
            }
            if self.max_depth.is_some_and(|max| path.depth >= max) {
                return;
            }

            // Sample lights
            let u = LightNumbers::draw(&*sampler, path.depth);
            strategy.add_direct_light(world, &path, &vertex, &u, out);

            // Sample the next vertex
            let Some(next) = self.next(&path, &vertex, sampler, out) else {
                return;
            };
            (path, target) = (next.path, next.target);
        }
    }
}

impl<A: Accel> AreaIntegrator<'_, A> {
    /// Samples the next segment: towards a point on some surface, or in the direction of a delta
    /// lobe. `None` if the vertex scatters no light from this point or direction to the viewer.
    fn next(
        &self,
        path: &PathState,
        vertex: &Vertex,
        sampler: &impl Sampler,
        out: &mut impl Sink,
    ) -> Option<PathSegment> {
        let depth = path.depth;
        let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
        let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
        let smooth = vertex.smooth_probability();
        if u_lobe >= smooth {
            let sample = vertex.sample(u_lobe, u)?;
            return Some(PathSegment {
                path: path.after(path.scatter(&self.world, vertex, &sample, 1.0, 1, out)),
                target: None,
            });
        }

        // Sample a point on a surface, with its density per area
        let choice = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)).y;
        let time = vertex.point.time;
        let (target, pdf) = self.areas.sample(self.world.scene, choice, u, time)?;
        let point = self.world.scene.surface_point(&target, time);

        // Compute the weight: BSDF times geometry term, divided by the density
        let to = point.p - vertex.point.p;
        let distance_squared = to.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let direction = to / distance_squared.sqrt();
        let wi = vertex.frame.to_local(direction);
        let (f, _) = vertex.eval_pdf(wi);
        let cos = point.ng.dot(direction).abs();
        let weight = f * (wi.z.abs() * cos / (distance_squared * pdf * smooth));
        let origin = self.world.origin(vertex, wi, direction);
        let towards = (point.p - origin).try_normalize()?;
        if weight.is_black() {
            return None;
        }
        if out.records() {
            let scattering = ScatteringRecord {
                direction: towards,
                lobe: vertex.bsdf.lobe_name(vertex.wo, vertex.frame.to_local(towards), false),
                is_delta: false,
                pdf: pdf * smooth * distance_squared / cos,
                weight,
                eta: 1.0,
                roulette: 1.0,
            };
            out.record(PathEvent::Scatter { depth, scattering });
        }
        let ray = Ray::new(origin, towards).when(time).within(vertex.body_towards(wi));
        let next = PathState {
            depth: depth + 1,
            beta: path.beta * weight,
            is_dispersed: path.is_dispersed,
            prev: Some(PrevVertex {
                from: vertex.light_context(),
                pdf: 0.0,
                is_delta: false,
                light_samples: 1,
            }),
            ..PathState::new(ray)
        };
        Some(PathSegment {
            path: next,
            target: Some(target),
        })
    }
}
