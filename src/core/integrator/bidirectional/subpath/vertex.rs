//! Vertices of subpaths.

use super::Surface;
use crate::accel::Accel;
use crate::bsdf::ScatteringEvent;
use crate::camera::{LensKind, LensPoint};
use crate::color::Spectrum;
use crate::integrator::World;
use crate::light::{Emission, LightId};
use crate::math::Vec3;

/// A vertex of a subpath from the camera or from a light.
///
/// Densities are per area of a surface, or per solid angle for infinitely distant lights and
/// lenses. The direction of a delta lobe has density 1. If the direction is sampled from the other
/// end of the path, its density is the Jacobian of the direction. The probability of each strategy
/// for the whole path follows from these densities (Veach 1997, §10.2).
#[derive(Clone, Debug)]
pub(crate) struct PathVertex<'a> {
    pub kind: VertexKind<Surface<'a>, LightEnd>,
    /// Position in world space; unused at an infinitely distant light.
    pub p: Vec3,
    /// Unit geometric normal. Zero at point lights and panoramic lenses. For infinitely distant
    /// lights and lenses: the direction in which their rays travel.
    pub ng: Vec3,
    /// Throughput of the subpath up to this vertex, divided by the density of the subpath.
    pub beta: Spectrum,
    /// Density with which the subpath sampled the vertex.
    pub forward: f32,
    /// Density with which a path from the other end, with the same vertices, would sample this
    /// vertex. Set when the subpath continues.
    pub reverse: f32,
    /// True if the subpath leaves the vertex by a delta lobe.
    pub is_delta: bool,
    /// True if this vertex is on a camera subpath that continues in a direction from which no light
    /// path can arrive.
    pub is_one_way: bool,
    /// Sum over all strategies that connect the path between the start of the subpath and this
    /// vertex. Each term is the density of a strategy, raised by the MIS heuristic, relative to the
    /// strategy that connects this vertex with the previous vertex. Computed by
    /// `Connector::sum_camera` and `Connector::sum_light`.
    pub others: f64,
    /// Scattering event at the vertex, if the render separates classes of light paths.
    pub event: Option<ScatteringEvent>,
}

/// Kind of a vertex. `S` describes surfaces, and `L` describes lights.
#[derive(Clone, Copy, Debug)]
pub(crate) enum VertexKind<S, L> {
    /// The lens.
    Lens(LensKind),
    /// A surface that scatters light.
    Surface(S),
    /// A light at which the path starts or ends.
    Light(L),
}

/// Light of a vertex at which a path starts or ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightEnd {
    pub id: LightId,
    pub is_infinite: bool,
    /// True if no ray can hit the light.
    pub is_delta: bool,
}

impl<'a> PathVertex<'a> {
    /// The first vertex of a camera path, at a point of the lens.
    pub fn lens<A>(world: &World<'a, A>, LensPoint { p, normal, kind }: LensPoint) -> Self
    where
        A: Accel,
    {
        Self {
            kind: VertexKind::Lens(kind),
            p,
            ng: normal,
            beta: Spectrum::ONE,
            forward: 1.0 / world.camera.lens_area(),
            reverse: 0.0,
            is_delta: false,
            is_one_way: false,
            others: 0.0,
            event: None,
        }
    }

    /// The first vertex of a light path, at the origin of `emission`. The light `id` was chosen
    /// with probability `pmf`.
    pub fn light(id: LightId, pmf: f32, emission: &Emission) -> Self {
        let pdf = if emission.is_infinite {
            emission.pdf_direction
        } else {
            emission.pdf_position
        };
        Self {
            kind: VertexKind::Light(LightEnd {
                id,
                is_infinite: emission.is_infinite,
                is_delta: emission.is_delta_position || emission.is_delta_direction,
            }),
            p: emission.p,
            ng: emission.ng,
            beta: emission.radiance * (1.0 / (pmf * pdf)),
            forward: pmf * pdf,
            reverse: 0.0,
            is_delta: false,
            is_one_way: false,
            others: 0.0,
            event: None,
        }
    }

    /// The last vertex of a camera path that hits the infinitely distant light `id` in direction
    /// `w`. `pdf` is the density of the direction.
    pub fn far_away(id: LightId, w: Vec3, pdf: f32) -> Self {
        let end = LightEnd {
            id,
            is_infinite: true,
            is_delta: false,
        };
        Self {
            kind: VertexKind::Light(end),
            p: Vec3::ZERO,
            ng: -w,
            beta: Spectrum::ZERO,
            forward: pdf,
            reverse: 0.0,
            is_delta: false,
            is_one_way: false,
            others: 0.0,
            event: None,
        }
    }

    /// Returns `true` if the vertex is on an infinitely distant light, or on the lens of a camera
    /// with parallel rays.
    pub fn is_infinite(&self) -> bool {
        match &self.kind {
            VertexKind::Lens(kind) => *kind == LensKind::Far,
            VertexKind::Light(end) => end.is_infinite,
            VertexKind::Surface(_) => false,
        }
    }

    /// Returns `true` if lights can be sampled for the vertex. The start of a ray from a circle, or
    /// from an infinitely distant lens, depends on the point that the ray hits. So there is no
    /// position for which a light could be sampled.
    pub fn takes_light_samples(&self) -> bool {
        !matches!(&self.kind, VertexKind::Lens(kind) if !kind.is_fixed())
    }

    /// Returns `true` if the vertex is on a light that no ray can hit.
    pub fn is_delta_light(&self) -> bool {
        matches!(&self.kind, VertexKind::Light(end) if end.is_delta)
    }

    /// Light of the vertex. The result is arbitrary if the vertex is not on a light.
    pub fn light_id(&self) -> LightId {
        match &self.kind {
            VertexKind::Light(end) => end.id,
            _ => LightId(0),
        }
    }

    /// Surface of the vertex, if the vertex is on a surface.
    pub fn surface(&self) -> Option<&Surface<'a>> {
        match &self.kind {
            VertexKind::Surface(surface) => Some(surface),
            _ => None,
        }
    }

    /// Unit direction from this vertex to `other`.
    pub fn direction_to(&self, other: &Self) -> Vec3 {
        match (self.is_infinite(), other.is_infinite()) {
            (true, _) => self.ng,
            (_, true) => -other.ng,
            _ => (other.p - self.p).normalize(),
        }
    }

    /// Converts the density `pdf` of a direction that leaves this vertex to the density at the
    /// vertex `to`. `pdf` is per solid angle, or per area of a disk if this vertex is infinitely
    /// distant.
    pub fn density_at(&self, pdf: f32, to: &Self) -> f32 {
        if to.is_infinite() {
            return pdf;
        }
        let d = to.p - self.p;
        let (w, squared) = if self.is_infinite() {
            (self.ng, 1.0)
        } else {
            (d.normalize_or_zero(), d.length_squared())
        };
        pdf * to.cosine(w).abs() / squared
    }

    /// Cosine between the unit direction `w` and the normal; 1 if the vertex has no normal.
    pub fn cosine(&self, w: Vec3) -> f32 {
        if self.ng == Vec3::ZERO { 1.0 } else { w.dot(self.ng) }
    }
}
