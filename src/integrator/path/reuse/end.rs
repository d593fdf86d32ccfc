//! The end of a shared path: what is scattered there, for all pixels that see it.

use super::First;
use crate::accel::Accel;
use crate::bsdf::{BsdfDirection, BsdfSample, BsdfView};
use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin, segment};
use crate::integrator::path::direct::{LIGHTS_A_LOOK, LightNumbers};
use crate::integrator::path::integrator::{PathIntegrator, PathStart, PathState, VertexNumbers};
use crate::integrator::path::strategy::{Directions, PrevVertex};
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::light::LightId;
use crate::math::{Ray, Vec2, Vec3};
use crate::sampler::Sampler;

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
#[derive(Clone, Copy)]
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

/// The first vertices that see the end; the owner's is the first of them.
struct Viewers<'e> {
    end: &'e Vertex<'e>,
    candidates: [Candidate; SAMPLES_AT_ONCE],
    count: usize,
    /// Density of ends at this point, per area.
    pdf: f32,
    /// The BSDF of the end as each of them sees it, where it has several lobes.
    views: [Option<BsdfView<'e>>; SAMPLES_AT_ONCE],
    /// What each of them receives.
    directions: Directions,
}

/// Light from one direction, as the end scatters it.
struct Scattered {
    /// `f |cos θ|` for each viewer.
    f: [Spectrum; SAMPLES_AT_ONCE],
    /// Density of the direction, per solid angle: the mean over viewers.
    pdf: f32,
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
    /// the path `owner`, which has found the end. The shares go to the sinks, or into `indirect` if there is one.
    #[inline(always)]
    pub fn light_all<A: Accel, S: Sampler, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        start: &PathStart<S>,
        firsts: &[Option<First>; SAMPLES_AT_ONCE],
        owner: usize,
        (out, mut indirect): (&mut [impl Sink<Radiance = R>], Option<&mut [R; SAMPLES_AT_ONCE]>),
    ) {
        let Some(viewers) = self.viewers(path, firsts, owner, out) else {
            return;
        };
        let mut radiance = [R::default(); SAMPLES_AT_ONCE];
        let mut own = None;
        let out_of_owner = &mut out[owner];

        // Sample lights
        let u = VertexNumbers::draw(start.sampler, self.depth, path.roulette);
        if let Some(u) = &u.light {
            self.sample_lights(path, &viewers, u, &mut radiance, out_of_owner);
        }

        // Sample the BSDF, and follow the path
        let directions = path.strategy.directions;
        if let Some(sample) = directions.sample(&self.vertex, u.lobe(self.vertex.bsdf), u.direction) {
            let next = |weight: Spectrum, pdf, scale| {
                let factor = path.roulette.play(self.depth, weight * scale, u.roulette)?;
                Some((
                    factor,
                    PrevVertex {
                        pdf,
                        ..PrevVertex::new(&self.vertex, &sample, 1)
                    },
                    weight * factor * scale,
                ))
            };
            let eta = sample.eta * sample.eta;
            if sample.is_delta() {
                let weight = self.beta * sample.weight;
                if let Some((factor, prev, scale)) = next(weight, sample.pdf, self.roulette_scale * eta) {
                    own = Some(self.follow(path, start, &sample, prev, scale, out_of_owner) * (weight * factor));
                }
            } else {
                let Scattered { f, pdf } = viewers.scattered(sample.wi);
                // Roulette goes by the pixel that follows the path, as long as that is not a dark one.
                let scale = self.roulette_scale * (self.beta.max_component().max(MIN_SHARED_BETA) * eta);
                let weight = viewers.mean(&f) * (1.0 / pdf);
                if pdf > 0.0
                    && let Some((factor, prev, scale)) = next(weight, pdf, scale)
                {
                    let light = self.follow(path, start, &sample, prev, scale, out_of_owner) * (factor / pdf);
                    for (radiance, f) in radiance.iter_mut().zip(&f[..viewers.count]) {
                        *radiance += light * *f;
                    }
                }
            }
        }

        // Shares of all viewers
        let mut add = |index: usize, share: R| match &mut indirect {
            None => out[index].radiance(share),
            Some(indirect) => indirect[index] += share,
        };
        let scale = 1.0 / viewers.pdf;
        for (candidate, radiance) in viewers.candidates().iter().zip(radiance) {
            add(candidate.index, radiance * (candidate.beta * scale));
        }
        if let Some(own) = own {
            add(owner, own);
        }
    }

    /// The radiance that arrives from the direction of `sample`.
    #[inline(always)]
    fn follow<A: Accel, S: Sampler, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        start: &PathStart<S>,
        sample: &BsdfSample,
        prev: PrevVertex,
        roulette_scale: Spectrum,
        out: &mut impl Sink<Radiance = R>,
    ) -> R {
        let ray = self.vertex.ray_along(sample.wi);
        let start = PathStart {
            key: start.key,
            sampler: start.sampler,
            hit: path.world.intersect(&ray, RayKind::Bounce, out),
            ray,
            depth: self.depth + 1,
            tail_depth: 0,
            prev: Some(prev),
            roulette_scale,
        };
        path.radiance(&start, out).tail
    }

    /// Adds the light of one sampled light, or of all lights, to the `radiance` that each viewer sees.
    #[inline(always)]
    fn sample_lights<A: Accel, S: Sampler, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        viewers: &Viewers,
        u: &LightNumbers<S>,
        radiance: &mut [R; SAMPLES_AT_ONCE],
        out: &mut impl Sink<Radiance = R>,
    ) {
        if !path.strategy.samples_lights() {
            return;
        }
        let scene = path.world.scene;
        let selection = scene.light_selection();
        match selection.all() {
            Some(ids) => {
                for (index, &id) in (0..).zip(ids) {
                    if index % LIGHTS_A_LOOK == LIGHTS_A_LOOK - 1 && out.is_cancelled() {
                        break;
                    }
                    self.sample_light(path, viewers, (id, 1.0), u.point_of(index), radiance, out);
                }
            }
            None => {
                if let Some(light) = selection.sample(scene.lights(), &self.vertex.light_context(), u.choice) {
                    self.sample_light(path, viewers, light, u.point, radiance, out);
                }
            }
        }
    }

    /// Adds the light `id`, of which `expected` samples are expected here.
    #[inline(always)]
    fn sample_light<A: Accel, R: Gathered>(
        &self,
        path: &PathIntegrator<A>,
        viewers: &Viewers,
        (id, expected): (LightId, f32),
        u: Vec2,
        radiance: &mut [R; SAMPLES_AT_ONCE],
        out: &mut impl Sink<Radiance = R>,
    ) {
        let (scene, vertex) = (path.world.scene, &self.vertex);
        let light = &scene.lights()[id.0 as usize];
        let Some(light) = light.sample(vertex.point.p, vertex.point.time, u, scene.textures()) else {
            return;
        };
        let wi = vertex.frame.to_local(light.wi);
        let Scattered { f, pdf } = viewers.scattered(wi);
        if f[..viewers.count].iter().all(|f| f.is_black()) {
            return;
        }
        let light_pdf = expected * light.pdf;
        let weight = path.strategy.light_weight(light_pdf, light.is_delta, pdf);
        let ray = light.shadow_ray(vertex.origin(wi)).when(vertex.point.time);
        let arrives = path.world.transmittance(&ray, out);
        if arrives > 0.0 {
            let light = R::of_light(light.radiance * (arrives * weight / light_pdf), id, scene);
            for (radiance, f) in radiance.iter_mut().zip(&f[..viewers.count]) {
                *radiance += light * *f;
            }
        }
    }

    /// The first vertices that see the end; `None` where not even the owner's could have found it.
    #[inline(always)]
    fn viewers<'e, A: Accel>(
        &'e self,
        path: &PathIntegrator<A>,
        firsts: &[Option<First>; SAMPLES_AT_ONCE],
        owner: usize,
        out: &mut [impl Sink],
    ) -> Option<Viewers<'e>> {
        let world = &path.world;
        let directions = path.strategy.directions;
        let candidate = |i: usize| self.candidate(firsts[i].as_ref()?, i, directions);

        // Vertices that could have found it. That the owner's sees it is known.
        let own = candidate(owner)?;
        let mut candidates = [own; SAMPLES_AT_ONCE];
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        let time = self.vertex.point.time;
        let to_end = |candidate: &Candidate| segment(candidate.origin, self.p).when(time);
        let mut count = 1;
        for candidate in (0..SAMPLES_AT_ONCE).filter(|i| *i != owner).filter_map(candidate) {
            rays[count] = to_end(&candidate);
            candidates[count] = candidate;
            count += 1;
        }

        // Their visibility; where surfaces have alpha, their transmittance
        let mut seen = [1.0; SAMPLES_AT_ONCE];
        if world.scene.has_alpha() {
            rays[0] = to_end(&own);
            for ((seen, ray), candidate) in seen.iter_mut().zip(&rays).zip(&candidates[..count]) {
                *seen = world.transmittance(ray, &mut out[candidate.index]);
            }
        } else {
            self.trace(world, &rays[1..count], &mut seen[1..count]);
            for candidate in &candidates[1..count] {
                out[candidate.index].ray(RayKind::Shadow);
            }
        }

        // Those that see it
        let mut viewers = Viewers {
            end: &self.vertex,
            candidates,
            count: 0,
            pdf: 0.0,
            views: [None; SAMPLES_AT_ONCE],
            directions,
        };
        for (candidate, seen) in candidates[..count].iter().zip(seen).filter(|(_, seen)| *seen > 0.0) {
            let pdf = seen * candidate.pdf;
            viewers.candidates[viewers.count] = Candidate {
                beta: candidate.beta * seen,
                pdf,
                ..*candidate
            };
            viewers.count += 1;
            viewers.pdf += pdf;
        }
        let bsdf = self.vertex.bsdf;
        if Vertex::needs_view(bsdf) {
            for (view, candidate) in viewers.views.iter_mut().zip(&viewers.candidates[..viewers.count]) {
                *view = Some(BsdfView::new(bsdf, candidate.wo));
            }
        }
        (viewers.pdf > 0.0).then_some(viewers)
    }

    /// Traces `rays` as one packet: whether each gets through, 0 or 1.
    #[inline(always)]
    fn trace<A: Accel>(&self, world: &World<A>, rays: &[Ray], seen: &mut [f32]) {
        let mut occluded = [false; SAMPLES_AT_ONCE];
        world.accel.occluded_coherent(rays, &mut occluded[..rays.len()]);
        for (seen, occluded) in seen.iter_mut().zip(occluded) {
            *seen = f32::from(u8::from(!occluded));
        }
    }

    /// The path `index`, whose first vertex is `first`, as one that could have found the end.
    #[inline(always)]
    fn candidate(&self, first: &First, index: usize, directions: Directions) -> Option<Candidate> {
        let vertex = &first.vertex;
        let d = self.p - vertex.point.p;
        let squared = d.length_squared();
        let w = d * (1.0 / squared.sqrt());
        let g = -self.n.dot(w) / squared;
        // From behind, or where the two points are one
        if g.is_nan() || g <= 0.0 || self.curved.is_some_and(|point| point.bends_for(-w)) {
            return None;
        }
        let wi = vertex.frame.to_local(w);
        let (f, pdf) = directions.eval_pdf(vertex, wi);
        let pdf = pdf * g;
        // Also false where the two points are one
        (pdf > 0.0 && pdf.is_finite()).then(|| Candidate {
            index,
            beta: first.beta * f * (wi.z.abs() * g),
            pdf,
            origin: vertex.origin(wi),
            wo: self.vertex.frame.to_local(-w),
        })
    }
}

