//! Paths of the chains and their vertices.

use crate::accel::Accel;
use crate::bsdf::{Bsdf, TransportMode};
use crate::camera::LensPoint;
use crate::color::Spectrum;
use crate::integrator::bidirectional::subpath::{Surface, VertexKind};
use crate::integrator::opacity::Transmittance;
use crate::integrator::{PathEvent, RaySink, World};
use crate::light::LightId;
use crate::math::{Vec2, Vec3};
use std::rc::Rc;

/// A whole path x0 … xk: x0 is on the lens and xk on a light.
///
/// It is a point of path space (Veach 1997, §8.2): all that is asked of it is computed from its vertices, not from how it was made. A path keeps which of
/// its vertices scatter by delta lobes. Such paths are on a surface in path space; the deltas of what they contribute and of the
/// densities with which they are made are the same, and cancel.
#[derive(Clone, Debug)]
pub(super) struct Path<'a> {
    pub vertices: Vec<Vertex<'a>>,
    /// Position on the film: pixels, origin top left.
    pub film: Vec2,
    pub camera: CameraSample,
    /// Product of the values of all vertices: the path's contribution but for factors that have no colour.
    pub color: Spectrum,
    /// What chains are after: the luminance of [`Path::color`], over that of the importance image there. Above 0.
    pub target: f64,
}

/// Random choices of a path at the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraSample {
    /// The numbers that draw the point of the lens.
    pub lens: Vec2,
    pub time: f32,
}

impl Path<'_> {
    /// Vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// The light that it comes from.
    pub fn source(&self) -> Option<&LightSource> {
        self.vertices.last().and_then(Vertex::source)
    }

    /// Records the path's vertices, from the camera on. A path of a Markov chain has no throughput of its own.
    pub fn record(&self, out: &mut impl RaySink) {
        for (i, vertex) in self.vertices.iter().enumerate() {
            match &vertex.kind {
                VertexKind::Surface(surface) => out.record(PathEvent::Vertex {
                    depth: i as u32 - 1,
                    hit: surface.hit,
                    p: vertex.p,
                    n: surface.point.ns,
                    beta: Spectrum::ONE,
                }),
                VertexKind::Lens { .. } => out.record(PathEvent::Start {
                    p: vertex.p,
                    direction: self
                        .vertices
                        .get(i + 1)
                        .map_or(vertex.ng, |next| vertex.direction_to(next)),
                    light: None,
                    beta: Spectrum::ONE,
                }),
                VertexKind::Light(_) => {}
            }
        }
        out.record(PathEvent::Visited);
    }

    /// Whether light can be joined from one to the other by the edge from the vertex `i` to the one after it.
    pub fn can_be_joined(&self, i: usize) -> bool {
        i + 1 < self.len() && !self.vertices[i].is_delta && !self.vertices[i + 1].is_delta
    }
}

/// A vertex of a path.
#[derive(Clone, Debug)]
pub(super) struct Vertex<'a> {
    pub kind: PathVertexKind<'a>,
    /// World space; without meaning at an infinitely distant light.
    pub p: Vec3,
    /// Unit geometric normal; zero at single points, the direction of travel at infinity.
    pub ng: Vec3,
    /// Whether the vertex scatters by a delta lobe.
    pub is_delta: bool,
    /// Share of light that passes between here and the vertex after it, which is the one that is nearer to the light: below 1 behind surfaces with alpha
    /// and thin glass.
    pub transmittance: Transmittance,
    pub factors: Factors,
}

/// What a vertex is on. Paths that go on from a surface have it in common.
pub(super) type PathVertexKind<'a> = VertexKind<Rc<Surface<'a>>, LightSource>;

/// Where the light of a path comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightSource {
    pub id: LightId,
    pub kind: LightSourceKind,
    /// Radiance, W·sr⁻¹·m⁻²; of parallel light irradiance, W·m⁻²; not of points.
    pub radiance: Spectrum,
    /// Opacity of its surface, which `radiance` does not include. A ray that has met the surface has
    /// paid for the opacity by chance; a sampled point has not.
    pub opacity: f32,
    /// Where rays from it start and end, clear of its own surface.
    pub origin: Vec3,
}

/// Kind of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LightSourceKind {
    /// A light that has an area.
    Area,
    /// A single point.
    Point,
    /// Infinitely far away, of many directions.
    Far,
    /// Infinitely far away, of a single direction.
    Parallel,
}

impl LightSourceKind {
    /// Whether the light is infinitely far away.
    pub fn is_infinite(self) -> bool {
        matches!(self, Self::Far | Self::Parallel)
    }

    /// Whether no ray can meet it.
    pub fn is_delta(self) -> bool {
        matches!(self, Self::Point | Self::Parallel)
    }
}

