//! Hull meshes of sphere and disk lights, and rays that hit a hull but miss its light.
//!
//! Backends support only triangles. The hull of a sphere is a polyhedron around it, and the hull of
//! a disk is a square around it. If a ray hits a hull and misses the light, the ray continues, as
//! at a surface of opacity 0 (`integrator/opacity.rs`). If a ray hits the hull of a sphere, the hit
//! is moved to the sphere; this is computed in f64. A surface between the hull and the sphere is
//! nearer than the moved hit, so the search for the nearest hit continues up to the moved hit
//! (`World::first_opaque`).
//!
//! Hulls are wider than their lights by a margin that bounds rounding errors. So hulls have an area
//! for lights of any size and position. The margin is the sum of two terms. They depend on the unit
//! roundoff u, the largest coordinate c of the light, and the largest coordinate s of the scene
//! ([`margin`]):
//!
//! - γ₃₂ (c + s): an intersector subtracts the origin of the ray, and then rounds the result
//!   several times. These errors displace the edges of a hull by at most γ₁₆ (c + s). Vertices have
//!   one rounding per coordinate, √3 u c. Neighbouring vertices of a polyhedron are 8 u c apart or
//!   more, so rounding does not turn a face over.
//! - 2⁻¹³ c for disks: rounding of the corners tilts a square by at most 10⁻³. Rays that hit the
//!   disk at a larger angle to its plane hit the square.
//!
//! For a camera far outside the scene the errors are larger than the margin. This matters only if
//! the light covers an angle so small that ray directions in f32 cannot resolve the angle.
//!
//! Limitation: a ray that starts in the gap between a sphere and its hull does not hit the near
//! side of the hull, but the hull behind the sphere. If another surface is inside the sphere, or in
//! the gap behind the sphere, the ray finds this surface first. The surface then hides the sphere.
//! The gap is 2 % of the radius, plus the margin.

use super::builder::SceneBuilder;
use super::{LightNumbering, Scene};
use crate::geometry::{Hit, Mesh, SurfacePoint};
use crate::light::{AreaLight, DiskLight, Light, LightId, RoundLight, SphereLight};
use crate::math::float::gamma;
use crate::math::{DVec3, Frame, Ray, Vec3};
use std::collections::HashMap;

/// Second term of the margin of a disk's square, as a fraction of the disk's largest coordinate.
const TILT_MARGIN: f64 = 1.0 / 8192.0;

/// First term of the margin between a light and its hull, scene units. `size` is the largest
/// absolute coordinate of the light, and `reach` the largest absolute coordinate of the scene.
fn margin(size: f64, reach: f32) -> f64 {
    f64::from(gamma(32)) * (size + f64::from(reach))
}

impl SceneBuilder {
    /// Widens the hulls of sphere and disk lights, for rays that start anywhere in the scene.
    pub(super) fn widen_hulls(&mut self) {
        if self.lamps.is_empty() {
            return;
        }
        let bounds = self.bounds();
        let reach = bounds.min.abs().max(bounds.max.abs()).max_element();
        for (mesh, material) in &mut self.meshes {
            match self.lamps.get(material).and_then(AreaLight::round) {
                Some(RoundLight::Sphere(light)) => *mesh = around_sphere(light, reach),
                Some(RoundLight::Disk(light)) => *mesh = around_disk(light, reach),
                None => {}
            }
        }
    }
}

/// Result of the test if a hit is on a hull, and if the ray hits the light in the hull.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum HullHit {
    /// The surface is not the hull of a light.
    NoHull,
    /// The ray hits the hull, but misses the light.
    Misses,
    /// The ray hits the light at this ray parameter, in lengths of the ray's direction.
    Enters(f32),
}

impl Scene {
    /// Returns true if `hit` is on the hull of a sphere or disk light that `ray` misses.
    #[inline(always)]
    pub fn misses_lamp(&self, hit: &Hit, ray: &Ray) -> bool {
        self.has_lamp_hulls && self.at_hull(hit, ray) == HullHit::Misses
    }

