//! Triangles as leaves of a hierarchy, and the watertight ray-triangle test.

use super::tree::Leaf;
use crate::geometry::{GeomId, PrimId, corners_at};
use crate::math::{Bounds3, DVec3, Ray, Vec3, Vec3Swizzles, float::gamma};

/// A triangle, transposed for SIMD: for each axis, the coordinates of the three corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleLeaf {
    coordinates: [Vec3; 3],
    pub geom: GeomId,
    pub prim: PrimId,
}

impl TriangleLeaf {
    pub fn new([a, b, c]: [Vec3; 3], geom: GeomId, prim: PrimId) -> Self {
        Self {
            coordinates: [0, 1, 2].map(|axis| Vec3::new(a[axis], b[axis], c[axis])),
            geom,
            prim,
        }
    }

    pub fn corners(&self) -> [Vec3; 3] {
        let [x, y, z] = self.coordinates;
        [0, 1, 2].map(|corner| Vec3::new(x[corner], y[corner], z[corner]))
    }
}

impl Leaf for TriangleLeaf {
    fn bounds(&self) -> Bounds3 {
        self.corners().into_iter().collect()
    }
}

/// A triangle whose corners move linearly from time 0 to time 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingTriangleLeaf {
    open: TriangleLeaf,
    close: [Vec3; 3],
}

impl MovingTriangleLeaf {
    pub fn new(open: TriangleLeaf, close: [Vec3; 3]) -> Self {
        Self { open, close }
    }

    /// The triangle at `time`.
    pub fn at(&self, time: f32) -> TriangleLeaf {
        let corners = corners_at(self.open.corners(), self.close, time);
        TriangleLeaf::new(corners, self.open.geom, self.open.prim)
    }
}

impl Leaf for MovingTriangleLeaf {
    fn bounds(&self) -> Bounds3 {
        // Enlarge the box, because interpolation may round a corner to a position slightly outside
        // of the segment between both ends.
        let error = |p: Vec3| gamma(4) * p.abs();
        let ends = self.open.corners().into_iter().chain(self.close);
        ends.flat_map(|p| [p - error(p), p + error(p)]).collect()
    }
}

/// A ray prepared for tests against triangles: axes are permuted and sheared so that the ray points
/// along +z (Woop, Benthin and Wald 2013, "Watertight Ray/Triangle Intersection").
pub(super) struct ShearedRay {
    origin: Vec3,
    direction: Vec3,
    axes: [usize; 3],
    shear: [f32; 2],
}

impl ShearedRay {
    pub fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let z = (0..3).fold(0, |best, axis| if d[axis].abs() > d[best].abs() { axis } else { best });
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        // Swap x and y to keep the winding of triangles
        if d[z] < 0.0 {
            (x, y) = (y, x);
        }
        Self {
            origin: ray.origin,
            direction: d,
            axes: [x, y, z],
            shear: [d[x] / d[z], d[y] / d[z]],
        }
    }

    /// Returns the ray parameter of a hit in `(t_min, t_max)`, and the barycentrics of the second
    /// and third corner. A ray through an edge hits the triangle. On a shared edge, the results of
    /// both triangles are consistent.
    #[inline(always)]
    pub fn intersect(&self, triangle: &TriangleLeaf, t_min: f32, t_max: f32) -> Option<(f32, f32, f32)> {
        // Compute the corners relative to the ray, after the shear
        let [x, y, z] = self.axes.map(|axis| triangle.coordinates[axis] - self.origin[axis]);
        let (x, y) = (x - self.shear[0] * z, y - self.shear[1] * z);

        // Compute the edge functions. If one of them is 0 in f32, compute all three in f64.
        let mut edges = x.zxy() * y.yzx() - y.zxy() * x.yzx();
        if edges.cmpeq(Vec3::ZERO).any() {
            let (x, y) = (x.as_dvec3(), y.as_dvec3());
            edges = (x.zxy() * y.yzx() - y.zxy() * x.yzx()).as_vec3a();
        }
        if edges.cmplt(Vec3::ZERO).any() && edges.cmpgt(Vec3::ZERO).any() {
            return None;
        }
        let determinant = edges.x + edges.y + edges.z;
        if determinant == 0.0 {
            return None;
        }
        let t = self.distance(triangle);
        let inverse = 1.0 / determinant;
        (t > t_min && t < t_max).then_some((t, edges.y * inverse, edges.z * inverse))
    }

    /// Ray parameter of the crossing with the triangle's plane, in f64. In f32, the error grows
    /// with the ratio of the triangle's length to its width. It would exceed any ray offset, and a
    /// ray that leaves a very thin triangle would hit the same triangle again.
    fn distance(&self, triangle: &TriangleLeaf) -> f32 {
        let [a, b, c] = triangle.corners().map(Vec3::as_dvec3);
        let normal: DVec3 = (b - a).cross(c - a);
        let t = normal.dot(a - self.origin.as_dvec3()) / normal.dot(self.direction.as_dvec3());
        t as f32
    }
}
