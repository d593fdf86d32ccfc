//! Comparison of the answers of two backends, and causes of disagreements.
//!
//! The hit distances of two backends may differ by rounding errors. [`Crossing`] computes a bound
//! on these errors from the triangle, the ray and the placement. Each hit must also be at the
//! crossing of its ray with its triangle, computed in f64. This check needs no second backend. It
//! finds wrong ids and barycentrics, and errors that both backends share.
//!
//! If one backend misses a hit, or if both hit different triangles, rounding explains the
//! difference in four cases:
//!
//! - The ray meets the boundary edge of a surface.
//! - The ray is parallel to the surface.
//! - The crossing is at an end of the ray's interval.
//! - The backends hit two surfaces that coincide.
//!
//! If the ray meets an edge, eight parallel rays around the ray are traced. If all eight rays hit a
//! surface at a similar or smaller distance, the edge is not a boundary, and the ray has leaked
//! through the surface. All other differences are defects, and `tests/it/rays/backends.rs` allows
//! none.

use super::brute::BruteForce;
use super::{Accel, Answer, Query};
use crate::geometry::{GeomId, Hit, InstanceId, PrimId, rounding};
use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::math::{DVec3, Frame, Ray, Vec3};
use crate::scene::Scene;
use std::f32::consts::TAU;

/// Answers of two backends to one query that differ by more than rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// Query to which the answers differ.
    pub query: Query,
    /// True if the first backend traced the ray in a packet.
    pub is_packet: bool,
    /// Answers of the two backends to the query.
    pub answers: [Answer; 2],
    /// Cause of the difference.
    pub cause: Cause,
}

/// Cause of a difference between two answers, or of a wrong answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// The distance between the ray and a boundary edge of a surface is within the rounding error.
    Edge,
    /// The ray is nearly parallel to the triangle. Rounding decides whether the ray crosses the
    /// plane of the triangle.
    Grazing,
    /// The crossing is within the rounding error of an end of the ray's interval.
    Interval,
    /// Two surfaces coincide, so rounding decides which surface is hit.
    Coincident,
    /// The ray passed through a shared edge or a corner of triangles, although the surface
    /// continues on all sides.
    Leak,
    /// No other cause applies, so a backend is wrong.
    Unexplained,
}

impl Cause {
    /// Number of causes.
    pub const COUNT: usize = Self::ALL.len();

    /// All causes.
    pub const ALL: [Self; 6] = [
        Self::Edge,
        Self::Grazing,
        Self::Interval,
        Self::Coincident,
        Self::Leak,
        Self::Unexplained,
    ];

    /// Name of the cause, for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Grazing => "grazing",
            Self::Interval => "interval",
            Self::Coincident => "coincident",
            Self::Leak => "leak",
            Self::Unexplained => "unexplained",
        }
    }

    /// Returns `true` if an answer is wrong. For the other causes, rounding allows more than one
    /// answer.
    pub fn is_fault(self) -> bool {
        matches!(self, Self::Leak | Self::Unexplained)
    }
}

impl Disagreement {
    /// For each backend, `true` if its answer is wrong. The answer of `brute`, if given, counts as
    /// correct. Both values are `false` if rounding explains the difference, or if the cause is
    /// `Unexplained` and `brute` is `None`.
    pub fn wrong(&self, scene: &Scene, brute: Option<&BruteForce>) -> [bool; 2] {
        let ray = &self.query.ray;
        let exact = brute.map(|brute| self.query.trace(brute));
        let truth = match self.cause {
            // The nearest hit of the backends and of brute force counts as correct, because brute
            // force may also leak through the edge.
            Cause::Leak => self
                .answers
                .into_iter()
                .chain(exact)
                .min_by(|a, b| nearness(a).total_cmp(&nearness(b))),
            Cause::Unexplained => exact,
            _ => None,
        };
        let is_wrong = |answer: Answer| truth.is_some_and(|truth| !agree(scene, ray, [answer, truth]));
        self.answers.map(is_wrong)
    }
}

/// Sort key of an answer: smaller for nearer hits, and smaller for occluded rays than for visible
/// rays.
fn nearness(answer: &Answer) -> f32 {
    match answer {
        Answer::Closest(hit) => hit.map_or(f32::INFINITY, |hit| hit.t),
        Answer::Occlusion(occluded) => f32::from(u8::from(!occluded)),
    }
}

/// Returns `true` if both answers agree within rounding error and each hit lies on its triangle.
fn agree(scene: &Scene, ray: &Ray, answers: [Answer; 2]) -> bool {
    match answers.map(|answer| answer.hit().map(|hit| Crossing::new(scene, ray, &hit))) {
        [Some(a), Some(b)] => a.is_right() && b.is_right() && a.is_as_far_as(&b),
        _ => answers[0].is_hit() == answers[1].is_hit(),
    }
}

