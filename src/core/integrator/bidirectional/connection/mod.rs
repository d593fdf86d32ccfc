//! Connections of a camera subpath and a light subpath by all strategies (s, t), and their weights
//! (`weights`).
//!
//! With s = 1 a new point on a light is sampled for the last camera vertex. With t = 1 a new point
//! on the lens is sampled. `light_tracing` uses only t = 1, `metropolis/pssmlt.rs` uses single
//! strategies, and `photon/vcm.rs` adds merging.

mod light_samples;
mod weights;

use super::subpath::{self, EMISSION_BLOCK, PathRay, PathVertex, Surface, Walk, block};
use crate::accel::Accel;
use crate::bsdf::{ScatteringEvent, TransportMode};
use crate::camera::LensPoint;
use crate::color::Spectrum;
use crate::film::FirstSurface;
use crate::geometry::segment;
use crate::integrator::path_record;
use crate::integrator::search_radius::Radii;
use crate::integrator::{FoundLight, Heuristic, PathEvent, RaySink, Roulette, SplatSink, World};
use crate::light::LightId;
use crate::light_sampling::LightSampleContext;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};
use crate::scene::Scene;
use light_samples::{LightDimensions, sample_lights};
use weights::LightHit;

/// Connects a camera subpath and a light subpath by all strategies.
///
/// A strategy (s, t) uses s vertices of the light subpath and t of the camera subpath (Veach 1997,
/// §10.2). With s = 1 a new point on a light is sampled for the last camera vertex. With t = 1 a
/// new point on the lens is sampled.
#[derive(Debug)]
pub(crate) struct Connector<'w, 'a, A> {
    pub world: &'w World<'a, A>,
    pub heuristic: Heuristic,
    pub roulette: Roulette,
    /// Maximum number of scattering events.
    pub max_depth: Option<u32>,
    /// Merging of light subpaths with camera subpaths, if enabled.
    pub merging: Option<Merging<'w>>,
}

/// Merging of subpaths that end near each other (Georgiev, Křivánek, Davidovič and Slusallek 2012,
/// "Light Transport Simulation with Vertex Connection and Merging").
#[derive(Clone, Copy, Debug)]
pub(crate) struct Merging<'w> {
    /// Number of light subpaths that may be merged with each camera subpath.
    pub paths: f32,
    /// Search radii: maximum distance between the ends of merged subpaths.
    pub radii: &'w Radii<'w>,
}

impl Merging<'_> {
    /// The factor `π r² n` (eq. 7 of Georgiev et al.). It converts the density of light vertices
    /// per area to the expected number of light vertices that are merged at the point `p`.
    fn acceptance(&self, p: Vec3, time: f32) -> f64 {
        let radius = self.radii.at(p, time) as f64;
        std::f64::consts::PI * radius * radius * self.paths as f64
    }
}

/// A camera subpath and a light subpath.
#[derive(Debug, Default)]
pub(crate) struct Subpaths<'a> {
    pub camera: Vec<PathVertex<'a>>,
    pub light: Vec<PathVertex<'a>>,
    /// Last segment of the camera subpath, if the subpath leaves the scene.
    pub escape: Option<PathRay>,
    /// Time of both subpaths.
    pub time: f32,
}

impl Subpaths<'_> {
    /// First surface of the camera subpath, for the auxiliary channels. `None` if the subpath hits
    /// no surface.
    pub fn first_seen<A: Accel>(&self, world: &World<A>, out: &mut impl RaySink) -> Option<FirstSurface> {
        let first = self.camera.get(1).and_then(PathVertex::surface)?;
        Some(first.first_seen(world, out))
    }

    /// Returns `true` if the camera subpath scatters only by delta lobes before its vertex number
    /// `count`, which is on a light.
    pub fn is_light_seen_by_delta(&self, count: usize) -> bool {
        let between = self.camera.iter().skip(1).take(count.saturating_sub(2));
        between.into_iter().all(|vertex| vertex.is_delta)
    }
}

