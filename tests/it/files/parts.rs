//! Parts of an OBJ file by the names of `o` and `g`: hidden, or shown alone.

use crate::support::program::*;
use std::fs;
use tempfile::TempDir;

/// Four squares in a row: an object of one group, an object of two groups with two names, and faces
/// below no group of that object.
const PARTS: [(&str, &str); 4] = [
    ("o Chair.001\ng seat\n", "f 1 2 3 4\n"),
    ("o Table\ng top wood\n", "f 2 5 6 3\n"),
    ("g leg wood\n", "f 5 7 8 6\n"),
    ("g\n", "f 7 9 10 8\n"),
];
const VERTICES: &str =
    "v -4 -1 0\nv -2 -1 0\nv -2 1 0\nv -4 1 0\nv 0 -1 0\nv 0 1 0\nv 2 -1 0\nv 2 1 0\nv 4 -1 0\nv 4 1 0\n";
const SCENE: &str = "version = 1\n[camera]\nposition = [0, 0, 8]\nlook_at = [0, 0, 0]\n\
    [image]\nwidth = 32\nheight = 8\n[render]\nsamples = 2\n[[object]]\nobj = \"a.obj\"\n\
    [[light]]\ntype = \"constant\"\nradiance = 0.5\n[[light]]\ntype = \"point\"\nposition = [0, 2, 3]\nintensity = 20\n";

/// A folder whose OBJ file has the faces of these parts; all names stay.
fn scene(shown: [bool; 4]) -> TempDir {
    let parts = PARTS.iter().zip(shown);
    let parts: String = parts
        .map(|((names, faces), is_shown)| format!("{names}{}", if is_shown { faces } else { "" }))
        .collect();
    folder(&[("a.obj", &format!("{VERTICES}{parts}")), ("s.toml", SCENE)])
}

fn picture(folder: &TempDir, flags: &str) -> Vec<u8> {
    let flags = split(flags);
    done(
        folder.path(),
        &joined(&["render", "s.toml", "-q", "-o", "t.exr"], &flags),
    );
    done(
        folder.path(),
        &joined(&["render", "s.toml", "-q", "-o", "t.png"], &flags),
    );
    fs::read(folder.path().join("t.png")).unwrap()
}

#[test]
fn hiding_a_part_equals_deleting_its_faces() {
    let whole = scene([true; 4]);
    for (flags, shown) in [
        ("--hide Chair.001", [false, true, true, true]),
        ("--hide Chair*", [false, true, true, true]),
        ("--hide seat --hide top", [false, false, true, true]),
        ("--hide wood", [true, false, false, true]),
        ("--only Table", [false, true, true, true]),
        ("--only Table --hide leg", [false, true, false, true]),
        ("--only seat --only leg", [true, false, true, false]),
        ("--hide top?wood", [true, false, true, true]),
    ] {
        let deleted = scene(shown);
        assert!(picture(&whole, flags) == picture(&deleted, ""), "{flags}");
        assert_same_bits(&whole.path().join("t.exr"), &deleted.path().join("t.exr"));
    }
}

#[test]
fn scene_files_hide_parts_and_dumps_keep_that() {
    let folder = scene([true; 4]);
    let expected = picture(&folder, "--hide wood --hide seat");
    assert!(picture(&folder, "--set render.hide=wood --hide seat") == expected);
    let with_keys = SCENE.replace("samples = 2", "samples = 2\nhide = [\"wood\", \"seat\"]");
    fs::write(folder.path().join("s.toml"), with_keys).unwrap();
    assert!(picture(&folder, "--dump-scene d.toml") == expected);
    fs::copy(folder.path().join("d.toml"), folder.path().join("s.toml")).unwrap();
    assert!(picture(&folder, "") == expected);
}

#[test]
fn patterns_without_a_part_are_errors() {
    let folder = scene([true; 4]);
    let error = |flags: &str| {
        refused(
            folder.path(),
            &joined(&["render", "s.toml", "-o", "t.png"], &split(flags)),
            1,
        )
    };
    let words = error("--hide Chiar.001");
    assert!(
        words.contains("no part of the scene has the name `Chiar.001`"),
        "{words}"
    );
    assert!(words.contains("did you mean `Chair.001`?"), "{words}");
    let words = error("--only * --hide *");
    assert!(words.contains("all parts of the scene are hidden"), "{words}");
    assert!(words.contains("`Table`"), "{words}");
    let args = split("render s.toml -o t.png --hide wood --obj-reader tobj");
    let words = refused(folder.path(), &args, 2);
    assert!(words.contains("--obj-reader own"), "{words}");
    let words = refused(folder.path(), &split("render s.toml -o t.png --set render.hide=3"), 2);
    assert!(words.contains("hide is not the name of a part"), "{words}");
}