    /// Tests if the surface at `hit` is a hull, and if `ray` hits the light inside the hull.
    #[inline(always)]
    pub(crate) fn hull_hit(&self, hit: &Hit, ray: &Ray) -> HullHit {
        if self.has_lamp_hulls {
            self.at_hull(hit, ray)
        } else {
            HullHit::NoHull
        }
    }

    #[inline(never)]
    fn at_hull(&self, hit: &Hit, ray: &Ray) -> HullHit {
        match self.lamp_of(hit).and_then(AreaLight::round) {
            None => HullHit::NoHull,
            Some(light) if light.is_missed(ray) => HullHit::Misses,
            Some(RoundLight::Sphere(light)) => HullHit::Enters(light.entry(ray).map_or(hit.t, |entry| entry.t)),
            // The square lies in the plane of the disk.
            Some(RoundLight::Disk(_)) => HullHit::Enters(hit.t),
        }
    }

    /// The light of the mesh that was hit, if the whole mesh is one light.
    fn lamp_of(&self, hit: &Hit) -> Option<&AreaLight> {
        let shape = self.shape(hit.geom);
        let LightId(id) = shape.first_light.filter(|_| shape.numbering == LightNumbering::One)?;
        match self.lights.get(id as usize) {
            Some(Light::Area(light)) => Some(light),
            _ => None,
        }
    }

    /// The point at which `ray` hits the surface at `hit`. If the surface is a hull, the point is
    /// on the light, not on the hull.
    pub fn surface_point_along(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        let point = self.surface_point(hit, ray.time);
        if !self.has_lamp_hulls {
            return point;
        }
        match self.lamp_of(hit).and_then(AreaLight::round) {
            Some(RoundLight::Sphere(light)) => light.entry(ray).map_or(point, |entry| SurfacePoint {
                p: entry.p,
                ng: entry.n,
                ns: entry.n,
                ray_offset: light.ray_offset(),
                curvature_offset: [0.0; 2],
                ..point
            }),
            Some(RoundLight::Disk(_)) | None => point,
        }
    }
}

/// Polyhedron of 320 faces around a sphere light: an icosahedron whose faces are divided into four,
/// twice. `reach` is the largest coordinate of the scene.
pub(super) fn around_sphere(light: &SphereLight, reach: f32) -> Mesh {
    let (center, radius) = (light.center().as_dvec3(), f64::from(light.radius()));
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut corners = Vec::new();
    for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    // Two corners of the icosahedron are neighbours if their distance is 2, the length of an edge.
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
    // Scale the polyhedron so that its nearest face touches the sphere
    let distance = |[a, b, c]: &[usize; 3]| {
        let (a, b, c) = (points[*a], points[*b], points[*c]);
        a.dot((b - a).cross(c - a).normalize())
    };
    let min = faces.iter().map(distance).fold(1.0, f64::min);
    let farthest = center.abs().max_element() + radius;
    let size = (radius + margin(farthest, reach)) / min;
    Mesh {
        positions: points.iter().map(|p| (center + size * p).as_vec3a()).collect(),
        triangles: faces.iter().map(|face| face.map(|i| i as u32)).collect(),
        ..Mesh::default()
    }
}

