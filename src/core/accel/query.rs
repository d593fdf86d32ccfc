use super::Accel;
use crate::geometry::Hit;
use crate::math::Ray;

/// A ray query to a backend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// Ray, with the interval of the ray parameter in which hits count.
    pub ray: Ray,
    /// Kind of the query.
    pub kind: QueryKind,
}

/// Kind of a ray query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueryKind {
    /// Query for the closest hit.
    Closest,
    /// Query for any hit.
    Occlusion,
}

/// Answer of a backend to a [`Query`] of the same kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// Closest hit, if any.
    Closest(Option<Hit>),
    /// True if there is any hit.
    Occlusion(bool),
}

impl Query {
    /// Query for the closest hit of `ray`.
    pub fn closest(ray: &Ray) -> Self {
        Self {
            ray: *ray,
            kind: QueryKind::Closest,
        }
    }

    /// Query for any hit of `ray`.
    pub fn occlusion(ray: &Ray) -> Self {
        Self {
            ray: *ray,
            kind: QueryKind::Occlusion,
        }
    }

    /// Traces the query with `accel`.
    #[inline(always)]
    pub fn trace(&self, accel: &(impl Accel + ?Sized)) -> Answer {
        match self.kind {
            QueryKind::Closest => Answer::Closest(accel.intersect(&self.ray)),
            QueryKind::Occlusion => Answer::Occlusion(accel.occluded(&self.ray)),
        }
    }
}

impl Answer {
    /// Closest hit, if the query was for the closest hit and the ray hit a surface.
    #[inline(always)]
    pub fn hit(&self) -> Option<Hit> {
        match self {
            Self::Closest(hit) => *hit,
            Self::Occlusion(_) => None,
        }
    }

    /// Returns `true` if the ray hit a surface.
    #[inline(always)]
    pub fn is_hit(&self) -> bool {
        match self {
            Self::Closest(hit) => hit.is_some(),
            Self::Occlusion(occluded) => *occluded,
        }
    }
}
