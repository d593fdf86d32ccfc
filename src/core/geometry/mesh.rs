//! Meshes, facets and surface points. If a mesh has vertex normals, the shading normal at a point
//! differs from the geometric normal of the facet.
//!
//! A difference between the two normals has three consequences:
//!
//! - A viewer may see the back of the shading normal on the front of the facet, which gives black
//!   rims. `SurfacePoint::seen_from` bends the shading normal until the mirror direction is in
//!   front of the facet (Keller et al. 2017).
//! - Facets would cast shadows on each other at grazing angles (the shadow terminator problem).
//!   This happens to directions that are in front of the surface by one normal and behind it by the
//!   other. A ray in such a direction starts at the height of the curved surface, along the
//!   geometric normal (Hanika 2021).
//! - For the same directions, the BSDF uses the shading normal, and the ray starts on the side of
//!   the surface that the shading normal gives. Geometry in the way of this ray, such as the wall
//!   itself, blocks the ray. The usual method against leaks rejects these directions. That method
//!   left whole facets black at the terminator of a coarse sphere
//!   (`tests/it/materials/surfaces.rs`).
//!
//! Each triangle in world space stores its normal and its part of the ray offset, a `Facet` of 16
//! bytes. Emitting triangles store one ray offset for all their points. Both together save 7 % of
//! the time of a render (docs/notebook/2026-11.md, "Single steps").

use super::{PrimId, UNNAMED};
use crate::color::Spectrum;
use crate::math::{Affine3A, Encode, Vec2, Vec3, Vec4, float::gamma};
use half::f16;

/// Indexed triangles, counter-clockwise seen from the front. They are in world space, or in the
/// object space of instances.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normal of each vertex; empty if the mesh is flat.
    pub normals: Vec<Vec3>,
    /// Texture coordinates of each vertex, v upwards; empty if there are none.
    pub uvs: Vec<Vec2>,
    /// Colour of each vertex, linear Rec.709 from 0 to 1. It multiplies the diffuse or base colour
    /// of the material. Empty if there are none.
    pub colors: Vec<[f16; 3]>,
    /// Opacity of each vertex, 0 to 1. It multiplies the opacity of the material. Empty if there
    /// are none.
    pub alphas: Vec<f16>,
    /// Vertex positions at time 1, with linear motion from time 0; empty if the mesh does not
    /// deform.
    pub positions_close: Vec<Vec3>,
    /// Shading normals at time 1; empty if there are none, or if the mesh does not deform.
    pub normals_close: Vec<Vec3>,
    /// Part of each triangle: the number of the part in the scene's
    /// [`PartNames`](super::PartNames). If all triangles belong to the same part, the list has a
    /// single number. It is empty if no part has a name. Parts do not affect the picture.
    pub parts: Vec<u32>,
    /// True if rays that arrive at the back of a triangle pass it without a hit.
    pub is_front_only: bool,
}

impl Encode for Mesh {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        let Self {
            positions,
            triangles,
            normals,
            uvs,
            colors,
            alphas,
            positions_close,
            normals_close,
            parts: _,
            is_front_only,
        } = self;
        positions.encode(sink);
        triangles.encode(sink);
        normals.encode(sink);
        uvs.encode(sink);
        colors.encode(sink);
        alphas.encode(sink);
        positions_close.encode(sink);
        normals_close.encode(sink);
        // Other meshes have the code that they had before this field existed.
        if *is_front_only {
            is_front_only.encode(sink);
        }
    }
}

/// A point on a surface, with all geometry that shading needs.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position in world space.
    pub p: Vec3,
    /// Time of this position.
    pub time: f32,
    /// Ray offset from `p` along the normal: a bound on rounding errors.
    pub ray_offset: f32,
    /// Height of the curved surface over the triangle, on the front and on the back. For rays whose
    /// direction is on different sides of `ng` and `ns`, this height is added to `ray_offset`.
    pub curvature_offset: [f32; 2],
    /// Unit geometric normal, on the side from which the corners run counter-clockwise.
    pub ng: Vec3,
    /// Unit shading normal, on the side of `ng`.
    pub ns: Vec3,
}

