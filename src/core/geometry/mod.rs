//! Triangles: mesh arrays, names of parts, typed ids, hits, surface points and ray origins;
//! subdivision surfaces of control meshes.
//!
//! This module does not depend on materials or ray-tracing backends. It computes points and normals
//! from the hits of any backend, so they are the same with all backends.

mod hit;
mod mesh;
mod part_names;
mod placement;
mod spawn;
mod subdivision;

pub use hit::{GeomId, Hit, InstanceId, PrimId, crossing};
pub use mesh::{Facet, Mesh, SurfacePoint, corners_at, retain_triangles, triangle_area, triangle_normal};
pub use part_names::{PartList, PartNames, UNNAMED};
pub use placement::{PlacedTriangle, Placement, rounding};
pub use spawn::{Side, offset_origin, offset_to, ray_between, ray_towards, segment};
pub use subdivision::{ControlMesh, IrregularEdges, MAX_STEPS, Scheme, SubdividedMesh};
