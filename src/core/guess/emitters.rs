//! Light of emitting surfaces on the rest of a scene.
//!
//! The eye of a robot, the screen of a phone and the flame of a torch light little except
//! themselves: their scenes need other light. The lamps of a room light most of it.
//!
//! Irradiance is measured at points that a camera sees. It is estimated by light paths of a few
//! bounces, with one light sample at each vertex. Irradiances are compared with each other, and
//! with a white display: a program that writes `Ke 1` means a surface of this brightness.

use super::scene_tracer::{SceneTracer, SurfaceHit};
use super::spread::radical_inverse;
use crate::geometry::segment;
use crate::light_sampling::{LightChoice, LightSampleContext, LightSelection};
use crate::math::hash::{GOLDEN_GAMMA, mix, unit_f32};
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::warp::{cosine_hemisphere, uniform_cone};
use rayon::prelude::*;
use std::f32::consts::PI;

/// Number of points that the camera sees.
const POINTS: u32 = 256;
/// Number of light paths per point.
const PATHS: u32 = 8;
/// Number of vertices of a path, including the point.
const VERTICES: u32 = 4;
/// Number of random numbers per vertex.
const NUMBERS: u32 = 5;
/// Median radiance of white surfaces below which a scene is dark, 8 stops below white.
const DARK: f32 = 1.0 / 256.0;
/// Distance of a ray's origin from its surface, in radii of the scene.
const OFFSET: f32 = 1e-4;

/// Requirement for a lit view: minimum fraction of lit surfaces among the visible surfaces, and
/// minimum irradiance of a lit surface, as a fraction of the median irradiance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Requirement {
    pub share: f32,
    pub irradiance: f32,
}

/// Returns true if the scene's lights fulfil `requirement` for the surfaces that are visible from
/// `eye` in the cone around `direction` with the half angle `half_angle`, in radians.
pub(super) fn light(
    tracer: &SceneTracer,
    eye: Vec3,
    (direction, half_angle): (Vec3, f32),
    requirement: Requirement,
) -> bool {
    let frame = Frame::from_z(direction);
    let selection = tracer.scene.light_selection(LightChoice::default());
    let point = |i: u32| {
        let u = Vec2::new(radical_inverse(2, i), radical_inverse(3, i));
        let w = frame.to_world(uniform_cone(u, half_angle.cos()));
        let seen = tracer.trace(eye, w)?;
        let emits = !tracer.material(&seen).emission_factor().is_black();
        (!emits).then(|| irradiance((tracer, &selection), eye + seen.distance * w, &seen, w, i))
    };
    let mut points: Vec<f32> = (0..POINTS).into_par_iter().filter_map(point).collect();
    points.sort_by(f32::total_cmp);
    let median = points.get(points.len() / 2).copied().unwrap_or(0.0);
    let darkest_lit = points.len() - (requirement.share * points.len() as f32).ceil() as usize;
    median >= DARK * PI && points[darkest_lit] >= requirement.irradiance * median
}

/// Estimates the irradiance at `p`, where a ray in the direction `w` hits the surface `seen`. `i`
/// is the index of the point.
fn irradiance(
    (tracer, selection): (&SceneTracer, &LightSelection),
    p: Vec3,
    seen: &SurfaceHit,
    w: Vec3,
    i: u32,
) -> f32 {
    let offset = OFFSET * tracer.region.bounds.radius();
    let paths = (0..PATHS).map(|k| {
        let (mut p, mut seen, mut w) = (p, *seen, w);
        let (mut sum, mut beta) = (0.0, 1.0);
        for vertex in 0..VERTICES {
            let u = |dimension: u32| {
                let index = (i * PATHS + k) * VERTICES + vertex;
                number(index * NUMBERS + dimension)
            };
            let n = if seen.normal.dot(w) > 0.0 {
                -seen.normal
            } else {
                seen.normal
            };
            let origin = p + offset * n;
            sum += beta * direct((tracer, selection), origin, n, [u(0), u(1), u(2)]);
            w = Frame::from_z(n).to_world(cosine_hemisphere(Vec2::new(u(3), u(4))));
            let Some(next) = tracer.trace(origin, w) else { break };
            (p, beta) = (origin + next.distance * w, beta * tracer.reflectance(&next));
            seen = next;
        }
        sum
    });
    paths.sum::<f32>() / PATHS as f32
}

/// Estimate of the direct irradiance at `p` with the normal `n`.
fn direct((tracer, selection): (&SceneTracer, &LightSelection), p: Vec3, n: Vec3, [choice, u, v]: [f32; 3]) -> f32 {
    let scene = tracer.scene;
    let lights = scene.lights();
    let context = LightSampleContext { p, n };
    let Some((id, pmf)) = selection.sample(lights, &context, choice) else {
        return 0.0;
    };
    let Some(sample) = selection.sample_light(lights, id, &context, 0.0, Vec2::new(u, v), scene.textures()) else {
        return 0.0;
    };
    let cos = sample.wi.dot(n);
    let is_met = |target: Vec3| {
        let ray = segment(p, target);
        let seen = tracer.trace(p, ray.direction);
        seen.is_none_or(|seen| seen.distance >= ray.t_max)
    };
    if cos > 0.0 && sample.target.is_none_or(is_met) {
        sample.radiance.luminance() * cos / (sample.pdf * pmf)
    } else {
        0.0
    }
}

/// Pseudorandom number in [0, 1) for each index.
fn number(index: u32) -> f32 {
    unit_f32(mix(u64::from(index).wrapping_add(1).wrapping_mul(GOLDEN_GAMMA)))
}
