use super::direct::{Vertex, estimate_direct};
use super::{Integrator, RayKind, Sink};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::geometry::ray_towards;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::sampling::mis::power_heuristic;
use crate::scene::{Incident, Scene};

/// Scatterings before Russian roulette may end a path. On the suite's cornell, hall and sponza 1 has the best product of
/// error and time, or is some 4 % from it (docs/benchmarks.md).
const ROULETTE_DEPTH: u32 = 1;

/// Largest probability of going on past roulette, so that every path ends, also in a closed room that absorbs nothing.
const MAX_SURVIVAL: f32 = 0.95;

/// Unidirectional path tracing with next-event estimation: lights and BSDF are sampled at every vertex and combined
/// by the power heuristic, and Russian roulette on the throughput ends paths (Kajiya 1986; Veach 1997, ch. 9–10).
#[derive(Clone, Copy, Debug)]
pub struct PathIntegrator<'a, A> {
    /// What light meets.
    pub scene: &'a Scene,
    /// Answers ray queries over `scene`.
    pub accel: &'a A,
    /// Where paths start.
    pub camera: &'a Camera,
    /// Scattering events at most: 0 shows emission alone, `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
}

/// The scattering that a ray comes from: what MIS needs when the ray meets a light.
struct Scattering {
    p: Vec3,
    pdf: f32,
}

/// The random numbers of one vertex.
struct VertexNumbers {
    light: (f32, Vec2),
    direction: Vec2,
    roulette: f32,
}

impl VertexNumbers {
    fn draw(sampler: &impl Sampler, depth: u32) -> Self {
        let dimension = |what| Dimension::bounce(depth, what);
        Self {
            light: (
                sampler.get_1d(dimension(Bounce::LightChoice)),
                sampler.get_2d(dimension(Bounce::LightPoint)),
            ),
            direction: sampler.get_2d(dimension(Bounce::Direction)),
            roulette: sampler.get_1d(dimension(Bounce::Roulette)),
        }
    }
}

/// Weight of light met by a scattered ray against having sampled the light; all of it counts at the camera, where
/// lights are not sampled.
fn emission_weight(scattering: Option<&Scattering>, light: &Incident) -> f32 {
    scattering.map_or(1.0, |s| power_heuristic(s.pdf, light.pdf))
}

impl<A: Accel> Integrator for PathIntegrator<'_, A> {
    const NAME: &'static str = "path";

    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        sampler.start(key);
        let film = key.pixel().as_vec2() + sampler.get_2d(Dimension::PIXEL);
        let mut ray = self.camera.ray(film, sampler.get_2d(Dimension::LENS));

        let mut radiance = Spectrum::ZERO;
        let mut beta = Spectrum::ONE;
        let mut scattering: Option<Scattering> = None;

        for depth in 0.. {
            // All draws of a vertex stand in one place, before its ray: none of them depends on what is hit.
            let u = VertexNumbers::draw(sampler, depth);
            out.ray(if depth == 0 { RayKind::Camera } else { RayKind::Bounce });
            let Some(hit) = self.accel.intersect(&ray) else {
                // Escaped: infinitely distant lights
                for light in self.scene.escaped() {
                    radiance += beta * light.radiance * emission_weight(scattering.as_ref(), &light);
                }
                break;
            };

            // The surface, and the light it emits by itself
            let point = self.scene.surface_point(&hit);
            let from = scattering.as_ref().map_or(ray.origin, |s| s.p);
            if let Some(light) = self.scene.emitted(&hit, from, point.p, ray.direction) {
                radiance += beta * light.radiance * emission_weight(scattering.as_ref(), &light);
            }
            let bsdf = self.scene.material(&hit).bsdf(&point);
            if depth == 0 {
                out.first_surface(FirstSurface {
                    albedo: bsdf.albedo(),
                    normal: point.ns * 1f32.copysign(-ray.direction.dot(point.ns)),
                    depth: self.camera.depth(point.p),
                });
            }
            if self.max_depth.is_some_and(|max| depth >= max) {
                break;
            }

            // Next-event estimation: light that arrives straight from a light
            let frame = Frame::from_z(point.ns);
            let wo = frame.to_local(-ray.direction);
            let vertex = Vertex {
                point: &point,
                frame: &frame,
                bsdf: &bsdf,
                wo,
            };
            radiance += beta * estimate_direct(self.scene, self.accel, &vertex, u.light, out);

            // All other light: go on in a direction drawn from the BSDF
            let Some(scattered) = bsdf.sample(wo, u.direction) else {
                break;
            };
            beta *= scattered.f * (scattered.wi.z.abs() / scattered.pdf);

            // Russian roulette
            if depth >= ROULETTE_DEPTH {
                let survival = beta.max_component().min(MAX_SURVIVAL);
                if u.roulette >= survival {
                    break;
                }
                beta = beta / survival;
            }

            ray = ray_towards(&point, frame.to_world(scattered.wi));
            scattering = Some(Scattering {
                p: point.p,
                pdf: scattered.pdf,
            });
        }
        out.radiance(radiance);
    }
}
