//! `embrasure check` and `embrasure explain`: findings, and the file and line of each.

use crate::support::program::{code, done, folder, json, printed, read_json, run, split, words, write_grey_png};
use crate::support::shared;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Report of `check --json` for a scene, and the exit code.
fn check(folder: &Path, scene: &str) -> (Value, i32) {
    let out = run(folder, &["check", scene, "--json"]);
    (json(&out), code(&out))
}

fn findings(report: &Value) -> &Vec<Value> {
    report["findings"].as_array().unwrap()
}

/// Text of a finding, `severity code file:line:column`. An unknown line or column is 0.
fn key(finding: &Value) -> String {
    let number = |key: &str| finding[key].as_u64().unwrap_or(0);
    let text = |key: &str| finding[key].as_str().unwrap().to_string();
    let (line, column) = (number("line"), number("column"));
    format!("{} {} {}:{line}:{column}", text("severity"), text("code"), text("file"))
}

const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl m\n";
const SCENE: &str = "version = 1\n[[object]]\nobj = \"a.obj\"\n";

/// Corners of a cube from `low` to `high`, as eight `v` lines.
fn corners(low: f32, high: f32) -> String {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|bit| if bit == 0 { low } else { high });
    let line = |[x, y, z]: [f32; 3]| format!("v {x} {y} {z}\n");
    (0..8).map(corner).map(line).collect()
}

/// Faces of the cube whose vertices have the eight indices from `first` on. They face outwards.
fn cube_faces(first: usize) -> Vec<String> {
    let faces = [
        [1, 3, 4, 2],
        [5, 6, 8, 7],
        [1, 2, 6, 5],
        [3, 7, 8, 4],
        [1, 5, 7, 3],
        [2, 4, 8, 6],
    ];
    let face = |f: [usize; 4]| format!("f {}\n", f.map(|i| (i + first - 1).to_string()).join(" "));
    faces.map(face).to_vec()
}

/// The face with reversed winding.
fn turned(face: &str) -> String {
    let words: Vec<&str> = face.split_whitespace().rev().collect();
    format!("f {}\n", words[..words.len() - 1].join(" "))
}

/// Asserts that a scene of an OBJ and an MTL text has exactly these findings, except notes on
/// defaults and rectangle lights.
fn assert_found(what: &str, obj: &str, mtl: &str, expected: &[&str]) {
    let folder = folder(&[("a.obj", obj), ("a.mtl", mtl), ("s.toml", SCENE)]);
    let (report, code) = check(folder.path(), "s.toml");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    let told = |key: &&String| !key.contains("note default-") && !key.contains("note rectangle-lights");
    let found: Vec<&String> = found.iter().filter(told).collect();
    assert_eq!(found, expected, "{what}: {report:#}");
    let is_wrong = expected.iter().any(|key| key.starts_with("error"));
    assert_eq!(code, i32::from(is_wrong), "{what}");
}

/// A face on the back of another face is a note if both look the same, or if the reader moves the
/// two faces apart, as in files whose walls are pairs of faces. Otherwise it is a warning.
#[test]
fn faces_on_the_back_of_others_are_a_note() {
    let library = "newmtl m\nKd 0.5\nnewmtl n\nKd 0.2\nnewmtl lamp\nKe 1 1 1\n";
    let single = "v 2 0 0\nv 3 0 0\nv 3 1 0\n".to_string() + &"v 4 0 0\nf 5 6 7\n".repeat(9);
    let cases = [
        (
            "two materials",
            "f 1 2 3 4\nusemtl n\nf 4 3 2 1\n".to_string(),
            "note two-sided a.obj:9:0",
        ),
        (
            "one material",
            "f 1 2 3\nf 2 1 3\n".to_string(),
            "note two-sided a.obj:8:0",
        ),
        (
            "a lamp",
            "usemtl lamp\nf 1 2 3\nf 2 1 3\n".to_string(),
            "note two-sided a.obj:9:0",
        ),
        (
            "a lamp of three faces",
            "usemtl lamp\nf 1 2 3\nf 2 1 3\nf 1 3 2\n".to_string(),
            "warning duplicate-face a.obj:9:0",
        ),
        (
            "a single pair of two materials",
            format!("f 1 2 3\nusemtl n\nf 2 1 3\nusemtl m\n{single}"),
            "warning duplicate-face a.obj:9:0",
        ),
    ];
    for (what, faces, expected) in cases {
        let folder = folder_of(&format!("{SQUARE}{faces}"), library);
        let (report, _) = check(folder.path(), "a.obj");
        let is_of_sides = |f: &&Value| ["two-sided", "duplicate-face"].contains(&f["code"].as_str().unwrap());
        let found: Vec<&Value> = findings(&report).iter().filter(is_of_sides).collect();
        assert!(found.iter().any(|f| key(f) == expected), "{what}: {report:#}");
        let help = found[0]["help"].as_str().unwrap_or("");
        assert_eq!(
            help.contains("delete"),
            expected.contains("duplicate"),
            "{what}: {help}"
        );
    }
}

