//! Recognition of the program that wrote a library, by the comments and numbers of the library and
//! by the OBJ file.

use super::*;

#[test]
fn writer_is_recognised_by_its_comment() {
    for (text, expected) in [
        (
            "# Blender 4.1.1 MTL File: 'x'\n",
            Some((MtlDialect::Blender, Some("4.1.1"), 1)),
        ),
        ("#\n# Blender MTL File: 'x'\n", Some((MtlDialect::Blender, None, 2))),
        ("# Blender3D MTL File: x.blend\n", Some((MtlDialect::Blender, None, 1))),
        (
            "\u{feff}# 3ds Max Wavefront OBJ Exporter\n",
            Some((MtlDialect::Max, None, 1)),
        ),
        (
            "\n# File produced by Open Cascade\n# SketchUp 8\n",
            Some((MtlDialect::Sketchup, None, 3)),
        ),
        ("# CINEMA 4D\n", Some((MtlDialect::Cinema4d, None, 1))),
        ("# Converted by VCGLIB\n", Some((MtlDialect::Meshlab, None, 1))),
        ("# Autodesk Maya 2019\n", Some((MtlDialect::Maya, None, 1))),
        ("# Material Count: 3\n", Some((MtlDialect::Blender, None, 1))),
        ("# Rhino\n", Some((MtlDialect::Rhino, None, 1))),
        ("# Exported from Wings 3D 2.2.9\n", Some((MtlDialect::Wings3d, None, 1))),
        ("# Created by 3dfier\n", Some((MtlDialect::Threedfier, None, 1))),
        (
            "# File produced by Open Asset Import Library (http://www.assimp.sf.net)\n# (assimp v4.1.2)\n",
            Some((MtlDialect::Assimp, None, 1)),
        ),
        // Comments at the beginning of OBJ files
        (
            "# Blender v2.79 (sub 0) OBJ File: 'a.blend'\n",
            Some((MtlDialect::Blender, Some("2.79"), 1)),
        ),
        ("# Blender 3.6.0\n", Some((MtlDialect::Blender, Some("3.6.0"), 1))),
        (
            "# Blender3D v249 OBJ File: \n",
            Some((MtlDialect::Blender, Some("2.49"), 1)),
        ),
        ("# Rhino of Sumatra, made with blender\n", None),
        ("# a blender full of soup\n# the Mayan temple\n", None),
        ("newmtl a\n# Blender 4.1.1 MTL File: 'x'\n", None),
        ("", None),
    ] {
        let found = Signature::find(text);
        let found = found.as_ref().map(|s| {
            (
                s.dialect,
                s.version.as_ref().map(|(version, _)| version.as_str()),
                s.line,
            )
        });
        assert_eq!(found, expected, "{text:?}");
    }
}

#[test]
fn exporter_of_blender_is_recognised_by_exponents() {
    let exporter = |text: &str, dialect| {
        let mut findings = Findings::default();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.mtl");
        std::fs::write(&path, text).unwrap();
        load_mtl(&path, &ObjContext::default(), in_dialect(dialect), &mut findings);
        let mut sections = Vec::new();
        for (line, statement) in statements(text) {
            let (key, rest) = split_keyword(&statement);
            match key {
                "newmtl" => sections.push(Section::new(rest, line, 1.0)),
                _ => drop(sections.last_mut().unwrap().set(&key.to_lowercase(), key, rest)),
            }
        }
        Interpretation::new(
            dialect,
            Signatures {
                library: Signature::find(text).as_ref(),
                obj: None,
            },
            &sections,
        )
        .writer
    };
    let native = |before_4| Writer::Blender(BlenderExport::Native { before_4 });
    let of = |header: &str, ns: &[f32]| {
        header.to_string()
            + &ns
                .iter()
                .map(|ns| format!("newmtl m\nNs {ns:.6}\n"))
                .collect::<String>()
    };
    for (header, ns, expected) in [
        (NATIVE_5, &[250.0][..], native(false)),
        (NATIVE_3, &[96.078_43], native(true)),
        (
            PYTHON,
            &[96.078_43, 0.0, 900.0],
            Writer::Blender(BlenderExport::Internal),
        ),
        (PYTHON, &[225.0, 96.078_43], Writer::Blender(BlenderExport::Python)),
        (PYTHON, &[0.0, 900.0], Writer::Blender(BlenderExport::Python)),
        (PYTHON, &[], Writer::Blender(BlenderExport::Python)),
        ("", &[324.0], Writer::Blender(BlenderExport::Python)),
        ("", &[250.0, 225.0], native(true)),
        ("", &[953.4], native(true)),
    ] {
        assert_eq!(
            exporter(&of(header, ns), MtlDialect::Blender),
            expected,
            "{header}{ns:?}"
        );
    }
    let meaning = |text: &str| {
        let library = Signature::find(text);
        let signatures = Signatures {
            library: library.as_ref(),
            obj: None,
        };
        Interpretation::new(MtlDialect::Auto, signatures, &[]).tr
    };
    assert_eq!(meaning("# 3ds Max\n"), TrMeaning::TransparencyFirst);
    assert_eq!(meaning("# MeshLab\n"), TrMeaning::Opacity);
    assert_eq!(meaning(""), TrMeaning::Transparency);
}

#[test]
fn writer_is_recognised_by_comment_of_obj_file() {
    let surface = blender(96.078_43, 1.0, 0.25, 1.0, 1.0, 2);
    let flat = PYTHON.to_string() + &blender(0.0, 1.0, 0.5, 1.0, 1.0, 2) + "map_Bump a.png\n";
    let slot = |obj| read_of(obj, &flat, MtlDialect::Auto).1[0][0];
    // The version of Blender determines if `map_Bump` is a height map or a normal map.
    assert_eq!(slot(None), MapSlot::Normal);
    assert_eq!(
        slot(Some("# Blender v2.79 (sub 0) OBJ File: 'a.blend'\n")),
        MapSlot::Bump
    );
    assert_eq!(
        slot(Some("# Blender v2.80 (sub 75) OBJ File: 'a.blend'\n")),
        MapSlot::Normal
    );
    // If the library has no comment, the comment of the OBJ file names the program.
    let obj = Some("# Blender v2.54 (sub 0) OBJ File: ''\n# www.blender.org\nmtllib a.mtl\n");
    let (materials, _, messages) = read_of(obj, &surface, MtlDialect::Auto);
    assert_eq!(materials[0].gloss, Gloss::Metallic(0.0));
    assert!(
        messages[0].contains("t.mtl:1: written by Blender 2.54, as its OBJ file says; "),
        "{messages:?}"
    );
    // A library written by hand is read literally. If a library has a comment, the comment decides
    // its dialect, not the OBJ file.
    for by_hand in ["newmtl m\nKd 0.2\nKs 0.5\nNs 30\n", "newmtl m\nKs 0.9\nillum 3\n"] {
        let (materials, _, messages) = read_of(obj, by_hand, MtlDialect::Auto);
        assert_eq!((&materials[0], messages.len()), (&auto(by_hand), 0));
    }
    let (_, _, messages) = read_of(obj, "# Rhino\nnewmtl m\nKd 0.2\nKs 0.5\nNs 30\n", MtlDialect::Auto);
    assert!(messages[0].contains("written by Rhino; "), "{messages:?}");
    let rhino = read_of(Some("# Rhino\n"), "newmtl m\nKd 0.2\nKs 0.5\nNs 30\n", MtlDialect::Auto);
    assert_eq!(rhino.0[0].gloss, Gloss::Metallic(0.0));
}
