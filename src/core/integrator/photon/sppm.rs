//! Stochastic progressive photon mapping with independent iterations.
//!
//! Hachisuka and Jensen (2009) store a radius, a count and a flux for each pixel, and the photons
//! of each iteration shrink the radius. So an iteration depends on all previous iterations. Knaus
//! and Zwicker (2011) make the radius a function of the iteration index alone and prove the same
//! convergence. We use the second form, because its iterations are ordinary samples. A render that
//! is stopped, split, merged or cropped is bit-identical, and pixels have no state.
//!
//! The disadvantage is that radii do not follow the local density of photons. A caustic with many
//! photons could use smaller disks, and a dark corner larger disks. Instead the first radius is a
//! multiple of the width of a pixel at the distance of the point. The blur is then equally wide in
//! the picture on near and far surfaces. `--photon-radius` sets one length for the whole scene.

use super::density::Density;
use super::grid::PhotonGrid;
use super::photons::{Photon, PhotonTracer, PhotonWorkItem};
use crate::accel::Accel;
use crate::integrator::path::direct::LightNumbers;
use crate::integrator::path::state::PathState;
use crate::integrator::search_radius::{ProgressiveRadius, Radii};
use crate::integrator::vertex::Vertex;
use crate::integrator::{IterationIntegrator, PathEvent, RaySink, Roulette, Sink, SplatSink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Stochastic progressive photon mapping (Hachisuka and Jensen 2009), in the form of Knaus and
/// Zwicker (2011, "Progressive Photon Mapping: A Probabilistic Approach"). Every iteration traces
/// new photons and gathers them within a radius that depends only on the index of the iteration.
/// Each iteration is an independent estimate.
///
/// The search radius blurs an iteration, so an iteration is biased. Radii shrink from iteration to
/// iteration, so the mean converges to the exact image. If radii shrink as
/// `r²ᵢ₊₁ / r²ᵢ = (i + α) / (i + 1)`, the variance of the mean falls as `n^−α`, and its bias as
/// `n^(α − 1)` (Knaus and Zwicker, §3.3).
///
/// Each path of light from a lamp to the camera is estimated in exactly one way. A camera path
/// continues by delta lobes, and at surfaces that scatter narrowly by any lobe. It ends at the
/// first surface that scatters widely ([`crate::bsdf::Bsdf::is_wide`]). The light consists of these
/// parts:
///
/// - emission that the path hits, with its MIS weight unless the path comes from the camera or from
///   a delta lobe;
/// - direct light that smooth lobes scatter, estimated at each vertex by light sampling and by one
///   scattered ray, weighted by MIS;
/// - light that was scattered at least once before the last vertex, and that smooth lobes of the
///   last vertex scatter: estimated from photons, which are stored from their first scattering
///   event on;
/// - light that photons do not contain: light that delta lobes of the last vertex scatter, and
///   light from below the horizon of its shading or geometric normal. The path continues for this
///   light.
#[derive(Debug)]
pub struct ProgressivePhotonIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Sampling options for direct light.
    pub strategy: Strategy,
    /// Maximum number of scattering events. `None`: the maximum of a light path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Number of light paths of an iteration. `None`: the number of pixels.
    pub photons: Option<u32>,
    /// Search radius of photons.
    pub radius: ProgressiveRadius,
}

/// Photons of one iteration, in a grid.
#[derive(Debug)]
pub struct IterationPhotons<'a> {
    grid: PhotonGrid,
    radii: Radii<'a>,
    /// Time of the photons.
    time: f32,
}