#[test]
fn face_mistakes_have_their_line() {
    let plain = "newmtl m\nKd 0.5 0.5 0.5\n";
    let cases: &[(&str, &str, &[&str])] = &[
        ("sound", "f 1 2 3 4\n", &[]),
        (
            "wrong lines, all of them",
            "f 1 2 3 4\nf 1 2 x\n f 1  2/3 4\nv 1 z 2\n",
            &[
                "warning wrong-statement a.obj:8:7",
                "warning wrong-statement a.obj:9:7",
                "warning wrong-statement a.obj:10:5",
                "note unused-vertex a.obj:10:0",
            ],
        ),
        (
            "a continued line",
            "f 1 2 3 4\nf 1 2 \\\n  9\n",
            &["warning wrong-statement a.obj:9:3"],
        ),
        (
            "no area",
            "f 1 2 3 4\nv 2 0 0\nf 1 2 5\n",
            &["warning degenerate-face a.obj:9:0"],
        ),
        (
            "a corner twice, by another index",
            "f 1 2 3 4\nv 0 0 0\nf 1 2 5\n",
            &["warning repeated-vertex a.obj:9:0"],
        ),
        (
            "turned and over",
            "f 1 2 3 4\nf 3 2 1 4\nf 1 2 3\nf 2 3 1\n",
            &["note two-sided a.obj:8:0", "warning duplicate-face a.obj:10:0"],
        ),
        (
            "five corners in another order",
            "v 0.5 2 0\nf 1 2 3 5 4\nf 4 1 2 3 5\n",
            &["warning duplicate-face a.obj:9:0"],
        ),
        (
            "a bow",
            "v 0.2 3 0\nf 1 2 3 4\nf 1 2 5 3\n",
            // Both faces have a triangle with the corners 1, 2 and 3.
            &[
                "warning crossing-face a.obj:9:0",
                "warning repeated-triangles s.toml:0:0",
            ],
        ),
        ("concave", "v 0.5 0.1 0\nf 1 5 2 3 4\n", &[]),
        ("two corners", "f 1 2 3 4\nf 1 2\n", &["warning short-face a.obj:8:0"]),
        (
            "lines and points",
            "f 1 2 3 4\nl 1 2\np 1 2\nl 2 3\n",
            &["note skipped-elements a.obj:8:0"],
        ),
        (
            "no area at all",
            "f 1 2 1\nf 2 1 2\n",
            &[
                "note unused-vertex a.obj:4:0",
                "warning repeated-vertex a.obj:7:0",
                "warning no-visible-face s.toml:0:0",
            ],
        ),
        (
            "a vertex too many",
            "v 9 9 9\nf 1 2 3 4\n",
            &["note unused-vertex a.obj:7:0"],
        ),
        (
            "normals",
            "vn 0 0 -1\nvn 0 0 0\nf 1//1 2//1 3//1 4//1\nf 1//2 2//2 3//2 4//2\n",
            &[
                "warning bad-normal a.obj:8:0",
                "warning flipped-normal a.obj:9:0",
                "warning duplicate-face a.obj:10:0",
            ],
        ),
        (
            "an unknown material",
            "f 1 2 3 4\nusemtl nn\nf 1 2 4\n",
            &["warning missing-material a.obj:8:0"],
        ),
        (
            "an unknown word",
            "f 1 2 3 4\nfoo b.obj\n",
            &["warning unknown-statement a.obj:8:0"],
        ),
        (
            "a statement without effect",
            "f 1 2 3 4\ncall b.obj\n",
            &["warning ignored-statement a.obj:8:0"],
        ),
        (
            "a missing library",
            "mtllib b.mtl\nf 1 2 3 4\n",
            &["warning missing-library a.obj:7:0"],
        ),
    ];
    for (what, faces, expected) in cases {
        assert_found(what, &format!("{SQUARE}{faces}"), plain, expected);
    }
    let far = SQUARE.replace("v 0", "v 1e7").replace("v 1 ", "v 10000001 ") + "f 1 2 3 4\n";
    assert_found("far away", &far, plain, &["warning far-from-origin s.toml:0:0"]);
    // `render` also warns about the lost digits, unless the file is moved to the origin.
    let folder = folder_of(&far, plain);
    let render = "render a.obj --size 8x8 --spp 1 -q -o x.png --denoise=off";
    let said = |line: &str| words(&done(folder.path(), &split(line)));
    assert!(said(&format!("{render} --origin off")).contains("[far-from-origin]"));
    assert!(!said(render).contains("[far-from-origin]"));
}

/// Far from the origin, the transform of an instance to its local space loses digits. This is
/// reported even if the scene is as wide as its distance from the origin.
#[test]
fn instances_that_are_far_away_are_found() {
    let scene = |x: &str, size: &str| {
        let m = format!("[[{size}, 0, 0, {x}], [0, {size}, 0, 0], [0, 0, {size}, 0], [0, 0, 0, 1]]");
        format!("{SCENE}name = \"stone\"\ninstances = [{m}]\n[[object]]\nobj = \"b.obj\"\n")
    };
    let square = format!("{SQUARE}f 1 2 3 4\n");
    let plain = "v -1e5 0 0\nv 1e5 0 0\nv 1e5 1e5 1\nv -1e5 1e5 0\nusemtl m\nf 1 2 3 4\n";
    for (x, size, is_far) in [
        ("1e5", "1", true),
        ("1e3", "1", false),
        ("1e5", "1e3", false),
        ("1e3", "0.001", true),
    ] {
        let files = [
            ("s.toml", scene(x, size)),
            ("a.obj", square.clone()),
            ("b.obj", format!("mtllib a.mtl\n{plain}")),
        ];
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (*name, text.as_str())).collect();
        let folder = folder(&[&files[..], &[("a.mtl", "newmtl m\nKd 0.5 0.5 0.5\n")]].concat());
        let (report, _) = check(folder.path(), "s.toml");
        let found = findings(&report).iter().find(|f| f["code"] == "far-instance");
        assert_eq!(found.is_some(), is_far, "{x} {size}: {report}");
        let names_it = found.is_none_or(|f| f["message"].as_str().is_some_and(|m| m.contains("`stone`")));
        assert!(names_it, "{report}");
    }
}

