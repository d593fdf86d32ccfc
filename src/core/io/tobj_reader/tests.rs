use super::*;
use crate::io::ObjReader;
use crate::io::load_obj::load_obj;
use std::fs;

fn options() -> LoadOptions {
    let mut options = LoadOptions::default();
    options.parameters.obj_reader = Some(ObjReader::Tobj);
    options
}

/// Reads an OBJ file and its library with tobj. Returns its contents and the texts of all findings.
fn load(obj: &str, mtl: &str) -> Result<(ObjFile, Vec<String>), FileError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.obj");
    fs::write(&path, obj).unwrap();
    fs::write(folder.path().join("a.mtl"), mtl).unwrap();
    let mut findings = Findings::default();
    let file = load_obj(&path, &options(), Allowance::default(), &(), &mut findings)?;
    Ok((file, findings.iter().map(ToString::to_string).collect()))
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 2\n";

#[test]
fn files_become_groups_by_material() {
    let text = format!(
        "mtllib a.mtl\n{SQUARE}usemtl red\nf 1/1/1 2/2/1 3/1/1\nusemtl blue\nf 1 2 3 4\nusemtl red\nf 2 3 4\nusemtl gone\nf 1 2 3\n"
    );
    let (file, findings) = load(&text, "newmtl red\nKd 1 0 0\nTf 0.5 0.5 0.5\nnewmtl blue\nKd 0 0 1\n").unwrap();
    let named: Vec<_> = file
        .groups
        .iter()
        .map(|g| (g.material.as_deref(), g.mesh.triangles.len()))
        .collect();
    // Faces with and without texture coordinates have groups of their own.
    let expected = [(Some("red"), 1), (Some("blue"), 2), (Some("red"), 1), (None, 1)];
    assert_eq!(named, expected);
    let red = &file.groups[0].mesh;
    assert_eq!((red.positions.len(), red.normals.len(), red.uvs.len()), (3, 3, 3));
    assert!(red.normals.iter().all(|&n| n == Vec3::Z));
    let material = &file.material("red").unwrap().material;
    assert_eq!(material.diffuse, crate::color::Spectrum::rgb(1.0, 0.0, 0.0));
    assert!(material.thin, "Tf is read too");
    assert_eq!((file.material("blue").unwrap().line, findings), (4, vec![]));
}

#[test]
fn failure_or_panic_of_tobj_is_an_error() {
    let refused = load(&format!("{SQUARE}f 1 2 3 # corner\n"), "").unwrap_err();
    assert!(
        refused.message.contains("tobj refuses this file: face parse error"),
        "{refused}"
    );
    assert!(refused.help.unwrap().contains("--obj-reader own"));
    let (_, findings) = load(&format!("mtllib a.mtl\n{SQUARE}f 1 2 3\n"), "newmtl a\nKd 0.5\n").unwrap();
    assert!(
        findings[0].contains("a.mtl: error: tobj refuses this file: it panics"),
        "{}",
        findings[0]
    );
    let (_, findings) = load(&format!("mtllib a.mtl\n{SQUARE}f 1 2 3\n"), "newmtl a\nNs -1\n").unwrap();
    assert!(
        findings[0].contains("a.mtl:1: warning: material `a`: Ns is `-1`; 0 is used"),
        "{}",
        findings[0]
    );
    let (_, findings) = load(&format!("mtllib b.mtl\n{SQUARE}f 1 2 3\n"), "").unwrap();
    assert!(
        findings[0].contains("b.mtl: warning: this material library is missing"),
        "{}",
        findings[0]
    );
    assert!(load(SQUARE, "").unwrap_err().message.contains("no faces"));
    assert!(
        load("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "")
            .unwrap_err()
            .message
            .contains("not finite")
    );
}
