//! Ray queries: the trait [`Accel`], its backends (`embree`, `bvh`, `brute`), and their cross-checks (`audit`, `disagreement`).
//!
//! A query finds the closest hit, or any hit, in the open interval of a ray. A backend reports ids, the ray parameter and barycentrics alone;
//! `geometry` makes points and normals of them.

mod audit;
pub mod brute;
#[cfg(feature = "obvhs")]
pub mod bvh;
mod disagreement;
#[cfg(feature = "embree")]
pub mod embree;
mod empty;
mod query;
mod record;

pub use audit::{Auditor, Findings};
use disagreement::judge;
pub use disagreement::{Cause, Crossing, Disagreement, compare};
pub(crate) use empty::Empty;
pub use query::{Answer, Query, QueryKind};
pub use record::Recorder;

use crate::geometry::Hit;
use crate::math::Ray;

/// An acceleration structure: committed, immutable, built once and shared by all threads.
pub trait Accel: Send + Sync {
    /// The closest hit in the ray's open interval.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// The closest hits of rays that start and go nearly alike: a backend may trace them together.
    ///
    /// `hits` is as long as `rays`. Which of two triangles is hit where they meet may be another one than by
    /// [`Accel::intersect`].
    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray);
        }
    }

    /// Whether anything is hit in the ray's open interval.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Whether anything is hit, for rays that start and go nearly alike: a backend may trace them together.
    ///
    /// `occluded` is as long as `rays`.
    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray);
        }
    }

    /// Number of `queries` that hit something: a loop that is compiled for the backend itself, so that measurements of it have no calls through a table.
    fn count_hits(&self, queries: &[Query]) -> usize {
        queries.iter().filter(|query| query.ask(self).is_hit()).count()
    }

    /// Which backend this is, and what it uses.
    fn info(&self) -> BackendInfo;

    /// Bytes the structure takes, as far as the backend tells.
    fn bytes(&self) -> u64;
}

/// How ray-tracing code reaches a backend.
pub trait Dispatch: Accel {
    /// Whether each query is a call through a table: code that is compiled for the backend itself gains nothing then.
    const IS_DYNAMIC: bool;
}

impl Dispatch for &dyn Accel {
    const IS_DYNAMIC: bool = true;
}

impl Accel for &dyn Accel {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        (**self).intersect(ray)
    }

    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        (**self).intersect_coherent(rays, hits);
    }

    fn occluded(&self, ray: &Ray) -> bool {
        (**self).occluded(ray)
    }

    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        (**self).occluded_coherent(rays, occluded);
    }

    fn count_hits(&self, queries: &[Query]) -> usize {
        (**self).count_hits(queries)
    }

    fn info(&self) -> BackendInfo {
        (**self).info()
    }

    fn bytes(&self) -> u64 {
        (**self).bytes()
    }
}

/// Describes a backend to users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// The name users type.
    pub name: &'static str,
    /// Version of the library behind it.
    pub version: String,
    /// Instruction set it runs on.
    pub isa: &'static str,
}