/// Square around a disk light, in the plane of the disk. `reach` is the largest coordinate of the
/// scene.
pub(super) fn around_disk(light: &DiskLight, reach: f32) -> Mesh {
    let (center, radius) = (light.center().as_dvec3(), f64::from(light.radius()));
    let farthest = center.abs().max_element() + radius;
    let size = radius + margin(farthest, reach) + TILT_MARGIN * farthest;
    let frame = Frame::from_z(light.normal());
    let [right, up] = [Vec3::X, Vec3::Y].map(|axis| size * frame.to_world(axis).as_dvec3());
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    Mesh {
        positions: corners.map(|[x, y]| (center + x * right + y * up).as_vec3a()).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Accel;
    use crate::accel::brute::BruteForce;
    use crate::color::Spectrum;
    use crate::geometry::PrimId;
    use crate::math::hash::{mix, unit_f32};

    /// Centres and radii of typical lamps, and of lamps that are smaller than the rounding of their
    /// coordinates.
    const LAMPS: [([f32; 3], f32); 8] = [
        ([0.0, 0.0, 0.0], 1.0),
        ([300.0, -20.0, 5.0], 0.25),
        ([1.0, 0.0, 0.0], 1e4),
        ([70.0, 70.0, 0.0], 1e-6),
        ([70.0, 70.0, 0.0], 1e-12),
        ([0.0, 0.0, 0.0], 1e-6),
        ([1e10, -3e9, 0.1], 1e-9),
        ([8388607.0, 0.0, -8388609.0], 0.3),
    ];

    fn sphere((center, radius): ([f32; 3], f32)) -> SphereLight {
        SphereLight::new(center.into(), radius, Spectrum::ONE)
    }

    #[test]
    fn hull_of_sphere_surrounds_it_at_every_size_and_place() {
        for (lamp, reach) in LAMPS
            .into_iter()
            .flat_map(|lamp| [0.0, 100.0].map(|reach| (lamp, reach)))
        {
            let light = sphere(lamp);
            let mesh = around_sphere(&light, reach);
            assert_eq!((mesh.triangles.len(), mesh.positions.len()), (320, 162));
            let size = margin(f64::from(lamp.1) + light.center().as_dvec3().abs().max_element(), reach);
            for prim in 0..320 {
                let corners = mesh.corners(PrimId(prim));
                let [a, b, c] = corners.map(|p| p.as_dvec3() - light.center().as_dvec3());
                let distance = a.dot((b - a).cross(c - a).normalize());
                // Half of the margin is left for the rounding errors of intersectors.
                let [min, max] = [0.5 * size, 0.03 * f64::from(lamp.1) + 1.2 * size];
                let gap = distance - f64::from(lamp.1);
                assert!((min..max).contains(&gap), "{lamp:?} {reach}: {gap} {min} {max}");
            }
        }
    }

    #[test]
    fn hull_of_disk_surrounds_it_at_every_size_and_place() {
        for (center, radius) in LAMPS {
            for normal in [
                Vec3::NEG_Y,
                Vec3::new(0.6, -0.0, 0.8),
                Vec3::new(-0.3, 0.5, 0.4).normalize(),
            ] {
                let light = DiskLight::new(center.into(), normal, radius, Spectrum::ONE);
                let mesh = around_disk(&light, 100.0);
                for prim in 0..2 {
                    let [a, b, c] = mesh.corners(PrimId(prim)).map(Vec3::as_dvec3);
                    let tilted = (b - a).cross(c - a).normalize();
                    assert!(
                        tilted.distance(normal.as_dvec3()) < 1e-3,
                        "{center:?} {radius}: {tilted}"
                    );
                }
            }
        }
    }

    /// Rays from the scene to points inside a light hit the light's hull, and hit the light.
    #[test]
    fn rays_towards_lamps_hit_their_hulls() {
        let u = |i: u64| 2.0 * unit_f32(mix(i)) - 1.0;
        for lamp in LAMPS {
            let mut builder = SceneBuilder::new();
            let size = lamp.1 + Vec3::from(lamp.0).abs().max_element();
            let [position, radiance] = [lamp.0.into(), Vec3::ONE];
            let radiance = Spectrum::from(radiance.to_array());
            builder
                .add_sphere(&super::super::SphereParameters {
                    position,
                    radius: lamp.1,
                    radiance,
                })
                .unwrap();
            let (scene, report) = builder.build().unwrap();
            assert_eq!((report.degenerate_triangles, report.default_light), (0, false));
            let accel = BruteForce::new(&scene);
            let mut hits = 0;
            for i in 0..500 {
                let origin = position + 2.0 * size * Vec3::new(u(4 * i), u(4 * i + 1), u(4 * i + 2));
                let ray = Ray::new(origin, (position - origin).normalize_or(Vec3::X));
                if origin.distance(position) <= lamp.1 || sphere(lamp).is_missed(&ray) {
                    continue;
                }
                let hit = accel.intersect(&ray).expect("a hull around the lamp");
                assert!(matches!(scene.hull_hit(&hit, &ray), HullHit::Enters(_)), "{lamp:?}");
                hits += 1;
            }
            // Ray directions in f32 are too coarse to hit the smallest lamps.
            assert!(hits > 100 || lamp.1 < 1e-5 * size, "{lamp:?}: {hits}");
        }
    }
}