#[test]
fn material_mistakes_have_their_line() {
    let square = format!("{SQUARE}f 1 2 3 4\n");
    let cases: &[(&str, &str, &[&str])] = &[
        (
            "wrong numbers, all of them",
            "newmtl m\nKd 0.5 red 0\nNs -1\n  d  1.5\nmap_Kd -s a.png\n",
            &[
                "warning wrong-statement a.mtl:2:8",
                "warning wrong-statement a.mtl:3:4",
                "note idle-number a.mtl:3:0",
                "warning wrong-statement a.mtl:4:6",
                "warning wrong-statement a.mtl:5:8",
            ],
        ),
        (
            "unknown words",
            "newmtl m\nKd 1\n  Kdd 1\nrefl a.png\n",
            &[
                "warning unknown-keyword a.mtl:3:3",
                "warning ignored-statement a.mtl:4:0",
            ],
        ),
        (
            "opacity",
            "newmtl m\nKd 1\nd 0.5\nTr 0.9\n",
            &["warning opacity a.mtl:4:0"],
        ),
        ("opacity of a lamp", "newmtl m\nKe 1\nd 0.5\n", &[]),
        (
            "too bright",
            "newmtl x\nKd 1\nnewmtl m\nKd 0.8\nKs 0.8\nillum 3\n",
            &["note unused-definition a.mtl:1:0", "warning scaled-material a.mtl:3:0"],
        ),
        (
            "highlights of lamps",
            "newmtl m\nKd 0.8\nKs 0.8\nNs 5\n",
            &["note mtl-dialect a.mtl:3:0"],
        ),
        (
            "a highlight without a shape",
            "newmtl m\nKd 0.8\nKs 0.1\nNs 0\n",
            &["note mtl-dialect a.mtl:4:0"],
        ),
        (
            "defined twice",
            "newmtl m\nKd 1\nnewmtl m\nKd 0.5\n",
            &["warning duplicate-material a.mtl:3:0"],
        ),
        (
            "exponent",
            "newmtl m\nKs 0.5\nNs 2000\n",
            &["note exponent-range a.mtl:3:0"],
        ),
        ("no exponent", "newmtl m\nKs 0.5\n", &[]),
        (
            "no highlight",
            "newmtl m\nKd 0.5\nKs 0.5\nNs 5\nillum 1\n",
            &["warning no-effect a.mtl:3:0", "note idle-number a.mtl:4:0"],
        ),
        (
            "a black mirror",
            "newmtl m\nKd 0.5\nillum 3\n",
            &["note illum a.mtl:3:0"],
        ),
        (
            "a missing picture",
            "newmtl m\nKd 0.5\nmap_Kd gone.png\n",
            &["warning missing-texture a.mtl:3:0"],
        ),
        (
            "invisible",
            "newmtl m\nKd 0.5\n\nd 0\n",
            &["warning invisible-scene a.mtl:4:0"],
        ),
        (
            "all light passes",
            "newmtl m\nTf 1 1 1\n",
            &["warning no-visible-face a.mtl:2:0"],
        ),
        (
            "no picture",
            "newmtl m\nKd 0.5\nmap_Kd a.mtl\n",
            &["warning unreadable-texture a.mtl:3:0"],
        ),
    ];
    for (what, mtl, expected) in cases {
        assert_found(what, &square, mtl, expected);
    }
}

/// A library material that the scene file replaces or patches counts as used if faces have its
/// name.
#[test]
fn overridden_materials_are_not_unused() {
    let mtl = "newmtl m\nKd 0.5\nnewmtl patched\nKd 0.5\nnewmtl idle\nKd 0.5\n";
    let obj = format!("{SQUARE}f 1 2 3\nusemtl patched\nf 1 3 4\n");
    let scene = "version = 1\n[[object]]\nobj = \"a.obj\"\n[material.m]\ndiffuse = [0.1, 0.2, 0.3]\n[patch.patched]\nroughness = 0.3\n\
                 [material.idle]\ndiffuse = [1, 1, 1]\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl), ("a.toml", scene)]);
    let (report, _) = check(folder.path(), "a.toml");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    let unused: Vec<&String> = found.iter().filter(|f| f.contains("unused")).collect();
    assert_eq!(
        unused,
        [
            "note unused-definition a.mtl:5:0",
            "warning unused-material a.toml:8:11"
        ]
    );
}

#[test]
fn texture_case_and_coordinates_are_checked() {
    let folder = folder(&[
        ("a.obj", &format!("{SQUARE}f 1 2 3 4\n")),
        ("a.mtl", "newmtl m\nKd 0.5\nmap_Kd .\\Wall.png\n"),
    ]);
    write_grey_png(&folder.path().join("wall.png"), &[200]);
    let (report, code) = check(folder.path(), "a.obj");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    assert!(found.contains(&"note other-case a.mtl:3:0".into()), "{found:?}");
    assert!(
        found.contains(&"warning missing-texture-coordinates a.obj:7:0".into()),
        "{found:?}"
    );
    assert_eq!(code, 0);
    let out = run(folder.path(), &["explain", "a.obj", "m", "--json"]);
    let facts = json(&out);
    let map = &facts["textures"]["diffuse"];
    assert_eq!(
        (&map["file"], &map["width"]),
        (&"./wall.png".into(), &1.into()),
        "{facts:#}"
    );
}

