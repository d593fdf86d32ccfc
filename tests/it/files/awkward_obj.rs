//! OBJ files of test suites of other loaders, and of real scenes. Each file loads with all its
//! triangles, or is refused with an error that has a line.

use crate::support::shared;
use embrasure::io::FileError;
use embrasure::scene::SceneBuilder;
use embrasure::scene_file::{LoadedScene, SceneFile, load_scene};
use std::fs;
use std::path::{Path, PathBuf};

fn obj_files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path());
    let mut files: Vec<PathBuf> = entries
        .flat_map(|p| if p.is_dir() { obj_files(&p) } else { vec![p] })
        .filter(|p| p.extension().is_some_and(|e| e == "obj"))
        .collect();
    files.sort();
    files
}

fn load(path: &Path) -> Result<LoadedScene, FileError> {
    load_scene(&SceneFile::of_obj(path), SceneBuilder::new())
}

/// Number of triangles of a loaded scene, including triangles that were skipped because they have
/// no area or repeat others.
fn triangles(loaded: &LoadedScene) -> u64 {
    let skipped = |words: &str| -> u64 {
        let of = |text: &str| text.split(words).nth(1)?.rsplit(' ').next()?.parse::<u64>().ok();
        loaded.warnings.iter().filter_map(|w| of(&w.text)).sum()
    };
    loaded.scene.triangle_count()
        + skipped("triangles without area, skipped: ")
        + skipped("triangles that repeat others at the same place, skipped: ")
}

/// Number of triangles according to the text: the sum of (corners − 2) over the `f` lines.
fn counted(path: &Path) -> u64 {
    let text = String::from_utf8_lossy(&fs::read(path).unwrap()).into_owned();
    let corners = |line: &str| {
        let mut words = line.split_whitespace().take_while(|w| !w.starts_with('#'));
        if words.next() == Some("f") {
            words.count() as u64
        } else {
            0
        }
    };
    text.lines().map(|line| corners(line).saturating_sub(2)).sum()
}

/// Loads a scene without its libraries. Each wrong statement is an error.
fn load_without_libraries(path: &Path) -> Result<LoadedScene, FileError> {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join("t.obj");
    let mut bytes = fs::read(path).unwrap();
    // Overwrite the keyword and keep the line, so that line numbers of errors stay right.
    while let Some(at) = bytes.windows(6).position(|word| word == b"mtllib") {
        bytes[at] = b'#';
    }
    fs::write(&copy, bytes).unwrap();
    let mut file = SceneFile::of_obj(&copy);
    file.load.strict = true;
    load_scene(&file, SceneBuilder::new())
}

fn assert_says_where(path: &Path, error: &FileError) {
    let no_faces = error.message.contains("no faces") && counted(path) == 0;
    assert!(error.position.is_some() || no_faces, "{}: {error}", path.display());
    assert!(error.help.is_some(), "{}: {error}", path.display());
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
fn awkward_files_load_or_fail_with_a_line() {
    let folder = shared("scenes/awkward-obj");
    let files = obj_files(&folder);
    assert!(files.len() > 70, "{} files", files.len());
    let mut loaded = 0;
    for path in &files {
        // Libraries, which are read from the folder of the file, may also be invalid. Here loading
        // must not panic, but may fail.
        let _ = load(path);
        match load_without_libraries(path) {
            Ok(scene) => {
                assert_eq!(triangles(&scene), counted(path), "{}", path.display());
                loaded += 1;
            }
            Err(error) => {
                println!("{}", error.to_string().replace("\n", " "));
                assert_says_where(path, &error);
            }
        }
    }
    println!("{loaded} of {} files load", files.len());
}

/// Test files of other loaders have a known number of triangles, or an error in a known line.
#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
fn loader_test_files_have_known_contents() {
    let folder = shared("scenes/awkward-obj");
    let cases: [(&str, Result<u64, usize>); 17] = [
        ("tinyobjloader/cube.obj", Ok(12)),
        ("tinyobjloader/cube-vertexcol.obj", Ok(12)),
        ("tinyobjloader/cube-vertex-w-component.obj", Ok(12)),
        ("tinyobjloader/issue-319-003.obj", Ok(8)),
        ("tinyobjloader/issue-330.obj", Ok(3)),
        ("tinyobjloader/leading-decimal-dot-issue-201.obj", Ok(1)),
        ("tinyobjloader/skin-weight.obj", Ok(12)),
        ("tinyobjloader/smoothing-group-two-squares.obj", Err(21)),
        ("tobj/quad.obj", Ok(5)),
        ("tobj/triangle.obj", Ok(1)),
        ("tobj/quad_colored_merge.obj", Ok(2)),
        ("rapidobj-primitives/primitives.obj", Ok(4)),
        ("rapidobj-mtllib/cube.obj", Ok(12)),
        ("tinyobjloader/invalid-relative-vertex-index.obj", Err(1)),
        ("tinyobjloader/issue-140-zero-face-idx.obj", Err(16)),
        ("tobj/invalid_index.obj", Err(12)),
        ("afl-crashers/afl-000002.obj", Err(6)),
    ];
    for (name, expected) in cases {
        let result = load_without_libraries(&folder.join(name));
        let got = result
            .as_ref()
            .map(triangles)
            .map_err(|e| e.position.map_or(0, |p| p.line));
        assert_eq!(got, expected, "{name}: {:?}", result.map(|_| ()));
    }
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn real_scenes_have_all_their_triangles() {
    let folder = shared("scenes");
    for path in obj_files(&folder) {
        let part = path.strip_prefix(&folder).unwrap_or(&path).to_string_lossy();
        if ["awkward-obj", "found"].iter().any(|kept| part.starts_with(kept)) {
            continue;
        }
        let loaded = load_without_libraries(&path).unwrap_or_else(|e| panic!("{e}"));
        println!("{}: {} triangles", path.display(), triangles(&loaded));
        assert_eq!(triangles(&loaded), counted(&path), "{}", path.display());
    }
}
