//! Factors of the vertices of a path: contributions, and densities in bidirectional path tracing.

use super::path::{Factors, LightEnd, LightEndKind, Path, Single, Vertex};
use super::space::PathSpace;
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::integrator::bidirectional::subpath::{Surface, VertexKind, emission_pdfs};
use crate::math::{Vec2, Vec3};

impl<'a, A: Accel> PathSpace<'_, 'a, A> {
    /// Factors of the vertex `at`. `before` is its neighbour on the camera's side, and `after` has
    /// the next two vertices on the light's side. `None` if the contribution is 0.
    pub fn factors(
        &self,
        at: &Vertex,
        before: Option<&Vertex>,
        after: [Option<&Vertex>; 2],
        time: f32,
    ) -> Option<Factors> {
        let geometry_term = after[0].map_or(1.0, |next| edge(at, next, after[1]));
        match &at.kind {
            VertexKind::Lens(_) => {
                let camera = self.world.camera;
                let next = after[0]?;
                let importance = camera.importance(at.p, at.direction_to(next), time)?;
                // Importance per area of the lens and solid angle, divided by the density of film
                // point and lens point
                let seen = importance.we * cosine(at, at.direction_to(next));
                let seen = seen * camera.lens_area() / self.film.area();
                Some(Factors {
                    // Only points have a lens point that faces them. So a movable lens is never
                    // connected to light from infinity.
                    geometry_term: if at.is_movable_lens() && next.is_infinite() {
                        f64::INFINITY
                    } else {
                        seen as f64 * geometry_term
                    },
                    ..Factors::default()
                })
            }
            VertexKind::Light(source) => self.factors_of_light(at, source, before?, time),
            VertexKind::Surface(surface) => {
                let (wo, wi) = (at.direction_to(before?), at.direction_to(after[0]?));
                let factors = if at.is_delta {
                    self.factors_of_delta(surface, wo, wi)?
                } else {
                    self.factors_of_surface(surface, wo, wi)
                };
                Some(Factors {
                    geometry_term,
                    ..factors
                })
            }
        }
    }

    fn factors_of_surface(&self, surface: &Surface, wo: Vec3, wi: Vec3) -> Factors {
        let scene = self.world.scene;
        let [out, into] = [wo, wi].map(|w| w.dot(surface.point.ng).abs() as f64);
        let towards_camera = out / into;
        Factors {
            value: surface.scattered_arrival(scene, wo, wi),
            camera: surface.pdf_from_camera(scene, wo, wi) as f64,
            light: surface.pdf_from_light(wi, wo) as f64 / towards_camera,
            towards_camera,
            ..Factors::default()
        }
    }

    fn factors_of_delta(&self, surface: &Surface, wo: Vec3, wi: Vec3) -> Option<Factors> {
        let single = |from: Vec3, to: Vec3, mode| {
            let frame = surface.frame_for(self.world.scene, from, mode);
            let (from, to) = (frame.to_local(from), frame.to_local(to));
            Single::of(&surface.bsdf, from, from.z * to.z > 0.0, mode)
        };
        let camera = single(wo, wi, TransportMode::Radiance)?;
        let light = single(wi, wo, TransportMode::Importance)?;
        let adjoint = surface.adjoint_delta(wo, wi);
        let towards_camera = (light.flux.luminance() * adjoint) as f64 / camera.flux.luminance() as f64;
        (towards_camera > 0.0).then(|| Factors {
            value: camera.flux,
            camera: camera.probability as f64,
            light: light.probability as f64 / towards_camera,
            towards_camera,
            ..Factors::default()
        })
    }

    fn factors_of_light(&self, at: &Vertex, source: &LightEnd, before: &Vertex, time: f32) -> Option<Factors> {
        let scene = self.world.scene;
        let w = at.direction_to(before);
        let is_infinite = source.kind.is_infinite();
        let [start, onwards] = emission_pdfs(scene, source.id, is_infinite, at.ng, w, time).map(f64::from);
        let (value, towards_camera) = match source.kind {
            LightEndKind::Area => {
                let cos = w.dot(at.ng);
                (cos > 0.0).then_some((source.radiance, cos as f64))?
            }
            LightEndKind::Point => {
                let light = &scene.lights()[source.id.0 as usize];
                let sample = light.sample(before.p, time, Vec2::ZERO, scene.textures())?;
                (sample.radiance * before.p.distance_squared(at.p), 1.0)
            }
            LightEndKind::Far | LightEndKind::Parallel => (source.radiance, 1.0),
        };
        Some(Factors {
            value,
            light: onwards / towards_camera,
            towards_camera,
            start: scene.emission_selection().pmf(source.id) as f64 * start / f64::from(source.opacity),
            ..Factors::default()
        })
    }

    /// Probability that a ray that leaves the scene, or that hits the surface of a light, is
    /// assigned to the light `source`.
    pub fn hit_probability(&self, source: &LightEnd) -> f64 {
        match source.kind {
            LightEndKind::Area => 1.0,
            LightEndKind::Far => 1.0 / self.far_lights as f64,
            LightEndKind::Point | LightEndKind::Parallel => 0.0,
        }
    }

    /// Density with which bidirectional path tracing makes the new vertices of `path`, divided by
    /// the contribution of the path. The new vertices are the `count` vertices after the first
    /// `kept` vertices. The density is the sum over all splits of the new vertices between both
    /// ends, without the factors of the kept vertices.
    ///
    /// The camera subpath keeps `kept` vertices, and the light subpath keeps all remaining
    /// vertices. Both subpaths continue from these vertices, and are then connected, unless the
    /// camera subpath hits a light (Veach 1997, §10.2 and §11.4.2.1).
    pub fn inverse_contribution(&self, path: &Path<'a>, kept: usize, count: usize) -> f64 {
        let n = path.len();
        let kept_light = n - kept - count;
        let factors = |i: usize| &path.vertices[i].factors;
        let or_0 = |x: f64| if x.is_finite() { x } else { 0.0 };
        // Loop over the numbers t of camera vertices, from the maximum down. `from_light` is the
        // product of the steps from the light. `sum` is the sum over all strategies with at least t
        // camera vertices, without their common steps from the camera (Horner's scheme).
        let first = (n - kept_light).min(n - 1);
        let (mut from_light, mut sum) = (1.0, 0.0);
        for t in (kept.max(1)..=kept + count).rev() {
            if t < first {
                from_light *= factors(t + 1).light;
            }
            let ends = match (path.source(), kept_light) {
                (Some(source), 0) if t == n => self.hit_probability(source),
                (_, 0) => factors(n - 1).start,
                _ => 1.0,
            };
            let geometry_term = match t {
                t if t == n => 1.0,
                t if path.can_be_joined(t - 1) => factors(t - 1).geometry_term,
                _ => f64::INFINITY,
            };
            sum = or_0(from_light * ends / (geometry_term * path.target)) + or_0(factors(t - 1).camera * sum);
        }
        sum
    }
}

/// Geometry term of the edge between `at` and `next`, if the edge connects two subpaths:
/// `transmittance |cos| / d²`, with the cosine at `next`. The term is divided by the cosine at
/// `next` of the direction to `after`, because the value of `next` contains this cosine (Veach
/// 1997, §8.2).
fn edge(at: &Vertex, next: &Vertex, after: Option<&Vertex>) -> f64 {
    if next.is_infinite() {
        return at.transmittance.pass as f64;
    }
    let w = next.direction_to(at);
    let cos = |w: Vec3| cosine(next, w).abs() as f64;
    let into = after.map_or(1.0, |after| cos(next.direction_to(after)));
    let squared = if at.is_infinite() {
        1.0
    } else {
        at.p.distance_squared(next.p) as f64
    };
    at.transmittance.pass as f64 * cos(w) / into / squared
}

/// Cosine between the unit direction `w` and the normal of `at`; 1 if the vertex has no normal.
fn cosine(at: &Vertex, w: Vec3) -> f32 {
    if at.ng == Vec3::ZERO { 1.0 } else { w.dot(at.ng) }
}