/// Names that differ from their files only in backslashes are not reported as other letter case.
#[test]
fn backslashes_are_reported_as_such() {
    let folder = folder(&[
        ("a.obj", &format!("{SQUARE}f 1 2 3 4\n")),
        ("a.mtl", "newmtl m\nKd 0.5\nmap_Kd .\\wall.png\n"),
    ]);
    write_grey_png(&folder.path().join("wall.png"), &[200]);
    let (report, _) = check(folder.path(), "a.obj");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    assert!(found.contains(&"note backslashes a.mtl:3:0".into()), "{found:?}");
    assert!(!found.iter().any(|key| key.contains("other-case")), "{found:?}");
}

#[test]
fn ambiguous_library_names_are_reported() {
    let plain = "newmtl m\nKd 0.5\n";
    let obj = format!("{SQUARE}f 1 2 3 4\n");
    let folder = folder(&[("a.obj", &obj), ("A.mtl", plain), ("A.MTL", plain)]);
    if folder.path().join("a.mtl").exists() {
        println!("skipped: names of files have no case here");
        return;
    }
    let (report, _) = check(folder.path(), "a.obj");
    let finding = findings(&report).iter().find(|f| f["code"] == "other-case").unwrap();
    assert_eq!(key(finding), "warning other-case a.obj:1:0");
    let message = finding["message"].as_str().unwrap();
    assert!(message.contains("`A.MTL`, the first of 2 files"), "{message}");
}

#[test]
fn faulty_glass_and_lamp_meshes_are_reported() {
    let glass = "newmtl m\nNi 1.5\nTf 1 1 1\nillum 7\n";
    let lamp = "newmtl m\nKe 1 1 1\n";
    let matte = "newmtl m\nKd 0.5\n";
    // Line numbers of faces start at 11.
    let head = corners(0.0, 1.0) + "mtllib a.mtl\nusemtl m\n";
    let outwards = cube_faces(1);
    let inwards: Vec<String> = outwards.iter().map(|face| turned(face)).collect();
    let mut mixed = outwards.clone();
    mixed[2] = turned(&mixed[2]);
    let open = outwards[..5].to_vec();
    let crowded: Vec<String> = outwards.iter().cloned().chain(["f 1 2 8 7\n".into()]).collect();
    let cases: &[(&str, &[String], &str, &[&str])] = &[
        ("sound glass", &outwards, glass, &[]),
        ("sound lamp", &outwards, lamp, &[]),
        ("open glass", &open, glass, &["warning open-shell a.obj:11:0"]),
        ("open lamp", &open, lamp, &[]),
        ("glass inside out", &inwards, glass, &["warning inside-out a.obj:11:0"]),
        ("lamp inside out", &inwards, lamp, &["warning light-inwards a.obj:11:0"]),
        ("mixed glass", &mixed, glass, &["warning mixed-winding a.obj:13:0"]),
        ("mixed lamp", &mixed, lamp, &["warning mixed-winding a.obj:13:0"]),
        ("matte", &mixed, matte, &[]),
    ];
    for (what, faces, mtl, expected) in cases {
        assert_found(what, &format!("{head}{}", faces.concat()), mtl, expected);
    }
    let folder = folder(&[("a.obj", &format!("{head}{}", crowded.concat())), ("a.mtl", glass)]);
    let (report, _) = check(folder.path(), "a.obj");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    assert!(
        found.iter().any(|key| key.starts_with("warning non-manifold")),
        "{found:?}"
    );

    // A cavity inside a closed body faces inwards. A cube is closed even if each face has vertices
    // of its own, at equal positions.
    let inner: String = cube_faces(9).iter().map(|face| turned(face)).collect();
    let hollow = format!("{}{}mtllib a.mtl\nusemtl m\n", corners(0.0, 1.0), corners(0.25, 0.75));
    assert_found(
        "hollow glass",
        &format!("{hollow}{}{inner}", outwards.concat()),
        glass,
        &[],
    );
    let corner_of_its_own: String = (0..6).map(|_| corners(0.0, 1.0)).collect();
    let split: String = (0..6).map(|i| cube_faces(1 + 8 * i)[i].clone()).collect();
    let obj = format!("{corner_of_its_own}mtllib a.mtl\nusemtl m\n{split}");
    let folder = folder_of(&obj, glass);
    let (report, _) = check(folder.path(), "a.obj");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    assert!(!found.iter().any(|key| key.contains("-shell")), "{found:?}");
}

