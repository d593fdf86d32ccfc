//! Seeds, corpus and findings of the fuzzer: each input passes the checks of the fuzz targets.

#[path = "../../fuzz/checks.rs"]
mod checks;

use checks::FILE_KINDS;
use embrasure::scene::SceneBuilder;
use embrasure::scene_file::{SceneFile, load_scene};
use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

/// Checks all inputs of one kind of file.
fn run(name: &str) {
    let kind = FILE_KINDS.iter().find(|kind| kind.name == name).unwrap();
    let place = tempfile::tempdir().unwrap();
    (kind.furnish)(place.path());
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz");
    let inputs = ["corpus", "findings"].map(|kind| files(&root.join(kind).join(name)));
    assert!(inputs[0].len() >= 9, "{} inputs", inputs[0].len());
    for path in inputs.iter().flatten() {
        println!("{}", path.display());
        (kind.check)(place.path(), &fs::read(path).unwrap());
    }
}

#[test]
fn obj_files() {
    run("obj");
}

#[test]
fn mtl_files() {
    run("mtl");
}

#[test]
fn scene_files() {
    run("scene");
}

#[test]
fn pictures() {
    run("texture");
}

#[test]
fn environments() {
    run("environment");
}

#[test]
fn renderings() {
    run("rendering");
}

/// Reads files that are larger than the inputs of a fuzzer. A reader with quadratic time would take
/// minutes.
#[test]
#[cfg_attr(not(long), ignore = "long")]
fn long_files_take_linear_time() {
    let many = |line: &dyn Fn(usize) -> String, n: usize| (0..n).map(line).collect::<String>();
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let folder = tempfile::tempdir().unwrap();
    let load = |files: &[(&str, String)]| {
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let path = folder.path().join(files[0].0);
        let file = match path.extension().is_some_and(|e| e == "toml") {
            true => SceneFile::load(&path).unwrap(),
            false => SceneFile::of_obj(&path),
        };
        load_scene(&file, SceneBuilder::new()).unwrap()
    };

    let keys = format!("newmtl a\n{}", many(&|i| format!("key{i} 1\n"), 300_000));
    load(&[("a.obj", format!("mtllib keys.mtl\n{triangle}")), ("keys.mtl", keys)]);

    let used = many(&|i| format!("usemtl m{i}\nf 1 2 3\n"), 100_000);
    let defined = many(&|i| format!("newmtl m{i}\n"), 100_000);
    let text = format!("mtllib many.mtl\n{triangle}{used}");
    assert_eq!(
        load(&[("b.obj", text), ("many.mtl", defined)]).scene.meshes().len(),
        100_001
    );

    let object = |i| format!("[[object]]\nobj = \"c.obj\"\ntransform = {{ translate = [{i}, 0, 0] }}\n");
    let objects = many(&object, 20_000);
    let files = [
        ("d.toml", format!("version = 1\n{objects}")),
        ("c.obj", triangle.to_string()),
    ];
    assert_eq!(load(&files).scene.instances().len(), 20_000);

    let unused = many(&|i| format!("[material.m{i}]\n"), 100_000);
    let text = format!("version = 1\n[[object]]\nobj = \"c.obj\"\n{unused}");
    let loaded = load(&[("c.toml", text), ("c.obj", triangle.to_string())]);
    let named = loaded
        .warnings
        .iter()
        .filter(|w| w.text.contains("no face uses"))
        .count();
    assert_eq!(named, 101, "{:?}", loaded.warnings.last());
}
