//! The end of a shared path: what is scattered there, for all pixels that see it.

use super::First;
use crate::accel::Accel;
use crate::bsdf::{BsdfDirection, BsdfLanes, BsdfSample, BsdfView, DirectionLanes, LANES};
use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin, segment};
use crate::integrator::opacity::Transmittance;
use crate::integrator::path::direct::LIGHTS_A_LOOK;
use crate::integrator::path::integrator::{PathIntegrator, PathStart, PathState, VertexNumbers};
use crate::integrator::path::strategy::{Directions, PrevVertex};
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::light::{LightId, LightSample};
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::Sampler;
use std::iter;

/// Minimum throughput that roulette assumes for a shared path.
const MIN_SHARED_BETA: f32 = 0.5;

/// The second vertex `y` of a path, at which the paths of a group meet.
///
/// Any of the paths might have found the point, and gone on from it in direction `w`. By the balance heuristic over all of them (Veach 1997, §9.2.2),
/// light `L` that arrives from `w` counts in the pixel whose first vertex is `xᵢ` as
///
/// ```text
/// f(xᵢ→y) |cos θᵢ| G(xᵢ, y) f_y(w → xᵢ) |cos θ_w| L / (S p̄(w)),
/// S = Σₖ pdfₖ(xₖ→y) G(xₖ, y),    p̄(w) = Σₖ pdfₖ(xₖ→y) G(xₖ, y) pdf_y(xₖ→w) / S,    G(x, y) = V(x, y) |cos θ_y| / |x − y|²
/// ```
///
/// which is never more than what the pixel's own path gives. `S` is the density of ends at `y`, and `p̄` that of directions there: the end scatters as the
/// mean of its viewers would. Where lights are sampled at `y`, their density stands in place of `p̄`, and the two are weighed against each other as at
/// any other vertex. What is emitted at `y`, and what arrives by a delta lobe, stays with the path that found it.
pub(super) struct End<'v> {
    /// The vertex as its owner, the path that found it, sees it.
    vertex: Vertex<'v>,
    /// Scattering events before the vertex.
    depth: u32,
    /// Throughput of the owner at the vertex, and its factor in roulette.
    beta: Spectrum,
    roulette_scale: Spectrum,
    /// The point, clear of its surface.
    p: Vec3,
    /// Unit geometric normal on the side that light leaves.
    n: Vec3,
    /// The point where the shading normal is another one: from where it would be bent, the end is another surface.
    curved: Option<SurfacePoint>,
}

/// A first vertex as one that could have found the end.
#[derive(Clone, Copy, Default)]
struct Candidate {
    /// Index of its path in the group.
    index: usize,
    /// Throughput from the end to the camera, per area at the end, if the end is seen.
    beta: Spectrum,
    /// Density per area with which it finds the end, if it sees it.
    pdf: f32,
    /// Origin of its ray to the end.
    origin: Vec3,
    /// Direction from the end to the first vertex, local frame of the end.
    wo: Vec3,
}

/// The first vertices that see the end: the first candidates of the workspace.
#[derive(Clone, Copy)]
struct Viewers {
    count: usize,
    /// Density of ends at this point, per area.
    pdf: f32,
    /// How the BSDF of the end is evaluated for them.
    bsdf: EndBsdf,
}

/// How the BSDF of an end is evaluated for its viewers.
#[derive(Clone, Copy)]
enum EndBsdf {
    /// It is matte: all see the same.
    Alike,
    /// In lanes.
    Lanes,
    /// By a view for each of them, where it has several lobes.
    Views,
}

/// Memory for the viewers of one end after the other.
pub(super) struct Workspace<'v> {
    candidates: [Candidate; SAMPLES_AT_ONCE],
    /// The BSDF of the end as each of the viewers sees it.
    lanes: BsdfLanes,
    views: [Option<BsdfView<'v>>; SAMPLES_AT_ONCE],
    /// BSDFs of the first vertices, and which of them are held there.
    firsts: BsdfLanes,
    is_held: [bool; SAMPLES_AT_ONCE],
}

// A lane for each sample
const _: () = assert!(LANES == SAMPLES_AT_ONCE);

