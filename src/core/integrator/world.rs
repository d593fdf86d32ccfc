//! The world that all integrators share: scene, backend, camera and pixel filter. The methods of
//! `World` are ray queries.
//!
//! The filter width of textures is an eighth of the width that a pixel has on the surface in a
//! direct view (`World::footprint`). This width depends only on the point and needs no state along
//! a path, so both ends of a bidirectional path agree on it. The mean over the samples of the pixel
//! does the rest of the filtering. After a diffuse bounce, the filter is narrower than necessary.
//! The narrow filter adds noise, but no blur. docs/notebook/2026-11.md, "Texture filters", has the
//! widths that were tried.
//!
//! `World::vertex` has a fast path for surfaces with one normal and one material.

use super::background::Backdrop;
use super::opacity::{OpacityWalk, ThinSurfaceChoices, Transmittance, stops};
use super::path_record;
use super::vertex::Vertex;
use super::{RayKind, RaySink, Sink};
use crate::accel::Accel;
use crate::bsdf::Bsdf;
use crate::camera::Camera;
use crate::color::Spectrum;
use crate::film::{Filter, LightPaths, LineStyle};
use crate::geometry::{Hit, Side, SurfacePoint, offset_to, segment};
use crate::light::{Emission, LightId};
use crate::light_sampling::LightSelection;
use crate::material::BsdfSlot;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampler::{Dimension, SampleKey, Sampler};
use crate::sampling::Wavelength;
use crate::scene::{HullHit, Scene};

/// Filter width of textures for one sample, in pixels.
///
/// The samples of a pixel lie at different points, and their mean filters textures again. For n
/// samples a width of 1/√n is enough (PBR4 §10.1.3, which stops at 1/8). Here n is always 64, so
/// that a sample does not depend on the number of samples of the render. With fewer than 64
/// samples, textures have more noise than necessary, but far less noise than the light has
/// (docs/notebook/2026-11.md).
const SAMPLE_WIDTH: f32 = 0.125;

/// Scene, backend, camera and light selection: shared by all integrators.
#[derive(Debug)]
pub struct World<'a, A> {
    /// Scene.
    pub scene: &'a Scene,
    /// Backend of ray queries over `scene`.
    pub accel: &'a A,
    /// Light selection of `scene`, with its learned data.
    pub light_selection: &'a LightSelection,
    /// Camera.
    pub camera: &'a Camera,
    /// Pixel filter.
    pub filter: &'a Filter,
    /// True if the first surface of a sample includes its [`Features`](crate::film::Features).
    pub features: bool,
    /// Style of the lines, if the render has the channel `lines`.
    pub lines: Option<LineStyle>,
    /// True if bidirectional methods also record the light of each strategy separately.
    pub strategies: bool,
    /// Classes of light paths, if the render separates them.
    pub paths: Option<&'a LightPaths>,
    /// Background for camera rays that leave the scene.
    pub backdrop: Backdrop,
}

// Derived impls would require `A: Clone`, though `A` is only behind a reference.
impl<A> Clone for World<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A> Copy for World<'_, A> {}

impl<'a, A> World<'a, A> {
    /// Returns a copy of this world with the backend `accel`.
    pub fn with_accel<B>(self, accel: &'a B) -> World<'a, B> {
        let Self {
            scene,
            light_selection,
            camera,
            filter,
            features,
            lines,
            strategies,
            paths,
            backdrop,
            ..
        } = self;
        World {
            scene,
            accel,
            light_selection,
            camera,
            filter,
            features,
            lines,
            strategies,
            paths,
            backdrop,
        }
    }
}

impl<'a, A: Accel> World<'a, A> {
    /// A world whose background is the environment lights, without additional channels.
    pub fn new(
        scene: &'a Scene,
        accel: &'a A,
        light_selection: &'a LightSelection,
        camera: &'a Camera,
        filter: &'a Filter,
    ) -> Self {
        Self {
            scene,
            accel,
            light_selection,
            camera,
            filter,
            features: false,
            lines: None,
            strategies: false,
            paths: None,
            backdrop: Backdrop::default(),
        }
    }

