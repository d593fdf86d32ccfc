//! Stochastic progressive photon mapping whose iterations are independent of each other.
//!
//! Hachisuka and Jensen (2009) keep a radius, a count and a flux for each pixel, and shrink the radius by what each iteration finds: an iteration
//! then depends on all iterations before it. Knaus and Zwicker (2011) make the radius a function of the iteration's index alone and prove the same
//! convergence. The second form is in use, because its iterations are samples like any others: a render that is stopped, split, merged or cropped has
//! the same bits, and pixels have no state.
//!
//! The price is that radii do not follow the local density of photons. A caustic, which has many photons, could do with smaller disks, and a dark
//! corner with larger ones. Instead the first radius is a multiple of a pixel's width at the distance of the point, so that near and far surfaces
//! look alike. `--photon-radius` sets one length for the whole scene.

use super::density::Density;
use super::grid::PhotonGrid;
use super::photons::{Photon, PhotonTracer};
use crate::accel::Accel;
use crate::integrator::path::direct::{Direct, LightNumbers, trace};
use crate::integrator::path::state::PathState;
use crate::integrator::search_radius::{ProgressiveRadius, Radii};
use crate::integrator::vertex::Vertex;
use crate::integrator::{IterationIntegrator, PathEvent, RaySink, Roulette, Sink, SplatSink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Stochastic progressive photon mapping (Hachisuka and Jensen 2009), in the form of Knaus and Zwicker (2011, "Progressive Photon Mapping: A
/// Probabilistic Approach"): every iteration sends photons anew, looks at them within a radius that its index alone decides, and is an estimate by
/// itself.
///
/// An iteration's estimate is biased, by the blur of its radius; iterations differ in that, and their mean comes as near to the picture as is wanted. With
/// radii that shrink as `r²ᵢ₊₁ / r²ᵢ = (i + α) / (i + 1)` the variance of the mean falls as `n^−α`, and its bias as `n^(α − 1)` (Knaus and Zwicker,
/// §3.3).
///
/// Each path of light is counted once. A path from the camera goes on by delta lobes, and past surfaces that scatter narrowly by any; where it meets
/// a surface that scatters widely ([`crate::bsdf::Bsdf::is_wide`]) its way ends. Then
///
/// - light that it meets on its way is seen: all of it behind a delta lobe, or at the camera, and by its MIS weight behind others;
/// - light that comes to a vertex straight from a light and leaves it by other than delta lobes is sampled there, and met by a ray of a random
///   direction, weighed by MIS;
/// - light that comes to the last vertex after having been scattered once or more, and leaves it by other than delta lobes, is that of photons, which
///   are kept from their first scattering on;
/// - light that leaves the last vertex by delta lobes, or comes there from beyond the horizon of its shading or geometric normal, is found by going on:
///   no photon brings it.
#[derive(Debug)]
pub struct ProgressivePhotonIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How direct light is found.
    pub strategy: Strategy,
    /// Maximum number of scattering events; `None` means as many as a light's path has room for, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Light paths of an iteration; `None`: as many as the image has pixels.
    pub photons: Option<u32>,
    /// Search radius.
    pub radius: ProgressiveRadius,
}

/// Photons of one iteration.
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

    /// Adds the light that photons have brought to `vertex`, which `path` has found.
    fn add_photons(&self, prepared: &IterationPhotons, path: &PathState, vertex: &Vertex, out: &mut impl Sink) {
        let point = &vertex.point;
        let radius = prepared.radii.at(point.p, point.time);
        let mut density = Density::new(self.world.scene, vertex, out.tells_parts());
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
        light.tell(path.beta * factor, path.depth + 2, out);
    }
}

impl<'a, A: Accel> IterationIntegrator for ProgressivePhotonIntegrator<'a, A> {
    type Part = (f32, Vec<Photon>);
    type Prepared = IterationPhotons<'a>;

    fn preparations(&self) -> u32 {
        PhotonTracer::<A>::work_items(self.paths())
    }

    fn prepare<S: Sampler>(&self, iteration: u32, index: u32, sampler: &mut S, out: &mut impl RaySink) -> Self::Part {
        let tracer = PhotonTracer {
            world: self.world,
            max_depth: self.max_depth,
            roulette: self.roulette,
            // What comes straight from lights is sampled where it is seen.
            min_scatterings: 1,
        };
        let time = self.world.time_of_iteration(iteration, sampler);
        (
            time,
            tracer.work_item((iteration, index), self.paths(), Some(time), sampler, out),
        )
    }

    fn join(&self, iteration: u32, parts: Vec<Self::Part>) -> Self::Prepared {
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

    fn sample<S: Sampler>(&self, prepared: &Self::Prepared, key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        self.follow(prepared, key, sampler, out);
    }
}

impl<A: Accel> ProgressivePhotonIntegrator<'_, A> {
    fn follow<S: Sampler>(&self, prepared: &IterationPhotons, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let mut path = PathState::new(world.camera_ray(key, Some(prepared.time), sampler, out));
        loop {
            // Find the next surface, and add emitted light
            let depth = path.depth;
            let slot = BsdfSlot::new();
            let vertex = path.next_vertex(world, None, &slot, out);
            strategy.add_found(world, &path, vertex.as_ref(), out);
            let Some(vertex) = vertex else { return };
            if self.max_depth.is_some_and(|max| depth >= max) {
                return;
            }

            // Direct light, and that of photons
            let u = LightNumbers::draw(sampler, depth);
            let direct = Direct::sample(world, (&path, &vertex), strategy, 1, &u, out);
            trace(direct, world, (&path, &vertex), out);
            let is_last = vertex.bsdf.is_wide();
            if is_last {
                self.add_photons(prepared, &path, &vertex, out);
            }

            // On
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(&vertex, u_lobe, u) else {
                return;
            };
            let direction = vertex.frame.to_world(sample.wi);
            if is_last && !sample.is_delta() && !vertex.is_one_way(direction) {
                // The other half of the estimate of direct light
                if strategy.meets_lights() && !(path.beta * sample.weight).is_black() {
                    let mut next = path.after(path.scatter(world, &vertex, &sample, (1.0, 1), out));
                    let slot = BsdfSlot::new();
                    let vertex = next.next_vertex(world, None, &slot, out);
                    strategy.add_found(world, &next, vertex.as_ref(), out);
                }
                return;
            }
            let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
            let decision = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, judged, decision) else {
                return;
            };
            path.go_on(path.scatter(world, &vertex, &sample, (factor, 1), out));
        }
    }
}
