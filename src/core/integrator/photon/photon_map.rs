//! Photon mapping with final gathering (Jensen 1996, "Global Illumination using Photon Maps").
//!
//! All photons are traced once, before the first sample (`render/photons.rs`), for the whole image,
//! even if only a crop or a part is rendered. Caustics are light that only delta lobes have
//! scattered. Their density is estimated directly at the vertex. Gather rays find all other
//! indirect light. The density estimate at the end of a gather ray uses all photons, including
//! unscattered photons.
//!
//! - Irradiance is not precomputed at photons (Christensen 1999). Precomputed irradiance would be
//!   several times faster, but would not support `--max-depth`, light groups, or lobes that are not
//!   matte.
//! - If a gather ray is shorter than the search radius at its end, the end becomes a vertex of the
//!   path. Otherwise the disk of the estimate would be visible in corners.
//! - If surfaces or lights move, each photon belongs to a slice of the shutter interval. Each
//!   sample uses the photons of the slice that contains its time. A slice has a fraction of the
//!   light paths, and so a larger search radius. Motion within a slice is still blurred, by at most
//!   a sixteenth of the motion with 65,536 paths.
//! - The errors of photons are common to all samples. The variance channel does not contain these
//!   errors. So `embrasure compare` does not use the variance channel of such images.

use super::density::Density;
use super::photons::Photon;
use super::tree::PhotonTree;
use crate::accel::Accel;
use crate::film::Points;
use crate::integrator::found_light::LightSum;
use crate::integrator::path::direct::LightNumbers;
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Integrator, PathEvent, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Photon mapping in two passes (Jensen 1996, "Global Illumination using Photon Maps"; Jensen
/// 2001). Photons are traced once. All samples of all pixels use these photons, directly for
/// caustics and by final gathering for all other indirect light.
///
/// Each path of light from a lamp to the camera is estimated in exactly one way. A camera path
/// continues by delta lobes, and at surfaces that scatter narrowly by any lobe. At a surface that
/// scatters widely ([`crate::bsdf::Bsdf::is_wide`]) the path traces rays sampled from the BSDF:
/// `gather_rays` rays the first time and one ray later. The light consists of these parts:
///
/// - emission that the path hits, or that a gather ray hits first, with its MIS weight;
/// - direct light, from light sampling at each vertex;
/// - light scattered only by delta lobes. This light arrives at wide surfaces as photons of the
///   caustic map, whose density is estimated there. A gather ray after a delta lobe therefore adds
///   no emission, because this is the same light;
/// - all other light. It was scattered by a smooth lobe of some surface, and after that only by
///   delta lobes. Gather rays hit that surface, directly or by delta lobes. The density of the
///   global map, which has all photons, gives the light that the surface scatters.
///
/// If a gather ray is shorter than the radius of the disk at its end, as in corners, the disk would
/// be visible in the image. The end of such a ray becomes a vertex of the path instead.
///
/// The image is biased for any number of samples, because densities are means over disks. The
/// photons are the same for all samples, so their error is common to all samples, and variances do
/// not contain it. More photons reduce bias and error. If objects move, samples use the photons of
/// a slice of the shutter interval.
#[derive(Debug)]
pub struct PhotonMapIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Photon maps, made before the first sample.
    pub maps: &'a PhotonMaps,
    /// Sampling options for direct light.
    pub strategy: Strategy,
    /// Maximum number of scattering events. `None`: the maximum of a light path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Number of photons of a density estimate, at least 2.
    pub photon_count: u32,
    /// Maximum distance of these photons, in scene units. `None`: [`FAR_SHARE`] times the radius of
    /// the scene in the global map, [`NEAR_SHARE`] times this radius in the caustic map.
    pub radius: Option<f32>,
    /// Number of gather rays from the first wide surface of a path, ≥ 1.
    pub gather_rays: u32,
}

/// Maximum search radius in the global map, relative to the radius of the scene.
pub const FAR_SHARE: f32 = 0.1;

/// Maximum search radius in the caustic map, relative to the radius of the scene. It is smaller
/// than [`FAR_SHARE`] because caustics have edges.
pub const NEAR_SHARE: f32 = 0.02;

/// Photon maps of a render, one pair of maps for each slice of the shutter interval.
#[derive(Debug)]
pub struct PhotonMaps {
    slices: Vec<PhotonSlice>,
}

/// Photon maps of one slice of the shutter interval.
#[derive(Debug)]
pub struct PhotonSlice {
    /// Global map: all photons of the slice.
    pub global: PhotonTree,
    /// Caustic map: photons scattered only by delta lobes.
    pub caustics: PhotonTree,
    /// Number of light paths that were traced for the slice.
    pub paths: u32,
}

