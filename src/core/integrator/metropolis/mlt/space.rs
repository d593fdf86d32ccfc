//! Path space of a scene: sampling of vertices, subpaths and connections for the paths of chains.

use super::numbers::Numbers;
use super::path::{CameraSample, LightEnd, LightEndKind, Path, Single, Vertex};
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::color::Spectrum;
use crate::geometry::segment;
use crate::integrator::bidirectional::subpath::{Surface, VertexKind};
use crate::integrator::metropolis::options::FilmArea;
use crate::integrator::opacity::Transmittance;
use crate::integrator::{ImportanceImage, RayKind, RaySink, World};
use crate::light::{Light, LightId};
use crate::light_sampling::LightSampleContext;
use crate::math::{Frame, Ray, Vec2, Vec3};
use crate::sampling::warp::{cosine_hemisphere, uniform_disk};
use std::ops::Range;
use std::rc::Rc;

/// Space of all paths that chains may visit, with the steps that make subpaths.
#[derive(Debug)]
pub(super) struct PathSpace<'w, 'a, A> {
    pub world: &'w World<'a, A>,
    /// Importance image. The target is the luminance of a path divided by this image.
    importance: &'w ImportanceImage,
    /// True if the space contains paths on which lamps are seen only through delta lobes.
    has_lamps: bool,
    /// Minimum number of vertices of a path, including both ends.
    pub min_vertices: usize,
    /// Maximum number of vertices of a path.
    pub max_vertices: usize,
    pub film: FilmArea,
    /// Number of infinitely distant lights that rays can hit.
    pub far_lights: usize,
}

impl<'w, 'a, A: Accel> PathSpace<'w, 'a, A> {
    /// The space of paths with `min_vertices` to `max_vertices` vertices.
    pub fn new(
        world: &'w World<'a, A>,
        importance: &'w ImportanceImage,
        min_vertices: usize,
        max_vertices: usize,
        has_lamps: bool,
    ) -> Self {
        Self {
            world,
            importance,
            has_lamps,
            min_vertices,
            max_vertices,
            film: FilmArea::of(world),
            far_lights: world
                .scene
                .escaped(world.light_selection, LightSampleContext::any_side(Vec3::ZERO), Vec3::Z)
                .count(),
        }
    }

