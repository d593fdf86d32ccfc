//! Paths of chains and their vertices.

use crate::accel::Accel;
use crate::bsdf::{Bsdf, TransportMode};
use crate::camera::{LensKind, LensPoint};
use crate::color::Spectrum;
use crate::integrator::bidirectional::subpath::{Surface, VertexKind};
use crate::integrator::opacity::Transmittance;
use crate::integrator::{PathEvent, RaySink, World};
use crate::light::LightId;
use crate::math::{Vec2, Vec3};
use std::rc::Rc;

/// A whole path x0 … xk. x0 is on the lens, and xk is on a light.
///
/// A path is a point of path space (Veach 1997, §8.2). All quantities are computed from its
/// vertices and do not depend on how the path was sampled. The path stores which of its vertices
/// scatter by delta lobes. Paths with delta lobes form a surface in path space. The same delta
/// distributions appear in their contribution and in their densities, and cancel.
#[derive(Clone, Debug)]
pub(super) struct Path<'a> {
    pub vertices: Vec<Vertex<'a>>,
    /// Position on the film, in pixels, origin top left.
    pub film: Vec2,
    pub camera: CameraSample,
    /// Product of the values of all vertices: the contribution of the path without scalar factors,
    /// per channel.
    pub color: Spectrum,
    /// Target of the path: luminance of [`Path::color`], divided by the importance image at
    /// [`Path::film`]. It is above 0.
    pub target: f64,
}

/// Random number of the lens point, and time of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct CameraSample {
    /// Random number of the lens point.
    pub lens: Vec2,
    pub time: f32,
}

impl Path<'_> {
    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Light at the end of the path.
    pub fn source(&self) -> Option<&LightEnd> {
        self.vertices.last().and_then(Vertex::source)
    }

    /// Records the vertices of the path, in order from the camera. The throughput of paths of a
    /// Markov chain is recorded as 1.
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
                VertexKind::Lens(_) => out.record(PathEvent::Start {
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

    /// Returns `true` if the edge from the vertex `i` to the next vertex can connect two subpaths.
    pub fn can_be_joined(&self, i: usize) -> bool {
        i + 1 < self.len() && !self.vertices[i].is_delta && !self.vertices[i + 1].is_delta
    }
}

/// A vertex of a path.
#[derive(Clone, Debug)]
pub(super) struct Vertex<'a> {
    pub kind: PathVertexKind<'a>,
    /// Position in world space; unused at an infinitely distant light.
    pub p: Vec3,
    /// Unit geometric normal. Zero at point lights and panoramic lenses. For infinitely distant
    /// lights and lenses: the direction in which their rays travel.
    pub ng: Vec3,
    /// True if the vertex scatters by a delta lobe.
    pub is_delta: bool,
    /// Transmittance from the vertex to the next vertex, which is nearer to the light. It is below
    /// 1 if surfaces with alpha or thin glass lie between the vertices.
    pub transmittance: Transmittance,
    pub factors: Factors,
}

/// Kind of a vertex of a path. Paths that continue from the same surface vertex share its surface.
pub(super) type PathVertexKind<'a> = VertexKind<Rc<Surface<'a>>, LightEnd>;

/// Light at the end of a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightEnd {
    pub id: LightId,
    pub kind: LightEndKind,
    /// Radiance, W·sr⁻¹·m⁻². For parallel light: irradiance, W·m⁻². Not used for point lights.
    pub radiance: Spectrum,
    /// Opacity of the light's surface. `radiance` does not include the opacity, because the opacity
    /// counts only for light sampling. A sampled point is always on the surface, but a ray stops at
    /// the surface only with this probability.
    pub opacity: f32,
    /// Origin of rays from the light, offset from its surface.
    pub origin: Vec3,
}

/// Kind of a light source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LightEndKind {
    /// Light with an area.
    Area,
    /// Point light.
    Point,
    /// Infinitely distant light with many directions.
    Far,
    /// Infinitely distant light with one direction.
    Parallel,
}

impl LightEndKind {
    /// Returns `true` if the light is infinitely distant.
    pub fn is_infinite(self) -> bool {
        matches!(self, Self::Far | Self::Parallel)
    }

    /// Returns `true` if no ray can hit the light.
    pub fn is_delta(self) -> bool {
        matches!(self, Self::Point | Self::Parallel)
    }
}

