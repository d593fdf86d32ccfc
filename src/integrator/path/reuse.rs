//! Path reuse between pixels: up to sixteen pixels of a tile share their second vertices (Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing
//! by Re-Using Paths").
//!
//! Nearly all error of a path tracer in a room comes from indirect light (docs/benchmarks.md, "Shared paths"). The paths of a group of pixels end
//! their first scattering at as many points. Where such a point is matte, it sends the same light in all directions, and each pixel of the group
//! connects its own first vertex to it. A connection costs one shadow ray and saves the rest of a path. The shadow rays towards one point run nearly
//! alike and are traced as one packet.
//!
//! The balance heuristic over all paths that could have found the point makes the estimate unbiased. It also bounds the estimate by what the pixel's
//! own path would give; the type `End` has the formula. Three kinds of light stay with the path that found them: light that is emitted at the second
//! vertex, light that other than matte surfaces scatter there, and all light behind a mirror.
//!
//! - Groups have sixteen pixels: 32 have hardly less error for their time and have more error in common.
//! - The first vertex takes two light samples. Once indirect light is shared, direct light of the pixel itself is much of the remaining error. The
//!   samples are number 2s and 2s + 1 of a stratified sequence of their own, and the power heuristic counts both.
//! - All paths of a group have one time, that of the first pixel: a point at one time cannot light a vertex at another.
//! - Visibility is transmittance where surfaces have alpha or are thin glass, also for the path's owner. Its probability counts in densities, and its
//!   tint in the light.
//! - A shared point must be the same surface for all pixels that connect to it. A vertex whose shading normal was bent is not shared, and a pixel for
//!   which the normal would be bent does not connect (`geometry/mesh.rs`).
//! - Roulette ends no path before the second vertex. From there on it assumes a minimum throughput: that the surface of one pixel is dark says
//!   nothing of the other pixels, and the paths that survive would reach these as fireflies.
//!
//! Pixels of a group have errors in common; `render/groups.rs` chooses groups so that no pattern shows. The samples of one pixel stay independent, so
//! its variance is right. The mean over a tile has the error that it has without reuse.

use super::integrator::{CameraPacket, PathIntegrator, PathState, clamped};
use super::strategy::Directions;
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin, segment};
use crate::integrator::opacity::Transmittance;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Gathered, Integrator, RayKind, Roulette, SAMPLES_AT_ONCE, Sink, World};
use crate::material::BsdfSlot;
use crate::math::{Ray, Vec3};
use crate::sampler::{SampleKey, Sampler};
use std::array::from_fn;

/// Path tracing in which pixels of a tile share their paths: all of them look at all second vertices that are matte (Bekaert, Sbert and
/// Halton 2002, "Accelerating Path Tracing by Re-Using Paths").
#[derive(Debug)]
pub struct ReusingPathIntegrator<'a, A> {
    /// Follows each path. Its roulette ends no path before the second vertex.
    pub path: PathIntegrator<'a, A>,
}

/// Minimum throughput that roulette assumes for a shared path.
const MIN_SHARED_BETA: f32 = 0.5;

impl<A: Accel> Integrator for ReusingPathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        let world = &self.path.world;
        // That one pixel's surface is dark says nothing of those with which it shares its path.
        let path = PathIntegrator {
            roulette: Roulette {
                depth: self.path.roulette.depth.max(1),
            },
            ..self.path
        };
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            // Paths that are shared must be of one time.
            let packet = CameraPacket::trace(world, keys, sampler, true, out);

            // Follow each path by itself
            let slots: [BsdfSlot; SAMPLES_AT_ONCE] = from_fn(|_| BsdfSlot::new());
            let mut firsts = [const { None }; SAMPLES_AT_ONCE];
            let mut ends = [const { None }; SAMPLES_AT_ONCE];
            let mut tails = [Default::default(); SAMPLES_AT_ONCE];
            // Light after the first bounce, where it is limited
            let limit = path.clamp_indirect;
            let mut indirect = limit.map(|_| [Default::default(); SAMPLES_AT_ONCE]);
            for (i, out) in out.iter_mut().enumerate() {
                let mut shared = Shared {
                    first: &mut firsts[i],
                    end: &mut ends[i],
                };
                let radiance = path.li(&packet.start(i, keys), &slots[i], &mut shared, out);
                tails[i] = radiance.tail;
                match (&ends[i], &mut indirect) {
                    (Some(_), _) => out.radiance(radiance.head),
                    (None, Some(indirect)) if radiance.has_tail => {
                        out.radiance(radiance.head);
                        indirect[i] += radiance.tail;
                    }
                    (None, _) => out.radiance(radiance.sum()),
                }
            }

            // All first vertices look at the shared ends.
            for (owner, (end, tail)) in ends.iter().zip(tails).enumerate() {
                if let Some(end) = end {
                    let to = (&mut *out, indirect.as_mut());
                    let from = (&firsts, &packet.tints);
                    end.light_all(tail, world, path.strategy.directions, from, owner, to);
                }
            }

            // Limit what each sample has got of all ends
            for (out, light) in out.iter_mut().zip(indirect.into_iter().flatten()) {
                out.radiance(clamped(light, limit));
            }
        }
    }

    fn pixels_at_once(&self) -> usize {
        SAMPLES_AT_ONCE
    }
}

