//! Photon tracing: light paths that store a photon at each vertex that can scatter light to a
//! viewer. `bidirectional/subpath` traces the paths.

use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::bidirectional::connection::Connector;
use crate::integrator::bidirectional::subpath::PathVertex;
use crate::integrator::{Heuristic, RaySink, Roulette, World};
use crate::light::LightId;
use crate::math::Vec3;
use crate::sampler::{Dimension, SampleKey, Sampler, Stream};

/// Photon: light that arrives at a surface at the end of a light path (Jensen 1996, "Global
/// Illumination using Photon Maps").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Position in world space.
    p: [f32; 3],
    /// Unit direction towards the previous vertex, world space.
    wi: [f32; 3],
    /// Unit geometric normal of the surface.
    ng: [f32; 3],
    /// Power in W, as if the photon's path carried all the light of the scene. The flux is the mean
    /// over all paths, including paths without a photon.
    power: [f32; 3],
    /// Light source of the photon.
    pub light: LightId,
    /// Number of scattering events of the path before the photon.
    pub scatterings: u16,
    /// Index of the slice of the shutter interval that contains the photon's time
    /// ([`PhotonTracer::slices`]).
    pub slice: u8,
    /// True if the photon is part of a caustic: its path has scattered at least once, and only by
    /// delta lobes.
    pub is_caustic: bool,
}

impl Photon {
    /// An unscattered photon of the light `light` at the point `p`, on a surface with unit normal
    /// `ng`. It has the power `power` and comes from the unit direction `wi`.
    pub fn new(light: LightId, p: Vec3, ng: Vec3, wi: Vec3, power: Spectrum) -> Self {
        Self {
            p: p.to_array(),
            wi: wi.to_array(),
            ng: ng.to_array(),
            power: power.to_array(),
            light,
            scatterings: 0,
            slice: 0,
            is_caustic: false,
        }
    }

    /// Position in world space.
    pub fn p(&self) -> Vec3 {
        Vec3::from_array(self.p)
    }

    /// Unit direction towards the previous vertex, world space.
    pub fn wi(&self) -> Vec3 {
        Vec3::from_array(self.wi)
    }

    /// Unit geometric normal of the surface.
    pub fn ng(&self) -> Vec3 {
        Vec3::from_array(self.ng)
    }

    /// Power, in W.
    pub fn power(&self) -> Spectrum {
        let [r, g, b] = self.power;
        Spectrum::rgb(r, g, b)
    }
}

/// Traces light paths, and stores a photon at each surface that has other lobes than delta lobes.
#[derive(Debug)]
pub struct PhotonTracer<'a, A> {
    /// World with the scene.
    pub world: World<'a, A>,
    /// Maximum number of scattering events of a whole path, including the event that scatters the
    /// light of a photon. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Minimum number of scattering events of a stored photon.
    pub min_scatterings: u16,
}

/// Light paths of a work item of an iteration.
#[derive(Clone, Copy, Debug)]
pub struct PhotonWorkItem {
    /// Index of the iteration.
    pub iteration: u32,
    /// Index of the work item.
    pub index: u32,
    /// Number of light paths of all work items of the iteration.
    pub paths: u32,
}

/// Number of light paths of a work item. Their random numbers are consecutive samples of one
/// stream, so that they are well distributed jointly.
pub const PHOTON_PATHS_A_WORK_ITEM: u32 = 1024;

/// Maximum number of slices of the shutter interval.
const MAX_SLICES: u32 = 16;
/// Minimum number of light paths per slice, if there are several slices.
const MIN_PATHS_OF_A_SLICE: u32 = 4096;

impl<'a, A: Accel> PhotonTracer<'a, A> {
    /// Number of slices of the shutter interval for `paths` light paths with random times. If
    /// surfaces or lights move there are several slices, so that the photons of a slice lie on
    /// their surfaces.
    pub fn slices(&self, paths: u32) -> u32 {
        if self.world.scene.is_moving() {
            (paths / MIN_PATHS_OF_A_SLICE).clamp(1, MAX_SLICES)
        } else {
            1
        }
    }

    /// Number of work items for `paths` light paths.
    pub fn work_items(paths: u32) -> u32 {
        paths.div_ceil(PHOTON_PATHS_A_WORK_ITEM)
    }

    /// Traces the light paths of `item`. Returns their photons in the order of the paths. All paths
    /// are at `time`. If `time` is `None`, each path has a random time, and consecutive paths are
    /// assigned to the slices in turn.
    pub fn work_item<S: Sampler>(
        &self,
        item: PhotonWorkItem,
        time: Option<f32>,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Vec<Photon> {
        let mut photons = Vec::new();
        let slices = if time.is_some() { 1 } else { self.slices(item.paths) };
        let mut turn = item.index * PHOTON_PATHS_A_WORK_ITEM;
        self.each_path(item, time, sampler, out, |path| {
            // Store a photon at each vertex that can scatter light to a viewer
            let light = path.first().map_or(LightId(0), |vertex| vertex.light_id());
            let slice = (turn % slices) as u8;
            turn += 1;
            let mut is_specular = true;
            for (scatterings, vertex) in path.iter().skip(1).enumerate() {
                let Some(surface) = vertex.surface() else { continue };
                let is_seen = !surface.bsdf.is_delta() && scatterings >= self.min_scatterings as usize;
                if is_seen && vertex.beta.is_valid() && !vertex.beta.is_black() {
                    let power = vertex.beta * surface.over_opacity(self.world.scene);
                    photons.push(Photon {
                        scatterings: scatterings as u16,
                        slice,
                        is_caustic: is_specular && scatterings > 0,
                        ..Photon::new(light, vertex.p, vertex.ng, surface.back, power)
                    });
                }
                is_specular &= vertex.is_delta;
            }
        });
        photons
    }

    /// Traces the light paths of `item` and calls `found` with each path. The vertices of a
    /// path are in order from the light.
    pub(crate) fn each_path<S: Sampler>(
        &self,
        item: PhotonWorkItem,
        time: Option<f32>,
        sampler: &mut S,
        out: &mut impl RaySink,
        mut found: impl FnMut(Vec<PathVertex<'a>>),
    ) {
        let connector = Connector::new(&self.world, Heuristic::Balance, self.roulette, self.max_depth);
        let PhotonWorkItem {
            iteration,
            index,
            paths,
        } = item;
        let first = index * PHOTON_PATHS_A_WORK_ITEM;
        let slices = self.slices(paths);
        for path in 0..PHOTON_PATHS_A_WORK_ITEM.min(paths.saturating_sub(first)) {
            let sample = iteration.wrapping_mul(PHOTON_PATHS_A_WORK_ITEM).wrapping_add(path);
            sampler.start(SampleKey::of_stream(Stream::Photons, index, sample));
            let time = time.unwrap_or_else(|| {
                let slice = ((first + path) % slices) as f32;
                let u = || (slice + sampler.get_1d(Dimension::TIME)) / slices as f32;
                self.world.time_at(u)
            });
            found(connector.light_path(time, sampler, out));
        }
    }
}

impl<A: Accel> World<'_, A> {
    /// Time of all paths of iteration `iteration`, for integrators in which photons and camera
    /// paths need the same time.
    pub(crate) fn time_of_iteration<S: Sampler>(&self, iteration: u32, sampler: &mut S) -> f32 {
        sampler.start(SampleKey::of_stream(Stream::Iteration, 0, iteration));
        self.time(sampler)
    }
}