    /// Starts the sample `key`. Returns the ray from a random point of the lens through a film
    /// point sampled from the pixel filter. The time of the ray is `time`, or random if `time` is
    /// `None`.
    #[inline(always)]
    pub fn camera_ray(
        &self,
        key: SampleKey,
        time: Option<f32>,
        sampler: &mut impl Sampler,
        out: &mut impl Sink,
    ) -> Ray {
        sampler.start(key);
        let (place, weight) = self.filter.sample(sampler.get_2d(Dimension::PIXEL));
        let film = key.pixel().as_vec2() + place;
        let is_seen = self.camera.sees(film);
        out.weight(if is_seen { weight } else { 0.0 });
        let time = time.unwrap_or_else(|| self.time(sampler));
        if let Some(style) = self.lines.filter(|_| is_seen) {
            self.draw_lines(style, film, time, sampler, out);
        }
        let ray = self.ray_through(film, time, sampler);
        path_record::start(&ray, None, Spectrum::ONE, out);
        ray
    }

    /// Time of a sample: random between shutter open and close if anything moves, else 0.
    pub(super) fn time(&self, sampler: &impl Sampler) -> f32 {
        self.time_at(|| sampler.get_1d(Dimension::TIME))
    }

    /// Returns `true` if the scene or the camera moves.
    pub(super) fn moves(&self) -> bool {
        self.scene.is_moving() || self.camera.is_moving()
    }

    /// Time at the fraction `u` of the interval between shutter open and close. Calls `u` only if
    /// anything moves.
    pub(super) fn time_at(&self, u: impl FnOnce() -> f32) -> f32 {
        if self.moves() { self.camera.time(u()) } else { 0.0 }
    }

    /// Chooses a light with a probability proportional to its power, by the random number `choice`.
    /// Then samples the emission of this light. Returns the light, the probability of the choice,
    /// and the emission.
    pub(super) fn sample_emission(
        &self,
        time: f32,
        choice: f32,
        u: impl FnOnce() -> [Vec2; 2],
    ) -> Option<(LightId, f32, Emission)> {
        let (id, pmf) = self.scene.emission_selection().sample(choice)?;
        Some((id, pmf, self.emission_of(id, time, u())?))
    }

    /// Samples a point on the light `id` and a direction of emission.
    pub(super) fn emission_of(&self, id: LightId, time: f32, [u_position, u_direction]: [Vec2; 2]) -> Option<Emission> {
        let light = &self.scene.lights()[id.0 as usize];
        light.sample_emission(time, u_position, u_direction, self.scene.textures(), &self.scene.ball())
    }

    /// Ray from a random point of the lens through the film point `film` (pixels, origin top left).
    #[inline(always)]
    pub(super) fn ray_through(&self, film: Vec2, time: f32, sampler: &impl Sampler) -> Ray {
        let lens = if self.camera.has_lens() {
            sampler.get_2d(Dimension::LENS)
        } else {
            Vec2::ZERO
        };
        self.camera.ray(film, lens, time)
    }

    /// Returns `true` if surfaces and lights do not move while the shutter is open.
    pub fn is_still(&self) -> bool {
        let [open, close] = self.camera.shutter();
        !self.scene.is_moving() || open == close
    }

    /// Vertex at the first surface of the sample `key`. Passes the auxiliary channels of the
    /// surface to `out`. `None` if the ray leaves the scene.
    pub fn first_vertex<'v>(
        &'v self,
        key: SampleKey,
        sampler: &mut impl Sampler,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Option<Vertex<'v>> {
        let ray = self.camera_ray(key, None, sampler, out);
        let (hit, beta) = self.intersect(&ray, RayKind::Camera, out);
        let Some(hit) = hit else {
            self.see_background(&ray, beta, out);
            return None;
        };
        let vertex = self.vertex(&hit, &ray, None, slot);
        let first = self.first_surface(&vertex, out);
        out.first_surface(first);
        Some(vertex)
    }

    /// Closest hit of `ray`, and the transmittance up to the hit. Rays pass surfaces with alpha and
    /// thin glass at random. Thin glass and absorbing bodies tint the light.
    #[inline(always)]
    pub fn intersect(&self, ray: &Ray, kind: RayKind, out: &mut impl RaySink) -> (Option<Hit>, Spectrum) {
        out.ray(kind);
        let hit = self.accel.intersect(ray);
        if self.scene.has_absorption() {
            return self.first_in_bodies(ray, hit, kind, None, out);
        }
        if self.lets_pass(kind) {
            return self.first_opaque(*ray, hit, kind, None, out);
        }
        (hit, Spectrum::ONE)
    }

