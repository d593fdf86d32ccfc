//! Subpaths from the camera and from lights. This module traces subpaths, `vertex` defines their
//! vertices, and `surface` defines the surface points of vertices.
//!
//! A subpath is a list of vertices. Each vertex has its throughput and two densities per area. The
//! first is the density with which a walk from the start of the subpath samples the vertex. The
//! second is the density with which a walk from the other end of the whole path would sample the
//! vertex.
//!
//! A path must have the same measurement contribution from both ends. So BSDFs are defined relative
//! to the cosine of the geometric normal (Veach 1997, §5.3). If a shading normal is bent for a
//! viewer (`geometry/mesh.rs`), the viewer is the vertex on the camera's side, even if the path
//! came from the light. Three rules follow:
//!
//! - A ray towards a light starts on the light's side of the bent normal, as in `path/direct.rs`. A
//!   ray of a light path starts on the side of the triangle to which the ray points.
//! - A light path has no viewer yet. If the shading normal differs much from the geometric normal,
//!   light leaves in directions that a lobe around the shading normal never samples. So a light
//!   path samples some directions around the geometric normal (`Surface::facet_share`).
//! - A camera path may leave a vertex in a direction below the horizon of the geometric normal, or
//!   of the shading normal (`Surface::is_one_way`). The ray hits the same triangle again, or the
//!   surface behind the rim of a curved surface. Light from that direction hits the other side of
//!   the triangle, so no light path arrives from there. Light samples use such a direction, but
//!   connections do not.
//!
//! Densities of directions sampled from delta lobes omit the delta distribution and the probability
//! of the lobe, which both ends have in common. The densities include the geometry of the segment
//! and the Jacobian of one direction with respect to the other (`delta_jacobian`). Without these
//! factors, the MIS weights would be wrong if the distances to the two neighbours of a mirror
//! differ.
//!
//! The filter width of texture lookups must be the same from both ends, so it depends only on the
//! surface point (`World::footprint`).

mod surface;
mod vertex;

pub(crate) use surface::Surface;
pub(crate) use vertex::{LightEnd, PathVertex, VertexKind};

use crate::accel::Accel;
use crate::bsdf::{ScatteringEvent, TransportMode};
use crate::color::Spectrum;
use crate::integrator::{PathEvent, RayKind, RaySink, Roulette, ScatteringRecord, World};
use crate::light::LightId;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};
use crate::scene::Scene;

/// Maximum number of vertices of a path, including both ends. Light of longer paths is lost.
pub(crate) const MAX_VERTICES: usize = 66;

/// Maximum number of vertices of a path with up to `max_depth` scattering events.
pub(crate) fn max_vertices(max_depth: Option<u32>) -> usize {
    max_depth.map_or(MAX_VERTICES, |depth| {
        MAX_VERTICES.min((depth as usize).saturating_add(2))
    })
}

/// Densities with which a light path starts at the light `id`: the density of its start, and the
/// density of its first direction `w`. `ng` is the normal at the start. The first density is per
/// area and the second per solid angle. For infinitely distant lights the first is per solid angle
/// and the second per area.
pub(crate) fn emission_pdfs(scene: &Scene, id: LightId, is_infinite: bool, ng: Vec3, w: Vec3, time: f32) -> [f32; 2] {
    let [position, direction] = scene.lights()[id.0 as usize].emission_pdfs(ng, w, time, &scene.ball());
    if is_infinite {
        [direction, position]
    } else {
        [position, direction]
    }
}

/// A ray that leaves the last vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathRay {
    pub ray: Ray,
    /// Throughput of the subpath up to the ray.
    pub beta: Spectrum,
    /// Density of the ray's direction per solid angle. For rays from infinity: density per area of
    /// a disk.
    pub pdf: f32,
}

/// Random walk that traces a subpath from its first vertex.
pub(crate) struct Walk<'w, 'a, A> {
    pub world: &'w World<'a, A>,
    pub mode: TransportMode,
    pub roulette: Roulette,
    /// Maximum number of vertices of the subpath.
    pub max: usize,
}