impl Mesh {
    /// Corners of triangle `prim`.
    pub fn corners(&self, prim: PrimId) -> [Vec3; 3] {
        self.triangles[prim.0 as usize].map(|i| self.positions[i as usize])
    }

    /// The mesh under a transform. Mirroring transforms swap the winding, so that the front stays
    /// the front.
    pub fn transformed(&self, transform: Affine3A) -> Self {
        let is_mirrored = transform.matrix3.determinant() < 0.0;
        // Normals transform by the inverse transpose.
        let of_normals = transform.matrix3.inverse().transpose();
        let point = |&p: &Vec3| transform.transform_point3a(p);
        let normal = |&n: &Vec3| (of_normals * n).normalize_or(n);
        Self {
            positions: self.positions.iter().map(point).collect(),
            triangles: if is_mirrored {
                self.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect()
            } else {
                self.triangles.clone()
            },
            normals: self.normals.iter().map(normal).collect(),
            uvs: self.uvs.clone(),
            colors: self.colors.clone(),
            alphas: self.alphas.clone(),
            positions_close: self.positions_close.iter().map(point).collect(),
            normals_close: self.normals_close.iter().map(normal).collect(),
            parts: self.parts.clone(),
            is_front_only: self.is_front_only,
        }
    }

    /// Mesh of `triangles`, whose vertices are vertices of this mesh, without unused vertices.
    /// `parts` has the parts of the triangles, as in [`Mesh::parts`].
    pub fn with_triangles(&self, mut triangles: Vec<[u32; 3]>, parts: Vec<u32>) -> Self {
        const UNUSED: u32 = u32::MAX;
        let mut numbers = vec![UNUSED; self.positions.len()];
        let mut used = Vec::new();
        for vertex in triangles.iter_mut().flatten() {
            let number = &mut numbers[*vertex as usize];
            if *number == UNUSED {
                *number = used.len() as u32;
                used.push(*vertex as usize);
            }
            *vertex = *number;
        }
        fn pick<T: Copy>(values: &[T], used: &[usize]) -> Vec<T> {
            if values.is_empty() {
                return Vec::new();
            }
            used.iter().map(|&i| values[i]).collect()
        }
        Self {
            positions: pick(&self.positions, &used),
            normals: pick(&self.normals, &used),
            uvs: pick(&self.uvs, &used),
            colors: pick(&self.colors, &used),
            alphas: pick(&self.alphas, &used),
            positions_close: pick(&self.positions_close, &used),
            normals_close: pick(&self.normals_close, &used),
            triangles,
            parts,
            is_front_only: self.is_front_only,
        }
    }

    /// Returns true if the vertices move.
    pub fn deforms(&self) -> bool {
        !self.positions_close.is_empty()
    }

    /// Corners of triangle `prim` at `time`.
    pub fn corners_at(&self, prim: PrimId, time: f32) -> [Vec3; 3] {
        let open = self.corners(prim);
        if self.deforms() {
            corners_at(open, self.corners_at_close(prim), time)
        } else {
            open
        }
    }

    /// Corners at time 1 of triangle `prim` of a mesh that deforms.
    pub fn corners_at_close(&self, prim: PrimId) -> [Vec3; 3] {
        self.triangles[prim.0 as usize].map(|i| self.positions_close[i as usize])
    }

    /// Unit shading normals at the corners of triangle `prim` at `time`; `None` if the mesh is
    /// flat.
    pub fn normals_at(&self, prim: PrimId, time: f32) -> Option<[Vec3; 3]> {
        let normal = |i: u32| {
            let open = *self.normals.get(i as usize)?;
            let close = self.normals_close.get(i as usize).copied();
            Some(close.map_or(open, |close| open.lerp(close, time).try_normalize().unwrap_or(open)))
        };
        let [a, b, c] = self.triangles[prim.0 as usize];
        Some([normal(a)?, normal(b)?, normal(c)?])
    }

