//! Camera rays of several samples, traced as one packet.

use super::state::{PathState, RayResult};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::{RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::math::{Ray, Vec3};
use crate::sampler::{Dimension, SampleKey, Sampler};

/// Packet of camera rays of at most [`SAMPLES_AT_ONCE`] samples, with their first hits.
pub(super) struct CameraPacket {
    rays: [Ray; SAMPLES_AT_ONCE],
    hits: [Option<Hit>; SAMPLES_AT_ONCE],
    /// Transmittance up to each hit.
    transmittances: [Spectrum; SAMPLES_AT_ONCE],
}

impl CameraPacket {
    /// Packet without rays.
    pub fn new() -> Self {
        Self {
            rays: [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE],
            hits: [None; SAMPLES_AT_ONCE],
            transmittances: [Spectrum::ONE; SAMPLES_AT_ONCE],
        }
    }

    /// Traces the camera rays of the samples `keys`. If `is_one_time`, all rays have the time of
    /// the first ray.
    #[inline(always)]
    pub fn trace<A: Accel>(
        &mut self,
        world: &World<A>,
        keys: &[SampleKey],
        sampler: &mut impl Sampler,
        is_one_time: bool,
        out: &mut [impl Sink],
    ) {
        let mut time = None;
        for (ray, (key, out)) in self.rays.iter_mut().zip(keys.iter().zip(&mut *out)) {
            *ray = world.camera_ray(*key, time, sampler, out);
            time = time.or(is_one_time.then_some(ray.time));
        }
        let (rays, hits) = (&self.rays[..keys.len()], &mut self.hits[..keys.len()]);
        world.accel.intersect_coherent(rays, hits);
        out.iter_mut().for_each(|out| out.ray(RayKind::Camera));
        if world.lets_pass(RayKind::Camera) || world.scene.has_absorption() {
            self.pass_surfaces(world, keys, sampler, out);
        }
    }

    /// Replaces each hit by the first surface that stops the ray. Rays pass through surfaces with
    /// alpha and thin glass, and absorbing bodies tint their light.
    fn pass_surfaces<A: Accel>(
        &mut self,
        world: &World<A>,
        keys: &[SampleKey],
        sampler: &mut impl Sampler,
        out: &mut [impl Sink],
    ) {
        for (i, (key, out)) in keys.iter().zip(out).enumerate() {
            let u = world.scene.has_thin_surfaces().then(|| {
                sampler.start(*key);
                sampler.get_1d(Dimension::THIN_SURFACES)
            });
            let (ray, hit) = (self.rays[i], self.hits[i]);
            (self.hits[i], self.transmittances[i]) = if world.scene.has_absorption() {
                world.first_in_bodies(&ray, hit, RayKind::Camera, u, out)
            } else {
                world.first_opaque(ray, hit, RayKind::Camera, u, out)
            };
        }
    }

    /// Path of the sample `i`, and the result of its first ray query.
    pub fn path(&self, i: usize) -> (PathState, RayResult) {
        (PathState::new(self.rays[i]), (self.hits[i], self.transmittances[i]))
    }
}
