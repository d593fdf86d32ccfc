//! The shadow-catching ground, as a wrapper around the path tracer.
//!
//! The ground shows the ratio `E / E₀` of its irradiance `E` to the irradiance `E₀` that it has
//! without objects. The path tracer estimates `E`. The wrapper estimates `E₀` by the same path with
//! the same random numbers in a world without surfaces, and takes the difference (a control
//! variate):
//!
//! ```text
//! E / E₀ = 1 + (E − E₀) / E₀
//! ```
//!
//! If no object stands on the ground, both estimates are bit-identical, and the ground has no
//! noise.

use super::integrator::{PathIntegrator, PathNumbers};
use super::state::{PathState, RayResult};
use crate::accel::{Accel, Empty};
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::integrator::found_light::LightSum;
use crate::integrator::{FoundLight, RayKind, RaySink, Sink};
use crate::material::BsdfSlot;
use crate::sampler::Sampler;

impl<A: Accel> PathIntegrator<'_, A> {
    /// Subtracts the unshadowed light if the camera ray of `path` hits the ground. Call it after
    /// the light of the path was added to `out`.
    #[inline(never)]
    pub(super) fn catch_shadow<S: Sampler>(
        &self,
        path: PathState,
        traced: RayResult,
        numbers: PathNumbers<S>,
        out: &mut impl Sink,
    ) {
        let world = &self.world;
        // Skip grounds for which the light without objects is unknown, as for lamps behind a
        // surface: a ray that hits the surface does not find the lamp.
        let ground = world.scene.ground().filter(|ground| ground.has_missing_light());
        let (hit, transmittance) = traced;
        let Some((ground, hit)) = ground.zip(hit).filter(|(ground, hit)| ground.is_at(hit)) else {
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
        let mut unshadowed = UnshadowedSink {
            sum: LightSum::default(),
            separates_parts: out.separates_parts(),
            separates_paths: out.separates_paths(),
        };
        open.li(path, Some(traced), numbers, &mut unshadowed);
        unshadowed.sum.pass_on(Spectrum::splat(-1.0), 1, out);
        let slot = BsdfSlot::new();
        let vertex = world.vertex(&hit, &path.ray, None, &slot);
        out.camera_view(world.shadow_view(ground, &vertex, &path.ray, transmittance));
    }
}

/// Sink that sums light and ignores rays, weights and surfaces.
struct UnshadowedSink {
    sum: LightSum,
    separates_parts: bool,
    separates_paths: bool,
}

impl Sink for UnshadowedSink {
    fn weight(&mut self, _: f32) {}

    fn light(&mut self, light: FoundLight) {
        self.sum.radiance += light.radiance;
        if self.separates_parts {
            self.sum.add_part(light);
        }
    }

    fn first_surface(&mut self, _: FirstSurface) {}

    fn separates_parts(&self) -> bool {
        self.separates_parts
    }

    fn separates_paths(&self) -> bool {
        self.separates_paths
    }
}

impl RaySink for UnshadowedSink {
    fn ray(&mut self, _: RayKind) {}
    fn cut_walk(&mut self) {}
}