/// Contribution of a vertex between its neighbours, and the densities with which subpaths continue
/// from the vertex to its neighbours. Scalar factors are separate from the value per channel.
///
/// The contribution of a path divided by its density is a product along the path. Its factors are
/// [`Factors::value`] of all vertices, and [`Factors::geometry_term`] of the connection. Its
/// divisors are [`Factors::camera`] of the vertices at which a camera subpath continued, and
/// [`Factors::light`] of the vertices at which a light subpath continued.
#[derive(Clone, Copy, Debug)]
pub(super) struct Factors {
    /// At a surface: throughput of light from the next vertex to the previous vertex, `f |cos|`
    /// with the shading normal. For a delta lobe: the fraction of the light that the lobe scatters.
    /// At a light: the emission.
    pub value: Spectrum,
    /// Density per solid angle with which a camera subpath continues to the next vertex. For a
    /// delta lobe: the probability of the lobe. At the lens: 1, per film area.
    pub camera: f64,
    /// Density with which a light subpath continues to the previous vertex, divided by
    /// [`Factors::towards_camera`]. For a delta lobe: the probability of the lobe, divided by the
    /// same factor.
    pub light: f64,
    /// Factor that converts `value` to the throughput of a light path. This throughput is per solid
    /// angle of the path's next direction, or per area of a disk for infinitely distant lights.
    pub towards_camera: f64,
    /// Geometry term of the edge to the next vertex, including its visibility, if this edge
    /// connects two subpaths.
    pub geometry_term: f64,
    /// Density of the vertex, if a light subpath starts at it.
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

    /// A vertex on the lens.
    pub fn lens(LensPoint { p, normal, kind }: LensPoint) -> Self {
        Self::new(VertexKind::Lens(kind), p, normal)
    }

    /// Surface of the vertex, if the vertex is on a surface.
    pub fn surface(&self) -> Option<&Surface<'a>> {
        match &self.kind {
            VertexKind::Surface(surface) => Some(surface),
            _ => None,
        }
    }

    /// Light of the vertex, if the vertex is on a light.
    pub fn source(&self) -> Option<&LightEnd> {
        match &self.kind {
            VertexKind::Light(source) => Some(source),
            _ => None,
        }
    }

    /// Returns `true` if both vertices are on the same triangle. This happens if a ray from `other`
    /// hits the triangle that it leaves. Such paths are rejected (`is_same_point` in `space`).
    pub fn is_on_same_triangle(&self, other: &Self) -> bool {
        let triangle = |vertex: &Self| vertex.surface().map(|s| (s.hit.prim, s.hit.geom, s.hit.inst));
        triangle(self).is_some_and(|own| triangle(other) == Some(own))
    }

    /// Returns `true` if the vertex is on an infinitely distant light, or on the lens of a camera
    /// with parallel rays.
    pub fn is_infinite(&self) -> bool {
        match &self.kind {
            VertexKind::Lens(kind) => *kind == LensKind::Far,
            VertexKind::Light(source) => source.kind.is_infinite(),
            VertexKind::Surface(_) => false,
        }
    }

    /// Returns `true` if the vertex is on a lens whose point depends on the next vertex of the
    /// path.
    pub fn is_movable_lens(&self) -> bool {
        matches!(&self.kind, VertexKind::Lens(kind) if !kind.is_fixed())
    }

    /// Returns `true` if the vertex can be connected to other vertices, because not all its lobes
    /// are delta lobes.
    pub fn is_smooth_somewhere(&self) -> bool {
        self.surface().is_none_or(|surface| !surface.bsdf.is_delta())
    }

    /// Unit direction from this vertex to `other`.
    pub fn direction_to(&self, other: &Self) -> Vec3 {
        match (self.is_infinite(), other.is_infinite()) {
            (true, _) => self.ng,
            (_, true) => -other.ng,
            _ => (other.p - self.p).normalize_or_zero(),
        }
    }

    /// Origin of rays towards light from the unit direction `w`. `before` is the previous vertex on
    /// the camera's side. If `before` is `None`, the origin is on the side of the surface that
    /// faces `w`.
    pub fn origin_towards_light<A: Accel>(&self, world: &World<A>, before: Option<&Self>, w: Vec3) -> Vec3 {
        match (&self.kind, before) {
            (VertexKind::Surface(surface), Some(before)) => {
                surface.origin_towards_light(world, self.direction_to(before), w)
            }
            _ => self.origin_towards_camera(w),
        }
    }

    /// Origin of rays of a light path in the unit direction `w`.
    pub fn origin_towards_camera(&self, w: Vec3) -> Vec3 {
        match &self.kind {
            VertexKind::Lens(_) => self.p,
            VertexKind::Surface(surface) => surface.origin_towards_camera(w),
            VertexKind::Light(source) => source.origin,
        }
    }
}

/// All delta lobes of a BSDF on one side of the surface, combined into one lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Single {
    /// Unit direction of the lobe, local frame.
    pub direction: Vec3,
    /// Fraction of the light that is scattered in this direction, per channel.
    pub flux: Spectrum,
    /// Probability of sampling this direction.
    pub probability: f32,
}

impl Single {
    /// Combined delta lobe of `bsdf` for light from `back` (local frame): on the side of `back` if
    /// `is_reflected`, otherwise on the other side. All delta lobes that reflect have the same
    /// direction, and their fractions are added.
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
