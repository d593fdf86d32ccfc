//! Subpaths from the camera and from lights.
//!
//! A subpath is a list of vertices. Each vertex has its throughput and two densities per area: that of being sampled from its own end, and that of
//! being sampled from the other end.
//!
//! Both ends must agree on one measurement contribution. BSDFs are therefore those that belong to the geometric normal (Veach 1997, §5.3). Where a
//! shading normal is bent for a viewer (`geometry/mesh.rs`), it is bent for the vertex on the camera's side, also if the path came from the light.
//! Three rules follow:
//!
//! - A ray that looks for light starts on the side that the light has by the bent normal, as in `path/direct.rs`. A ray that carries light away
//!   starts on the side of the facet from which it is seen.
//! - A light path does not know its viewer. It draws some directions about the normal of the facet (`Surface::facet_share`): where the shading normal
//!   is far from it, light leaves in directions that a lobe about the shading normal never draws.
//! - A camera ray that starts above a facet in a direction below it meets the same facet again (`Surface::is_met_again`). No other strategy can make
//!   such a vertex; its density is infinite in all weights.
//!
//! The filter width of texture lookups must be the same from both ends, and so depends on the point alone (`World::footprint`).

use crate::accel::Accel;
use crate::bsdf::{Bsdf, BsdfSample, Scattering, TransportMode};
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::geometry::{Hit, Side, SurfacePoint, offset_origin, offset_to};
use crate::integrator::vertex::Vertex;
use crate::integrator::{RayKind, RaySink, Roulette, World};
use crate::light::{Emission, LightId, LightSampleContext};
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};
use crate::sampling::warp::cosine_hemisphere;
use crate::scene::{Incident, Scene};
use std::borrow::Cow;
use std::f32::consts::FRAC_1_PI;
use std::ops::Deref;

/// Maximum number of vertices of a path, both ends counted: light that is scattered more often cannot be seen.
pub(crate) const MAX_VERTICES: usize = 66;

/// A vertex of a subpath, which starts at the camera or at a light.
///
/// Densities are per area of a surface, for infinitely distant lights per solid angle; 1 for what a delta distribution has drawn, with which all
/// strategies that can make the path draw it. They tell how likely each strategy of making the whole path is (Veach 1997, §10.2).
#[derive(Clone, Debug)]
pub(crate) struct PathVertex<'a> {
    pub kind: VertexKind<Surface<'a>, LightEnd>,
    /// World space; without meaning at infinity.
    pub p: Vec3,
    /// Unit geometric normal; zero at single points, the direction of travel at infinity.
    pub ng: Vec3,
    /// What the vertex counts, over the density of the subpath so far.
    pub beta: Spectrum,
    /// Density with which the subpath has made the vertex: infinite where it has met the triangle that it left, as no other strategy can.
    pub forward: f32,
    /// The one with which a path from the other end would have, coming along the same vertices; set when the subpath goes on.
    pub reverse: f32,
    /// Whether the subpath goes on by a delta lobe.
    pub is_delta: bool,
}

/// What a vertex of a path is on: `S` describes surfaces, and `L` lights.
#[derive(Clone, Copy, Debug)]
pub(crate) enum VertexKind<S, L> {
    /// The lens.
    Lens,
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

/// A BSDF, which is the scene's or, where it varies, the vertex's own.
#[derive(Clone, Debug)]
pub(crate) enum Held<'a> {
    ByScene(&'a Bsdf),
    Here(Box<Bsdf>),
}

impl Deref for Held<'_> {
    type Target = Bsdf;
    fn deref(&self) -> &Bsdf {
        match self {
            Self::ByScene(bsdf) => bsdf,
            Self::Here(bsdf) => bsdf,
        }
    }
}

/// A point of a surface, independent of its viewer.
#[derive(Clone, Debug)]
pub(crate) struct Surface<'a> {
    pub hit: Hit,
    /// With the shading normal as it is before it is bent to a viewer.
    pub point: SurfacePoint,
    frame: Frame,
    pub bsdf: Held<'a>,
    /// Whether normals or material vary here.
    is_detailed: bool,
    /// Unit direction to the previous vertex, world space.
    pub back: Vec3,
}