/// Hooks of path reuse into [`PathIntegrator::li`].
pub(crate) trait Reuse<'v> {
    /// Takes note of the first vertex, and gives it back.
    #[inline(always)]
    fn first_vertex(&mut self, vertex: Vertex<'v>) -> Vertex<'v> {
        vertex
    }

    /// Decides whether pixels share the light that is scattered at `vertex`, where `path` has come to the depth
    /// [`tail_depth`](super::integrator::PathStart::tail_depth); then the path goes on for all of them.
    #[inline(always)]
    fn tail_vertex(&mut self, _vertex: &Vertex, _path: &mut PathState) {}
}

/// No path reuse: each path serves its own pixel.
pub(crate) struct NoReuse;

impl Reuse<'_> for NoReuse {}

/// Records what a path shares with others.
struct Shared<'s, 'v> {
    first: &'s mut Option<Vertex<'v>>,
    end: &'s mut Option<End>,
}

impl<'v> Reuse<'v> for Shared<'_, 'v> {
    #[inline(always)]
    fn first_vertex(&mut self, vertex: Vertex<'v>) -> Vertex<'v> {
        *self.first = Some(vertex);
        vertex
    }

    #[inline(always)]
    fn tail_vertex(&mut self, vertex: &Vertex, path: &mut PathState) {
        if path.is_delta() || !End::can_be(vertex) {
            return;
        }
        *self.end = Some(End::new(vertex));
        // The light that comes back along the path counts in several pixels, in each by a factor of its own, which is not known yet. Roulette
        // goes by the pixel that follows the path, as long as that is not a dark one.
        path.roulette_scale *= path.beta.max_component().max(MIN_SHARED_BETA);
        path.beta = Spectrum::ONE;
    }
}

/// The second vertex of a path, on a matte surface: it sends the same light to the first vertices
/// of all paths of a group.
///
/// Any of the paths might have found the point. By the balance heuristic over all of them (Veach 1997, §9.2.2), the light
/// `L` of an end `y` counts in the pixel whose first vertex is `xᵢ` as
///
/// ```text
/// f(xᵢ→y) |cos θᵢ| G(xᵢ, y) L / Σₖ pdfₖ(xₖ→y) G(xₖ, y),    G(x, y) = V(x, y) |cos θ_y| / |x − y|²
/// ```
///
/// which is never more than `f |cos θ| / pdf · L` of the pixel's own path. What is emitted at `y`, and what is scattered there by
/// other than matte surfaces, stays with the path that found it.
struct End {
    /// The point, clear of its surface.
    p: Vec3,
    /// Time of the path, which all paths of a group have in common.
    time: f32,
    /// Unit geometric normal on the side that light leaves.
    n: Vec3,
    /// The point where the shading normal is another one: from where it would be bent, the end is another surface.
    curved: Option<SurfacePoint>,
}

/// A first vertex that could have found the end.
#[derive(Clone, Copy)]
struct Candidate {
    index: usize,
    /// `f |cos θ| |cos θ_y| / d²`: the light it takes from the end, if it sees it.
    f: Spectrum,
    /// Density per area with which it finds the end, if it sees it.
    pdf: f32,
    /// Origin of its ray to the end.
    origin: Vec3,
}

impl End {
    /// Whether `vertex` scatters to all directions alike.
    fn can_be(vertex: &Vertex) -> bool {
        vertex.bsdf.is_lambert() && !vertex.is_bent
    }

