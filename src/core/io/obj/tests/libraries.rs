use super::{SQUARE, load, load_file};
use crate::io::LoadOptions;
use std::fs;

#[test]
fn a_missing_library_is_a_warning() {
    let file = load(format!("{SQUARE}mtllib gone.mtl\nusemtl a\nf 1 2 3\nmtllib gone.mtl\n")).unwrap();
    assert!(
        file.warnings[0].contains("t.obj:5: material library"),
        "{}",
        file.warnings[0]
    );
    assert_eq!(file.warnings.len(), 1);
    assert_eq!(file.groups[0].material.as_deref(), Some("a"));
}

#[test]
fn libraries_are_found() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("Lib")).unwrap();
    for name in ["a.mtl", "b c.mtl", "Lib/d.mtl", "e.mtl"] {
        let material = name.trim_end_matches(".mtl");
        fs::write(folder.path().join(name), format!("newmtl {material}\nKd 1\n")).unwrap();
    }
    // Materials that come, and number of warnings
    let cases: [(&str, &[&str], usize); 7] = [
        ("mtllib a.mtl e.mtl", &["a", "e"], 0),
        ("mtllib b c.mtl", &["b c"], 0),
        ("mtllib e.mtl b\\ c.mtl", &["e", "b c"], 0),
        ("mtllib ./a.mtl\nmtllib ./a.mtl", &["a"], 0),
        ("mtllib Lib\\d.mtl a.mtl", &["Lib/d", "a"], 0),
        ("mtllib LIB\\D.mtl", &["Lib/d"], 1),
        ("mtllib a.mtl x.mtl", &["a"], 1),
    ];
    for (line, names, warnings) in cases {
        let path = folder.path().join("t.obj");
        fs::write(&path, format!("{line}\n{SQUARE}f 1 2 3\n")).unwrap();
        let file = load_file(&path, &LoadOptions::default()).unwrap();
        let got: Vec<_> = file.materials.iter().map(|m| m.material.name.as_str()).collect();
        assert_eq!(got, names, "{line}");
        // Where the system ignores case, it is not wrong.
        let expected = if folder.path().join("LIB").exists() && line.contains("LIB") {
            0
        } else {
            warnings
        };
        assert_eq!(file.warnings.len(), expected, "{line}: {:?}", file.warnings);
        assert!(
            file.warnings
                .iter()
                .all(|w| w.contains("t.obj:1: ") && w.contains("material library")),
            "{:?}",
            file.warnings
        );
    }
}
