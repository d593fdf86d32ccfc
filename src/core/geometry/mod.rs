//! Triangles: mesh arrays, names of parts, typed ids, hits, surface points and the ray origins that
//! leave them; surfaces that a mesh is the control mesh of.
//!
//! Independent of materials and ray-tracing backends: hits of any backend are turned into points and normals here,
//! so backends cannot disagree on them.

mod hit;
mod mesh;
mod part_names;
mod placement;
mod spawn;
mod subdivision;

pub use hit::{GeomId, Hit, InstanceId, PrimId, crossing};
pub use mesh::{Facet, Mesh, SurfacePoint, corners_at, retain_triangles, triangle_area, triangle_normal};
pub use part_names::{PartNames, UNNAMED};
pub use placement::{PlacedTriangle, Placement, rounding};
pub use spawn::{Side, offset_origin, offset_to, ray_between, ray_towards, segment};
pub use subdivision::{ControlMesh, Irregular, MAX_STEPS, Scheme, Subdivided};
