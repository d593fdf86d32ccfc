//! Records of paths: vertices, densities, weights and contributions, as the integrators use them (`embrasure paths`, `render --pixel`).
//!
//! Integrators tell a sink what they do if it asks for it ([`RaySink::records`]). The sinks of renders do not, and nothing is computed for records then. A record
//! is a flat list of events in the order of the integrator's work: vertices belong to the path that began last, and light to the vertex that was met last.

use super::vertex::Vertex;
use super::{RaySink, Sink};
use crate::bsdf::BsdfSample;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::light::LightId;
use crate::math::{Ray, Vec2, Vec3};

/// An event in the life of a path.
#[derive(Clone, Copy, Debug)]
pub enum PathEvent {
    /// A path begins.
    Start {
        /// Where: on the lens, or on a light.
        p: Vec3,
        /// Unit direction of its ray.
        direction: Vec3,
        /// The light that it begins at; `None` at the camera.
        light: Option<LightId>,
        /// Throughput of the ray.
        beta: Spectrum,
    },
    /// The path meets a surface.
    Vertex {
        /// Scattering events before it. In a tree of rays it belongs to the last vertex with one event less.
        depth: u32,
        /// The hit.
        hit: Hit,
        /// World-space position.
        p: Vec3,
        /// Unit shading normal.
        n: Vec3,
        /// Throughput of the ray that meets it.
        beta: Spectrum,
    },
    /// Emitted light that the path meets, at its last vertex or infinitely far away.
    Emission(EmissionRecord),
    /// A light is sampled for the last vertex.
    LightSample(LightSampleRecord),
    /// The shadow ray of the first light sample that has none yet was traced.
    Shadow {
        /// Transmittance; black where the light is occluded.
        transmittance: Spectrum,
    },
    /// The path leaves a vertex.
    Scatter {
        /// Scattering events before that vertex: it is the last one of which this is so.
        depth: u32,
        /// Where to.
        scattering: ScatteringRecord,
    },
    /// A subpath from the camera and one from a light are joined.
    Connection {
        /// Vertices from the light, and from the camera.
        strategy: (usize, usize),
        /// Whether their ends were merged, in place of connected: then both count the last vertex.
        is_merged: bool,
        /// The light.
        light: LightId,
        /// MIS weight of the strategy.
        weight: f32,
        /// Light without that weight.
        radiance: Spectrum,
    },
    /// The density of photons at the last vertex was estimated.
    Photons {
        /// Number of photons.
        count: u32,
        /// Radius of the disk, scene units.
        radius: f32,
    },
    /// A path that a Markov chain visits is whole.
    Visited,
    /// The cache of irradiance was asked at the last vertex.
    Cached,
    /// Light of a path that pixels share is added, by a connection of the first vertex to an end.
    Shared {
        /// Column and row of the pixel whose path has found the end.
        owner: [u32; 2],
        /// The end.
        p: Vec3,
    },
    /// The rest of a path that is shared begins: its light is that of [`PathEvent::Shared`] in all pixels that see its end.
    SharedPath,
    /// A part of the light of the next [`PathEvent::Added`].
    Light(Spectrum),
    /// Light is added to the sample's own pixel, or where it falls on the film.
    Added {
        /// Position on the film, pixels, if it may be another pixel.
        film: Option<Vec2>,
        /// The light.
        radiance: Spectrum,
    },
}

/// Emitted light that a path meets.
#[derive(Clone, Copy, Debug)]
pub struct EmissionRecord {
    /// The light.
    pub light: LightId,
    /// Unit direction towards it.
    pub direction: Vec3,
    /// Density per solid angle with which the direction was drawn; 0 at the camera and behind delta lobes.
    pub scattering_pdf: f32,
    /// Density per solid angle with which light sampling draws it, the choice of the light included.
    pub light_pdf: f32,
    /// MIS weight.
    pub weight: f32,
    /// Emitted radiance.
    pub radiance: Spectrum,
}

/// A sample of a light.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleRecord {
    /// The light.
    pub light: LightId,
    /// Unit direction towards it.
    pub direction: Vec3,
    /// Where on it; `None` infinitely far away.
    pub target: Option<Vec3>,
    /// Probability of choosing this light, times the number of samples that are summed.
    pub pmf: f32,
    /// Density of the direction per solid angle, given the light; 1 for delta lights.
    pub pdf: f32,
    /// Density per solid angle with which the BSDF draws the direction.
    pub scattering_pdf: f32,
    /// MIS weight.
    pub weight: f32,
    /// BSDF times cosine.
    pub f_cos: Spectrum,
    /// Radiance, or irradiance of delta lights.
    pub radiance: Spectrum,
    /// Transmittance along its shadow ray; `None` until that is traced, which [`PathEvent::Shadow`] says.
    pub transmittance: Option<Spectrum>,
}

/// A direction in which a path leaves a vertex.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringRecord {
    /// Unit direction.
    pub direction: Vec3,
    /// Name of the lobe that has the largest share of the light from there.
    pub lobe: &'static str,
    /// Whether that is a delta lobe.
    pub is_delta: bool,
    /// Density per solid angle; the probability of a delta lobe.
    pub pdf: f32,
    /// Factor of the throughput, without `roulette`.
    pub weight: Spectrum,
    /// Index of refraction beyond the surface over that before it, where the path is refracted, else 1.
    pub eta: f32,
    /// Factor that makes up for paths that roulette has ended, and the like.
    pub roulette: f32,
}

/// Records that a path begins along `ray`, at the camera or at `light`.
#[inline(always)]
pub(super) fn start(ray: &Ray, light: Option<LightId>, beta: Spectrum, out: &mut impl RaySink) {
    if out.records() {
        out.record(PathEvent::Start {
            p: ray.origin,
            direction: ray.direction,
            light,
            beta,
        });
    }
}

/// Records that a path meets `vertex` after `depth` scattering events, with the throughput `beta`.
#[inline(always)]
pub(super) fn vertex(depth: u32, vertex: &Vertex, beta: Spectrum, out: &mut impl RaySink) {
    if out.records() {
        out.record(PathEvent::Vertex {
            depth,
            hit: vertex.hit,
            p: vertex.point.p,
            n: vertex.point.ns,
            beta,
        });
    }
}

/// Tells `out` that a path leaves `vertex`, which it has met after `depth` scattering events, by
/// `sample`. `roulette` makes up for paths that end.
#[inline(always)]
pub(super) fn scatter(depth: u32, vertex: &Vertex, sample: &BsdfSample, roulette: f32, out: &mut impl Sink) {
    if out.tells_paths() {
        out.scattered(depth, vertex.event(sample.wi, sample.is_delta()));
    }
    if out.records() {
        let scattering = ScatteringRecord {
            direction: vertex.frame.to_world(sample.wi),
            lobe: vertex.bsdf.lobe_name(vertex.wo, sample.wi, sample.is_delta()),
            is_delta: sample.is_delta(),
            pdf: sample.pdf,
            weight: sample.weight,
            eta: sample.eta,
            roulette,
        };
        out.record(PathEvent::Scatter { depth, scattering });
    }
}
