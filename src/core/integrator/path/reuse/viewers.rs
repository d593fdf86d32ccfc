//! Viewers of an end: the first vertices of a group that see the end, and the BSDF values of the
//! end for each viewer.

use super::end::End;
use super::first_vertices::{Connections, FirstVertices};
use crate::accel::Accel;
use crate::bsdf::{BsdfDirection, BsdfLanes, BsdfView, ScatteringEvent};
use crate::color::Spectrum;
use crate::integrator::opacity::Transmittance;
use crate::integrator::path::strategy::Directions;
use crate::integrator::vertex::Vertex;
use crate::integrator::{RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::math::{Ray, Vec3, Vec3Lanes};

/// First vertices of a group, and memory for the viewers of its ends, one end at a time.
pub(super) struct Workspace<'f, 'v> {
    first_vertices: FirstVertices<'f, 'v>,
    /// Connections to the current end.
    connections: Connections,
    candidates: [Candidate; SAMPLES_AT_ONCE],
    /// BSDF of the end for each first vertex (`lanes`) or for each viewer (`views`). Each is
    /// allocated when an end first needs it.
    lanes: Option<Box<BsdfLanes>>,
    views: Option<Box<[Option<BsdfView<'v>>; SAMPLES_AT_ONCE]>>,
}

/// A first vertex that could have found the end. It is a viewer if the end is visible from it.
#[derive(Clone, Copy, Default)]
pub(super) struct Candidate {
    /// Index of the path of this vertex in the group.
    pub index: usize,
    /// Throughput from the end to the camera, per area at the end.
    pub beta: Spectrum,
    /// Density per area with which this vertex finds the end.
    pdf: f32,
    /// Unit direction from the first vertex to the end, world frame.
    w: Vec3,
}

impl Candidate {
    /// The first vertex of the path `owner` as the only candidate, for ends to which no vertex can
    /// connect. The throughput of the path already includes the division by the density, so the
    /// density is 1 here.
    fn alone(end: &End, owner: usize) -> Self {
        Self {
            index: owner,
            beta: end.beta,
            pdf: 1.0,
            w: -end.vertex.frame.to_world(end.vertex.wo),
        }
    }

    /// Unit direction from `end` to the first vertex, local frame of the end.
    #[inline(always)]
    fn wo(&self, end: &End) -> Vec3 {
        end.vertex.frame.to_local(-self.w)
    }
}

/// The viewers of an end: the first `count` candidates of the workspace.
#[derive(Clone, Copy)]
pub(super) struct Viewers {
    count: usize,
    /// Density per area with which the paths of the viewers find this end, summed over the viewers.
    pub pdf: f32,
    bsdf: EndBsdf,
}

/// Method to evaluate the BSDF of an end for its viewers.
#[derive(Clone, Copy)]
enum EndBsdf {
    /// The surface is matte: the BSDF has the same value for all viewers.
    Alike,
    /// The BSDF is evaluated for all viewers at once, in lanes.
    Lanes,
    /// The BSDF is evaluated for each viewer separately. If the BSDF has several lobes, each viewer
    /// has a `BsdfView`.
    Views,
}

/// Factors by which the end scatters light from one direction to its viewers.
pub(super) struct EndScattering {
    /// `f |cos θ|` for each viewer.
    pub f: ViewerValues,
    /// Density of this direction, per solid angle: the mean over viewers.
    pub pdf: f32,
}

// Values are used only within one call, so their size does not matter.
#[allow(clippy::large_enum_variant)]
pub(super) enum ViewerValues {
    /// One value for all viewers, if the surface is matte.
    Alike(Spectrum),
    Each([Spectrum; SAMPLES_AT_ONCE]),
}

impl<'f, 'v> Workspace<'f, 'v> {
    /// Workspace for a group with the first vertices `first_vertices`.
    #[inline(always)]
    pub fn new(first_vertices: FirstVertices<'f, 'v>) -> Self {
        Self {
            first_vertices,
            connections: Connections::NONE,
            candidates: [Candidate::default(); SAMPLES_AT_ONCE],
            lanes: None,
            views: None,
        }
    }

    /// Collects the candidates: the first vertices that could have found `end`, beginning with the
    /// vertex of `owner`. Returns the number of candidates, and `false`. If the owner's own vertex
    /// cannot connect to the end, the owner is the only candidate, and the result is 1 and `true`.
    #[inline(always)]
    fn find_candidates(&mut self, end: &End, owner: usize) -> (usize, bool) {
        self.first_vertices.connect_to(end, &mut self.connections);
        let Some(own) = self.candidate(end, owner) else {
            let alone = Candidate::alone(end, owner);
            self.connections.w.set(owner, alone.w);
            self.candidates[0] = alone;
            return (1, true);
        };
        self.candidates[0] = own;
        let mut count = 1;
        for index in (0..SAMPLES_AT_ONCE).filter(|index| *index != owner) {
            if let Some(candidate) = self.candidate(end, index) {
                self.candidates[count] = candidate;
                count += 1;
            }
        }
        (count, false)
    }

    /// The first vertex `index` as a candidate, if it can connect to `end`. Visibility is not
    /// tested.
    #[inline(always)]
    fn candidate(&self, end: &End, index: usize) -> Option<Candidate> {
        let (beta, pdf) = self.connections.get(index)?;
        let w = self.connections.w.get(index);
        let bends = end.curved.is_some_and(|point| point.bends_for(-w));
        (!bends).then_some(Candidate { index, beta, pdf, w })
    }

    /// Prepares the BSDF of `end` for the first `count` candidates. Returns the method to evaluate
    /// the BSDF.
    #[inline(never)]
    fn view(&mut self, end: &End<'v>, count: usize) -> EndBsdf {
        let bsdf = end.vertex.bsdf;
        if self.first_vertices.directions == Directions::Bsdf {
            let lanes = self.lanes.get_or_insert_with(|| Box::new(BsdfLanes::empty()));
            if lanes.pack(bsdf, &end.vertex.frame.to_local_lanes(&self.connections.w).reversed()) {
                return EndBsdf::Lanes;
            }
        }
        let views = self.views.get_or_insert_with(|| Box::new([None; SAMPLES_AT_ONCE]));
        for (view, candidate) in views.iter_mut().zip(&self.candidates[..count]) {
            *view = Vertex::needs_view(bsdf).then(|| BsdfView::new(bsdf, candidate.wo(end)));
        }
        EndBsdf::Views
    }
}

impl Viewers {
    /// Finds the viewers of `end`. The path `owner` found this end.
    #[inline(always)]
    pub fn find<'v, A: Accel>(
        end: &End<'v>,
        owner: usize,
        world: &World<A>,
        work: &mut Workspace<'_, 'v>,
        out: &mut [impl Sink],
    ) -> Self {
        // Find the vertices that could have found the end. The owner's vertex is first, and sees
        // the end.
        let (count, is_alone) = work.find_candidates(end, owner);
        let candidates = &mut work.candidates[..count];
        // The throughput of an owner without other candidates already includes the transmittance.
        let passes = !is_alone && world.scene.lets_light_pass();
        let absorbs = !is_alone && world.scene.has_absorption();
        let is_known = !passes && !absorbs;
        let traced = usize::from(is_known)..count;

        // Trace shadow rays for the other candidates; also for the owner if the visibility is a
        // transmittance
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        let mut occluded = [false; SAMPLES_AT_ONCE];
        for i in traced.clone() {
            rays[i] = work.first_vertices.ray_to(end, &work.connections, candidates[i].index);
            out[candidates[i].index].ray(RayKind::Shadow);
        }
        let accel = world.accel;
        accel.occluded_coherent(&rays[traced.clone()], &mut occluded[traced]);

        // Keep the candidates that see the end, with their transmittance
        let mut viewers = Self {
            count: 0,
            pdf: 0.0,
            bsdf: EndBsdf::Alike,
        };
        for i in 0..count {
            let mut candidate = candidates[i];
            let seen = match occluded[i] {
                true if passes => world.transmittance(&rays[i], &mut out[candidate.index]),
                true => Transmittance::BLOCKED,
                false if absorbs => Transmittance {
                    tint: world.scene.transmittance_along(&rays[i]),
                    ..Transmittance::CLEAR
                },
                false => Transmittance::CLEAR,
            };
            if seen.is_blocked() {
                continue;
            }
            candidate.beta *= seen.color();
            candidate.pdf *= seen.pass;
            viewers.pdf += candidate.pdf;
            candidates[viewers.count] = candidate;
            viewers.count += 1;
        }
        if !end.vertex.bsdf.is_lambert() {
            viewers.bsdf = work.view(end, viewers.count);
        }
        viewers
    }

    /// The viewers as candidates, which are stored in `work`.
    #[inline(always)]
    pub fn of<'w>(&self, work: &'w Workspace) -> &'w [Candidate] {
        &work.candidates[..self.count]
    }

    /// Scattering events of light that arrives at `end` from `wi` (local frame), for the viewer
    /// number `i`: at its first vertex and at the end. Also returns the number of scattering events
    /// before these events.
    #[inline(never)]
    pub fn events(&self, end: &End, work: &Workspace, i: usize, wi: Vec3) -> (u32, Vec<ScatteringEvent>) {
        let candidate = &work.candidates[i];
        let at_end = end.vertex.bsdf.event(candidate.wo(end), wi, false);
        let Some(first) = work.first_vertices.get(candidate.index) else {
            return (end.depth, vec![at_end]);
        };
        let at_first = first.vertex.event(first.vertex.frame.to_local(candidate.w), false);
        (first.depth, vec![at_first, at_end])
    }

    /// Factors by which `end` scatters light from `wi` (local frame) to the viewers.
    #[inline(always)]
    pub fn scattered(&self, end: &End, work: &Workspace, wi: Vec3) -> EndScattering {
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
                let (f, pdf) = work.first_vertices.directions.eval_pdf(&end.vertex, wi);
                let f = ViewerValues::Alike(f * cos);
                return EndScattering { f, pdf };
            }
            EndBsdf::Lanes => {
                if let Some(lanes) = &work.lanes {
                    let values = lanes.eval_pdf(&Vec3Lanes::splat(wi));
                    let viewers = candidates.iter().enumerate();
                    viewers.for_each(|(i, candidate)| add(i, values.get(candidate.index)));
                }
            }
            EndBsdf::Views => {
                let bsdf = end.vertex.bsdf;
                let terms = (work.first_vertices.directions == Directions::Bsdf && Vertex::needs_view(bsdf))
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
                            work.first_vertices.directions.eval_pdf(&vertex, wi)
                        }
                    };
                    add(i, value);
                }
            }
        }
        EndScattering {
            f: ViewerValues::Each(values),
            pdf: density / self.pdf,
        }
    }
}