impl<'v> Workspace<'v> {
    /// Memory that holds nothing.
    pub fn new() -> Self {
        Self {
            candidates: [Candidate::default(); SAMPLES_AT_ONCE],
            lanes: BsdfLanes::empty(),
            views: [None; SAMPLES_AT_ONCE],
            firsts: BsdfLanes::empty(),
            is_held: [false; SAMPLES_AT_ONCE],
        }
    }

    /// Takes in the first vertices of a group, which look in `directions`.
    #[inline(always)]
    pub fn begin(&mut self, firsts: &[Option<First>; SAMPLES_AT_ONCE], directions: Directions) {
        self.is_held = [false; SAMPLES_AT_ONCE];
        let has_lobes = |first: &&First| directions == Directions::Bsdf && Vertex::needs_view(first.vertex.bsdf);
        if firsts.iter().flatten().any(|first| has_lobes(&first)) {
            let firsts = firsts.iter().enumerate();
            let firsts = firsts.filter_map(|(i, first)| Some((i, first.as_ref().filter(has_lobes)?)));
            let firsts = firsts.map(|(i, first)| (i, first.vertex.bsdf, first.vertex.wo));
            self.is_held = self.firsts.hold_each(firsts);
        }
    }
}

/// Light from one direction, as the end scatters it.
struct Scattered {
    /// `f |cos θ|` for each viewer.
    f: ForViewers,
    /// Density of the direction, per solid angle: the mean over viewers.
    pdf: f32,
}

// Lives for the time of one call.
#[allow(clippy::large_enum_variant)]
enum ForViewers {
    /// Matte surfaces scatter the same light to all.
    Alike(Spectrum),
    Each([Spectrum; SAMPLES_AT_ONCE]),
}

/// Light that the end scatters to its viewers.
#[derive(Default)]
struct Shares<R> {
    /// To all of them.
    alike: R,
    /// To each of them besides.
    each: [R; SAMPLES_AT_ONCE],
}

impl<R: Gathered> Shares<R> {
    #[inline(always)]
    fn add(&mut self, light: R, scattered: &Scattered) {
        match &scattered.f {
            ForViewers::Alike(f) => self.alike += light * *f,
            ForViewers::Each(f) => self.each.iter_mut().zip(f).for_each(|(share, f)| *share += light * *f),
        }
    }

    #[inline(always)]
    fn of(&self, viewer: usize) -> R {
        let mut share = self.alike;
        share += self.each[viewer];
        share
    }
}

impl<'v> End<'v> {
    /// Whether what `vertex` scatters is shared: where all lobes are narrow the light of one viewer is none for the others.
    pub fn can_be(vertex: &Vertex) -> bool {
        !vertex.is_bent && vertex.bsdf.is_wide()
    }

    /// The end at `vertex`, which `path` has come to after `depth` scatterings.
    pub fn new(vertex: Vertex<'v>, depth: u32, path: &PathState) -> Self {
        let point = vertex.point;
        let n = point.ng * 1f32.copysign(vertex.wo.z);
        Self {
            p: offset_origin(&point, n),
            n,
            curved: point.is_curved().then_some(point),
            depth,
            beta: path.beta,
            roulette_scale: path.roulette_scale,
            vertex,
        }
    }