impl<'a> Surface<'a> {
    /// The surface at `hit`, met along `ray`.
    pub fn new<A: Accel>(world: &World<'a, A>, hit: Hit, ray: &Ray) -> Self {
        let back = -ray.direction;
        if let Some((point, bsdf)) = world.scene.plain_surface(&hit, ray.time) {
            return Self {
                hit,
                frame: Frame::from_z(point.ns),
                point,
                bsdf: Held::ByScene(bsdf),
                is_detailed: false,
                back,
            };
        }
        let point = world.scene.surface_point(&hit, ray.time);
        let footprint = world.footprint(&point);
        let point = world.scene.with_relief(&hit, point, footprint);
        Self {
            hit,
            frame: world.scene.frame(&hit, &point),
            point,
            bsdf: match world.scene.bsdf_at(&hit, ray.time, footprint) {
                Cow::Borrowed(bsdf) => Held::ByScene(bsdf),
                Cow::Owned(bsdf) => Held::Here(Box::new(bsdf)),
            },
            is_detailed: true,
            back,
        }
    }

    /// Point and frame with the shading normal as it is for a viewer in the direction `wo`.
    fn seen_from(&self, scene: &Scene, wo: Vec3) -> (SurfacePoint, Frame) {
        if !self.is_detailed || !self.point.bends_for(wo) {
            return (self.point, self.frame);
        }
        let point = self.point.seen_from(wo);
        (point, scene.frame(&self.hit, &point))
    }

    /// The local frame for a path that comes from the direction `back`: one from a light does not know yet who looks.
    pub fn frame_for(&self, scene: &Scene, back: Vec3, mode: TransportMode) -> Frame {
        match mode {
            TransportMode::Radiance => self.seen_from(scene, back).1,
            TransportMode::Importance => self.frame,
        }
    }

    /// Whether a ray that left `other` has met the triangle that it left: by a shading normal that is bent far away light comes from beyond the facet's
    /// horizon, and a ray that looks for it there finds the facet itself. Nothing but a path from the camera can make such a pair of points.
    pub fn is_met_again(&self, other: &Self) -> bool {
        let triangle = |hit: &Hit| (hit.prim, hit.geom, hit.inst);
        triangle(&self.hit) == triangle(&other.hit)
    }

    /// Light from the direction `wi` that leaves in the direction `wo` to the camera: `f |cos|` by the shading normal, which is what radiance per solid
    /// angle of `wi` is multiplied by.
    pub fn scattered(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let (point, frame) = self.seen_from(scene, wo);
        self.bsdf.eval(frame.to_local(wo), frame.to_local(wi)) * wi.dot(point.ns).abs()
    }

