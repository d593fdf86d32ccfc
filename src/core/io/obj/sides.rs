//! Faces at the same place, with opposite orders of their corners and different materials.
//! Exporters of SketchUp, ShapeNet and Minecraft write the front and the back of a wall in this
//! way.
//!
//! Without a correction, rounding errors would decide which of both faces a ray hits. Each face is
//! moved along its normal by 1/100,000 of the file's diagonal. In every backend, a ray then hits
//! the face whose front is on the side of the ray's origin.

use super::ObjFaces;
use super::colors::Colors;
use super::groups::Faces;
use super::outline::{Outline, Section, VertexData};
use crate::math::hash::mix;
use crate::math::{Bounds3, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Distance by which a face is moved, as a multiple of the file's diagonal.
const GAP: f32 = 1e-5;
/// Minimum fraction of faces that belong to pairs of front and back. Exporters write all walls in
/// pairs. If the fraction is smaller, the pairs are therefore mistakes in the model, and are not
/// moved.
const MIN_SHARE: f32 = 0.25;

/// A face: the indices of its material and of its section, and the range of its corners in the
/// section.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    material: usize,
    section: usize,
    first: usize,
    end: usize,
}

impl Place {
    fn corners(&self) -> Range<usize> {
        self.first..self.end
    }
}

/// Moves the front and the back of each pair apart. Returns the number of pairs.
pub(super) fn separate(outline: &mut Outline, colors: &mut Colors, faces: &[Faces]) -> usize {
    let pairs = two_sided(outline, faces);
    if pairs.is_empty() {
        return 0;
    }
    let bounds: Bounds3 = outline.vertices.positions.iter().copied().collect();
    let gap = GAP * 2.0 * bounds.radius();
    for face in pairs.iter().flatten() {
        move_out(
            (&mut outline.vertices, colors),
            &mut outline.sections[face.section],
            face.corners(),
            gap,
        );
    }
    pairs.len()
}

/// Pairs of faces of different materials with the same corners in opposite orders.
fn two_sided(outline: &Outline, faces: &[Faces]) -> Vec<[Place; 2]> {
    if faces.len() < 2 {
        return Vec::new();
    }
    let Outline { vertices, sections, .. } = outline;
    let positions = |section: usize, corners: Range<usize>| -> Vec<Vec3> {
        corners.map(|i| vertices.position(&sections[section], i)).collect()
    };
    // Compare only faces with equal hashes, because comparing faces takes longer than hashing them.
    let hash = |section: usize, corners: Range<usize>| {
        let hashes = corners.map(|i| hash(vertices.position(&sections[section], i)));
        hashes.fold(0, u64::wrapping_add)
    };
    let runs = || faces.iter().flat_map(|faces| &faces.runs);
    let mut hashes: Vec<u64> = runs()
        .par_bridge()
        .flat_map_iter(|run| {
            let faces = sections[run.section].faces(&run.faces);
            faces.map(|face| hash(run.section, face))
        })
        .collect();
    hashes.par_sort_unstable();
    let runs_of_equal = hashes.chunk_by(|a, b| a == b);
    let several: Vec<u64> = runs_of_equal
        .filter(|equal| equal.len() > 1)
        .map(|equal| equal[0])
        .collect();
    if several.is_empty() {
        return Vec::new();
    }
    let mut at: HashMap<u64, Vec<Place>> = HashMap::new();
    for (material, run) in (0..)
        .zip(faces)
        .flat_map(|(i, faces)| faces.runs.iter().map(move |run| (i, run)))
    {
        for face in sections[run.section].faces(&run.faces) {
            let hash = hash(run.section, face.clone());
            if several.binary_search(&hash).is_ok() {
                at.entry(hash).or_default().push(Place {
                    material,
                    section: run.section,
                    first: face.start,
                    end: face.end,
                });
            }
        }
    }
    let is_two_sided = |[a, b]: &[Place; 2]| {
        let [front, back] = [a, b].map(|place| positions(place.section, place.corners()));
        a.material != b.material && is_opposite(&front, &back)
    };
    let pairs = at
        .into_values()
        .filter_map(|places| <[Place; 2]>::try_from(places).ok());
    let mut pairs: Vec<_> = pairs.filter(is_two_sided).collect();
    if !ObjFaces::are_two_sided(pairs.len(), hashes.len()) {
        return Vec::new();
    }
    pairs.sort_unstable();
    pairs
}

