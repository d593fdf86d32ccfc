//! Surface points at the vertices of subpaths.

use crate::accel::Accel;
use crate::bsdf::{Bsdf, BsdfSample, Scattering, ScatteringEvent, TransportMode};
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::geometry::{Hit, Side, SurfacePoint, offset_origin};
use crate::integrator::vertex::Vertex;
use crate::integrator::{RaySink, World};
use crate::light_sampling::LightSampleContext;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampling::warp::cosine_hemisphere;
use crate::scene::{Incident, Scene};
use std::borrow::Cow;
use std::f32::consts::FRAC_1_PI;
use std::ops::Deref;

/// A BSDF: borrowed from the scene, or owned by the vertex if the BSDF varies over the surface.
#[derive(Clone, Debug)]
pub(crate) enum BsdfRef<'a> {
    ByScene(&'a Bsdf),
    Here(Box<Bsdf>),
}

impl Deref for BsdfRef<'_> {
    type Target = Bsdf;
    fn deref(&self) -> &Bsdf {
        match self {
            Self::ByScene(bsdf) => bsdf,
            Self::Here(bsdf) => bsdf,
        }
    }
}

/// A surface point. It does not depend on the direction from which it is seen.
#[derive(Clone, Debug)]
pub(crate) struct Surface<'a> {
    pub hit: Hit,
    /// Surface point, with the shading normal that is not bent for a viewer.
    pub point: SurfacePoint,
    frame: Frame,
    pub bsdf: BsdfRef<'a>,
    /// Index of the absorbing body behind the surface, as in [`Ray::body`]; 0 if there is none.
    body: u32,
    /// True if shading normals or the material vary over the surface.
    is_detailed: bool,
    /// Unit direction towards the previous vertex, world space.
    pub back: Vec3,
}

impl<'a> Surface<'a> {
    /// The surface that `ray` hits at `hit`.
    pub fn new<A: Accel>(world: &World<'a, A>, hit: Hit, ray: &Ray) -> Self {
        let back = -ray.direction;
        if let Some((point, bsdf)) = world.scene.plain_surface(&hit, ray.time) {
            return Self {
                hit,
                frame: Frame::from_z(point.ns),
                point,
                bsdf: BsdfRef::ByScene(bsdf),
                body: world.scene.body_behind(&hit),
                is_detailed: false,
                back,
            };
        }
        let point = world.scene.surface_point_along(&hit, ray);
        let footprint = world.footprint(&point);
        let point = world.scene.with_bumps(&hit, point, footprint);
        Self {
            hit,
            frame: world.scene.frame(&hit, &point),
            point,
            bsdf: match world.scene.bsdf_at(&hit, ray.time, footprint) {
                Cow::Borrowed(bsdf) => BsdfRef::ByScene(bsdf),
                Cow::Owned(bsdf) => BsdfRef::Here(Box::new(bsdf)),
            },
            body: world.scene.body_behind(&hit),
            is_detailed: true,
            back,
        }
    }

    /// Surface point and local frame, with the shading normal bent for a viewer in the unit
    /// direction `wo`.
    fn seen_from(&self, scene: &Scene, wo: Vec3) -> (SurfacePoint, Frame) {
        if !self.bends_for(wo) {
            return (self.point, self.frame);
        }
        let point = self.point.seen_from(wo);
        (point, scene.frame(&self.hit, &point))
    }

    /// Local frame for a subpath whose previous vertex is in the direction `back`. A light path has
    /// no viewer yet, so its shading normal is not bent.
    pub fn frame_for(&self, scene: &Scene, back: Vec3, mode: TransportMode) -> Frame {
        match mode {
            TransportMode::Radiance => self.seen_from(scene, back).1,
            TransportMode::Importance => self.frame,
        }
    }

    /// Returns `true` if only a camera path can continue in the direction `wi`. `wo` is the
    /// direction to its previous vertex. The condition is that `wi` is on different sides of the
    /// geometric normal and of the shading normal bent for `wo`. Light from `wi` hits the other
    /// side of the triangle.
    pub fn is_one_way(&self, wo: Vec3, wi: Vec3) -> bool {
        self.is_detailed && !self.point.seen_from(wo).sides_agree(wi)
    }

