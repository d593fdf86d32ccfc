//! Viewers of an end: the first vertices of a group that see it, and the BSDF of the end as each of them sees it.

use super::First;
use super::end::End;
use crate::accel::Accel;
use crate::bsdf::{BsdfDirection, BsdfLanes, BsdfView, DirectionLanes, LANES, ScatteringEvent};
use crate::color::Spectrum;
use crate::film::LightPaths;
use crate::geometry::segment;
use crate::integrator::opacity::Transmittance;
use crate::integrator::path::strategy::Directions;
use crate::integrator::trail::seen_after;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::math::{Ray, Vec3};
use std::iter;

// A lane for each sample
const _: () = assert!(LANES == SAMPLES_AT_ONCE);

/// The first vertices of a group, and memory for the viewers of one end after the other.
pub(super) struct Workspace<'v> {
    pub firsts: [Option<First<'v>>; SAMPLES_AT_ONCE],
    directions: Directions,
    /// BSDFs of first vertices, and which of them the lanes hold. They are large, and matte scenes have none.
    first_bsdfs: Option<Box<BsdfLanes>>,
    is_held: [bool; SAMPLES_AT_ONCE],
    candidates: [Candidate; SAMPLES_AT_ONCE],
    /// The BSDF of the end as each of the viewers sees it, in lanes or by views, where an end has needed them.
    lanes: Option<Box<BsdfLanes>>,
    views: Option<Box<[Option<BsdfView<'v>>; SAMPLES_AT_ONCE]>>,
}

/// A first vertex as one that could have found the end.
#[derive(Clone, Copy, Default)]
pub(super) struct Candidate {
    /// Index of its path in the group.
    pub index: usize,
    /// Throughput from the end to the camera, per area at the end.
    pub beta: Spectrum,
    /// Density per area with which it finds the end.
    pdf: f32,
    /// Direction from the first vertex to the end, local frame of the first vertex.
    wi: Vec3,
    /// The same direction, world frame.
    w: Vec3,
}

impl Candidate {
    /// Direction from `end` to the first vertex, local frame of the end.
    #[inline(always)]
    fn wo(&self, end: &End) -> Vec3 {
        end.vertex.frame.to_local(-self.w)
    }

    /// `light` that the end sends to the first vertex, in the classes that it has for the camera.
    #[inline(always)]
    pub fn seen<R: Gathered>(&self, light: R, work: &Workspace, paths: Option<&LightPaths>) -> R {
        if !R::TELLS_PATHS {
            return light;
        }
        let Some(first) = &work.firsts[self.index] else {
            return light;
        };
        let light = light.scattered(|| first.vertex.event(self.wi, false), paths);
        seen_after(light, &first.events, paths)
    }
}

/// The first vertices that see the end: the first candidates of the workspace.
#[derive(Clone, Copy)]
pub(super) struct Viewers {
    count: usize,
    /// Density of ends at this point, per area.
    pub pdf: f32,
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

/// Light from one direction, as the end scatters it.
pub(super) struct Scattered {
    /// `f |cos θ|` for each viewer.
    pub f: ForViewers,
    /// Density of the direction, per solid angle: the mean over viewers.
    pub pdf: f32,
}

// Lives for the time of one call.
#[allow(clippy::large_enum_variant)]
pub(super) enum ForViewers {
    /// Matte surfaces scatter the same light to all.
    Alike(Spectrum),
    Each([Spectrum; SAMPLES_AT_ONCE]),
}

impl<'v> Workspace<'v> {
    /// For a group with these first vertices, whose paths draw directions by `directions`.
    #[inline(always)]
    pub fn new(firsts: [Option<First<'v>>; SAMPLES_AT_ONCE], directions: Directions) -> Self {
        let mut work = Self {
            firsts,
            directions,
            first_bsdfs: None,
            is_held: [false; SAMPLES_AT_ONCE],
            candidates: [Candidate::default(); SAMPLES_AT_ONCE],
            lanes: None,
            views: None,
        };
        let vertices = work.firsts.iter().enumerate();
        let vertices = vertices.filter_map(|(i, first)| Some((i, &first.as_ref()?.vertex)));
        let mut of_lobes = vertices
            .filter(|(_, vertex)| Vertex::needs_view(vertex.bsdf))
            .peekable();
        if directions == Directions::Bsdf && of_lobes.peek().is_some() {
            let bsdfs = of_lobes.map(|(i, vertex)| (i, vertex.bsdf, vertex.wo));
            work.is_held = empty_lanes(&mut work.first_bsdfs).hold_each(bsdfs);
        }
        work
    }

    /// Collects the first vertices that could have found `end`, the one of `owner` first; gives their number.
    #[inline(always)]
    fn find_candidates(&mut self, end: &End, owner: usize) -> usize {
        // The first vertices on the right side of the end, and their geometry terms
        let mut geometry = [0.0; SAMPLES_AT_ONCE];
        let mut count = 0;
        let others = (0..SAMPLES_AT_ONCE).filter(|i| *i != owner);
        for index in iter::once(owner).chain(others) {
            let Some(first) = &self.firsts[index] else { continue };
            let d = end.p - first.vertex.point.p;
            let squared = d.length_squared();
            let w = d * (1.0 / squared.sqrt());
            let g = -end.n.dot(w) / squared;
            // From behind, or where the two points are one
            if g.is_nan() || g <= 0.0 || end.curved.is_some_and(|point| point.bends_for(-w)) {
                continue;
            }
            geometry[count] = g;
            let candidate = &mut self.candidates[count];
            (candidate.index, candidate.w) = (index, w);
            candidate.wi = first.vertex.frame.to_local(w);
            count += 1;
        }

        // Values and densities of their BSDFs
        let held = self.first_bsdfs.as_ref().filter(|_| self.is_held.contains(&true));
        let values = held.map(|held| {
            let mut lanes = DirectionLanes::splat(Vec3::Z);
            let candidates = &self.candidates[..count];
            candidates
                .iter()
                .for_each(|candidate| lanes.set(candidate.index, candidate.wi));
            held.eval_pdf(&lanes)
        });
        let mut kept = 0;
        for (k, geometry) in geometry[..count].iter().enumerate() {
            let candidate = &self.candidates[k];
            let Some(first) = &self.firsts[candidate.index] else {
                continue;
            };
            let (f, pdf) = match &values {
                Some(values) if self.is_held[candidate.index] => values.get(candidate.index),
                _ => self.directions.eval_pdf(&first.vertex, candidate.wi),
            };
            let pdf = pdf * geometry;
            if pdf > 0.0 && pdf.is_finite() {
                let beta = first.beta * f * (candidate.wi.z.abs() * geometry);
                let candidate = move_to(&mut self.candidates, k, kept);
                (candidate.beta, candidate.pdf) = (beta, pdf);
                kept += 1;
            }
        }
        kept
    }

    /// Makes the BSDF of `end`, as each of the first `count` candidates sees it.
    #[inline(never)]
    fn view(&mut self, end: &End<'v>, count: usize) -> EndBsdf {
        let (bsdf, candidates) = (end.vertex.bsdf, &self.candidates[..count]);
        if self.directions == Directions::Bsdf {
            let mut wo = DirectionLanes::splat(end.vertex.wo);
            for (i, candidate) in candidates.iter().enumerate() {
                wo.set(i, candidate.wo(end));
            }
            if empty_lanes(&mut self.lanes).hold(bsdf, &wo) {
                return EndBsdf::Lanes;
            }
        }
        let views = self.views.get_or_insert_with(|| Box::new([None; SAMPLES_AT_ONCE]));
        for (view, candidate) in views.iter_mut().zip(candidates) {
            *view = Vertex::needs_view(bsdf).then(|| BsdfView::new(bsdf, candidate.wo(end)));
        }
        EndBsdf::Views
    }
}

/// The candidate at `from`, moved to `to` where that is another place.
#[inline(always)]
fn move_to(candidates: &mut [Candidate], from: usize, to: usize) -> &mut Candidate {
    if from != to {
        candidates[to] = candidates[from];
    }
    &mut candidates[to]
}

/// The lanes, made where there are none yet.
#[inline(always)]
fn empty_lanes(lanes: &mut Option<Box<BsdfLanes>>) -> &mut BsdfLanes {
    lanes.get_or_insert_with(|| Box::new(BsdfLanes::empty()))
}

impl Viewers {
    /// Finds the viewers of `end`, which the path `owner` has found.
    #[inline(always)]
    pub fn find<'v, A: Accel>(
        end: &End<'v>,
        owner: usize,
        world: &World<A>,
        work: &mut Workspace<'v>,
        out: &mut [impl Sink],
    ) -> Self {
        // Vertices that could have found it, the owner's first. That this one sees it is known.
        let count = work.find_candidates(end, owner);
        let candidates = &mut work.candidates[..count];
        let known = usize::from(candidates.first().is_some_and(|first| first.index == owner));

        // Their visibility; where light passes surfaces, their transmittance
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        for (ray, candidate) in rays.iter_mut().zip(&*candidates) {
            if let Some(first) = &work.firsts[candidate.index] {
                *ray = segment(first.vertex.origin(candidate.wi), end.p).when(end.vertex.point.time);
                ray.body = match first.vertex.body_towards(candidate.wi) {
                    0 => end.vertex.body_towards(end.vertex.wo),
                    body => body,
                };
            }
        }
        let mut seen = [Transmittance::CLEAR; SAMPLES_AT_ONCE];
        let passes = world.scene.lets_light_pass();
        let absorbs = world.scene.has_absorption();
        let traced = if passes || absorbs { 0..count } else { known..count };
        let mut occluded = [false; SAMPLES_AT_ONCE];
        world
            .accel
            .occluded_coherent(&rays[traced.clone()], &mut occluded[traced.clone()]);
        for i in traced {
            let out = &mut out[candidates[i].index];
            out.ray(RayKind::Shadow);
            seen[i] = match occluded[i] {
                false if absorbs => Transmittance {
                    tint: world.scene.transmittance_along(&rays[i]),
                    ..Transmittance::CLEAR
                },
                false => Transmittance::CLEAR,
                true if passes => world.transmittance(&rays[i], out),
                true => Transmittance::BLOCKED,
            };
        }

        // Keep those that see it
        let mut viewers = Self {
            count: 0,
            pdf: 0.0,
            bsdf: EndBsdf::Alike,
        };
        for (i, seen) in seen[..count].iter().enumerate().filter(|(_, seen)| !seen.is_blocked()) {
            let candidate = move_to(candidates, i, viewers.count);
            candidate.beta *= seen.color();
            candidate.pdf *= seen.pass;
            viewers.count += 1;
            viewers.pdf += candidate.pdf;
        }
        if !end.vertex.bsdf.is_lambert() {
            viewers.bsdf = work.view(end, viewers.count);
        }
        viewers
    }

    /// The viewers themselves.
    #[inline(always)]
    pub fn of<'w>(&self, work: &'w Workspace) -> &'w [Candidate] {
        &work.candidates[..self.count]
    }

    /// The event of light from `wi` (local frame) that `end` scatters to the viewer number `i`.
    pub fn event(&self, end: &End, work: &Workspace, i: usize, wi: Vec3) -> ScatteringEvent {
        end.vertex.bsdf.event(work.candidates[i].wo(end), wi, false)
    }

    /// Light from `wi` (local frame), as `end` scatters it to the viewers.
    #[inline(always)]
    pub fn scattered(&self, end: &End, work: &Workspace, wi: Vec3) -> Scattered {
        let cos = wi.z.abs();
        let candidates = self.of(work);
        let mut values = [Spectrum::ZERO; SAMPLES_AT_ONCE];
        let mut density = 0.0;
        let mut add = |i: usize, (f, pdf): (Spectrum, f32)| {
            values[i] = f * cos;
            density += candidates[i].pdf * pdf;
        };
        match self.bsdf {
            EndBsdf::Alike => {
                let (f, pdf) = work.directions.eval_pdf(&end.vertex, wi);
                let f = ForViewers::Alike(f * cos);
                return Scattered { f, pdf };
            }
            EndBsdf::Lanes => {
                if let Some(lanes) = &work.lanes {
                    let values = lanes.eval_pdf(&DirectionLanes::splat(wi));
                    (0..self.count).for_each(|i| add(i, values.get(i)));
                }
            }
            EndBsdf::Views => {
                let bsdf = end.vertex.bsdf;
                let terms = (work.directions == Directions::Bsdf && Vertex::needs_view(bsdf))
                    .then(|| BsdfDirection::new(bsdf, wi));
                let views = work.views.iter().flat_map(|views| views.iter());
                for (i, (candidate, view)) in candidates.iter().zip(views).enumerate() {
                    let value = match (&terms, view) {
                        (Some(terms), Some(view)) => view.eval_pdf_with(terms),
                        (_, view) => {
                            let vertex = Vertex {
                                wo: candidate.wo(end),
                                view: view.as_ref(),
                                ..end.vertex
                            };
                            work.directions.eval_pdf(&vertex, wi)
                        }
                    };
                    add(i, value);
                }
            }
        }
        Scattered {
            f: ForViewers::Each(values),
            pdf: density / self.pdf,
        }
    }
}
