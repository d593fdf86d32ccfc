//! Sizes of the named parts of a scene. With them, users find the important parts.

use super::Scene;
use crate::geometry::{GeomId, Mesh, PrimId, UNNAMED, triangle_area};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Size of a part of the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PartSize {
    /// Name of the part; empty for triangles without a name.
    pub name: String,
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
        let of_meshes: Vec<BTreeMap<u32, PartSize>> = geoms.par_iter().map(|geom| sizes_in(self.mesh(*geom))).collect();
        let of_name = |part| PartSize {
            name: names.name(part).into_owned(),
            ..PartSize::default()
        };
        let mut sizes: Vec<PartSize> = std::iter::once(UNNAMED).chain(names.parts()).map(of_name).collect();
        for (part, size) in of_meshes.into_iter().flatten() {
            sizes[part as usize].add(size.triangles, size.area);
        }
        sizes.rotate_left(1);
        sizes.retain(|size| size.triangles > 0);
        sizes
    }
}

/// Sizes of the parts in a mesh, by the index of the part. Names are not filled in.
fn sizes_in(mesh: &Mesh) -> BTreeMap<u32, PartSize> {
    let mut sizes: BTreeMap<u32, PartSize> = BTreeMap::new();
    for prim in (0..mesh.triangles.len() as u32).map(PrimId) {
        let [a, b, c] = mesh.corners(prim);
        sizes.entry(mesh.part(prim)).or_default().add(1, triangle_area(a, b, c));
    }
    sizes
}
