use super::super::polygon;
use super::{SQUARE, corners, load, mesh};
use crate::geometry::{PrimId, triangle_normal};
use crate::math::{Vec2, Vec3};

#[test]
fn faces_are_grouped_by_material() {
    let text = format!("{SQUARE}f 1 2 3\nusemtl a\nf 1 2 3 4\no part\nusemtl b c\nf 1 2 3\nusemtl\ta\nf -4 -3 -2\n");
    let file = load(&text).unwrap();
    let summary: Vec<_> = file
        .groups
        .iter()
        .map(|g| (g.material.as_deref(), g.mesh.triangles.len()))
        .collect();
    assert_eq!(summary, [(None, 1), (Some("a"), 3), (Some("b c"), 1)]);
    let a = &file.groups[1].mesh;
    assert_eq!(corners(a, 1), [Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
    assert_eq!(corners(a, 2)[..2], [Vec3::ZERO, Vec3::X]);
    // Vertices are shared within a group, and no vertex is unused.
    let vertices: Vec<_> = file.groups.iter().map(|g| g.mesh.positions.len()).collect();
    assert_eq!(vertices, [3, 4, 3]);
}

#[test]
fn concave_faces_are_cut_inside() {
    // A triangle of the fan from the first corner of this arrow would lie outside of the arrow.
    let mesh = mesh("v 4 3 0\nv 0 0 0\nv 4 -3 0\nv 1 0 0\nf 1 2 3 4\n");
    for t in 0..2 {
        let [p0, p1, p2] = corners(&mesh, t);
        assert_eq!(triangle_normal(p0, p1, p2), Vec3::Z);
    }
}

#[test]
fn corners_with_equal_indices_are_one_vertex() {
    let text = format!("{SQUARE}vt 0 0\nvt 1 0.5 7\nvt .25\nvn 0 0 2\nvn 0 -3 0\n");
    let file = mesh(&format!(
        "{text}f 1/1/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/1/1\nf 1/1/2 -3/-2/-2 4/2/1\n"
    ));
    assert_eq!(file.triangles, [[0, 1, 2], [0, 2, 3], [4, 1, 5]]);
    let uvs = [[0.0, 0.0], [1.0, 0.5], [0.25, 0.0], [0.0, 0.0], [0.0, 0.0], [1.0, 0.5]];
    assert_eq!(file.uvs, uvs.map(Vec2::from));
    assert_eq!(file.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Z, -Vec3::Y, Vec3::Z]);

    let (no_normals, no_uvs) = (
        mesh(&format!("{text}f 1/1 2/2 3/1\n")),
        mesh(&format!("{text}f 1//1 2//1 3//2\n")),
    );
    assert_eq!((no_normals.uvs.len(), no_normals.normals.len()), (3, 0));
    assert_eq!((no_uvs.uvs.len(), no_uvs.normals.len()), (0, 3));
    let plain = mesh(&format!("{text}f 1 2 3\n"));
    assert_eq!((plain.uvs.len(), plain.normals.len()), (0, 0));
}

#[test]
fn faces_without_normals_stay_flat_among_others() {
    let text = format!(
        "{SQUARE}v 0 0 1\nvt 1 1\nvn 0 1 1\nvn 0 0 0\nvn nan 0 1\nvn 1.#QNAN 0 1\nvt inf 0\n\
         f 1/1/1 2/1/1 3/1/1\nf 1/1 2/1 5/1\nf 1/1/2 3/1/1 4/1/3\nf 1/1 2/1 3/1\n"
    );
    let file = load(&text).unwrap();
    assert!(
        file.warnings[0].contains("t.obj:8: 3 normals are zero or not finite"),
        "{:?}",
        file.warnings
    );
    assert!(
        file.warnings[1].contains("t.obj:11: 1 texture coordinate is"),
        "{:?}",
        file.warnings
    );
    let mesh = &file.groups[0].mesh;
    let given = Vec3::new(0.0, 0.5f32.sqrt(), 0.5f32.sqrt());
    let normals = |t: usize| mesh.triangles[t].map(|i| mesh.normals[i as usize]);
    assert!(normals(0).iter().all(|n| n.distance(given) < 1e-6));
    assert_eq!(normals(1), [-Vec3::Y; 3]);
    assert_eq!([normals(2)[0], normals(2)[2]], [Vec3::Z; 2]);
    assert!(normals(2)[1].distance(given) < 1e-6);
    assert_eq!(normals(3), [Vec3::Z; 3]);
    // A group that has only invalid normals is flat-shaded.
    let flat = load(format!("{SQUARE}vn 0 0 0\nf 1//1 2//1 3//1\n")).unwrap();
    assert!(flat.groups[0].mesh.normals.is_empty());
}

/// Faces without texture coordinates show the mean of a texture, so they have a group of their own.
#[test]
fn faces_without_texture_coordinates_are_separate() {
    let file = load(format!("{SQUARE}vt 1 1\nf 1/1 2/1 3/1\nf 1 3 4\nf 2/1 3/1 4/1\n")).unwrap();
    let [with, without] = [0, 1].map(|i| &file.groups[i].mesh);
    assert_eq!([with.triangles.len(), without.triangles.len()], [2, 1]);
    assert!(with.uvs.iter().all(|uv| *uv == Vec2::ONE) && without.uvs.is_empty());
}

/// A cube from -1 to 1 with one quad per side. The statement `before[i]` is before quad i.
fn cube(before: [&str; 6]) -> String {
    let side = |bit: usize, i: usize| if i >> bit & 1 == 1 { 1 } else { -1 };
    let mut text: String = (0..8)
        .map(|i| format!("v {} {} {}\n", side(0, i), side(1, i), side(2, i)))
        .collect();
    let quads = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"];
    for (statement, quad) in before.iter().zip(quads) {
        text += &format!("{statement}\nf {quad}\n");
    }
    text
}

#[test]
fn smoothing_groups_share_normals() {
    // If all sides are in one smoothing group, the normals point along the diagonals of the cube,
    // by symmetry.
    let round = mesh(&cube(["s 3", "", "", "", "", ""]));
    assert_eq!(round.positions.len(), 8);
    for (p, n) in round.positions.iter().zip(&round.normals) {
        assert!((*n * 3f32.sqrt() - *p).length() < 1e-6, "{n} at {p}");
    }
    for off in ["s off", "s 0", "s"] {
        assert!(mesh(&cube([off, "", "", "", "", ""])).normals.is_empty());
    }
    // Opposite sides have no common corners. All sides are flat if two smoothing groups have two
    // opposite sides each, and two sides have no group.
    let flat = mesh(&cube(["s 1", "s 1", "s 2", "s 2", "s off", "s off"]));
    assert_eq!(flat.triangles.len(), 12);
    for t in 0..12 {
        let facet = flat.facet(PrimId(t));
        let normals = flat.triangles[t as usize].map(|i| flat.normals[i as usize]);
        assert!(normals.iter().all(|n| n.distance(facet.normal()) < 1e-6), "{t}");
    }
}

#[test]
fn smoothing_joins_equal_positions_across_materials() {
    // A roof has two sides with separate vertices and materials. Along the ridge, both sides have
    // the mean normal.
    let roof = "v -1 0 0\nv 0 1 0\nv 0 1 1\nv -1 0 1\nv -0 1 0\nv 1 0 0\nv 1 0 1\nv 0 1 1\n\
                s 1\nusemtl a\nf 4 3 2 1\nusemtl b\nf 8 7 6 5\n";
    let file = load(roof).unwrap();
    assert_eq!(file.groups.len(), 2);
    for group in &file.groups {
        for (p, n) in group.mesh.positions.iter().zip(&group.mesh.normals) {
            let expected = Vec3::new(p.x, 1.0, 0.0).normalize();
            assert!(n.distance(expected) < 1e-6, "{n} at {p}");
        }
    }
    // Normals of the file are kept.
    let given = load(roof.replace("s 1", "vn 0 0 1\ns 1").replace("8 7 6 5", "8 7//1 6 5//1")).unwrap();
    let n = &given.groups[1].mesh.normals;
    assert_eq!([n[1], n[3]], [Vec3::Z; 2]);
    assert!(n[0].distance(Vec3::Y) < 1e-6);
    assert!(given.groups[0].mesh.normals[1].distance(Vec3::Y) < 1e-6);
}

#[test]
fn long_faces_are_cut_as_fans() {
    let n = polygon::MAX_CLIPPED + 1;
    let circle = |i: usize| {
        let (sin, cos) = (i as f64 / n as f64 * std::f64::consts::TAU).sin_cos();
        format!("v {cos} {sin} 0\n")
    };
    let text: String = (0..n).map(circle).collect();
    let corners: String = (1..=n).map(|i| format!(" {i}")).collect();
    let file = load(format!("{text}f{corners}\n")).unwrap();
    assert_eq!(file.groups[0].mesh.triangles.len(), n - 2);
    assert!(
        file.warnings[0].contains("t.obj:10002: 1 face of more than 10000 corners"),
        "{:?}",
        file.warnings
    );
}