    /// [`Surface::is_one_way`] for a sampled direction `wi`. The direction of a delta lobe around a
    /// normal that is bent for `wo` is one-way too.
    pub fn is_sample_one_way(&self, wo: Vec3, wi: Vec3, is_delta: bool) -> bool {
        is_delta && self.bends_for(wo) || self.is_one_way(wo, wi)
    }

    /// Returns `true` if the shading normal is bent for a viewer in the direction `wo`.
    fn bends_for(&self, wo: Vec3) -> bool {
        self.is_detailed && self.point.bends_for(wo)
    }

    /// [`Surface::scattered`] for light of a light path that arrives from the direction `wi`.
    /// Returns 0 if only a camera path can continue in that direction ([`Surface::is_one_way`]).
    pub fn scattered_arrival(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        if self.is_one_way(wo, wi) {
            Spectrum::ZERO
        } else {
            self.scattered(scene, wo, wi)
        }
    }

    /// Number by which a delta lobe of a light path multiplies the radiance, in addition to the
    /// weight of the lobe. The light comes from the direction `wi` and leaves in the direction
    /// `wo`. Returns 0 if a camera path cannot go in the reverse direction.
    pub fn adjoint_delta(&self, wo: Vec3, wi: Vec3) -> f32 {
        if self.is_sample_one_way(wo, wi, true) {
            0.0
        } else {
            self.point.adjoint_factor(wi, wo)
        }
    }

    /// Throughput of light that comes from the direction `wi` and leaves towards the camera in the
    /// direction `wo`. This is `f |cos|` with the shading normal: the factor of radiance per solid
    /// angle of `wi`.
    pub fn scattered(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let (point, frame) = self.seen_from(scene, wo);
        self.bsdf.eval(frame.to_local(wo), frame.to_local(wi)) * wi.dot(point.ns).abs()
    }

    /// Scattering event of light that comes from the direction `wi` and leaves towards the camera
    /// in the direction `wo`.
    pub fn event(&self, scene: &Scene, wo: Vec3, wi: Vec3, is_delta: bool) -> ScatteringEvent {
        let (_, frame) = self.seen_from(scene, wo);
        self.bsdf.event(frame.to_local(wo), frame.to_local(wi), is_delta)
    }

    /// Density per solid angle with which a camera path continues in the direction `wi`. `wo` is
    /// the direction to its previous vertex.
    pub fn pdf_from_camera(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> f32 {
        let (_, frame) = self.seen_from(scene, wo);
        self.bsdf.pdf(frame.to_local(wo), frame.to_local(wi))
    }

    /// Density per solid angle with which a light path continues in the direction `wo`. `wi` is the
    /// direction to its previous vertex. The density does not depend on a viewer.
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

    /// Samples the next direction of a camera path or a light path, according to `mode`. `back` is
    /// the direction to the previous vertex, and `local` is `back` in the local frame of
    /// [`Surface::frame_for`]. The sampled direction is in this frame, and its weight is a factor
    /// of radiance.
    pub fn sample(&self, back: Vec3, local: Vec3, u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match mode {
            TransportMode::Radiance => self.bsdf.sample(local, u_lobe, u, mode),
            TransportMode::Importance => self.sample_from_light(back, u_lobe, u),
        }
    }

    /// Ray along which a subpath continues in direction `w`. `back` is the direction to the
    /// previous vertex.
    pub fn ray_onwards<A: Accel>(&self, world: &World<A>, back: Vec3, w: Vec3, mode: TransportMode) -> Ray {
        let origin = match mode {
            TransportMode::Radiance => self.origin_towards_light(world, back, w),
            TransportMode::Importance => self.origin_towards_camera(w),
        };
        Ray::new(origin, w).when(self.point.time).within(self.body_towards(w))
    }

    /// Index of the absorbing body in which rays in direction `w` start, as in [`Ray::body`].
    pub fn body_towards(&self, w: Vec3) -> u32 {
        if w.dot(self.point.ng) < 0.0 { self.body } else { 0 }
    }

    /// Samples the next direction of a light path, in the local frame of [`Surface::frame_for`].
    /// `wi` is the direction to its previous vertex. The weight of the sample is a factor of
    /// radiance.
    fn sample_from_light(&self, wi: Vec3, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
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
            // Rescale the rest of the random number to [0, `smooth`), the range in which it chooses
            // a smooth lobe
            true => ((u_lobe - about_facet) / (1.0 - share)).min(smooth * (1.0 - f32::EPSILON)),
            false => u_lobe,
        };
        let sample = self.bsdf.sample(local, u_lobe, u, TransportMode::Importance)?;
        if share > 0.0 && !sample.is_delta() {
            Some(BsdfSample {
                pdf: self.pdf_from_light(wi, self.frame.to_world(sample.wi)),
                ..sample
            })
        } else {
            Some(sample)
        }
    }