/// A panel close to the ceiling whose front faces the ceiling is reported, with the flag that turns
/// it over. A panel that faces the room is not.
#[test]
fn lamps_that_face_the_ceiling_are_reported() {
    let room: String = cube_faces(1).iter().map(|face| turned(face)).collect();
    let library = "newmtl white\nKd 0.5\nnewmtl lamp\nKe 1 1 1\n";
    let panel = "v 0.3 0.99 0.3\nv 0.7 0.99 0.3\nv 0.7 0.99 0.7\nv 0.3 0.99 0.7\n";
    for (face, is_backward) in [("f 9 12 11 10\n", true), ("f 9 10 11 12\n", false)] {
        let obj = format!(
            "mtllib a.mtl\n{}{panel}o Room\nusemtl white\n{room}o Panel\nusemtl lamp\n{face}",
            corners(0.0, 1.0)
        );
        let folder = folder_of(&obj, library);
        let (report, _) = check(folder.path(), "a.obj");
        let found = findings(&report).iter().find(|f| f["code"] == "light-backward");
        assert_eq!(found.is_some(), is_backward, "{face}: {report:#}");
        if let Some(finding) = found {
            assert!(finding["message"].as_str().unwrap().contains("`Panel`"), "{finding}");
            assert_eq!(finding["help"], "--part 'Panel.rotate=[180,0,0]' turns it over");
        }
    }
}

fn folder_of(obj: &str, mtl: &str) -> TempDir {
    folder(&[("a.obj", obj), ("a.mtl", mtl)])
}

#[test]
fn all_mistakes_of_a_scene_file_are_listed() {
    let scene = "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [\n  0, 0, 0]\nfocus = [\n 3,\n 4]\n[image]\nwidth = \"a\"\n\
                 [rendr]\nsamples = 3\n[render]\nintegrator = \"paths\"\n[[object]]\nobj = \"a.obj\"\n[material.unknown]\n\
                 diffuse = [0, 0, 0]\n[[light]]\ntype = \"point\"\n[[light]]\ntype = \"sun\"\n";
    let folder = folder(&[
        ("s.toml", scene),
        ("a.obj", &format!("{SQUARE}f 1 2 3 4\nf 1 2 7\n")),
        ("a.mtl", "newmtl m\nKd 0.5\n"),
    ]);
    let (report, code) = check(folder.path(), "s.toml");
    let found: Vec<String> = findings(&report).iter().map(key).collect();
    let found: Vec<&str> = found
        .iter()
        .map(String::as_str)
        .filter(|key| !key.contains("note"))
        .collect();
    let expected = [
        "warning wrong-statement a.obj:8:7",
        "error scene-file s.toml:6:1",
        "error scene-file s.toml:10:9",
        "error scene-file s.toml:11:2",
        "error scene-file s.toml:14:14",
        "warning unused-material s.toml:17:11",
        "error wrong-light s.toml:20:8",
        "error wrong-light s.toml:22:8",
    ];
    assert_eq!(found, expected, "{report:#}");
    assert_eq!(code, 1);
    // The first error of `render` is one of the errors that `check` reports.
    let out = run(folder.path(), &["render", "s.toml", "--spp", "1"]);
    assert!(words(&out).contains("s.toml:11:2: unknown key `rendr`"));
}

#[test]
fn cameras_that_see_nothing_are_found() {
    let camera =
        |position: &str, look_at: &str| format!("{SCENE}[camera]\nposition = {position}\nlook_at = {look_at}\n");
    let room = corners(-10.0, 10.0) + &corners(-0.1, 0.1) + "mtllib a.mtl\nusemtl m\n";
    let inwards: String = cube_faces(1).iter().map(|face| turned(face)).collect();
    let obj = format!("{room}{inwards}{}", cube_faces(9).concat());
    let cases = [
        (
            camera("[0, 0, 30]", "[0, 0, 40]"),
            Some("warning empty-view s.toml:0:0"),
        ),
        (
            camera("[0, 0, 0.01]", "[0, 0, 5]"),
            Some("warning camera-inside s.toml:0:0"),
        ),
        (camera("[0, 0, 5]", "[0, 0, 0]"), None),
    ];
    for (scene, expected) in cases {
        let folder = folder(&[("s.toml", &scene), ("a.obj", &obj), ("a.mtl", "newmtl m\nKd 0.5\n")]);
        let (report, _) = check(folder.path(), "s.toml");
        let found: Vec<String> = findings(&report)
            .iter()
            .map(key)
            .filter(|k| !k.contains("note"))
            .collect();
        assert_eq!(found.first().map(String::as_str), expected, "{report:#}");
    }
}

#[test]
fn many_findings_of_a_kind_are_one() {
    let text = format!("{SQUARE}{}", "f 1 2 3\n".repeat(2001));
    let folder = folder_of(&text, "newmtl m\nKd 0.5\n");
    let (report, code) = check(folder.path(), "a.obj");
    let duplicate = findings(&report)
        .iter()
        .find(|f| f["code"] == "duplicate-face")
        .unwrap();
    assert_eq!((&duplicate["count"], &duplicate["line"]), (&2000.into(), &8.into()));
    let places = duplicate["places"].as_array().unwrap();
    assert!((2..10).contains(&places.len()) && places[1]["line"] == 9, "{places:?}");
    assert_eq!(code, 0);
    let library: String = (0..500)
        .map(|i| format!("newmtl m\nKd 1\nd 0.1\nTr 0.5\nNs x\nNi x{i}\n"))
        .collect();
    fs::write(folder.path().join("a.mtl"), library).unwrap();
    let (report, _) = check(folder.path(), "a.obj");
    let opacity: Vec<&Value> = findings(&report).iter().filter(|f| f["code"] == "opacity").collect();
    assert_eq!((opacity.len(), &opacity[0]["count"]), (1, &500.into()));
    let wrong: Vec<&Value> = findings(&report)
        .iter()
        .filter(|f| f["code"] == "wrong-statement")
        .collect();
    assert_eq!(
        (wrong.len(), &wrong[0]["count"]),
        (21, &481.into()),
        "the file comes before its lines"
    );
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKd 0.5\n").unwrap();
    let wrong = format!("{SQUARE}f 1 2 3\n{}", "f 1 2 9\n".repeat(1000));
    fs::write(folder.path().join("a.obj"), wrong).unwrap();
    let out = run(folder.path(), &["check", "a.obj"]);
    let text = printed(&out);
    assert!(
        text.contains("a.obj: warning: 980 more statements are wrong [wrong-statement]"),
        "{text}"
    );
    assert!(text.lines().count() < 70, "{text}");
    assert_eq!(out.status.code(), Some(0));
}

