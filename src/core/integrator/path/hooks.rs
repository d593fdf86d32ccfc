//! Hooks by which path reuse learns of the vertices of a path. The path tracer knows nothing else of path reuse.

use super::state::PathState;
use crate::bsdf::ScatteringEvent;
use crate::integrator::vertex::Vertex;

/// Hooks of path reuse into `PathIntegrator::li`.
pub(crate) trait Reuse<'v> {
    /// Whether paths may end where others share what is scattered.
    const ENDS_PATHS: bool;

    /// Takes note of a vertex that `path` meets after `depth` scatterings. `events` are those on the way, where paths are distinguished.
    #[inline(always)]
    fn meet(
        &mut self,
        _depth: u32,
        _vertex: &Vertex<'v>,
        _path: &PathState,
        _events: impl FnOnce() -> Vec<ScatteringEvent>,
    ) {
    }

    /// Whether the path ends at the vertex that was met last, because others share what is scattered there.
    #[inline(always)]
    fn ends_path(&self) -> bool {
        false
    }

    /// Whether roulette may end the path at the vertex that was met last.
    #[inline(always)]
    fn allows_roulette(&self) -> bool {
        true
    }
}

/// No path reuse: each path serves its own pixel.
pub(crate) struct NoReuse;

impl Reuse<'_> for NoReuse {
    const ENDS_PATHS: bool = false;
}
