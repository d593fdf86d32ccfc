use super::Accel;
use crate::geometry::Hit;
use crate::math::Ray;

/// A question to a backend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Query {
    /// The segment in question.
    pub ray: Ray,
    /// Kind of the query.
    pub kind: QueryKind,
}

/// Kind of a query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QueryKind {
    /// The closest hit.
    Closest,
    /// Whether there is any hit.
    Occlusion,
}

/// What a backend says to a [`Query`] of the same kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The closest hit, if there is one.
    Closest(Option<Hit>),
    /// Whether there is any hit.
    Occlusion(bool),
}

impl Query {
    /// Asks for the closest hit of `ray`.
    pub fn closest(ray: &Ray) -> Self {
        Self {
            ray: *ray,
            kind: QueryKind::Closest,
        }
    }

    /// Asks whether `ray` hits anything.
    pub fn occlusion(ray: &Ray) -> Self {
        Self {
            ray: *ray,
            kind: QueryKind::Occlusion,
        }
    }

    /// Asks `accel`.
    #[inline(always)]
    pub fn ask(&self, accel: &(impl Accel + ?Sized)) -> Answer {
        match self.kind {
            QueryKind::Closest => Answer::Closest(accel.intersect(&self.ray)),
            QueryKind::Occlusion => Answer::Occlusion(accel.occluded(&self.ray)),
        }
    }
}

impl Answer {
    /// The closest hit, if that was asked for and there is one.
    #[inline(always)]
    pub fn hit(&self) -> Option<Hit> {
        match self {
            Self::Closest(hit) => *hit,
            Self::Occlusion(_) => None,
        }
    }

    /// Whether anything was hit.
    #[inline(always)]
    pub fn is_hit(&self) -> bool {
        match self {
            Self::Closest(hit) => hit.is_some(),
            Self::Occlusion(occluded) => *occluded,
        }
    }
}
