//! Movement of parts, before faces are subdivided or cut into triangles. The result is the same as
//! for a file with the moved positions and normals. A position or normal that both moved faces and
//! other faces use is copied.

use super::colors::Colors;
use super::outline::{NONE, Outline, Section};
use crate::io::{FileError, PartFilter, PartMovement};
use crate::math::{Bounds3, Mat3A, Vec3, affine_from_trs, excerpt_of_name};
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::path::Path;

/// Group of the parts that do not move.
const STILL: u32 = 0;

/// Faces that rotate about one centre.
struct MovingGroup {
    movement: PartMovement,
    bounds: Bounds3,
}

/// Moves the parts of the file `path` as the rules of `filter` require.
///
/// # Errors
///
/// If a part is moved so far that a coordinate is not finite.
pub(super) fn move_parts(
    path: &Path,
    outline: &mut Outline,
    colors: &mut Colors,
    filter: &PartFilter,
) -> Result<(), FileError> {
    if !filter.moves() {
        return Ok(());
    }
    let (group_of_part, mut groups) = groups(outline, filter);
    let group_of = |part: u32| group_of_part.get(part as usize).copied().unwrap_or(STILL);
    let Outline { vertices, sections, .. } = &*outline;
    for section in sections.iter().chain(&outline.wires) {
        for (face, group) in faces_of(section, &group_of) {
            if let Some(group) = groups.get_mut(group as usize) {
                let corners = face.map(|i| vertices.position(section, i));
                corners.for_each(|p| group.bounds.extend(p));
            }
        }
    }
    let moves: Vec<Move> = groups.iter().map(Move::of).collect();
    for section in outline
        .sections
        .iter_mut()
        .filter(|_| moves.iter().any(|group| group.is_mirrored))
    {
        for (face, group) in faces_of(section, &group_of) {
            if moves.get(group as usize).is_some_and(|group| group.is_mirrored) {
                section.turn_over(face);
            }
        }
    }

    let count = outline.vertices.positions.len();
    let positions = separate(outline, &group_of, count, 0, Section::set_position);
    for &old in &positions.copies {
        let old = old as usize;
        outline.vertices.positions.push(outline.vertices.positions[old]);
        colors.rgb.extend(colors.rgb.get(old).copied());
        colors.alpha.extend(colors.alpha.get(old).copied());
    }
    for (p, &group) in outline.vertices.positions.iter_mut().zip(&positions.groups) {
        let moved = moves[group as usize].position(*p);
        if !moved.is_finite() && p.is_finite() {
            let part = (1..).zip(&group_of_part[1..]).find(|&(_, &of_part)| of_part == group);
            let name = part.map(|(part, _)| outline.parts.name(part)).unwrap_or_default();
            let message = format!(
                "the part `{}` is moved so far that its coordinates are not finite",
                excerpt_of_name(&name)
            );
            return Err(FileError::new(path, message).help("use a smaller `translate` or `scale`"));
        }
        *p = moved;
    }
    if moves.iter().any(|group| group.turned.is_some()) {
        let count = outline.vertices.normals.len();
        let normals = separate(outline, &group_of, count, 2, Section::set_normal);
        for &old in &normals.copies {
            outline.vertices.normals.push(outline.vertices.normals[old as usize]);
        }
        for (n, &group) in outline.vertices.normals.iter_mut().zip(&normals.groups) {
            *n = moves[group as usize].normal(*n);
        }
    }
    Ok(())
}

/// Index of the group of each part, and the groups; the first group is [`STILL`].
fn groups(outline: &Outline, filter: &PartFilter) -> (Vec<u32>, Vec<MovingGroup>) {
    let group = |movement| MovingGroup {
        movement,
        bounds: Bounds3::EMPTY,
    };
    let (mut group_of_part, mut groups) = (vec![STILL], vec![group(PartMovement::default())]);
    // Find groups by name. Parts with one name may have several movements.
    let mut by_name: HashMap<Cow<str>, Vec<u32>> = HashMap::new();
    for part in outline.parts.parts() {
        let (movement, name) = filter.movement(&outline.parts, part);
        let known = by_name.entry(name).or_default();
        let same = known.iter().find(|&&index| groups[index as usize].movement == movement);
        let index = match same {
            _ if movement.is_empty() => STILL,
            Some(&index) => index,
            None => {
                groups.push(group(movement));
                let index = groups.len() as u32 - 1;
                known.push(index);
                index
            }
        };
        group_of_part.push(index);
    }
    (group_of_part, groups)
}

