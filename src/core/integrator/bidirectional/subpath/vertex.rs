//! Vertices of subpaths.

use super::Surface;
use crate::accel::Accel;
use crate::bsdf::ScatteringEvent;
use crate::camera::LensPoint;
use crate::color::Spectrum;
use crate::integrator::World;
use crate::light::{Emission, LightId};
use crate::math::Vec3;

/// A vertex of a subpath, which starts at the camera or at a light.
///
/// Densities are per area of a surface, for infinitely distant lights and lenses per solid angle. A
/// delta lobe draws its direction with density 1, and a path from
/// the other end with the Jacobian of its direction. Densities tell how likely each strategy of making the whole path is (Veach 1997, §10.2).
#[derive(Clone, Debug)]
pub(crate) struct PathVertex<'a> {
    pub kind: VertexKind<Surface<'a>, LightEnd>,
    /// World space; without meaning at an infinitely distant light.
    pub p: Vec3,
    /// Unit geometric normal; zero at single points, the direction of travel at infinity.
    pub ng: Vec3,
    /// What the vertex counts, over the density of the subpath so far.
    pub beta: Spectrum,
    /// Density with which the subpath has made the vertex.
    pub forward: f32,
    /// The one with which a path from the other end would have, coming along the same vertices; set when the subpath goes on.
    pub reverse: f32,
    /// Whether the subpath goes on by a delta lobe.
    pub is_delta: bool,
    /// True if the subpath is the camera's, and goes on in a direction from which no light path can come.
    pub is_one_way: bool,
    /// Densities of all strategies that join the path between its end and this vertex, raised by the MIS heuristic, over that of a connection of this vertex
    /// with the one before it. `Connector::sum_camera` and `Connector::sum_light` compute it.
    pub others: f64,
    /// The event by which the subpath goes on, where paths are distinguished.
    pub event: Option<ScatteringEvent>,
}

/// What a vertex of a path is on: `S` describes surfaces, and `L` lights.
#[derive(Clone, Copy, Debug)]
pub(crate) enum VertexKind<S, L> {
    /// The lens, seen from infinity if `is_far`: its rays are parallel.
    Lens { is_far: bool },
    /// A surface that scatters.
    Surface(S),
    /// A light, where a path starts or ends.
    Light(L),
}

/// The light that a vertex is on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightEnd {
    pub id: LightId,
    pub is_infinite: bool,
    /// Whether no ray can meet it.
    pub is_delta: bool,
}

impl<'a> PathVertex<'a> {
    /// The camera's end of a path.
    pub fn lens<A>(world: &World<'a, A>, LensPoint { p, normal, is_far }: LensPoint) -> Self
    where
        A: Accel,
    {
        Self {
            kind: VertexKind::Lens { is_far },
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

    /// The light's end of a path, where `emission` sets out; its light was chosen with probability `pmf`.
    pub fn light(id: LightId, pmf: f32, emission: &Emission) -> Self {
        let pdf = match emission.is_infinite {
            true => emission.pdf_direction,
            false => emission.pdf_position,
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

    /// The end of a path from the camera that has met the infinitely distant light `id` in direction `w`, drawn with density `pdf`.
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

    /// Returns true if the vertex is on an infinitely distant light, or on the lens of parallel
    /// rays.
    pub fn is_infinite(&self) -> bool {
        match &self.kind {
            VertexKind::Lens { is_far } => *is_far,
            VertexKind::Light(end) => end.is_infinite,
            VertexKind::Surface(_) => false,
        }
    }

    /// Whether the vertex is on a light that no ray can meet.
    pub fn is_delta_light(&self) -> bool {
        matches!(&self.kind, VertexKind::Light(end) if end.is_delta)
    }

    /// The vertex's light; an arbitrary one if it is on none.
    pub fn light_id(&self) -> LightId {
        match &self.kind {
            VertexKind::Light(end) => end.id,
            _ => LightId(0),
        }
    }

    /// The vertex's surface, if it is on one.
    pub fn surface(&self) -> Option<&Surface<'a>> {
        match &self.kind {
            VertexKind::Surface(surface) => Some(surface),
            _ => None,
        }
    }

    /// Unit direction from here to `other`.
    pub fn direction_to(&self, other: &Self) -> Vec3 {
        match (self.is_infinite(), other.is_infinite()) {
            (true, _) => self.ng,
            (_, true) => -other.ng,
            _ => (other.p - self.p).normalize(),
        }
    }

    /// The density at `to` of what leaves here with density `pdf`: per solid angle, or at infinity per area of a disk.
    pub fn density_at(&self, pdf: f32, to: &Self) -> f32 {
        if to.is_infinite() {
            return pdf;
        }
        let d = to.p - self.p;
        let (w, squared) = match self.is_infinite() {
            true => (self.ng, 1.0),
            false => (d.normalize_or_zero(), d.length_squared()),
        };
        pdf * to.cosine(w).abs() / squared
    }

    /// Cosine of `w` to the normal; 1 at a point that has none.
    pub fn cosine(&self, w: Vec3) -> f32 {
        if self.ng == Vec3::ZERO { 1.0 } else { w.dot(self.ng) }
    }
}