    /// Unit tangents along u and v of triangle `prim` with these corners. `None` if the triangle
    /// has no texture coordinates, or if the texture coordinates are degenerate.
    pub fn tangents(&self, prim: PrimId, [p0, p1, p2]: [Vec3; 3]) -> Option<[Vec3; 2]> {
        let [t0, t1, t2] = self.corner_uvs(prim)?;
        let ([e1, e2], [d1, d2]) = ([p1 - p0, p2 - p0], [t1 - t0, t2 - t0]);
        // Solve p = p₀ + u ∂p/∂u + v ∂p/∂v at the three corners. Only the directions of both
        // derivatives are needed
        let side = 1f32.copysign(d1.perp_dot(d2));
        let du = ((d2.y * e1 - d1.y * e2) * side).try_normalize()?;
        let dv = ((d1.x * e2 - d2.x * e1) * side).try_normalize()?;
        Some([du, dv])
    }

    /// Length in texture coordinates per length in space on triangle `prim` with these corners: the
    /// square root of the ratio of the areas. 0 if the triangle has no texture coordinates.
    pub fn uv_per_length(&self, prim: PrimId, [p0, p1, p2]: [Vec3; 3]) -> f32 {
        let Some([t0, t1, t2]) = self.corner_uvs(prim) else {
            return 0.0;
        };
        let ratio = (t1 - t0).perp_dot(t2 - t0).abs() / (p1 - p0).cross(p2 - p0).length();
        if ratio.is_finite() { ratio.sqrt() } else { 0.0 }
    }

    /// Bytes of all arrays.
    pub fn bytes(&self) -> usize {
        size_of_val(self.positions.as_slice())
            + size_of_val(self.triangles.as_slice())
            + size_of_val(self.normals.as_slice())
            + size_of_val(self.uvs.as_slice())
            + size_of_val(self.colors.as_slice())
            + size_of_val(self.alphas.as_slice())
            + size_of_val(self.positions_close.as_slice())
            + size_of_val(self.normals_close.as_slice())
            + size_of_val(self.parts.as_slice())
    }

    /// Part of triangle `prim`.
    pub fn part(&self, prim: PrimId) -> u32 {
        let part = self.parts.get(prim.0 as usize).or(self.parts.first());
        part.copied().unwrap_or(UNNAMED)
    }

    /// Sets the part of each triangle.
    pub fn set_parts(&mut self, parts: Vec<u32>) {
        self.parts = match parts.as_slice() {
            [first, others @ ..] if others.iter().all(|part| part == first) => {
                Some(*first).filter(|&part| part != UNNAMED).into_iter().collect()
            }
            _ => parts,
        };
    }

    /// Facet of triangle `prim`, which all points of the triangle share.
    pub fn facet(&self, prim: PrimId) -> Facet {
        Facet::new(self.corners(prim))
    }

    /// Point of triangle `prim` at the barycentric coordinates `b1`, `b2` of its second and third
    /// corner.
    pub fn surface_point(&self, prim: PrimId, b1: f32, b2: f32) -> SurfacePoint {
        self.surface_point_on(self.facet(prim), prim, b1, b2)
    }

    /// [`Self::surface_point`] with the triangle's facet.
    #[inline(always)]
    pub fn surface_point_on(&self, facet: Facet, prim: PrimId, b1: f32, b2: f32) -> SurfacePoint {
        let corners = self.corners(prim);
        let point = SurfacePoint::new(corners, facet, b1, b2);
        if self.normals.is_empty() {
            return point;
        }
        let normals = self.triangles[prim.0 as usize].map(|i| self.normals[i as usize]);
        point.curved(corners, normals, [1.0 - b1 - b2, b1, b2])
    }

    /// Texture coordinates at barycentric coordinates `b1`, `b2`; `None` if the mesh has none.
    pub fn uv(&self, prim: PrimId, b1: f32, b2: f32) -> Option<Vec2> {
        let [t0, t1, t2] = self.corner_uvs(prim)?;
        Some((1.0 - b1 - b2) * t0 + b1 * t1 + b2 * t2)
    }