    /// Fraction of the smooth samples of light paths that are cosine-distributed around the
    /// geometric normal. The BSDF samples directions around the shading normal, and never
    /// directions above the horizon of the geometric normal but below the horizon of the shading
    /// normal. A viewer in such a direction still sees light, because the shading normal is bent
    /// for the viewer. The fraction is proportional to the square root of the part that the BSDF
    /// misses. This choice limits both the number of badly sampled paths and the weights of the few
    /// paths in the missed directions.
    fn facet_share(&self) -> f32 {
        if self.is_detailed {
            0.5 * (1.0 - self.point.ns.dot(self.point.ng)).clamp(0.0, 1.0).sqrt()
        } else {
            0.0
        }
    }

    /// Origin of rays in direction `wi` towards light that is scattered to `wo`. It is on the
    /// light's side of the shading normal, as in [`World::origin_on`].
    pub fn origin_towards_light<A: Accel>(&self, world: &World<A>, wo: Vec3, wi: Vec3) -> Vec3 {
        let (point, _) = self.seen_from(world.scene, wo);
        world.origin_on(&point, Side::of(wi.dot(point.ns)), wi)
    }

    /// Origin of rays of a light path in direction `wo`. It is on the side of the surface that is
    /// visible from that direction.
    pub fn origin_towards_camera(&self, wo: Vec3) -> Vec3 {
        offset_origin(&self.point, wo)
    }

    /// Light sampling context of the point, seen from the direction `wo`.
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

    /// Reciprocal of the probability that the surface stops a ray. Both subpaths of a merged path
    /// hit the surface with this probability, although the two hits are one vertex of the path.
    /// This factor removes one of the two probabilities.
    pub fn over_opacity(&self, scene: &Scene) -> f32 {
        if scene.lets_light_pass() {
            1.0 / scene.stopping_share(&self.hit)
        } else {
            1.0
        }
    }

    /// Auxiliary channels of this surface, if it is the first surface that the camera sees.
    pub fn first_seen<A: Accel>(&self, world: &World<A>, out: &mut impl RaySink) -> FirstSurface {
        let (point, frame) = self.seen_from(world.scene, self.back);
        let vertex = Vertex {
            hit: self.hit,
            is_dispersing: false,
            is_bent: point.ns != self.point.ns,
            point,
            wo: frame.to_local(self.back),
            frame,
            bsdf: &self.bsdf,
            view: None,
            body: self.body,
        };
        world.first_surface(&vertex, out)
    }

    /// Emission of the surface towards the previous vertex, if the surface emits light. `from` is
    /// the light sampling context of the previous vertex.
    pub fn emitted<A: Accel>(&self, world: &World<A>, from: &LightSampleContext) -> Option<Incident> {
        let point = &self.point;
        let light = world.scene.emitted(
            world.light_selection,
            &self.hit,
            from,
            (point.p, -self.back),
            point.time,
        )?;
        (!light.radiance.is_black()).then_some(light)
    }

    /// Throughput of a light path from the direction `wi` to the direction `wo`, divided by the
    /// cosine between `wo` and the geometric normal. This is the BSDF that belongs to the geometric
    /// normal, so that both directions of a path have the same measure (Veach 1997, §5.3).
    pub fn adjoint_throughput(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let factor = 1.0 / wi.dot(self.point.ng).abs();
        if factor.is_finite() {
            self.scattered_arrival(scene, wo, wi) * factor
        } else {
            Spectrum::ZERO
        }
    }
}