#[test]
fn check_lists_all_warnings_of_render() {
    let folder = folder(&[
        (
            "a.obj",
            &format!("mtllib gone.mtl\n{SQUARE}f 1 2 3 4\nf 1 2\nusemtl n\nf 1 2 3\nf 1 1 2\nq\n"),
        ),
        ("a.mtl", "newmtl m\nKd 0.8\nKs 0.8\nd 0.5\nTr 0.9\nmap_Kd gone.png\nq\n"),
    ]);
    let args = split("render a.obj --spp 1 --size 8x8 --stats x.json -q");
    done(folder.path(), &args);
    let stats = read_json(&folder.path().join("x.json"));
    let warnings = stats["warnings"].as_array().unwrap();
    assert!(warnings.len() >= 8, "{warnings:?}");
    let (report, _) = check(folder.path(), "a.obj");
    let known = |warning: &str| {
        let said = |f: &Value| warning.contains(f["message"].as_str().unwrap());
        // `render` counts triangles without area, and triangles without texture coordinates.
        // `check` has the lines of the faces, so the texts differ.
        let counts = ["triangles without area", "have no texture coordinates"];
        findings(&report).iter().any(said) || counts.iter().any(|count| warning.contains(count))
    };
    for warning in warnings {
        assert!(known(warning.as_str().unwrap()), "{warning}: {report:#}");
    }
}

#[test]
fn clean_scenes_have_no_findings() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for scene in [
        "cornell-box.toml",
        "closed-box.toml",
        "depth-of-field.toml",
        "furnace.toml",
        "veach-plates.toml",
    ] {
        let (report, code) = check(&scenes, scene);
        let summary = &report["summary"];
        assert_eq!(
            (&summary["errors"], &summary["warnings"]),
            (&0.into(), &0.into()),
            "{report:#}"
        );
        assert_eq!(code, 0);
        assert!(report["triangles"].as_u64() > Some(0) && report["memory"]["peak"].as_u64() > Some(1_000_000));
    }
}

#[test]
fn light_power_matches_a_lambertian_lamp() {
    let folder = folder_of(&format!("{SQUARE}f 1 2 3 4\n"), "newmtl m\nKe 3 3 3\n");
    let (report, _) = check(folder.path(), "a.obj");
    let told = findings(&report)
        .iter()
        .filter(|finding| finding["code"] == "rectangle-lights")
        .count();
    assert_eq!(told, 1, "{report:#}");
    for kind in ["rectangle", "total"] {
        let watts = report["light_power_w"][kind].as_f64().unwrap();
        assert!((watts - 3.0 * std::f64::consts::PI).abs() < 1e-5, "{watts}");
    }
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn awkward_files_are_checked_without_harm() {
    let folder = shared("scenes/awkward-obj");
    let mut files = Vec::new();
    let mut folders: Vec<PathBuf> = vec![folder.clone()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap().map(|e| e.unwrap().path()) {
            match entry.extension().is_some_and(|e| e == "obj") {
                _ if entry.is_dir() => folders.push(entry),
                true => files.push(entry),
                false => {}
            }
        }
    }
    assert!(files.len() > 70, "{} files", files.len());
    for file in files {
        let start = Instant::now();
        let (report, code) = check(&folder, file.to_str().unwrap());
        assert!(start.elapsed() < Duration::from_secs(10), "{}", file.display());
        let errors = report["summary"]["errors"].as_u64().unwrap();
        assert_eq!(code, i32::from(errors > 0), "{}", file.display());
        for finding in findings(&report) {
            let is_text = |key: &str| finding[key].as_str().is_some_and(|text| !text.is_empty());
            assert!(is_text("code") && is_text("file") && is_text("message"), "{finding}");
        }
    }
}

/// Compares the memory forecast of `check` with the largest resident size of a render.
// The backend `brute` would take minutes.
#[cfg(any(feature = "embree", feature = "obvhs"))]
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "needs /proc/self/status")]
#[cfg_attr(not(long), ignore = "long")]
fn memory_is_forecast() {
    let n = 400;
    let mut text = String::new();
    for y in 0..=n {
        for x in 0..=n {
            text += &format!("v {x} {y} {}\n", (x * 7 + y * 3) % 5);
        }
    }
    for y in 0..n {
        for x in 0..n {
            let i = y * (n + 1) + x + 1;
            text += &format!("f {i} {} {} {}\n", i + 1, i + n + 2, i + n + 1);
        }
    }
    let scene = "version = 1\n[[object]]\nobj = \"a.obj\"\n";
    let folder = folder(&[("a.obj", &text), ("s.toml", scene)]);
    let (report, _) = check(folder.path(), "s.toml");
    assert_eq!(report["triangles"], 2 * n * n);
    // The image of a bare OBJ is denoised, which needs more memory.
    let (bare, _) = check(folder.path(), "a.obj");
    assert!(bare["memory"]["picture"].as_u64() > report["memory"]["picture"].as_u64());
    assert!(bare["memory"]["peak"].as_u64() > report["memory"]["peak"].as_u64());
    // The peak depends on the allocator and on the other programs that run. The lowest of three
    // peaks counts.
    let stats = || {
        done(
            folder.path(),
            &split("render s.toml --spp 1 --stats x.json -q -o x.exr"),
        );
        read_json(&folder.path().join("x.json"))
    };
    let peak_of = |stats: &Value| stats["peak_rss_bytes"].as_f64().unwrap();
    let runs = [stats(), stats(), stats()];
    let stats = runs.iter().min_by(|a, b| peak_of(a).total_cmp(&peak_of(b))).unwrap();
    let (peak, forecast) = (peak_of(stats), report["memory"]["peak"].as_f64().unwrap());
    println!("forecast {forecast}, measured {peak}");
    // The forecast is an estimate.
    assert!(
        (0.7..1.5).contains(&(forecast / peak)),
        "forecast {forecast}, measured {peak}"
    );
    let bvh = report["memory"]["acceleration"].as_f64().unwrap() / stats["bvh_bytes"].as_f64().unwrap();
    assert!((0.75..1.5).contains(&bvh), "{bvh}");
}

