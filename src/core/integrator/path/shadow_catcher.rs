//! The ground that catches shadows, as a wrapper around the path tracer.
//!
//! The ground shows the share `E / E₀` of its irradiance `E₀` without the scene. The path tracer
//! estimates `E`. The wrapper estimates `E₀` by the same path with the same random numbers in a world
//! without surfaces, and takes the difference (a control variate):
//!
//! ```text
//! E / E₀ = 1 + (E − E₀) / E₀
//! ```
//!
//! Where nothing stands on the ground both estimates have equal bits, and the ground has no noise.

use super::integrator::{PathIntegrator, PathStart};
use crate::accel::{Accel, Empty};
use crate::film::FirstSurface;
use crate::integrator::{Gathered, RayKind, RaySink, Sink};
use crate::material::BsdfSlot;
use crate::sampler::Sampler;
use std::marker::PhantomData;

impl<A: Accel> PathIntegrator<'_, A> {
    /// Subtracts the unshadowed light if the camera ray of `start` hits the ground. The path of
    /// `start` has given its light to `out`.
    #[inline(always)]
    pub(super) fn catch_shadow<S: Sampler, R: Gathered>(
        &self,
        start: &PathStart<S>,
        out: &mut impl Sink<Radiance = R>,
    ) {
        if self.world.scene.ground().is_some() {
            self.subtract_unshadowed(start, out);
        }
    }

    #[inline(never)]
    fn subtract_unshadowed<S: Sampler, R: Gathered>(&self, start: &PathStart<S>, out: &mut impl Sink<Radiance = R>) {
        let world = &self.world;
        // Light of lamps behind a surface is unknown: a ray that hits the surface does not find it.
        let ground = world.scene.ground().filter(|ground| ground.knows_missing_light());
        let Some((ground, hit)) = ground.zip(start.hit).filter(|(ground, hit)| ground.is_at(hit)) else {
            return;
        };
        let accel: &dyn Accel = &Empty;
        let open = PathIntegrator {
            world: world.with_accel(&accel),
            strategy: self.strategy,
            max_depth: self.max_depth,
            roulette: self.roulette,
            light_samples: self.light_samples,
            clamp_indirect: None,
        };
        let unshadowed: R = open.radiance(start, &mut Silent(PhantomData)).sum();
        out.radiance(unshadowed * -1.0);
        let slot = BsdfSlot::new();
        let vertex = world.vertex(&hit, &start.ray, &slot);
        out.camera_view(world.shadow_view(ground, &vertex, (&start.ray, start.tint)));
    }
}

/// Ignores everything.
struct Silent<R>(PhantomData<R>);

impl<R: Gathered> Sink for Silent<R> {
    type Radiance = R;

    fn weight(&mut self, _: f32) {}
    fn radiance(&mut self, _: R) {}
    fn first_surface(&mut self, _: FirstSurface) {}
}

impl<R> RaySink for Silent<R> {
    fn ray(&mut self, _: RayKind) {}
    fn cut_walk(&mut self) {}
}