/// What a vertex contributes between its neighbours, and with which densities paths go on from it to them.
///
/// What a path contributes over the density with which it was made is a product along the path: of [`Factors::value`] at all vertices, over
/// [`Factors::camera`] where a subpath from the camera was continued, over [`Factors::light`] where one from a light was, and times
/// [`Factors::geometry_term`] where two subpaths were joined.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factors {
    /// Light that comes from the vertex after this one and is scattered to the one before it, `f |cos|` by the shading normal; of a delta lobe the share
    /// of the light; at a light what it emits.
    pub value: Spectrum,
    /// Density with which a subpath from the camera goes on to the next vertex: per solid angle, of delta lobes the probability; at
    /// the lens 1, per film.
    pub camera: f64,
    /// The one with which a subpath from a light goes on to the vertex before, over [`Factors::towards_camera`].
    pub light: f64,
    /// What `value` is multiplied by to be what a path from a light counts per solid angle of the direction in which it goes on: of infinitely distant
    /// lights per area of a disk.
    pub towards_camera: f64,
    /// Geometry term of the edge to the next vertex, with its visibility, where this edge joins two subpaths.
    pub geometry_term: f64,
    /// Density of the vertex itself where a subpath starts there, at a light.
    pub start: f64,
}

impl Default for Factors {
    fn default() -> Self {
        Self {
            value: Spectrum::ONE,
            camera: 1.0,
            light: 1.0,
            towards_camera: 1.0,
            geometry_term: 1.0,
            start: 1.0,
        }
    }
}

impl<'a> Vertex<'a> {
    /// A vertex at `p`, with unit geometric normal `ng`.
    pub fn new(kind: PathVertexKind<'a>, p: Vec3, ng: Vec3) -> Self {
        Self {
            kind,
            p,
            ng,
            is_delta: false,
            transmittance: Transmittance::CLEAR,
            factors: Factors::default(),
        }
    }

    /// The vertex on the lens.
    pub fn lens(LensPoint { p, normal, is_far }: LensPoint) -> Self {
        Self::new(VertexKind::Lens { is_far }, p, normal)
    }

    /// The vertex's surface, if it is on one.
    pub fn surface(&self) -> Option<&Surface<'a>> {
        match &self.kind {
            VertexKind::Surface(surface) => Some(surface),
            _ => None,
        }
    }

    /// The vertex's light, if it is on one.
    pub fn source(&self) -> Option<&LightSource> {
        match &self.kind {
            VertexKind::Light(source) => Some(source),
            _ => None,
        }
    }

    /// Whether a ray that left `other` has met the triangle that it left. Such points are one and the same to all that is computed of a path's vertices.
    pub fn is_met_again(&self, other: &Self) -> bool {
        let triangle = |vertex: &Self| vertex.surface().map(|s| (s.hit.prim, s.hit.geom, s.hit.inst));
        triangle(self).is_some_and(|own| triangle(other) == Some(own))
    }

    /// Returns true if the vertex is infinitely far away, as is the lens of parallel rays.
    pub fn is_infinite(&self) -> bool {
        match &self.kind {
            VertexKind::Lens { is_far } => *is_far,
            VertexKind::Light(source) => source.kind.is_infinite(),
            VertexKind::Surface(_) => false,
        }
    }

    /// Whether something scatters here that other vertices can be joined to.
    pub fn is_smooth_somewhere(&self) -> bool {
        self.surface().is_none_or(|surface| !surface.bsdf.is_delta())
    }

    /// Unit direction from here to `other`.
    pub fn direction_to(&self, other: &Self) -> Vec3 {
        match (self.is_infinite(), other.is_infinite()) {
            (true, _) => self.ng,
            (_, true) => -other.ng,
            _ => (other.p - self.p).normalize_or_zero(),
        }
    }

    /// Where rays start that go on in direction `w` to find light, on the path that comes from the camera by `before`; if that is not known, on the
    /// side that `w` points to.
    pub fn origin_towards_light<A: Accel>(&self, world: &World<A>, before: Option<&Self>, w: Vec3) -> Vec3 {
        match (&self.kind, before) {
            (VertexKind::Surface(surface), Some(before)) => {
                surface.origin_towards_light(world, self.direction_to(before), w)
            }
            _ => self.origin_towards_camera(w),
        }
    }

    /// Where rays start that carry light away in direction `w`.
    pub fn origin_towards_camera(&self, w: Vec3) -> Vec3 {
        match &self.kind {
            VertexKind::Lens { .. } => self.p,
            VertexKind::Surface(surface) => surface.origin_towards_camera(w),
            VertexKind::Light(source) => source.origin,
        }
    }
}

/// What the delta lobes of a BSDF scatter to one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Single {
    /// Direction, local frame.
    pub direction: Vec3,
    /// Share of the light.
    pub flux: Spectrum,
    /// Probability with which it is drawn.
    pub probability: f32,
}

impl Single {
    /// The delta direction of `bsdf` for light that comes from `back` (local frame), on the same side or on the other. Lobes that reflect have one direction, and count together.
    pub fn of(bsdf: &Bsdf, back: Vec3, is_reflected: bool, mode: TransportMode) -> Option<Self> {
        let (mut total, mut flux, mut direction) = (0.0, Spectrum::ZERO, None);
        for sample in bsdf.delta_directions(back, mode).filter(|sample| sample.pdf > 0.0) {
            let share = sample.weight * sample.pdf;
            total += share.mean();
            if (sample.wi.z * back.z > 0.0) == is_reflected {
                flux += share;
                direction = Some(sample.wi);
            }
        }
        let probability = (1.0 - bsdf.smooth_probability(back)) * (flux.mean() / total);
        direction.filter(|_| probability > 0.0).map(|direction| Self {
            direction,
            flux,
            probability,
        })
    }
}