/// For each face of a section, the range of its corners and its group.
fn faces_of(section: &Section, group_of: &dyn Fn(u32) -> u32) -> Vec<(Range<usize>, u32)> {
    let all = section.all_faces();
    let groups = section.parts(&all).map(group_of);
    section.faces(&all).zip(groups).collect()
}

/// Positions or normals after copying, so that each is used by one group only.
struct SeparatedValues {
    /// Group of each position or normal, including copies.
    groups: Vec<u32>,
    /// For each copy, the index of the original position or normal.
    copies: Vec<u32>,
}

/// Copies positions (`kind` 0) or normals (`kind` 2), so that each is used by one group only. There
/// are `count` values before. If several groups use a value, the first group keeps the value, and
/// the other groups get copies. Indices of copies follow after the indices of the existing values.
fn separate(
    outline: &mut Outline,
    group_of: &dyn Fn(u32) -> u32,
    count: usize,
    kind: usize,
    set: impl Fn(&mut Section, usize, u32),
) -> SeparatedValues {
    let mut groups = vec![NONE; count];
    let mut copies = Vec::new();
    let mut copy_of: HashMap<(u32, u32), u32> = HashMap::new();
    for section in outline.sections.iter_mut().chain(&mut outline.wires) {
        for (face, group) in faces_of(section, group_of) {
            for corner in face {
                let value = section.corner(corner)[kind];
                match groups.get(value as usize).copied() {
                    None => {}
                    Some(NONE) => groups[value as usize] = group,
                    Some(owner) if owner == group => {}
                    Some(_) => {
                        let next = (count + copies.len()) as u32;
                        let copy = *copy_of.entry((group, value)).or_insert(next);
                        if copy == next {
                            copies.push(value);
                            groups.push(group);
                        }
                        set(section, corner, copy);
                    }
                }
            }
        }
    }
    // Values that no face uses do not move.
    for group in groups.iter_mut().filter(|group| **group == NONE) {
        *group = STILL;
    }
    SeparatedValues { groups, copies }
}

/// Movement of the points of a group.
struct Move {
    translation: Vec3,
    /// Centre of rotation and scale, matrix of rotation and scale, and matrix that transforms
    /// normals. `None` for a translation alone.
    turned: Option<(Vec3, Mat3A, Mat3A)>,
    is_mirrored: bool,
}

impl Move {
    fn of(group: &MovingGroup) -> Self {
        let PartMovement {
            translate,
            rotate,
            scale,
        } = group.movement;
        let linear = affine_from_trs(Vec3::ZERO, rotate.unwrap_or_default(), scale.unwrap_or(Vec3::ONE)).matrix3;
        Self {
            translation: translate.unwrap_or_default(),
            turned: (group.movement.has_center() && !group.bounds.is_empty())
                .then(|| (group.bounds.center(), linear, linear.inverse().transpose())),
            is_mirrored: linear.determinant() < 0.0,
        }
    }

    fn position(&self, p: Vec3) -> Vec3 {
        let turned = match self.turned {
            Some((center, linear, _)) => center + linear * (p - center),
            None => p,
        };
        turned + self.translation
    }

