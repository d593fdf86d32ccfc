use super::direct::{Direct, LightNumbers};
use super::strategy::PrevVertex;
use super::surface_areas::SurfaceAreas;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::vertex::Vertex;
use crate::integrator::{DirectLight, Integrator, PathEvent, ScatteringRecord, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Path tracing whose next vertex is a point uniform over the area of all surfaces, connected by visibility (the three-point form of the light transport
/// equation; PBR4 §13.2). Delta lobes are followed as everywhere. Direct light comes from light sampling.
///
/// The geometry term cos θ cos θ′ / d² stays in the estimate: its variance has no bound near corners, and most points are hidden. It is there to be
/// compared with, for short paths.
#[derive(Debug)]
pub struct AreaIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Areas of the scene's surfaces.
    pub areas: &'a SurfaceAreas,
    /// Maximum number of scattering events; `None` leaves the end to occlusion.
    pub max_depth: Option<u32>,
}

/// The ray to the next vertex.
struct Next {
    ray: Ray,
    /// Factor of the throughput.
    weight: Spectrum,
    /// Density of the direction per solid angle; the probability of a delta lobe.
    pdf: f32,
    /// The surface point that the ray must meet; `None` along a delta lobe.
    target: Option<Hit>,
    prev: PrevVertex,
}

impl<A: Accel> Integrator for AreaIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let strategy = Strategy {
            direct: DirectLight::Light,
            ..Strategy::default()
        };
        let mut ray = world.camera_ray(key, None, sampler, out);
        let mut beta = Spectrum::ONE;
        let mut came: Option<Next> = None;

        for depth in 0.. {
            // Intersect the ray with the scene, and add light that no light sample has counted
            let slot = BsdfSlot::new();
            let prev = came.as_ref().map(|next| &next.prev);
            let met = strategy.arrive(world, (&ray, depth), prev, &mut beta, &slot, out);
            let Some((hit, vertex)) = &met else { return };

            // A sampled point that is hidden ends the path
            let target = came.as_ref().and_then(|next| next.target.as_ref());
            if target.is_some_and(|target| !hit.is_same_surface(target)) {
                return;
            }
            if self.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Sample lights
            let u = LightNumbers::draw(&*sampler, depth);
            let direct = Direct::sample(world, vertex, &strategy, 1, &u, out).arrives(world, out);
            out.radiance(direct * beta);

            // Sample the next vertex
            let Some(next) = self.next(vertex, depth, sampler) else {
                return;
            };
            if out.records() {
                let scattering = ScatteringRecord {
                    direction: next.ray.direction,
                    lobe: vertex.bsdf.lobe_name(
                        vertex.wo,
                        vertex.frame.to_local(next.ray.direction),
                        next.prev.is_delta,
                    ),
                    is_delta: next.prev.is_delta,
                    pdf: next.pdf,
                    weight: next.weight,
                    eta: 1.0,
                    roulette: 1.0,
                };
                out.record(PathEvent::Scatter { depth, scattering });
            }
            beta *= next.weight;
            ray = next.ray;
            came = Some(next);
        }
    }
}

impl<A: Accel> AreaIntegrator<'_, A> {
    /// A point on some surface, or the direction of a delta lobe; `None` where neither scatters light to the viewer.
    fn next(&self, vertex: &Vertex, depth: u32, sampler: &impl Sampler) -> Option<Next> {
        let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
        let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
        let smooth = vertex.smooth_probability();
        if u_lobe >= smooth {
            let sample = vertex.sample(u_lobe, u)?;
            return Some(Next {
                ray: self.world.ray_along(vertex, sample.wi),
                weight: sample.weight,
                pdf: sample.pdf,
                target: None,
                prev: PrevVertex::new(vertex, &sample, 1),
            });
        }

        // A point on a surface, with its density per area
        let choice = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)).y;
        let time = vertex.point.time;
        let (target, pdf) = self.areas.sample(self.world.scene, choice, u, time)?;
        let point = self.world.scene.surface_point(&target, time);

        // BSDF, geometry term and density make the weight
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
        (!weight.is_black()).then(|| Next {
            ray: Ray::new(origin, towards).when(time).within(vertex.body_towards(wi)),
            weight,
            pdf: pdf * smooth * distance_squared / cos,
            target: Some(target),
            prev: PrevVertex {
                from: vertex.light_context(),
                pdf: 0.0,
                is_delta: false,
                light_samples: 1,
            },
        })
    }
}