impl ObjFaces {
    /// Returns true if a file of `faces` faces with `pairs` pairs of front and back was written
    /// with two faces for each wall. A render then moves the faces of each pair apart.
    pub fn are_two_sided(pairs: usize, faces: usize) -> bool {
        pairs > 0 && (2 * pairs) as f32 > MIN_SHARE * faces as f32
    }
}

/// Hash of a position.
fn hash(p: Vec3) -> u64 {
    // Adding 0 turns −0 into 0.
    let [x, y, z] = (p + Vec3::ZERO).to_array().map(|x| u64::from(x.to_bits()));
    mix(mix(mix(x) ^ y) ^ z)
}

/// Returns true if both faces have the same corners in opposite orders.
fn is_opposite(a: &[Vec3], b: &[Vec3]) -> bool {
    let n = a.len();
    let from = |start: usize| (0..n).all(|i| a[i] == b[(start + n - i) % n]);
    n == b.len() && (0..n).any(from)
}

/// Assigns new positions to the face with the corners `corners`: the old positions, moved by `gap`
/// along the normal of the face.
fn move_out(
    (vertices, colors): (&mut VertexData, &mut Colors),
    section: &mut Section,
    corners: Range<usize>,
    gap: f32,
) {
    let positions: Vec<Vec3> = corners.clone().map(|i| vertices.position(section, i)).collect();
    // Newell's normal, for any polygon
    let next = positions.iter().cycle().skip(1);
    let sum: Vec3 = positions
        .iter()
        .zip(next)
        .map(|(a, b)| (*a - positions[0]).cross(*b - positions[0]))
        .sum();
    let offset = gap * sum.normalize_or_zero();
    for (corner, p) in corners.zip(positions) {
        let [before, ..] = section.corner(corner);
        colors.rgb.extend(colors.rgb.get(before as usize).copied());
        colors.alpha.extend(colors.alpha.get(before as usize).copied());
        section.set_position(corner, vertices.positions.len() as u32);
        vertices.positions.push(p + offset);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Colors, Group, MaterialRules, into_groups};
    use super::super::{chunk::DataSelection, counts::Chunks, parse::parse};
    use crate::io::PartFilter;
    use std::path::Path;

    /// Reads a file with the corners of a square of side 1 and the statements `faces`. Returns the
    /// groups and the number of pairs.
    fn groups(faces: &str) -> (Vec<Group>, usize) {
        let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{faces}");
        let chunks = Chunks::count(&text, 1 << 20);
        let filter = PartFilter::default();
        let selection = DataSelection::of_faces(&filter);
        let outline = parse(Path::new("t.obj"), &chunks, selection, &|_| ()).unwrap();
        into_groups(outline, Colors::default(), &MaterialRules::default(), true)
    }

    #[test]
    fn fronts_and_backs_are_moved_apart() {
        // The two backs are cut along different diagonals.
        for back in ["f 4 3 2 1", "f 1 4 3 2"] {
            let (groups, pairs) = groups(&format!("usemtl a\nf 1 2 3 4\nusemtl b\n{back}\n"));
            assert_eq!(pairs, 1);
            let heights = |group: &Group| group.mesh.positions.iter().map(|p| p.z).collect::<Vec<_>>();
            let gap = heights(&groups[0])[0];
            assert!(gap > 0.0 && gap < 1e-4, "{gap}");
            assert_eq!(heights(&groups[0]), [gap; 4]);
            assert_eq!(heights(&groups[1]), [-gap; 4]);
        }
    }

    #[test]
    fn other_faces_are_not_moved() {
        for faces in [
            // Faces with equal order of corners, equal materials, three faces at one place, and
            // different corners
            "usemtl a\nf 1 2 3 4\nusemtl b\nf 2 3 4 1\n",
            "usemtl a\nf 1 2 3 4\nf 4 3 2 1\nusemtl b\nf 1 2 3\n",
            "usemtl a\nf 1 2 3\nf 2 3 1\nusemtl b\nf 3 2 1\n",
            "usemtl a\nf 1 2 3\nusemtl b\nf 4 3 1\n",
        ] {
            let (groups, pairs) = groups(faces);
            assert_eq!(pairs, 0, "{faces}");
            assert!(
                groups
                    .iter()
                    .flat_map(|group| &group.mesh.positions)
                    .all(|p| p.z == 0.0)
            );
        }
    }
}
