//! The end of a shared path: the vertex to which all pixels of a group connect.

use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin};
use crate::integrator::path::state::PathState;
use crate::integrator::vertex::Vertex;
use crate::math::Vec3;

/// The second vertex `y` of a path, which is shared by all pixels of a group.
///
/// Any path of the group might have found the point `y`, and continued from it in direction `w`.
/// The estimate uses the balance heuristic over all these paths (Veach 1997, §9.2.2). Light `L`
/// that arrives from `w` adds the following radiance to the pixel whose first vertex is `xᵢ`:
///
/// ```text
/// f(xᵢ→y) |cos θᵢ| G(xᵢ, y) f_y(w → xᵢ) |cos θ_w| L / (S p̄(w)),
/// S = Σₖ pdfₖ(xₖ→y) G(xₖ, y),    p̄(w) = Σₖ pdfₖ(xₖ→y) G(xₖ, y) pdf_y(xₖ→w) / S,
/// G(x, y) = V(x, y) |cos θ_y| / |x − y|²
/// ```
///
/// This radiance is never more than the light that the pixel's own path would add. `S` is the
/// density of ends at `y`. `p̄` is the density of directions at `y`: the mean over its viewers,
/// which are the first vertices that see `y`. If lights are sampled at `y`, the density of the
/// light sample replaces `p̄`, and the two strategies are weighted as at any other vertex. Light
/// that is emitted at `y`, and light that arrives by a delta lobe, is added only to the pixel whose
/// path found it.
///
/// A first vertex can connect to `y` only if `y` is on the same side of the shading normal and of
/// the geometric normal of the first vertex. A ray below the horizon of one normal can hit the
/// surface that it leaves, and no other vertex can connect to that point. Such an end is used only
/// by the path that found it, as without reuse. Whether a first vertex shares `y` depends only on
/// these two points, and not on the path that found `y`. So the densities of the other vertices are
/// right.
pub(super) struct End<'v> {
    /// The vertex, seen from the first vertex of its owner. The owner is the path that found the
    /// end.
    pub(super) vertex: Vertex<'v>,
    /// Number of scattering events before the vertex.
    pub(super) depth: u32,
    /// Throughput of the owner at the vertex, and the factor by which roulette multiplies this
    /// throughput.
    pub(super) beta: Spectrum,
    pub(super) roulette_scale: Spectrum,
    /// Position of the end, offset from the surface: end point of connections.
    pub(super) p: Vec3,
    /// Unit geometric normal on the side of the viewers.
    pub(super) n: Vec3,
    /// Surface point, if its shading normal differs from the geometric normal. A viewer for which
    /// this normal would be bent does not connect, because the surface at this point would be
    /// different for this viewer.
    pub(super) curved: Option<SurfacePoint>,
}

impl<'v> End<'v> {
    /// Returns `true` if `vertex` can be the end of a shared path. If all lobes are narrow, light
    /// that is scattered to one viewer is black for the others.
    pub fn can_be(vertex: &Vertex) -> bool {
        !vertex.is_bent && vertex.bsdf.is_wide()
    }

    /// The end at `vertex`, which `path` found.
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
