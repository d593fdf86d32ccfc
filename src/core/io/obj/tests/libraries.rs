use super::{ObjFaces, SQUARE, load, load_file};
use crate::io::LoadOptions;
use crate::io::PartFilter;
use std::fs;
use std::path::Path;

/// Names of the materials of an OBJ file with `statements`, and the warnings about the file.
fn materials(folder: &Path, statements: &str) -> (Vec<String>, Vec<String>) {
    let path = folder.join("t.obj");
    fs::write(&path, format!("{SQUARE}{statements}\nf 1 2 3\n")).unwrap();
    let file = load_file(&path, &LoadOptions::default()).unwrap();
    let names = file.materials.into_iter().map(|found| found.material.name).collect();
    (names, file.warnings)
}

/// A folder with the files `libraries`. Each library has one material, with the name of the
/// library.
fn folder(libraries: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in libraries {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, format!("newmtl {}\nKd 1\n", name.trim_end_matches(".mtl"))).unwrap();
    }
    folder
}

#[test]
fn library_is_found_beside_file_or_in_parent_folder() {
    let all = folder(&["in/a.mtl", "in/my red.mtl", "in/my blue.mtl", "above.mtl", "in/c_d.mtl"]);
    let at = all.path().join("in");
    for (statement, names) in [
        ("mtllib models/block/a.mtl", &["in/a"][..]),
        ("mtllib C:\\Users\\me\\A.MTL", &["in/a"]),
        ("mtllib other/above.mtl", &["above"]),
        ("mtllib \"a.mtl\"", &["in/a"]),
        ("mtllib \"my red.mtl\" \"my blue.mtl\"", &["in/my red", "in/my blue"]),
        ("mtllib my red.mtl my blue.mtl", &["in/my red", "in/my blue"]),
        ("mtllib my_red.mtl a.mtl", &["in/my red", "in/a"]),
        ("mtllib c d.mtl", &["in/c_d"]),
        ("mtllib no.mtl a.mtl", &["in/a"]),
        ("mtllib huh a.mtl", &["in/a"]),
    ] {
        let (found, messages) = materials(&at, &format!("{statement}\nusemtl m"));
        assert_eq!(found, names, "{statement}");
        let is_exact = statement == "mtllib my red.mtl my blue.mtl";
        let wanted = if is_exact { 0 } else { names.len() };
        // There is at most one message for each name. There is at least one message, unless the
        // statement has the exact name.
        assert!(
            messages.len() <= wanted.max(1) && (is_exact || !messages.is_empty()),
            "{statement}: {messages:?}"
        );
        assert!(messages.iter().all(|words| words.contains("t.obj:5: ")), "{messages:?}");
    }
}

#[test]
fn name_with_blanks_has_one_message() {
    let all = folder(&["cake.mtl"]);
    for statement in ["mtllib Chocolate Cake.mtl", "mtllib Chocolate cake.mtl"] {
        let (names, told) = materials(all.path(), &format!("{statement}\nusemtl m"));
        assert_eq!(
            (names.as_slice(), told.len()),
            (&["cake".to_string()][..], 1),
            "{told:?}"
        );
        let name = statement.trim_start_matches("mtllib ");
        assert!(
            told[0].contains(&format!("`{name}` is missing; `")) && told[0].contains("cake.mtl` is used"),
            "{told:?}"
        );
    }
}

#[test]
fn library_with_name_of_obj_file_is_used() {
    let at = folder(&["t.mtl", "a.mtl"]);
    let at = at.path();
    let (names, messages) = materials(at, "mtllib typo.mtl\nmtllib gone.mtl\nusemtl t");
    assert_eq!((names.as_slice(), messages.len()), (&["t".to_string()][..], 1));
    assert!(
        messages[0].contains("t.obj:5: material library `typo.mtl` is missing; `")
            && messages[0].contains("t.mtl` is used"),
        "{messages:?}"
    );
    let (names, messages) = materials(at, "usemtl t");
    assert_eq!((names.as_slice(), messages.len()), (&["t".to_string()][..], 1));
    assert!(
        messages[0].contains("t.obj: the file names no material library; "),
        "{messages:?}"
    );
    // Without `usemtl`, the only material of the library is used.
    let (names, messages) = materials(at, "");
    assert_eq!((names.as_slice(), messages.len()), (&["t".to_string()][..], 2));
    assert!(
        messages[1].contains("no face names a material; all faces get `t`"),
        "{messages:?}"
    );
    fs::write(at.join("t.mtl"), "newmtl t\nKd 1\nnewmtl u\nKd 1\n").unwrap();
    assert!(materials(at, "").0.is_empty());
    fs::write(at.join("t.mtl"), "newmtl t\nKd 1\n").unwrap();
    // A library with the name of the OBJ file is not used if another library is found.
    assert_eq!(materials(at, "mtllib a.mtl gone.mtl\nusemtl a").0, ["a"]);
    fs::rename(at.join("t.mtl"), at.join("T.obj.mtl")).unwrap();
    assert_eq!(materials(at, "usemtl t").0, ["t"]);
}

#[test]
fn names_may_have_number_signs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mtl = "newmtl Paint #1 # one\nKd 1 0 0\nnewmtl Paint #2\nKd 0 0 1\nmap_Kd wall #2.png # of brick\nnewmtl red # the wall\nKd 1 0 0\nnewmtl #9\n";
    fs::write(at.join("my #1.mtl"), mtl).unwrap();
    let statements = "mtllib my #1.mtl # mine\nusemtl Paint #1\nf 1 2 3\nusemtl Paint #2 # two\nf 1 2 4\nusemtl red # used\nf 1 2 3 # all\nusemtl #9\n";
    let path = at.join("t.obj");
    fs::write(&path, format!("{SQUARE}{statements}\nf 1 2 3\n")).unwrap();
    let file = load_file(&path, &LoadOptions::default()).unwrap();
    let groups: Vec<_> = file
        .groups
        .iter()
        .map(|group| group.material.as_deref().unwrap())
        .collect();
    assert_eq!(groups, ["Paint #1", "Paint #2", "red", "#9"]);
    let names: Vec<_> = file
        .materials
        .iter()
        .map(|found| found.material.name.as_str())
        .collect();
    assert_eq!(names, ["Paint #1", "Paint #2", "red", "#9"]);
    let map = &file.materials[1].maps[0].statement;
    assert_eq!(
        map.names().collect::<Vec<_>>(),
        ["wall #2.png # of brick", "wall #2.png", "wall"]
    );
    assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    let defined = names.into_iter().collect();
    let faces = ObjFaces::read(&path, &PartFilter::default(), &defined).unwrap();
    let used: Vec<_> = faces.materials().iter().map(|m| m.name.as_deref().unwrap()).collect();
    assert_eq!(used, groups);
}

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
    // Statement, names of the materials, and number of warnings
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
        fs::write(&path, format!("{line}\n{SQUARE}usemtl {}\nf 1 2 3\n", names[0])).unwrap();
        let file = load_file(&path, &LoadOptions::default()).unwrap();
        let got: Vec<_> = file.materials.iter().map(|m| m.material.name.as_str()).collect();
        assert_eq!(got, names, "{line}");
        // On a system that ignores case, other case is not a warning.
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
