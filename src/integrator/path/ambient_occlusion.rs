use crate::accel::Accel;
use crate::integrator::{Integrator, Sink, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};
use crate::sampling::warp::cosine_hemisphere;

/// Ambient occlusion: the cosine-weighted share of the hemisphere in which nothing is near; 1 in the open.
#[derive(Debug)]
pub struct AmbientOcclusion<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Maximum distance of occluders, scene units.
    pub distance: f32,
}

impl<A: Accel> Integrator for AmbientOcclusion<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let slot = BsdfSlot::new();
        let Some((_, vertex)) = self.world.look(key, sampler, &slot, out) else {
            return;
        };

        // A cosine-weighted direction on the viewer's side
        let mut wi = cosine_hemisphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)));
        wi.z = wi.z.copysign(vertex.wo.z);
        let probe = Ray {
            t_max: self.distance,
            ..vertex.ray_along(wi)
        };
        let open = self.world.transmittance(&probe, out).color();
        out.radiance(open.into());
    }
}
