//! Lamps of two faces at one place, with opposite orders of their corners. Only fronts emit light,
//! so each side must show the face whose front it sees.

use crate::support::program::*;
use crate::support::{read_channel, read_rgb};
use std::fs;
use tempfile::TempDir;

const VERTICES: &str = "mtllib a.mtl\nv -4 -4 0\nv 4 -4 0\nv 5 0 0\nv 4 4 0\nv -4 4 0\n";
const LIBRARY: &str = "newmtl lamp\nKd 0 0 0\nKe 1 1 1\nnewmtl black\nKd 0 0 0\nnewmtl half\nKd 0 0 0\nd 0.5\n\
    newmtl half-lamp\nKd 0 0 0\nKe 1 1 1\nd 0.5\n";

/// A folder with the faces `faces`. The cameras of `front.toml` and `back.toml` see nothing else.
fn lamp(faces: &str) -> TempDir {
    let scene = |z: &str| {
        format!(
            "version = 1\n[camera]\nposition = [0.1, 0.05, {z}]\nlook_at = [0.1, 0.05, 0]\nvertical_fov = 60\n\
             [image]\nwidth = 24\nheight = 24\n[render]\nsamples = 64\n[[object]]\nobj = \"a.obj\"\n\
             [[light]]\ntype = \"constant\"\nradiance = 2\n"
        )
    };
    folder(&[
        ("a.obj", &format!("{VERTICES}{faces}")),
        ("a.mtl", LIBRARY),
        ("front.toml", &scene("3")),
        ("back.toml", &scene("-3")),
    ])
}

/// Red of all pixels, seen from both sides with each backend.
fn views(folder: &TempDir, flags: &str) -> Vec<(String, Vec<f32>)> {
    let mut views = Vec::new();
    for side in ["front", "back"] {
        for backend in ["embree", "obvhs", "brute"] {
            let line = format!("render {side}.toml -q --denoise=off --backend {backend} {flags} -o t.exr");
            done(folder.path(), &split(&line));
            let [red, ..] = read_rgb(&folder.path().join("t.exr"));
            views.push((format!("{side}, {backend}"), red));
        }
    }
    views
}

/// Both sides emit, with every backend. The faces are cut along different diagonals. The emission
/// may be of the library, of a patch, or of a part.
#[test]
fn both_sides_emit() {
    for (faces, flags) in [
        ("usemtl lamp\nf 1 2 4 5\nf 5 4 2 1\n", ""),
        ("usemtl lamp\nf 1 2 3 4 5\nf 3 2 1 5 4\n", ""),
        ("usemtl lamp\nf 1 2 4\nf 1 4 5\nf 4 2 1\nf 5 4 1\n", ""),
        ("usemtl black\nf 1 2 4 5\nf 5 4 2 1\n", "--material black.emission=1"),
        ("o p\nusemtl black\nf 1 2 4 5\nf 5 4 2 1\n", "--part p.emission=1"),
    ] {
        for (view, red) in views(&lamp(faces), flags) {
            let wrong = red.iter().filter(|&&value| (value - 1.0).abs() > 1e-6).count();
            assert_eq!(wrong, 0, "{faces} {flags}, {view}");
        }
    }
    let folder = lamp("usemtl lamp\nf 1 2 4 5\nf 5 4 2 1\n");
    let checked = printed(&run(folder.path(), &split("check front.toml")));
    assert_eq!(checked.matches("[two-sided]").count(), 1, "{checked}");
    assert!(!checked.contains("[duplicate-face]"), "{checked}");
}

/// Faces that are not opaque stay where they are, because light that passes one of them would be
/// absorbed by the other. The lamp beside them has no influence.
#[test]
fn opacity_does_not_compound() {
    let folder =
        lamp("usemtl half\nf 1 2 4 5\nf 5 4 2 1\nv 90 0 0\nv 91 0 0\nv 90 1 0\nusemtl lamp\nf 6 7 8\nf 8 7 6\n");
    for (view, red) in views(&folder, "") {
        // Half of the light of the background, whose radiance is 2
        let mean = red.iter().sum::<f32>() / red.len() as f32;
        assert!((mean - 1.0).abs() < 0.03, "{view}: {mean}");
    }
}

/// A lamp that is not opaque shows the front of one face on each side, and its opacity counts once,
/// with every backend. The opacity may be a number, a texture, or the alpha of vertices.
#[test]
fn lamps_that_are_not_opaque_emit_on_both_sides() {
    let (faces, alpha) = (
        "f 1 2 4 5\nf 5 4 2 1\n",
        "v -4 -4 0 1 1 1 0.5\nv 4 -4 0 1 1 1 0.5\nv 4 4 0 1 1 1 0.5\nv -4 4 0 1 1 1 0.5\n",
    );
    for (faces, flags) in [
        (format!("usemtl half-lamp\n{faces}"), ""),
        (format!("usemtl lamp\n{faces}"), "--material lamp.opacity=0.5"),
        (
            "vt 0 0\nusemtl lamp\nf 1/1 2/1 4/1 5/1\nf 5/1 4/1 2/1 1/1\n".into(),
            "--material lamp.opacity_map=half.png",
        ),
        (format!("{alpha}usemtl lamp\nf 6 7 8 9\nf 9 8 7 6\n"), ""),
    ] {
        let folder = lamp(&faces);
        write_grey_png(&folder.path().join("half.png"), &[128]);
        for (view, red) in views(&folder, flags) {
            // Half of the lamp of radiance 1, and half of the background of radiance 2
            let mean = red.iter().sum::<f32>() / red.len() as f32;
            assert!((mean - 1.5).abs() < 0.02, "{faces} {flags}, {view}: {mean}");
        }
        let checked = printed(&run(folder.path(), &joined(&["check", "front.toml"], &split(flags))));
        assert_eq!(checked.matches("[two-sided]").count(), 1, "{checked}");
        assert!(!checked.contains("[duplicate-face]"), "{checked}");
    }
}

/// A face of the same material that lies on no other face keeps its back, which is black.
#[test]
fn other_faces_of_the_lamp_keep_their_backs() {
    let folder = lamp("v 90 0 0\nv 91 0 0\nv 90 1 0\nusemtl half-lamp\nf 1 2 4 5\nf 6 7 8\nf 8 7 6\n");
    for (view, red) in views(&folder, "") {
        let mean = red.iter().sum::<f32>() / red.len() as f32;
        let expected = if view.starts_with("front") { 1.5 } else { 1.0 };
        assert!((mean - expected).abs() < 0.02, "{view}: {mean}");
    }
}

/// Files without emission are not changed: the depth of both faces is that of the file.
#[test]
fn other_pairs_of_one_material_are_not_moved() {
    let folder = lamp("usemtl black\nf 1 2 4 5\nf 5 4 2 1\n");
    let depths = |flags: &str| {
        done(
            folder.path(),
            &split(&format!("render front.toml -q --spp 1 --denoise=off {flags} -o t.exr")),
        );
        read_channel(&folder.path().join("t.exr"), "Z")
    };
    let plain = depths("");
    fs::write(
        folder.path().join("a.obj"),
        format!("{VERTICES}usemtl black\nf 1 2 4 5\n"),
    )
    .unwrap();
    assert!(plain == depths(""));
}
