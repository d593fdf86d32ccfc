//! Sampling of points uniformly over the area of all surfaces of a scene.

use crate::geometry::{GeomId, Hit, InstanceId, PrimId, triangle_area};
use crate::math::Vec2;
use crate::sampling::AliasTable;
use crate::sampling::warp::uniform_triangle;
use crate::scene::Scene;

/// All triangles of a scene, including the triangles of instances. Triangles are chosen in
/// proportion to their areas.
#[derive(Debug)]
pub struct SurfaceAreas {
    triangles: Vec<(InstanceId, GeomId, PrimId)>,
    /// Table that chooses a triangle; `None` if all areas are 0.
    table: Option<AliasTable>,
}

impl SurfaceAreas {
    /// Surface areas of `scene` at time 0.
    pub fn new(scene: &Scene) -> Self {
        let prims = |geom: GeomId| (0..scene.mesh(geom).triangles.len() as u32).map(PrimId);
        let of_meshes = |inst: InstanceId, geoms: std::ops::Range<u32>| {
            geoms.flat_map(move |geom| prims(GeomId(geom)).map(move |prim| (inst, GeomId(geom), prim)))
        };
        let world_meshes = of_meshes(InstanceId::NONE, scene.world_meshes());
        let instances = scene.instances().iter().enumerate().flat_map(|(id, instance)| {
            let geoms = scene.prototypes()[instance.prototype as usize].clone();
            of_meshes(InstanceId(id as u32), geoms)
        });
        let triangles: Vec<_> = world_meshes.chain(instances).collect();
        let areas: Vec<f64> = triangles.iter().map(|&id| area(scene, &hit(id), 0.0)).collect();
        Self {
            triangles,
            table: AliasTable::new(&areas),
        }
    }

    /// Samples a surface point at `time`. Returns the point and its density per area. `choice`
    /// chooses the triangle, and `u` the point on the triangle. `None` if the area is 0.
    pub fn sample(&self, scene: &Scene, choice: f32, u: Vec2, time: f32) -> Option<(Hit, f32)> {
        let (index, pmf) = self.table.as_ref()?.sample(choice);
        let hit = hit(*self.triangles.get(index)?);
        let (b1, b2) = uniform_triangle(u);
        let hit = Hit { b1, b2, ..hit };
        // For a moving triangle, use the area at `time`.
        let area = area(scene, &hit, time) as f32;
        (area > 0.0).then(|| (hit, pmf / area))
    }
}

/// Hit at the first corner of a triangle.
fn hit((inst, geom, prim): (InstanceId, GeomId, PrimId)) -> Hit {
    Hit::at_corner(geom, prim, inst)
}

/// Area of the triangle of `hit` at `time`, in squared scene units.
fn area(scene: &Scene, hit: &Hit, time: f32) -> f64 {
    let [p0, p1, p2] = scene.corners(hit, time);
    triangle_area(p0, p1, p2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::material::Material;
    use crate::math::Vec3;
    use crate::sampler::{Bounce, Dimension, Independent, SampleKey, Sampler};
    use crate::scene::SceneBuilder;

    /// χ² test over four equal parts of each triangle. The lines between the midpoints of the edges
    /// separate the parts. All points have the same density: 1 divided by the total area.
    #[test]
    fn points_are_uniform_over_all_triangles() {
        const N: u32 = 400_000;
        /// 99.99 % quantile of χ² with 11 degrees of freedom.
        const BOUND: f64 = 37.4;
        let widths = [1.0, 4.0, 0.05];
        let mut builder = SceneBuilder::new();
        for (z, width) in widths.into_iter().enumerate() {
            let z = Vec3::Z * z as f32;
            let mesh = Mesh {
                positions: vec![z, z + Vec3::X * width, z + Vec3::Y],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            let material = builder.add_material(Material::default()).unwrap();
            builder.add_mesh(mesh, material).unwrap();
        }
        let (scene, _) = builder.build().unwrap();
        let areas = SurfaceAreas::new(&scene);
        let whole = 0.5 * widths.iter().sum::<f32>();

        let mut counts = [[0u32; 4]; 3];
        for i in 0..N {
            let mut sampler = Independent::new(1);
            sampler.start(SampleKey::new(0, 0, i));
            let choice = sampler.get_1d(Dimension::bounce(0, Bounce::LightPoint));
            let u = sampler.get_2d(Dimension::bounce(0, Bounce::Direction));
            let (hit, pdf) = areas.sample(&scene, choice, u, 0.0).unwrap();
            assert!((pdf * whole - 1.0).abs() < 1e-5, "{pdf}");
            let part = match (hit.b1, hit.b2) {
                (b1, _) if b1 > 0.5 => 1,
                (_, b2) if b2 > 0.5 => 2,
                (b1, b2) if b1 + b2 < 0.5 => 0,
                _ => 3,
            };
            counts[hit.geom.0 as usize][part] += 1;
        }
        let terms = counts.iter().zip(widths).flat_map(|(parts, width)| {
            let expected = f64::from(N) * f64::from(0.5 * width / whole) / 4.0;
            parts.map(|count| (f64::from(count) - expected).powi(2) / expected)
        });
        let chi_squared: f64 = terms.sum();
        assert!(chi_squared < BOUND, "{chi_squared}: {counts:?}");
    }
}
