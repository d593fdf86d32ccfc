//! Sizes of the named parts of a scene. They show users which parts are important.

use super::Scene;
use crate::geometry::{GeomId, Mesh, PrimId, UNNAMED, triangle_area};
use crate::math::Bounds3;
use rayon::prelude::*;
use std::ops::Range;

/// Maximum number of triangles that one thread measures.
const TRIANGLES: usize = 1 << 12;
/// Number of ranges of triangles that are measured at a time.
const RANGES: usize = 64;

/// Size of a part of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartSize {
    /// Id of the part in [`Scene::part_names`]; [`UNNAMED`] for triangles without a part name.
    pub part: u32,
    /// Number of triangles.
    pub triangles: u64,
    /// Sum of the triangle areas, in square scene units.
    pub area: f64,
    /// Box around the triangles. Of a mesh of a prototype, it is the box before placement.
    pub bounds: Bounds3,
}

impl PartSize {
    fn add(&mut self, other: &Self) {
        self.triangles += other.triangles;
        self.area += other.area;
        self.bounds = self.bounds.union(other.bounds);
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
        let numbers = std::iter::once(UNNAMED).chain(names.parts());
        let mut sizes: Vec<PartSize> = numbers
            .map(|part| PartSize {
                part,
                triangles: 0,
                area: 0.0,
                bounds: Bounds3::EMPTY,
            })
            .collect();
        let ranges = geoms.iter().flat_map(|&geom| {
            let count = self.mesh(geom).triangles.len();
            let range = move |start: usize| (geom, start..count.min(start + TRIANGLES));
            (0..count).step_by(TRIANGLES).map(range)
        });
        // A mesh may have as many parts as triangles, so some triangles are measured at a time.
        let ranges: Vec<_> = ranges.collect();
        for ranges in ranges.chunks(RANGES) {
            let of_range = |(geom, range): &(GeomId, Range<usize>)| sizes_in(self.mesh(*geom), range.clone());
            let of_ranges: Vec<Vec<PartSize>> = ranges.par_iter().map(of_range).collect();
            for size in of_ranges.into_iter().flatten() {
                sizes[size.part as usize].add(&size);
            }
        }
        sizes.rotate_left(1);
        sizes.retain(|size| size.triangles > 0);
        sizes
    }
}

/// Sizes of the parts in a range of triangles of a mesh: one entry for each run of consecutive
/// triangles of the same part.
fn sizes_in(mesh: &Mesh, range: Range<usize>) -> Vec<PartSize> {
    let mut sizes: Vec<PartSize> = Vec::new();
    for prim in range.map(|prim| PrimId(prim as u32)) {
        let [a, b, c] = mesh.corners(prim);
        let triangle = PartSize {
            part: mesh.part(prim),
            triangles: 1,
            area: triangle_area(a, b, c),
            bounds: [a, b, c].into_iter().collect(),
        };
        match sizes.last_mut() {
            Some(last) if last.part == triangle.part => last.add(&triangle),
            _ => sizes.push(triangle),
        }
    }
    sizes
}
