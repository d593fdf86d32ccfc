//! Connected components of a mesh. Vertices at the same position are merged.

use crate::geometry::Mesh;
use crate::math::Vec3;
use std::collections::{BTreeMap, HashMap};

/// For each vertex, the index of the first vertex at the same position.
pub(in crate::scene) fn welded(mesh: &Mesh) -> Vec<u32> {
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    let positions = mesh.positions.iter().enumerate();
    let first = positions.map(|(i, p)| {
        // Adding zero turns −0 into +0
        let bits = (*p + Vec3::ZERO).to_array().map(f32::to_bits);
        *known.entry(bits).or_insert(i as u32)
    });
    first.collect()
}

/// Indices of the triangles of each connected component. Components are ordered by their first
/// triangles. `parents` is the result of [`welded`].
pub(in crate::scene) fn components(mesh: &Mesh, mut parents: Vec<u32>) -> Vec<Vec<u32>> {
    // Find the root with path halving (Tarjan 1975)
    fn root(parents: &mut [u32], mut i: u32) -> u32 {
        while parents[i as usize] != i {
            let above = parents[parents[i as usize] as usize];
            parents[i as usize] = above;
            i = above;
        }
        i
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| root(&mut parents, vertex));
        let min = a.min(b).min(c);
        for other in [a, b, c] {
            // Find the root again, because it may have changed in this loop.
            let other = root(&mut parents, other);
            parents[other as usize] = min;
        }
    }
    let mut index_of: BTreeMap<u32, usize> = BTreeMap::new();
    let mut components: Vec<Vec<u32>> = Vec::new();
    for (i, [vertex, ..]) in mesh.triangles.iter().enumerate() {
        let index = *index_of.entry(root(&mut parents, *vertex)).or_insert_with(|| {
            components.push(Vec::new());
            components.len() - 1
        });
        components[index].push(i as u32);
    }
    components
}