impl PhotonMaps {
    /// Maps of `photons`, the photons of `paths` light paths. The shutter interval has `slices`
    /// slices of equal length.
    pub fn new(mut photons: Vec<Photon>, paths: u32, slices: u32) -> Self {
        photons.sort_by_key(|photon| photon.slice);
        let of_slice = |slice: u32| {
            let before = photons.partition_point(|photon| u32::from(photon.slice) < slice);
            let global = photons.split_off(before);
            let caustics = global.iter().filter(|photon| photon.is_caustic).copied();
            PhotonSlice {
                caustics: PhotonTree::new(caustics.collect()),
                global: PhotonTree::new(global),
                // Light paths are assigned to the slices in turn.
                paths: paths.saturating_sub(slice).div_ceil(slices),
            }
        };
        // Split off the slices from the end of the sorted photons.
        let mut slices: Vec<PhotonSlice> = (0..slices).rev().map(of_slice).collect();
        slices.reverse();
        Self { slices }
    }

    /// Maps of the slice at the fraction `u` of the shutter interval. `None` if there are no
    /// slices.
    pub fn at(&self, u: f32) -> Option<&PhotonSlice> {
        let last = self.slices.len().checked_sub(1)?;
        self.slices.get(((u * self.slices.len() as f32) as usize).min(last))
    }
}

/// Purpose of a ray: the light that it adds.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Purpose {
    /// Adds the emission that the ray hits, and continues as a camera path.
    See,
    /// Gather ray: adds the light that the surface at its end scatters. `length` is the distance
    /// along the gather ray from its start to its last delta lobe; 0 if it met none. `after_delta`
    /// is true if the ray leaves a delta lobe.
    Gather { length: f32, after_delta: bool },
}

/// A path whose last ray is not traced yet.
struct QueuedPath {
    path: PathState,
    purpose: Purpose,
    /// Number of the path's gather ray, counted from 1; 0 before the path has a gather ray.
    branch: u32,
}

impl QueuedPath {
    /// Index of the block of random numbers for the vertex at the end of the ray.
    fn block(&self) -> u32 {
        const DEPTHS: u32 = 64;
        self.branch * DEPTHS + self.path.depth.min(DEPTHS - 1)
    }
}

impl<A: Accel> Integrator for PhotonMapIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let ray = self.world.camera_ray(key, None, sampler, out);
        let mut queue = vec![QueuedPath {
            path: PathState::new(ray),
            purpose: Purpose::See,
            branch: 0,
        }];
        while let Some(next) = queue.pop().filter(|_| !out.is_cancelled()) {
            self.follow(next, sampler, &mut queue, out);
        }
    }
}

