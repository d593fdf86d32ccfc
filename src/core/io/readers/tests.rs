use super::*;
use crate::math::{Vec2, Vec3};
use std::fs;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nvn 0.1 0 1\n";

/// Compares `t.obj`, beside a library `a.mtl`, and returns the reports.
fn compared(obj: &[u8], mtl: &str, plant: &mut dyn FnMut(&mut ObjFile)) -> Vec<ComparedFile> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.obj");
    fs::write(&path, obj).unwrap();
    fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    compare(&path, &LoadOptions::default(), plant).unwrap()
}

/// Codes of what is explained in all files, and what is not.
fn found(reports: &[ComparedFile]) -> (Vec<&'static str>, Vec<(usize, String)>) {
    let codes = reports
        .iter()
        .flat_map(|r| r.explained.0.keys().map(|kind| kind.code()));
    let unexplained = reports.iter().flat_map(|r| &r.unexplained);
    let unexplained = unexplained.map(|found| (found.line, found.message.clone()));
    (codes.collect(), unexplained.collect())
}

#[test]
fn each_documented_difference_is_explained() {
    // A file, and the kinds that explain what differs
    let cases: [(&str, &[&str]); 37] = [
        ("f 1/1/2 2/2/2 3/3/2\nf 1/1/1 2/2/1 3/3/1 4/4/1", &[]),
        ("v 0.2 0.2 0\nf 1 2 3 4\nf 2 5 4 1", &["polygon-cut"]),
        ("s 1\nf 1 2 3\nv 0 0 1\nf 1 4 5", &["smoothing-group"]),
        ("s 1\nf 1 2 3 4\ns off\nf 1 2 3", &[]),
        ("f 1/1 2/2 3/3\nf 1 2 3\nf 1//1 2//2 3//1", &["mixed-corners"]),
        ("f 1/1 2 3/3\nf 1/2 2/2 3/3", &["mixed-corners"]),
        ("vn 0 0 0\nf 1//1 2//2 3//3", &["mixed-corners"]),
        (
            "vn 0 0 0\nf 1//1 2//1 3//1\nf 1//3 2//-1 3//3",
            &["mixed-corners", "bad-normal"],
        ),
        ("f 1 2 \\\n 3 4", &["continued-line"]),
        ("f 1 2 3 # corner", &["comment"]),
        ("g a # group\no b \\\n  c\nf 1 2 3", &[]),
        ("usemtl\ta\nf 1 2 3\n", &["keyword-blanks", "undefined-material"]),
        ("mtllib a.mtl\nusemtl\tred\nf 1 2 3\n", &["keyword-blanks"]),
        ("mtllib a.mtl\n  usemtl red\nf 1 2 3\n", &["keyword-blanks"]),
        ("usemtl\nf 1 2 3", &["nameless"]),
        ("mtllib A.MTL\nusemtl red\nf 1 2 3", &["library-name"]),
        ("mtllib .\\a.mtl\nusemtl red\nf 1 2 3", &["library-name"]),
        ("mtllib gone.mtl a.mtl\nusemtl red\nf 1 2 3", &["library-name"]),
        ("mtllib gone.mtl\nusemtl red\nf 1 2 3", &["undefined-material"]),
        ("mtllib b/a.mtl\nusemtl red\nf 1 2 3", &["library-name"]),
        (
            "mtllib a.mtl\nusemtl red # one\nf 1 2 3\nusemtl red\nf 2 3 4",
            &["comment"],
        ),
        ("usemtl red\nf 1 2 3\nmtllib a.mtl\nf 2 3 4", &["late-library"]),
        (
            "mtllib a.mtl\nusemtl blue\nf 1 2 3\nusemtl red\nf 2 3 4",
            &["undefined-material"],
        ),
        ("f 1 2 5\no a\nf -4 2 -2\nv 5 5 5", &["forward-reference"]),
        ("f 1 2 5\nv 5 5 5", &[]),
        ("v 2 4 6 2\nf 1 2 5", &["vertex-weight"]),
        ("v 2 4 6 1\nf 1 2 5", &[]),
        ("v 2 4 6 1 2\nf 1 2 5", &["vertex-values"]),
        ("v 2 4 6 1 1 0\nf 1 2 5", &["vertex-colour"]),
        ("vt 0.5\nf 1/5 2/1 3/1", &["short-texture-coordinate"]),
        ("vn 1.#QNAN 0 1\nf 1//3 2//3 3//3", &["bad-normal", "number-word"]),
        ("fo 1 2 3", &["fo"]),
        ("l 1 2 3 4\nl 1 2\nf 1 2 3\np 1", &["polyline"]),
        ("f\nf 1 x\nf 1 2 3", &["short-face"]),
        ("f 1/0 2/0 3/0\nf 1 2 3", &[]),
        ("f 1/1 2/0 3/1\nf 1 2 3", &["mixed-corners", "wrong-statement"]),
        ("v nan 0 0\nf 1 2 5\nf 1 2 3", &["wrong-statement"]),
    ];
    let mut failures = Vec::new();
    for (lines, expected) in cases {
        let reports = compared(
            format!("{SQUARE}{lines}\n").as_bytes(),
            "newmtl red\nKd 1 0 0\n",
            &mut |_| (),
        );
        let got = found(&reports);
        if got != (expected.to_vec(), vec![]) || reports[0].triangles == 0 {
            failures.push(format!("{lines}: {got:?}, {} triangles", reports[0].triangles));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
    let text = format!("{SQUARE}f 1 2 3\n");
    let utf16: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, expected) in [
        (format!("\u{feff}{text}").into_bytes(), "byte-order-mark"),
        (text.replace('\n', "\r").into_bytes(), "line-ends"),
        (utf16, "encoding"),
        (
            format!("{text}# gr\u{fc}n").chars().map(|c| c as u8).collect(),
            "encoding",
        ),
    ] {
        let reports = compared(&bytes, "", &mut |_| ());
        assert_eq!(found(&reports), (vec![expected], vec![]));
        assert_eq!(reports[0].triangles, 1);
    }
    // What both refuse is no difference.
    for lines in ["f 1 2 9", "v 1 2", "f a b c", "f 0 1 2"] {
        let reports = compared(format!("{SQUARE}{lines}\n").as_bytes(), "", &mut |_| ());
        assert_eq!(found(&reports), (vec![], vec![]), "{lines}");
        assert!(reports[0].refused_by_own.is_some() && reports[0].refused_by_tobj.is_some());
    }
}

#[test]
fn differences_of_libraries_are_explained() {
    let cases: [(&str, &[&str]); 19] = [
        (
            "newmtl red\nKd .7 .1 .1\nKs 0.1 0.2 0.3\nNs 10\nNi 1.5\nd 0.5\nTr 0.5\nillum 2\nKe 1 1 1\nTf 1 0.5 0\nPr 0.3",
            &[],
        ),
        (
            "newmtl red\nmap_Kd -s 2 2 wall.png\nbump -bm 0.3 b.png\nmap_Ke e.png\nnorm n.png\nmap_d d.png\nmap_Ns s.png",
            &[],
        ),
        ("newmtl red\nKd 0.5", &["grey-colour"]),
        ("newmtl red\nKd xyz 0.3 0.5 0.1", &["xyz-colour"]),
        ("newmtl red\nKe xyz 3", &["xyz-colour"]),
        ("newmtl red\nTf xyz 0.3 0.5 0.1", &[]),
        ("NEWMTL red\nkd 1 0 0", &["keyword-case"]),
        ("newmtl red\nd -halo 0.5", &["number-options"]),
        ("newmtl red\nKa spectral x.rfl", &["grey-colour"]),
        ("newmtl red\nmap_Kd a.png # wall", &["comment"]),
        ("newmtl red\nKd 1 0 0 # red", &[]),
        ("newmtl red\nKd 1 \\\n 0 0", &["continued-line"]),
        ("newmtl\nKd 1 0 0\nnewmtl red", &["nameless"]),
        ("\u{feff}newmtl red\nKd 1 0 0", &["byte-order-mark"]),
        ("newmtl red\nKd 1 0 0 0", &["wrong-statement"]),
        ("newmtl red\nNs -1", &[]),
        ("newmtl red\nillum 11", &[]),
        ("newmtl red\nmap_Ka", &["ambient"]),
        ("newmtl red\nKd 1 0 0\nKd 0 1 0\nnewmtl red\nKd 0 0 1", &[]),
    ];
    let mut failures = Vec::new();
    for (mtl, expected) in cases {
        let obj = format!("mtllib a.mtl\n{SQUARE}usemtl red\nf 1 2 3\n");
        let reports = compared(obj.as_bytes(), mtl, &mut |_| ());
        let got = found(&reports);
        if got != (expected.to_vec(), vec![]) || reports.len() != 2 {
            failures.push(format!("{mtl}: {got:?}, {} files", reports.len()));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
    // Neither reader takes a word that is not a number.
    let reports = compared(
        format!("mtllib a.mtl\n{SQUARE}f 1 2 3\n").as_bytes(),
        "newmtl a\nNs x\n",
        &mut |_| (),
    );
    assert_eq!(found(&reports), (vec![], vec![]));
}

/// A mistake of the own reader is found, with its line.
#[test]
fn planted_mistakes_are_found() {
    let text = format!("mtllib a.mtl\n{SQUARE}usemtl red\nf 1/1/1 2/2/1 3/3/2 4/4/2\nf 1/1/1 2/2/1 4/4/2\n");
    type Plant = fn(&mut ObjFile);
    let plants: [(&str, usize, Plant); 8] = [
        ("texture coordinates", 13, |file| file.groups[0].mesh.uvs.swap(0, 1)),
        ("texture coordinates", 13, |file| {
            file.groups[0].mesh.uvs[2] += Vec2::splat(1e-7)
        }),
        ("normals", 13, |file| file.groups[0].mesh.normals[3] = Vec3::X),
        ("normals", 13, |file| file.groups[0].mesh.normals.clear()),
        ("positions", 13, |file| file.groups[0].mesh.positions[1].x = 1.0000001),
        ("positions", 14, |file| file.groups[0].mesh.triangles[2].swap(0, 1)),
        ("triangles", 14, |file| _ = file.groups[0].mesh.triangles.pop()),
        ("material", 13, |file| file.groups[0].material = Some("blue".into())),
    ];
    for (what, line, plant) in plants {
        let reports = compared(text.as_bytes(), "newmtl red\nKd 1 0 0\n", &mut |file| plant(file));
        let (explained, unexplained) = found(&reports);
        let first = unexplained.first().unwrap_or_else(|| panic!("{what} is not found"));
        assert!(
            first.0 == line && first.1.contains(what),
            "{what}: line {}: {}",
            first.0,
            first.1
        );
        assert!(explained.is_empty() || what == "material", "{what}");
    }
    // A cut that turns a triangle over, or leaves a part of the polygon out
    let concave = format!("{SQUARE}v 0.2 0.2 0\nf 1 2 5 4\n");
    for wrong in [[[0, 1, 2], [1, 2, 3]], [[0, 1, 3], [0, 3, 1]]] {
        let mut plant =
            |file: &mut ObjFile| file.groups[0].mesh.triangles = wrong.map(|t| t.map(|i| i as u32)).to_vec();
        let (_, unexplained) = found(&compared(concave.as_bytes(), "", &mut plant));
        assert_eq!(unexplained.len(), 1);
    }
}

/// What looks like a comment is a part of a name that both the file and its library have.
#[test]
fn names_with_number_signs_are_the_same() {
    let obj = format!("{SQUARE}mtllib a.mtl\nusemtl Paint #1\nf 1 2 3\nusemtl Paint #2 # two\nf 2 3 4\n");
    let mtl = "newmtl Paint #1 # red\nKd 1 0 0\nnewmtl Paint #2\nKd 0 0 1\n";
    let reports = compared(obj.as_bytes(), mtl, &mut |own| {
        assert_eq!(own.groups.len(), 2);
    });
    // tobj takes the comments as parts of the names.
    assert_eq!(found(&reports), (vec!["comment", "comment"], vec![]));
    let reports = compared(obj.as_bytes(), mtl, &mut |own| {
        own.groups[1].material = Some("Paint".into())
    });
    assert!(!found(&reports).1.is_empty(), "a planted mistake");
}

#[test]
fn a_library_of_the_name_of_the_file_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("own.obj");
    std::fs::write(folder.path().join("own.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    for statement in ["", "mtllib gone.mtl\n"] {
        std::fs::write(&path, format!("{SQUARE}{statement}usemtl red\nf 1 2 3\n")).unwrap();
        let reports = compare_readers(&path, &LoadOptions::default()).unwrap();
        assert_eq!(found(&reports), (vec!["library-name"], vec![]), "{statement}");
    }
}
