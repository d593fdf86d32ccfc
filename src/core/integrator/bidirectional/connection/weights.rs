//! MIS weights over all strategies that can sample a path.
//!
//! A weight compares the density of a strategy with the densities of all other strategies.
//! Neighbouring strategies differ by one vertex, so each ratio of densities follows from the ratio
//! before it (Veach 1997, §10.2). Of all vertices, only two on either side of a connection have
//! densities that depend on the connection. So each vertex of a subpath stores the sum over the
//! strategies that connect nearer to the start of the subpath (`PathVertex::others`). A weight is
//! then computed in constant time (van Antwerpen 2011, "Recursive MIS Computation for Streaming
//! BDPT on the GPU"; Georgiev 2012, "Implementing Vertex Connection and Merging").
//!
//! The direction of a delta lobe has density 1 if it is sampled from the start of the subpath. If
//! it is sampled from the other end of the path, its density is the Jacobian of one direction with
//! respect to the other ([`super::subpath`] computes it). Strategies that would connect at a delta
//! lobe are not counted.
//!
//! Vertex merging (`photon/vcm.rs`) adds one term for each vertex that the path does not leave by a
//! delta lobe. The term is the density of both subpaths that end at this vertex, times `π r² n` for
//! n light paths (Georgiev et al. 2012).

use super::Connector;
use crate::accel::Accel;
use crate::integrator::bidirectional::subpath::{PathVertex, VertexKind, emission_pdfs};
use crate::light::LightId;
use crate::light_sampling::LightSampleContext;
use crate::math::Vec3;

/// A light that a camera path hits. `direct` is the density with which light sampling would find
/// the same point.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightHit {
    pub light: LightId,
    pub direct: f32,
}

