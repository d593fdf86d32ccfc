//! When the answers of two backends count as the same, and why they may differ.

use super::{Accel, Answer, Query};
use crate::geometry::{Hit, rounding};
use crate::math::float::{UNIT_ROUNDOFF, gamma};
use crate::math::{DVec3, Ray, Vec3};
use crate::scene::Scene;

/// Answers of two backends to one query that are further apart than rounding makes them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disagreement {
    /// What was asked.
    pub query: Query,
    /// What each backend said.
    pub answers: [Answer; 2],
    /// Why.
    pub cause: Cause,
}

/// Why a triangle may be hit by one right intersector and missed by another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Cause {
    /// The ray passes an edge nearer than roundings can tell, and what is behind it is something else.
    Edge,
    /// The ray runs so nearly in the plane of the triangle that roundings decide whether it crosses it.
    Grazing,
    /// The crossing is nearer to an end of the ray's interval than roundings can tell.
    Interval,
    /// None of these: one of the backends is wrong.
    Unexplained,
}

impl Cause {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Edge, Self::Grazing, Self::Interval, Self::Unexplained];

    /// As users read it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Edge => "edge",
            Self::Grazing => "grazing",
            Self::Interval => "interval",
            Self::Unexplained => "unexplained",
        }
    }
}

/// Asks both backends, and says how they disagree, if they do.
pub fn compare(scene: &Scene, accels: [&dyn Accel; 2], query: &Query) -> Option<Disagreement> {
    judge(scene, accels, query, accels.map(|accel| query.ask(accel)))
}

/// Says how the answers that `accels` gave disagree, if they do.
///
/// They agree where both miss, or both hit at distances that differ by no more than [`Crossing::t_error`] of both hits: whose
/// triangle it is does not matter, since neighbours share their edges. Occlusion must be the same.
pub(super) fn judge(
    scene: &Scene,
    accels: [&dyn Accel; 2],
    query: &Query,
    answers: [Answer; 2],
) -> Option<Disagreement> {
    let ray = &query.ray;
    let cause = match answers {
        [Answer::Closest(Some(a)), Answer::Closest(Some(b))] => {
            let error = Crossing::new(scene, ray, &a).t_error() + Crossing::new(scene, ray, &b).t_error();
            if (a.t as f64 - b.t as f64).abs() <= error {
                return None;
            }
            // The further hit says that the nearer one was missed.
            let nearer = if a.t < b.t { a } else { b };
            Crossing::new(scene, ray, &nearer).cause()
        }
        [a, b] if a.is_hit() == b.is_hit() => return None,
        [a, _] => {
            let hitting = accels[usize::from(!a.is_hit())];
            let hit = hitting.intersect(ray);
            hit.map_or(Cause::Unexplained, |hit| Crossing::new(scene, ray, &hit).cause())
        }
    };
    Some(Disagreement {
        query: *query,
        answers,
        cause,
    })
}

/// A ray and a triangle that it is said to hit, in f64.
///
/// Bounds on what intersectors in f32 make of it follow from these magnitudes: the distance R from the origin to the furthest
/// corner, the longest edge E, the unnormalised normal N, the direction d, and the unit roundoff u. Corners relative to the
/// origin are off by u R. Edge functions (Plücker's as Embree has them, or sheared ones of Woop et al. 2013) are volumes
/// of the direction and two corners whose distance from the ray is at most E: some tens of roundings of R E |d| at most. The
/// distance is a quotient by N·d in which an error of a corner or of the normal counts by at most E, since the crossing is no
/// further than that from any corner: some tens of roundings of R E² / |N·d|. Both are taken as 32 here;
/// `tests/backends.rs` prints how much of that is used.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    ray: Ray,
    t: f64,
    /// Relative to the origin of the ray.
    corners: [DVec3; 3],
    /// R E.
    scale: f64,
    /// E.
    edge: f64,
    /// |N·d|.
    determinant: f64,
    /// |N|.
    normal: f64,
    /// How far the triangle may be displaced by what moves it.
    displacement: f64,
}

/// Roundings that the bounds allow.
const ROUNDINGS: f64 = 32.0 * UNIT_ROUNDOFF as f64;

impl Crossing {
    /// Of `ray` and the triangle of `hit`.
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
        // Where the ray is moved into the space of the mesh, or the corners to a time, that rounds too.
        let size = placed.iter().fold(ray.origin.abs(), |size, p| size.max(p.abs()));
        let placement = scene.instance(hit.inst).map(|i| i.placement.at(ray.time));
        let displacement = match placement {
            Some(placement) => rounding(&placement, 2.0 * size),
            None if scene.mesh(hit.geom).deforms() => gamma(8) * size,
            None => Vec3::ZERO,
        };
        Self {
            ray: *ray,
            displacement: displacement.length() as f64,
            t: hit.t as f64,
            corners,
            scale: reach * edge,
            edge,
            determinant: normal.dot(ray.direction.as_dvec3()).abs(),
            normal: normal.length(),
        }
    }

    /// Largest error of a hit's distance, in lengths of the ray's direction.
    pub fn t_error(&self) -> f64 {
        (ROUNDINGS * self.scale * self.edge + self.displacement * self.normal) / self.determinant
    }

    /// Why another intersector may miss the triangle.
    fn cause(&self) -> Cause {
        let direction = self.ray.direction.as_dvec3();
        let volume_error = (ROUNDINGS * self.scale + self.displacement * self.edge) * direction.length();
        let [p0, p1, p2] = self.corners;
        let volumes = [p1.cross(p2), p2.cross(p0), p0.cross(p1)].map(|n| n.dot(direction).abs());
        let near = |end: f32| (self.t - end as f64).abs() <= self.t_error();
        if self.determinant <= volume_error {
            Cause::Grazing
        } else if volumes.iter().any(|v| *v <= volume_error) {
            Cause::Edge
        } else if near(self.ray.t_min) || near(self.ray.t_max) {
            Cause::Interval
        } else {
            Cause::Unexplained
        }
    }
}
