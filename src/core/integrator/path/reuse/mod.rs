//! Path reuse between pixels: up to sixteen pixels of a tile share their second vertices (Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing
//! by Re-Using Paths"; Bauszat, Petitjean and Eisemann 2017, "Gradient-Domain Path Reusing").
//!
//! Nearly all error of a path tracer in a room comes from indirect light (docs/benchmarks.md, "Shared paths"). The paths of a group of pixels end
//! their first scattering at as many points. Each pixel of the group connects its own first vertex to each of these ends, and evaluates the BSDF there
//! for its own direction. A connection costs one shadow ray and saves the rest of a path. The shadow rays towards one end run nearly alike and are
//! traced as one packet.
//!
//! The balance heuristic over all paths that could have found the end makes the estimate unbiased. It also bounds the estimate by what the pixel's
//! own path would give; the type `End` has the formulas. Two kinds of light stay with the path that found them: light that is emitted at the second
//! vertex, and light that arrives there by a delta lobe.
//!
//! - The first vertex is the first surface that is no mirror or smooth glass: the chain of those before it counts as part of the camera.
//! - Groups have sixteen pixels: 32 have hardly less error for their time and have more error in common.
//! - The first vertex takes three light samples. Once indirect light is shared, direct light of the pixel itself is much of the remaining error. The
//!   samples are numbers 3s to 3s + 2 of a stratified sequence of their own, and the power heuristic counts all.
//! - All paths of a group have one time, that of the first pixel: a point at one time cannot light a vertex at another.
//! - Visibility is transmittance where surfaces have alpha or are thin glass, also for the path's owner.
//! - A shared point must be the same surface for all pixels that connect to it. A vertex whose shading normal was bent is not shared, and a pixel for
//!   which the normal would be bent does not connect (`geometry/mesh.rs`).
//! - Roulette ends no path between first and second vertex. From there on it assumes a minimum throughput: that the surface of one pixel is dark says
//!   nothing of the other pixels, and the paths that survive would reach these as fireflies.
//!
//! Pixels of a group have errors in common; `render/groups.rs` chooses groups so that no pattern shows. The samples of one pixel stay independent, so
//! its variance is right. The mean over a tile has the error that it has without reuse.

mod end;
mod firsts;
mod share;
mod viewers;

use super::hooks::Reuse;
use super::integrator::{CameraPacket, PathIntegrator, clamped};
use super::state::PathState;
use crate::accel::Accel;
use crate::bsdf::ScatteringEvent;
use crate::integrator::vertex::Vertex;
use crate::integrator::{Integrator, Roulette, SAMPLES_AT_ONCE, Sink};
use crate::material::BsdfSlot;
use crate::sampler::{SampleKey, Sampler};
use end::End;
use firsts::{First, Firsts};
use std::array::from_fn;
use viewers::Workspace;

/// Path tracing in which pixels of a tile share their paths: all of them look at all second vertices that scatter widely (Bekaert, Sbert and
/// Halton 2002, "Accelerating Path Tracing by Re-Using Paths").
#[derive(Debug)]
pub struct ReusingPathIntegrator<'a, A> {
    /// Follows each path.
    pub path: PathIntegrator<'a, A>,
}

/// Vertices of a path that are looked at: up to two mirrors or faces of glass, the first vertex, and the end.
const LOOKED_AT: usize = 4;

impl<A: Accel> Integrator for ReusingPathIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.samples(&[key], sampler, std::slice::from_mut(out));
    }

    fn samples<S: Sampler>(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [impl Sink]) {
        // Roulette that begins at once spares the first vertex: the end counts for other pixels too.
        let path = PathIntegrator {
            roulette: Roulette {
                depth: self.path.roulette.depth.max(1),
                ..self.path.roulette
            },
            ..self.path
        };
        for (keys, out) in keys.chunks(SAMPLES_AT_ONCE).zip(out.chunks_mut(SAMPLES_AT_ONCE)) {
            // Paths that are shared must be of one time.
            let packet = CameraPacket::trace(&path.world, keys, sampler, true, out);

            // Follow each path to its end, or as far as it goes if it has none
            // On the heap: slots are large, and an array of them would be copied when it is made.
            let slots: Vec<BsdfSlot> = (0..LOOKED_AT * SAMPLES_AT_ONCE).map(|_| BsdfSlot::new()).collect();
            let mut firsts = from_fn(|_| None);
            let mut ends: [_; SAMPLES_AT_ONCE] = from_fn(|_| None);
            // Light after the first bounce, where it is limited
            let limit = path.clamp_indirect;
            let mut indirect = limit.map(|_| [Default::default(); SAMPLES_AT_ONCE]);
            let slots = slots.chunks_exact(LOOKED_AT);
            for ((i, out), slots) in out.iter_mut().enumerate().zip(slots) {
                let mut shared = Shared {
                    first: &mut firsts[i],
                    end: &mut ends[i],
                    max_depth: path.max_depth,
                };
                let start = packet.start(i, keys);
                let radiance = path.li(&start, slots, &mut shared, out);
                match &mut indirect {
                    Some(indirect) if radiance.has_tail => {
                        out.radiance(radiance.head);
                        indirect[i] += radiance.tail;
                    }
                    _ => out.radiance(radiance.sum()),
                }
                path.catch_shadow(&start, out);
            }

            // All first vertices look at all ends.
            let mut work = Workspace::new(Firsts::new(&firsts, path.strategy.directions));
            for (owner, end) in ends.iter().enumerate() {
                if let Some(end) = end {
                    let to = (&mut *out, indirect.as_mut());
                    end.light_all(&path, &packet.start(owner, keys), &mut work, owner, to);
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

/// Records what a path shares with others.
struct Shared<'s, 'v> {
    first: &'s mut Option<First<'v>>,
    end: &'s mut Option<End<'v>>,
    /// Maximum number of scattering events. Where there is one, first vertices lie at depth 0, so that paths through an end have the same number for
    /// all pixels.
    max_depth: Option<u32>,
}

impl<'v> Reuse<'v> for Shared<'_, 'v> {
    const ENDS_PATHS: bool = true;

    #[inline(always)]
    fn meet(
        &mut self,
        depth: u32,
        vertex: &Vertex<'v>,
        path: &PathState,
        events: impl FnOnce() -> Vec<ScatteringEvent>,
    ) {
        match self.first {
            None => {
                let is_late = depth > 0 && (self.max_depth.is_some() || depth as usize + 1 >= LOOKED_AT);
                // All surfaces before it are mirrors or smooth glass.
                if !vertex.bsdf.is_delta() && !is_late {
                    *self.first = Some(First {
                        vertex: *vertex,
                        beta: path.beta,
                        depth,
                        events: events(),
                    });
                }
            }
            Some(first) => {
                let is_second = depth == first.depth + 1 && !path.is_delta();
                if is_second && self.max_depth.is_none_or(|max| depth < max) && End::can_be(vertex) {
                    *self.end = Some(End::new(*vertex, depth, path, events()));
                }
            }
        }
    }

    #[inline(always)]
    fn ends_path(&self) -> bool {
        self.end.is_some()
    }

    /// A path that ends between first and second vertex would end for all pixels that could have found its end.
    #[inline(always)]
    fn allows_roulette(&self) -> bool {
        self.end.is_some() || self.first.is_none()
    }
}
