use super::groups::FaceRun;
use super::outline::Outline;
use crate::io::normals::{area_vector, corner_angles, weld};
use crate::math::{DVec3, Vec3};
use std::collections::HashMap;

/// Adds missing normals to the corners of faces in a smoothing group. The normal is the mean over
/// all faces of the group at the same point, weighted by their angles at the point (Thürmer and
/// Wüthrich 1998).
///
/// The means are appended to the outline's normals. If the normals of the faces cancel, the mean is
/// zero, and the corner is treated as a corner without a normal.
pub(super) fn smooth<'a>(outline: &mut Outline, runs: impl Iterator<Item = &'a FaceRun> + Clone) {
    let Outline { vertices, sections, .. } = outline;
    let smooth_runs = runs.filter(|run| run.smoothing != 0);
    let lacks_normals = |run: &FaceRun| {
        let section = &sections[run.section];
        section
            .faces(&run.faces)
            .flatten()
            .any(|i| !vertices.has_normal(section, i))
    };
    if !smooth_runs.clone().any(lacks_normals) {
        return;
    }

    // For each group and each point, sum the normals of the faces
    let points = weld(&vertices.positions);
    let mut index_of: HashMap<(u32, u32), usize> = HashMap::new();
    let mut sums: Vec<DVec3> = Vec::new();
    let mut corners: Vec<Vec3> = Vec::new();
    for run in smooth_runs.clone() {
        let section = &sections[run.section];
        for face in section.faces(&run.faces) {
            corners.clear();
            corners.extend(face.clone().map(|i| vertices.position(section, i)));
            let normal = area_vector(&corners).normalize_or_zero();
            for (i, angle) in face.zip(corner_angles(&corners, normal)) {
                let key = (points[section.corner(i)[0] as usize], run.smoothing);
                let index = *index_of.entry(key).or_insert_with(|| {
                    sums.push(DVec3::ZERO);
                    sums.len() - 1
                });
                sums[index] += angle * normal;
            }
        }
    }

    // Assign the normal of the point to corners without a normal
    let first = vertices.normals.len();
    for run in smooth_runs {
        let section = &mut sections[run.section];
        let corners: Vec<usize> = section.faces(&run.faces).flatten().collect();
        for i in corners {
            let key = (points[section.corner(i)[0] as usize], run.smoothing);
            if let (false, Some(&index)) = (vertices.has_normal(section, i), index_of.get(&key)) {
                section.set_normal(i, (first + index) as u32);
            }
        }
    }
    let means = sums.iter().map(|sum| sum.normalize_or_zero().as_vec3a());
    vertices.normals.extend(means);
}