/// Traces the query in both backends. Returns the disagreement of the answers, if any.
pub fn compare(scene: &Scene, accels: [&dyn Accel; 2], query: &Query) -> Option<Disagreement> {
    judge(scene, accels, query, accels.map(|accel| query.trace(accel)))
}

/// Returns the disagreement between the answers of `accels`, if any.
///
/// Each hit must be at the crossing of its ray and its triangle, computed in f64. Both backends
/// must hit, or both must miss. The hit distances may differ by the sum of [`Crossing::t_error`] of
/// both hits. Both hits must be on the same triangle. Exceptions are rays that graze a triangle,
/// and rays that meet an edge, because two triangles may share this edge.
pub(super) fn judge(
    scene: &Scene,
    accels: [&dyn Accel; 2],
    query: &Query,
    answers: [Answer; 2],
) -> Option<Disagreement> {
    let ray = &query.ray;
    let crossings = answers.map(|answer| answer.hit().map(|hit| Crossing::new(scene, ray, &hit)));
    let missed = |hitting: &dyn Accel, crossing: &Crossing| match crossing.cause() {
        Cause::Edge if crossing.continues_around(hitting) => Cause::Leak,
        cause => cause,
    };
    let cause = match crossings {
        _ if crossings.iter().flatten().any(|crossing| !crossing.is_right()) => Cause::Unexplained,
        [Some(a), Some(b)] if a.is_as_far_as(&b) => {
            let is_at_an_edge = |crossing: &Crossing| matches!(crossing.cause(), Cause::Edge | Cause::Grazing);
            if a.triangle == b.triangle || is_at_an_edge(&a) || is_at_an_edge(&b) {
                return None;
            }
            Cause::Coincident
        }
        // The backend with the farther hit missed the nearer hit.
        [Some(a), Some(b)] if a.t < b.t => missed(accels[0], &a),
        [Some(_), Some(b)] => missed(accels[1], &b),
        [Some(a), None] => missed(accels[0], &a),
        [None, Some(b)] => missed(accels[1], &b),
        [None, None] if answers[0].is_hit() == answers[1].is_hit() => return None,
        [None, None] => {
            let hitting = accels[usize::from(!answers[0].is_hit())];
            let hit = hitting.intersect(ray);
            hit.map_or(Cause::Unexplained, |hit| {
                missed(hitting, &Crossing::new(scene, ray, &hit))
            })
        }
    };
    Some(Disagreement {
        query: *query,
        is_packet: false,
        answers,
        cause,
    })
}

/// A ray and the triangle of its hit, in f64.
///
/// Bounds on the errors of f32 intersectors follow from these magnitudes: the distance R from the
/// origin to the farthest corner, the longest edge E, the unnormalised normal N, the direction d,
/// and the unit roundoff u. Corners relative to the origin have an error of u R. Edge functions
/// (Plücker's as in Embree, or sheared as in Woop et al. 2013) are volumes of the direction and two
/// corners whose distance from the ray is at most E. The error of an edge function is at most some
/// tens of roundings of R E |d|. The hit distance is a quotient with the divisor N·d. An error of a
/// corner or of the normal is multiplied by at most E, because the distance of the crossing from
/// each corner is at most E. The error of the hit distance is therefore some tens of roundings of R
/// E² / |N·d|. Both bounds use 32 roundings. The test `tests/it/rays/backends.rs` prints the
/// largest errors as fractions of these bounds, and of the bound on barycentrics that follows from
/// them.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    ray: Ray,
    triangle: (InstanceId, GeomId, PrimId),
    /// Ray parameter of the hit.
    t: f64,
    /// Barycentrics of the hit.
    barycentrics: [f64; 2],
    /// Corners relative to the origin of the ray.
    corners: [DVec3; 3],
    /// Product R E.
    scale: f64,
    /// Longest edge E.
    edge: f64,
    /// Unnormalised normal N.
    normal: DVec3,
    /// Product N·d.
    determinant: f64,
    /// Bound on the rounding error that motion or placement adds to the corners.
    displacement: f64,
}

/// Relative error bound of 32 roundings.
const ROUNDINGS: f64 = 32.0 * UNIT_ROUNDOFF as f64;

impl Crossing {
    /// Crossing of `ray` and the triangle of `hit`.
    pub fn new(scene: &Scene, ray: &Ray, hit: &Hit) -> Self {
        let placed = scene.corners(hit, ray.time);
        let corners = placed.map(|p| p.as_dvec3() - ray.origin.as_dvec3());
        let [p0, p1, p2] = corners;
        let normal = (p1 - p0).cross(p2 - p0);
        let edge = [p1 - p0, p2 - p1, p0 - p2]
            .map(DVec3::length)
            .into_iter()
            .fold(0.0, f64::max);
        let reach = corners.map(DVec3::length).into_iter().fold(0.0, f64::max);
        // The transform of the ray into the space of the mesh has a rounding error, and so has the
        // interpolation of the corners in time.
        let size = placed.iter().fold(ray.origin.abs(), |size, p| size.max(p.abs()));
        let placement = scene.instance(hit.inst).map(|i| i.placement.at(ray.time));
        let displacement = match placement {
            Some(placement) => rounding(&placement, 2.0 * size),
            None if scene.mesh(hit.geom).deforms() => gamma(8) * size,
            None => Vec3::ZERO,
        };
        Self {
            ray: *ray,
            triangle: (hit.inst, hit.geom, hit.prim),
            displacement: displacement.length() as f64,
            t: hit.t as f64,
            barycentrics: [hit.b1 as f64, hit.b2 as f64],
            corners,
            scale: reach * edge,
            edge,
            normal,
            determinant: normal.dot(ray.direction.as_dvec3()),
        }
    }

