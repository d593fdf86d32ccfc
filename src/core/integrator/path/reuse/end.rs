//! The end of a shared path.

use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin};
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::math::Vec3;

/// The second vertex `y` of a path, at which the paths of a group meet.
///
/// Any of the paths might have found the point, and gone on from it in direction `w`. By the balance heuristic over all of them (Veach 1997, §9.2.2),
/// light `L` that arrives from `w` counts in the pixel whose first vertex is `xᵢ` as
///
/// ```text
/// f(xᵢ→y) |cos θᵢ| G(xᵢ, y) f_y(w → xᵢ) |cos θ_w| L / (S p̄(w)),
/// S = Σₖ pdfₖ(xₖ→y) G(xₖ, y),    p̄(w) = Σₖ pdfₖ(xₖ→y) G(xₖ, y) pdf_y(xₖ→w) / S,    G(x, y) = V(x, y) |cos θ_y| / |x − y|²
/// ```
///
/// which is never more than what the pixel's own path gives. `S` is the density of ends at `y`, and `p̄` that of directions there: the end scatters as the
/// mean of its viewers would. Where lights are sampled at `y`, their density stands in place of `p̄`, and the two are weighed against each other as at
/// any other vertex. Light that is emitted at `y`, and light that arrives by a delta lobe, stays with the path that found it.
///
/// A first vertex finds `y` by a connection only if both of its normals put `y` on the same side.
/// Beyond the horizon of one normal, a ray can hit the surface that it has left. No other vertex can
/// connect to that point: such an end belongs to its owner alone, and counts as without reuse. The pair
/// of points alone decides if `y` is shared, not the path that found it, so the densities of the other
/// vertices are right.
pub(super) struct End<'v> {
    /// The vertex as its owner, the path that found it, sees it.
    pub(super) vertex: Vertex<'v>,
    /// Scattering events before the vertex.
    pub(super) depth: u32,
    /// Throughput of the owner at the vertex, and its factor in roulette.
    pub(super) beta: Spectrum,
    pub(super) roulette_scale: Spectrum,
    /// The point, clear of its surface.
    pub(super) p: Vec3,
    /// Unit geometric normal on the side that light leaves.
    pub(super) n: Vec3,
    /// The point where the shading normal is another one: from where it would be bent, the end is another surface.
    pub(super) curved: Option<SurfacePoint>,
}

impl<'v> End<'v> {
    /// Whether light scattered at `vertex` is shared. Where all lobes are narrow, light that one viewer sees is black for the others.
    pub fn can_be(vertex: &Vertex) -> bool {
        !vertex.is_bent && vertex.bsdf.is_wide()
    }

    /// The end at `vertex`, which `path` has found.
    pub fn new(vertex: Vertex<'v>, path: &PathState) -> Self {
        let point = vertex.point;
        let n = point.ng * 1f32.copysign(vertex.wo.z);
        Self {
            p: offset_origin(&point, n),
            n,
            curved: point.is_curved().then_some(point),
            depth: path.depth,
            beta: path.beta,
            roulette_scale: path.roulette_scale,
            vertex,
        }
    }
}
