use super::connection::{Connector, Subpaths};
use super::subpath::Surface;
use crate::accel::Accel;
use crate::integrator::{Heuristic, IterationIntegrator, RayKind, RaySink, Roulette, SplatSink, World};
use crate::math::Ray;
use crate::sampler::{SampleKey, Sampler};

/// Light tracing: paths start at lights, and every vertex is connected to the camera (Arvo 1986;
/// Dutré, Lafortune and Willems 1993). Light that reaches the camera by a delta lobe (in mirrors
/// and through glass) is missing, because no connection can find it. If the start of a camera ray
/// depends on the point that the ray hits, no light can be sampled for the lens
/// ([`LensKind`](crate::camera::LensKind)). Camera rays then find the lamps that the camera sees
/// directly.
#[derive(Debug)]
pub struct LightIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
}

impl<A: Accel> IterationIntegrator for LightIntegrator<'_, A> {
    type PreparationPart = ();
    type Preparation = ();

    fn preparations(&self) -> u32 {
        0
    }

    fn prepare<S: Sampler>(&self, _: u32, _: u32, _: &mut S, _: &mut impl RaySink) {}

    fn join(&self, _: u32, _: Vec<()>) {}

    fn repeats(&self) -> bool {
        self.world.camera.repeats()
    }

    fn sends_light(&self) -> bool {
        true
    }

    fn sample<S: Sampler>(&self, _: &(), key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        let connector = Connector::new(&self.world, Heuristic::Balance, self.roulette, self.max_depth);
        // Trace the camera ray for the auxiliary channels. If no light can be sampled for the lens,
        // add the lights that the ray hits
        let ray = self.world.camera_ray(key, None, sampler, out);
        if !self.world.camera.lens_of(&ray).kind.is_fixed() {
            self.trace_to_lights(ray, sampler, out);
        } else if let (Some(hit), _) = self.world.intersect(&ray, RayKind::Camera, out) {
            let first = Surface::new(&self.world, hit, &ray).first_seen(&self.world, out);
            out.first_surface(first);
        }

        // Trace a light path, and connect each vertex to the camera
        let paths = Subpaths {
            light: connector.light_path(ray.time, sampler, out),
            time: ray.time,
            ..Subpaths::default()
        };
        let mut found = Vec::new();
        for s in 1..=paths.light.len().max(1).min(connector.max_vertices() - 1) {
            connector.strategy((s, 1), &paths, sampler, out, &mut |c| found.push(c));
        }
        for c in found {
            if let Some(film) = c.film {
                c.record(out);
                out.splat(film, c.light(c.radiance, self.world.scene));
            }
        }
    }
}

impl<A: Accel> LightIntegrator<'_, A> {
    /// Adds the lights that the camera ray `ray` hits, if no light can be sampled for the lens.
    fn trace_to_lights(&self, ray: Ray, sampler: &impl Sampler, out: &mut impl SplatSink) {
        let connector = Connector::new(&self.world, Heuristic::Balance, self.roulette, Some(0));
        let (camera, escape) = connector.camera_path(ray, sampler, out);
        let mut paths = Subpaths {
            camera,
            escape,
            time: ray.time,
            ..Subpaths::default()
        };
        if let Some(first) = paths.first_seen(&self.world, out) {
            out.first_surface(first);
        }
        let mut found = Vec::new();
        connector.strategy((0, paths.camera.len()), &paths, sampler, out, &mut |c| found.push(c));
        connector.escape(&mut paths, &mut |c| found.push(c));
        for c in found {
            c.record(out);
            out.light(c.light(c.radiance, self.world.scene));
        }
    }
}