    /// [`World::first_opaque`] for scenes with bodies that absorb light. The tint includes the
    /// absorption.
    #[inline(never)]
    pub(super) fn first_in_bodies(
        &self,
        ray: &Ray,
        first: Option<Hit>,
        kind: RayKind,
        u: Option<f32>,
        out: &mut impl RaySink,
    ) -> (Option<Hit>, Spectrum) {
        let (hit, tint) = if self.lets_pass(kind) {
            self.first_opaque(*ray, first, kind, u, out)
        } else {
            (first, Spectrum::ONE)
        };
        (
            hit,
            hit.map_or(tint, |hit| tint * self.scene.transmittance_to(&hit, ray)),
        )
    }

    /// Returns `true` if rays of this kind may pass surfaces without a change of direction.
    #[inline(always)]
    pub(super) fn lets_pass(&self, kind: RayKind) -> bool {
        self.scene.lets_light_pass()
            || (kind == RayKind::Camera && (self.scene.hides_from_camera() || self.scene.ground().is_some()))
    }

    /// First surface along `ray` that stops the ray, and the tint of the glass in front of this
    /// surface. `first` is the closest hit of the ray. A surface of opacity α stops the fraction α
    /// of all rays, by [`stops`]. A random number decides whether the ray passes thin glass: `u` in
    /// [0, 1), or a hash if `u` is `None`.
    #[inline(never)]
    pub(super) fn first_opaque(
        &self,
        ray: Ray,
        first: Option<Hit>,
        kind: RayKind,
        u: Option<f32>,
        out: &mut impl RaySink,
    ) -> (Option<Hit>, Spectrum) {
        let has_thin_surfaces = self.scene.has_thin_surfaces();
        let mut choices = ThinSurfaceChoices::new(u);
        let is_opaque = |hit: &Hit| {
            stops(hit, &ray, self.scene.opacity(hit)) && !(has_thin_surfaces && choices.passes(hit, &ray, self.scene))
        };
        let hit = self.first_that(is_opaque, ray, first, kind, out);
        (hit, choices.tint)
    }

    /// First surface along `ray` for which `is_opaque` returns `true`. `first` is the closest hit
    /// of the ray. The ground does not stop camera rays from below. For the backend, a sphere or
    /// disk lamp is a mesh that covers the lamp, called its hull (`scene/lamp_hulls.rs`). If `ray`
    /// enters a hull and meets the lamp, surfaces between the hull and the lamp count as in front
    /// of the lamp.
    #[inline(always)]
    pub(super) fn first_that(
        &self,
        mut is_opaque: impl FnMut(&Hit) -> bool,
        ray: Ray,
        first: Option<Hit>,
        kind: RayKind,
        out: &mut impl RaySink,
    ) -> Option<Hit> {
        let is_below = |hit: &Hit| {
            let ground = self.scene.ground().filter(|ground| ground.is_at(hit));
            kind == RayKind::Camera && ground.is_some_and(|ground| ray.direction.dot(ground.normal()) >= 0.0)
        };
        // Ray parameter at which the surface stops the ray; `None` if the ray passes
        let mut stop = |hit: &Hit| match self.scene.hull_hit(hit, &ray) {
            HullHit::Misses => None,
            HullHit::Enters(t) => Some(t),
            HullHit::NoHull => {
                let stops =
                    !is_below(hit) && self.scene.is_visible(hit, &ray, kind == RayKind::Camera) && is_opaque(hit);
                stops.then_some(hit.t)
            }
        };
        let mut hit = first?;
        let mut walk = OpacityWalk::behind(self.accel, ray, &hit);
        let mut lamp: Option<Hit> = None;
        loop {
            match stop(&hit) {
                Some(t) if t > hit.t => {
                    lamp = lamp.filter(|lamp| lamp.t <= t).or(Some(Hit { t, ..hit }));
                    walk.end_at(t);
                }
                Some(_) => return Some(hit),
                None => {}
            }
            match walk.next(kind, out) {
                Some(next) => hit = next,
                None => return lamp.or(walk.is_cut().then_some(hit)),
            }
        }
    }

