//! Both readers of OBJ and MTL files agree: on the scenes of the project, on all inputs of the fuzz targets, and on the files of `../shared`.

use crate::support::program::{done, folder, json, read_json, refused};
use crate::support::shared;
use embrasure::description::{SceneFile, load_scene};
use embrasure::io::{LoadOptions, ObjReader, compare_readers};
use embrasure::scene::SceneBuilder;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

fn files(folder: &Path, extension: Option<&str>) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = entries
        .flat_map(|path| {
            if path.is_dir() {
                files(&path, extension)
            } else {
                vec![path]
            }
        })
        .filter(|path| extension.is_none_or(|wanted| path.extension().is_some_and(|e| e == wanted)))
        .collect();
    files.sort();
    files
}

/// Files whose positions a render changes are compared as they are written.
#[test]
fn files_that_are_moved_are_compared_as_written() {
    let folder = folder(&[
        (
            "far.obj",
            "v 512345 5412345 430\nv 512346 5412345 430\nv 512345 5412346 431\nf 1 2 3\n",
        ),
        (
            "sides.obj",
            "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl front\nf 1 2 3\nusemtl back\nf 3 2 1\n",
        ),
        ("a.mtl", "newmtl front\nKd 0.8 0.1 0.1\nnewmtl back\nKd 0.1 0.1 0.8\n"),
    ]);
    for file in ["far.obj", "sides.obj"] {
        done(folder.path(), &["audit", "--readers", file]);
    }
}

/// Differences by kind, and those that are not explained.
#[derive(Default)]
struct Tally {
    files: usize,
    triangles: u64,
    both_refuse: usize,
    kinds: BTreeMap<&'static str, (usize, u64)>,
    unexplained: Vec<String>,
}