    /// Interpolated colour at barycentric coordinates `b1`, `b2`; 1 if the mesh has no colours.
    pub fn color(&self, prim: PrimId, b1: f32, b2: f32) -> Spectrum {
        if self.colors.is_empty() {
            return Spectrum::ONE;
        }
        let [a, b, c] = self.triangles[prim.0 as usize].map(|i| {
            let color = self.colors.get(i as usize).copied().unwrap_or([f16::ONE; 3]);
            Spectrum::from(color.map(f16::to_f32))
        });
        a * (1.0 - b1 - b2) + b * b1 + c * b2
    }

    /// Interpolated opacity at barycentric coordinates `b1`, `b2`; 1 if the mesh has no opacities.
    pub fn alpha(&self, prim: PrimId, b1: f32, b2: f32) -> f32 {
        if self.alphas.is_empty() {
            return 1.0;
        }
        let [a, b, c] = self.corner_alphas(prim);
        (1.0 - b1 - b2) * a + b1 * b + b2 * c
    }

    /// Opacities of the corners of triangle `prim`; 1 if the mesh has no opacities.
    pub fn corner_alphas(&self, prim: PrimId) -> [f32; 3] {
        let alpha = |i: u32| self.alphas.get(i as usize).map_or(1.0, |alpha| alpha.to_f32());
        self.triangles[prim.0 as usize].map(alpha)
    }

    /// Texture coordinates of the corners of triangle `prim`.
    pub fn corner_uvs(&self, prim: PrimId) -> Option<[Vec2; 3]> {
        let uv = |i: u32| self.uvs.get(i as usize).copied();
        let [a, b, c] = self.triangles[prim.0 as usize];
        Some([uv(a)?, uv(b)?, uv(c)?])
    }
}

/// Keeps the triangles for which `keeps` returns true, and their entries of `parts`
/// ([`Mesh::parts`]).
pub fn retain_triangles(triangles: &mut Vec<[u32; 3]>, parts: &mut Vec<u32>, mut keeps: impl FnMut(&[u32; 3]) -> bool) {
    if parts.len() < triangles.len() {
        triangles.retain(keeps);
        return;
    }
    let mut kept = 0;
    for i in 0..triangles.len() {
        if keeps(&triangles[i]) {
            // Usually all triangles are kept, and nothing is written
            if kept < i {
                (triangles[kept], parts[kept]) = (triangles[i], parts[i]);
            }
            kept += 1;
        }
    }
    triangles.truncate(kept);
    parts.truncate(kept);
}

/// Unit geometric normal and ray offset of a triangle, which all points of the triangle share.
#[derive(Clone, Copy, Debug)]
pub struct Facet(Vec4);

impl Facet {
    /// Facet of the triangle with these corners.
    ///
    /// The ray offset is a bound on the error of an intersector. An intersector subtracts the ray's
    /// origin from the corners. The results, which are as large as the longest edge E, are rounded,
    /// and this moves the plane. In narrow triangles, the error is larger by the ratio of E to the
    /// width, which is E² / (2 · area). On a plane through the origin, this is the only error.
    /// Without the offset, an intersector would hit the surface again. For very narrow triangles
    /// (slivers), the offset is at most half the width, so that rays do not skip geometry beside
    /// them.
    pub fn new([p0, p1, p2]: [Vec3; 3]) -> Self {
        let extent = (p1 - p0).abs().max((p2 - p0).abs()).max_element();
        let longest = [p1 - p0, p2 - p1, p0 - p2]
            .map(Vec3::length)
            .into_iter()
            .fold(0.0, f32::max);
        let width = (2.0 * triangle_area(p0, p1, p2) / longest as f64) as f32;
        let rounding = gamma(6) * extent;
        let ray_offset = rounding.max((rounding * (longest / width)).min(0.5 * width));
        Self(triangle_normal(p0, p1, p2).extend(ray_offset))
    }

