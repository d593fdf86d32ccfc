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
use crate::film::Points;
use crate::integrator::found_light::LightSum;
use crate::integrator::path::direct::{Direct, LightNumbers, trace};
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Integrator, PathEvent, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
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

/// A path whose ray is still to be traced.
struct QueuedPath {
    path: PathState,
    purpose: Purpose,
    /// Number of the gather ray that the path follows, from 1 on; 0 before the path branches.
    branch: u32,
}

impl QueuedPath {
    /// The block of random numbers of the vertex where its ray ends.
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
    /// Adds the light that `queued` finds where its ray ends; what goes on from there is added to
    /// `queue`.
    fn follow<S: Sampler>(&self, queued: QueuedPath, sampler: &S, queue: &mut Vec<QueuedPath>, out: &mut impl Sink) {
        let (world, strategy) = (&self.world, &self.strategy);
        let block = queued.block();
        let mut path = queued.path;
        let depth = path.depth;
        let slot = BsdfSlot::new();
        let vertex = path.next_vertex(world, None, &slot, out);
        strategy.add_found(world, &path, vertex.as_ref(), out);
        let Some(vertex) = vertex else { return };
        if depth == 0 && world.features {
            let mut first = world.first_surface(&vertex);
            if let Some(features) = &mut first.features {
                features.points = self.photons_at(&vertex);
            }
            out.first_surface(first);
        }
        if self.max_depth.is_some_and(|max| depth >= max) {
            return;
        }

        // A gather ray ends with the density of photons, unless it is too short
        let mut gathered = None;
        if let Purpose::Gather { length, .. } = queued.purpose {
            let length = length + vertex.hit.t;
            let density = (!vertex.bsdf.is_delta())
                .then(|| self.recorded_density(|slice| (&slice.global, FAR_SHARE), (depth, &vertex), out));
            if length > density.as_ref().map_or(0.0, |density| density.radius) {
                density.into_iter().for_each(|density| density.tell(&path, out));
                gathered = Some(length);
            }
        }

        // Else direct light and caustics
        if gathered.is_none() {
            let u = LightNumbers::draw(sampler, block);
            let direct = Direct::sample(world, (&path, &vertex), strategy, 1, &u, out);
            trace(direct, world, (&path, &vertex), out);
            if vertex.bsdf.is_wide() {
                self.recorded_density(|slice| (&slice.caustics, NEAR_SHARE), (depth, &vertex), out)
                    .tell(&path, out);
            }
        }

        // On, by several rays the first time
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
            // No photon has brought light from beyond the horizon: the path goes on, as if the camera had seen the vertex.
            let is_one_way = !sample.is_delta() && vertex.is_one_way(vertex.frame.to_world(sample.wi));
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
            // That there are many of them is no reason to end.
            let eta_squared = sample.eta * sample.eta;
            let judged = path.beta * sample.weight * (path.roulette_scale * eta_squared);
            let decision = sampler.get_2d(Dimension::bounce(numbers, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, judged, decision) else {
                continue;
            };
            let next = path.after(path.scatter(world, &vertex, &sample, (factor / rays as f32, 1), out));
            queue.push(QueuedPath {
                path: PathState {
                    roulette_scale: next.roulette_scale * rays as f32,
                    // Lights are not sampled where photons are gathered.
                    prev: next.prev.filter(|_| gathered.is_none() || !is_one_way),
                    // Such light is a caustic.
                    skips_emission: matches!(purpose, Purpose::Gather { after_delta: true, .. }),
                    ..next
                },
                purpose,
                branch,
            });
        }
    }

    /// Photons about `vertex`, which the camera sees first.
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
        // The search leaves out the farthest of as many as are asked for.
        let is_dot = !slice.global.nearest(point.p, 2, dot, counts).photons.is_empty();
        let caustics = self.density(|slice| (&slice.caustics, NEAR_SHARE), (0, vertex), false);
        Points {
            dot: f32::from(u8::from(is_dot)),
            radius: nearest.squared.sqrt(),
            count: nearest.photons.len() as f32,
            caustics: (caustics.light.radiance * caustics.factor).luminance(),
            gradient: 0.0,
        }
    }

    /// Maximum distance of photons that count: as it is set, or `share` of the radius of the scene.
    fn max_distance(&self, share: f32) -> f32 {
        self.radius.unwrap_or_else(|| share * self.world.scene.ball().radius)
    }

    /// [`PhotonMapIntegrator::density`], whose number of photons is recorded.
    fn recorded_density(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        met: (u32, &Vertex),
        out: &mut impl Sink,
    ) -> PhotonLight {
        let light = self.density(map, met, out.tells_parts());
        if out.records() {
            let (count, radius) = (light.count, light.radius);
            out.record(PathEvent::Photons { count, radius });
        }
        light
    }

    /// The light of photons that `vertex` scatters, after `depth` scattering events of the path. `map` says of which photons of a slice,
    /// and their maximum distance over the radius of the scene.
    fn density(
        &self,
        map: impl Fn(&PhotonSlice) -> (&PhotonTree, f32),
        (depth, vertex): (u32, &Vertex),
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

/// Light of photons near a vertex.
#[derive(Default)]
struct PhotonLight {
    light: LightSum,
    /// Factor of the light.
    factor: f32,
    /// Distance of the farthest photon.
    radius: f32,
    /// Number of photons.
    count: u32,
}

impl PhotonLight {
    /// Tells `out` the light that the vertex scatters along `path`.
    fn tell(&self, path: &PathState, out: &mut impl Sink) {
        self.light.tell(path.beta * self.factor, path.depth + 2, out);
    }
}