    /// Transmittance along `ray`. It is 1 or 0, unless the ray crosses thin glass or surfaces of
    /// opacity below 1, or lies in an absorbing body.
    #[inline(always)]
    pub fn transmittance(&self, ray: &Ray, out: &mut impl RaySink) -> Transmittance {
        let passed = self.transmittance_of_surfaces(ray, out);
        match ray.body {
            0 => passed,
            _ => Transmittance {
                tint: passed.tint * self.scene.transmittance_along(ray),
                ..passed
            },
        }
    }

    #[inline(always)]
    fn transmittance_of_surfaces(&self, ray: &Ray, out: &mut impl RaySink) -> Transmittance {
        if self.scene.lets_light_pass() {
            return self.transmittance_by_walk(*ray, false, out);
        }
        out.ray(RayKind::Shadow);
        if self.accel.occluded(ray) {
            Transmittance::BLOCKED
        } else {
            Transmittance::CLEAR
        }
    }

    /// [`World::transmittance`] for a ray between the lens and `seen`, the hit of a surface that
    /// the camera sees.
    #[inline(always)]
    pub fn transmittance_to_lens(&self, ray: &Ray, seen: &Hit, out: &mut impl RaySink) -> Transmittance {
        if !self.scene.hides_from_camera() {
            return self.transmittance(ray, out);
        }
        if !self.scene.is_visible_to_camera(seen) {
            return Transmittance::BLOCKED;
        }
        let passed = self.transmittance_by_walk(*ray, true, out);
        Transmittance {
            tint: passed.tint * self.scene.transmittance_along(ray),
            ..passed
        }
    }

    #[inline(never)]
    fn transmittance_by_walk(&self, ray: Ray, is_from_camera: bool, out: &mut impl RaySink) -> Transmittance {
        let mut walk = OpacityWalk::along(self.accel, ray);
        let mut transmittance = Transmittance::CLEAR;
        while let Some(hit) = walk.next(RayKind::Shadow, out) {
            transmittance.cross(&hit, &ray, self.scene, is_from_camera);
            if transmittance.is_blocked() {
                return Transmittance::BLOCKED;
            }
        }
        if walk.is_cut() {
            Transmittance::BLOCKED
        } else {
            transmittance
        }
    }

