//! Points of surfaces on which subpaths have vertices.

use crate::accel::Accel;
use crate::bsdf::{Bsdf, BsdfSample, Scattering, ScatteringEvent, TransportMode};
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::geometry::{Hit, Side, SurfacePoint, offset_origin};
use crate::integrator::World;
use crate::integrator::vertex::Vertex;
use crate::light::LightSampleContext;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampling::warp::cosine_hemisphere;
use crate::scene::{Incident, Scene};
use std::borrow::Cow;
use std::f32::consts::FRAC_1_PI;
use std::ops::Deref;

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
    /// Surface point, with the shading normal before it is bent to a viewer.
    pub point: SurfacePoint,
    frame: Frame,
    pub bsdf: Held<'a>,
    /// The body behind the surface, as in [`Ray::body`].
    body: u32,
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
                Cow::Borrowed(bsdf) => Held::ByScene(bsdf),
                Cow::Owned(bsdf) => Held::Here(Box::new(bsdf)),
            },
            body: world.scene.body_behind(&hit),
            is_detailed: true,
            back,
        }
    }

    /// Point and frame with the shading normal as it is for a viewer in the direction `wo`.
    fn seen_from(&self, scene: &Scene, wo: Vec3) -> (SurfacePoint, Frame) {
        if !self.bends_for(wo) {
            return (self.point, self.frame);
        }
        let point = self.point.seen_from(wo);
        (point, scene.frame(&self.hit, &point))
    }

    /// The local frame for a path that comes from the direction `back`: one from a light has no viewer yet.
    pub fn frame_for(&self, scene: &Scene, back: Vec3, mode: TransportMode) -> Frame {
        match mode {
            TransportMode::Radiance => self.seen_from(scene, back).1,
            TransportMode::Importance => self.frame,
        }
    }

    /// Returns true if only a path from the camera, which leaves in the direction `wo` to its previous
    /// vertex, can go on here in the direction `wi`: by the shading normal, as `wo` sees it, `wi` is on
    /// another side than by the geometric normal. Light from `wi` hits the other side of the facet.
    pub fn is_one_way(&self, wo: Vec3, wi: Vec3) -> bool {
        self.is_detailed && !self.point.seen_from(wo).sides_agree(wi)
    }

    /// [`Surface::is_one_way`] for a sampled direction `wi`. A delta lobe about a normal that is bent to
    /// `wo` is one-way too.
    pub fn goes_one_way(&self, wo: Vec3, wi: Vec3, is_delta: bool) -> bool {
        is_delta && self.bends_for(wo) || self.is_one_way(wo, wi)
    }

    /// Returns true if the shading normal is another one for a viewer in the direction `wo`.
    fn bends_for(&self, wo: Vec3) -> bool {
        self.is_detailed && self.point.bends_for(wo)
    }

    /// [`Surface::scattered`] for light that arrives by a path from a light: zero if `wi` is one-way
    /// ([`Surface::is_one_way`]).
    pub fn scattered_arrival(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        match self.is_one_way(wo, wi) {
            true => Spectrum::ZERO,
            false => self.scattered(scene, wo, wi),
        }
    }

    /// What radiance is multiplied by at a delta lobe that takes light from the direction `wi` to the direction `wo` on a path from a light, besides the
    /// weight of the lobe; 0 if a path from the camera would not go the same way back.
    pub fn adjoint_delta(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.goes_one_way(wo, wi, true) {
            true => 0.0,
            false => self.point.adjoint_factor(wi, wo),
        }
    }

    /// Light from the direction `wi` that leaves in the direction `wo` to the camera: `f |cos|` by the shading normal, which is what radiance per solid
    /// angle of `wi` is multiplied by.
    pub fn scattered(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let (point, frame) = self.seen_from(scene, wo);
        self.bsdf.eval(frame.to_local(wo), frame.to_local(wi)) * wi.dot(point.ns).abs()
    }

    /// The event of light from the direction `wi` that leaves in the direction `wo` to the camera.
    pub fn event(&self, scene: &Scene, wo: Vec3, wi: Vec3, is_delta: bool) -> ScatteringEvent {
        let (_, frame) = self.seen_from(scene, wo);
        self.bsdf.event(frame.to_local(wo), frame.to_local(wi), is_delta)
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

    /// Draws a direction in which a path that comes from the direction `back` goes on, from either end: in the local frame of [`Surface::frame_for`], in
    /// which `back` is `local`. The weight is that of radiance.
    pub fn sample(&self, (back, local): (Vec3, Vec3), u_lobe: f32, u: Vec2, mode: TransportMode) -> Option<BsdfSample> {
        match mode {
            TransportMode::Radiance => self.bsdf.sample(local, u_lobe, u, mode),
            TransportMode::Importance => self.sample_from_light(back, u_lobe, u),
        }
    }

    /// The ray on which a path that comes from the direction `back` goes on in direction `w`.
    pub fn ray_onwards<A: Accel>(&self, world: &World<A>, back: Vec3, w: Vec3, mode: TransportMode) -> Ray {
        let origin = match mode {
            TransportMode::Radiance => self.origin_towards_light(world, back, w),
            TransportMode::Importance => self.origin_towards_camera(w),
        };
        Ray::new(origin, w).when(self.point.time).within(self.body_towards(w))
    }

    /// The body, as in [`Ray::body`], in which rays in direction `w` start.
    pub fn body_towards(&self, w: Vec3) -> u32 {
        if w.dot(self.point.ng) < 0.0 { self.body } else { 0 }
    }

    /// Draws a direction in which a path from a light that comes from the direction `wi` goes on: in the local frame of [`Surface::frame_for`], its weight
    /// that of radiance.
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
            // Remainder of the number, below all delta lobes
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
    /// [`World::origin_on`] says.
    pub fn origin_towards_light<A: Accel>(&self, world: &World<A>, wo: Vec3, wi: Vec3) -> Vec3 {
        let (point, _) = self.seen_from(world.scene, wo);
        world.origin_on(&point, Side::of(wi.dot(point.ns)), wi)
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

    /// 1 over the probability with which the surface stops rays: what light that has met it by that chance counts to others who have met it by the same chance. Both
    /// ends of a merged path are one vertex of it.
    pub fn over_opacity(&self, scene: &Scene) -> f32 {
        match scene.lets_light_pass() {
            true => 1.0 / scene.stopping_share(&self.hit),
            false => 1.0,
        }
    }

    /// What the auxiliary channels show of it, where the camera sees it first.
    pub fn first_seen<A: Accel>(&self, world: &World<A>) -> FirstSurface {
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
        world.first_surface(&vertex)
    }

    /// The light that the surface itself sends back along the ray that has met it, as `from` sees it.
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

    /// What a path that carries light here from the direction `wi` counts in the direction `wo`, over the cosine of `wo` with the geometric normal: the
    /// BSDF of the surface that the geometric normal belongs to, so that both ways of making a path give one measure (Veach 1997, §5.3).
    pub fn adjoint_throughput(&self, scene: &Scene, wo: Vec3, wi: Vec3) -> Spectrum {
        let factor = 1.0 / wi.dot(self.point.ng).abs();
        match factor.is_finite() {
            true => self.scattered_arrival(scene, wo, wi) * factor,
            false => Spectrum::ZERO,
        }
    }
}
