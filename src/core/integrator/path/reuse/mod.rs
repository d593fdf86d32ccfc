//! Path reuse between pixels: up to sixteen pixels of a tile share their second vertices (Bekaert,
//! Sbert and Halton 2002, "Accelerating Path Tracing by Re-Using Paths"; Bauszat, Petitjean and
//! Eisemann 2017, "Gradient-Domain Path Reusing").
//!
//! In a room, nearly all error of a path tracer comes from indirect light
//! (docs/notebook/2026-11.md, "Shared paths"). Each pixel of a group traces one path, whose second
//! vertex is called its end. Each pixel connects its own first vertex to the ends of all paths, and
//! evaluates the BSDF of each end for the direction of the connection. A connection costs one
//! shadow ray and saves the rest of a path. The shadow rays to one end are nearly parallel and are
//! traced as one packet.
//!
//! The balance heuristic over all paths that could have found the end makes the estimate unbiased.
//! With these weights, an end never adds more light to a pixel than the pixel's own path to this
//! end would add. The type `End` has the formulas. Two kinds of light are added only to the pixel
//! whose path found them: light emitted at the second vertex, and light that arrives there by a
//! delta lobe.
//!
//! - The first vertex is the first surface that is not a mirror or smooth glass. Mirrors and glass
//!   before the first vertex count as part of the camera.
//! - Groups have sixteen pixels. Groups of 32 pixels have hardly less error in the same time, and a
//!   larger part of the error is common to all pixels.
//! - Random numbers of different pixels are independent up to the first vertices. Random numbers
//!   behind different ends may depend on each other. The light of a pixel is a sum over ends, so
//!   its mean does not change.
//! - The first vertex takes three light samples. With shared indirect light, the direct light of
//!   the pixel itself causes much of the remaining error. Sample s of the pixel uses the numbers 3s
//!   to 3s + 2 of a separate stratified sequence, and the power heuristic includes all three
//!   samples.
//! - All paths of a group have the time of the first pixel's path, because a point at one time
//!   cannot light a vertex at another time.
//! - If surfaces have alpha or are thin glass, the visibility of an end is a transmittance. It is
//!   computed also for the path that found the end, so that all pixels use the same estimate.
//! - A shared point must be the same surface for all pixels that connect to it. A vertex with a
//!   bent shading normal is not shared, and a pixel for which the normal would be bent does not
//!   connect (`geometry/mesh.rs`).
//! - Roulette does not end a path between its first and its second vertex. A path without an end
//!   (its second vertex cannot be shared) continues without roulette too. Behind an end, roulette
//!   assumes a minimum throughput. Without this minimum, a dark surface in one pixel would end most
//!   paths, and the few survivors would be fireflies in bright pixels.
//!
//! The errors of the pixels of a group are correlated; `render/groups.rs` chooses groups without a
//! visible pattern. The samples of one pixel stay independent, so the variance of the pixel is
//! estimated correctly. The mean over a tile has the same error as without reuse.

mod contributions;
mod end;
mod first_vertices;
mod viewers;

use super::camera_packet::CameraPacket;
use super::direct::trace;
use super::integrator::{PathIntegrator, PathNumbers, with_clamped};
use super::state::{PathState, RayResult};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::listeners::SummingSink;
use crate::integrator::{Integrator, Roulette, SAMPLES_AT_ONCE, Sink};
use crate::material::BsdfSlot;
use crate::sampler::{SampleKey, Sampler};
use end::End;
use first_vertices::{FirstVertex, FirstVertices};
use std::array::from_fn;
use viewers::Workspace;

/// Path tracing in which the pixels of a group share their paths (Bekaert, Sbert and Halton 2002,
/// "Accelerating Path Tracing by Re-Using Paths"). Each pixel connects to the second vertices of
/// all paths of the group, if these vertices scatter widely.
#[derive(Debug)]
pub struct ReusingPathIntegrator<'a, A> {
    /// Path tracer that traces the paths.
    pub path: PathIntegrator<'a, A>,
}

/// Number of vertices up to the end of a path: at most two mirrors or faces of glass, the first
/// vertex, and the end.
const MAX_VERTICES_TO_END: usize = 4;

impl<A: Accel> Integrator for ReusingPathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        match self.path.clamp_indirect {
            None => self.trace(keys, sampler, out),
            Some(limit) => with_clamped(limit, out, |out| self.trace(keys, sampler, out)),
        }
    }

    fn pixels_at_once(&self) -> usize {
        SAMPLES_AT_ONCE
    }
}