    /// Follows the path from here and gives each path whose first vertex sees the end its share of the light that is scattered here. `start` is that of
    /// the path `owner`, which has found the end; `firsts` are the first vertices, which `work` has taken in. The shares go to the sinks, or into
    /// `indirect` if there is one.
    #[inline(always)]
    pub fn light_all<A: Accel, S: Sampler, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        start: &PathStart<S>,
        (firsts, work): (&[Option<First>; SAMPLES_AT_ONCE], &mut Workspace<'v>),
        owner: usize,
        (out, mut indirect): (&mut [impl Sink<Radiance = R>], Option<&mut [R; SAMPLES_AT_ONCE]>),
    ) {
        let (world, strategy) = (&path.world, &path.strategy);
        let u = VertexNumbers::draw(start.sampler, self.depth, path.roulette);
        let mut shares = Shares::default();
        // Much light that a path looks for is not there: the viewers are found when there is some.
        let mut viewers = None;

        // Sample lights
        if let Some(u) = u.light.as_ref().filter(|_| strategy.samples_lights()) {
            let mut add = |(id, expected): (LightId, f32), u: Vec2, out: &mut [_]| {
                let Some((light, wi, radiance)) = self.sample_light(world, id, u, &mut out[owner]) else {
                    return;
                };
                let viewers = viewers.get_or_insert_with(|| self.viewers(path, firsts, work, owner, out));
                let scattered = self.scattered(viewers, work, strategy.directions, wi);
                let pdf = expected * light.pdf;
                let weight = strategy.light_weight(pdf, light.is_delta, scattered.pdf);
                shares.add(R::of_light(radiance * (weight / pdf), id, world.scene), &scattered);
            };
            let selection = world.scene.light_selection();
            match selection.all() {
                Some(ids) => {
                    for (index, &id) in (0..).zip(ids) {
                        if index % LIGHTS_A_LOOK == LIGHTS_A_LOOK - 1 && out[owner].is_cancelled() {
                            break;
                        }
                        add((id, 1.0), u.point_of(index), out);
                    }
                }
                None => {
                    let light = selection.sample(world.scene.lights(), &self.vertex.light_context(), u.choice);
                    light.into_iter().for_each(|light| add(light, u.point, out));
                }
            }
        }

        // Sample the BSDF, and follow the path
        let u_lobe = u.lobe(self.vertex.bsdf);
        let sample = strategy.directions.sample(&self.vertex, u_lobe, u.direction);
        if let Some((sample, factor, next)) = sample.and_then(|sample| self.play(path, &sample, start, &u)) {
            let next = next.traced(world, &mut out[owner]);
            let radiance = path.radiance(&next, &mut out[owner]);
            // What is emitted where the ray ends, and what arrives there
            let (emitted, scattered) = match radiance.has_tail {
                true => (radiance.head, radiance.tail),
                false => (radiance.tail, R::default()),
            };
            if sample.is_delta() {
                // No other path finds it.
                let light = radiance.sum() * (self.beta * sample.weight * factor);
                match &mut indirect {
                    None => out[owner].radiance(light),
                    Some(indirect) => indirect[owner] += light,
                }
            } else if !emitted.sum().is_black() || !scattered.sum().is_black() {
                let viewers = viewers.get_or_insert_with(|| self.viewers(path, firsts, work, owner, out));
                let for_viewers = self.scattered(viewers, work, strategy.directions, sample.wi);
                let mut light = scattered;
                if !emitted.sum().is_black() {
                    let prev = PrevVertex {
                        pdf: for_viewers.pdf,
                        ..PrevVertex::new(&self.vertex, &sample, 1)
                    };
                    light += next.emitted(world, strategy, &prev);
                }
                if for_viewers.pdf > 0.0 {
                    shares.add(light * (factor / for_viewers.pdf), &for_viewers);
                }
            }
        }

        // Shares of all viewers
        let Some(viewers) = viewers else { return };
        for (i, candidate) in work.candidates[..viewers.count].iter().enumerate() {
            let share = shares.of(i) * (candidate.beta * (1.0 / viewers.pdf));
            match &mut indirect {
                None => out[candidate.index].radiance(share),
                Some(indirect) => indirect[candidate.index] += share,
            }
        }
    }

    /// Samples the light `id`: the sample, its direction in the local frame, and the radiance that arrives; `None` if none does.
    #[inline(always)]
    fn sample_light<A: Accel>(
        &self,
        world: &World<A>,
        id: LightId,
        u: Vec2,
        out: &mut impl Sink,
    ) -> Option<(LightSample, Vec3, Spectrum)> {
        let vertex = &self.vertex;
        let (lights, textures) = (world.scene.lights(), world.scene.textures());
        let to = (&vertex.light_context(), vertex.point.time);
        let light = world
            .scene
            .light_selection()
            .sample_light(lights, id, to, u, textures)?;
        let wi = vertex.frame.to_local(light.wi);
        if light.radiance.is_black() || (wi.z * vertex.wo.z <= 0.0 && !vertex.bsdf.is_transmitting()) {
            return None;
        }
        let ray = light.shadow_ray(vertex.origin(wi)).when(vertex.point.time);
        let arrives = world.transmittance(&ray, out);
        (!arrives.is_blocked()).then(|| (light, wi, light.radiance * arrives.color()))
    }

