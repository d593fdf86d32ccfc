use super::{RayKind, Sink};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::SurfacePoint;
use crate::math::{Frame, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};
use crate::sampling::mis::power_heuristic;
use crate::scene::Scene;

/// Light that one sampled light sends to `point` and on along `wo` (local frame), weighted against BSDF sampling.
///
/// The half of the estimator that samples lights (Veach 1997, §9.2); the other half is the emission that the
/// scattered ray meets.
pub(super) fn estimate_direct<A: Accel, S: Sampler>(
    scene: &Scene,
    accel: &A,
    (point, frame, bsdf): (&SurfacePoint, &Frame, &Bsdf),
    wo: Vec3,
    depth: u32,
    sampler: &S,
    out: &mut impl Sink,
) -> Spectrum {
    // Choose a light, then a direction towards it.
    let Some((id, pmf)) = scene
        .light_selection()
        .sample(sampler.get_1d(Dimension::bounce(depth, Bounce::LightChoice)))
    else {
        return Spectrum::ZERO;
    };
    let u = sampler.get_2d(Dimension::bounce(depth, Bounce::LightPoint));
    let Some(light) = scene.lights()[id.0 as usize].sample(point.p, u) else {
        return Spectrum::ZERO;
    };

    // What would be scattered; a shadow ray is traced only where that is anything.
    let wi = frame.to_local(light.wi);
    let f = bsdf.eval(wo, wi) * wi.z.abs();
    if f.is_black() {
        return Spectrum::ZERO;
    }
    out.ray(RayKind::Shadow);
    if accel.occluded(&light.shadow_ray(point)) {
        return Spectrum::ZERO;
    }

    let pdf = pmf * light.pdf;
    let weight = if light.is_delta {
        1.0
    } else {
        power_heuristic(pdf, bsdf.pdf(wo, wi))
    };
    f * light.radiance * (weight / pdf)
}
