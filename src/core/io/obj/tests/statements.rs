use super::{ReadObj, SQUARE, corners, load, load_strictly, mesh};
use crate::math::Vec3;

#[test]
fn line_ends_comments_and_continuations_are_read() {
    let text = format!("\u{feff}{SQUARE}usemtl a # red\nf 1 2 3 # one\nf 1 2 \\\n3 4\nf 1 2\n");
    for text in [text.clone(), text.replace('\n', "\r\n"), text.replace('\n', "\r")] {
        let file = load(&text).unwrap();
        assert_eq!(file.groups[0].material.as_deref(), Some("a"));
        assert_eq!(file.groups[0].mesh.triangles.len(), 3);
        let warning = &file.warnings[0];
        assert!(warning.contains("t.obj:9: 1 face of fewer than 3"), "{warning}");
    }
}

#[test]
fn unusual_number_formats_are_read() {
    let plain = mesh("v 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\nf 1 2 3\n");
    let texts = [
        "v +1 .5 -2e3\nv 5. -0 0e9\nv 0 25E-2 0\nf 1 2 3",
        "  v\t1.0  5e-1\t-2000.000 0.7\t\r\nv 5 0 0 1\nv 0 0.2500000000000000000000000000001 0\n\tf\t-3 +2  -1 ",
        "v 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\nfo 1 2 3 # old",
        "f 1// 2/ 3\nv 1 0.5 -2000\nv 5 0 0\nv 0 0.25 0\n",
    ];
    for text in texts {
        let mesh = mesh(text);
        assert_eq!(
            (mesh.triangles.len(), corners(&mesh, 0)),
            (1, corners(&plain, 0)),
            "{text}"
        );
    }
    let latin = load(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl Wei\xdf\nf 1 2 3\n").unwrap();
    assert_eq!(latin.groups[0].material.as_deref(), Some("Weiß"));
}

#[test]
fn lines_and_points_are_not_faces() {
    let file = load(format!("{SQUARE}l 1 2 3 4\np 1 2\nf 1 2 3\nl 1 2\n")).unwrap();
    assert_eq!(file.groups[0].mesh.triangles.len(), 1);
    let messages = "t.obj:5: 2 lines (`l`) and 2 points (`p`) are skipped, the first in this line";
    assert!(
        file.warnings.len() == 1 && file.warnings[0].contains(messages),
        "{:?}",
        file.warnings
    );
}

#[test]
fn unread_statements_have_one_warning_each() {
    let curve = "vp 0.5\ncstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\ndeg 3\nsurf 0 1 0 1 1 2 3 4\n";
    let other = "call a.obj\ncsh -ls\ncall b.obj\n";
    let file = load(format!("{SQUARE}f 1 2 3\ns x\n{curve}{other}s y\n")).unwrap();
    assert_eq!(file.warnings.len(), 4, "{:?}", file.warnings);
    for expected in [
        "t.obj:6: 2 smoothing groups",
        "t.obj:15: 2 statements `call` have no effect, the first in this line: other files are not read",
        "t.obj:16: `csh` has no effect: commands are not run",
        "t.obj:10: 1 curve (`curv`) and 1 surface (`surf`) are skipped, the first in this line",
    ] {
        let is_told = file.warnings.iter().any(|warning| warning.contains(expected));
        assert!(is_told, "{expected}: {:?}", file.warnings);
    }
}

#[test]
fn zero_bytes_at_the_end_are_ignored() {
    let file = load(format!("{SQUARE}f 1 2 3\n\0\0\0\n")).unwrap();
    assert_eq!(file.warnings, Vec::<String>::new());
    let file = load(format!("{SQUARE}f 1 2 3\ncall a.obj\n")).unwrap();
    assert!(
        file.warnings[0].contains("t.obj:6: `call` has no effect"),
        "{:?}",
        file.warnings
    );
}

#[test]
fn invalid_statement_is_an_error_with_its_position() {
    let cases = [
        ("f 1 2 9\n", 5, "9"),
        ("f 1 2 0\n", 5, "0"),
        ("f 1 2 -7\n", 5, "-7"),
        ("f 1 2 x\n", 5, "x"),
        ("vn 0 0 1\nf 1//4 2//1 3//1\n", 6, "1//4"),
        ("# c\nv 1 nan 0\nf 1 2 5\n", 6, "nan"),
        ("v 1 2\nf 1 2 3\n", 5, "v 1 2"),
        ("v 1 2 inf\nf 1 2 5\n", 5, "inf"),
        ("v 1 2 a\nf 1 2 3\n", 5, "a"),
        ("vn 0 1\nf 1 2 3\n", 5, "vn 0 1"),
        ("v 1 2 1e39\nf 1 2 3\n", 5, "1e39"),
        ("v 1 2 -1.#IND\nf 1 2 3\n", 5, "-1.#IND"),
        ("v 1,5 2 3\nf 1 2 3\n", 5, "1,5"),
        ("vt\nf 1 2 3\n", 5, "vt"),
        ("vt 0 x\nf 1 2 3\n", 5, "`x`"),
        ("f 1/1 2/1 3/1\n", 5, "1/1"),
        ("f 1/2/3/4 2 3\n", 5, "1/2/3/4"),
        ("f /1 2 3\n", 5, "/1"),
        ("f 1 2 99999999999999999999\n", 5, "99999999999999999999"),
        ("f 1 2 -9223372036854775808\n", 5, "-9223372036854775808"),
        ("f 1 2 \\\n x\nf y 1 2\n", 6, "x"),
        ("f 1 2 3\nf 1 2 9\nv 1\n", 6, "9"),
        ("f 1 2 \u{7}\n", 5, "`\u{fffd}`"),
    ];
    for (rest, line, value) in cases {
        let error = load_strictly(format!("{SQUARE}{rest}")).unwrap_err();
        assert_eq!(error.position.map(|p| p.line), Some(line), "{rest:?}: {error}");
        assert!(error.message.contains(value), "{rest:?}: {error}");
        assert!(error.help.is_some(), "{rest:?}: {error}");
    }
    let long = load(format!("{SQUARE}f 1 2 {}\n", "9x".repeat(100_000))).unwrap_err();
    assert!(
        long.message.chars().count() < 100 && long.message.contains("9x9x"),
        "{long}"
    );
}

#[test]
fn wrong_index_of_a_corner_is_treated_as_missing() {
    let cases = [
        ("f 1 2 9\n", "", &["the face is left out"][..]),
        ("f 1 2 x\n", "", &["the face is left out"]),
        (
            "f 1/1 2/1 3/4\n",
            "f 1/1 2/1 3\n",
            &["its texture coordinates count as 0 0"],
        ),
        (
            "f 1/x 2/1 3/1\n",
            "f 1 2/1 3/1\n",
            &["texture coordinate index in `1/x` is not a number"],
        ),
        (
            "f 1/9/9 2/1/9 3/1/1\n",
            "f 1 2/1 3/1/1\n",
            &["coordinates count as 0 0", "its normal is computed"],
        ),
        ("f 1//1 2//1 3//0\n", "f 1//1 2//1 3\n", &["its normal is computed"]),
        (
            "vt x\nf 1/2 2/2 3/2\n",
            "vt 0\nf 1/2 2/2 3/2\n",
            &["`x` is not a number; the texture coordinate counts as 0 0"],
        ),
    ];
    for (wrong, right, words) in cases {
        let of = |lines: &str| load(format!("{SQUARE}vt 0 1\nvn 0 0 1\nf 1/1/1 2/1/1 4/1/1\n{lines}")).unwrap();
        let (found, expected) = (of(wrong), of(right));
        let meshes = |read: &ReadObj| format!("{:?}", read.groups);
        assert_eq!(meshes(&found), meshes(&expected), "{wrong}");
        assert_eq!(expected.warnings.len(), 0, "{wrong}");
        assert_eq!(found.warnings.len(), words.len(), "{wrong}: {:?}", found.warnings);
        for (warning, words) in found.warnings.iter().zip(words) {
            assert!(warning.contains(words), "{warning}");
        }
    }
    // A file without faces is an error.
    assert!(load(format!("{SQUARE}f 1 2 9\n")).is_err());
}

#[test]
fn faces_with_wrong_positions_are_left_out() {
    // The file has faces with wrong and with valid positions, with two materials and in smoothing
    // groups. One of the wrong positions is unused.
    for wrong in ["v nan 1 0", "v 0 x 0", "v 0 1", "v 0 0 1e999"] {
        let lines = format!(
            "v 2 0 0\n{wrong}\n{wrong}\nf 1 2 3\ns 1\nf 1 6 3\nusemtl red\nf 2 5 3 6\nf 1 3 4\ns off\nf 4 6 5\n"
        );
        let right = "v 2 0 0\nf 1 2 3\ns 1\nusemtl red\nf 1 3 4\ns off\n";
        let [found, expected] = [&*lines, right].map(|lines| load(format!("{SQUARE}{lines}")).unwrap());
        let triangles = |read: &ReadObj| -> Vec<(Option<String>, Vec<[Vec3; 3]>)> {
            let of_group = |group: &crate::io::obj::Group| {
                let all = (0..group.mesh.triangles.len() as u32).map(|t| corners(&group.mesh, t));
                (group.material.clone(), all.collect())
            };
            read.groups.iter().map(of_group).collect()
        };
        assert_eq!(triangles(&found), triangles(&expected), "{wrong}");
        let warnings = &found.warnings;
        let wrong = "faces with this vertex are left out";
        let [first, second] = [0, 1].map(|i| warnings.iter().filter(|w| w.contains(wrong)).nth(i).unwrap());
        let faces = warnings.iter().find(|w| w.contains("3 faces are left out")).unwrap();
        let at = |line: u32| format!(":{line}");
        assert!(first.contains(&at(6)) && second.contains(&at(7)), "{first} {second}");
        assert!(faces.contains(&at(10)), "{faces}");
        assert!(load_strictly(format!("{SQUARE}{lines}")).is_err());
        // A file without a valid face is an error.
        assert!(load(format!("{SQUARE}{wrong}\nf 1 2 5\n")).is_err());
    }
}

#[test]
fn relative_indices_count_back_from_their_line() {
    // Relative indices count back from the line of the face. Absolute indices may refer to later
    // lines.
    let file = mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 1\nf -3 -2 -1\nf 1 5 4\nv 0 0 5\n");
    assert_eq!(corners(&file, 0), [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(corners(&file, 1), [Vec3::X, Vec3::Y, Vec3::Z]);
    assert_eq!(corners(&file, 2), [Vec3::ZERO, 5.0 * Vec3::Z, Vec3::Z]);
    let error = load("f -1 -2 -3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap_err();
    assert_eq!(
        error.help.unwrap(),
        "no `v` came before this line: use a positive index"
    );
}

#[test]
fn nothing_to_render_is_an_error() {
    for text in [
        "",
        "# only a comment\n",
        SQUARE,
        "\n\n\\",
        "\u{feff}",
        "mtllib\nusemtl\ns\nv",
    ] {
        let error = load(text).unwrap_err();
        assert!(
            error.message.contains("no faces") || text.ends_with('v'),
            "{text:?}: {error}"
        );
    }
    for (text, what, remedy) in [
        (
            SQUARE.to_string(),
            "no faces in this OBJ file: the file is a point cloud of 4 vertices",
            "surface",
        ),
        ("v 0 0 0\n".into(), "a point cloud of 1 vertex", "surface"),
        (
            format!("{SQUARE}vt 0 0\nvt 0.2"),
            "the file is cut off in its last line, after 4 vertices and before the faces",
            "again",
        ),
        (
            format!("{SQUARE}vt 0 0\n"),
            "the file has only the 4 vertices of a mesh",
            "again",
        ),
        (
            format!("{SQUARE}l 1 2\nl 2 3\np 1"),
            "its 2 lines (`l`) and 1 point (`p`) are skipped",
            "--line-width",
        ),
        (
            format!("{SQUARE}p 1 2 3 4"),
            "its 4 points (`p`) are skipped",
            "--line-width",
        ),
        (
            format!("{SQUARE}cstype bezier\ndeg 1 1\nsurf 0 1 0 1 1 2 3 4\nend\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2 3 4"),
            "its 1 curve (`curv`) and 2 surfaces (`surf`) are not rendered, the first in this line",
            "convert free-form curves and surfaces to faces",
        ),
        ("o a\n".into(), "no faces in this OBJ file", "export"),
    ] {
        let error = load(&text).unwrap_err();
        assert!(error.message.contains(what), "{text:?}: {error}");
        assert!(error.help.unwrap().contains(remedy), "{text:?}");
    }
}
