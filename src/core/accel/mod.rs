//! Ray queries: the trait [`Accel`], its backends (`embree`, `bvh`, `brute`), and their
//! cross-checks (`audit`, `disagreement`).
//!
//! A query finds the closest hit, or any hit, in the open interval of a ray. A backend returns only
//! ids, the ray parameter and barycentrics; `geometry` computes points and normals.

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

pub use audit::{AuditFindings, Auditor};
use disagreement::judge;
pub use disagreement::{Cause, Crossing, Disagreement, compare};
pub(crate) use empty::Empty;
pub use query::{Answer, Query, QueryKind};
pub use record::Recorder;

use crate::geometry::Hit;
use crate::math::Ray;

/// An acceleration structure for ray queries. It is built once, does not change, and is shared by
/// all threads.
pub trait Accel: Send + Sync {
    /// Closest hit in the ray's open interval.
    fn intersect(&self, ray: &Ray) -> Option<Hit>;

    /// Writes the closest hits of `rays` to `hits`. The rays have similar origins and directions,
    /// so a backend may trace them together.
    ///
    /// `hits` is as long as `rays`. On an edge between two triangles, the hit may differ from the
    /// hit of [`Accel::intersect`].
    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.intersect(ray);
        }
    }

    /// Returns `true` if there is a hit in the ray's open interval.
    fn occluded(&self, ray: &Ray) -> bool;

    /// Writes the occlusion of `rays` to `occluded`: `true` for each ray with a hit. The rays have
    /// similar origins and directions, so a backend may trace them together.
    ///
    /// `occluded` is as long as `rays`.
    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        for (ray, occluded) in rays.iter().zip(occluded) {
            *occluded = self.occluded(ray);
        }
    }

    /// Number of `queries` with a hit. The loop is compiled for each backend, so measured times
    /// contain no dynamic calls.
    fn count_hits(&self, queries: &[Query]) -> usize {
        queries.iter().filter(|query| query.trace(self).is_hit()).count()
    }

    /// Name, version and instruction set of the backend.
    fn info(&self) -> BackendInfo;

    /// Memory of the structure in bytes, as far as the backend can measure it.
    fn bytes(&self) -> u64;
}

/// A backend that integrators call statically (as `EmbreeAccel`) or dynamically (`&dyn Accel`).
pub trait Dispatch: Accel {
    /// True if each query is a dynamic call. Code that is specialised for the type of the backend
    /// then has no advantage.
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

/// Description of a backend for users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BackendInfo {
    /// Name of the backend on the command line.
    pub name: &'static str,
    /// Version of the backend's library.
    pub version: String,
    /// Instruction set that the backend uses.
    pub isa: &'static str,
}
