/// A mesh of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct GeomId(pub u32);

/// A triangle of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PrimId(pub u32);

/// An instance of a mesh; [`InstanceId::NONE`] for geometry that stands in the scene itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InstanceId(pub u32);

impl InstanceId {
    /// Not instanced.
    pub const NONE: Self = Self(u32::MAX);
}

/// All that a backend may say of an intersection.
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
    /// Triangle within its mesh.
    pub prim: PrimId,
    /// Mesh within the scene.
    pub geom: GeomId,
    /// Instance that was hit.
    pub inst: InstanceId,
}

impl Hit {
    /// Whether `other` is a hit of the same triangle in the same instance.
    pub fn is_same_surface(&self, other: &Self) -> bool {
        (self.prim, self.geom, self.inst) == (other.prim, other.geom, other.inst)
    }
}
