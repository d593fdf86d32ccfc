//! Photon mapping with final gathering (Jensen 1996, "Global Illumination using Photon Maps").
//!
//! All photons are sent once, before the first sample (`render/photons.rs`), whatever the crop: crops and parts of a render have the photons of the
//! whole. Caustics, light that delta lobes alone have scattered, are looked up directly. All other indirect light comes by gather rays; the density
//! estimate at their ends uses all photons, those straight from lights included.
//!
//! - Irradiance is not computed ahead at photons (Christensen 1999), which would be some times faster. It would know neither `--max-depth` nor light
//!   groups nor lobes other than matte ones.
//! - A gather ray shorter than the search radius at its end makes that end a vertex of the path, because disks would show in corners.
//! - Where surfaces or lights move, photons are sent within slices of the shutter interval, and each sample looks at the photons of the slice that has
//!   its time. A slice has its share of the paths, and so a larger radius. What moves within a slice is still blurred, by a sixteenth of its way
//!   at most where there are 65,536 paths.
//! - The errors of photons are common to all samples. The variance channel does not contain them, and `embrasure compare` does not test by it.

use super::density::Density;
use super::photons::Photon;
use super::tree::PhotonTree;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::film::Points;
use crate::integrator::path::direct::{Direct, LightNumbers};
use crate::integrator::path::strategy::PrevVertex;
use crate::integrator::path_record;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, Integrator, PathEvent, RayKind, RaySink, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Photon mapping in two passes (Jensen 1996, "Global Illumination using Photon Maps"; Jensen 2001): photons are sent once, and all samples of all
/// pixels look at them, straight at caustics and by final gathering at all else.
///
/// Each path of light is counted once. A path from the camera goes on by delta lobes, and past surfaces that scatter narrowly by any; where it meets
/// a surface that scatters widely ([`crate::bsdf::Bsdf::is_wide`]) it sends rays of directions that the BSDF draws, `gather_rays` the first time and
/// one later. Then
///
/// - light that the path meets on its way is seen, and so is light that a gather ray meets first, by its MIS weight;
/// - light that comes to a vertex straight from a light is sampled there;
/// - light that has been scattered by delta lobes alone comes to wide surfaces as photons of the caustic map, the density of which is estimated
///   there; a gather ray that a delta lobe has sent on meets no light, since that would be the same;
/// - all other light has left, last of all, a surface that scatters it by other than delta lobes: gather rays meet that surface, straight or by
///   delta lobes, where the density of the global map, which has all photons, tells what it scatters.
///
/// Where a gather ray is shorter than the radius of the disk that it looks at, as it is in corners, the disk would show; such an end is treated as
/// a vertex of the path instead.
///
/// The picture is biased, and stays so however many samples are added: densities are means over disks, and the photons are the same
/// for all samples. More photons make both less. The error that photons bring is common to all samples, so that variances do not tell of it.
/// Where things move, samples look at photons of a slice of the shutter interval.
#[derive(Debug)]
pub struct PhotonMapIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Photons that were sent before.
    pub maps: &'a PhotonMaps,
    /// How direct light is found.
    pub strategy: Strategy,
    /// Maximum number of scattering events; `None` means as many as a light's path has room for, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Number of photons of an estimate, at least 2.
    pub photon_count: u32,
    /// Maximum distance of these photons, scene units; `None`: [`FAR_SHARE`] of the radius of the scene in the global map, [`NEAR_SHARE`] in that of caustics.
    pub radius: Option<f32>,
    /// Rays that leave the first wide surface on the way, ≥ 1.
    pub gather_rays: u32,
}

/// Maximum search radius in the global map, over the radius of the scene.
pub const FAR_SHARE: f32 = 0.1;

/// Maximum search radius in the map of caustics, over the radius of the scene: where they have edges, they should be seen.
pub const NEAR_SHARE: f32 = 0.02;

/// The photons of a render, by slices of the shutter interval.
#[derive(Debug)]
pub struct PhotonMaps {
    slices: Vec<PhotonSlice>,
}

/// Photons of a slice of the shutter interval.
#[derive(Debug)]
pub struct PhotonSlice {
    /// All photons.
    pub global: PhotonTree,
    /// Photons whose light has been scattered by delta lobes alone.
    pub caustics: PhotonTree,
    /// Paths that left them.
    pub paths: u32,
}

impl PhotonMaps {
    /// Maps of the photons that `paths` paths left, none of which was left out, in `slices` slices of equal length.
    pub fn new(mut photons: Vec<Photon>, paths: u32, slices: u32) -> Self {
        photons.sort_by_key(|photon| photon.slice);
        let of_slice = |slice: u32| {
            let before = photons.partition_point(|photon| u32::from(photon.slice) < slice);
            let global = photons.split_off(before);
            let caustics = global.iter().filter(|photon| photon.is_caustic).copied();
            PhotonSlice {
                caustics: PhotonTree::new(caustics.collect()),
                global: PhotonTree::new(global),
                // Paths take turns.
                paths: paths.saturating_sub(slice).div_ceil(slices),
            }
        };
        // Each takes the end of what is left.
        let mut slices: Vec<PhotonSlice> = (0..slices).rev().map(of_slice).collect();
        slices.reverse();
        Self { slices }
    }