impl Viewers<'_> {
    #[inline(always)]
    fn candidates(&self) -> &[Candidate] {
        &self.candidates[..self.count]
    }

    /// The end, as the viewer `i` sees it.
    #[inline(always)]
    fn vertex(&self, i: usize) -> Vertex<'_> {
        Vertex {
            wo: self.candidates[i].wo,
            view: self.views[i].as_ref(),
            ..*self.end
        }
    }

    /// Light from `wi` (local frame), as the end scatters it.
    #[inline(always)]
    fn scattered(&self, wi: Vec3) -> Scattered {
        let cos = wi.z.abs();
        if self.end.bsdf.is_lambert() {
            let (f, pdf) = self.directions.eval_pdf(self.end, wi);
            return Scattered {
                f: [f * cos; SAMPLES_AT_ONCE],
                pdf,
            };
        }
        let mut scattered = Scattered {
            f: [Spectrum::ZERO; SAMPLES_AT_ONCE],
            pdf: 0.0,
        };
        let terms = (self.directions == Directions::Bsdf && self.views[0].is_some())
            .then(|| BsdfDirection::new(self.end.bsdf, wi));
        for (i, candidate) in self.candidates().iter().enumerate() {
            let (f, pdf) = match (&terms, &self.views[i]) {
                (Some(terms), Some(view)) => view.eval_pdf_with(terms),
                _ => self.directions.eval_pdf(&self.vertex(i), wi),
            };
            scattered.f[i] = f * cos;
            scattered.pdf += candidate.pdf * pdf;
        }
        scattered.pdf /= self.pdf;
        scattered
    }

    /// Mean over the viewers, each by the density with which it finds the end.
    #[inline(always)]
    fn mean(&self, f: &[Spectrum; SAMPLES_AT_ONCE]) -> Spectrum {
        let sum = self
            .candidates()
            .iter()
            .zip(f)
            .fold(Spectrum::ZERO, |sum, (candidate, f)| sum + *f * candidate.pdf);
        sum / self.pdf
    }
}
