use super::{RayKind, Sink, Strategy, World};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::color::Spectrum;
use crate::geometry::SurfacePoint;
use crate::light::LightId;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};

/// A surface point with the local frame and the scattering that hold there.
pub(super) struct Vertex<'a> {
    pub point: SurfacePoint,
    pub frame: Frame,
    pub bsdf: &'a Bsdf,
    /// Direction to the viewer, local frame.
    pub wo: Vec3,
}

/// The random numbers of one estimate of direct light.
pub(super) struct LightNumbers<'a, S> {
    choice: f32,
    point: Vec2,
    sampler: &'a S,
    depth: u32,
}

impl<'a, S: Sampler> LightNumbers<'a, S> {
    /// Those of the vertex reached after `depth` scatterings.
    pub fn draw(sampler: &'a S, depth: u32) -> Self {
        Self {
            choice: sampler.get_1d(Dimension::bounce(depth, Bounce::LightChoice)),
            point: sampler.get_2d(Dimension::bounce(depth, Bounce::LightPoint)),
            sampler,
            depth,
        }
    }

    /// Those of the light in place `index`, where all lights are sampled.
    fn point_of(&self, index: u32) -> Vec2 {
        self.sampler
            .get_2d(Dimension::bounce(self.depth, Bounce::LightPoint).nth(index))
    }
}

/// Light that sampled lights send to `vertex` and on to the viewer, weighed against following scattered rays.
///
/// This is the half of the estimator that samples lights (Veach 1997, §9.2); the other half is the emission that a
/// scattered ray meets.
#[inline(always)]
pub(super) fn estimate_direct<A: Accel>(
    world: &World<A>,
    vertex: &Vertex,
    strategy: &Strategy,
    u: &LightNumbers<impl Sampler>,
    out: &mut impl Sink,
) -> Spectrum {
    if !strategy.samples_lights() || vertex.bsdf.is_delta() {
        return Spectrum::ZERO;
    }
    let selection = world.scene.light_selection();
    let mut radiance = Spectrum::ZERO;
    // Every light, or one of them
    if let Some(ids) = selection.all() {
        for (index, &id) in ids.iter().enumerate() {
            radiance += sample_light(world, vertex, strategy, (id, 1.0), u.point_of(index as u32), out);
        }
    } else if let Some(chosen) = selection.sample(u.choice) {
        radiance = sample_light(world, vertex, strategy, chosen, u.point, out);
    }
    radiance
}

/// The same for the one light `id`, which was chosen with probability `pmf`.
#[inline(always)]
fn sample_light<A: Accel>(
    world: &World<A>,
    vertex: &Vertex,
    strategy: &Strategy,
    (id, pmf): (LightId, f32),
    u: Vec2,
    out: &mut impl Sink,
) -> Spectrum {
    // A direction towards the light
    let Some(light) = world.scene.lights()[id.0 as usize].sample(vertex.point.p, u) else {
        return Spectrum::ZERO;
    };

    // What would be scattered; a shadow ray is traced only where that is anything.
    let wi = vertex.frame.to_local(light.wi);
    let f = vertex.bsdf.eval(vertex.wo, wi) * wi.z.abs();
    if f.is_black() {
        return Spectrum::ZERO;
    }
    out.ray(RayKind::Shadow);
    if world.accel.occluded(&light.shadow_ray(&vertex.point)) {
        return Spectrum::ZERO;
    }

    let pdf = pmf * light.pdf;
    let scattering_pdf = || strategy.directions.pdf(vertex.bsdf, vertex.wo, wi);
    f * light.radiance * (strategy.light_weight(pdf, light.is_delta, scattering_pdf) / pdf)
}