    /// Vertex on the lens for a sample.
    pub fn lens(&self, CameraSample { lens, time }: CameraSample) -> Vertex<'a> {
        Vertex::lens(self.world.camera.lens_point(lens, time))
    }

    /// Vertex on the surface that `ray` hits. `None` if the ray leaves the scene.
    pub fn intersect(&self, ray: &Ray, kind: RayKind, out: &mut impl RaySink) -> Option<Vertex<'a>> {
        // The transmittance along the ray is not used here. `PathSpace::transmittance` computes it
        // for the edge.
        let (hit, _) = self.world.intersect(ray, kind, out);
        let hit = hit?;
        let surface = Surface::new(self.world, hit, ray);
        let (p, ng) = (surface.point.p, surface.point.ng);
        Some(Vertex::new(VertexKind::Surface(Rc::new(surface)), p, ng))
    }

    /// Vertex on the light that `ray` hits: on the surface `hit`, or on an infinitely distant light
    /// chosen by `u` if `hit` is `None`.
    pub fn light_at(&self, hit: Option<Vertex<'a>>, ray: &Ray, u: f32) -> Option<Vertex<'a>> {
        let scene = self.world.scene;
        let from = LightSampleContext::any_side(ray.origin);
        let Some(vertex) = hit else {
            let index = ((u * self.far_lights as f32) as usize).min(self.far_lights.checked_sub(1)?);
            let light = scene
                .escaped(self.world.light_selection, from, ray.direction)
                .nth(index)?;
            return Some(self.far_away(light.id, light.radiance, ray.direction));
        };
        let surface = vertex.surface()?;
        let light = surface.emitted(self.world, &from)?;
        let ng = scene.lights()[light.id.0 as usize].normal(vertex.p, ray.time)?;
        let source = LightEnd {
            id: light.id,
            kind: LightEndKind::Area,
            radiance: light.radiance,
            opacity: scene.opacity(&surface.hit),
            origin: surface.origin_towards_camera(ng),
        };
        Some(Vertex::new(VertexKind::Light(source), vertex.p, ng))
    }

    /// Vertex on the infinitely distant light `id` in the unit direction `w`.
    fn far_away(&self, id: LightId, radiance: Spectrum, w: Vec3) -> Vertex<'a> {
        let source = LightEnd {
            id,
            kind: LightEndKind::Far,
            radiance,
            opacity: 1.0,
            origin: Vec3::ZERO,
        };
        Vertex::new(VertexKind::Light(source), Vec3::ZERO, -w)
    }

    /// Vertex at a random point of a random light. The light is chosen by power.
    fn light(&self, time: f32, numbers: &mut Numbers) -> Option<Vertex<'a>> {
        let scene = self.world.scene;
        let (choice, u) = (numbers.next(), [numbers.next_2d(), numbers.next_2d()]);
        let (id, _, emission) = self.world.sample_emission(time, choice, || u)?;
        let kind = match (emission.is_infinite, &scene.lights()[id.0 as usize]) {
            (true, Light::Directional(_)) => LightEndKind::Parallel,
            (true, _) => LightEndKind::Far,
            (false, _) if emission.is_delta_position => LightEndKind::Point,
            (false, _) => LightEndKind::Area,
        };
        let source = LightEnd {
            id,
            kind,
            radiance: emission.radiance / emission.opacity,
            opacity: emission.opacity,
            origin: emission.origin,
        };
        // Infinitely distant lights have directions instead of positions.
        let p = if kind.is_infinite() { Vec3::ZERO } else { emission.p };
        Some(Vertex::new(VertexKind::Light(source), p, emission.ng))
    }

    /// Adds `count` vertices to the camera subpath `path`. If `to_light`, the last vertex is on the
    /// light that the subpath hits. `None` if a vertex cannot be made.
    pub fn extend_from_camera(
        &self,
        path: &mut Vec<Vertex<'a>>,
        count: usize,
        to_light: bool,
        sample: CameraSample,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<()> {
        for left in (0..count).rev() {
            if path.is_empty() {
                path.push(self.lens(sample));
                continue;
            }
            let (ray, kind) = self.onwards_from_camera(path, sample, numbers)?;
            let hit = self.intersect(&ray, kind, out);
            if is_same_point(path, &hit) {
                return None;
            }
            let next = if left == 0 && to_light {
                self.light_at(hit, &ray, numbers.next())?
            } else {
                hit?
            };
            self.note_through(path, &next, sample.time, out);
            path.push(next);
        }
        Some(())
    }

    /// Ray along which the camera subpath `path` continues, and the kind of the ray.
    pub fn onwards_from_camera(
        &self,
        path: &mut [Vertex<'a>],
        sample: CameraSample,
        numbers: &mut Numbers,
    ) -> Option<(Ray, RayKind)> {
        if path.len() > 1 {
            let ray = self.scatter(path, TransportMode::Radiance, numbers)?;
            return Some((ray, RayKind::Bounce));
        }
        let film = self.film.at(numbers.next_2d());
        let ray = self.world.camera.ray(film, sample.lens, sample.time);
        if let [lens] = path {
            lens.p = ray.origin;
        }
        Some((ray, RayKind::Camera))
    }

    /// Adds `count` vertices to the light subpath `path`, in order from the light. `None` if a
    /// vertex cannot be made.
    pub fn extend_from_light(
        &self,
        path: &mut Vec<Vertex<'a>>,
        count: usize,
        time: f32,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<()> {
        for _ in 0..count {
            let next = match path.last().map(|last| (last, last.source())) {
                None => self.light(time, numbers)?,
                Some((last, source)) => {
                    let ray = match source {
                        Some(source) => self.set_out(last, source, time, numbers)?,
                        None => self.scatter(path, TransportMode::Importance, numbers)?,
                    };
                    let mut next = self.intersect(&ray, RayKind::Bounce, out)?;
                    let last = path.last()?;
                    next.transmittance = self.transmittance(None, &next, last, time, out);
                    next
                }
            };
            path.push(next);
        }
        Some(())
    }

    /// Samples the ray that leaves the light `source` at `vertex`. The direction of the ray is
    /// random. For light from infinity, its position is random instead.
    fn set_out(&self, vertex: &Vertex, source: &LightEnd, time: f32, numbers: &mut Numbers) -> Option<Ray> {
        let u = numbers.next_2d();
        let (origin, w) = match source.kind {
            LightEndKind::Area => (source.origin, Frame::from_z(vertex.ng).to_world(cosine_hemisphere(u))),
            LightEndKind::Point => (
                source.origin,
                self.world.emission_of(source.id, time, [Vec2::ZERO, u])?.w,
            ),
            LightEndKind::Far | LightEndKind::Parallel => {
                (self.world.scene.ball().before(vertex.ng, uniform_disk(u)), vertex.ng)
            }
        };
        Some(Ray::new(origin, w).when(time))
    }

    /// Samples the ray along which the subpath `path` continues from its last vertex, on a surface.
    /// Sets `is_delta` of the vertex.
    fn scatter(&self, path: &mut [Vertex<'a>], mode: TransportMode, numbers: &mut Numbers) -> Option<Ray> {
        let (u_lobe, u) = (numbers.next(), numbers.next_2d());
        if u_lobe >= self.smooth_probability(path, mode)? {
            return self.scatter_by_delta(path, mode, numbers);
        }
        let [.., before, last] = path else { return None };
        let back = last.direction_to(before);
        let surface = last.surface()?;
        let frame = surface.frame_for(self.world.scene, back, mode);
        let sample = surface.sample(back, frame.to_local(back), u_lobe, u, mode)?;
        let wi = (!sample.is_delta()).then_some(sample.wi)?;
        let ray = surface.ray_onwards(self.world, back, frame.to_world(wi), mode);
        last.is_delta = false;
        Some(ray)
    }

    /// Probability that the subpath `path` leaves its last vertex, on a surface, by a lobe that is
    /// not a delta lobe.
    pub fn smooth_probability(&self, path: &[Vertex<'a>], mode: TransportMode) -> Option<f32> {
        let [.., before, last] = path else { return None };
        let back = last.direction_to(before);
        let surface = last.surface()?;
        let frame = surface.frame_for(self.world.scene, back, mode);
        Some(surface.bsdf.smooth_probability(frame.to_local(back)))
    }

    /// Samples the ray along which the subpath `path` leaves its last vertex, on a surface, by a
    /// delta lobe. Reflection or transmission is chosen with a probability proportional to its
    /// light.
    pub fn scatter_by_delta(&self, path: &mut [Vertex<'a>], mode: TransportMode, numbers: &mut Numbers) -> Option<Ray> {
        let [.., before, last] = path else { return None };
        let back = last.direction_to(before);
        let surface = last.surface()?;
        let frame = surface.frame_for(self.world.scene, back, mode);
        let local = frame.to_local(back);
        let sides = [true, false].map(|is_reflected| Single::of(&surface.bsdf, local, is_reflected, mode));
        let weights = sides.map(|side| side.map_or(0.0, |side| side.probability as f64));
        let direction = sides[numbers.choose(weights.into_iter())?]?.direction;
        let ray = surface.ray_onwards(self.world, back, frame.to_world(direction), mode);
        last.is_delta = true;
        Some(ray)
    }

    /// Transmittance between `a` and the next vertex `b`, for edges along which a ray was traced.
    /// `before` is the previous vertex of `a` on the camera's side, if it is known.
    pub fn transmittance(
        &self,
        before: Option<&Vertex>,
        a: &Vertex,
        b: &Vertex,
        time: f32,
        out: &mut impl RaySink,
    ) -> Transmittance {
        if self.world.scene.lets_light_pass() || self.world.scene.has_absorption() {
            self.visibility(before, a, b, time, out)
        } else {
            Transmittance::CLEAR
        }
    }

    /// Returns `true` if the object of `vertex` does not move.
    pub fn is_still(&self, vertex: &Vertex) -> bool {
        let scene = self.world.scene;
        match &vertex.kind {
            VertexKind::Lens(_) => !self.world.camera.is_moving(),
            VertexKind::Surface(surface) => !scene.moves(&surface.hit),
            VertexKind::Light(source) => !scene.lights()[source.id.0 as usize].is_moving(),
        }
    }

    /// Transmittance between `a` and the next vertex `b`, for edges along which no ray was traced.
    /// `before` is the previous vertex of `a` on the camera's side, if it is known.
    pub fn visibility(
        &self,
        before: Option<&Vertex>,
        a: &Vertex,
        b: &Vertex,
        time: f32,
        out: &mut impl RaySink,
    ) -> Transmittance {
        let w = a.direction_to(b);
        let origin = a.origin_towards_light(self.world, before, w);
        let ray = if b.is_infinite() {
            Ray::new(origin, w)
        } else {
            segment(origin, b.origin_towards_camera(-w))
        };
        let body = |vertex: &Vertex, w| vertex.surface().map_or(0, |surface| surface.body_towards(w));
        let body = match body(a, w) {
            0 => body(b, -w),
            body => body,
        };
        let ray = ray.when(time).within(body);
        match (&a.kind, b.surface()) {
            (VertexKind::Lens(_), Some(seen)) => self.world.transmittance_to_lens(&ray, &seen.hit, out),
            _ => self.world.transmittance(&ray, out),
        }
    }

    /// Stores the transmittance of the edge from the last vertex of `camera` to `next`, along which
    /// a ray was traced ([`PathSpace::transmittance`]).
    pub fn note_through(&self, camera: &mut [Vertex<'a>], next: &Vertex, time: f32, out: &mut impl RaySink) {
        if let [.., before, last] = camera {
            last.transmittance = self.transmittance(Some(before), last, next, time, out);
        } else if let [lens] = camera {
            lens.transmittance = self.transmittance(None, lens, next, time, out);
        }
    }

    /// Connects the camera subpath `camera` and the light subpath `light` by an edge. Vertices of
    /// `light` are in order from the light. `None` if no light passes. `fresh` is the range of
    /// vertices of the whole path that are new or moved. All other vertices keep their factors
    /// (`Factors`).
    pub fn join(
        &self,
        mut camera: Vec<Vertex<'a>>,
        light: impl DoubleEndedIterator<Item = Vertex<'a>>,
        fresh: Range<usize>,
        sample: CameraSample,
        out: &mut impl RaySink,
    ) -> Option<Path<'a>> {
        let second = camera.len();
        camera.extend(light.rev());
        if second == 1 {
            self.face(&mut camera, sample)?;
        }
        if second < camera.len() {
            camera[second - 1].transmittance = Transmittance::CLEAR;
            for end in [second - 1, second] {
                camera[end].is_delta = false;
                if !camera[end].is_smooth_somewhere() {
                    return None;
                }
            }
        }
        // Make the checks that need no rays first
        let mut path = self.path(camera, fresh, sample)?;
        if second < path.len() {
            // No light passes between two points of a plane, even if a bent normal gives a nonzero
            // BSDF.
            if path.vertices[second - 1].factors.geometry_term <= 0.0 {
                return None;
            }
            let before = second.checked_sub(2).map(|i| &path.vertices[i]);
            let (a, b) = (&path.vertices[second - 1], &path.vertices[second]);
            let transmittance = self.visibility(before, a, b, sample.time, out);
            path.color *= transmittance.tint;
            path.target = self.target(path.color, path.film);
            if transmittance.is_blocked() || path.target <= 0.0 {
                return None;
            }
            path.vertices[second - 1].transmittance = transmittance;
            path.vertices[second - 1].factors.geometry_term *= transmittance.pass as f64;
        }
        Some(path)
    }

    /// If the lens point depends on the point that it sees: moves the lens, which is the first
    /// vertex of `path`, to the lens point that sees the second vertex. `None` if no lens point
    /// sees this vertex.
    fn face(&self, path: &mut [Vertex<'a>], sample: CameraSample) -> Option<()> {
        let [lens, seen, ..] = path else { return None };
        if lens.is_movable_lens() {
            let camera = self.world.camera;
            let point = camera.lens_point(sample.lens, sample.time);
            lens.p = camera
                .lens_facing(point, seen.p, sample.time)
                .filter(|_| !seen.is_infinite())?
                .p;
        }
        Some(())
    }

    /// Target of a path with the contribution `color` at the film position `film`.
    fn target(&self, color: Spectrum, film: Vec2) -> f64 {
        (color.luminance() / self.importance.at(film)) as f64
    }

    /// Makes the path with the vertices `vertices`, and computes its contribution. `None` if the
    /// contribution is 0. An edge whose visibility is not tested yet has the transmittance 1 here.
    fn path(&self, mut vertices: Vec<Vertex<'a>>, fresh: Range<usize>, camera: CameraSample) -> Option<Path<'a>> {
        let time = camera.time;
        let n = vertices.len();
        let source = vertices.last()?.source()?;
        // The camera cannot see delta lights.
        if n < self.min_vertices.max(2) || n > self.max_vertices || (n == 2 && source.kind.is_delta()) {
            return None;
        }
        if !self.has_lamps && vertices[1..n - 1].iter().all(|vertex| vertex.is_delta) {
            return None;
        }
        let w = vertices[0].direction_to(&vertices[1]);
        let film = self.world.camera.importance(vertices[0].p, w, time)?.film;
        if !self.film.contains(film) {
            return None;
        }
        // The factors of a vertex depend on its neighbours, and on the vertex after the next
        // vertex.
        for i in fresh.start.saturating_sub(2)..n.min(fresh.end + 1) {
            let before = i.checked_sub(1).map(|i| &vertices[i]);
            let after = [1, 2].map(|steps| vertices.get(i + steps));
            vertices[i].factors = self.factors(&vertices[i], before, after, time)?;
        }
        let values = vertices
            .iter()
            .map(|vertex| vertex.factors.value * vertex.transmittance.tint);
        let color = values.fold(Spectrum::ONE, |color, value| color * value);
        let target = self.target(color, film);
        (target > 0.0 && target.is_finite()).then_some(Path {
            vertices,
            film,
            camera,
            color,
            target,
        })
    }
}

/// Returns `true` if `hit` is on the same triangle as the last vertex of the camera subpath
/// `camera`. Paths with such a hit are rejected, because they can be sampled from one end only.
pub(super) fn is_same_point(camera: &[Vertex], hit: &Option<Vertex>) -> bool {
    let ends = camera.last().zip(hit.as_ref());
    ends.is_some_and(|(last, hit)| hit.is_on_same_triangle(last))
}
