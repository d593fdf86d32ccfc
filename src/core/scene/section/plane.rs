//! The plane of a section, and coordinates in the plane.

use crate::math::{DVec2, DVec3, Vec3};

/// A plane that cuts the scene. Points behind the plane are kept. Points in front of the plane or
/// in the plane are removed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionPlane {
    /// Unit normal.
    normal: DVec3,
    /// Distance of the plane from the origin along the normal.
    offset: f64,
    /// Unit vectors in the plane; their cross product is the normal.
    axes: [DVec3; 2],
}

impl SectionPlane {
    /// The plane through `point` with the normal `normal`, which may have any length. `None` if any
    /// number is not finite, or if the normal is zero.
    pub fn new(normal: DVec3, point: DVec3) -> Option<Self> {
        let normal = normal.try_normalize()?;
        let offset = normal.dot(point);
        let units = [DVec3::X, DVec3::Y, DVec3::Z];
        // If the normal is along an axis of the world, use the other two axes. Coordinates in the
        // plane then have no rounding errors.
        let aligned = units.iter().position(|unit| normal.dot(*unit).abs() == 1.0);
        let axes = match aligned {
            Some(axis) => [units[(axis + 1) % 3], units[(axis + 2) % 3] * normal[axis].signum()],
            None => {
                let across = normal.any_orthonormal_vector();
                [across, normal.cross(across)]
            }
        };
        (offset.is_finite()).then_some(Self { normal, offset, axes })
    }

    /// Signed distance of `p` from the plane: negative on the kept side.
    pub(super) fn distance(&self, p: Vec3) -> f64 {
        self.normal.dot(p.as_dvec3()) - self.offset
    }

    /// The point at which the plane crosses the edge from `kept` to `removed`, and the position of
    /// this point on the edge, from 0 at `kept` to 1 at `removed`. Each end of the edge is given
    /// with its signed distance from the plane.
    pub(super) fn crossing(&self, kept: (Vec3, f64), removed: (Vec3, f64)) -> (Vec3, f32) {
        let share = kept.1 / (kept.1 - removed.1);
        let [a, b] = [kept.0, removed.0].map(Vec3::as_dvec3);
        let p = a + share * (b - a);
        let p = p - (self.normal.dot(p) - self.offset) * self.normal;
        (p.as_vec3a(), share as f32)
    }

    /// Coordinates of `p` in the plane.
    pub(super) fn coordinates(&self, p: Vec3) -> DVec2 {
        let [u, v] = self.axes.map(|axis| axis.dot(p.as_dvec3()));
        DVec2::new(u, v)
    }

    /// The point of the plane with the coordinates `at`.
    pub(super) fn point(&self, at: DVec2) -> Vec3 {
        let [u, v] = self.axes;
        (self.offset * self.normal + at.x * u + at.y * v).as_vec3a()
    }
}