    /// Density per solid angle with which a path from the camera that comes from the direction `wo` goes on in `wi`.
    pub fn pdf_from_camera(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> f32 {
        let (_, frame) = self.seen_from(scene, wo);
        self.bsdf.pdf(frame.to_local(wo), frame.to_local(wi))
    }

    /// Density per solid angle with which a path from a light that comes from the direction `wi` goes on in `wo`. The viewer is not known yet.
    pub fn pdf_from_light(&self, wi: Vec3, wo: Vec3) -> f32 {
        let (from, to) = (self.frame.to_local(wi), self.frame.to_local(wo));
        let pdf = self.bsdf.pdf(from, to);
        match self.facet_share() {
            0.0 => pdf,
            share => {
                let [cos_from, cos_to] = [wi, wo].map(|w| w.dot(self.point.ng));
                let sides = match self.bsdf.glossy_eta(from) {
                    Some(_) => 0.5,
                    None => f32::from(u8::from(cos_from * cos_to > 0.0)),
                };
                let about_facet = sides * cos_to.abs() * FRAC_1_PI;
                (1.0 - share) * pdf + share * self.bsdf.smooth_probability(from) * about_facet
            }
        }
    }

    /// Draws a direction in which a path from a light that comes from the direction `wi` goes on: in the local frame of [`Surface::frame_for`], its weight
    /// that of radiance.
    pub fn sample_from_light(&self, wi: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        let (local, share) = (self.frame.to_local(wi), self.facet_share());
        let smooth = if share > 0.0 {
            self.bsdf.smooth_probability(local)
        } else {
            0.0
        };
        let about_facet = share * smooth;
        let u_lobe = match u_lobe < smooth {
            true if u_lobe < about_facet => {
                let is_through = self.bsdf.glossy_eta(local).is_some() && u_lobe < 0.5 * about_facet;
                let side = 1f32.copysign(wi.dot(self.point.ng)) * if is_through { -1.0 } else { 1.0 };
                let w = Frame::from_z(side * self.point.ng).to_world(cosine_hemisphere(u));
                let to = self.frame.to_local(w);
                let pdf = self.pdf_from_light(wi, w);
                return (pdf > 0.0).then(|| BsdfSample::new(self.bsdf.eval(local, to), to, pdf, Scattering::Diffuse));
            }
            // What is left of the number, below all delta lobes
            true => ((u_lobe - about_facet) / (1.0 - share)).min(smooth * (1.0 - f32::EPSILON)),
            false => u_lobe,
        };
        let sample = self.bsdf.sample(local, u_lobe, u, TransportMode::Importance)?;
        match share > 0.0 && !sample.is_delta() {
            true => Some(BsdfSample {
                pdf: self.pdf_from_light(wi, self.frame.to_world(sample.wi)),
                ..sample
            }),
            false => Some(sample),
        }
    }

    /// Share of a light's paths that go on by the cosine about the geometric normal. The BSDF draws directions about the shading normal, and those that are
    /// above the facet but beyond its horizon never: but with the normal bent to a viewer there light is scattered there too. It grows with the square root
    /// of what is missed, so that neither many paths are drawn badly nor few count too much.
    fn facet_share(&self) -> f32 {
        match self.is_detailed {
            true => 0.5 * (1.0 - self.point.ns.dot(self.point.ng)).clamp(0.0, 1.0).sqrt(),
            false => 0.0,
        }
    }

    /// Where rays start that go on in direction `wi` to find the light which is scattered to `wo`: on the side that it has by the shading normal, as
    /// [`Vertex::origin`] says.
    pub fn origin_towards_light(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Vec3 {
        let (point, _) = self.seen_from(scene, wo);
        offset_to(&point, Side::of(wi.dot(point.ns)))
    }

    /// Where rays start that carry light away in direction `wo`: on the side from which it is seen there.
    pub fn origin_towards_camera(&self, wo: Vec3) -> Vec3 {
        offset_origin(&self.point, wo)
    }

    /// The point as one that light falls on, seen from the direction `wo`.
    pub fn light_context(&self, scene: &Scene, wo: Vec3) -> LightSampleContext {
        let (point, frame) = self.seen_from(scene, wo);
        let wo = frame.to_local(wo);
        LightSampleContext {
            p: point.p,
            n: match self.bsdf.glossy_eta(wo) {
                Some(_) => Vec3::ZERO,
                None => point.ns * 1f32.copysign(wo.z),
            },
        }
    }

    /// 1 over the share of the surface that is there: what light that has met it by that chance counts to others who have met it by the same chance. Both
    /// ends of a merged path are one vertex of it.
    pub fn over_opacity(&self, scene: &Scene) -> f32 {
        match scene.has_alpha() {
            true => 1.0 / scene.opacity(&self.hit),
            false => 1.0,
        }
    }

    /// What the auxiliary channels show of it, where the camera sees it first.
    pub fn first_seen<A: Accel>(&self, world: &World<A>) -> FirstSurface {
        let (point, frame) = self.seen_from(world.scene, self.back);
        let vertex = Vertex {
            is_bent: point.ns != self.point.ns,
            point,
            wo: frame.to_local(self.back),
            frame,
            bsdf: &self.bsdf,
            view: None,
        };
        world.first_surface(&self.hit, &vertex)
    }

    /// The light that the surface itself sends back along the ray that has met it, as `from` sees it.
    pub fn emitted(&self, scene: &Scene, from: &LightSampleContext) -> Option<Incident> {
        let point = &self.point;
        let light = scene.emitted(&self.hit, from, point.p, -self.back, point.time)?;
        (!light.radiance.is_black()).then_some(light)
    }
}

impl<'a> PathVertex<'a> {
    /// The camera's end of a path.
    pub fn lens<A>(world: &World<'a, A>, p: Vec3, time: f32) -> Self
    where
        A: Accel,
    {
        Self {
            kind: VertexKind::Lens,
            p,
            ng: world.camera.forward(time),
            beta: Spectrum::ONE,
            forward: 1.0 / world.camera.lens_area(),
            reverse: 0.0,
            is_delta: false,
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
        }
    }

    /// Whether the vertex is on an infinitely distant light.
    pub fn is_infinite(&self) -> bool {
        matches!(&self.kind, VertexKind::Light(end) if end.is_infinite)
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
        let cos = if to.ng == Vec3::ZERO { 1.0 } else { w.dot(to.ng).abs() };
        pdf * cos / squared
    }
}

/// A ray that leaves a vertex of a subpath.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathRay {
    pub ray: Ray,
    /// Throughput.
    pub beta: Spectrum,
    /// Density of the direction, per solid angle; of rays from infinity per area of a disk.
    pub pdf: f32,
}

/// How a subpath walks on from its first vertex.
pub(crate) struct Walk<'w, 'a, A> {
    pub world: &'w World<'a, A>,
    pub mode: TransportMode,
    pub roulette: Roulette,
    /// Maximum number of vertices.
    pub most: usize,
}

impl<'a, A: Accel> Walk<'_, 'a, A> {
    /// Adds to `path`, whose only vertex is left by `first`, all further vertices. Gives the segment that leaves the scene, if one does.
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
        // How much larger radiance is for having been refracted
        let mut roulette_scale = 1.0;
        while path.len() < self.most {
            let Some(hit) = self.world.intersect(&ray, kind, out) else {
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
            };
            let before = path.len() - 1;
            let is_met_again = match (path[before].surface(), vertex.surface()) {
                (Some(left), Some(met)) => met.is_met_again(left),
                _ => false,
            };
            vertex.forward = match path[before].is_delta {
                _ if is_met_again => f32::INFINITY,
                true => 1.0,
                false => path[before].density_at(pdf, &vertex),
            };
            path.push(vertex);
            if path.len() == self.most {
                break;
            }

            // A direction
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
            path[before].reverse = match next.is_delta {
                true => 1.0,
                false => path[before + 1].density_at(next.reverse_pdf, &path[before]),
            };
            beta *= next.weight;
            roulette_scale *= next.eta * next.eta;
            let u = sampler.get_2d(Dimension::bounce(block, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, beta * (roulette_scale / start), u) else {
                break;
            };
            beta *= factor;
            pdf = next.pdf;
            ray = next.ray;
        }
        None
    }

    /// Samples a direction in which the subpath goes on from `surface`.
    fn scatter(&self, surface: &Surface, u_lobe: f32, u: Vec2) -> Option<Onwards> {
        let scene = self.world.scene;
        let back = surface.back;
        let is_from_camera = self.mode == TransportMode::Radiance;
        let frame = surface.frame_for(scene, back, self.mode);
        let sample = match is_from_camera {
            true => surface.bsdf.sample(frame.to_local(back), u_lobe, u, self.mode)?,
            false => surface.sample_from_light(back, u_lobe, u)?,
        };
        let w = frame.to_world(sample.wi);
        let weight = match (is_from_camera, sample.is_delta()) {
            (true, _) => sample.weight,
            (false, true) => sample.weight * surface.point.adjoint_factor(back, w),
            // By the normal that the camera will see
            (false, false) => surface.carried(scene, w, back) * (w.dot(surface.point.ng).abs() / sample.pdf),
        };
        if weight.is_black() {
            return None;
        }
        let (pdf, reverse_pdf) = match (sample.is_delta(), is_from_camera) {
            (true, _) => (1.0, 1.0),
            (false, true) => (sample.pdf, surface.pdf_from_light(w, back)),
            (false, false) => (sample.pdf, surface.pdf_from_camera(scene, w, back)),
        };
        let origin = match is_from_camera {
            true => surface.origin_towards_light(scene, back, w),
            false => surface.origin_towards_camera(w),
        };
        Some(Onwards {
            ray: Ray::new(origin, w).when(surface.point.time),
            weight,
            is_delta: sample.is_delta(),
            pdf,
            reverse_pdf,
            eta: if is_from_camera { sample.eta } else { 1.0 },
        })
    }
}

impl Surface<'_> {
    /// What a path that carries light here from the direction `wi` counts in the direction `wo`, over the cosine of `wo` with the geometric normal: the
    /// BSDF of the surface that the geometric normal belongs to, so that both ways of making a path give one measure (Veach 1997, §5.3).
    pub fn carried(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let factor = 1.0 / wi.dot(self.point.ng).abs();
        match factor.is_finite() {
            true => self.scattered(scene, wo, wi) * factor,
            false => Spectrum::ZERO,
        }
    }
}

/// A sampled direction in which a subpath goes on.
struct Onwards {
    ray: Ray,
    weight: Spectrum,
    is_delta: bool,
    /// Per solid angle; 1 for a delta lobe.
    pdf: f32,
    /// Density of the way back, likewise.
    reverse_pdf: f32,
    eta: f32,
}

/// Block of random numbers of the vertex after `depth` scattering events: paths from the camera and from lights take turns.
pub(crate) fn block(mode: TransportMode, depth: u32) -> u32 {
    match mode {
        TransportMode::Radiance => 2 * depth,
        TransportMode::Importance => 2 * depth + 3,
    }
}

/// Block of random numbers of the light that a path starts from.
pub(crate) const EMISSION_BLOCK: u32 = 1;