    /// Unit geometric normal, on the side from which the corners run counter-clockwise.
    #[inline(always)]
    pub fn normal(self) -> Vec3 {
        Vec3::from_vec4(self.0)
    }

    /// Bound on the distance between the plane and a hit of an intersector.
    #[inline(always)]
    fn ray_offset(self) -> f32 {
        self.0.w
    }
}

impl SurfacePoint {
    /// Point at barycentric coordinates `b1`, `b2` of a flat triangle.
    ///
    /// With rounding errors, `p` lies in a box around the true point. The half-width of the box is
    /// `γ₇ Σ |bᵢ pᵢ|` (PBR4 eq. 6.25), plus two more roundings for the move off the surface. The
    /// offset along the normal `n` that leaves the box is the `|n|`-weighted sum of the
    /// half-widths. The ray offset of the facet is added to this offset.
    #[inline(always)]
    pub fn new([p0, p1, p2]: [Vec3; 3], facet: Facet, b1: f32, b2: f32) -> Self {
        let (t0, t1, t2) = ((1.0 - b1 - b2) * p0, b1 * p1, b2 * p2);
        let magnitude = t0.abs() + t1.abs() + t2.abs();
        let ng = facet.normal();
        Self {
            p: t0 + t1 + t2,
            time: 0.0,
            // The components of a unit vector sum to at most √3.
            ray_offset: gamma(9) * ng.abs().dot(magnitude) + facet.ray_offset(),
            curvature_offset: [0.0; 2],
            ng,
            ns: ng,
        }
    }

    /// Returns this point with the shading normal and the height of a curved surface. The triangle
    /// is a facet of this surface, with the unit normals `normals` at the corners. `b` are the
    /// barycentric weights of the corners.
    ///
    /// The shading normal is interpolated. Rays start at the height of the curved surface over the
    /// facet, if the curved surface bulges to the side of the rays. Without this, the edges of
    /// facets would be visible at grazing angles. The height follows Hanika 2021, "Hacking the
    /// Shadow Terminator", eq. 1: the point is projected onto the tangent plane at each corner, and
    /// the heights of the projections are interpolated. Tangent planes in front of the point and
    /// tangent planes behind the point are summed separately.
    #[inline(never)]
    pub(super) fn curved(self, corners: [Vec3; 3], normals: [Vec3; 3], b: [f32; 3]) -> Self {
        let mut ns = Vec3::ZERO;
        let mut curvature_offset = [0.0; 2];
        for i in 0..3 {
            // Flip vertex normals that are not on the side of the geometric normal.
            let n = normals[i] * 1f32.copysign(normals[i].dot(self.ng));
            ns += b[i] * n;
            let height = (corners[i] - self.p).dot(n);
            curvature_offset[usize::from(height < 0.0)] += b[i] * height.abs() * n.dot(self.ng);
        }
        Self {
            ns: ns.try_normalize().unwrap_or(self.ng),
            curvature_offset,
            ..self
        }
    }

    /// Returns this point with the shading normal of a bump or normal map. `bumped` is this normal
    /// in the frame of the two unit tangents `du` and `dv` and of the current shading normal.
    pub fn with_bumps(self, [du, dv]: [Vec3; 2], bumped: Vec3) -> Self {
        // Project the tangents onto the plane perpendicular to the shading normal
        let onto = |t: Vec3| (t - self.ns * t.dot(self.ns)).try_normalize().unwrap_or(Vec3::ZERO);
        let n = bumped.x * onto(du) + bumped.y * onto(dv) + bumped.z * self.ns;
        let ns = n.try_normalize().filter(|n| n.dot(self.ng) > 0.0);
        Self {
            ns: ns.unwrap_or(self.ns),
            ..self
        }
    }

    /// Returns true if the shading normal differs from the geometric normal.
    pub fn is_curved(&self) -> bool {
        self.ns != self.ng
    }

