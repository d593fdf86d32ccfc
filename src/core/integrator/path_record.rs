//! Records of paths: vertices, densities, weights and contributions of integrators
//! (`embrasure paths`, `render --pixel`).
//!
//! Integrators record events if [`RaySink::records`] returns `true`. The sinks of renders return
//! `false`, and nothing is computed for records then. A record is a flat list of events in the
//! order of the integrator's work. A vertex belongs to the last path that started. Light belongs to
//! the last vertex.

use super::vertex::Vertex;
use super::{RaySink, Sink};
use crate::bsdf::BsdfSample;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::light::LightId;
use crate::math::{Ray, Vec2, Vec3};

/// An event in the record of a path.
#[derive(Clone, Copy, Debug)]
pub enum PathEvent {
    /// A path begins.
    Start {
        /// Start point, on the lens or on a light.
        p: Vec3,
        /// Unit direction of the first ray.
        direction: Vec3,
        /// Light at the start. `None` at the camera.
        light: Option<LightId>,
        /// Throughput of the first ray.
        beta: Spectrum,
    },
    /// The path hits a surface.
    Vertex {
        /// Number of scattering events before the vertex. In a tree of rays, the previous vertex is
        /// the last vertex with one event less.
        depth: u32,
        /// Hit of the ray on the surface.
        hit: Hit,
        /// World-space position.
        p: Vec3,
        /// Unit shading normal.
        n: Vec3,
        /// Throughput of the ray that hits the surface.
        beta: Spectrum,
    },
    /// The path hits emitted light, at its last vertex or infinitely far away.
    Emission(EmissionRecord),
    /// A light sample was taken at the last vertex.
    LightSample(LightSampleRecord),
    /// Transmittance of a shadow ray. The ray belongs to the first light sample whose shadow ray
    /// was not traced yet.
    Shadow {
        /// Transmittance; black if the light is occluded.
        transmittance: Spectrum,
    },
    /// The path leaves a vertex.
    Scatter {
        /// Number of scattering events before the vertex, which is the last vertex with this depth.
        depth: u32,
        /// Outgoing direction, density and weight.
        scattering: ScatteringRecord,
    },
    /// A camera subpath and a light subpath are connected.
    Connection {
        /// Number of vertices of the light subpath and of the camera subpath.
        strategy: (usize, usize),
        /// True if the ends of the subpaths were merged instead of connected. Both numbers of
        /// `strategy` then include the merged vertex.
        is_merged: bool,
        /// Light source of the path.
        light: LightId,
        /// MIS weight of the strategy.
        weight: f32,
        /// Light without the MIS weight.
        radiance: Spectrum,
    },
    /// The density of the photons around the last vertex was estimated.
    Photons {
        /// Number of photons in the disk.
        count: u32,
        /// Radius of the disk, in scene units.
        radius: f32,
    },
    /// A path of a Markov chain is complete, before it is accepted or rejected.
    Visited,
    /// The irradiance cache was used at the last vertex.
    Cached,
    /// Light of a path shared between pixels is added. The first vertex of the pixel was connected
    /// to the second vertex of that path, which is called the end of the path.
    Shared {
        /// Column and row of the pixel whose path found the end.
        owner: [u32; 2],
        /// World-space position of the end.
        p: Vec3,
    },
    /// The rest of a shared path begins. All pixels that are connected to the end of the path
    /// receive the light of this rest ([`PathEvent::Shared`]).
    SharedPath,
    /// Part of the light of the next [`PathEvent::Added`].
    Light(Spectrum),
    /// Light is added to the pixel of the sample or at a point of the film.
    Added {
        /// Position on the film, in pixels. `None`: the pixel of the sample.
        film: Option<Vec2>,
        /// Radiance that is added.
        radiance: Spectrum,
    },
}

/// Record of emission that a path hits.
#[derive(Clone, Copy, Debug)]
pub struct EmissionRecord {
    /// Light that the path hits.
    pub light: LightId,
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Density per solid angle with which the BSDF sampled the direction; 0 at the camera and
    /// behind delta lobes.
    pub scattering_pdf: f32,
    /// Density per solid angle with which light sampling samples the direction, including the
    /// choice of the light.
    pub light_pdf: f32,
    /// MIS weight.
    pub weight: f32,
    /// Emitted radiance.
    pub radiance: Spectrum,
}

/// Record of a light sample at a vertex.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleRecord {
    /// Light that is sampled.
    pub light: LightId,
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Point on the light. `None` if the light is infinitely far away.
    pub target: Option<Vec3>,
    /// Probability of choosing this light, times the number of samples that are summed.
    pub pmf: f32,
    /// Density of the direction per solid angle, given the light; 1 for delta lights.
    pub pdf: f32,
    /// Density per solid angle with which the BSDF samples the direction.
    pub scattering_pdf: f32,
    /// MIS weight.
    pub weight: f32,
    /// BSDF times cosine with the shading normal.
    pub f_cos: Spectrum,
    /// Radiance, or irradiance of delta lights.
    pub radiance: Spectrum,
    /// Transmittance along the shadow ray. `None` until the shadow ray is traced
    /// ([`PathEvent::Shadow`]).
    pub transmittance: Option<Spectrum>,
}

/// Record of the direction in which a path leaves a vertex.
#[derive(Clone, Copy, Debug)]
pub struct ScatteringRecord {
    /// Unit outgoing direction, world frame.
    pub direction: Vec3,
    /// Name of the lobe that scatters the largest fraction of the light from that direction.
    pub lobe: &'static str,
    /// True if this lobe is a delta lobe.
    pub is_delta: bool,
    /// Density of the direction per solid angle. For a delta lobe: probability of the lobe.
    pub pdf: f32,
    /// Factor by which the throughput changes, without the factor `roulette`.
    pub weight: Spectrum,
    /// Index of refraction beyond the surface, divided by the index on the side of the path. 1 if
    /// the path is not refracted.
    pub eta: f32,
    /// Factor that compensates for paths that roulette or another random choice terminates, or for
    /// several branches.
    pub roulette: f32,
}

/// Records the start of a path along `ray`, at the camera or at `light`.
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

/// Records that a path hits `vertex` after `depth` scattering events, with the throughput `beta`.
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

/// Passes the scattering `sample` at `vertex` to `out`, after `depth` earlier scattering events.
/// `roulette` is the factor that compensates for terminated paths.
#[inline(always)]
pub(super) fn scatter(depth: u32, vertex: &Vertex, sample: &BsdfSample, roulette: f32, out: &mut impl Sink) {
    if out.separates_paths() {
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