    /// Error bound of the ray parameter of the hit.
    pub fn t_error(&self) -> f64 {
        (ROUNDINGS * self.scale * self.edge + self.displacement * self.normal.length()) / self.determinant.abs()
    }

    /// Error bound of an edge function.
    fn volume_error(&self) -> f64 {
        (ROUNDINGS * self.scale + self.displacement * self.edge) * self.ray.direction.as_dvec3().length()
    }

    /// For each corner, the edge function of the opposite edge. The three edge functions sum to
    /// `determinant`.
    fn volumes(&self) -> [f64; 3] {
        let [p0, p1, p2] = self.corners;
        [p1.cross(p2), p2.cross(p0), p0.cross(p1)].map(|n| n.dot(self.ray.direction.as_dvec3()))
    }

    /// Error bound of the hit's barycentrics. A barycentric is an edge function divided by the sum
    /// of all three edge functions, and is at most 1. Four errors of edge functions therefore add
    /// up.
    pub fn barycentric_error(&self) -> f64 {
        4.0 * self.volume_error() / self.determinant.abs() + ROUNDINGS
    }

    /// Returns the errors of the hit, compared with the crossing computed in f64: the error of the
    /// ray parameter, and the larger error of the two barycentrics.
    pub fn errors(&self) -> (f64, f64) {
        let [_, b1, b2] = self.volumes().map(|volume| volume / self.determinant);
        let t = self.normal.dot(self.corners[0]) / self.determinant;
        let [d1, d2] = self.barycentrics;
        ((self.t - t).abs(), (d1 - b1).abs().max((d2 - b2).abs()))
    }

    /// Returns `true` if the hit is at the crossing of ray and triangle, within the ray's interval.
    /// The hit of a grazing ray may be anywhere in the triangle.
    fn is_right(&self) -> bool {
        let [b1, b2] = self.barycentrics;
        let is_inside = b1.min(b2).min(1.0 - b1 - b2) >= -ROUNDINGS;
        let is_in_range = self.t > self.ray.t_min as f64 && self.t < self.ray.t_max as f64;
        let (t, b) = self.errors();
        let is_there = t <= self.t_error() && b <= self.barycentric_error();
        is_inside && is_in_range && (is_there || self.is_grazing())
    }

    /// Returns `true` if this hit and `other` have the same distance up to rounding.
    fn is_as_far_as(&self, other: &Self) -> bool {
        (self.t - other.t).abs() <= self.t_error() + other.t_error()
    }

    /// Returns `true` if rounding decides whether the ray crosses the triangle's plane.
    fn is_grazing(&self) -> bool {
        self.determinant.abs() <= self.volume_error()
    }

    /// Cause of a disagreement in which another backend misses this triangle.
    fn cause(&self) -> Cause {
        let near = |end: f32| (self.t - end as f64).abs() <= self.t_error();
        if self.is_grazing() {
            Cause::Grazing
        } else if self.volumes().iter().any(|v| v.abs() <= self.volume_error()) {
            Cause::Edge
        } else if near(self.ray.t_min) || near(self.ray.t_max) {
            Cause::Interval
        } else {
            Cause::Unexplained
        }
    }

    /// Returns `true` if the surface continues on all sides of the ray. Traces eight parallel rays
    /// whose offset is larger than rounding errors. All of them must hit a surface at a similar or
    /// smaller distance.
    fn continues_around(&self, accel: &dyn Accel) -> bool {
        let ray = &self.ray;
        let length = ray.direction.length();
        let roundings = ROUNDINGS * self.scale / self.edge + self.displacement;
        let offset = 4.0 * roundings as f32 + gamma(8) * ray.origin.abs().max_element();
        // Limit the hit distance of the parallel rays. If the surface turns away steeply at the
        // edge, they hit farther away, and the edge counts as a boundary.
        let furthest = self.t as f32 + 64.0 * offset / length;
        let frame = Frame::from_z(ray.direction / length);
        (0..8).all(|i| {
            let (sin, cos) = (TAU * (i as f32 + 0.5) / 8.0).sin_cos();
            let beside = Ray {
                origin: ray.origin + offset * frame.to_world(Vec3::new(cos, sin, 0.0)),
                ..*ray
            };
            accel.intersect(&beside).is_some_and(|hit| hit.t <= furthest)
        })
    }
}