/// Contribution of one strategy to the image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contribution {
    /// Strategy (s, t): number of light vertices and number of camera vertices.
    pub strategy: (usize, usize),
    /// Light of the strategy without the MIS weight. It is an estimate of the light of all paths
    /// with s + t vertices. The light falls on the pixel of the sample or on the position `film`.
    pub radiance: Spectrum,
    /// MIS weight of the strategy.
    pub weight: f32,
    /// Position on the film. `None`: the pixel of the sample.
    pub film: Option<Vec2>,
    /// Light source of the path.
    pub light: LightId,
    /// Scattering events at the connected vertices, the vertex of the light subpath first. `None`
    /// if there is no connection, or if the render does not separate classes of light paths.
    pub ends: [Option<ScatteringEvent>; 2],
}

impl Contribution {
    /// All scattering events in order from the light, if the render separates classes of light
    /// paths. `paths` are the subpaths of the contribution.
    pub fn events<'p>(&self, paths: &'p Subpaths) -> impl Iterator<Item = ScatteringEvent> + 'p {
        let (s, t) = self.strategy;
        // Vertices of a subpath, except its first vertex and the connected vertex
        fn inner<'p>(path: &'p [PathVertex], count: usize) -> &'p [PathVertex<'p>] {
            path.get(1..count.saturating_sub(1)).unwrap_or_default()
        }
        let of_light = inner(&paths.light, s).iter().filter_map(|vertex| vertex.event);
        let of_camera = inner(&paths.camera, t).iter().rev().filter_map(|vertex| vertex.event);
        of_light.chain(self.ends.into_iter().flatten()).chain(of_camera)
    }

    /// Light with the radiance `radiance` and the source of this contribution.
    pub fn light(&self, radiance: Spectrum, scene: &Scene) -> FoundLight<'static> {
        let (s, t) = self.strategy;
        FoundLight::of(radiance, self.light, scene, (s + t - 2) as u32)
    }

    /// Records the strategy. Call this just before the light of the contribution is added.
    pub fn record(&self, out: &mut impl RaySink) {
        if out.records() {
            out.record(PathEvent::Connection {
                strategy: self.strategy,
                is_merged: false,
                light: self.light,
                weight: self.weight,
                radiance: self.radiance,
            });
        }
    }

    /// Adds the weighted light to the pixel of the sample, or at the position `film`.
    pub fn add_to(&self, scene: &Scene, out: &mut impl SplatSink) {
        let light = self.light(self.radiance * self.weight, scene);
        self.record(out);
        match self.film {
            Some(film) => out.splat(film, light),
            None => out.light(light),
        }
    }
}

impl<'w, 'a, A: Accel> Connector<'w, 'a, A> {
    /// A connector without merging.
    pub fn new(world: &'w World<'a, A>, heuristic: Heuristic, roulette: Roulette, max_depth: Option<u32>) -> Self {
        Self {
            world,
            heuristic,
            roulette,
            max_depth,
            merging: None,
        }
    }

    /// Number of light paths in an iteration, which is the number of pixels of the image.
    fn paths(&self) -> f32 {
        let size = self.world.camera.resolution();
        size.x as f32 * size.y as f32
    }

    /// Maximum number of vertices of a path.
    pub fn max_vertices(&self) -> usize {
        subpath::max_vertices(self.max_depth)
    }