    /// Factor that corrects a BSDF's value along a path from a light, which arrives from the unit
    /// direction `wo` and continues in `wi`: `|wo·ns| |wi·ng| / (|wo·ng| |wi·ns|)`. If the shading
    /// normal differs from the geometric normal, a BSDF is not symmetric. Without the factor, the
    /// picture of paths from lights would differ from the picture of paths from the camera (Veach
    /// 1997, §5.3). The factor is 0 if a direction lies in the surface.
    pub fn adjoint_factor(&self, wo: Vec3, wi: Vec3) -> f32 {
        let [o, i] = [wo, wi].map(|w| w.dot(self.ns).abs() / w.dot(self.ng).abs());
        let factor = o / i;
        if factor.is_finite() { factor } else { 0.0 }
    }

    /// Returns true if [`SurfacePoint::seen_from`] bends the shading normal for the unit direction
    /// `wo` to the viewer.
    pub fn bends_for(&self, wo: Vec3) -> bool {
        // Height of the mirror direction, on the side of `wo`
        let height = (2.0 * wo.dot(self.ns) * self.ns - wo).dot(self.ng);
        height * 1f32.copysign(wo.dot(self.ng)) < MIN_HEIGHT
    }

    /// Returns this point with a shading normal that is bent so that the mirror direction of `wo`
    /// is in front of the facet. The bend is as small as possible. `wo` is the unit direction to
    /// the viewer. Without the bend, curved objects have black rims (Keller et al. 2017, "The Iray
    /// Light Transport Simulation and Rendering System", appendix A.3: the mirror direction is
    /// moved to the horizon).
    pub fn seen_from(self, wo: Vec3) -> Self {
        if !self.bends_for(wo) {
            return self;
        }
        let side = 1f32.copysign(wo.dot(self.ng));
        let (ng, ns) = (self.ng * side, self.ns * side);
        let mirrored = 2.0 * wo.dot(ns) * ns - wo;
        let at_horizon = mirrored + (MIN_HEIGHT - mirrored.dot(ng)) * ng;
        let bent = at_horizon.try_normalize().and_then(|r| (wo + r).try_normalize());
        Self {
            ns: bent.map_or(self.ng, |n| n * side),
            ..self
        }
    }
}

/// Minimum sine of the angle between a mirror direction and the facet. It is larger than the
/// rounding errors of a few unit vectors.
const MIN_HEIGHT: f32 = 1e-4;

/// Corners at `time` of a triangle that moves linearly from `open` at time 0 to `close` at time 1.
pub fn corners_at(open: [Vec3; 3], close: [Vec3; 3], time: f32) -> [Vec3; 3] {
    [0, 1, 2].map(|i| (1.0 - time) * open[i] + time * close[i])
}

/// Unit normal of the triangle by its winding; zero only if the triangle has no area.
pub fn triangle_normal(p0: Vec3, p1: Vec3, p2: Vec3) -> Vec3 {
    let n = (p1 - p0).cross(p2 - p0);
    let squared = n.length_squared();
    // In f32, the cross product is accurate except near the ends of the range of f32. There, f64 is
    // used.
    if (1e-30..1e30).contains(&squared) {
        n * (1.0 / squared.sqrt())
    } else {
        let [p0, p1, p2] = [p0, p1, p2].map(Vec3::as_dvec3);
        (p1 - p0).cross(p2 - p0).normalize_or_zero().as_vec3a()
    }
}

/// Area of the triangle, in f64 so that tiny and huge triangles are accurate.
pub fn triangle_area(p0: Vec3, p1: Vec3, p2: Vec3) -> f64 {
    let [p0, p1, p2] = [p0, p1, p2].map(Vec3::as_dvec3);
    0.5 * (p1 - p0).cross(p2 - p0).length()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normals_are_accurate_at_every_scale() {
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
    fn surface_points_are_nearer_to_the_plane_than_their_ray_offset() {
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
            assert!(off < s.ray_offset as f64, "{off} against {}", s.ray_offset);
            assert!(s.ray_offset < 2e-4, "{}", s.ray_offset);
        }
    }
}
