use crate::accel::Accel;
use crate::integrator::{Integrator, Sink, World};
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec2};
use crate::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
use crate::sampling::warp::cosine_hemisphere;

/// Ambient occlusion: the cosine-weighted fraction of the hemisphere without near surfaces. It is 1
/// if no surface is near.
#[derive(Debug)]
pub struct AmbientOcclusion<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Maximum distance of occluders, in scene units.
    pub distance: f32,
}

/// The default distance comes from `PROBES` × `PROBES` camera rays, evenly spaced over the image.
const PROBES: u32 = 32;

impl<A: Accel> AmbientOcclusion<'_, A> {
    /// Default maximum distance of occluders, in scene units. In a closed room the walls would
    /// occlude every long ray. So the default is half the median distance from visible surfaces to
    /// the next surface in a cosine-weighted direction, rounded to two digits. If more than half of
    /// these directions leave the scene, the default is the diameter of the scene.
    pub fn usual_distance(world: &World<A>) -> f32 {
        let size = world.camera.resolution().as_vec2();
        let time = world.camera.time(0.5);
        let mut sampler = Independent::new(0);
        let mut free: Vec<f32> = Vec::new();
        for (x, y) in (0..PROBES).flat_map(|y| (0..PROBES).map(move |x| (x, y))) {
            sampler.start(SampleKey::new(x, y, 0));
            let place = (Vec2::new(x as f32, y as f32) + 0.5) / PROBES as f32;
            let ray = world.ray_through(place * size, time, &sampler);
            let Some(hit) = world.accel.intersect(&ray) else {
                continue;
            };
            let slot = BsdfSlot::new();
            let vertex = world.vertex(&hit, &ray, None, &slot);
            let mut wi = cosine_hemisphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)));
            wi.z = wi.z.copysign(vertex.wo.z);
            let next = world.accel.intersect(&world.ray_along(&vertex, wi));
            free.push(next.map_or(f32::INFINITY, |hit| hit.t));
        }
        free.sort_by(f32::total_cmp);
        match free.get(free.len() / 2) {
            Some(median) if median.is_finite() && *median > 0.0 => two_digits(0.5 * median),
            _ => 2.0 * world.scene.bounds().radius(),
        }
    }
}

/// Rounds `x`, which is above 0, to two significant digits, so that rounding errors of rays have no
/// effect.
fn two_digits(x: f32) -> f32 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

impl<A: Accel> Integrator for AmbientOcclusion<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let slot = BsdfSlot::new();
        let Some(vertex) = self.world.first_vertex(key, sampler, &slot, out) else {
            return;
        };

        // Sample a cosine-weighted direction on the viewer's side
        let mut wi = cosine_hemisphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)));
        wi.z = wi.z.copysign(vertex.wo.z);
        let probe = Ray {
            t_max: self.distance,
            ..self.world.ray_along(&vertex, wi)
        };
        let open = self.world.transmittance(&probe, out).color();
        out.radiance(open);
    }
}