impl Tally {
    fn add(&mut self, path: &Path) {
        let compared = compare_readers(path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        self.files += 1;
        for file in &compared {
            self.triangles += file.triangles;
            self.both_refuse += usize::from(file.refused_by_own.is_some() && file.refused_by_tobj.is_some());
            for (kind, lines) in &file.explained.0 {
                let entry = self.kinds.entry(kind.code()).or_default();
                *entry = (entry.0 + 1, entry.1 + lines.count);
            }
            for found in &file.unexplained {
                let name = file.path.display();
                self.unexplained
                    .push(format!("{}: {name}:{}: {}", path.display(), found.line, found.message));
            }
        }
    }

    fn assert_explained(&self) {
        println!(
            "{} files, {} triangles, both refuse {}",
            self.files, self.triangles, self.both_refuse
        );
        for (kind, (files, count)) in &self.kinds {
            println!("  {kind}: {count} in {files} files");
        }
        assert!(self.unexplained.is_empty(), "{}", self.unexplained.join("\n"));
    }
}

fn project() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

#[test]
fn readers_agree_on_the_projects_files() {
    let mut tally = Tally::default();
    for name in ["scenes", "tests/faults", "docs/gallery"] {
        files(&project().join(name), Some("obj"))
            .iter()
            .for_each(|path| tally.add(path));
    }
    assert!(tally.files >= 13, "{} files", tally.files);
    tally.assert_explained();
}

/// Inputs of fuzzing are read under the names that they have there, and none of them makes the second reader panic.
#[test]
fn readers_agree_on_the_fuzz_corpus() {
    let place = tempfile::tempdir().unwrap();
    let mut tally = Tally::default();
    let inputs = |kind: &str| {
        let folders = ["corpus", "findings"].map(|folder| project().join("tests/fuzz").join(folder).join(kind));
        folders
            .iter()
            .flat_map(|folder| files(folder, None))
            .collect::<Vec<_>>()
    };
    for input in inputs("obj") {
        // The name tells which input differs.
        let path = place
            .path()
            .join(format!("{}.obj", input.file_stem().unwrap().to_string_lossy()));
        fs::copy(&input, &path).unwrap();
        tally.add(&path);
        let mut file = SceneFile::of_obj(&path);
        file.load.parameters.obj_reader = Some(ObjReader::Tobj);
        if let Err(error) = load_scene(&file, SceneBuilder::new()) {
            assert!(error.help.is_some(), "{error}");
        }
    }
    for input in inputs("mtl") {
        let name = input.file_name().unwrap().to_string_lossy().into_owned();
        let library = place.path().join(format!("{name}.lib"));
        fs::copy(&input, &library).unwrap();
        let path = place.path().join(format!("{name}.mtl.obj"));
        let text = format!("mtllib {name}.lib\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n");
        fs::write(&path, text).unwrap();
        tally.add(&path);
    }
    assert!(tally.files > 300, "{} files", tally.files);
    tally.assert_explained();
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn readers_agree_on_awkward_files_and_real_scenes() {
    let mut tally = Tally::default();
    // Files that are known to show faults are compared by the tests of these faults.
    let root = shared("scenes");
    let is_known = |path: &Path| {
        path.strip_prefix(&root)
            .is_ok_and(|p| p.to_string_lossy().starts_with("found"))
    };
    files(&root, Some("obj"))
        .iter()
        .filter(|path| !is_known(path))
        .for_each(|path| tally.add(path));
    assert!(tally.files > 100, "{} files", tally.files);
    tally.assert_explained();
}

const OBJ: &str =
    "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3 4\nusemtl blue\nf 1 2 5\n";
const MTL: &str = "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nKe 1 1 1\n";

#[test]
fn the_audit_of_readers_tells_lines_and_kinds() {
    let obj = format!("{OBJ}f 1 2 4 # triangle\n");
    let folder = folder(&[("a.obj", &obj), ("a.mtl", MTL), ("b.obj", OBJ)]);
    let at = folder.path();
    let text = |out: &Output| String::from_utf8_lossy(&out.stdout).into_owned();
    let said = text(&done(at, &["audit", "b.obj", "--readers"]));
    assert!(said.contains("b.obj: triangles compared: 3"), "{said}");
    assert!(
        said.contains("a.mtl: materials compared: 2\n2 files: 0 unexplained differences"),
        "{said}"
    );
    let out = done(at, &["audit", "a.obj", "--readers", "-o", "report.json"]);
    let said = text(&out);
    assert!(said.contains("tobj refuses it: face parse error"), "{said}");
    assert!(said.contains("explained: comment, 1 time (line 11)"), "{said}");
    let report = read_json(&at.join("report.json"));
    assert_eq!(report, json(&done(at, &["audit", "a.obj", "--readers", "--json"])));
    assert_eq!(report["files"][0]["explained"]["comment"]["lines"][0], 11);
    assert_eq!(report["unexplained"], 0);
    let said = refused(at, &["audit", "a.obj", "--readers", "--rays", "5"], 2);
    assert!(said.contains("--readers"), "{said}");
}

/// A plain scene is the same picture by both readers, and what tobj refuses says how to read it.
#[test]
fn pictures_are_the_same_by_both_readers() {
    let folder = folder(&[
        ("a.obj", OBJ),
        ("a.mtl", MTL),
        ("c.obj", &format!("{OBJ}f 1 2 4 # triangle\n")),
    ]);
    let at = folder.path();
    let render = |flags: &[&str]| {
        let args = [
            "render", "a.obj", "--spp", "2", "--size", "16x16", "-o", "x.exr", "--stats", "x.json", "-q",
        ];
        done(at, &[&args[..], flags].concat());
        read_json(&at.join("x.json"))["scene_hash"]
            .as_str()
            .unwrap()
            .to_string()
    };
    assert_eq!(render(&[]), render(&["--obj-reader", "tobj"]));
    let said = refused(at, &["render", "c.obj", "--obj-reader", "tobj", "-o", "y.exr"], 1);
    assert!(said.contains("--obj-reader own"), "{said}");
}