impl<A: Accel> ProgressivePhotonIntegrator<'_, A> {
    fn paths(&self) -> u32 {
        let size = self.world.camera.resolution();
        self.photons.unwrap_or_else(|| size.x.saturating_mul(size.y)).max(1)
    }

    /// Adds the light of the photons around `vertex`, the last vertex of the camera path `path`.
    fn add_photons(&self, prepared: &IterationPhotons, path: &PathState, vertex: &Vertex, out: &mut impl Sink) {
        let point = &vertex.point;
        let radius = prepared.radii.at(point.p, point.time);
        let mut density = Density::new(self.world.scene, vertex, out.separates_parts());
        let mut count = 0;
        prepared.grid.each_within(point.p, radius, |photon| {
            let scatterings = path.depth + 1 + photon.scatterings as u32;
            if self.max_depth.is_none_or(|max| scatterings <= max) {
                density.add(photon);
                count += 1;
            }
        });
        if out.records() {
            out.record(PathEvent::Photons { count, radius });
        }
        let (light, factor) = density.radiance(self.paths(), radius * radius);
        light.pass_on(path.beta * factor, path.depth + 2, out);
    }
}

impl<'a, A: Accel> IterationIntegrator for ProgressivePhotonIntegrator<'a, A> {
    type PreparationPart = (f32, Vec<Photon>);
    type Preparation = IterationPhotons<'a>;

    fn preparations(&self) -> u32 {
        PhotonTracer::<A>::work_items(self.paths())
    }

    fn prepare<S: Sampler>(
        &self,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Self::PreparationPart {
        let tracer = PhotonTracer {
            world: self.world,
            max_depth: self.max_depth,
            roulette: self.roulette,
            // The camera path estimates direct light, so skip unscattered photons.
            min_scatterings: 1,
        };
        let time = self.world.time_of_iteration(iteration, sampler);
        let item = PhotonWorkItem {
            iteration,
            index,
            paths: self.paths(),
        };
        (time, tracer.work_item(item, Some(time), sampler, out))
    }

    fn join(&self, iteration: u32, parts: Vec<Self::PreparationPart>) -> Self::Preparation {
        let time = parts.first().map_or(0.0, |(time, _)| *time);
        let (camera, ball) = (self.world.camera, self.world.scene.ball());
        let radii = self.radius.of_iteration(iteration, camera, &ball);
        let photons: Vec<Photon> = parts.into_iter().flat_map(|(_, photons)| photons).collect();
        IterationPhotons {
            grid: PhotonGrid::new(photons, &radii, time),
            radii,
            time,
        }
    }

    fn sends_light(&self) -> bool {
        false
    }

    fn sample<S: Sampler>(
        &self,
        prepared: &Self::Preparation,
        key: SampleKey,
        sampler: &mut S,
        out: &mut impl SplatSink,
    ) {
        self.follow(prepared, key, sampler, out);
    }
}

impl<A: Accel> ProgressivePhotonIntegrator<'_, A> {
    fn follow<S: Sampler>(&self, prepared: &IterationPhotons, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let mut path = PathState::new(world.camera_ray(key, Some(prepared.time), sampler, out));
        loop {
            // Find the next surface, and add its emission
            let depth = path.depth;
            let slot = BsdfSlot::new();
            let Some(vertex) = strategy.next_vertex(world, &mut path, None, &slot, out) else {
                return;
            };
            if self.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Add direct light, and the light of photons at the last vertex
            let u = LightNumbers::draw(sampler, depth);
            strategy.add_direct_light(world, &path, &vertex, &u, out);
            let is_last = vertex.bsdf.is_wide();
            if is_last {
                self.add_photons(prepared, &path, &vertex, out);
            }

            // Sample the next direction
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(&vertex, u_lobe, u) else {
                return;
            };
            let direction = vertex.frame.to_world(sample.wi);
            if is_last && !sample.is_delta() && !vertex.is_one_way(direction) {
                // Trace the scattered ray that completes the estimate of direct light
                if strategy.counts_emission_hits() && !(path.beta * sample.weight).is_black() {
                    let mut next = path.after(path.scatter(world, &vertex, &sample, 1.0, 1, out));
                    strategy.next_vertex(world, &mut next, None, &BsdfSlot::new(), out);
                }
                return;
            }
            let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
            let decision = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, judged, decision) else {
                return;
            };
            path.advance(path.scatter(world, &vertex, &sample, factor, 1, out));
        }
    }
}