impl<A: Accel> ReusingPathIntegrator<'_, A> {
    /// Traces samples; each group of samples shares its paths.
    fn trace<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        // Roulette must not end a path at its first vertex, because other pixels use the end of the
        // path.
        let integrator = PathIntegrator {
            roulette: Roulette {
                depth: self.path.roulette.depth.max(1),
                ..self.path.roulette
            },
            ..self.path
        };
        // A first vertex connects to the ends of other pixels. The random numbers of these pixels
        // must be independent of the numbers of the first vertex.
        let mut of_first_vertices = sampler.clone();
        of_first_vertices.separate();
        let mut packet = CameraPacket::new();
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            // All paths of a group must have one time.
            packet.trace(&integrator.world, keys, &mut of_first_vertices, true, out);

            // Trace each path to its end, or completely if it has no end. Slots are on the heap,
            // because they are large, and an array would be copied when it is made.
            let slots: Vec<BsdfSlot> = (0..MAX_VERTICES_TO_END * SAMPLES_AT_ONCE)
                .map(|_| BsdfSlot::new())
                .collect();
            let mut first_vertices = from_fn(|_| None);
            let mut ends: [_; SAMPLES_AT_ONCE] = from_fn(|_| None);
            let slots = slots.chunks_exact(MAX_VERTICES_TO_END);
            for ((i, out), slots) in out.iter_mut().enumerate().zip(slots) {
                let (path, traced) = packet.path(i);
                let to_first = PathNumbers::start(&integrator.world, keys[i], &mut of_first_vertices);
                let numbers = PathNumbers::start(&integrator.world, keys[i], sampler);
                let found = (&mut first_vertices[i], &mut ends[i]);
                integrator.find_end(path, traced, [to_first, numbers], slots, found, out);
                if integrator.world.scene.ground().is_some() {
                    integrator.catch_shadow(path, traced, numbers, out);
                }
            }

            // Connect all first vertices to all ends.
            let mut work = Workspace::new(FirstVertices::new(&first_vertices, integrator.strategy.directions));
            for (owner, end) in ends.iter().enumerate() {
                if let Some(end) = end {
                    let numbers = PathNumbers::start(&integrator.world, keys[owner], sampler);
                    end.light_all(&integrator, numbers, &mut work, owner, out);
                }
            }
        }
    }
}

impl<'a, A: Accel> PathIntegrator<'a, A> {
    /// Traces `path` to its end, and adds the light that it finds before the end. `traced` is the
    /// result of the first ray query. Sets `first` and `end` if they are found; vertices are stored
    /// in `slots`. A path without an end is traced completely. `to_first` has the random numbers of
    /// the vertices before the first vertex.
    #[inline(always)]
    fn find_end<'v, S: Sampler>(
        &'v self,
        mut path: PathState,
        traced: RayResult,
        [to_first, numbers]: [PathNumbers<S>; 2],
        slots: &'v [BsdfSlot<'v>],
        (first, end): (&mut Option<FirstVertex<'v>>, &mut Option<End<'v>>),
        out: &mut impl Sink,
    ) {
        // If roulette ended a path between its first and second vertex, the path would end for all
        // pixels that could have found its end. Paths without an end are few; they also continue
        // without roulette.
        let roulette = |first: &Option<FirstVertex>| match first {
            Some(_) => Roulette::after(u32::MAX),
            None => self.roulette,
        };
        let mut traced = Some(traced);
        for (i, slot) in slots.iter().enumerate() {
            let Some(hit) = path.intersect(&self.world, traced.take(), out) else {
                return self.strategy.add_sky(&self.world, &path, out);
            };
            let vertex = path.vertex(&self.world, &hit, numbers.wavelength.as_ref(), slot, out);
            self.strategy.add_emission(&self.world, &path, &vertex, out);
            if Some(path.depth) == self.max_depth {
                return;
            }
            let is_second = first.as_ref().is_some_and(|first| path.depth == first.depth + 1);
            if is_second && !path.is_delta() && End::can_be(&vertex) {
                *end = Some(End::new(vertex, &path));
                return;
            }
            // All surfaces before the first vertex are mirrors or smooth glass. With a maximum
            // depth, only the vertex at depth 0 can be the first vertex, so that paths through an
            // end have the same number of events for all pixels.
            let is_late = i > 0 && (self.max_depth.is_some() || i + 1 >= slots.len());
            let is_first = first.is_none() && !vertex.bsdf.is_delta() && !is_late;
            if is_first {
                *first = Some(FirstVertex::new(vertex, &path));
            }

            let numbers = if first.is_some() { numbers } else { to_first };
            let u = numbers.vertex(path.depth, self.roulette);
            let direct = self.sample_light(&path, &vertex, &u, out);
            let next = self.scatter(&path, &vertex, roulette(first), &u, out);
            trace(direct, &self.world, &path, &vertex, out);
            let Some(next) = next else { return };
            path.advance(next);
            if first.is_some() && !is_first {
                break;
            }
        }
        let mut rest = SummingSink::new(path.depth, out);
        let integrator = PathIntegrator {
            roulette: roulette(first),
            ..*self
        };
        integrator.li(path, None, numbers, &mut rest);
        let sum = rest.sum;
        sum.pass_on(Spectrum::ONE, path.depth + 1, out);
    }
}
