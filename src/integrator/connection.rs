use super::photon_grid::Radii;
use super::subpath::{EMISSION_BLOCK, LightEnd, MOST_VERTICES, PathVertex, Place, Segment, Walk, block};
use super::{Heuristic, RaySink, Roulette, World};
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::color::Spectrum;
use crate::geometry::segment;
use crate::light::{LightId, LightSample, Receiver};
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, Sampler};
use crate::scene::Scene;

/// All ways to make a path of a subpath from the camera and one from a light.
///
/// A strategy (s, t) takes s vertices from the light's subpath and t from the camera's (Veach 1997, §10.2). With s = 1 the point on the light is
/// drawn anew for the vertex that it lights; with t = 1 the point on the lens is.
#[derive(Debug)]
pub(super) struct Connector<'w, 'a, A> {
    pub world: &'w World<'a, A>,
    pub heuristic: Heuristic,
    pub roulette: Roulette,
    /// Scattering events at most.
    pub max_depth: Option<u32>,
    /// Where subpaths from lights are also merged with those from the camera, with how many and how.
    pub merging: Option<Merging<'w>>,
}

/// Merging of subpaths that end near each other (Georgiev, Křivánek, Davidovič and Slusallek 2012, "Light Transport Simulation with Vertex Connection
/// and Merging").
#[derive(Clone, Copy, Debug)]
pub(super) struct Merging<'w> {
    /// Subpaths from lights with which each one from the camera may be merged.
    pub paths: f32,
    /// How far away their ends may be.
    pub radii: &'w Radii<'w>,
}

impl Merging<'_> {
    /// How often a point is taken for `p`, over the density per area with which it is drawn: `π r² n` (their eq. 7).
    fn acceptance(&self, p: Vec3, time: f32) -> f64 {
        let radius = self.radii.at(p, time) as f64;
        std::f64::consts::PI * radius * radius * self.paths as f64
    }
}

/// A subpath from the camera and one from a light.
#[derive(Debug, Default)]
pub(super) struct Subpaths<'a> {
    pub camera: Vec<PathVertex<'a>>,
    pub light: Vec<PathVertex<'a>>,
    /// How the one from the camera leaves the scene, if it does.
    pub escape: Option<Segment>,
    /// When.
    pub time: f32,
}

/// What a strategy finds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contribution {
    /// Vertices from the light, and from the camera.
    pub strategy: (usize, usize),
    /// Estimate of the light that comes by paths of this length, in the sample's own pixel or where `film` says.
    pub radiance: Spectrum,
    /// Share of it that the strategy has among all that could have made the path.
    pub weight: f32,
    /// Where it falls, if not on the sample's own pixel.
    pub film: Option<Vec2>,
    /// From which light it comes.
    pub light: LightId,
}