    /// The end at `vertex`.
    fn new(vertex: &Vertex) -> Self {
        let point = vertex.point;
        let n = point.ng * 1f32.copysign(vertex.wo.z);
        Self {
            p: offset_origin(&point, n),
            time: point.time,
            n,
            curved: point.is_curved().then_some(point),
        }
    }

    /// Gives each path whose first vertex sees the end its share of `radiance`, which is an estimate of what is scattered to its side; the
    /// path `owner` has found it. The shares go to the sinks, or into `indirect` if there is one.
    fn light_all<A: Accel, R: Gathered>(
        &self,
        radiance: R,
        world: &World<A>,
        directions: Directions,
        (firsts, tints): (&[Option<Vertex>; SAMPLES_AT_ONCE], &[Spectrum; SAMPLES_AT_ONCE]),
        owner: usize,
        (out, mut indirect): (&mut [impl Sink<Radiance = R>], Option<&mut [R; SAMPLES_AT_ONCE]>),
    ) {
        if radiance.sum().is_black() {
            return;
        }

        // Vertices that could have found it. That the owner's sees it is known.
        let Some(own) = firsts[owner]
            .as_ref()
            .and_then(|v| self.candidate(v, owner, directions))
        else {
            return;
        };
        let mut others = [own; SAMPLES_AT_ONCE];
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        let mut count = 0;
        for (i, first) in firsts.iter().enumerate().filter(|(i, _)| *i != owner) {
            let Some(first) = first else { continue };
            if let Some(candidate) = self.candidate(first, i, directions) {
                others[count] = candidate;
                rays[count] = segment(candidate.origin, self.p).when(self.time);
                count += 1;
            }
        }

        // Their visibility; where light passes surfaces, their transmittance
        let (others, rays) = (&others[..count], &rays[..count]);
        let mut seen = [Transmittance::CLEAR; SAMPLES_AT_ONCE];
        let mut own_seen = Transmittance::CLEAR;
        let mut occluded = [false; SAMPLES_AT_ONCE];
        world.accel.occluded_coherent(rays, &mut occluded[..count]);
        let passes = world.scene.lets_light_pass();
        for (((seen, ray), other), occluded) in seen.iter_mut().zip(rays).zip(others).zip(occluded) {
            out[other.index].ray(RayKind::Shadow);
            *seen = match occluded {
                false => Transmittance::CLEAR,
                true if passes => world.transmittance(ray, &mut out[other.index]),
                true => Transmittance::BLOCKED,
            };
        }
        if passes {
            let ray = segment(own.origin, self.p).when(self.time);
            own_seen = world.transmittance(&ray, &mut out[owner]);
        }

        // Their shares
        let others = || others.iter().zip(seen);
        let pdf = others().fold(own_seen.pass * own.pdf, |pdf, (other, seen)| {
            pdf + seen.pass * other.pdf
        });
        if pdf <= 0.0 {
            return;
        }
        let light = radiance * (1.0 / pdf);
        let mut add = |index: usize, share: R| match &mut indirect {
            None => out[index].radiance(share),
            Some(indirect) => indirect[index] += share,
        };
        add(owner, light * own.f * (own_seen.color() * tints[owner]));
        for (other, seen) in others().filter(|(_, seen)| !seen.is_blocked()) {
            add(other.index, light * other.f * (seen.color() * tints[other.index]));
        }
    }

    /// The path `index`, whose first vertex is `vertex`, as one that could have found the end.
    #[inline(always)]
    fn candidate(&self, vertex: &Vertex, index: usize, directions: Directions) -> Option<Candidate> {
        let d = self.p - vertex.point.p;
        let squared = d.length_squared();
        let wi = d * (1.0 / squared.sqrt());
        let g = -self.n.dot(wi) / squared;
        if self.curved.is_some_and(|point| point.bends_for(-wi)) {
            return None;
        }
        let wi = vertex.frame.to_local(wi);
        let (f, pdf) = directions.eval_pdf(vertex, wi);
        let pdf = pdf * g;
        // Also false where the two points are one
        (pdf > 0.0 && pdf.is_finite()).then(|| Candidate {
            index,
            f: f * (wi.z.abs() * g),
            pdf,
            origin: vertex.origin(wi),
        })
    }
}
