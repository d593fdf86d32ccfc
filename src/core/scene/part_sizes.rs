//! Sizes of the named parts of a scene. They show users which parts are important.

use super::Scene;
use crate::geometry::{GeomId, Mesh, PrimId, UNNAMED, triangle_area};
use rayon::prelude::*;

/// Size of a part of the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartSize {
    /// Id of the part in [`Scene::part_names`]; [`UNNAMED`] for triangles without a part name.
    pub part: u32,
    /// Number of triangles.
    pub triangles: u64,
    /// Sum of the triangle areas, in square scene units.
    pub area: f64,
}

impl PartSize {
    fn add(&mut self, triangles: u64, area: f64) {
        self.triangles += triangles;
        self.area += area;
    }
}

impl Scene {
    /// Sizes of the parts of meshes, in the order in which their first faces appear. Triangles
    /// without a part name are last. A mesh of a prototype counts once, with its size before
    /// placement. The result is empty if no part has a name.
    pub fn part_sizes(&self) -> Vec<PartSize> {
        let names = self.part_names();
        if names.is_empty() {
            return Vec::new();
        }
        let ground = self.ground().map(|ground| ground.geom());
        let geoms: Vec<GeomId> = self.geom_ids().filter(|geom| Some(*geom) != ground).collect();
        let of_meshes: Vec<Vec<PartSize>> = geoms.par_iter().map(|geom| sizes_in(self.mesh(*geom))).collect();
        let numbers = std::iter::once(UNNAMED).chain(names.parts());
        let mut sizes: Vec<PartSize> = numbers
            .map(|part| PartSize {
                part,
                ..PartSize::default()
            })
            .collect();
        for size in of_meshes.into_iter().flatten() {
            sizes[size.part as usize].add(size.triangles, size.area);
        }
        sizes.rotate_left(1);
        sizes.retain(|size| size.triangles > 0);
        sizes
    }
}

/// Sizes of the parts in a mesh: one entry for each run of consecutive triangles of the same part.
fn sizes_in(mesh: &Mesh) -> Vec<PartSize> {
    let mut sizes: Vec<PartSize> = Vec::new();
    for prim in (0..mesh.triangles.len() as u32).map(PrimId) {
        let [a, b, c] = mesh.corners(prim);
        let (part, area) = (mesh.part(prim), triangle_area(a, b, c));
        match sizes.last_mut() {
            Some(last) if last.part == part => last.add(1, area),
            _ => sizes.push(PartSize {
                part,
                triangles: 1,
                area,
            }),
        }
    }
    sizes
}