impl<'a, A: Accel> Connector<'_, 'a, A> {
    /// Paths of a frame: each pixel has one from the camera, and sends one from a light into the scene.
    fn paths(&self) -> f32 {
        let size = self.world.camera.resolution();
        size.x as f32 * size.y as f32
    }

    /// Vertices of a path at most.
    pub fn most_vertices(&self) -> usize {
        self.max_depth
            .map_or(MOST_VERTICES, |depth| MOST_VERTICES.min(depth as usize + 2))
    }

    /// Follows both subpaths, the camera's along `ray`.
    pub fn subpaths(&self, ray: Ray, sampler: &impl Sampler, out: &mut impl RaySink) -> Subpaths<'a> {
        let (camera, escape) = self.camera_path(ray, sampler, out);
        Subpaths {
            light: self.light_path(ray.time, sampler, out),
            camera,
            escape,
            time: ray.time,
        }
    }

    /// The subpath that starts along `ray`, and how it leaves the scene, if it does.
    pub fn camera_path(
        &self,
        ray: Ray,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
    ) -> (Vec<PathVertex<'a>>, Option<Segment>) {
        let lens = PathVertex::lens(self.world, ray.origin, ray.time);
        let first = Segment {
            ray,
            beta: Spectrum::ONE,
            pdf: self.pdf_of_camera(ray.origin, ray.direction, ray.time),
        };
        let mut path = vec![lens];
        let walk = self.walk(TransportMode::Radiance, self.most_vertices());
        let escape = walk.follow(&mut path, first, sampler, out);
        (path, escape)
    }

    /// The subpath of a light at `time`; empty where nothing emits.
    pub fn light_path(&self, time: f32, sampler: &impl Sampler, out: &mut impl RaySink) -> Vec<PathVertex<'a>> {
        let scene = self.world.scene;
        let number = |what| Dimension::bounce(EMISSION_BLOCK, what);
        let choice = sampler.get_2d(number(Bounce::Decisions)).x;
        let Some((id, pmf)) = scene.emission_selection().sample(choice) else {
            return Vec::new();
        };
        let u = [Bounce::LightPoint, Bounce::Direction].map(|what| sampler.get_2d(number(what)));
        let light = &scene.lights()[id.0 as usize];
        let Some(emission) = light.sample_emission(time, u[0], u[1], scene.textures(), &scene.ball()) else {
            return Vec::new();
        };
        let first = Segment {
            ray: Ray::new(emission.origin, emission.w).when(time),
            beta: emission.weight() * (1.0 / pmf),
            pdf: match emission.is_infinite {
                true => emission.pdf_position,
                false => emission.pdf_direction,
            },
        };
        let mut path = vec![PathVertex::light(id, pmf, &emission)];
        let walk = self.walk(TransportMode::Importance, self.most_vertices() - 1);
        walk.follow(&mut path, first, sampler, out);
        path
    }

    fn walk(&self, mode: TransportMode, most: usize) -> Walk<'_, 'a, A> {
        Walk {
            world: self.world,
            mode,
            roulette: self.roulette,
            most,
        }
    }

    /// What all strategies make of `paths`.
    pub fn all(
        &self,
        paths: &mut Subpaths<'a>,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        mut found: impl FnMut(Contribution),
    ) {
        let most = self.most_vertices();
        for t in 1..=paths.camera.len() {
            for s in 0..=most - t {
                // s = 1 needs no subpath.
                if s + t >= 2 && s <= paths.light.len().max(1) {
                    self.strategy((s, t), paths, sampler, out, &mut found);
                }
            }
        }
        self.escape(paths, &mut found);
    }

    /// What the strategy (s, t) makes of `paths`, which have as many vertices; with s = 0 of what is met within the scene.
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
            (0, t) => self.meet((&camera[..t], paths.time), found),
            (1, 1) => self.look_at_light(paths.time, sampler, out, found),
            (1, t) => self.sample_light((&camera[..t], paths.time), sampler, out, found),
            (s, 1) => self.look_at((&light[..s], paths.time), sampler, out, found),
            (s, t) => self.connect((&camera[..t], &light[..s], paths.time), out, found),
        }
    }

    /// s = 0: the camera's subpath meets a light.
    fn meet(&self, (camera, time): (&[PathVertex<'a>], f32), found: &mut impl FnMut(Contribution)) {
        let [.., before, last] = camera else { return };
        let Some(surface) = last.surface() else { return };
        let from = self.receiver(before);
        let Some(light) = surface.emitted(self.world.scene, &from) else {
            return;
        };
        let met = Met {
            light: light.id,
            direct: before.density_at(light.pdf, last),
        };
        found(Contribution {
            strategy: (0, camera.len()),
            radiance: last.beta * light.radiance,
            weight: self.weight(camera, &[], Some(met), time),
            film: None,
            light: light.id,
        });
    }

    /// The same where it leaves the scene, and meets what is infinitely far away.
    pub fn escape(&self, paths: &mut Subpaths<'a>, found: &mut impl FnMut(Contribution)) {
        let (camera, time) = (&mut paths.camera, paths.time);
        let (Some(Segment { ray, beta, pdf }), Some(last)) = (paths.escape, camera.last()) else {
            return;
        };
        let from = self.receiver(last);
        for light in self.world.scene.escaped(from, ray.direction) {
            if light.radiance.is_black() {
                continue;
            }
            camera.push(PathVertex::far_away(light.id, ray.direction, pdf));
            let met = Met {
                light: light.id,
                direct: light.pdf,
            };
            found(Contribution {
                strategy: (0, camera.len()),
                radiance: beta * light.radiance,
                weight: self.weight(camera, &[], Some(met), time),
                film: None,
                light: light.id,
            });
            camera.pop();
        }
    }

    /// s = 1: a light is sampled for the last vertex of the camera's subpath.
    fn sample_light(
        &self,
        (camera, time): (&[PathVertex<'a>], f32),
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let Some(last) = camera.last() else { return };
        let Some(surface) = last.surface().filter(|surface| !surface.bsdf.is_delta()) else {
            return;
        };
        let number = |what| Dimension::bounce(block(TransportMode::Radiance, camera.len() as u32 - 2), what);
        let numbers = LightNumbers {
            choice: number(Bounce::Decisions),
            point: number(Bounce::LightPoint),
        };
        self.lights(&self.receiver(last), time, &numbers, sampler, |sampled| {
            let wi = sampled.sample.wi;
            let f = surface.scattered(self.world.scene, surface.back, wi);
            if f.is_black() {
                return;
            }
            let ray = sampled.sample.shadow_ray(surface.origin(wi)).when(time);
            let transmittance = self.world.transmittance(&ray, out);
            if transmittance > 0.0 {
                found(Contribution {
                    strategy: (1, camera.len()),
                    radiance: last.beta * f * sampled.radiance() * transmittance,
                    weight: self.weight(camera, &[sampled.vertex()], None, time),
                    film: None,
                    light: sampled.id,
                });
            }
        });
    }

    /// s = t = 1: a light is sampled for the lens.
    fn look_at_light(
        &self,
        time: f32,
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let lens = self.lens_vertex(1, time, sampler);
        let number = |what| Dimension::bounce(EMISSION_BLOCK, what).nth(0);
        let numbers = LightNumbers {
            choice: number(Bounce::Decisions),
            point: number(Bounce::LightPoint),
        };
        self.lights(&Receiver::any_side(lens.p), time, &numbers, sampler, |sampled| {
            let wi = sampled.sample.wi;
            // What has no size is not seen.
            let seen = self.seen(&lens, wi, time).filter(|_| !sampled.sample.is_delta);
            let Some((film, importance)) = seen else { return };
            let ray = sampled.sample.shadow_ray(lens.p).when(time);
            let transmittance = self.world.transmittance(&ray, out);
            if transmittance > 0.0 {
                let camera = std::slice::from_ref(&lens);
                found(Contribution {
                    strategy: (1, 1),
                    radiance: sampled.radiance() * (importance * transmittance),
                    weight: self.weight(camera, &[sampled.vertex()], None, time),
                    film: Some(film),
                    light: sampled.id,
                });
            }
        });
    }

    /// t = 1: the last vertex of the light's subpath is joined to the lens.
    fn look_at(
        &self,
        (light, time): (&[PathVertex<'a>], f32),
        sampler: &impl Sampler,
        out: &mut impl RaySink,
        found: &mut impl FnMut(Contribution),
    ) {
        let Some((last, surface)) = light.last().and_then(|v| Some((v, v.surface()?))) else {
            return;
        };
        let lens = self.lens_vertex(light.len(), time, sampler);
        let w = last.direction_to(&lens);
        let Some((film, importance)) = self.seen(&lens, -w, time) else {
            return;
        };
        let geometry = w.dot(last.ng).abs() / last.p.distance_squared(lens.p);
        let f = surface.carried(self.world.scene, w, surface.back);
        let radiance = last.beta * f * (geometry * importance);
        if radiance.is_black() {
            return;
        }
        let ray = segment(surface.origin(w), lens.p).when(time);
        let transmittance = self.world.transmittance(&ray, out);
        if transmittance > 0.0 {
            found(Contribution {
                strategy: (light.len(), 1),
                radiance: radiance * transmittance,
                weight: self.weight(std::slice::from_ref(&lens), light, None, time),
                film: Some(film),
                light: light[0].light_id(),
            });
        }
    }

    /// Both subpaths are joined by their last vertices.
    fn connect(
        &self,
        (camera, light, time): (&[PathVertex<'a>], &[PathVertex<'a>], f32),
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
        let f = at_a.scattered(scene, at_a.back, w) * at_b.carried(scene, -w, at_b.back);
        let radiance = a.beta * f * b.beta * geometry;
        if radiance.is_black() {
            return;
        }
        let ray = segment(at_a.origin(w), at_b.origin(-w)).when(time);
        let transmittance = self.world.transmittance(&ray, out);
        if transmittance > 0.0 {
            found(Contribution {
                strategy: (light.len(), camera.len()),
                radiance: radiance * transmittance,
                weight: self.weight(camera, light, None, time),
                film: None,
                light: light[0].light_id(),
            });
        }
    }

    /// A point of the lens for a light's subpath of `s` vertices.
    fn lens_vertex(&self, s: usize, time: f32, sampler: &impl Sampler) -> PathVertex<'a> {
        let u = match self.world.camera.has_lens() {
            true => sampler.get_2d(Dimension::LENS.nth(s as u32)),
            false => Vec2::ZERO,
        };
        PathVertex::lens(self.world, self.world.camera.lens_point(u, time), time)
    }

    /// Where light that comes to the lens against the direction `w` falls, and what it counts there over the density of the point: for one of all the
    /// paths of a frame.
    fn seen(&self, lens: &PathVertex, w: Vec3, time: f32) -> Option<(Vec2, f32)> {
        let importance = self.world.camera.importance(lens.p, w, time)?;
        let we = importance.we * w.dot(lens.ng) / lens.forward;
        Some((importance.film, we / self.paths()))
    }

    /// Samples of lights, of one or of all, for `receiver`.
    fn lights(
        &self,
        receiver: &Receiver,
        time: f32,
        numbers: &LightNumbers,
        sampler: &impl Sampler,
        mut found: impl FnMut(Sampled<'a>),
    ) {
        let scene = self.world.scene;
        let selection = scene.light_selection();
        let mut of = |id: LightId, pmf: f32, point: Dimension| {
            let light = &scene.lights()[id.0 as usize];
            let sample = light.sample(receiver.p, time, sampler.get_2d(point), scene.textures());
            if let Some(sample) = sample {
                found(Sampled {
                    scene,
                    id,
                    pmf,
                    sample,
                    time,
                });
            }
        };
        if let Some(ids) = selection.all() {
            for (&id, index) in ids.iter().zip(1..) {
                of(id, 1.0, numbers.point.nth(index));
            }
        } else if let Some((id, pmf)) = selection.sample(scene.lights(), receiver, sampler.get_2d(numbers.choice).x) {
            of(id, pmf, numbers.point);
        }
    }

    /// The vertex as a point that light falls on, seen from the vertex before it on a path from the camera.
    fn receiver(&self, vertex: &PathVertex) -> Receiver {
        match vertex.surface() {
            Some(surface) => surface.receiver(self.world.scene, surface.back),
            None => Receiver::any_side(vertex.p),
        }
    }

    /// Density per solid angle with which a path of the frame leaves the lens at `p` in direction `w`.
    fn pdf_of_camera(&self, p: Vec3, w: Vec3, time: f32) -> f32 {
        let importance = self.world.camera.importance(p, w, time);
        importance.map_or(0.0, |importance| importance.pdf / self.paths())
    }

    /// Density with which a path from the camera that comes from `before` goes on from `at` to `to`.
    fn pdf_from_camera(&self, before: Option<&PathVertex>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.place, before) {
            (Place::Surface(surface), Some(before)) => {
                surface.pdf_from_camera(self.world.scene, at.direction_to(before), w)
            }
            _ => self.pdf_of_camera(at.p, w, time),
        };
        at.density_at(pdf, to)
    }

    /// The same of a path from a light.
    fn pdf_from_light(&self, before: Option<&PathVertex>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.place, before) {
            (Place::Surface(surface), Some(before)) => surface.pdf_from_light(at.direction_to(before), w),
            (Place::Light(id, end), _) => {
                let [position, direction] = self.emission_pdfs(*id, at.ng, w, time);
                if end.is_infinite { position } else { direction }
            }
            _ => 0.0,
        };
        at.density_at(pdf, to)
    }

    fn emission_pdfs(&self, id: LightId, ng: Vec3, w: Vec3, time: f32) -> [f32; 2] {
        let scene = self.world.scene;
        scene.lights()[id.0 as usize].emission_pdfs(ng, w, time, &scene.ball())
    }

    /// Share of the strategy that joins these subpaths among all that could have made their path (Veach 1997, §10.2.1).
    fn weight(&self, camera: &[PathVertex], light: &[PathVertex], met: Option<Met>, time: f32) -> f32 {
        self.weight_of(camera, light, met, time, false)
    }

    /// Share of merging the last vertex of `camera` with the one that follows on `light` among all strategies that could have made the path.
    pub fn merging_weight(&self, camera: &[PathVertex], light: &[PathVertex], time: f32) -> f32 {
        self.weight_of(camera, light, None, time, true)
    }

    fn weight_of(
        &self,
        camera: &[PathVertex],
        light: &[PathVertex],
        met: Option<Met>,
        time: f32,
        is_merged: bool,
    ) -> f32 {
        let (s, t) = (light.len(), camera.len());
        let n = s + t;
        let mut path = Densities::new(n);
        for (i, vertex) in camera.iter().enumerate() {
            path.set(i, vertex, [vertex.forward, vertex.reverse]);
        }
        for (i, vertex) in light.iter().enumerate() {
            path.set(n - 1 - i, vertex, [vertex.reverse, vertex.forward]);
        }
        let at = |i: usize| if i < t { &camera[i] } else { &light[n - 1 - i] };

        // What the vertices at the joint would be drawn with from the other side
        let before = |i: usize| (i > 0).then(|| at(i - 1));
        match met {
            None => {
                path.is_delta[t - 1] = false;
                // What is merged may have come there by a delta lobe.
                path.is_delta[t] &= is_merged;
                path.from_camera[t] = self.pdf_from_camera(before(t - 1), at(t - 1), at(t), time);
                if s > 1 {
                    path.from_camera[t + 1] = self.pdf_from_camera(Some(at(t - 1)), at(t), at(t + 1), time);
                }
                let after = (s > 1).then(|| at(t + 1));
                path.from_light[t - 1] = self.pdf_from_light(after, at(t), at(t - 1), time);
                if t > 1 {
                    path.from_light[t - 2] = self.pdf_from_light(Some(at(t)), at(t - 1), at(t - 2), time);
                }
            }
            Some(Met { light, .. }) => {
                let (end, next) = (at(n - 1), at(n - 2));
                let w = end.direction_to(next);
                let [position, direction] = self.emission_pdfs(light, end.ng, w, time);
                let [own, onwards] = match end.is_infinite() {
                    true => [direction, position],
                    false => [position, direction],
                };
                path.is_delta[n - 1] = false;
                path.from_light[n - 1] = self.world.scene.emission_selection().pmf(light) * own;
                path.from_light[n - 2] = end.density_at(onwards, next);
            }
        }

        // Where a light would be sampled for the vertex before it
        let (direct, is_delta_light) = match met {
            Some(met) => (met.direct, false),
            None => self.direct(at(n - 1), at(n - 2), (n > 2).then(|| at(n - 3)), time),
        };
        if let Some(merging) = &self.merging {
            // To be compared with densities of merging, those by delta lobes need the geometry that is common to all other strategies.
            for i in (1..n - 1).filter(|&i| path.is_delta[i]) {
                path.from_camera[i + 1] = at(i).density_at(1.0, at(i + 1));
                path.from_light[i - 1] = at(i).density_at(1.0, at(i - 1));
            }
            for i in 1..n - 1 {
                let can_merge = !path.is_delta[i] && at(i).surface().is_some_and(|surface| !surface.bsdf.is_delta());
                if can_merge {
                    path.acceptance[i] = merging.acceptance(at(i).p, time);
                }
            }
        }
        path.weight(t, direct, is_delta_light, is_merged, self.heuristic)
    }

    /// Density with which the end `light` of a path is sampled for the vertex `at`, seen from `before`; and whether there is no other way to it but
    /// from itself.
    fn direct(&self, light: &PathVertex, at: &PathVertex, before: Option<&PathVertex>, time: f32) -> (f32, bool) {
        let scene = self.world.scene;
        let Place::Light(id, end) = &light.place else {
            return (0.0, false);
        };
        let receiver = match (at.surface(), before) {
            (Some(surface), Some(before)) => surface.receiver(scene, at.direction_to(before)),
            _ => Receiver::any_side(at.p),
        };
        let pmf = scene.light_selection().pmf(scene.lights(), &receiver, *id);
        if end.is_delta {
            return (pmf, true);
        }
        let pdf = scene.lights()[id.0 as usize].pdf(receiver.p, light.p, at.direction_to(light), time);
        (pmf * at.density_at(pdf, light), false)
    }
}

/// The light that a path meets, and the density with which it would have been sampled.
#[derive(Clone, Copy, Debug)]
struct Met {
    light: LightId,
    direct: f32,
}

/// Dimensions of the numbers that sample a light.
struct LightNumbers {
    choice: Dimension,
    point: Dimension,
}

/// A sample of the light `id`, which was chosen with probability `pmf`.
struct Sampled<'a> {
    scene: &'a Scene,
    id: LightId,
    pmf: f32,
    sample: LightSample,
    time: f32,
}

impl<'a> Sampled<'a> {
    /// What arrives, over the density.
    fn radiance(&self) -> Spectrum {
        self.sample.radiance * (1.0 / (self.pmf * self.sample.pdf))
    }

    /// The light's end of the path, as a path that starts there would have made it.
    fn vertex(&self) -> PathVertex<'a> {
        let light = &self.scene.lights()[self.id.0 as usize];
        let (sample, is_infinite) = (&self.sample, self.sample.target.is_none());
        let ng = match is_infinite {
            true => -sample.wi,
            false => light.normal(self.time).unwrap_or(Vec3::ZERO),
        };
        let [position, direction] = light.emission_pdfs(ng, -sample.wi, self.time, &self.scene.ball());
        let end = LightEnd {
            is_infinite,
            is_delta: sample.is_delta,
        };
        PathVertex {
            place: Place::Light(self.id, end),
            p: sample.target.unwrap_or(Vec3::ZERO),
            ng,
            beta: Spectrum::ZERO,
            forward: self.scene.emission_selection().pmf(self.id) * if is_infinite { direction } else { position },
            reverse: 0.0,
            is_delta: false,
        }
    }
}

/// With which densities each vertex of a path, from the camera on, is drawn from either side.
struct Densities {
    n: usize,
    from_camera: [f32; MOST_VERTICES],
    from_light: [f32; MOST_VERTICES],
    /// Where the path goes on by a delta lobe, to which nothing can be joined.
    is_delta: [bool; MOST_VERTICES],
    /// [`Merging::acceptance`] at the vertex; 0 where nothing is merged.
    acceptance: [f64; MOST_VERTICES],
}

impl Densities {
    fn new(n: usize) -> Self {
        Self {
            n,
            from_camera: [0.0; MOST_VERTICES],
            from_light: [0.0; MOST_VERTICES],
            is_delta: [false; MOST_VERTICES],
            acceptance: [0.0; MOST_VERTICES],
        }
    }

    fn set(&mut self, i: usize, vertex: &PathVertex, [camera, light]: [f32; 2]) {
        self.from_camera[i] = camera;
        self.from_light[i] = light;
        self.is_delta[i] = vertex.is_delta;
    }

    /// Weight of the strategy with `t` vertices from the camera, the last of which is merged or connected; `direct` is the density of the light's end
    /// where it is sampled for its neighbour.
    fn weight(&self, t: usize, direct: f32, is_delta_light: bool, is_merged: bool, heuristic: Heuristic) -> f32 {
        let n = self.n;
        // Densities of strategies over that of this one, from which they differ vertex by vertex
        let ratio = |i: usize| self.from_light[i] as f64 / self.from_camera[i] as f64;
        let sampled = direct as f64 / self.from_light[n - 1] as f64;
        // Of merging the vertex `t − 1`, over that of a connection there
        let merged = |t: usize| self.acceptance[t - 1] * self.from_light[t - 1] as f64;
        let own = match is_merged {
            true => merged(t),
            false if t == n - 1 => sampled,
            false => 1.0,
        };
        let counts = |t: usize| match t {
            t if t == n => !is_delta_light,
            _ => !self.is_delta[t - 1] && !self.is_delta[t],
        };
        let mut sum = 1.0;
        let mut add = |other: usize, product: f64| {
            if self.acceptance[other - 1] > 0.0 && !(is_merged && other == t) {
                sum += heuristic.raised(product * merged(other) / own);
            }
            if counts(other) && (is_merged || other != t) {
                let product = product * if other == n - 1 { sampled } else { 1.0 } / own;
                sum += heuristic.raised(product);
            }
        };
        add(t, 1.0);
        let mut product = 1.0;
        for other in (1..t).rev() {
            product *= ratio(other);
            add(other, product);
        }
        let mut product = 1.0;
        for other in t + 1..=n {
            product /= ratio(other - 1);
            add(other, product);
        }
        // A strategy that is no match for others at all counts nothing.
        let weight = (1.0 / sum) as f32;
        if weight.is_finite() { weight } else { 0.0 }
    }
}