#[test]
fn usage_and_scene_errors_have_exit_codes() {
    let folder = folder_of(&format!("{SQUARE}f 1 2 3 4\n"), "newmtl m\nKd 0.5\n");
    let code = |args: &[&str]| run(folder.path(), args).status.code().unwrap();
    assert_eq!(code(&["check"]), 2);
    assert_eq!(code(&["check", "a.obj", "--mtl-dialect", "huh"]), 2);
    assert_eq!(code(&["check", "a.obj"]), 0);
    for (scene, name) in [
        ("gone.obj", "unreadable-file"),
        ("gone.toml", "scene-file"),
        ("a.mtl", "unreadable-file"),
    ] {
        let (report, code) = check(folder.path(), scene);
        assert_eq!((code, &findings(&report)[0]["code"]), (1, &name.into()), "{report:#}");
    }
    assert_eq!(code(&["explain", "a.obj"]), 2);
    assert_eq!(code(&["explain", "a.obj", "m", "--size", "0x3"]), 2);
    assert_eq!(code(&["explain", "a.obj", "m", "-o", "x.jpg"]), 2);
    let out = run(folder.path(), &["explain", "a.obj", "M2"]);
    let words = String::from_utf8(out.stderr).unwrap();
    assert!(
        out.status.code() == Some(1) && words.contains("the nearest names are m"),
        "{words}"
    );
}