    /// Slice at the share `u` of the shutter interval; `None` where there is none.
    pub fn at(&self, u: f32) -> Option<&PhotonSlice> {
        let last = self.slices.len().checked_sub(1)?;
        self.slices.get(((u * self.slices.len() as f32) as usize).min(last))
    }
}

/// Purpose of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Purpose {
    /// To see, with all light that it meets.
    See,
    /// To gather what the surface that it meets scatters. Before its last delta lobe it has come so far.
    Gather { length: f32, after_delta: bool },
}

/// A ray that is still to be traced, with the state of its path.
struct QueuedRay {
    ray: Ray,
    purpose: Purpose,
    /// Scatterings so far.
    depth: u32,
    /// Number of the gather ray that the path follows, from 1 on; 0 before the path branches.
    branch: u32,
    /// Throughput.
    beta: Spectrum,
    /// Squared indices of refraction that `beta` has been divided by.
    roulette_scale: f32,
    prev: Option<PrevVertex>,
}

impl QueuedRay {
    /// The block of random numbers of the vertex where it ends.
    fn block(&self) -> u32 {
        const DEPTHS: u32 = 64;
        self.branch * DEPTHS + self.depth.min(DEPTHS - 1)
    }
}

impl<A: Accel> Integrator for PhotonMapIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let ray = self.world.camera_ray(key, None, sampler, out);
        let mut segments = vec![QueuedRay {
            ray,
            purpose: Purpose::See,
            depth: 0,
            branch: 0,
            beta: Spectrum::ONE,
            roulette_scale: 1.0,
            prev: None,
        }];
        while let Some(segment) = segments.pop().filter(|_| !out.is_cancelled()) {
            let radiance = self.follow(segment, sampler, &mut segments, out);
            out.radiance(radiance);
        }
    }
}