    /// Plays roulette before the path goes on by `sample`: what makes up for the paths that end, and the start of the rest.
    #[inline(always)]
    fn play<'s, A: Accel, S: Sampler>(
        &self,
        path: &PathIntegrator<A>,
        sample: &BsdfSample,
        start: &PathStart<'s, S>,
        u: &VertexNumbers<S>,
    ) -> Option<(BsdfSample, f32, PathStart<'s, S>)> {
        let eta = sample.eta * sample.eta;
        let scale = match sample.is_delta() {
            true => self.beta * self.roulette_scale * eta,
            // Roulette goes by the pixel that follows the path, as long as that is not a dark one.
            false => self.roulette_scale * (self.beta.max_component().max(MIN_SHARED_BETA) * eta),
        };
        let factor = path.roulette.play(self.depth, sample.weight * scale, u.roulette)?;
        let next = PathStart {
            key: start.key,
            sampler: start.sampler,
            ray: self.vertex.ray_along(sample.wi),
            hit: None,
            tint: Spectrum::ONE,
            depth: self.depth + 1,
            tail_depth: self.depth + 1,
            roulette_scale: sample.weight * factor * scale,
        };
        Some((*sample, factor, next))
    }

    /// Finds the first vertices that see the end.
    #[inline(always)]
    fn viewers<A: Accel>(
        &self,
        path: &PathIntegrator<A>,
        firsts: &[Option<First>; SAMPLES_AT_ONCE],
        work: &mut Workspace<'v>,
        owner: usize,
        out: &mut [impl Sink],
    ) -> Viewers {
        let (world, directions) = (&path.world, path.strategy.directions);

        // Vertices that could have found it, the owner's first. That this one sees it is known.
        let count = self.candidates(firsts, work, owner, directions);
        let candidates = &mut work.candidates[..count];
        let known = usize::from(candidates.first().is_some_and(|first| first.index == owner));

        // Their visibility; where light passes surfaces, their transmittance
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        for (ray, candidate) in rays.iter_mut().zip(&*candidates) {
            *ray = segment(candidate.origin, self.p).when(self.vertex.point.time);
        }
        let mut seen = [Transmittance::CLEAR; SAMPLES_AT_ONCE];
        let passes = world.scene.lets_light_pass();
        let traced = if passes { 0..count } else { known..count };
        let mut occluded = [false; SAMPLES_AT_ONCE];
        world
            .accel
            .occluded_coherent(&rays[traced.clone()], &mut occluded[traced.clone()]);
        for i in traced {
            let out = &mut out[candidates[i].index];
            out.ray(RayKind::Shadow);
            seen[i] = match occluded[i] {
                false => Transmittance::CLEAR,
                true if passes => world.transmittance(&rays[i], out),
                true => Transmittance::BLOCKED,
            };
        }

        // Keep those that see it
        let mut viewers = Viewers {
            count: 0,
            pdf: 0.0,
            bsdf: EndBsdf::Alike,
        };
        for i in 0..count {
            if !seen[i].is_blocked() {
                let candidate = candidates[i];
                let pdf = seen[i].pass * candidate.pdf;
                candidates[viewers.count] = Candidate {
                    beta: candidate.beta * seen[i].color(),
                    pdf,
                    ..candidate
                };
                viewers.count += 1;
                viewers.pdf += pdf;
            }
        }
        if !self.vertex.bsdf.is_lambert() {
            viewers.bsdf = self.see(work, viewers.count, directions);
        }
        viewers
    }

    /// Makes the BSDF of the end, as each of `count` viewers sees it.
    #[inline(never)]
    fn see(&self, work: &mut Workspace<'v>, count: usize, directions: Directions) -> EndBsdf {
        let (bsdf, candidates) = (self.vertex.bsdf, &work.candidates[..count]);
        if directions == Directions::Bsdf {
            let mut wo = DirectionLanes::splat(self.vertex.wo);
            for (i, candidate) in candidates.iter().enumerate() {
                wo.set(i, candidate.wo);
            }
            if work.lanes.hold(bsdf, &wo) {
                return EndBsdf::Lanes;
            }
        }
        for (view, candidate) in work.views.iter_mut().zip(candidates) {
            *view = Vertex::needs_view(bsdf).then(|| BsdfView::new(bsdf, candidate.wo));
        }
        EndBsdf::Views
    }

    /// Collects the vertices of `firsts` that could have found the end, the one of `owner` first; gives their number.
    #[inline(always)]
    fn candidates(
        &self,
        firsts: &[Option<First>; SAMPLES_AT_ONCE],
        work: &mut Workspace<'v>,
        owner: usize,
        directions: Directions,
    ) -> usize {
        // From where the end may be found, and in which direction
        let mut found = [0; SAMPLES_AT_ONCE];
        let mut count = 0;
        let mut wi = DirectionLanes::splat(Vec3::Z);
        let others = (0..SAMPLES_AT_ONCE).filter(|i| *i != owner);
        for i in iter::once(owner).chain(others) {
            let Some(first) = &firsts[i] else { continue };
            let vertex = &first.vertex;
            let d = self.p - vertex.point.p;
            let squared = d.length_squared();
            let w = d * (1.0 / squared.sqrt());
            let g = -self.n.dot(w) / squared;
            // From behind, or where the two points are one
            if g.is_nan() || g <= 0.0 || self.curved.is_some_and(|point| point.bends_for(-w)) {
                continue;
            }
            let to_end = vertex.frame.to_local(w);
            wi.set(i, to_end);
            found[count] = i;
            work.candidates[count] = Candidate {
                index: i,
                beta: first.beta * (to_end.z.abs() * g),
                pdf: g,
                origin: to_end,
                wo: self.vertex.frame.to_local(-w),
            };
            count += 1;
        }

        // Their BSDFs
        let values = work.is_held.contains(&true).then(|| work.firsts.eval_pdf(&wi));
        let mut kept = 0;
        for k in 0..count {
            let candidate = work.candidates[k];
            let Some(first) = &firsts[candidate.index] else {
                continue;
            };
            let wi = candidate.origin;
            let (f, pdf) = match &values {
                Some(values) if work.is_held[candidate.index] => values.get(candidate.index),
                _ => directions.eval_pdf(&first.vertex, wi),
            };
            let pdf = pdf * candidate.pdf;
            if pdf > 0.0 && pdf.is_finite() {
                work.candidates[kept] = Candidate {
                    beta: candidate.beta * f,
                    pdf,
                    origin: first.vertex.origin(wi),
                    ..candidate
                };
                kept += 1;
            }
        }
        kept
    }

    /// Light from `wi` (local frame), as the end scatters it to `viewers`.
    #[inline(always)]
    fn scattered(&self, viewers: &Viewers, work: &Workspace, directions: Directions, wi: Vec3) -> Scattered {
        let cos = wi.z.abs();
        let candidates = &work.candidates[..viewers.count];
        let mut values = [Spectrum::ZERO; SAMPLES_AT_ONCE];
        let mut density = 0.0;
        let mut add = |i: usize, (f, pdf): (Spectrum, f32)| {
            values[i] = f * cos;
            density += candidates[i].pdf * pdf;
        };
        match viewers.bsdf {
            EndBsdf::Alike => {
                let (f, pdf) = directions.eval_pdf(&self.vertex, wi);
                return Scattered {
                    f: ForViewers::Alike(f * cos),
                    pdf,
                };
            }
            EndBsdf::Lanes => {
                let values = work.lanes.eval_pdf(&DirectionLanes::splat(wi));
                (0..viewers.count).for_each(|i| add(i, values.get(i)));
            }
            EndBsdf::Views => {
                let bsdf = self.vertex.bsdf;
                let terms =
                    (directions == Directions::Bsdf && Vertex::needs_view(bsdf)).then(|| BsdfDirection::new(bsdf, wi));
                for (i, candidate) in candidates.iter().enumerate() {
                    let value = match (&terms, &work.views[i]) {
                        (Some(terms), Some(view)) => view.eval_pdf_with(terms),
                        (_, view) => {
                            let vertex = Vertex {
                                wo: candidate.wo,
                                view: view.as_ref(),
                                ..self.vertex
                            };
                            directions.eval_pdf(&vertex, wi)
                        }
                    };
                    add(i, value);
                }
            }
        }
        Scattered {
            f: ForViewers::Each(values),
            pdf: density / viewers.pdf,
        }
    }
}