    fn normal(&self, n: Vec3) -> Vec3 {
        match self.turned {
            Some((_, _, of_normals)) if n != Vec3::ZERO => (of_normals * n).normalize_or(n),
            _ => n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::PartRule;
    use crate::io::obj::chunk::DataSelection;
    use crate::io::obj::counts::Chunks;
    use crate::io::obj::parse::parse;
    use crate::math::Glob;
    use half::f16;

    /// Two quads of one object with a common edge, and a quad of another object.
    const TEXT: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 6 0 0\nv 6 2 0\nv 10 0 0\nv 14 0 0\nv 14 2 0\nv 10 2 0\n\
        vn 1 0 0\no Chair1\ng seat\nf 1//1 2//1 3//1 4//1\ng leg\nf 2//1 5//1 6//1 3//1\n\
        o Chair2\ng seat\nf 7//1 8//1 9//1 10//1\n";

    /// Positions and normals of the corners of each face after the movements.
    fn moved(rules: &[(&str, PartMovement)]) -> Vec<Vec<[Vec3; 2]>> {
        let filter = PartFilter {
            hide: Vec::new(),
            only: Vec::new(),
            rules: rules
                .iter()
                .map(|(glob, movement)| PartRule {
                    glob: Glob::new(glob),
                    visible: None,
                    has_material: false,
                    movement: *movement,
                })
                .collect(),
        };
        let selection = DataSelection::of_faces(&filter);
        let mut outline = parse(Path::new("t.obj"), &Chunks::count(TEXT, 50), selection, &|_| ()).unwrap();
        let mut colors = Colors {
            rgb: (0..10).map(|i| [f16::from_f32(i as f32); 3]).collect(),
            alpha: Vec::new(),
        };
        move_parts(Path::new("t.obj"), &mut outline, &mut colors, &filter).unwrap();
        let Outline { vertices, sections, .. } = &outline;
        assert_eq!(colors.rgb.len(), vertices.positions.len());
        let mut faces = Vec::new();
        for section in sections {
            for face in section.faces(&section.all_faces()) {
                let corner = |i| {
                    [
                        vertices.position(section, i),
                        vertices.normals[section.corner(i)[2] as usize],
                    ]
                };
                faces.push(face.map(corner).collect());
            }
        }
        faces
    }

    fn turn(x: f32, y: f32, z: f32) -> PartMovement {
        PartMovement {
            rotate: Some(Vec3::new(x, y, z)),
            ..PartMovement::default()
        }
    }

    fn shift(x: f32, y: f32, z: f32) -> PartMovement {
        PartMovement {
            translate: Some(Vec3::new(x, y, z)),
            ..PartMovement::default()
        }
    }

    #[track_caller]
    fn assert_near(face: &[[Vec3; 2]], corners: [[f32; 2]; 4], normal: [f32; 3]) {
        for ([p, n], [x, y]) in face.iter().zip(corners) {
            assert!(p.distance(Vec3::new(x, y, 0.0)) < 2e-6, "{face:?}");
            assert!(n.distance(normal.into()) < 1e-6, "{face:?}");
        }
    }

    #[test]
    fn shared_vertices_are_split() {
        let still = moved(&[]);
        let faces = moved(&[("leg", shift(0.25, 0.5, 1.0))]);
        assert_eq!((&faces[0], &faces[2]), (&still[0], &still[2]));
        for ([new, n], [old, m]) in faces[1].iter().zip(&still[1]) {
            assert_eq!((*new, n), (*old + Vec3::new(0.25, 0.5, 1.0), m));
        }
    }

    /// Each object rotates about its own centre. All groups of the object rotate together.
    #[test]
    fn parts_of_a_name_rotate_about_one_center() {
        let faces = moved(&[("Chair*", turn(0.0, 0.0, 90.0))]);
        // The centres are (3, 1) and (12, 1): (x, y) becomes (4 − y, x − 2) and (13 − y, x − 11).
        assert_near(
            &faces[0],
            [[4.0, -2.0], [4.0, 0.0], [2.0, 0.0], [2.0, -2.0]],
            [0.0, 1.0, 0.0],
        );
        assert_near(
            &faces[1],
            [[4.0, 0.0], [4.0, 4.0], [2.0, 4.0], [2.0, 0.0]],
            [0.0, 1.0, 0.0],
        );
        assert_near(
            &faces[2],
            [[13.0, -1.0], [13.0, 3.0], [11.0, 3.0], [11.0, -1.0]],
            [0.0, 1.0, 0.0],
        );
        // The rule selects the group `leg`, so the centre of rotation is (4, 1).
        let faces = moved(&[("leg", turn(0.0, 0.0, 90.0))]);
        assert_near(
            &faces[0],
            [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]],
            [1.0, 0.0, 0.0],
        );
        assert_near(
            &faces[1],
            [[5.0, -1.0], [5.0, 3.0], [3.0, 3.0], [3.0, -1.0]],
            [0.0, 1.0, 0.0],
        );
    }

    #[test]
    fn rotation_by_360_degrees_changes_nothing() {
        let (still, faces) = (moved(&[]), moved(&[("*", turn(360.0, -360.0, 720.0))]));
        for ([p, n], [q, m]) in faces.iter().flatten().zip(still.iter().flatten()) {
            assert!(p.distance(*q) < 2e-5 && n.distance(*m) < 2e-6, "{p} {q}");
        }
    }

    /// Later rules replace single keys of earlier rules. A reflection keeps the front of faces.
    #[test]
    fn later_rules_replace_single_keys() {
        let mirror = PartMovement {
            scale: Some(Vec3::new(-1.0, 1.0, 1.0)),
            translate: Some(Vec3::new(9.0, 9.0, 9.0)),
            ..PartMovement::default()
        };
        let faces = moved(&[("Chair2", mirror), ("seat", shift(0.0, 1.0, 0.0))]);
        assert_near(
            &faces[0],
            [[0.0, 1.0], [2.0, 1.0], [2.0, 3.0], [0.0, 3.0]],
            [1.0, 0.0, 0.0],
        );
        assert_near(
            &faces[2],
            [[14.0, 3.0], [10.0, 3.0], [10.0, 1.0], [14.0, 1.0]],
            [-1.0, 0.0, 0.0],
        );
    }
}