impl<A: Accel> PhotonMapIntegrator<'_, A> {
    /// The light that `segment` finds where it ends; what goes on from there is added to `segments`.
    fn follow<S: Sampler, R: Gathered>(
        &self,
        segment: QueuedRay,
        sampler: &S,
        segments: &mut Vec<QueuedRay>,
        out: &mut impl Sink<Radiance = R>,
    ) -> R {
        let (world, strategy) = (&self.world, &self.strategy);
        let QueuedRay {
            ray, depth, mut beta, ..
        } = segment;
        let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
        let (hit, transmittance) = world.intersect(&ray, kind, out);
        beta *= transmittance;
        if depth == 0 && hit.is_none() && world.see_background(&ray, beta, out) {
            return R::default();
        }
        let slot = BsdfSlot::new();
        let vertex = hit.map(|hit| world.vertex(&hit, &ray, &slot));
        let met = hit.as_ref().zip(vertex.as_ref());
        let mut emitted = R::default();
        let prev = segment.prev.as_ref();
        strategy.found(world.scene, &ray, prev, Spectrum::ONE, met, |light| emitted += light);
        let is_caustic = matches!(segment.purpose, Purpose::Gather { after_delta: true, .. });
        let mut radiance = if is_caustic { R::default() } else { emitted * beta };
        if let Some(met) = met {
            path_record::vertex(depth, met, beta, out);
        }
        if !is_caustic {
            strategy.record_emitted(world.scene, &ray, prev, met, out);
            path_record::light(radiance.sum(), out);
        }
        let Some((hit, vertex)) = met else { return radiance };
        if depth == 0 {
            let mut first = world.first_surface(hit, vertex);
            if let Some(features) = &mut first.features {
                features.points = self.photons_at(vertex);
            }
            out.first_surface(first);
        }
        if self.max_depth.is_some_and(|max| depth >= max) {
            return radiance;
        }

        // A gather ray ends with the density of photons, unless it is too short
        let is_delta = vertex.bsdf.is_delta();
        let mut gathered = None;
        if let Purpose::Gather { length, .. } = segment.purpose {
            let length = length + hit.t;
            let (found, radius) = match is_delta {
                true => (R::default(), 0.0),
                false => self.recorded_density(|slice| (&slice.global, FAR_SHARE), vertex, depth, out),
            };
            if length > radius {
                let found = found * beta;
                path_record::light(found.sum(), out);
                radiance += found;
                gathered = Some(length);
            }
        }

        // Else direct light and caustics
        let block = segment.block();
        if gathered.is_none() {
            let u = LightNumbers::draw(sampler, block);
            let direct = Direct::sample(world, vertex, strategy, 1, &u, out).arrives(world, out) * beta;
            path_record::light(direct.sum(), out);
            radiance += direct;
            if vertex.bsdf.is_wide() {
                let (caustics, _) =
                    self.recorded_density::<R>(|slice| (&slice.caustics, NEAR_SHARE), vertex, depth, out);
                let caustics = caustics * beta;
                path_record::light(caustics.sum(), out);
                radiance += caustics;
            }
        }

        // On, by several rays the first time
        let parts = gathered.is_none() && vertex.bsdf.is_wide() && segment.branch == 0;
        let rays = if parts { self.gather_rays } else { 1 };
        for index in 0..rays {
            let branch = if parts { 1 + index } else { segment.branch };
            let numbers = if parts { branch << 6 | block } else { block };
            let u_lobe = sampler.get_1d(Dimension::bounce(numbers, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(numbers, Bounce::Direction));
            let Some(sample) = strategy.directions.sample(vertex, u_lobe, u) else {
                continue;
            };
            let was_gathering = matches!(segment.purpose, Purpose::Gather { .. });
            // No photon has brought light from beyond the horizon: the path goes on, as if the camera had seen the vertex.
            let ray = world.ray_along(vertex, sample.wi);
            let is_one_way = !sample.is_delta() && vertex.is_one_way(ray.direction);
            let purpose = match (gathered, sample.is_delta()) {
                _ if is_one_way => Purpose::See,
                (Some(length), true) => Purpose::Gather {
                    length,
                    after_delta: true,
                },
                // What other lobes scatter has been gathered.
                (Some(_), false) => continue,
                // Light that comes by a delta lobe to a vertex that a gather ray has met is a caustic where that ray comes from, if it is scattered
                // no more.
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
            let beta = beta * sample.weight / rays as f32;
            let roulette_scale = segment.roulette_scale * sample.eta * sample.eta;
            let decision = sampler.get_2d(Dimension::bounce(numbers, Bounce::Decisions)).y;
            // That there are many of them is no reason to end.
            let judged = beta * (roulette_scale * rays as f32);
            let Some(factor) = self.roulette.play(depth, judged, decision) else {
                continue;
            };
            path_record::scatter(depth, vertex, &sample, factor / rays as f32, out);
            segments.push(QueuedRay {
                ray,
                purpose,
                depth: depth + 1,
                branch,
                beta: beta * factor,
                roulette_scale: roulette_scale * if parts { rays as f32 } else { 1.0 },
                // Lights are not sampled where photons are gathered.
                prev: (gathered.is_none() || !is_one_way).then(|| PrevVertex::new(vertex, &sample, 1)),
            });
        }
        radiance
    }

    /// Photons about `vertex`, which the camera sees first.
    fn photons_at(&self, vertex: &Vertex) -> Points {
        let point = &vertex.point;
        let slice = self.maps.at(self.world.camera.share_of_shutter(point.time));
        let Some(slice) = slice.filter(|_| !vertex.bsdf.is_delta()) else {
            return Points::default();
        };
        let density = Density::<Spectrum>::new(self.world.scene, vertex);
        let counts = |photon: &Photon| density.is_of_surface(photon);
        let dot = 0.5 * self.world.camera.pixel_width(point.p, point.time);
        let max = self.max_distance(FAR_SHARE);
        let nearest = slice.global.nearest(point.p, self.photon_count as usize, max, counts);
        // The search leaves out the farthest of as many as are asked for.
        let is_dot = !slice.global.nearest(point.p, 2, dot, counts).photons.is_empty();
        let (caustics, ..) = self.density::<Spectrum>(|slice| (&slice.caustics, NEAR_SHARE), vertex, 0);
        Points {
            dot: f32::from(u8::from(is_dot)),
            radius: nearest.squared.sqrt(),
            count: nearest.photons.len() as f32,
            caustics: caustics.luminance(),
            gradient: 0.0,
        }
    }

    /// Maximum distance of photons that count: as it is set, or `share` of the radius of the scene.
    fn max_distance(&self, share: f32) -> f32 {
        self.radius.unwrap_or_else(|| share * self.world.scene.ball().radius)
    }

    /// [`PhotonMapIntegrator::density`] without the number of photons, which is recorded where paths are.
    fn recorded_density<R: Gathered>(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        vertex: &Vertex,
        depth: u32,
        out: &mut impl RaySink,
    ) -> (R, f32) {
        let (radiance, radius, count) = self.density(map, vertex, depth);
        if out.records() {
            out.record(PathEvent::Photons { count, radius });
        }
        (radiance, radius)
    }

    /// The light of photons that `vertex` scatters, after `depth` scatterings of the path, how far they reach, and how many count. `map` says of which photons of a
    /// slice, and their maximum distance over the radius of the scene.
    fn density<R: Gathered>(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        vertex: &Vertex,
        depth: u32,
    ) -> (R, f32, u32) {
        let scene = self.world.scene;
        let Some(slice) = self.maps.at(self.world.camera.share_of_shutter(vertex.point.time)) else {
            return (R::default(), 0.0, 0);
        };
        let (map, share) = map(slice);
        let max = self.max_distance(share);
        let mut density = Density::new(scene, vertex);
        let nearest = map.nearest(vertex.point.p, self.photon_count as usize, max, |photon| {
            let scatterings = depth + 1 + photon.scatterings as u32;
            self.max_depth.is_none_or(|max| scatterings <= max) && density.is_of_surface(photon)
        });
        for photon in &nearest.photons {
            density.add(photon);
        }
        (
            density.radiance(slice.paths, nearest.squared),
            nearest.squared.sqrt(),
            nearest.photons.len() as u32,
        )
    }
}
