use super::{RayKind, Sink};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::SurfacePoint;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::mis::power_heuristic;
use crate::scene::Scene;

/// A surface point with the local frame and the scattering that hold there.
pub(super) struct Vertex<'a> {
    pub point: &'a SurfacePoint,
    pub frame: &'a Frame,
    pub bsdf: &'a Bsdf,
    /// Direction to the viewer, local frame.
    pub wo: Vec3,
}

/// Light that one sampled light sends to `vertex` and on to the viewer, weighted against BSDF sampling.
///
/// `u_choice` chooses the light, `u_point` the point on it. This is the half of the estimator that samples lights
/// (Veach 1997, §9.2); the other half is the emission that the scattered ray meets.
pub(super) fn estimate_direct<A: Accel>(
    scene: &Scene,
    accel: &A,
    vertex: &Vertex,
    (u_choice, u_point): (f32, Vec2),
    out: &mut impl Sink,
) -> Spectrum {
    // Choose a light, then a direction towards it.
    let Some((id, pmf)) = scene.light_selection().sample(u_choice) else {
        return Spectrum::ZERO;
    };
    let Some(light) = scene.lights()[id.0 as usize].sample(vertex.point.p, u_point) else {
        return Spectrum::ZERO;
    };

    // What would be scattered; a shadow ray is traced only where that is anything.
    let wi = vertex.frame.to_local(light.wi);
    let f = vertex.bsdf.eval(vertex.wo, wi) * wi.z.abs();
    if f.is_black() {
        return Spectrum::ZERO;
    }
    out.ray(RayKind::Shadow);
    if accel.occluded(&light.shadow_ray(vertex.point)) {
        return Spectrum::ZERO;
    }

    let pdf = pmf * light.pdf;
    let weight = if light.is_delta {
        1.0
    } else {
        power_heuristic(pdf, vertex.bsdf.pdf(vertex.wo, wi))
    };
    f * light.radiance * (weight / pdf)
}
