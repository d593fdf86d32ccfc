use super::PrimId;
use crate::math::{Vec2, Vec3, Vec4, float::gamma};

/// Indexed triangles in world space, counter-clockwise seen from the front.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normal of each vertex; empty where the mesh is flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each vertex, v upwards; empty where there are none.
    pub uvs: Vec<Vec2>,
}

/// A point on a surface, with all that shading needs of the geometry.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position in world space.
    pub p: Vec3,
    /// How far along the normal a ray must start from `p` to clear the surface: a bound on rounding errors.
    pub clearance: f32,
    /// Unit geometric normal, by the winding.
    pub ng: Vec3,
    /// Unit shading normal, on the side of `ng`.
    pub ns: Vec3,
}

impl Mesh {
    /// Corners of triangle `prim`.
    pub fn corners(&self, prim: PrimId) -> [Vec3; 3] {
        self.triangles[prim.0 as usize].map(|i| self.positions[i as usize])
    }

    /// What all points of triangle `prim` share.
    pub fn facet(&self, prim: PrimId) -> Facet {
        Facet::new(self.corners(prim))
    }

    /// The point of triangle `prim` at barycentric coordinates `b1`, `b2` of its second and third corner.
    pub fn surface_point(&self, prim: PrimId, b1: f32, b2: f32) -> SurfacePoint {
        SurfacePoint::new(self.corners(prim), self.facet(prim), b1, b2)
    }
}

/// What all points of a triangle share.
#[derive(Clone, Copy, Debug)]
pub struct Facet(Vec4);

impl Facet {
    /// Of the triangle with these corners.
    ///
    /// An intersector that tests the triangle later subtracts the ray's origin from the corners and rounds edges as long as the
    /// triangle: some roundings of its longest edge E move its plane, the more so the narrower it is, by E² over twice
    /// the area. This does not vanish on a plane through the origin, where an intersector would find the surface again.
    /// Slivers are given no more than half their width, lest rays skip what is beside them.
    pub fn new([p0, p1, p2]: [Vec3; 3]) -> Self {
        let extent = (p1 - p0).abs().max((p2 - p0).abs()).max_element();
        let longest = [p1 - p0, p2 - p1, p0 - p2]
            .map(Vec3::length)
            .into_iter()
            .fold(0.0, f32::max);
        let width = (2.0 * triangle_area(p0, p1, p2) / longest as f64) as f32;
        let rounding = gamma(6) * extent;
        let clearance = rounding.max((rounding * (longest / width)).min(0.5 * width));
        Self(triangle_normal(p0, p1, p2).extend(clearance))
    }

    /// Unit geometric normal, by the winding.
    #[inline(always)]
    pub fn normal(self) -> Vec3 {
        Vec3::from_vec4(self.0)
    }

    /// How far from a point of the plane an intersector may find the triangle.
    #[inline(always)]
    fn clearance(self) -> f32 {
        self.0.w
    }
}

impl SurfacePoint {
    /// The point at barycentric coordinates `b1`, `b2` of a flat triangle.
    ///
    /// Rounding puts `p` into a box around the true point; its half-width is `γ₇ Σ |bᵢ pᵢ|` (PBR4 eq. 6.25) and two more
    /// roundings for the move off the surface. A plane of normal `n` clears it by the half-width's `|n|`-weighted sum, to which
    /// the facet's own clearance is added.
    #[inline(always)]
    pub fn new([p0, p1, p2]: [Vec3; 3], facet: Facet, b1: f32, b2: f32) -> Self {
        let (t0, t1, t2) = ((1.0 - b1 - b2) * p0, b1 * p1, b2 * p2);
        let magnitude = t0.abs() + t1.abs() + t2.abs();
        let ng = facet.normal();
        Self {
            p: t0 + t1 + t2,
            // The components of a unit vector sum to √3 at most.
            clearance: gamma(9) * ng.abs().dot(magnitude) + facet.clearance(),
            ng,
            ns: ng,
        }
    }
}

/// Unit normal of the triangle by its winding; zero only where the triangle has no area at all.
pub fn triangle_normal(p0: Vec3, p1: Vec3, p2: Vec3) -> Vec3 {
    let n = (p1 - p0).cross(p2 - p0);
    let squared = n.length_squared();
    // Away from the ends of f32's range the product keeps its precision; elsewhere f64 does.
    if (1e-30..1e30).contains(&squared) {
        n * (1.0 / squared.sqrt())
    } else {
        let [p0, p1, p2] = [p0, p1, p2].map(Vec3::as_dvec3);
        (p1 - p0).cross(p2 - p0).normalize_or_zero().as_vec3a()
    }
}

/// Area of the triangle, in f64 so that tiny and huge ones keep theirs.
pub fn triangle_area(p0: Vec3, p1: Vec3, p2: Vec3) -> f64 {
    let [p0, p1, p2] = [p0, p1, p2].map(Vec3::as_dvec3);
    0.5 * (p1 - p0).cross(p2 - p0).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_hold_at_every_scale() {
        let n = Vec3::new(1.0, 2.0, 3.0).normalize();
        let frame = crate::math::Frame::from_z(n);
        for exponent in -18..=18 {
            let s = 10f32.powi(exponent);
            let corners = [Vec3::ZERO, Vec3::X, Vec3::new(0.3, 0.9, 0.0)].map(|p| frame.to_world(p) * s);
            let [p0, p1, p2] = corners;
            let got = triangle_normal(p0, p1, p2);
            assert!(got.distance(n) < 1e-5, "scale {s}: {got}");
            let area = triangle_area(p0, p1, p2) / (s as f64).powi(2);
            assert!((area - 0.45).abs() < 1e-5, "scale {s}: {area}");
        }
    }

    #[test]
    fn surface_points_are_nearer_to_the_plane_than_their_clearance() {
        let mesh = Mesh {
            positions: vec![
                Vec3::new(-3.1, 100.7, 2.3),
                Vec3::new(4.2, 101.3, -0.7),
                Vec3::new(0.9, 99.1, 5.5),
            ],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let d: Vec<_> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        let normal = (d[1] - d[0]).cross(d[2] - d[0]).normalize();
        for (b1, b2) in [(0.0f32, 0.0f32), (0.3, 0.6), (0.123_456_7, 0.2), (1.0, 0.0)] {
            let s = mesh.surface_point(PrimId(0), b1, b2);
            let off = (s.p.as_dvec3() - d[0]).dot(normal).abs();
            assert!(off < s.clearance as f64, "{off} against {}", s.clearance);
            assert!(s.clearance < 2e-4, "{}", s.clearance);
        }
    }
}