impl<A: Accel> PhotonMapIntegrator<'_, A> {
    /// Traces the ray of `queued`, and adds the light that the ray finds. Adds the next rays to
    /// `queue`.
    fn follow<S: Sampler>(&self, queued: QueuedPath, sampler: &S, queue: &mut Vec<QueuedPath>, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let block = queued.block();
        let mut path = queued.path;
        let depth = path.depth;
        let slot = BsdfSlot::new();
        let Some(vertex) = strategy.next_vertex(world, &mut path, None, &slot, out) else {
            return;
        };
        if depth == 0 && world.features {
            let mut first = world.first_surface(&vertex, out);
            if let Some(features) = &mut first.features {
                features.points = self.photons_at(&vertex);
            }
            out.first_surface(first);
        }
        if self.max_depth.is_some_and(|max| depth >= max) {
            return;
        }

        // End a gather ray with a density estimate, unless the ray is too short
        let mut gathered = None;
        if let Purpose::Gather { length, .. } = queued.purpose {
            let length = length + vertex.hit.t;
            let density = (!vertex.bsdf.is_delta())
                .then(|| self.recorded_density(|slice| (&slice.global, FAR_SHARE), depth, &vertex, out));
            if length > density.as_ref().map_or(0.0, |density| density.radius) {
                density.into_iter().for_each(|density| density.pass_on(&path, out));
                gathered = Some(length);
            }
        }

        // Otherwise, add direct light and caustics
        if gathered.is_none() {
            let u = LightNumbers::draw(sampler, block);
            strategy.add_direct_light(world, &path, &vertex, &u, out);
            if vertex.bsdf.is_wide() {
                self.recorded_density(|slice| (&slice.caustics, NEAR_SHARE), depth, &vertex, out)
                    .pass_on(&path, out);
            }
        }

        // Sample the next rays: several rays at the first wide surface
        let parts = gathered.is_none() && vertex.bsdf.is_wide() && queued.branch == 0;
        let rays = if parts { self.gather_rays } else { 1 };
        for index in 0..rays {
            let branch = if parts { 1 + index } else { queued.branch };
            let numbers = if parts { branch << 6 | block } else { block };
            let u_lobe = sampler.get_1d(Dimension::bounce(numbers, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(numbers, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(&vertex, u_lobe, u) else {
                continue;
            };
            let was_gathering = matches!(queued.purpose, Purpose::Gather { .. });
            // No photon comes from below the horizon, so the path continues there as a camera path.
            let is_one_way = !sample.is_delta() && vertex.is_one_way(vertex.frame.to_world(sample.wi));
            let purpose = match (gathered, sample.is_delta()) {
                _ if is_one_way => Purpose::See,
                (Some(length), true) => Purpose::Gather {
                    length,
                    after_delta: true,
                },
                // The density estimate at this vertex includes the light of all lobes that are not
                // delta lobes.
                (Some(_), false) => continue,
                // Light that arrives at the end of a gather ray directly by a delta lobe is a
                // caustic at the start of the gather ray.
                (None, true) if was_gathering => Purpose::Gather {
                    length: 0.0,
                    after_delta: true,
                },
                (None, false) if vertex.bsdf.is_wide() => Purpose::Gather {
                    length: 0.0,
                    after_delta: false,
                },
                (None, _) => Purpose::See,
            };
            // The number of gather rays must not change the survival probability.
            let eta_squared = sample.eta * sample.eta;
            let judged = path.beta * sample.weight * (path.roulette_scale * eta_squared);
            let decision = sampler.get_2d(Dimension::bounce(numbers, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, judged, decision) else {
                continue;
            };
            let next = path.after(path.scatter(world, &vertex, &sample, factor / rays as f32, 1, out));
            queue.push(QueuedPath {
                path: PathState {
                    roulette_scale: next.roulette_scale * rays as f32,
                    // If photons were gathered, lights were not sampled: emission then has the
                    // weight 1.
                    prev: next.prev.filter(|_| gathered.is_none() || !is_one_way),
                    // Behind a delta lobe, emission is part of the caustic map.
                    skips_emission: matches!(purpose, Purpose::Gather { after_delta: true, .. }),
                    ..next
                },
                purpose,
                branch,
            });
        }
    }

    /// Statistics of the photons around `vertex`, the first vertex of a camera path, for the
    /// auxiliary channels.
    fn photons_at(&self, vertex: &Vertex) -> Points {
        let point = &vertex.point;
        let slice = self.maps.at(self.world.camera.share_of_shutter(point.time));
        let Some(slice) = slice.filter(|_| !vertex.bsdf.is_delta()) else {
            return Points::default();
        };
        let density = Density::new(self.world.scene, vertex, false);
        let counts = |photon: &Photon| density.is_of_surface(photon);
        let dot = 0.5 * self.world.camera.pixel_width(point.p, point.time);
        let max = self.max_distance(FAR_SHARE);
        let nearest = slice.global.nearest(point.p, self.photon_count as usize, max, counts);
        // Search for two photons, because the search does not return the farthest photon.
        let is_dot = !slice.global.nearest(point.p, 2, dot, counts).photons.is_empty();
        let caustics = self.density(|slice| (&slice.caustics, NEAR_SHARE), 0, vertex, false);
        Points {
            dot: f32::from(u8::from(is_dot)),
            radius: nearest.squared.sqrt(),
            count: nearest.photons.len() as f32,
            caustics: (caustics.light.radiance * caustics.factor).luminance(),
            gradient: 0.0,
        }
    }

    /// Maximum search radius: the option `radius`, or `share` times the radius of the scene.
    fn max_distance(&self, share: f32) -> f32 {
        self.radius.unwrap_or_else(|| share * self.world.scene.ball().radius)
    }

    /// [`PhotonMapIntegrator::density`], which also records the number of photons.
    fn recorded_density(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        depth: u32,
        vertex: &Vertex,
        out: &mut impl Sink,
    ) -> PhotonLight {
        let light = self.density(map, depth, vertex, out.separates_parts());
        if out.records() {
            let (count, radius) = (light.count, light.radius);
            out.record(PathEvent::Photons { count, radius });
        }
        light
    }

    /// Estimates the light that arrives as photons and that `vertex` scatters. The vertex is after
    /// `depth` scattering events of the camera path. `map` selects a map of a slice, and its
    /// maximum search radius relative to the radius of the scene.
    fn density(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        depth: u32,
        vertex: &Vertex,
        has_parts: bool,
    ) -> PhotonLight {
        let scene = self.world.scene;
        let Some(slice) = self.maps.at(self.world.camera.share_of_shutter(vertex.point.time)) else {
            return PhotonLight::default();
        };
        let (map, share) = map(slice);
        let max = self.max_distance(share);
        let mut density = Density::new(scene, vertex, has_parts);
        let nearest = map.nearest(vertex.point.p, self.photon_count as usize, max, |photon| {
            let scatterings = depth + 1 + photon.scatterings as u32;
            self.max_depth.is_none_or(|max| scatterings <= max) && density.is_of_surface(photon)
        });
        for photon in &nearest.photons {
            density.add(photon);
        }
        let (light, factor) = density.radiance(slice.paths, nearest.squared);
        PhotonLight {
            light,
            factor,
            radius: nearest.squared.sqrt(),
            count: nearest.photons.len() as u32,
        }
    }
}

/// Result of a density estimate: light of the photons near a vertex.
#[derive(Default)]
struct PhotonLight {
    light: LightSum,
    /// Factor that converts `light` to radiance.
    factor: f32,
    /// Distance of the farthest photon, in scene units.
    radius: f32,
    /// Number of photons of the estimate.
    count: u32,
}

impl PhotonLight {
    /// Passes the light that the vertex scatters along `path` to the sink `out`.
    fn pass_on(&self, path: &PathState, out: &mut impl Sink) {
        self.light.pass_on(path.beta * self.factor, path.depth + 2, out);
    }
}