    /// Vertex at `hit`, seen along `ray`. `wavelength` is the wavelength of the path, if it has
    /// one. `slot` stores the BSDF if the BSDF varies over the surface, and the `BsdfView` of the
    /// BSDF.
    #[inline(always)]
    pub fn vertex<'v>(
        &'v self,
        hit: &Hit,
        ray: &Ray,
        wavelength: Option<&Wavelength>,
        slot: &'v BsdfSlot<'v>,
    ) -> Vertex<'v> {
        let mut vertex = self.undispersed_vertex(hit, ray, slot);
        if let Some(bsdf) = wavelength.and_then(|wavelength| self.dispersed(hit, slot, wavelength)) {
            vertex.bsdf = bsdf;
            vertex.is_dispersing = true;
        }
        vertex
    }

    #[inline(always)]
    fn undispersed_vertex<'v>(&'v self, hit: &Hit, ray: &Ray, slot: &'v BsdfSlot<'v>) -> Vertex<'v> {
        let Some((point, bsdf)) = self.scene.plain_surface(hit, ray.time) else {
            return self.detailed_vertex(hit, ray, slot);
        };
        let frame = Frame::from_z(point.ns);
        let wo = frame.to_local(-ray.direction);
        Vertex {
            hit: *hit,
            wo,
            bsdf,
            view: Vertex::view_in(slot, bsdf, wo),
            frame,
            point,
            is_bent: false,
            is_dispersing: false,
            body: self.scene.body_behind(hit),
        }
    }

    /// Ray that leaves `vertex` in the unit direction `wi` (local frame).
    #[inline(always)]
    pub fn ray_along(&self, vertex: &Vertex, wi: Vec3) -> Ray {
        let w = vertex.frame.to_world(wi);
        let ray = Ray::new(self.origin_on(&vertex.point, Side::of(wi.z), w), w);
        ray.when(vertex.point.time).within(vertex.body_towards(wi))
    }

    /// Origin of rays that leave `vertex` in the unit direction `w` (world frame). `wi` is the same
    /// direction in the local frame.
    #[inline(always)]
    pub fn origin(&self, vertex: &Vertex, wi: Vec3, w: Vec3) -> Vec3 {
        self.origin_on(&vertex.point, Side::of(wi.z), w)
    }

    /// Origin of rays that leave `point` in the unit direction `w`, which is on `side` of the
    /// shading normal.
    ///
    /// If `w` is on the other side of the geometric normal, the ray still starts on `side`, so that
    /// it never starts behind a wall. The ray then hits the surface itself, or goes past the rim of
    /// a curved surface.
    #[inline(always)]
    pub fn origin_on(&self, point: &SurfacePoint, side: Side, w: Vec3) -> Vec3 {
        let height = point.height(side);
        if height == 0.0 || point.is_above(side, w) {
            return offset_to(point, side);
        }
        self.raised_origin(point, side, height)
    }

    /// Origin raised from the triangle to the curved surface that the triangle approximates. If
    /// another surface lies in between, the origin is not raised, because a ray that starts inside
    /// another object finds no light.
    #[inline(never)]
    fn raised_origin(&self, point: &SurfacePoint, side: Side, height: f32) -> Vec3 {
        let (low, high) = (offset_to(point, side), point.raised(side, height));
        if self.accel.occluded(&segment(low, high).when(point.time)) {
            low
        } else {
            high
        }
    }

    /// Random wavelength for the light of a path. `None` if the scene has no dispersive glass.
    #[inline(always)]
    pub(super) fn wavelength(&self, sampler: &impl Sampler) -> Option<Wavelength> {
        (self.scene.is_dispersive()).then(|| Wavelength::sample(sampler.get_1d(Dimension::WAVELENGTH)))
    }

    /// BSDF of the surface at `hit` for `wavelength`, stored in `slot`. `None` if the BSDF does not
    /// depend on the wavelength.
    #[inline(never)]
    fn dispersed<'v>(&self, hit: &Hit, slot: &'v BsdfSlot<'v>, wavelength: &Wavelength) -> Option<&'v Bsdf> {
        let bsdf = self.scene.bsdf_of_wavelength(hit, wavelength.nanometers)?;
        Some(slot.bsdf.get_or_init(|| bsdf))
    }

    /// [`World::vertex`] for surfaces whose normals or materials vary.
    #[inline(never)]
    fn detailed_vertex<'v>(&'v self, hit: &Hit, ray: &Ray, slot: &'v BsdfSlot<'v>) -> Vertex<'v> {
        let wo = -ray.direction;
        let point = self.scene.surface_point_along(hit, ray);
        let footprint = self.footprint(&point);
        let shaded = self.scene.with_bumps(hit, point, footprint);
        let point = shaded.seen_from(wo);
        let frame = self.scene.frame(hit, &point);
        let wo = frame.to_local(wo);
        let bsdf = self.scene.bsdf(hit, ray.time, footprint, &slot.bsdf);
        Vertex {
            hit: *hit,
            wo,
            bsdf,
            view: Vertex::view_in(slot, bsdf, wo),
            frame,
            point,
            is_bent: point.ns != shaded.ns,
            is_dispersing: false,
            body: self.scene.body_behind(hit),
        }
    }

    /// Footprint of a ray on the surface at `point`, in scene units: [`SAMPLE_WIDTH`] times the
    /// width of a pixel in a direct view from the camera. Along a path the true footprint is at
    /// least this wide (PBR4 §10.1.3, which approximates the same way). The footprint depends only
    /// on the point, because camera paths and light paths that hit the point must find the same
    /// surface there.
    pub(super) fn footprint(&self, point: &SurfacePoint) -> f32 {
        let to = self.camera.view_of(point.p, point.time);
        // At grazing angles the footprint of a pixel is stretched along one axis. Use the side of a
        // square of the same area.
        let cos = (to.dot(point.ng) / to.length()).abs().max(1e-2);
        SAMPLE_WIDTH * self.camera.pixel_width(point.p, point.time) / cos.sqrt()
    }
}
