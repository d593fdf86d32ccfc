//! Lamps that are round: meshes around them, and the rays that miss the lamp within.
//!
//! Backends know triangles alone, so a sphere is in the world as a polyhedron around it and a disk as a square. A ray that meets such a hull and not the
//! lamp goes on, as at a surface of opacity 0 (`integrator/opacity.rs`): the lamp is round to the last bit for all backends.

use super::{LightNumbering, Scene};
use crate::geometry::{Hit, Mesh, SurfacePoint};
use crate::light::{Light, LightId};
use crate::math::{DVec3, Frame, Ray, Vec3};
use std::collections::HashMap;

/// Margin of a hull: roundings of its vertices do not reach the lamp.
const SLACK: f64 = 1.0 + 1e-5;

impl Scene {
    /// Whether `ray`, which meets a triangle at `hit`, misses the lamp of which that is the hull.
    #[inline(always)]
    pub fn misses_lamp(&self, hit: &Hit, ray: &Ray) -> bool {
        self.has_lamp_hulls && self.misses_hull(hit, ray)
    }

    #[inline(never)]
    fn misses_hull(&self, hit: &Hit, ray: &Ray) -> bool {
        match self.lamp_of(hit) {
            Some(Light::Sphere(light)) => light.is_missed(ray),
            Some(Light::Disk(light)) => light.is_missed(ray),
            _ => false,
        }
    }

    /// The light that the whole mesh is which was hit, if it is one.
    fn lamp_of(&self, hit: &Hit) -> Option<&Light> {
        let shape = self.shape(hit.geom);
        let LightId(id) = shape.first_light.filter(|_| shape.numbering == LightNumbering::One)?;
        self.lights.get(id as usize)
    }

    /// The point at which `ray` meets the surface at `hit`: of a lamp, and not of its hull.
    pub fn surface_point_along(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        let point = self.surface_point(hit, ray.time);
        if !self.has_lamp_hulls {
            return point;
        }
        match self.lamp_of(hit) {
            Some(Light::Sphere(light)) => light.entry(ray).map_or(point, |(p, n)| SurfacePoint {
                p,
                ng: n,
                ns: n,
                ray_offset: light.ray_offset(),
                curvature_offset: [0.0; 2],
                ..point
            }),
            _ => point,
        }
    }
}

/// A polyhedron of 320 faces around the sphere about `center` of that radius: an icosahedron, whose faces are cut into four twice.
pub(super) fn around_sphere(center: Vec3, radius: f32) -> Mesh {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut corners = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Corners are neighbours at the distance 2 of an edge.
    let is_edge = |i: usize, j: usize| (corners[i].distance(corners[j]) - 2.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if is_edge(i, j) && is_edge(j, k) && is_edge(k, i) {
                    let outwards = (corners[j] - corners[i]).cross(corners[k] - corners[i]).dot(corners[i]) > 0.0;
                    faces.push(if outwards { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    let mut points: Vec<DVec3> = corners.iter().map(|corner| corner.normalize()).collect();
    for _ in 0..2 {
        let mut middles = HashMap::new();
        let mut middle = |points: &mut Vec<DVec3>, a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a] + points[b]).normalize());
                points.len() - 1
            })
        };
        let split = |[a, b, c]: [usize; 3]| {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| middle(&mut points, a, b));
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(split).collect();
    }
    // The nearest face touches the sphere.
    let distance = |[a, b, c]: &[usize; 3]| {
        let (a, b, c) = (points[*a], points[*b], points[*c]);
        a.dot((b - a).cross(c - a).normalize())
    };
    let min = faces.iter().map(distance).fold(1.0, f64::min);
    let size = f64::from(radius) * SLACK / min;
    Mesh {
        positions: points
            .iter()
            .map(|p| (center.as_dvec3() + size * p).as_vec3a())
            .collect(),
        triangles: faces.iter().map(|face| face.map(|i| i as u32)).collect(),
        ..Mesh::default()
    }
}

/// A square around the disk about `center` of that radius, its front along the unit vector `normal`.
pub(super) fn around_disk(center: Vec3, normal: Vec3, radius: f32) -> Mesh {
    let (frame, size) = (Frame::from_z(normal), (f64::from(radius) * SLACK) as f32);
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    Mesh {
        positions: corners
            .map(|[x, y]| center + frame.to_world(size * Vec3::new(x, y, 0.0)))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PrimId;

    /// Each face of the hull lies off the sphere, and looks outwards.
    #[test]
    fn hulls_are_around() {
        for (center, radius) in [
            (Vec3::ZERO, 1.0f32),
            (Vec3::new(300.0, -20.0, 5.0), 0.25),
            (Vec3::X, 1e4),
        ] {
            let mesh = around_sphere(center, radius);
            assert_eq!((mesh.triangles.len(), mesh.positions.len()), (320, 162));
            for prim in 0..320 {
                let [a, b, c] = mesh.corners(PrimId(prim)).map(|p| (p - center).as_dvec3());
                let distance = a.dot((b - a).cross(c - a).normalize()) / f64::from(radius);
                assert!((1.0..1.06).contains(&distance), "{center} {radius}: {distance}");
            }
        }
        let disk = around_disk(Vec3::ONE, Vec3::NEG_Y, 2.0);
        let [a, b, c] = disk.corners(PrimId(1));
        assert!((b - a).cross(c - a).normalize().distance(Vec3::NEG_Y) < 1e-6);
    }
}