impl<A: Accel> Connector<'_, '_, A> {
    /// Density at `to` with which a camera path continues from `at` to `to`. `wo` is the direction
    /// from `at` to the previous vertex.
    fn pdf_from_camera(&self, wo: Option<Vec3>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.kind, wo) {
            (VertexKind::Surface(surface), Some(wo)) => surface.pdf_from_camera(self.world.scene, wo, w),
            _ => self.pdf_of_camera(at.p, w, time),
        };
        at.density_at(pdf, to)
    }

    /// Density at `to` with which a light path continues from `at` to `to`. `before` is the vertex
    /// before `at`.
    fn pdf_from_light(&self, before: Option<&PathVertex>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.kind, before) {
            (VertexKind::Surface(surface), Some(before)) => surface.pdf_from_light(at.direction_to(before), w),
            (VertexKind::Light(end), _) => {
                let [_, onwards] = emission_pdfs(self.world.scene, end.id, end.is_infinite, at.ng, w, time);
                onwards
            }
            _ => 0.0,
        };
        at.density_at(pdf, to)
    }

    /// MIS weight of the strategy that connects the subpaths `camera` and `light` (Veach 1997,
    /// §10.2.1). `light_hit` is set if the camera subpath hits a light.
    pub(super) fn weight(
        &self,
        camera: &[PathVertex],
        light: &[PathVertex],
        light_hit: Option<LightHit>,
        time: f32,
    ) -> f32 {
        self.weight_of(camera, light, light_hit, time, false)
    }

    /// MIS weight of the strategy that merges the last vertex of `camera` with a vertex of a light
    /// path. `light` has the vertices of the light path before the merged vertex.
    pub fn merging_weight(&self, camera: &[PathVertex], light: &[PathVertex], time: f32) -> f32 {
        self.weight_of(camera, light, None, time, true)
    }

    fn weight_of(
        &self,
        camera: &[PathVertex],
        light: &[PathVertex],
        light_hit: Option<LightHit>,
        time: f32,
        is_merged: bool,
    ) -> f32 {
        let (s, t) = (light.len(), camera.len());
        let Some((end, before)) = camera.split_last() else {
            return 0.0;
        };
        let densities = match light_hit {
            Some(light_hit) => self.densities_at_light_hit(end, before.last(), light_hit, time),
            None => self.densities(camera, light, is_merged, time),
        };
        let is_delta_light = light.first().is_some_and(PathVertex::is_delta_light);

        // ANCHOR: sum
        // Sum the strategies that connect nearer to the camera, relative to the connection here
        let mut on_camera_side = 0.0;
        if let Some((previous, _)) = before.split_last() {
            let mut others = match s {
                // For s = 0 the next strategy is a light sample, not a connection
                0 => one_if(!previous.is_delta) * self.raised(densities.direct, densities.end),
                _ => one_if(!previous.is_delta && !previous.is_one_way),
            };
            others += self.merges(previous, densities.previous, time);
            if t > 2 {
                others += self.beyond(densities.previous, previous.forward, previous.others);
            }
            on_camera_side = self.beyond(densities.end, end.forward, others);
        }

        // Sum the strategies that connect nearer to the light
        let mut on_light_side = 0.0;
        if let Some((other, rest)) = light.split_last() {
            let others = match rest.last() {
                None => one_if(!is_delta_light),
                Some(next) => {
                    let can_connect = !(next.is_delta || is_merged && other.is_delta);
                    let mut others = one_if(can_connect);
                    if s == 2 {
                        others *= self.raised(densities.direct, next.forward);
                    }
                    let merges = if is_merged && other.is_delta {
                        0.0
                    } else {
                        self.merges_at_end(other, other.forward, time)
                    };
                    others + merges + self.beyond(densities.next, next.forward, next.others)
                }
            };
            on_light_side = self.beyond(densities.other, other.forward, others);
        }

        // Compute the terms of the strategies that connect or merge here
        let connection = match light.last() {
            Some(other) if is_merged && other.is_delta => 0.0,
            Some(other) if s == 1 => self.raised(densities.direct, other.forward),
            _ => 1.0,
        };
        let merging = if s > 0 {
            self.merges_at_end(end, densities.end, time)
        } else {
            0.0
        };
        let (own, other) = if is_merged {
            (merging, connection)
        } else {
            (connection, merging)
        };
        let weight = (1.0 / (1.0 + (other + on_camera_side + on_light_side) / own)) as f32;
        // ANCHOR_END: sum
        // The weight is 0 if this strategy has density 0 for the path.
        if weight.is_finite() { weight } else { 0.0 }
    }

    /// Densities of the vertices next to the connection between `camera` and `light`.
    fn densities(
        &self,
        camera: &[PathVertex],
        light: &[PathVertex],
        is_merged: bool,
        time: f32,
    ) -> ConnectionDensities {
        let (Some((end, before)), Some((other, rest))) = (camera.split_last(), light.split_last()) else {
            return ConnectionDensities::default();
        };
        let back = end.surface().map(|surface| surface.back);
        let w = end.direction_to(other);
        // If the direction is one-way, no light path arrives at `end` from this direction.
        let is_one_way = end.surface().is_some_and(|surface| surface.is_one_way(surface.back, w));
        // A merged vertex may follow a delta lobe of the light path. Only this lobe can then have
        // sampled the vertex.
        let by_delta = is_merged && other.is_delta;
        ConnectionDensities {
            end: match by_delta {
                _ if is_one_way => 0.0,
                true => other.density_at(1.0, end),
                false => self.pdf_from_light(rest.last(), other, end, time),
            },
            previous: match before.last() {
                Some(previous) if !previous.is_one_way => self.pdf_from_light(Some(other), end, previous, time),
                _ => 0.0,
            },
            other: self.pdf_from_camera(back, end, other, time),
            next: match rest.last() {
                Some(next) if by_delta => next.reverse,
                Some(next) => self.pdf_from_camera(Some(other.direction_to(end)), other, next, time),
                None => 0.0,
            },
            direct: match (light, rest.last()) {
                (_, None) => self.direct(other, end, back, time),
                (_, Some(next)) if rest.len() == 1 => self.direct(next, other, Some(other.direction_to(end)), time),
                _ => 0.0,
            },
        }
    }

    /// Densities if `end`, the last vertex of the camera subpath, is on a light. `previous` is the
    /// vertex before `end`.
    fn densities_at_light_hit(
        &self,
        end: &PathVertex,
        previous: Option<&PathVertex>,
        light_hit: LightHit,
        time: f32,
    ) -> ConnectionDensities {
        let Some(previous) = previous else {
            return ConnectionDensities::default();
        };
        let scene = self.world.scene;
        let w = end.direction_to(previous);
        let [own, onwards] = emission_pdfs(scene, light_hit.light, end.is_infinite(), end.ng, w, time);
        ConnectionDensities {
            end: scene.emission_selection().pmf(light_hit.light) * own,
            previous: if previous.is_one_way {
                0.0
            } else {
                end.density_at(onwards, previous)
            },
            direct: if previous.takes_light_samples() {
                light_hit.direct
            } else {
                0.0
            },
            ..ConnectionDensities::default()
        }
    }

    /// Sets [`PathVertex::others`] along a camera subpath.
    pub fn sum_camera(&self, path: &mut [PathVertex], time: f32) {
        for k in 1..path.len() {
            let (before, at) = (&path[k - 1], &path[k]);
            let mut others = connects(before, at) + self.merges(before, before.reverse, time);
            if k > 1 {
                others += self.beyond(before.reverse, before.forward, before.others);
            }
            path[k].others = others;
        }
    }

    /// Sets [`PathVertex::others`] along a light subpath.
    pub fn sum_light(&self, path: &mut [PathVertex], time: f32) {
        let Some(first) = path.first_mut() else { return };
        first.others = one_if(!first.is_delta_light());
        for m in 1..path.len() {
            let (before, at) = (&path[m - 1], &path[m]);
            let mut others = connects(before, at);
            if m == 1 {
                // The strategy s = 1 samples the light from the vertex `at`. The density of this
                // sample depends on the vertex after `at`, which does not exist at the end of the
                // path.
                let Some(next) = path.get(2) else { break };
                let direct = self.direct(before, at, Some(at.direction_to(next)), time);
                others *= self.raised(direct, before.forward);
            }
            others += self.merges(at, at.forward, time) + self.beyond(before.reverse, before.forward, before.others);
            path[m].others = others;
        }
    }

    /// Ratio `density / over`, raised to the exponent of the MIS heuristic.
    fn raised(&self, density: f32, over: f32) -> f64 {
        self.heuristic.raised(density as f64 / over as f64)
    }

    /// Converts the sum `others` from "relative to the connection before a vertex" to "relative to
    /// the connection after the vertex". `own` is the density of the vertex if it is sampled from
    /// the start of its subpath. `other` is the density of the vertex if it is sampled from the
    /// other end of the path. Returns 0 if `others` is 0, even if the ratio of the densities is
    /// infinite.
    fn beyond(&self, other: f32, own: f32, others: f64) -> f64 {
        match self.raised(other, own) {
            ratio if ratio == 0.0 || others == 0.0 => 0.0,
            ratio => ratio * others,
        }
    }

    /// Density of merging at the vertex `at`, relative to a connection of `at` with its neighbour
    /// on the light's side. `from_light` is the density of `at` from the light.
    fn merges(&self, at: &PathVertex, from_light: f32, time: f32) -> f64 {
        if at.is_delta {
            0.0
        } else {
            self.merges_at_end(at, from_light, time)
        }
    }

    /// [`Connector::merges`] for the last vertex of a subpath, at which no delta lobe was sampled.
    fn merges_at_end(&self, at: &PathVertex, from_light: f32, time: f32) -> f64 {
        let Some(merging) = &self.merging else { return 0.0 };
        if at.surface().is_some_and(|surface| !surface.bsdf.is_delta()) {
            self.heuristic
                .raised(merging.acceptance(at.p, time) * from_light as f64)
        } else {
            0.0
        }
    }

    /// Density with which light sampling at the vertex `at` finds the vertex `light` on a light.
    /// `wo` is the direction from `at` to its previous vertex on the camera's side.
    fn direct(&self, light: &PathVertex, at: &PathVertex, wo: Option<Vec3>, time: f32) -> f32 {
        let scene = self.world.scene;
        let VertexKind::Light(end) = &light.kind else {
            return 0.0;
        };
        let context = match (at.surface(), wo) {
            (Some(surface), Some(wo)) => surface.light_context(scene, wo),
            _ => LightSampleContext::any_side(at.p),
        };
        let pmf = self.world.light_selection.pmf(scene.lights(), &context, end.id);
        if end.is_delta {
            return pmf;
        }
        let wi = at.direction_to(light);
        let factor = self
            .world
            .light_selection
            .pdf_factor(scene.lights(), end.id, &context, wi);
        let pdf = scene.lights()[end.id.0 as usize].pdf(context.p, light.p, wi, time) * factor;
        pmf * at.density_at(pdf, light)
    }
}

fn one_if(condition: bool) -> f64 {
    f64::from(u8::from(condition))
}

/// Returns 1 if `a` and the next vertex `b` of its subpath can be connected, else 0.
fn connects(a: &PathVertex, b: &PathVertex) -> f64 {
    one_if(!a.is_delta && !a.is_one_way && !b.is_delta)
}

/// Densities with which a path from the other end samples the vertices next to a connection. A
/// density is 0 if its vertex does not exist.
#[derive(Clone, Copy, Debug, Default)]
struct ConnectionDensities {
    /// Density of the last vertex of the camera subpath, sampled from the light.
    end: f32,
    /// Density of the vertex before the last vertex of the camera subpath, sampled from the light.
    previous: f32,
    /// Density of the last vertex of the light subpath, sampled from the camera.
    other: f32,
    /// Density of the vertex before the last vertex of the light subpath, sampled from the camera.
    next: f32,
    /// Density of the vertex on the light, if light sampling at the neighbour of this vertex finds
    /// it. 0 if neither of these two vertices is next to the connection.
    direct: f32,
}

#[cfg(test)]
mod tests;
