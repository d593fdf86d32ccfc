//! Weights of multiple importance sampling over all strategies that make one path.
//!
//! A weight is computed from two arrays of densities, one from each end. Neighbouring strategies differ by one vertex, so each ratio of densities
//! follows from the one before (Veach 1997, §10.2). A delta lobe counts 1 on both sides; strategies that would have to join subpaths at a delta lobe
//! are left out.
//!
//! Vertex merging (`photon/vcm.rs`) adds one term for each vertex that is not passed by a delta lobe: its density is that of both subpaths that end
//! there, times `π r² n` for n light paths (Georgiev et al. 2012). Densities behind delta lobes are 1 for connections, which all have them in common.
//! Merging compares densities per area, and needs the geometry of the segment there too.

use super::Connector;
use crate::accel::Accel;
use crate::integrator::Heuristic;
use crate::integrator::bidirectional::subpath::{MAX_VERTICES, PathVertex, VertexKind, emission_pdfs};
use crate::light::{LightId, LightSampleContext};
use crate::math::Vec3;

/// A light that a path meets, and the density with which light sampling would have found it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Met {
    pub light: LightId,
    pub direct: f32,
}

impl<A: Accel> Connector<'_, '_, A> {
    /// Density with which a path from the camera that comes from the direction `wo` goes on from `at` to `to`.
    fn pdf_from_camera(&self, wo: Option<Vec3>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.kind, wo) {
            (VertexKind::Surface(surface), Some(wo)) => surface.pdf_from_camera(self.world.scene, wo, w),
            _ => self.pdf_of_camera(at.p, w, time),
        };
        at.density_at(pdf, to)
    }

    /// Density with which a path from a light that comes from `before` goes on from `at` to `to`.
    fn pdf_from_light(&self, before: Option<&PathVertex>, at: &PathVertex, to: &PathVertex, time: f32) -> f32 {
        let w = at.direction_to(to);
        let pdf = match (&at.kind, before) {
            (VertexKind::Surface(surface), Some(before)) => surface.pdf_from_light(at.direction_to(before), w),
            (VertexKind::Light(end), _) => {
                let [_, onwards] = emission_pdfs(self.world.scene, (end.id, end.is_infinite), at.ng, w, time);
                onwards
            }
            _ => 0.0,
        };
        at.density_at(pdf, to)
    }

    /// Share of the strategy that joins these subpaths among all that could have made their path (Veach 1997, §10.2.1).
    pub(super) fn weight(&self, camera: &[PathVertex], light: &[PathVertex], met: Option<Met>, time: f32) -> f32 {
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
        let back = |i: usize| at(i).surface().map(|surface| surface.back);
        match met {
            None => {
                path.is_delta[t - 1] = false;
                // What is merged may have come there by a delta lobe.
                path.is_delta[t] &= is_merged;
                path.from_camera[t] = self.pdf_from_camera(back(t - 1), at(t - 1), at(t), time);
                if s > 1 {
                    path.from_camera[t + 1] =
                        self.pdf_from_camera(Some(at(t).direction_to(at(t - 1))), at(t), at(t + 1), time);
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
                let scene = self.world.scene;
                let [own, onwards] = emission_pdfs(scene, (light, end.is_infinite()), end.ng, w, time);
                path.is_delta[n - 1] = false;
                path.from_light[n - 1] = scene.emission_selection().pmf(light) * own;
                path.from_light[n - 2] = end.density_at(onwards, next);
            }
        }

        // Where a light would be sampled for the vertex before it
        let (direct, is_delta_light) = match met {
            Some(met) => (met.direct, false),
            None => {
                let wo = match s {
                    1 => back(n - 2),
                    _ => Some(at(n - 2).direction_to(at(n - 3))),
                };
                self.direct(at(n - 1), at(n - 2), wo, time)
            }
        };
        if let Some(merging) = &self.merging {
            // To be compared with densities of merging, those by delta lobes need the geometry of their segments, which connections alone leave out.
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

    /// Density with which the end `light` of a path is sampled for the vertex `at`, seen from the direction `wo`; and whether there is no other way to it but
    /// from itself.
    fn direct(&self, light: &PathVertex, at: &PathVertex, wo: Option<Vec3>, time: f32) -> (f32, bool) {
        let scene = self.world.scene;
        let VertexKind::Light(end) = &light.kind else {
            return (0.0, false);
        };
        let context = match (at.surface(), wo) {
            (Some(surface), Some(wo)) => surface.light_context(scene, wo),
            _ => LightSampleContext::any_side(at.p),
        };
        let pmf = scene.light_selection().pmf(scene.lights(), &context, end.id);
        if end.is_delta {
            return (pmf, true);
        }
        let wi = at.direction_to(light);
        let factor = scene.light_selection().pdf_factor(scene.lights(), end.id, &context, wi);
        let pdf = scene.lights()[end.id.0 as usize].pdf(context.p, light.p, wi, time) * factor;
        (pmf * at.density_at(pdf, light), false)
    }
}

/// With which densities each vertex of a path, from the camera on, is drawn from either side.
struct Densities {
    n: usize,
    from_camera: [f32; MAX_VERTICES],
    from_light: [f32; MAX_VERTICES],
    /// Where the path goes on by a delta lobe, to which nothing can be joined.
    is_delta: [bool; MAX_VERTICES],
    /// [`super::Merging::acceptance`] at the vertex; 0 where nothing is merged.
    acceptance: [f64; MAX_VERTICES],
}

impl Densities {
    fn new(n: usize) -> Self {
        Self {
            n,
            from_camera: [0.0; MAX_VERTICES],
            from_light: [0.0; MAX_VERTICES],
            is_delta: [false; MAX_VERTICES],
            acceptance: [0.0; MAX_VERTICES],
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
        // ANCHOR: sum
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
            // Past a vertex that no other strategy makes there is none, whatever densities say.
            if product == 0.0 {
                break;
            }
            add(other, product);
        }
        let mut product = 1.0;
        for other in t + 1..=n {
            product /= ratio(other - 1);
            add(other, product);
        }
        // ANCHOR_END: sum
        // A strategy that is no match for others at all counts nothing.
        let weight = (1.0 / sum) as f32;
        if weight.is_finite() { weight } else { 0.0 }
    }
}
