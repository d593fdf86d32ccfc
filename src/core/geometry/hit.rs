use crate::math::{DVec3, Ray};

/// Index of a mesh of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GeomId(pub u32);

/// Index of a triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PrimId(pub u32);

/// Index of an instance of the scene; [`InstanceId::NONE`] for geometry that is not instanced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InstanceId(pub u32);

impl InstanceId {
    /// Id of geometry that is not instanced.
    pub const NONE: Self = Self(u32::MAX);
}

/// Intersection of a ray with the scene, as returned by every backend.
///
/// The point is `(1 − b1 − b2) p0 + b1 p1 + b2 p2` of the triangle's vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in lengths of the ray's direction.
    pub t: f32,
    /// Barycentric coordinate of the triangle's second vertex.
    pub b1: f32,
    /// Barycentric coordinate of the triangle's third vertex.
    pub b2: f32,
    /// Triangle in its mesh.
    pub prim: PrimId,
    /// Mesh in the scene.
    pub geom: GeomId,
    /// Instance that was hit.
    pub inst: InstanceId,
}

impl Hit {
    /// A hit at the first corner of a triangle, at the ray parameter 0.
    pub fn at_corner(geom: GeomId, prim: PrimId, inst: InstanceId) -> Self {
        Self {
            t: 0.0,
            b1: 0.0,
            b2: 0.0,
            prim,
            geom,
            inst,
        }
    }

    /// Returns true if `other` hits the same triangle of the same instance.
    pub fn is_same_surface(&self, other: &Self) -> bool {
        (self.prim, self.geom, self.inst) == (other.prim, other.geom, other.inst)
    }
}

/// Crossing of `ray` and the plane of a triangle, in f64 (Möller and Trumbore 1997). Returns the
/// ray parameter, and the barycentrics of the second and third corner. `None` if the ray is
/// parallel to the plane.
pub fn crossing(ray: &Ray, [p0, p1, p2]: [DVec3; 3]) -> Option<(f64, f64, f64)> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (e1, e2, s) = (p1 - p0, p2 - p0, origin - p0);
    let (h, q) = (direction.cross(e2), s.cross(e1));
    let determinant = e1.dot(h);
    if determinant == 0.0 {
        return None;
    }
    Some((
        e2.dot(q) / determinant,
        s.dot(h) / determinant,
        direction.dot(q) / determinant,
    ))
}
