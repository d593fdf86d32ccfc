//! Faces at the same place, with opposite orders of their corners. Exporters of SketchUp, ShapeNet
//! and Minecraft write the front and the back of a wall in this way.
//!
//! Without a correction, rounding errors would decide which of both faces a ray hits. Each face is
//! moved along its normal by 1/100,000 of the file's diagonal. In every backend, a ray then hits
//! the face whose front is on the side of the ray's origin.
//!
//! Faces of two materials are moved when the file is read. Two faces of one material look the same,
//! unless the material emits light, because only fronts emit. The final material is not known here.
//! These pairs are therefore listed (`twins`), and the code that adds the mesh to a scene decides
//! about their movement. Light would pass two surfaces of a lamp that is not opaque, so rays from
//! behind pass these faces (`Twins::split_off`).

use super::ObjFaces;
use super::colors::Colors;
use super::groups::Faces;
use super::outline::{Outline, Section, VertexData};
use super::twins::CoincidentFaces;
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

/// A face: the indices of its material, of its group and of its section, and the range of its
/// corners in the section.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct FacePlace {
    material: usize,
    group: usize,
    section: usize,
    first: usize,
    end: usize,
}

impl FacePlace {
    fn corners(&self) -> Range<usize> {
        self.first..self.end
    }
}

/// Moves the front and the back of each pair of two materials apart, and lists the pairs of one
/// material. `may_emit` is true if a material may emit light. Otherwise a file of one material is
/// not searched.
pub(super) fn separate(outline: &mut Outline, colors: &mut Colors, faces: &[Faces], may_emit: bool) -> CoincidentFaces {
    let (pairs, twins) = coincident(outline, faces, may_emit);
    if pairs.is_empty() && twins.is_empty() {
        return CoincidentFaces::default();
    }
    let bounds: Bounds3 = outline.vertices.positions.iter().copied().collect();
    let gap = GAP * 2.0 * bounds.radius();
    let mut found = CoincidentFaces::new(pairs.len(), gap);
    for [a, b] in twins {
        found.add_twins(a.group, [(a.section, a.first), (b.section, b.first)]);
    }
    for face in pairs.iter().flatten() {
        move_out(
            (&mut outline.vertices, colors),
            &mut outline.sections[face.section],
            face.corners(),
            gap,
        );
    }
    found
}

/// Pairs of faces with the same corners in opposite orders: pairs of two materials that are to be
/// moved apart, and pairs of one material in one group.
fn coincident(outline: &Outline, faces: &[Faces], may_emit: bool) -> (Vec<[FacePlace; 2]>, Vec<[FacePlace; 2]>) {
    // Groups of one material and one list of rules differ only by their texture coordinates.
    let mut ids = HashMap::new();
    let mut id_of = |faces: &Faces| {
        let next = ids.len();
        *ids.entry((faces.material.clone(), faces.rules)).or_insert(next)
    };
    let materials: Vec<usize> = faces.iter().map(&mut id_of).collect();
    if ids.len() < 2 && !may_emit {
        return <_>::default();
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
        return <_>::default();
    }
    let mut at: HashMap<u64, Vec<FacePlace>> = HashMap::new();
    for (group, run) in (0..)
        .zip(faces)
        .flat_map(|(i, faces)| faces.runs.iter().map(move |run| (i, run)))
    {
        for face in sections[run.section].faces(&run.faces) {
            let hash = hash(run.section, face.clone());
            if several.binary_search(&hash).is_ok() {
                at.entry(hash).or_default().push(FacePlace {
                    material: materials[group],
                    group,
                    section: run.section,
                    first: face.start,
                    end: face.end,
                });
            }
        }
    }
    let are_opposite = |[a, b]: &[FacePlace; 2]| {
        let [front, back] = [a, b].map(|place| positions(place.section, place.corners()));
        is_opposite(&front, &back)
    };
    let pairs = at
        .into_values()
        .filter_map(|places| <[FacePlace; 2]>::try_from(places).ok());
    let is_of_two = |[a, b]: &[FacePlace; 2]| a.material != b.material;
    let (mut pairs, mut twins): (Vec<_>, Vec<_>) = pairs.filter(are_opposite).partition(is_of_two);
    if !ObjFaces::are_two_sided(pairs.len(), hashes.len()) {
        pairs.clear();
    }
    twins.retain(|[a, b]| may_emit && a.group == b.group);
    pairs.sort_unstable();
    twins.sort_unstable();
    (pairs, twins)
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
    use super::super::{Colors, Group, MaterialRules, PairSearch, into_groups};
    use super::super::{chunk::DataSelection, counts::Chunks, parse::parse};
    use crate::io::PartFilter;
    use crate::math::Vec3;
    use std::path::Path;

    /// Reads a file with the corners of a square of side 1 and the statements `faces`. Returns the
    /// groups and the number of pairs.
    fn groups(faces: &str) -> (Vec<Group>, usize) {
        let text = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{faces}");
        let chunks = Chunks::count(&text, 1 << 20);
        let filter = PartFilter::default();
        let selection = DataSelection::of_faces(&filter);
        let outline = parse(Path::new("t.obj"), &chunks, selection, &|_| ()).unwrap();
        let search = PairSearch {
            is_on: true,
            may_emit: true,
        };
        into_groups(outline, Colors::default(), &MaterialRules::default(), search)
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

    /// Pairs of one material are listed, and can be moved apart later. Other faces do not move.
    #[test]
    fn pairs_of_one_material_are_listed() {
        let (mut groups, pairs) = groups("usemtl a\nf 1 2 3\nf 1 2 3 4\nf 1 4 3 2\nusemtl b\nf 1 2 4\n");
        assert_eq!(pairs, 0);
        assert_eq!(groups[0].twins.pairs, [[1..3, 3..5]]);
        assert!(groups[1].twins.pairs.is_empty());
        let Group { mesh, twins, .. } = &mut groups[0];
        mesh.positions_close = mesh.positions.iter().map(|p| 2.0 * *p).collect();
        let before = mesh.clone();
        twins.move_apart(mesh);
        assert_eq!(mesh.triangles[0], before.triangles[0]);
        for (triangles, side) in [(1..3, 1.0), (3..5, -1.0)] {
            for (new, old) in mesh.triangles[triangles.clone()]
                .iter()
                .zip(&before.triangles[triangles])
            {
                for (&new, &old) in new.iter().zip(old) {
                    let offset = mesh.positions[new as usize] - before.positions[old as usize];
                    assert_eq!(offset, side * twins.gap * Vec3::Z);
                    let close = mesh.positions_close[new as usize] - before.positions_close[old as usize];
                    assert_eq!(close, offset);
                }
            }
        }
        assert_eq!(mesh.positions.len(), before.positions.len() + 8);
        assert_eq!(mesh.positions.len(), mesh.positions_close.len());
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