impl<'a, A: Accel> Walk<'_, 'a, A> {
    /// Traces the subpath `path`, which has one vertex, along the ray `first`, and adds all further
    /// vertices. Returns the last segment if the subpath leaves the scene.
    pub fn follow(
        &self,
        path: &mut Vec<PathVertex<'a>>,
        first: PathRay,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
    ) -> Option<PathRay> {
        let PathRay {
            mut ray,
            mut beta,
            mut pdf,
        } = first;
        let start = beta.max_component();
        let mut kind = match self.mode {
            TransportMode::Radiance => RayKind::Camera,
            TransportMode::Importance => RayKind::Bounce,
        };
        // Factor by which roulette multiplies the throughput. It removes the change of radiance by
        // refraction
        let mut roulette_scale = 1.0;
        while path.len() < self.max {
            let (hit, transmittance) = self.world.intersect(&ray, kind, out);
            beta *= transmittance;
            let Some(hit) = hit else {
                return Some(PathRay { ray, beta, pdf });
            };
            kind = RayKind::Bounce;
            let surface = Surface::new(self.world, hit, &ray);
            let depth = path.len() as u32 - 1;
            let mut vertex = PathVertex {
                p: surface.point.p,
                ng: surface.point.ng,
                kind: VertexKind::Surface(surface),
                beta,
                forward: 0.0,
                reverse: 0.0,
                is_delta: false,
                is_one_way: false,
                others: 0.0,
                event: None,
            };
            let before = path.len() - 1;
            vertex.forward = path[before].density_at(pdf, &vertex);
            if let Some(surface) = vertex.surface().filter(|_| out.records()) {
                out.record(PathEvent::Vertex {
                    depth,
                    hit,
                    p: vertex.p,
                    n: surface.point.ns,
                    beta,
                });
            }
            path.push(vertex);
            if path.len() == self.max {
                break;
            }

            // Sample the next direction
            let block = block(self.mode, depth);
            let u_lobe = sampler.get_1d(Dimension::bounce(block, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(block, Bounce::Direction));
            let next = {
                let Some(surface) = path[before + 1].surface() else {
                    break;
                };
                self.scatter(surface, u_lobe, u)
            };
            let Some(next) = next else { break };
            path[before + 1].is_delta = next.is_delta;
            path[before + 1].event = next.event;
            path[before + 1].is_one_way = next.is_one_way;
            path[before].reverse = if path[before].is_one_way {
                0.0
            } else {
                path[before + 1].density_at(next.reverse_pdf, &path[before])
            };
            beta *= next.weight;
            roulette_scale *= next.eta * next.eta;
            let u = sampler.get_2d(Dimension::bounce(block, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, beta * (roulette_scale / start), u) else {
                break;
            };
            if let Some(surface) = path[before + 1].surface().filter(|_| out.records()) {
                let frame = surface.frame_for(self.world.scene, surface.back, self.mode);
                let (from, to) = (frame.to_local(surface.back), frame.to_local(next.ray.direction));
                let scattering = ScatteringRecord {
                    direction: next.ray.direction,
                    lobe: surface.bsdf.lobe_name(from, to, next.is_delta),
                    is_delta: next.is_delta,
                    pdf: next.pdf,
                    weight: next.weight,
                    eta: next.eta,
                    roulette: factor,
                };
                out.record(PathEvent::Scatter { depth, scattering });
            }
            beta *= factor;
            pdf = next.pdf;
            ray = next.ray;
        }
        None
    }

    /// Samples the direction in which the subpath leaves `surface`. `None` if the subpath ends.
    fn scatter(&self, surface: &Surface, u_lobe: f32, u: Vec2) -> Option<Continuation> {
        let scene = self.world.scene;
        let back = surface.back;
        let is_from_camera = self.mode == TransportMode::Radiance;
        let frame = surface.frame_for(scene, back, self.mode);
        let local = frame.to_local(back);
        let sample = surface.sample(back, local, u_lobe, u, self.mode)?;
        let w = frame.to_world(sample.wi);
        let weight = match (is_from_camera, sample.is_delta()) {
            (true, _) => sample.weight,
            (false, true) => sample.weight * surface.adjoint_delta(w, back),
            // Use the shading normal that is bent for the viewer in direction `w`
            (false, false) => surface.adjoint_throughput(scene, w, back) * (w.dot(surface.point.ng).abs() / sample.pdf),
        };
        if weight.is_black() {
            return None;
        }
        let (pdf, reverse_pdf) = match (sample.is_delta(), is_from_camera) {
            (true, _) => (1.0, delta_jacobian(local.z, sample.wi.z, sample.eta)),
            (false, true) => (sample.pdf, surface.pdf_from_light(w, back)),
            (false, false) => (sample.pdf, surface.pdf_from_camera(scene, w, back)),
        };
        Some(Continuation {
            ray: surface.ray_onwards(self.world, back, w, self.mode),
            weight,
            is_delta: sample.is_delta(),
            is_one_way: is_from_camera && surface.is_sample_one_way(back, w, sample.is_delta()),
            event: self.world.paths.map(|_| {
                let (wo, wi) = if is_from_camera { (back, w) } else { (w, back) };
                surface.event(scene, wo, wi, sample.is_delta())
            }),
            pdf,
            reverse_pdf,
            eta: if is_from_camera { sample.eta } else { 1.0 },
        })
    }
}

/// Ratio of the solid angle around the outgoing direction of a delta lobe to the solid angle around
/// the incoming direction: 1 for mirrors. For refraction, the ratio follows from `η² cos θ dω`,
/// which is the same on both sides, because the basic radiance `L / η²` stays constant. `eta` is
/// the index of refraction on the far side relative to the near side.
///
/// The two ends of a path sample the direction as delta distributions in different variables. This
/// ratio converts a density in one variable to a density in the other variable.
fn delta_jacobian(cos_back: f32, cos_onwards: f32, eta: f32) -> f32 {
    (cos_back / (cos_onwards * eta * eta)).abs()
}

/// A sampled direction in which a subpath continues, with its weight and densities.
struct Continuation {
    ray: Ray,
    weight: Spectrum,
    is_delta: bool,
    /// True if no light path can arrive from this direction ([`PathVertex::is_one_way`]).
    is_one_way: bool,
    /// Scattering event, if the render separates classes of light paths.
    event: Option<ScatteringEvent>,
    /// Density of the direction per solid angle; 1 for a delta lobe.
    pdf: f32,
    /// Density of the reverse direction per solid angle; for a delta lobe [`delta_jacobian`].
    reverse_pdf: f32,
    eta: f32,
}

/// Index of the block of random numbers for the vertex after `depth` scattering events. Camera and
/// light paths use alternate blocks.
pub(crate) fn block(mode: TransportMode, depth: u32) -> u32 {
    match mode {
        TransportMode::Radiance => 2 * depth,
        TransportMode::Importance => 2 * depth + 3,
    }
}

/// Index of the block of random numbers that sample the light at the start of a path.
pub(crate) const EMISSION_BLOCK: u32 = 1;