#[test]
fn explain_lists_lobes_and_renders_a_sphere() {
    let mtl = "newmtl x\nKd 1\nnewmtl m\nKd 0.25 0.25 0.25\nKs 0.5 0.5 0.5\nNs 40\nKe 2 2 2\n";
    let folder = folder_of(&format!("{SQUARE}f 1 2 3 4\n"), mtl);
    let out = run(folder.path(), &["explain", "a.obj", "m", "--json"]);
    let facts = json(&out);
    assert_eq!((&facts["defined"], &facts["triangles"]), (&"a.mtl:3".into(), &2.into()));
    let power = facts["power_w"].as_f64().unwrap();
    assert!((power - 2.0 * std::f64::consts::PI).abs() < 1e-5, "{power}");
    let lobes = facts["lobes"].as_array().unwrap();
    let names: Vec<&str> = lobes.iter().map(|l| l["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["Lambert", "Phong"]);
    // A lobe is chosen with a probability proportional to its reflectance. At normal incidence
    // nearly all of the sharp lobe is above the horizon.
    for (lobe, chosen, albedo) in [(&lobes[0], 1.0 / 3.0, 0.25), (&lobes[1], 2.0 / 3.0, 0.5)] {
        let probability = lobe["probability"]["normal"].as_f64().unwrap();
        assert!((probability - chosen).abs() < 1e-3, "{lobe}");
        let share = lobe["albedo"]["normal"][0].as_f64().unwrap();
        assert!((share / albedo - 1.0).abs() < 0.06, "{lobe}");
    }
    // Place the same OBJ twice in the scene
    let twice = format!("{SCENE}[[object]]\nobj = \"a.obj\"\ntransform = {{ translate = [3, 0, 0], scale = 2 }}\n");
    fs::write(folder.path().join("s.toml"), twice).unwrap();
    let out = run(folder.path(), &["explain", "s.toml", "m", "--json"]);
    let facts = json(&out);
    let power = facts["power_w"].as_f64().unwrap();
    assert!((power - 10.0 * std::f64::consts::PI).abs() < 1e-4, "{facts:#}");
    assert_eq!(facts["triangles"], 4);

    for name in ["x.exr", "x.png"] {
        let args = [
            "explain", "a.obj", "m", "-o", name, "--size", "32x24", "--spp", "4", "-q",
        ];
        done(folder.path(), &args);
    }
    let pixels = crate::support::read_rgb(&folder.path().join("x.exr"));
    assert_eq!(pixels[0].len(), 32 * 24);
    // The sphere emits; the sky is dim.
    assert!(pixels[0][12 * 32 + 16] > 2.0 && pixels[0][16] < 0.5, "{pixels:?}");
    let args = split("explain a.obj m -o y.exr --size 32x24 --spp 4 -q --threads 1");
    done(folder.path(), &args);
    assert_eq!(pixels, crate::support::read_rgb(&folder.path().join("y.exr")));
}

/// Numbers have few digits. A roughness is listed only for lobes that have a roughness. Below a
/// coat, the albedos of the lobes sum to the total albedo.
#[test]
fn explain_prints_short_numbers() {
    let mtl = "newmtl x\nKd 1\nnewmtl m\nKd 0.25 0.25 0.25\nKs 0.5 0.5 0.5\nNs 40\n";
    let folder = folder_of(&format!("{SQUARE}f 1 2 3 4\n"), mtl);
    let of = |flags: &str| {
        let args = split(flags);
        let args = args.iter().flat_map(|flag| ["--material", *flag]);
        let args: Vec<&str> = ["explain", "a.obj", "m"].into_iter().chain(args).collect();
        let text = printed(&done(folder.path(), &args));
        let facts = json(&done(folder.path(), &[&args[..], &["--json"]].concat()));
        (text, facts)
    };
    let (text, facts) = of("");
    assert!(!text.contains("roughness") && facts["roughness"].is_null(), "{text}");
    assert!(text.contains("\n  diffuse       [0.25, 0.25, 0.25]\n"), "{text}");
    assert!(text.contains("\n  opacity       1\n"), "{text}");

    let (text, _) = of("m.metallic=0 m.roughness=0.3");
    assert!(text.contains(", f0 0.04, roughness 0.3\n"), "{text}");
    assert!(text.contains("\n  roughness     0.3\n"), "{text}");

    for flags in [
        "m.metallic=0 m.roughness=0.5 m.clearcoat=1 m.clearcoat_roughness=0.2",
        "m.clearcoat=1",
        "m.sheen=0.8 m.clearcoat=0.7 m.clearcoat_roughness=0.5",
    ] {
        let (text, facts) = of(flags);
        // The roughness of a coat is not the roughness of the material.
        let has_roughness = flags.contains("m.roughness");
        assert_eq!(text.contains("\n  roughness "), has_roughness, "{text}");
        for (view, degrees) in [("normal", 0.0), ("60_degrees", 60.0)] {
            let total = facts["albedo_by_angle"].as_array().unwrap();
            let total = total.iter().find(|entry| entry["degrees"] == degrees).unwrap();
            let total = total["albedo"][1].as_f64().unwrap();
            let lobes = facts["lobes"].as_array().unwrap();
            let sum: f64 = lobes.iter().map(|lobe| lobe["albedo"][view][1].as_f64().unwrap()).sum();
            assert!(
                (sum - total).abs() < 2e-3,
                "{flags}, {view}: {sum} of {total}: {facts:#}"
            );
        }
    }
}

/// A missing file is reported once, with its number of uses, the materials that use it, and what is
/// rendered instead. Invisible materials and missing lights are reported. With `-v`, the parts of
/// the memory are listed.
#[test]
fn text_report_groups_findings() {
    let obj = format!("{SQUARE}f 1 2 3 4\nusemtl n\nf 1 2 3 4\nusemtl o\nf 1 2 3 4\nusemtl p\nf 1 2 3 4\n");
    let mtl = "newmtl m\nmap_Kd gone.png\nmap_Bump gone.png\nnewmtl n\nmap_Kd gone.png\nnewmtl o\nKd 1\nd 0\nnewmtl p\nmap_d holes.png\n";
    let folder = folder(&[("a.obj", &obj), ("a.mtl", mtl), ("s.toml", SCENE)]);
    let (report, _) = check(folder.path(), "a.obj");
    let missing: Vec<&Value> = findings(&report)
        .iter()
        .filter(|f| f["code"] == "missing-texture")
        .collect();
    let told: Vec<(u64, &str)> = missing
        .iter()
        .map(|f| (f["count"].as_u64().unwrap(), f["message"].as_str().unwrap()))
        .collect();
    assert_eq!(
        told,
        [
            (
                3,
                "texture `gone.png` is missing; `m`, `n` are rendered in one plain colour; `m` is rendered flat, without bumps"
            ),
            (1, "texture `holes.png` is missing; `p` is rendered without holes"),
        ]
    );
    let places: Vec<u64> = missing[0]["places"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["line"].as_u64().unwrap())
        .collect();
    assert_eq!(places, [2, 3, 5]);
    let keys: Vec<String> = findings(&report).iter().map(key).collect();
    assert!(
        keys.contains(&"warning invisible-material a.mtl:8:0".to_string()),
        "{keys:?}"
    );

    let text = |args: &[&str]| printed(&run(folder.path(), &[&["check"], args].concat()));
    let brief = text(&["a.obj"]);
    assert!(
        brief.contains("light: none in the file; `embrasure render` adds light"),
        "{brief}"
    );
    assert!(
        !brief.contains("MB: ") && brief.contains("; -v lists its parts"),
        "{brief}"
    );
    assert!(text(&["s.toml"]).contains("light: none in the file; white light"));
    let verbose = text(&["-v", "a.obj"]);
    assert!(verbose.contains("    MB: scene "), "{verbose}");
    fs::write(folder.path().join("a.mtl"), "newmtl m\nKe 1 1 1\n").unwrap();
    assert!(text(&["a.obj"]).contains(" W ("));
}