    /// Traces a camera subpath along `ray` and a light subpath.
    pub fn subpaths(&self, ray: Ray, sampler: &impl Sampler, out: &mut impl RaySink) -> Subpaths<'a> {
        let (camera, escape) = self.camera_path(ray, sampler, out);
        let mut light = self.light_path(ray.time, sampler, out);
        self.sum_light(&mut light, ray.time);
        Subpaths {
            light,
            camera,
            escape,
            time: ray.time,
        }
    }

    /// Traces the camera subpath along `ray`. Returns its vertices, and its last segment if the
    /// subpath leaves the scene.
    pub fn camera_path(
        &self,
        ray: Ray,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
    ) -> (Vec<PathVertex<'a>>, Option<PathRay>) {
        let lens = PathVertex::lens(self.world, self.world.camera.lens_of(&ray));
        let first = PathRay {
            ray,
            beta: Spectrum::ONE,
            pdf: self.pdf_of_camera(ray.origin, ray.direction, ray.time),
        };
        path_record::start(&ray, None, Spectrum::ONE, out);
        let mut path = vec![lens];
        let walk = self.walk(TransportMode::Radiance, self.max_vertices());
        let escape = walk.follow(&mut path, first, sampler, out);
        self.sum_camera(&mut path, ray.time);
        (path, escape)
    }

    /// Traces a light subpath at `time`. Returns no vertices if no light emits. Call
    /// [`Connector::sum_light`] before MIS weights of the subpath are computed.
    pub fn light_path(&self, time: f32, sampler: &impl Sampler, out: &mut impl RaySink) -> Vec<PathVertex<'a>> {
        let number = |what| Dimension::bounce(EMISSION_BLOCK, what);
        let choice = sampler.get_2d(number(Bounce::Decisions)).x;
        let u = || [Bounce::LightPoint, Bounce::Direction].map(|what| sampler.get_2d(number(what)));
        let Some((id, pmf, emission)) = self.world.sample_emission(time, choice, u) else {
            return Vec::new();
        };
        let first = PathRay {
            ray: Ray::new(emission.origin, emission.w).when(time),
            beta: emission.weight() * (1.0 / pmf),
            pdf: if emission.is_infinite {
                emission.pdf_position
            } else {
                emission.pdf_direction
            },
        };
        path_record::start(&first.ray, Some(id), first.beta, out);
        let mut path = vec![PathVertex::light(id, pmf, &emission)];
        let walk = self.walk(TransportMode::Importance, self.max_vertices() - 1);
        walk.follow(&mut path, first, sampler, out);
        path
    }

    fn walk(&self, mode: TransportMode, max: usize) -> Walk<'_, 'a, A> {
        Walk {
            world: self.world,
            mode,
            roulette: self.roulette,
            max,
        }
    }

    /// Calls `found` with the contribution of each strategy that connects the subpaths `paths`.
    pub fn all(
        &self,
        paths: &mut Subpaths<'a>,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: impl FnMut(Contribution),
    ) {
        self.all_of(2, paths, sampler, out, found);
    }

    /// Calls `found` with the contributions of paths with at least `min_vertices` vertices.
    /// `min_vertices` must be at least 2.
    pub fn all_of(
        &self,
        min_vertices: usize,
        paths: &mut Subpaths<'a>,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        mut found: impl FnMut(Contribution),
    ) {
        let max = self.max_vertices();
        for t in 1..=paths.camera.len() {
            for s in 0..=max - t {
                // s = 1 needs no vertex of the light subpath.
                if s + t >= min_vertices && s <= paths.light.len().max(1) {
                    self.strategy((s, t), paths, sampler, out, &mut found);
                }
            }
        }
        if paths.camera.len() + 1 >= min_vertices {
            self.escape(paths, &mut found);
        }
    }

    /// Calls `found` with the contributions of the strategy `strategy`, (s, t). `paths` must have
    /// enough vertices. For s = 0 only emission of surfaces that the camera subpath hits is
    /// included.
    pub fn strategy(
        &self,
        strategy: (usize, usize),
        paths: &Subpaths<'a>,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let (camera, light) = (&paths.camera, &paths.light);
        match strategy {
            (0, t) => self.hit_light(&camera[..t], paths.time, found),
            (1, 1) => self.sample_light_for_lens(paths.time, sampler, out, found),
            (1, t) => self.sample_light(&camera[..t], paths.time, sampler, out, found),
            (s, 1) => self.connect_to_lens(&light[..s], paths.time, sampler, out, found),
            (s, t) => self.connect(&camera[..t], &light[..s], paths.time, out, found),
        }
    }

    /// s = 0: the camera subpath hits a light.
    fn hit_light(&self, camera: &[PathVertex<'a>], time: f32, found: &mut impl FnMut(Contribution)) {
        let [.., before, last] = camera else { return };
        let Some(surface) = last.surface() else { return };
        let from = self.light_context(before);
        let Some(light) = surface.emitted(self.world, &from) else {
            return;
        };
        let light_hit = LightHit {
            light: light.id,
            direct: before.density_at(light.pdf, last),
        };
        found(Contribution {
            strategy: (0, camera.len()),
            radiance: last.beta * light.radiance,
            weight: self.weight(camera, &[], Some(light_hit), time),
            film: None,
            light: light.id,
            ends: [None; 2],
        });
    }

    /// s = 0: the camera subpath leaves the scene and hits infinitely distant lights.
    pub fn escape(&self, paths: &mut Subpaths<'a>, found: &mut impl FnMut(Contribution)) {
        let (camera, time) = (&mut paths.camera, paths.time);
        let (Some(PathRay { ray, beta, pdf }), Some(last)) = (paths.escape, camera.last()) else {
            return;
        };
        let from = self.light_context(last);
        for light in self
            .world
            .scene
            .escaped(self.world.light_selection, from, ray.direction)
        {
            if light.radiance.is_black() {
                continue;
            }
            camera.push(PathVertex::far_away(light.id, ray.direction, pdf));
            let light_hit = LightHit {
                light: light.id,
                direct: light.pdf,
            };
            found(Contribution {
                strategy: (0, camera.len()),
                radiance: beta * light.radiance,
                weight: self.weight(camera, &[], Some(light_hit), time),
                film: None,
                light: light.id,
                ends: [None; 2],
            });
            camera.pop();
        }
    }

    /// s = 1: a light is sampled for the last vertex of the camera subpath.
    fn sample_light(
        &self,
        camera: &[PathVertex<'a>],
        time: f32,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let Some(last) = camera.last() else { return };
        let Some(surface) = last.surface().filter(|surface| !surface.bsdf.is_delta()) else {
            return;
        };
        let number = |what| Dimension::bounce(block(TransportMode::Radiance, camera.len() as u32 - 2), what);
        let numbers = LightDimensions {
            choice: number(Bounce::Decisions),
            point: number(Bounce::LightPoint),
        };
        sample_lights(
            self.world.scene,
            self.world.light_selection,
            &self.light_context(last),
            time,
            &numbers,
            sampler,
            |sampled| {
                let wi = sampled.sample.wi;
                let f = surface.scattered(self.world.scene, surface.back, wi);
                if f.is_black() {
                    return;
                }
                let ray = sampled
                    .sample
                    .shadow_ray(surface.origin_towards_light(self.world, surface.back, wi))
                    .when(time)
                    .within(surface.body_towards(wi));
                let transmittance = self.world.transmittance(&ray, out).color();
                if !transmittance.is_black() {
                    found(Contribution {
                        strategy: (1, camera.len()),
                        radiance: last.beta * f * sampled.radiance() * transmittance,
                        weight: self.weight(camera, &[sampled.vertex()], None, time),
                        film: None,
                        light: sampled.id,
                        ends: [None, self.event(surface, surface.back, wi)],
                    });
                }
            },
        );
    }

    /// s = t = 1: a light is sampled for the lens.
    fn sample_light_for_lens(
        &self,
        time: f32,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let lens = PathVertex::lens(self.world, self.lens_point(1, time, sampler));
        if !lens.takes_light_samples() {
            return;
        }
        let number = |what| Dimension::bounce(EMISSION_BLOCK, what).nth(0);
        let numbers = LightDimensions {
            choice: number(Bounce::Decisions),
            point: number(Bounce::LightPoint),
        };
        sample_lights(
            self.world.scene,
            self.world.light_selection,
            &LightSampleContext::any_side(lens.p),
            time,
            &numbers,
            sampler,
            |sampled| {
                let wi = sampled.sample.wi;
                // The camera cannot see delta lights.
                let seen = self.seen(&lens, wi, time).filter(|_| !sampled.sample.is_delta);
                let Some((film, importance)) = seen else { return };
                let ray = sampled.sample.shadow_ray(lens.p).when(time);
                let transmittance = self.world.transmittance(&ray, out).color();
                if !transmittance.is_black() {
                    let camera = std::slice::from_ref(&lens);
                    found(Contribution {
                        strategy: (1, 1),
                        radiance: sampled.radiance() * (transmittance * importance),
                        weight: self.weight(camera, &[sampled.vertex()], None, time),
                        film: Some(film),
                        light: sampled.id,
                        ends: [None; 2],
                    });
                }
            },
        );
    }

    /// t = 1: the last vertex of the light subpath is connected to the lens.
    fn connect_to_lens(
        &self,
        light: &[PathVertex<'a>],
        time: f32,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let Some((last, surface)) = light.last().and_then(|v| Some((v, v.surface()?))) else {
            return;
        };
        let lens = self.lens_point(light.len(), time, sampler);
        let Some(lens) = self.world.camera.lens_facing(lens, last.p, time) else {
            return;
        };
        let lens = PathVertex::lens(self.world, lens);
        let w = last.direction_to(&lens);
        let Some((film, importance)) = self.seen(&lens, -w, time) else {
            return;
        };
        let squared = if lens.is_infinite() {
            1.0
        } else {
            last.p.distance_squared(lens.p)
        };
        let geometry = w.dot(last.ng).abs() / squared;
        let f = surface.adjoint_throughput(self.world.scene, w, surface.back);
        let radiance = last.beta * f * (geometry * importance);
        if radiance.is_black() {
            return;
        }
        let ray = segment(surface.origin_towards_camera(w), lens.p).when(time);
        let ray = ray.within(surface.body_towards(w));
        let transmittance = self.world.transmittance_to_lens(&ray, &surface.hit, out).color();
        if !transmittance.is_black() {
            found(Contribution {
                strategy: (light.len(), 1),
                radiance: radiance * transmittance,
                weight: self.weight(std::slice::from_ref(&lens), light, None, time),
                film: Some(film),
                light: light[0].light_id(),
                ends: [self.event(surface, w, surface.back), None],
            });
        }
    }

    /// s, t > 1: the last vertices of both subpaths are connected by an edge.
    fn connect(
        &self,
        camera: &[PathVertex<'a>],
        light: &[PathVertex<'a>],
        time: f32,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let (Some(a), Some(b)) = (camera.last(), light.last()) else {
            return;
        };
        let (Some(at_a), Some(at_b)) = (a.surface(), b.surface()) else {
            return;
        };
        let w = a.direction_to(b);
        let scene = self.world.scene;
        let geometry = w.dot(b.ng).abs() / a.p.distance_squared(b.p);
        let f = at_a.scattered_arrival(scene, at_a.back, w) * at_b.adjoint_throughput(scene, -w, at_b.back);
        let radiance = a.beta * f * b.beta * geometry;
        if radiance.is_black() {
            return;
        }
        let ends = (
            at_a.origin_towards_light(self.world, at_a.back, w),
            at_b.origin_towards_camera(-w),
        );
        let body = match at_a.body_towards(w) {
            0 => at_b.body_towards(-w),
            body => body,
        };
        let ray = segment(ends.0, ends.1).when(time).within(body);
        let transmittance = self.world.transmittance(&ray, out).color();
        if !transmittance.is_black() {
            found(Contribution {
                strategy: (light.len(), camera.len()),
                radiance: radiance * transmittance,
                weight: self.weight(camera, light, None, time),
                film: None,
                light: light[0].light_id(),
                ends: [self.event(at_b, -w, at_b.back), self.event(at_a, at_a.back, w)],
            });
        }
    }

    /// Scattering event of light that comes from the direction `wi` and leaves a connected vertex
    /// in the direction `wo`. `None` if the render does not separate classes of light paths.
    fn event(&self, surface: &Surface, wo: Vec3, wi: Vec3) -> Option<ScatteringEvent> {
        self.world.paths.map(|_| surface.event(self.world.scene, wo, wi, false))
    }

    /// Samples a point of the lens for a light subpath of `s` vertices.
    fn lens_point(&self, s: usize, time: f32, sampler: &impl Sampler) -> LensPoint {
        let u = if self.world.camera.has_lens() {
            sampler.get_2d(Dimension::LENS.nth(s as u32))
        } else {
            Vec2::ZERO
        };
        self.world.camera.lens_point(u, time)
    }

    /// Film position of light that arrives at the lens from the direction `w`, and the weight of
    /// this light for one light path of the iteration. The weight is the importance divided by the
    /// density of the lens point and by the number of light paths.
    fn seen(&self, lens: &PathVertex, w: Vec3, time: f32) -> Option<(Vec2, f32)> {
        let importance = self.world.camera.importance(lens.p, w, time)?;
        let we = importance.we * lens.cosine(w) / lens.forward;
        Some((importance.film, we / self.paths()))
    }

    /// Light sampling context of the vertex of a camera path, seen from its previous vertex.
    fn light_context(&self, vertex: &PathVertex) -> LightSampleContext {
        match vertex.surface() {
            Some(surface) => surface.light_context(self.world.scene, surface.back),
            None => LightSampleContext::any_side(vertex.p),
        }
    }

    /// Density with which a path of the iteration leaves the lens point `p` in direction `w`: per
    /// solid angle, or per area perpendicular to the rays if camera rays are parallel.
    fn pdf_of_camera(&self, p: Vec3, w: Vec3, time: f32) -> f32 {
        let importance = self.world.camera.importance(p, w, time);
        importance.map_or(0.0, |importance| importance.pdf / self.paths())
    }
}
